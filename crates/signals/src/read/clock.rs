//! The time of a table.

use std::path::Path;

use super::sidecar::Sidecar;
use super::{TOLD, Table};
use crate::finding::{Finding, Kind};
use crate::names::short;
use crate::outlier::LARGEST;
use crate::recording::Recording;
use crate::unit::Unit;

/// A recording covers at most so many usual steps a row. Whoever brings it to even steps takes memory for all that it covers:
/// this keeps that in proportion to what was recorded. Dropouts take a few, samples on change some dozens.
const COVERS: f64 = 50.0;

/// Takes the time out of the table, in s. Where it is `bounded`, for a simulation, it has to be covered by the rows.
pub(super) fn take(
    file: &Path,
    table: &mut Table,
    sidecar: &Sidecar,
    bounded: bool,
    findings: &mut Vec<Finding>,
) -> Option<Vec<f64>> {
    let at = table.names.iter().position(|n| sidecar.variable(n).as_deref() == Some("time"));
    let Some(at) = at else {
        let likely = ["t", "Time", "TIME", "timestamp", "Timestamp", "time_s", "time [s]", "times", "sec"];
        let near = table.names.iter().find(|n| likely.contains(&n.as_str()));
        let first = table.names.first().map_or("", String::as_str);
        let mend = match near {
            Some(n) => {
                format!("rename `{n}` to `time`, or write in the sidecar: [columns] \"{n}\" = \"time\"")
            }
            None => format!("the first column is `{first}`: name the one with the time in s `time`"),
        };
        findings.push(Finding::error(Kind::NoTime, file, "there is no column `time`", mend));
        return None;
    };
    let name = table.names.remove(at);
    let mut time = table.columns.remove(at);
    if let Some(column) = sidecar.column(&name) {
        let unit = match &column.unit {
            Some((_, unit)) if unit.exponents == [0, 0, 1, 0, 0, 0, 0] => *unit,
            Some((text, _)) => {
                let what = format!("`{text}` is no unit of time");
                findings.push(
                    Finding::error(Kind::Unit, &sidecar.file, what, "write s, ms or us").line(column.line),
                );
                return None;
            }
            None => Unit::ONE,
        };
        for t in &mut time {
            *t = unit.to_si(column.value(*t));
        }
    }
    let before = findings.len();
    check(file, &time, table, findings);
    if bounded && findings.len() == before {
        findings.extend(jump(file, &time, table));
    }
    (findings.len() == before).then_some(time)
}

/// A gap so long that the rows do not cover what they span.
fn jump(file: &Path, time: &[f64], table: &Table) -> Option<Finding> {
    if let Some(row) = time.iter().position(|t| t.abs() > LARGEST) {
        let finding =
            Finding::error(Kind::TimeSpan, file, "no clock shows that", "correct it, or remove the row");
        return Some(finding.line(table.line(row)).time(time[row]));
    }
    let steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    let mut sorted = steps.clone();
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
    let finding = Finding::error(Kind::TimeSpan, file, what, mend).line(table.line(longest + 1));
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
    Some(Finding::error(Kind::TimeSpan, &run.file, what, mend).channel(&finest.name))
}

fn check(file: &Path, time: &[f64], table: &Table, findings: &mut Vec<Finding>) {
    let mut wrong = 0;
    let mut last: Option<f64> = None;
    for (row, &t) in time.iter().enumerate() {
        let (kind, what, mend) = match last {
            _ if !t.is_finite() => {
                let what = format!("the time of row {} is missing or not finite", row + 1);
                (Kind::MissingTime, what, "remove the row")
            }
            Some(before) if t == before => {
                (Kind::ClockRepeats, format!("the clock repeats {t} s"), "remove one of the rows")
            }
            Some(before) if t < before => (
                Kind::ClockBack,
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
        if wrong <= TOLD {
            let line = table.line(row);
            let finding = Finding::error(kind, file, what, mend).line(line);
            findings.push(if t.is_finite() { finding.time(t) } else { finding });
        }
    }
    if wrong > TOLD {
        let what = format!("so it is in {wrong} of {} rows", time.len());
        findings.push(Finding::error(Kind::MissingTime, file, what, "look at how the time was written"));
    }
    if time.is_empty() {
        let mend = "export the recording again";
        findings.push(Finding::error(Kind::EmptyFile, file, "there is no row", mend));
    }
}
