//! The time of a table.

mod calendar;

use std::path::Path;

use super::sidecar::Sidecar;
use super::table::{ClockTicks, ReadTable, TableColumn, unit_of};
use crate::finding::{Finding, FindingKind, MAX_REPORTED};
use crate::names::short;
use crate::outlier::LARGEST;
use crate::recording::Recording;
use crate::unit::SignalUnit;

/// A recording covers at most so many usual steps a row. Resampling to even steps takes memory for all that it covers:
/// this keeps that in proportion to what was recorded. Dropouts take a few, samples on change some dozens.
const COVERS: f64 = 50.0;

/// What a table is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ClockUse {
    /// To be taken as it is.
    Look,
    /// To be compared with a simulation: its rows have to cover it.
    Recording,
    /// To drive a simulation: a few corners may represent all of it.
    Drive,
}

/// Times in s, one for each row; the same one twice is a jump.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ClockColumn {
    pub(super) time: Vec<f64>,
    /// What time 0 is, in s since the beginning of 1970, where the file counts from there.
    pub(super) epoch: Option<f64>,
}

/// Takes the time out of the table.
pub(super) fn take(
    file: &Path,
    table: &mut ReadTable,
    sidecar: &Sidecar,
    rate: Option<f64>,
    wanted: ClockUse,
    findings: &mut Vec<Finding>,
) -> Option<ClockColumn> {
    let before = findings.len();
    let at = table.columns.iter().position(|c| sidecar.variable(&c.name).as_deref() == Some("time"));
    let clock = match (at, rate) {
        (Some(at), _) => {
            let column = table.columns.remove(at);
            read(file, &column, table, sidecar, findings)?
        }
        (None, Some(_)) => ClockColumn::default(),
        (None, None) => {
            findings.push(missing(file, table));
            return None;
        }
    };
    let ClockColumn { time, epoch } = clock;
    let rows = table.columns.first().map_or(time.len(), |c| c.values.len());
    if let Some(rate) = rate {
        let start = time.first().copied().filter(|t| t.is_finite()).unwrap_or(0.0);
        let even: Vec<f64> = (0..rows).map(|row| start + row as f64 / rate).collect();
        findings.extend(evened(file, rate, &time, &even));
        check(file, &even, table, wanted, findings);
        return (!findings[before..].iter().any(Finding::is_error))
            .then_some(ClockColumn { time: even, epoch });
    }
    check(file, &time, table, wanted, findings);
    let fails = |findings: &[Finding]| findings[before..].iter().any(Finding::is_error);
    if wanted == ClockUse::Recording && !fails(findings) {
        findings.extend(jump(file, &time, table));
    }
    (!fails(findings)).then_some(ClockColumn { time, epoch })
}

fn missing(file: &Path, table: &ReadTable) -> Finding {
    let likely = ["t", "Time", "TIME", "timestamp", "Timestamp", "time_s", "times", "sec"];
    let near = table.names().find(|n| likely.contains(n));
    let first = table.names().next().unwrap_or("");
    let mend = match near {
        Some(n) => {
            format!("rename `{n}` to `time`, or write under [columns] of case.toml: \"{n}\" = \"time\"")
        }
        None => format!(
            "the first column is `{first}`: name the one with the time in s `time`; rows that are evenly spaced need none, give their `rate` (Hz) in the sidecar"
        ),
    };
    Finding::error(FindingKind::NoTime, file, "there is no column `time`", mend)
}

/// The clock as its column gives it: seconds, a unit's counts, dates, Unix times.
fn read(
    file: &Path,
    column: &TableColumn,
    table: &ReadTable,
    sidecar: &Sidecar,
    findings: &mut Vec<Finding>,
) -> Option<ClockColumn> {
    let said = sidecar.column(&column.name);
    let unit = match said.and_then(|c| c.unit.clone()).or_else(|| unit_of(column)) {
        Some((_, unit)) if unit.exponents == [0, 0, 1, 0, 0, 0, 0] => Some(unit),
        Some((text, _)) => {
            let (place, line) = said.map_or((file, Some(1)), |c| (c.file.as_path(), Some(c.line)));
            let what = format!("`{text}` is no unit of time");
            findings.push(Finding::error(FindingKind::Unit, place, what, "write s, ms or us").line(line));
            return None;
        }
        None => None,
    };
    let scaled = said.is_some_and(|c| c.scale.is_some() || c.offset != 0.0);
    if let Some(said) =
        said.filter(|c| (scaled || c.unit.is_some()) && (column.words > 0 || column.ticks.is_some()))
    {
        let what = format!("`{}` holds times with a unit of their own", column.name);
        let mend = "take `scale`, `offset` and `unit` out";
        findings.push(Finding::error(FindingKind::Unit, &said.file, what, mend).line(said.line));
        return None;
    }
    let (ticks, counted) = if let Some(ticks) = &column.ticks {
        (Some(ticks.clone()), String::new())
    } else if column.words > 0 {
        match calendar::dates(column) {
            Ok(ticks) => (Some(ticks), String::new()),
            Err(row) => {
                // Among numbers it is a word that is at fault, not that the others are no dates.
                let numbers = column.values.iter().any(|t| t.is_finite());
                let word = |row: &usize| column.values[*row].is_nan() && !column.texts[*row].is_empty();
                let row = (0..column.texts.len()).find(word).filter(|_| numbers).unwrap_or(row);
                let what = match numbers {
                    true => format!("{:?} is no number", column.texts[row]),
                    false => format!("{:?} is neither a number nor a date", column.texts[row]),
                };
                let mend = "write the time in s, or as 2024-03-01T12:00:00.000Z";
                let finding = Finding::error(FindingKind::NotANumber, file, what, mend).line(table.line(row));
                findings.push(finding.channel(&column.name));
                return None;
            }
        }
    } else if scaled {
        (None, String::new())
    } else {
        let unix = calendar::unix(column, unit.map(|u| u.factor));
        unix.map_or((None, String::new()), |(ticks, name)| (Some(ticks), name))
    };
    match ticks {
        Some(ticks) if ticks.of_epoch => {
            findings.extend(of_epoch(file, &column.name, &ticks, &counted));
            Some(ClockColumn { time: ticks.since_first(), epoch: ticks.first().map(|(seconds, _)| seconds) })
        }
        Some(_) => Some(ClockColumn { time: column.values.clone(), epoch: None }),
        None => {
            let unit = unit.unwrap_or(SignalUnit::ONE);
            let value = |t: &f64| said.map_or(*t, |c| c.value(*t));
            Some(ClockColumn {
                time: column.values.iter().map(|t| unit.to_si(value(t))).collect(),
                epoch: None,
            })
        }
    }
}

fn of_epoch(file: &Path, name: &str, ticks: &ClockTicks, counted: &str) -> Option<Finding> {
    let (_, date) = ticks.first()?;
    let unit = if counted.is_empty() { String::new() } else { format!(" in {counted}") };
    let what = format!("the clock shows Unix time{unit}: it is counted from the first row, {date}");
    let mend = "nothing, if that is meant; else name the unit or the scale of this column in the sidecar";
    Some(Finding::note(FindingKind::TimeUnit, file, what, mend).channel(name))
}

/// What replaces a clock that is not used.
fn evened(file: &Path, rate: f64, shown: &[f64], even: &[f64]) -> Option<Finding> {
    let (first, last) = (even.first()?, even.last()?);
    let shows = match (shown.first(), shown.last()) {
        (Some(a), Some(b)) => {
            format!(", where the clock's column goes from {} s to {} s", short(*a), short(*b))
        }
        _ => String::new(),
    };
    let what = format!(
        "rows are evenly spaced at {} Hz: from {} s to {} s{shows}",
        short(rate),
        short(*first),
        short(*last)
    );
    Some(Finding::note(FindingKind::TimeSpan, file, what, "correct `rate`, if that is not so"))
}

/// A gap so long that the rows do not cover what they span.
fn jump(file: &Path, time: &[f64], table: &ReadTable) -> Option<Finding> {
    if let Some(row) = time.iter().position(|t| t.abs() > LARGEST) {
        let finding = Finding::error(
            FindingKind::TimeSpan,
            file,
            "no clock shows that",
            "correct it, or remove the row",
        );
        return Some(finding.line(table.line(row)).time(time[row]));
    }
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let mut sorted: Vec<f64> = steps.iter().copied().filter(|h| *h > 0.0).collect();
    sorted.sort_unstable_by(f64::total_cmp);
    let usual = *sorted.get(sorted.len() / 2)?;
    let covered = steps.iter().sum::<f64>() / usual;
    if covered <= COVERS * time.len() as f64 {
        return None;
    }
    let longest = (0..steps.len()).max_by(|a, b| steps[*a].total_cmp(&steps[*b]))?;
    let what = format!(
        "the clock jumps from {} s to {} s where {} s is usual: {} rows do not cover that",
        time[longest],
        time[longest + 1],
        short(usual),
        time.len()
    );
    let mend = "correct the time, or cut the file there: two runs are two recordings";
    let finding = Finding::error(FindingKind::TimeSpan, file, what, mend).line(table.line(longest + 1));
    Some(finding.time(time[longest + 1]))
}

/// The same of a channel that was sampled in a burst.
pub(super) fn bursts(run: &Recording, rows: usize) -> Option<Finding> {
    let step = |c: &crate::Channel| c.median_step().unwrap_or(f64::INFINITY);
    let finest = run.channels.iter().min_by(|a, b| step(a).total_cmp(&step(b)))?;
    if run.duration() / step(finest) <= COVERS * rows as f64 {
        return None;
    }
    let what = format!(
        "a sample every {} s, in a recording of {} s with {rows} rows",
        short(step(finest)),
        short(run.duration())
    );
    let mend = "thin it out to the rate of the other channels, or cut the recording to where it was sampled";
    Some(Finding::error(FindingKind::TimeSpan, &run.file, what, mend).channel(&finest.name))
}

fn check(file: &Path, time: &[f64], table: &ReadTable, wanted: ClockUse, findings: &mut Vec<Finding>) {
    let mut wrong = 0;
    let mut last: Option<f64> = None;
    for (row, &t) in time.iter().enumerate() {
        let (kind, what, mend) = match last {
            _ if !t.is_finite() => {
                let what = format!("the time of row {} is missing or not finite", row + 1);
                (FindingKind::MissingTime, what, "remove the row")
            }
            Some(before) if t < before => (
                FindingKind::ClockBack,
                format!("the clock jumps back from {before} s to {t} s"),
                "sort the rows, or cut the file there: two runs are two recordings",
            ),
            _ => {
                last = Some(t);
                continue;
            }
        };
        // After a jump the clock goes on from where it landed.
        if t.is_finite() {
            last = Some(t);
        }
        wrong += 1;
        if wrong <= MAX_REPORTED {
            let line = table.line(row);
            let finding = Finding::error(kind, file, what, mend).line(line);
            findings.push(if t.is_finite() { finding.time(t) } else { finding });
        }
    }
    if wrong > MAX_REPORTED {
        let what = format!("so it is in {wrong} of {} rows", time.len());
        findings.push(Finding::error(
            FindingKind::MissingTime,
            file,
            what,
            "look at how the time was written",
        ));
    }
    if time.is_empty() {
        let mend = "export the recording again";
        findings.push(Finding::error(FindingKind::EmptyFile, file, "there is no row", mend));
    }
    if wrong == 0 {
        findings.extend(repeats(file, time, table, wanted));
    }
}

/// Rows per unit of time of a clock that is coarser than its rows. From the first to the last row at which it goes on: the rows
/// before and behind are no whole step of it. `None`: it goes on once at most.
pub(crate) fn row_rate(time: &[f64]) -> Option<f64> {
    let goes_on = |k: &usize| time[*k] != time[*k - 1];
    let first = (1..time.len()).find(goes_on)?;
    let last = (1..time.len()).rfind(goes_on)?;
    Some((last - first) as f64 / (time[last] - time[first])).filter(|rate| rate.is_finite())
}

/// A time that two rows share is a jump; one that more share is none, nor are jumps at most of a recording's times: such a clock is
/// coarser than its rows.
fn repeats(file: &Path, time: &[f64], table: &ReadTable, wanted: ClockUse) -> Option<Finding> {
    let shared: Vec<&[f64]> = time.chunk_by(|a, b| a == b).collect();
    let most = shared.iter().enumerate().max_by_key(|(k, rows)| (rows.len(), usize::MAX - k))?.0;
    let repeated = shared.iter().filter(|rows| rows.len() > 1).count();
    let begin = |group: usize| shared[..group].iter().map(|rows| rows.len()).sum::<usize>();
    if shared[most].len() > 2 || wanted == ClockUse::Recording && 2 * repeated >= shared.len() && repeated > 0
    {
        let (t, rows) = (shared[most][0], shared[most].len());
        let about = |rate: f64| format!(" (they are about {} a second)", short(rate.round()));
        let guess = row_rate(time).map(about).unwrap_or_default();
        let what = format!(
            "the clock repeats {t} s: {rows} rows share it, and {repeated} of {} times are shared",
            shared.len()
        );
        let mend = format!(
            "if the rows are evenly spaced{guess}, write their rate in Hz: `rate = N` in the sidecar, or under [recordings] of case.toml; else remove the rows that repeat"
        );
        let finding = Finding::error(FindingKind::ClockRepeats, file, what, mend);
        return Some(finding.line(table.line(begin(most) + 1)).time(t));
    }
    let first = shared.iter().position(|rows| rows.len() == 2)?;
    let more = if repeated > 1 { format!(", and {} more times", repeated - 1) } else { String::new() };
    let what =
        format!("two rows have this time{more}: a jump, from the first one's values to the second one's");
    let finding = Finding::note(
        FindingKind::Jump,
        file,
        what,
        "nothing, if that is meant; else remove one of the rows",
    );
    Some(finding.line(table.line(begin(first) + 1)).time(shared[first][0]))
}
