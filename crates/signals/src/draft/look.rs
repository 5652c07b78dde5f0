//! A log before anything is known of it: its columns, and which of them is the clock.

use std::path::{Path, PathBuf};

use super::lerobot;
use super::words::{NameMeaning, Quantity};
use crate::finding::{Finding, FindingKind};
use crate::names::short;
use crate::read::{ReadTable, TableColumn, plain_table, row_rate};
use crate::unit::SignalUnit;

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LogColumn {
    pub(super) name: String,
    pub(super) meaning: NameMeaning,
    /// As the file gives it.
    pub(super) unit: Option<String>,
    /// Largest size, and from the least to the largest value.
    pub(super) most: f64,
    pub(super) span: f64,
    /// All values are whole numbers.
    pub(super) whole: bool,
    /// Cells that are text.
    pub(super) words: bool,
}

/// The column that is the clock.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DraftClock {
    pub(super) name: String,
    /// To be written; `None`: the file gives it, or it is s or a date.
    pub(super) unit: Option<String>,
    pub(super) guess: Option<String>,
    /// Rows a second, where the clock is coarser than the rows.
    pub(super) rate: Option<f64>,
}

/// A log.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LookedLog {
    pub(super) file: PathBuf,
    pub(super) columns: Vec<LogColumn>,
    pub(super) clock: Option<DraftClock>,
    /// Other columns that count time, in agreement with the clock.
    pub(super) clocks: Vec<String>,
}

/// Words of counters that are no clocks.
const COUNTERS: [&str; 5] = ["frame", "index", "seq", "counter", "episode"];

/// Reads a file, of several episodes each as a log of its own: `file.parquet#0`, `file.parquet#1`. `named` is the clock as the user
/// names it.
pub(super) fn look(file: &Path, named: Option<&str>, findings: &mut Vec<Finding>) -> Vec<LookedLog> {
    let Some(mut table) = plain_table(file, findings) else { return Vec::new() };
    lerobot::label(file, &mut table);
    let parquet = file.extension().is_some_and(|e| e == "parquet");
    let numbers = if parquet { table.episodes() } else { Vec::new() };
    if numbers.len() < 2 {
        return look_at(file, &table, named, findings).into_iter().collect();
    }
    let mut logs = Vec::new();
    for n in numbers {
        let name = PathBuf::from(format!("{}#{n}", file.display()));
        logs.extend(table.clone().episode(n).ok().and_then(|own| look_at(&name, &own, named, findings)));
    }
    logs
}

fn look_at(
    file: &Path,
    table: &ReadTable,
    named: Option<&str>,
    findings: &mut Vec<Finding>,
) -> Option<LookedLog> {
    let mut clocks: Vec<usize> = (0..table.columns.len()).filter(|i| is_clock(table, *i)).collect();
    if let Some(name) = named {
        let Some(at) = table.names().position(|n| n == name) else {
            let what = format!("there is no column `{name}`");
            let mend = format!("name one of {}", list(table.names()));
            findings.push(Finding::error(FindingKind::NoTime, file, what, mend));
            return None;
        };
        clocks = vec![at];
    } else if let Some(at) = table.names().position(|n| n == "time") {
        // The name that a recording's clock has.
        clocks.retain(|i| *i != at);
        clocks.insert(0, at);
    } else {
        // The finer one first.
        clocks.sort_by_key(|i| std::cmp::Reverse(distinct(&table.columns[*i].values)));
    }
    let (clock, others) = match clocks.split_first() {
        None => {
            if let Some(wrong) = table.columns.iter().find_map(|c| back(file, c, table)) {
                findings.push(wrong);
                return None;
            }
            (None, Vec::new())
        }
        Some((first, others)) => {
            let own = &table.columns[*first];
            let differs = others.iter().find(|i| !agree(&own.values, &table.columns[**i].values));
            if let (Some(other), false) = (differs, own.name == "time") {
                let other = &table.columns[*other].name;
                let what =
                    format!("there are two clocks, `{}` and `{other}`, and they do not agree", own.name);
                let mend = format!("name the one by which the readings were taken: --time {}", own.name);
                findings.push(Finding::error(FindingKind::NoTime, file, what, mend));
                return None;
            }
            let others = others.iter().map(|i| table.columns[*i].name.clone()).collect();
            (Some(clock(table, *first)), others)
        }
    };
    let column = |(i, c): (usize, &TableColumn)| {
        let finite = || c.values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let any = low <= high;
        (Some(i) != clocks.first().copied()).then(|| LogColumn {
            name: c.name.clone(),
            meaning: NameMeaning::of(&c.name, c.label.as_deref()),
            unit: c.unit.clone(),
            most: if any { high.abs().max(low.abs()) } else { 0.0 },
            span: if any { high - low } else { 0.0 },
            whole: any && finite().all(|x| x.fract() == 0.0),
            words: c.words > 0 || !any,
        })
    };
    let columns = table.columns.iter().enumerate().filter_map(column).collect();
    Some(LookedLog { file: file.into(), columns, clock, clocks: others })
}

fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let names: Vec<_> = names.take(12).map(|n| format!("`{n}`")).collect();
    names.join(", ")
}

fn distinct(values: &[f64]) -> usize {
    values.windows(2).filter(|w| w[0] != w[1]).count()
}

/// A column that never goes back, of a name that is one of a time, or a time by its type.
fn is_clock(table: &ReadTable, i: usize) -> bool {
    let c = &table.columns[i];
    let meaning = NameMeaning::of(&c.name, None);
    let counter = meaning.rest.iter().any(|w| COUNTERS.contains(&w.as_str()));
    let grows = c.values.windows(2).all(|w| w[1] >= w[0]) && c.values.first() < c.values.last();
    let of_time = c
        .unit
        .as_deref()
        .and_then(SignalUnit::parse)
        .is_some_and(|u| u.exponents == SignalUnit::SECOND.exponents);
    let named = meaning.quantity == Some(Quantity::Time) || (of_time && meaning.quantity.is_none());
    let dates = named && c.words > 0 && c.words == c.values.len();
    !counter && (c.ticks.is_some() || (named && grows) || dates)
}

/// A column with the name of a clock that does not go on.
fn back(file: &Path, c: &TableColumn, table: &ReadTable) -> Option<Finding> {
    let named = NameMeaning::of(&c.name, None).quantity == Some(Quantity::Time);
    let at = c.values.windows(2).position(|w| w[1] < w[0]).filter(|_| named)?;
    let what = format!(
        "the clock `{}` jumps back from {} to {}",
        c.name,
        short(c.values[at]),
        short(c.values[at + 1])
    );
    let mend = "sort the rows, or cut the file there: two runs are two recordings";
    Some(Finding::error(FindingKind::ClockBack, file, what, mend).line(table.line(at + 1)))
}

/// One is a line over the other, up to a step.
fn agree(a: &[f64], b: &[f64]) -> bool {
    let n = a.len().min(b.len());
    let (Some(first), Some(last)) = (a.first(), a.get(n.saturating_sub(1))) else { return true };
    let slope = (b[n - 1] - b[0]) / (last - first);
    // The coarser one may be late by its own step.
    let longest = |t: &[f64], scale: f64| t.windows(2).map(|w| (w[1] - w[0]) * scale).fold(0.0, f64::max);
    let step = longest(b, 1.0).max(longest(a, slope));
    let near = |(x, y): (&f64, &f64)| (b[0] + slope * (x - first) - y).abs() <= step;
    slope.is_finite() && a.iter().zip(b).all(near)
}

/// Its unit: of the file, of the name, or by the size of its steps.
fn clock(table: &ReadTable, i: usize) -> DraftClock {
    let c = &table.columns[i];
    let mut own = DraftClock { name: c.name.clone(), unit: None, guess: None, rate: None };
    let mut steps: Vec<f64> = c.values.windows(2).map(|w| w[1] - w[0]).filter(|h| *h > 0.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    // What counts from the beginning of 1970 is recognised by the reader.
    let unix = c.ticks.is_some() || c.words > 0 || c.values.first().is_some_and(|t| *t >= 1e9);
    let named = NameMeaning::of(&c.name, None).unit.or_else(|| {
        let last = c.name.rsplit('_').next().unwrap_or("");
        matches!(last, "ms" | "us" | "ns").then(|| last.to_owned())
    });
    let per = |unit: &str| SignalUnit::parse(unit).map_or(1.0, |u| u.factor);
    let mut factor = c.unit.as_deref().map_or(1.0, per);
    match named {
        Some(unit) if c.unit.is_none() && !unix => {
            factor = per(&unit);
            own.unit = (factor != 1.0).then_some(unit);
        }
        None if c.unit.is_none() && !unix => {
            let guess = match usual {
                h if h >= 1e5 => Some("ns"),
                h if h >= 1e3 => Some("us"),
                h if h >= 1.0 => Some("ms"),
                _ => None,
            };
            if let Some(unit) = guess {
                factor = per(unit);
                own.guess = Some(format!("rows are {} apart: taken as {unit}", short(usual)));
                own.unit = Some(unit.into());
            }
        }
        _ => {}
    }
    let rows = c.values.len();
    let coarse = rows > 2 && distinct(&c.values) * 2 < rows;
    let rate = row_rate(&c.values).filter(|_| coarse).map(|rate| rate / factor);
    own.rate = rate.filter(|r| *r > 0.0).map(|rate| format!("{rate:.2e}").parse().unwrap_or(rate));
    own
}
