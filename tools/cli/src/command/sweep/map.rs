//! `trueup sweep map`: what runs came to, over two factors, as a page.

use std::collections::BTreeSet;

use trueup_cosim::{Kind as Sort, Memory};
use trueup_report::{Page, Tile, Tiles, number};
use trueup_sweep::{Beside, Design, Done, Kind, Runner, Sweep, Take, Value, done};

use super::{TELL, beside, damaged, failed};
use crate::args::Map;
use crate::error::Error;
use crate::output::{say, write};
use crate::stages::Stages;

/// A tile without a text of one of the columns.
const NO_TEXT: &str = "·";

pub(super) fn map(args: &Map) -> Result<(), Error> {
    let mut runner = Runner::open(&args.file).map_err(failed)?;
    let what = look(&runner)?;
    let others = args.beside.as_ref().map(|file| Beside::read(file, runner.sweep(), runner.design()));
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

fn look(runner: &Runner) -> Result<What, Error> {
    let Sweep { file, kind, factors, outputs, .. } = runner.sweep();
    let wrong = |why: &str| Error::Failed(format!("{}: {why}", file.display()));
    if !matches!(kind, Kind::Grid | Kind::List) {
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
fn courses(runner: &mut Runner, done: &Done) -> Courses {
    let mut all =
        Courses { outputs: Vec::new(), lines: Vec::new(), span: [f64::INFINITY, f64::NEG_INFINITY] };
    let (mut stages, mut told): (Option<Stages>, _) = (None, std::time::Instant::now());
    let count = done.records.len();
    for (at, record) in done.records.iter().enumerate() {
        let mut memory = Memory::default();
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
fn discrete(sweep: &Sweep, memory: &Memory) -> Vec<usize> {
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

fn page(runner: &Runner, what: &What, done: &Done, courses: &Courses, others: Option<&Beside>) -> String {
    let (sweep, design) = (runner.sweep(), runner.design());
    let units = runner.units();
    let (factor_units, output_units) = units.split_at(sweep.factors.len());
    let named = |f: usize, run: u64| {
        let (value, unit) = (shown(&design.value(f, run)), &factor_units[f].1);
        format!("{} = {value}{}{unit}", sweep.factors[f].name, if unit.is_empty() { "" } else { " " })
    };
    let levels = what.axes.map(|f| levels(design, f));
    let mut panels: Vec<String> = Vec::new();
    let mut columns = Vec::new();
    let told: Vec<usize> = (0..sweep.outputs.len()).filter(|o| *o != what.outcome).collect();
    for o in &told {
        columns.push([sweep.outputs[*o].name.clone(), output_units[*o].1.clone()]);
    }
    // The line of what it would have come to stands first.
    let variable = &sweep.outputs[what.outcome].variable;
    let mut lines: Vec<usize> = (0..courses.outputs.len()).collect();
    lines.sort_by_key(|l| sweep.outputs[courses.outputs[*l]].variable != *variable);
    let kind = |value: f64| what.kinds.iter().position(|k| k.0 as f64 == value);
    let tile = |(at, record): (usize, &trueup_sweep::Record)| {
        let run = record.run;
        let panel = what.apart.iter().map(|f| named(*f, run)).collect::<Vec<_>>().join(", ");
        let panel = panels.iter().position(|p| *p == panel).unwrap_or_else(|| {
            panels.push(panel);
            panels.len() - 1
        });
        let place = |axis: usize| {
            let value = design.value(what.axes[axis], run);
            levels[axis].iter().position(|l| *l == value).unwrap_or_default()
        };
        let values = record.result.as_ref().map(Vec::as_slice).unwrap_or_default();
        let texts = others.map(|o| (o, &o.texts[at]));
        let remark = match (&record.result, texts) {
            (Err(why), _) => format!("Failed: {why}"),
            (_, Some((o, texts))) => {
                let said = o.columns.iter().zip(texts).filter(|(_, t)| !t.is_empty());
                said.map(|(c, t)| format!("{c}: {t}")).collect::<Vec<_>>().join(", ")
            }
            _ => String::new(),
        };
        let course = |l: &usize| {
            let of = &courses.lines[at][*l];
            let kinds = sweep.outputs[courses.outputs[*l]].variable == *variable;
            let shown = |v: f64| if kinds { kind(v).map_or(0.0, |k| k as f64 + 1.0) } else { v };
            of.iter().map(|(t, v)| (*t, shown(*v))).collect()
        };
        let all: Vec<String> = (0..sweep.factors.len()).map(|f| named(f, run)).collect();
        Tile {
            name: format!("run {run}, {}", all.join(", ")),
            panel,
            at: [place(0), place(1)],
            kind: values.get(what.outcome).copied().flatten().and_then(kind),
            mark: texts.map(|(_, texts)| mark(texts)).unwrap_or_default(),
            remark,
            values: told.iter().map(|o| values.get(*o).copied().flatten()).collect(),
            lines: lines.iter().map(course).collect(),
        }
    };
    let tiles: Vec<Tile> = done.records.iter().enumerate().map(tile).collect();
    let kinds: Vec<String> = what.kinds.iter().map(|k| k.1.clone()).collect();
    let shown_levels = levels.map(|l| l.iter().map(shown).collect::<Vec<_>>());
    let axis = |k: usize| [sweep.factors[what.axes[k]].name.as_str(), factor_units[what.axes[k]].1.as_str()];
    let names: Vec<String> = lines.iter().map(|l| sweep.outputs[courses.outputs[*l]].name.clone()).collect();
    let stem = sweep.file.file_stem().unwrap_or_default().to_string_lossy();
    let lead = format!("{} runs of {}.", tiles.len(), sweep.system.display());
    let mut page = Page::new(&format!("Map of {stem}"), &lead);
    page.section(
        "Map",
        &format!(
            "Each tile is a run, its colour what the run came to. Choose one with a click or the arrow keys: below stand its numbers and \
             its time line, what it would have come to had it ended then, and when each of the others was true. \
             trueup sweep {} --run N repeats run N with all that it records.",
            sweep.file.display()
        ),
    );
    page.tiles(&Tiles {
        title: &sweep.outputs[what.outcome].name,
        x: axis(0),
        y: axis(1),
        levels: [&shown_levels[0], &shown_levels[1]],
        kinds: &kinds,
        panels: &panels,
        columns: &columns,
        lines: &names,
        span: courses.span,
        tiles: &tiles,
    });
    page.section("What the colours mean", "");
    let count = |k: usize| tiles.iter().filter(|t| t.kind == Some(k)).count().to_string();
    let rows =
        what.kinds.iter().enumerate().map(|(k, (_, name, text))| vec![name.clone(), text.clone(), count(k)]);
    page.table(&[&sweep.outputs[what.outcome].name, "meaning", "runs"], &rows.collect::<Vec<_>>());
    if let Some(others) = others {
        compare(&mut page, others, &kinds, &tiles);
    }
    page.finish()
}

/// How often which of ours stands beside which of theirs.
fn compare(page: &mut Page, others: &Beside, kinds: &[String], tiles: &[Tile]) {
    let text = format!(
        "What others say of the same runs, as it was handed over: it decides nothing here. In the tiles: {}. Number of runs:",
        others.columns.join(" / ")
    );
    page.section("Beside it", &text);
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
fn levels(design: &Design, factor: usize) -> Vec<Value> {
    let mut all: Vec<Value> = Vec::new();
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

fn as_number(value: &Value) -> Option<f64> {
    match value {
        Value::Number(x) => Some(*x),
        Value::Integer(n) => Some(*n as f64),
        Value::Boolean(_) | Value::Text(_) => None,
    }
}

fn shown(value: &Value) -> String {
    // Rounding has left of 0 what no axis should show.
    as_number(value).map_or_else(|| value.text(), |x| number(if x.abs() < 1e-12 { 0.0 } else { x }))
}
