//! One channel alone.

use crate::finding::{Finding, FindingKind, Severity};
use crate::names::short;
use crate::quantum::Quantum;
use crate::recording::{Channel, Interpolation, Recording};
use crate::variable::{SignalVariable, VariableRole};

/// A gap is a dropout from so many median steps on.
const GAP: f64 = 5.0;
/// Least number of samples of a plateau that may be clipping.
const PLATEAU: usize = 5;

pub(super) fn check(run: &Recording, c: &Channel, known: &[SignalVariable], findings: &mut Vec<Finding>) {
    let variable = known.iter().find(|v| v.name == c.name);
    let Some((low, high)) = c.range() else { return };
    if low == high {
        if c.len() > 1 {
            // At rest an unused input is 0 all along, and rightly so.
            let idle = low == 0.0 && variable.is_some_and(|v| v.role == VariableRole::Input);
            let what = format!("the value is {low} all along");
            let mend = "look whether the sensor was connected, or leave the column out";
            let severity = if idle { Severity::Note } else { Severity::Warning };
            let finding = Finding::warning(FindingKind::Constant, &run.file, what, mend).channel(&c.name);
            findings.push(Finding { severity, ..finding });
        }
        return;
    }
    let driven =
        variable.is_some_and(|v| v.role == VariableRole::Input) || c.interpolation == Interpolation::Hold;
    let tell = |f: Finding| f.channel(&c.name);
    let quantum = Quantum::of(&c.values);
    findings.extend(size(run, variable, low, high).map(tell));
    findings.extend(gaps(run, c).map(tell));
    findings.extend(clipped(run, c, low, high, quantum.least).map(tell));
    if !driven {
        findings.extend(stuck(run, c, known, high - low).map(tell));
        findings.extend(resolution(run, c, &quantum).map(tell));
    }
}

/// Values that the variable can hardly have.
fn size(run: &Recording, variable: Option<&SignalVariable>, low: f64, high: f64) -> Option<Finding> {
    let v = variable?;
    let unit = if v.unit.is_empty() { String::new() } else { format!(" {}", v.unit) };
    let mend = format!(
        "if the file is in another unit, declare it in the sidecar: [columns] {} = {{ unit = \"...\" }}",
        v.name
    );
    let warn =
        |what: String| Some(Finding::warning(FindingKind::UnitSuspicion, &run.file, what, mend.clone()));
    if let Some(min) = v.min.filter(|m| low < *m) {
        return warn(format!("values down to {low}{unit}, below the least sensible one, {min}{unit}"));
    }
    if let Some(max) = v.max.filter(|m| high > *m) {
        return warn(format!("values up to {high}{unit}, above the largest sensible one, {max}{unit}"));
    }
    let nominal = v.nominal.filter(|n| *n > 0.0)?;
    let ratio = low.abs().max(high.abs()) / nominal;
    (!(1e-4..=1e3).contains(&ratio))
        .then(|| warn(format!("values of {low} to {high}{unit}, where about {nominal}{unit} is usual")))?
}

fn gaps(run: &Recording, c: &Channel) -> Option<Finding> {
    let step = c.median_step()?;
    let gaps: Vec<_> = c.time.windows(2).filter(|w| w[1] - w[0] > GAP * step).collect();
    let longest = gaps.iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))?;
    let what = format!(
        "{} gap{} in the samples, the longest of {} s where {} s is usual",
        gaps.len(),
        if gaps.len() == 1 { "" } else { "s" },
        short(longest[1] - longest[0]),
        short(step)
    );
    let mend = "nothing is compared there; an input goes on by its interpolation: look whether that is right";
    Some(Finding::warning(FindingKind::Dropout, &run.file, what, mend).time(longest[0]))
}

/// Runs of equal values: first index and length.
fn runs(values: &[f64]) -> impl Iterator<Item = (usize, usize)> {
    let mut start = 0;
    values.chunk_by(|a, b| a == b).map(move |run| {
        let at = start;
        start += run.len();
        (at, run.len())
    })
}

/// Plateaus at an extreme that are entered and left steeply: the top of a smooth or quantised motion is not.
fn clipped(run: &Recording, c: &Channel, low: f64, high: f64, quantum: f64) -> Option<Finding> {
    let x = &c.values;
    // A signal that is made of steps, a command, may stay where it is.
    let repeated = x.windows(2).filter(|w| w[0] == w[1]).count();
    let steps = x.windows(2).filter(|w| (w[0] - w[1]).abs() > 3.0 * quantum).count();
    if steps == 0 {
        return None;
    }
    let steep = |i: usize, j: usize| (x[i] - x[j]).abs() > 3.0 * quantum;
    let plateau = |(i, n): &(usize, usize)| {
        let (before, after) = (i.checked_sub(1), i + n);
        (x[*i] == high || x[*i] == low)
            && *n >= PLATEAU
            && before.is_none_or(|b| steep(*i, b))
            && (after == x.len() || steep(after - 1, after))
    };
    let all: Vec<_> = runs(x).filter(plateau).collect();
    let samples: usize = all.iter().map(|(_, n)| n).sum();
    let elsewhere = repeated.saturating_sub(samples - all.len());
    if all.is_empty() || elsewhere * 5 >= x.len() {
        return None;
    }
    let sides: Vec<_> = [low, high].into_iter().filter(|v| all.iter().any(|(i, _)| x[*i] == *v)).collect();
    let values = sides.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and ");
    let what = format!("{samples} samples in {} runs are at the extreme {values}: clipped", all.len());
    let mend = "widen the range of the amplifier or sensor, or cut the recording";
    Some(Finding::warning(FindingKind::Clipped, &run.file, what, mend).time(c.time[all[0].0]))
}

/// A reading that freezes and comes back with a jump, or freezes while another one moves.
fn stuck(run: &Recording, c: &Channel, known: &[SignalVariable], range: f64) -> Option<Finding> {
    let x = &c.values;
    let mut steps: Vec<f64> = x.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).collect();
    steps.sort_unstable_by(f64::total_cmp);
    // Of the steps that are usual, a large one.
    let usual = *steps.get(steps.len() * 9 / 10)?;
    let long = (x.len() / 100).max(20);
    let (at, n) = runs(x).filter(|(_, n)| *n >= long).find(|(i, n)| {
        let jumps = |next: &f64| (next - x[*i]).abs() > (10.0 * usual).max(0.05 * range);
        x.get(i + n).is_some_and(jumps) || others_move(run, c, known, [c.time[*i], c.time[i + n - 1]])
    })?;
    let (start, end) = (c.time[at], c.time[at + n - 1]);
    let what = format!("the reading stays at {} from {start} s to {end} s although the system moves", x[at]);
    let mend = "leave these cells empty, or cut the recording";
    Some(Finding::warning(FindingKind::Stuck, &run.file, what, mend).time(start))
}

/// Whether another output goes over half its range meanwhile. An input may: a slow ramp moves nothing for a while.
fn others_move(run: &Recording, c: &Channel, known: &[SignalVariable], [from, to]: [f64; 2]) -> bool {
    let output = |o: &&Channel| known.iter().any(|v| v.name == o.name && v.role == VariableRole::Output);
    run.channels.iter().filter(|o| o.name != c.name).filter(output).any(|o| {
        let inside = o.time.partition_point(|t| *t < from)..o.time.partition_point(|t| *t <= to);
        let part = Channel::new("", "", o.time[inside.clone()].to_vec(), o.values[inside].to_vec());
        match (part.range(), o.range()) {
            (Some((a, b)), Some((low, high))) => b - a > 0.5 * (high - low),
            _ => false,
        }
    })
}

/// The steps that are seen against those that are declared.
fn resolution(run: &Recording, c: &Channel, q: &Quantum) -> Option<Finding> {
    let step = q.least;
    let stepped = q.regular && q.has_many_values() && q.repeats(c.len());
    let finding = match c.sensor.resolution.filter(|r| *r > 0.0) {
        Some(declared) if stepped && step > 1.5 * declared => Finding::warning(
            FindingKind::Quantisation,
            &run.file,
            format!(
                "the reading goes in steps of {}, declared is a resolution of {}",
                short(step),
                short(declared)
            ),
            format!("write resolution = {}", short(step)),
        ),
        Some(declared) if q.has_many_values() && step > 0.0 && step < 0.5 * declared => Finding::warning(
            FindingKind::Quantisation,
            &run.file,
            format!(
                "the reading has steps of {}, finer than the declared resolution of {}",
                short(step),
                short(declared)
            ),
            "correct the resolution, or its unit",
        ),
        // Digits of a text are no counts: they are far finer than the signal.
        None if stepped && step > 1e-4 * c.range().map_or(0.0, |(low, high)| high - low) => Finding::note(
            FindingKind::Quantisation,
            &run.file,
            format!("the reading goes in steps of {}", short(step)),
            format!("write [channels.\"{}\"] resolution = {}", c.name, short(step)),
        ),
        _ => return None,
    };
    Some(finding)
}
