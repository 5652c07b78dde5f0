//! Wild readings: single ones that no motion explains. They are left out in the intake, once for all who read a case.
//!
//! Nothing is squared, and what is compared are medians: a reading of any size is found, however large.

use std::path::Path;

use crate::finding::{Finding, FindingKind};
use crate::names::short;
use crate::quantum::Quantum;
use crate::recording::{Channel, Interpolation, Recording};
use crate::variable::{SignalVariable, VariableRole};

/// Larger than any quantity in SI. Fourth powers of what is left have finite sums.
pub(crate) const LARGEST: f64 = 1e30;
/// Half the window of the Hampel identifier, in samples.
const HALF: usize = 5;
/// A reading is an outlier from so many robust standard deviations of its neighbourhood, and of the noise.
const STANDS_OUT: f64 = 8.0;
/// A few in a row, or one of an input, are wild where they are beyond so many times what nearly all others span: more than
/// sensors resolve. A slip from rest is not, nor is the blow of a hammer.
const BEYOND: f64 = 1e6;
/// The same of a motor that drives the plant all along.
const PULSE: f64 = 100.0;
/// A span of so many times the noise is a signal.
const SIGNAL: f64 = 20.0;
/// What happens in more than one of so many readings is no outlier.
const RARE: usize = 20;

/// Removes wild readings from every channel, and reports it.
pub(crate) fn leave_out(run: &mut Recording, known: &[SignalVariable], findings: &mut Vec<Finding>) {
    let file = run.file.clone();
    for c in &mut run.channels {
        let variable = known.iter().find(|v| v.name == c.name);
        let driven =
            variable.is_some_and(|v| v.role == VariableRole::Input) || c.interpolation == Interpolation::Hold;
        let mut wild: Vec<usize> = (0..c.len()).filter(|i| c.values[*i].abs() > LARGEST).collect();
        if wild.len() * RARE > c.len() {
            let i = wild[0];
            let what = format!("values up to {}: no quantity is as large", short(c.values[i]));
            let mend = "correct the export, or the `scale` or `unit` of the sidecar";
            findings.push(
                Finding::error(FindingKind::BadValue, &file, what, mend).channel(&c.name).time(c.time[i]),
            );
            continue;
        }
        let motor = variable.is_some_and(|v| v.drives);
        let found = if driven { pulses(&c.values, motor) } else { spikes(&c.values) };
        let new = |list: Vec<usize>| list.into_iter().filter(|i| !wild.contains(i)).collect::<Vec<_>>();
        let (more, stay) = (new(found.out), new(found.stay));
        if (wild.len() + more.len()) * RARE <= c.len() {
            wild.extend(more);
            wild.sort_unstable();
        } else {
            findings.push(spike(&file, c, &more, "too many to be left out"));
        }
        if !stay.is_empty() {
            findings.push(spike(&file, c, &stay, "in a row, which are not left out"));
        }
        if !wild.is_empty() {
            findings.push(spike(&file, c, &wild, "left out"));
            let keep = |i: &usize| wild.binary_search(i).is_err();
            let kept: Vec<usize> = (0..c.len()).filter(keep).collect();
            c.time = kept.iter().map(|i| c.time[*i]).collect();
            c.values = kept.iter().map(|i| c.values[*i]).collect();
        }
    }
}

fn spike(file: &Path, c: &Channel, found: &[usize], done: &str) -> Finding {
    let x = &c.values;
    let off = |i: usize| {
        let near = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|j| x.get(j));
        near.map(|y| (x[i] - y).abs()).fold(f64::INFINITY, f64::min)
    };
    let worst = found.iter().copied().max_by(|a, b| off(*a).total_cmp(&off(*b))).unwrap_or(0);
    let (n, s) = (found.len(), if found.len() == 1 { "" } else { "s" });
    let shown = |i: Option<usize>| i.and_then(|i| x.get(i)).map_or("the end".to_owned(), |x| short(*x));
    let (before, after) = (shown(worst.checked_sub(1)), shown(Some(worst + 1)));
    let what = format!("{n} spike{s}, such as {} between {before} and {after}: {done}", short(x[worst]));
    let mend = "leave these cells empty if the sensor was wrong";
    Finding::warning(FindingKind::Spike, file, what, mend).channel(&c.name).time(c.time[worst])
}

/// Outliers: to be left out, or only reported.
#[derive(Default)]
struct OutlierReadings {
    out: Vec<usize>,
    stay: Vec<usize>,
}

/// How far each reading is from the median of its neighbourhood, and the median deviation there.
fn apart(x: &[f64]) -> impl Iterator<Item = (usize, f64, f64)> {
    let mut window = Vec::with_capacity(2 * HALF + 1);
    (0..x.len()).map(move |i| {
        let begin = i.saturating_sub(HALF).min(x.len() - 2 * HALF - 1);
        window.clear();
        window.extend_from_slice(&x[begin..=begin + 2 * HALF]);
        let centre = median(&mut window);
        window.iter_mut().for_each(|y| *y = (*y - centre).abs());
        (i, (x[i] - centre).abs(), median(&mut window))
    })
}

/// Noise as second differences show it, motion all but removed.
fn noise(x: &[f64]) -> f64 {
    let mut second: Vec<f64> = x.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    1.4826 * median(&mut second) / 6f64.sqrt()
}

/// What nine tenths of the readings span.
fn span(x: &[f64]) -> f64 {
    let mut sorted = x.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let at = |share: usize| sorted.get((sorted.len() * share / 20).min(sorted.len() - 1)).copied();
    at(19).zip(at(1)).map_or(0.0, |(high, low)| high - low)
}

/// Runs of neighbours among increasing indices.
fn neighbours(found: &[(usize, f64)]) -> impl Iterator<Item = &[(usize, f64)]> {
    found.chunk_by(|a, b| a.0 + 1 == b.0)
}

/// Hampel's identifier: a reading far from the median of its neighbourhood, measured by their median deviation.
fn spikes(x: &[f64]) -> OutlierReadings {
    let mut all = OutlierReadings::default();
    if x.len() < 4 * HALF {
        return all;
    }
    let least = (STANDS_OUT * noise(x)).max(4.0 * Quantum::of(x).least);
    let far = apart(x).filter(|(_, off, deviation)| *off > least && *off > STANDS_OUT * 1.4826 * deviation);
    let found: Vec<(usize, f64)> = far.map(|(i, off, _)| (i, off)).collect();
    let span = span(x);
    for run in neighbours(&found) {
        let beyond = span > 0.0 && run.iter().all(|(_, off)| *off > BEYOND * span);
        let list = if run.len() == 1 || beyond { &mut all.out } else { &mut all.stay };
        list.extend(run.iter().map(|f| f.0));
    }
    all
}

/// Single readings of an input that no amplifier makes; of what is no motor, that no sensor reads.
fn pulses(x: &[f64], motor: bool) -> OutlierReadings {
    let mut all = OutlierReadings::default();
    if x.len() < 4 * HALF {
        return all;
    }
    let span = span(x);
    let least = if motor && span > SIGNAL * noise(x) { PULSE * span } else { BEYOND * span };
    if least > 0.0 {
        let found: Vec<(usize, f64)> =
            apart(x).filter(|(_, off, _)| *off > least).map(|(i, off, _)| (i, off)).collect();
        all.out = neighbours(&found).filter(|run| run.len() <= 2).flatten().map(|f| f.0).collect();
    }
    all
}

pub(crate) fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn swing(n: usize) -> Vec<f64> {
        let noise = |i: usize| (i as f64 * 12.9898).sin() * 43_758.545_3 % 1.0;
        (0..n).map(|i| (0.013 * i as f64).sin() + 1e-4 * noise(i)).collect()
    }
    fn left(values: Vec<f64>, role: VariableRole, drives: bool) -> (Vec<f64>, Vec<Finding>) {
        let time = (0..values.len()).map(|i| 0.01 * i as f64).collect();
        let mut run =
            Recording { channels: vec![Channel::new("x", "", time, values)], ..Recording::default() };
        let mut findings = Vec::new();
        leave_out(
            &mut run,
            &[SignalVariable { drives, ..SignalVariable::new("x", "", role) }],
            &mut findings,
        );
        (run.channels.remove(0).values, findings)
    }

    /// One reading of any size, anywhere, of an output and of an input: it is left out, and it alone.
    #[test]
    fn one_wild_reading_of_any_size_is_left_out() {
        for size in [2e2, 1e5, 1e10, 1e20, 1e100, 1e160, 1e300, f64::MAX] {
            for (role, at) in [
                (VariableRole::Output, 0),
                (VariableRole::Output, 2),
                (VariableRole::Output, 999),
                (VariableRole::Input, 500),
            ] {
                for sign in [1.0, -1.0] {
                    let mut x = swing(1000);
                    x[at] = sign * size;
                    let (kept, findings) = left(x, role, true);
                    assert_eq!((kept.len(), findings.len()), (999, 1), "{size} at {at} of {role:?}");
                    assert!(kept.iter().all(|x| x.abs() < 1.1));
                    assert!(findings[0].what.contains("1 spike, such as"), "{}", findings[0]);
                }
            }
        }
    }

    #[test]
    fn a_healthy_channel_and_a_pulse_that_is_meant_stay() {
        assert_eq!(left(swing(1000), VariableRole::Output, false), (swing(1000), vec![]));
        let mut hammer = vec![0.0; 1000];
        hammer[300] = 50.0;
        assert_eq!(left(hammer.clone(), VariableRole::Input, false), (hammer.clone(), vec![]));
        let noisy: Vec<f64> = hammer.iter().zip(swing(1000)).map(|(h, x)| h + 1e-3 * x).collect();
        assert_eq!(left(noisy.clone(), VariableRole::Input, false).0.len(), 1000);
        // Steps of a command.
        let steps: Vec<f64> = (0..1000).map(|i| f64::from(i / 100 % 2)).collect();
        assert_eq!(left(steps.clone(), VariableRole::Input, true), (steps, vec![]));
        // A slip of three readings is a motion.
        let mut slip = vec![0.0; 1000];
        slip.iter_mut().enumerate().for_each(|(i, x)| *x = 1e-4 * (i as f64 * 12.9898).sin());
        slip[400..403].fill(0.3);
        assert_eq!(left(slip, VariableRole::Output, false).0.len(), 1000);
    }

    #[test]
    fn many_readings_beyond_all_quantities_are_refused() {
        let (_, findings) = left(vec![0.0, 1e160, 1.0], VariableRole::Output, false);
        assert!(
            findings[0].is_error() && findings[0].to_string().contains("x at 0.01 s: values up to 1e160")
        );
    }
}
