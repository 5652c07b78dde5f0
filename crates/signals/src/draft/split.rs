//! Which recordings are at rest, which repeat each other, which are held out; what their sensors show.

use std::collections::BTreeMap;

use crate::case::Loaded;
use crate::figures::ChannelFigures;
use crate::recording::{Interpolation, Recording};
use crate::variable::{SignalVariable, VariableRole, role};

/// Inputs of one command differ by less than this share (root mean square).
const SAME: f64 = 0.05;
/// Words in names of recordings that are meant to be held out.
const HELD_OUT: [&str; 5] = ["hold", "test", "valid", "eval", "late"];

/// Of the recordings of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Split {
    pub(super) train: Vec<String>,
    pub(super) holdout: Vec<String>,
    /// They were named so.
    pub(super) by_name: bool,
    pub(super) rest: Vec<String>,
    pub(super) repeats: Vec<Vec<String>>,
    pub(super) sensors: BTreeMap<String, DraftSensor>,
    /// Start in s and length in s of each.
    pub(super) times: BTreeMap<String, [f64; 2]>,
}

/// What the readings of a channel show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DraftSensor {
    pub(super) resolution: Option<f64>,
    pub(super) noise: Option<f64>,
    pub(super) held: bool,
}

impl Split {
    /// All for fitting.
    pub(super) fn all(names: &[String]) -> Self {
        Self { train: names.to_vec(), ..Self::default() }
    }

    pub(super) fn of(loaded: &Loaded, known: &[SignalVariable]) -> Self {
        let mut own = Self::default();
        let runs: Vec<(&str, &Recording)> =
            loaded.case.train.iter().filter_map(|n| Some((n.as_str(), loaded.recordings.get(n)?))).collect();
        own.times = runs.iter().map(|(n, r)| ((*n).to_owned(), [r.start, r.duration()])).collect();
        own.rest = runs.iter().filter(|(_, r)| rests(r, known)).map(|(n, _)| (*n).to_owned()).collect();
        if own.rest.len() == runs.len() {
            own.rest.clear();
        }
        let moving: Vec<_> = runs.iter().filter(|(n, _)| !own.rest.iter().any(|r| r == n)).copied().collect();
        let held = |n: &str| HELD_OUT.iter().any(|word| n.to_lowercase().contains(word));
        let named: Vec<&str> = moving.iter().map(|(n, _)| *n).filter(|n| held(n)).collect();
        own.by_name = !named.is_empty() && named.len() < moving.len();
        let count = if moving.len() < 2 { 0 } else { moving.len().div_ceil(4) };
        for (i, (name, _)) in moving.iter().enumerate() {
            let out = if own.by_name { named.contains(name) } else { i + count >= moving.len() };
            if out { own.holdout.push((*name).into()) } else { own.train.push((*name).into()) }
        }
        own.repeats = repeats(&moving, known);
        let quiet = !own.rest.is_empty() || !own.repeats.is_empty();
        for (_, run) in &moving {
            for c in &run.channels {
                let Some(figures) = ChannelFigures::of(c) else { continue };
                let sensor = own
                    .sensors
                    .entry(c.name.clone())
                    .or_insert(DraftSensor { held: true, ..DraftSensor::default() });
                let least = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::min);
                sensor.held &= figures.interpolation == Some(Interpolation::Hold);
                sensor.resolution = least(sensor.resolution, figures.resolution);
                if role(known, &c.name) == Some(VariableRole::Output) && !quiet {
                    sensor.noise = sensor.noise.into_iter().chain(figures.noise).reduce(f64::max);
                }
            }
        }
        for (name, sensor) in &mut own.sensors {
            sensor.held &= role(known, name) == Some(VariableRole::Input);
        }
        own
    }
}

/// No output moves.
fn rests(run: &Recording, known: &[SignalVariable]) -> bool {
    let outputs = run.channels.iter().filter(|c| role(known, &c.name) == Some(VariableRole::Output));
    let figures: Vec<_> = outputs.filter_map(ChannelFigures::of).collect();
    !figures.is_empty() && figures.iter().all(ChannelFigures::is_at_rest)
}

/// Groups with the same inputs and length.
fn repeats(runs: &[(&str, &Recording)], known: &[SignalVariable]) -> Vec<Vec<String>> {
    let mut groups: Vec<(&Recording, Vec<String>)> = Vec::new();
    for (name, run) in runs {
        match groups.iter_mut().find(|(first, _)| same(first, run, known)) {
            Some((_, group)) => group.push((*name).into()),
            None => groups.push((run, vec![(*name).into()])),
        }
    }
    groups.into_iter().map(|(_, group)| group).filter(|group| group.len() > 1).collect()
}

fn same(a: &Recording, b: &Recording, known: &[SignalVariable]) -> bool {
    let mut inputs =
        a.channels.iter().filter(|c| role(known, &c.name) == Some(VariableRole::Input)).peekable();
    let long = (a.duration() - b.duration()).abs() <= 0.01 * a.duration();
    long && inputs.peek().is_some()
        && inputs.all(|c| {
            let Some(d) = b.channel(&c.name) else { return false };
            let shifted: Vec<f64> = c.time.iter().map(|t| t - a.start + b.start).collect();
            let apart: f64 = c.values.iter().zip(d.sample(&shifted)).map(|(x, y)| (x - y).powi(2)).sum();
            apart.sqrt() <= SAME * c.values.iter().map(|x| x * x).sum::<f64>().sqrt()
        })
}
