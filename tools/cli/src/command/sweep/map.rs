//! `trueup sweep map`: what runs came to, over two factors, as a page.

use std::collections::BTreeSet;

use trueup_cosim::{ColumnKind as Sort, SeriesMemory};
use trueup_report::{Page, Tile, Tiles, number};
use trueup_sweep::{
    FactorValue, FinishedSweep, RunNotes, RunRecord, Runner, SweepDesign, SweepFile, SweepKind, Take, done,
};

use super::common::{TELL, beside, damaged, failed};
use crate::args::ReportMap;
use crate::error::CliError;
use crate::output::{say, write};
use crate::stages::Stages;

/// A tile without a text of one of the columns.
const NO_TEXT: &str = "·";

pub(super) fn map(args: &ReportMap) -> Result<(), CliError> {
    let mut runner = Runner::open(&args.file).map_err(failed)?;
    let what = look(&runner)?;
    let others = args.beside.as_ref().map(|file| RunNotes::read(file, runner.sweep(), runner.design()));
    let others = others.transpose().map_err(failed)?;
    let done = done(&runner).map_err(failed)?;
    damaged(&done.damage, "its run is there from another line");
    let courses = courses(&mut runner, &done);
    let page = page(&runner, &what, &done, &courses, others.as_ref());
    let to = args.output.clone().unwrap_or_else(|| beside(&args.file, ".html"));
    write(&to, page.as_bytes())?;
    say(&format!("{}: {} runs\n", to.display(), done.records.len()))
}

/// What is drawn.
struct What {
    /// Factors along x and y.
    axes: [usize; 2],
    /// Factors of which each combination is a map of its own.
    apart: Vec<usize>,
    /// The output that colours.
    outcome: usize,
    /// Its kinds: number, name, description.
    kinds: Vec<(i64, String, String)>,
}

fn look(runner: &Runner) -> Result<What, CliError> {
    let SweepFile { file, kind, factors, outputs, .. } = runner.sweep();
    let wrong = |why: &str| CliError::Failed(format!("{}: {why}", file.display()));
    if !matches!(kind, SweepKind::Grid | SweepKind::List) {
        return Err(wrong("a map has rows and columns; let the design be a grid or a list"));
    }
    let n = factors.len();
    if n < 2 {
        return Err(wrong("a map is over two factors, and there is one; vary another one, too"));
    }
    let colours = |o: &trueup_sweep::Output| o.take == Take::Final && !runner.items(o).is_empty();
    let mend = "no output is the last value of an enumeration, which would colour the map; keep one, as \
                `outcome = { variable = \"scene.outcome\" }`";
    let outcome = outputs.iter().position(colours).ok_or_else(|| wrong(mend))?;
    let items = runner.items(&outputs[outcome]).iter();
    let kinds = items.map(|i| (i.value, i.name.clone(), i.description.clone())).collect();
    // The last factor changes fastest.
    Ok(What { axes: [n - 1, n - 2], apart: (0..n - 2).collect(), outcome, kinds })
}

/// When the variables that are no real numbers changed, of each run.
struct Courses {
    /// Outputs that have one, by their place.
    outputs: Vec<usize>,
    /// By run and output.
    lines: Vec<Vec<Vec<(f64, f64)>>>,
    span: [f64; 2],
}

/// Runs all of them once more: logs have numbers, not courses.
fn courses(runner: &mut Runner, done: &FinishedSweep) -> Courses {
    let mut all =
        Courses { outputs: Vec::new(), lines: Vec::new(), span: [f64::INFINITY, f64::NEG_INFINITY] };
    let (mut stages, mut told): (Option<Stages>, _) = (None, std::time::Instant::now());
    let count = done.records.len();
    for (at, record) in done.records.iter().enumerate() {
        let mut memory = SeriesMemory::default();
        // Why it failed is in its record.
        let _ = runner.run_into(record.run, &mut memory);
        if let (Some(a), Some(b)) = (memory.time().first(), memory.time().last()) {
            all.span = [all.span[0].min(*a), all.span[1].max(*b)];
        }
        if all.outputs.is_empty() {
            all.outputs = discrete(runner.sweep(), &memory);
        }
        let outputs = &runner.sweep().outputs;
        let series = all.outputs.iter().map(|o| memory.column(&outputs[*o].variable).unwrap_or_default());
        all.lines.push(series.map(|values| changes(memory.time(), values)).collect());
        if told.elapsed() >= TELL {
            told = std::time::Instant::now();
            let part = (at + 1) as f64 / count as f64;
            stages.get_or_insert_with(Stages::new).tell(part, &format!("{} of {count} time lines", at + 1));
        }
    }
    all
}

/// Outputs, one of each variable, whose variables are Boolean, whole or items.
fn discrete(sweep: &SweepFile, memory: &SeriesMemory) -> Vec<usize> {
    let mut seen = BTreeSet::new();
    let is = |name: &str| {
        let column = memory.columns().iter().find(|c| c.name == name);
        column.is_some_and(|c| matches!(c.kind, Sort::Boolean | Sort::Integer | Sort::Unsigned))
    };
    let outputs = sweep.outputs.iter().enumerate();
    outputs.filter(|(_, o)| is(&o.variable) && seen.insert(o.variable.as_str())).map(|(k, _)| k).collect()
}

/// When a series takes which value; of values at the same time the last one.
fn changes(time: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let mut all: Vec<(f64, f64)> = Vec::new();
    for (t, v) in time.iter().zip(values) {
        if all.last().is_some_and(|(before, _)| before == t) {
            all.pop();
        }
        if all.last().is_none_or(|(_, before)| before != v) {
            all.push((*t, *v));
        }
    }
    all
}

/// The tiles, and what their places and numbers mean.
struct Drawn {
    tiles: Vec<Tile>,
    /// Names of the maps, one for each combination of the factors apart.
    panels: Vec<String>,
    /// Values along x and y.
    levels: [Vec<FactorValue>; 2],
    /// Outputs whose numbers are shown below, by their place.
    told: Vec<usize>,
    /// Outputs with a time line, by their place: first that of what a run would have come to.
    lines: Vec<usize>,
}

fn draw(
    runner: &Runner,
    what: &What,
    done: &FinishedSweep,
    courses: &Courses,
    others: Option<&RunNotes>,
) -> Drawn {
    let (sweep, design) = (runner.sweep(), runner.design());
    let outputs = &sweep.outputs;
    let units = runner.units();
    let named = |f: usize, run: u64| {
        let (value, unit) = (shown(&design.value(f, run)), &units[f].1);
        format!("{} = {value}{}{unit}", sweep.factors[f].name, if unit.is_empty() { "" } else { " " })
    };
    let colours = |o: usize| outputs[o].variable == outputs[what.outcome].variable;
    let mut order: Vec<usize> = (0..courses.outputs.len()).collect();
    order.sort_by_key(|l| !colours(courses.outputs[*l]));
    let mut drawn = Drawn {
        tiles: Vec::with_capacity(done.records.len()),
        panels: Vec::new(),
        levels: what.axes.map(|f| levels(design, f)),
        told: (0..outputs.len()).filter(|o| *o != what.outcome).collect(),
        lines: order.iter().map(|l| courses.outputs[*l]).collect(),
    };
    let kind = |value: f64| what.kinds.iter().position(|k| k.0 as f64 == value);
    for (at, record) in done.records.iter().enumerate() {
        let run = record.run;
        let panel = what.apart.iter().map(|f| named(*f, run)).collect::<Vec<_>>().join(", ");
        if !drawn.panels.contains(&panel) {
            drawn.panels.push(panel.clone());
        }
        let place = |axis: usize| {
            let value = design.value(what.axes[axis], run);
            drawn.levels[axis].iter().position(|l| *l == value).unwrap_or_default()
        };
        let values = record.result.as_ref().map(Vec::as_slice).unwrap_or_default();
        let course = |l: &usize| {
            // A time line of kinds has 0 where there is none of them.
            let height = |v: f64| {
                if colours(courses.outputs[*l]) { kind(v).map_or(0.0, |k| k as f64 + 1.0) } else { v }
            };
            courses.lines[at][*l].iter().map(|(t, v)| (*t, height(*v))).collect()
        };
        let all: Vec<String> = (0..sweep.factors.len()).map(|f| named(f, run)).collect();
        drawn.tiles.push(Tile {
            name: format!("run {run}, {}", all.join(", ")),
            panel: drawn.panels.iter().position(|p| *p == panel).unwrap_or_default(),
            at: [place(0), place(1)],
            kind: values.get(what.outcome).copied().flatten().and_then(kind),
            mark: others.map(|o| mark(&o.texts[at])).unwrap_or_default(),
            remark: remark(record, others.map(|o| (o, &o.texts[at][..]))),
            values: drawn.told.iter().map(|o| values.get(*o).copied().flatten()).collect(),
            lines: order.iter().map(course).collect(),
        });
    }
    drawn
}

/// Why a run failed, else what others say of it.
fn remark(record: &RunRecord, others: Option<(&RunNotes, &[String])>) -> String {
    if let Err(why) = &record.result {
        return format!("Failed: {why}");
    }
    let Some((others, texts)) = others else { return String::new() };
    let said = others.columns.iter().zip(texts).filter(|(_, t)| !t.is_empty());
    said.map(|(c, t)| format!("{c}: {t}")).collect::<Vec<_>>().join(", ")
}

fn page(
    runner: &Runner,
    what: &What,
    done: &FinishedSweep,
    courses: &Courses,
    others: Option<&RunNotes>,
) -> String {
    let sweep = runner.sweep();
    let units = runner.units();
    let (factor_units, output_units) = units.split_at(sweep.factors.len());
    let drawn = draw(runner, what, done, courses, others);
    let tiles = &drawn.tiles;
    let name = |o: &usize| sweep.outputs[*o].name.clone();
    let columns: Vec<_> = drawn.told.iter().map(|o| [name(o), output_units[*o].1.clone()]).collect();
    let lines: Vec<String> = drawn.lines.iter().map(name).collect();
    let kinds: Vec<String> = what.kinds.iter().map(|k| k.1.clone()).collect();
    let levels = drawn.levels.each_ref().map(|l| l.iter().map(shown).collect::<Vec<_>>());
    let axis = |k: usize| [sweep.factors[what.axes[k]].name.as_str(), factor_units[what.axes[k]].1.as_str()];
    let stem = sweep.file.file_stem().unwrap_or_default().to_string_lossy();
    let lead = format!("{} runs of {}.", tiles.len(), sweep.system.display());
    let mut page = Page::new(&format!("Map of {stem}"), &lead);
    page.section(
        "Map",
        &format!(
            "Each tile is a run, its colour what the run came to. Choose one with a click or the arrow keys: its numbers are shown below, with \
             its time line, what it would have come to had it ended then, and when each of the others was true. \
             trueup sweep {} --run N repeats run N with all that it records.",
            sweep.file.display()
        ),
    );
    page.tiles(&Tiles {
        title: &sweep.outputs[what.outcome].name,
        x: axis(0),
        y: axis(1),
        levels: [&levels[0], &levels[1]],
        kinds: &kinds,
        panels: &drawn.panels,
        columns: &columns,
        lines: &lines,
        span: courses.span,
        tiles,
    });
    page.section("What the colours mean", "");
    let count = |k: usize| tiles.iter().filter(|t| t.kind == Some(k)).count().to_string();
    let rows =
        what.kinds.iter().enumerate().map(|(k, (_, name, text))| vec![name.clone(), text.clone(), count(k)]);
    page.table(&[&sweep.outputs[what.outcome].name, "meaning", "runs"], &rows.collect::<Vec<_>>());
    if let Some(others) = others {
        compare(&mut page, others, &kinds, tiles);
    }
    page.finish()
}

/// How often each of ours is paired with each of theirs.
fn compare(page: &mut Page, others: &RunNotes, kinds: &[String], tiles: &[Tile]) {
    let text = format!(
        "Results of others for the same runs, as given in their file; they change nothing here. In the tiles: {}. Number of runs:",
        others.columns.join(" / ")
    );
    page.section("Comparison", &text);
    let mut columns: Vec<(usize, &str)> = Vec::new();
    for c in 0..others.columns.len() {
        let said: BTreeSet<&str> =
            others.texts.iter().map(|t| t[c].as_str()).filter(|t| !t.is_empty()).collect();
        columns.extend(said.into_iter().map(|t| (c, t)));
    }
    let head: Vec<String> = columns.iter().map(|(c, t)| format!("{}: {t}", others.columns[*c])).collect();
    let head: Vec<&str> = std::iter::once("ours").chain(head.iter().map(String::as_str)).collect();
    let row = |(k, name): (usize, &String)| {
        let count = |(c, text): &(usize, &str)| {
            let both = tiles.iter().zip(&others.texts).filter(|(t, o)| t.kind == Some(k) && o[*c] == *text);
            both.count().to_string()
        };
        std::iter::once(name.clone()).chain(columns.iter().map(count)).collect::<Vec<_>>()
    };
    let rows = kinds.iter().enumerate().filter(|(k, _)| tiles.iter().any(|t| t.kind == Some(*k)));
    page.table(&head, &rows.map(row).collect::<Vec<_>>());
}

fn mark(texts: &[String]) -> String {
    if texts.iter().all(String::is_empty) {
        return String::new();
    }
    let shown = texts.iter().map(|t| if t.is_empty() { NO_TEXT } else { t.as_str() });
    shown.collect::<Vec<_>>().join("/")
}

/// The values that a factor takes: numbers ascending, others in the order of the runs.
fn levels(design: &SweepDesign, factor: usize) -> Vec<FactorValue> {
    let mut all: Vec<FactorValue> = Vec::new();
    for value in (1..=design.runs()).map(|run| design.value(factor, run)) {
        if !all.contains(&value) {
            all.push(value);
        }
    }
    if let Some(mut numbers) =
        all.iter().map(|v| Some((as_number(v)?, v.clone()))).collect::<Option<Vec<_>>>()
    {
        numbers.sort_by(|a, b| a.0.total_cmp(&b.0));
        return numbers.into_iter().map(|(_, v)| v).collect();
    }
    all
}

fn as_number(value: &FactorValue) -> Option<f64> {
    match value {
        FactorValue::Number(x) => Some(*x),
        FactorValue::Integer(n) => Some(*n as f64),
        FactorValue::Boolean(_) | FactorValue::Text(_) => None,
    }
}

fn shown(value: &FactorValue) -> String {
    // Rounding has left of 0 what no axis should show.
    as_number(value).map_or_else(|| value.text(), |x| number(if x.abs() < 1e-12 { 0.0 } else { x }))
}
