//! Gains and offsets of outputs that the filter does not read, a torque sensor's say: by regression of their readings on what the model
//! has of them along the smoothed trajectory.
//!
//! ```text
//! y' - h = (n - 1) h + (o - o0) / g0 + v      y' = (reading - o0) / g0, gain n g0
//! ```

use nalgebra::{DMatrix, DVector};
use trueup_signals::{Loaded, SensorData};

use super::frame::InnovationsFrame;
use super::intake::{begun, by_readings, shown_at};
use super::known_effects::KnownEffects;
use super::numeric::interpolated;
use super::rig::{GAIN, OFFSET};

/// What was found of such channels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UnreadFigures {
    /// Names (a channel with `.gain`) and values.
    pub values: Vec<(String, f64)>,
    /// The same of offsets of single recordings.
    pub offsets: Vec<(String, usize, f64)>,
    /// Nats that they gain over the assumed ones.
    pub gain: f64,
}

/// Whether a gain or an offset of a sensor is estimated.
pub fn is_estimated(s: &SensorData) -> bool {
    s.gain.is_some() || s.offset.is_some()
}

/// A figure with its prior: mean 0 and standard deviation 1 of its number.
struct Figure {
    name: String,
    recording: Option<usize>,
    assumed: f64,
    /// By how much the value is larger where the number is 1.
    unit: f64,
    column: Vec<f64>,
}

/// Figures of all outputs that are neither a reading nor an input of the frame's plant, along its trajectory in hand.
pub fn unread(loaded: &Loaded, frame: &InnovationsFrame) -> UnreadFigures {
    let train = loaded.train();
    let mut names: Vec<&str> = Vec::new();
    for c in train.iter().flat_map(|r| &r.channels) {
        if is_estimated(&c.sensor) && !names.contains(&&*c.name) && !frame.plant.has_channel(&c.name) {
            names.push(&c.name);
        }
    }
    let mut found = UnreadFigures::default();
    if names.is_empty() {
        return found;
    }
    let dry = frame.plant.coordinates().iter().any(|c| c.dry.is_some());
    let Some(model) = frame.plant.known_effects().cloned().or_else(|| KnownEffects::none(&loaded.case, dry))
    else {
        return found;
    };
    for name in names {
        if let Some(output) = model.output(name) {
            of_channel(loaded, frame, (&model, output), name, &mut found);
        }
    }
    found
}

fn of_channel(
    loaded: &Loaded,
    frame: &InnovationsFrame,
    (model, output): (&KnownEffects, usize),
    name: &str,
    found: &mut UnreadFigures,
) {
    let train = loaded.train();
    let mut sensor: Option<SensorData> = None;
    let (mut left, mut shown, mut runs) = (Vec::new(), Vec::new(), Vec::new());
    for (k, r) in train.iter().enumerate() {
        let Some(c) = r.channel(name) else { continue };
        let delayed = r.channels.iter().any(|c| c.sensor.delay != 0.0);
        let least = || r.channels.iter().flat_map(shown_at).fold(f64::MAX, f64::min);
        let begin = if delayed { begun(r) } else { least() };
        let nodes = frame.output_along(model, k, output);
        let time: Vec<f64> = (0..nodes.len()).map(|t| frame.runs[k].time(t)).collect();
        let at: Vec<f64> = shown_at(c).map(|t| t - begin).collect();
        let h = interpolated(&at, &time, &nodes);
        left.extend(c.believed().iter().zip(&h).map(|(y, h)| y - h));
        runs.resize(runs.len() + h.len(), k);
        shown.extend(h);
        sensor.get_or_insert_with(|| c.sensor.clone());
    }
    let Some(sensor) = sensor.filter(|_| !left.is_empty()) else { return };
    let figures = figures(loaded, name, &sensor, &shown, &runs);
    let noise = sensor.noise.map_or_else(|| by_readings(&train, name), |n| n / sensor.believed_gain().abs());
    let columns = DMatrix::from_fn(left.len(), figures.len(), |i, k| figures[k].column[i]);
    let left = DVector::from_vec(left);
    // What the fit misses of the readings counts as their noise where it is more than that.
    let solve = |variance: f64| {
        let square = columns.tr_mul(&columns) / variance + DMatrix::identity(figures.len(), figures.len());
        let right = columns.tr_mul(&left) / variance;
        let factor = square.cholesky()?;
        let x = factor.solve(&right);
        let logarithm: f64 = factor.l_dirty().diagonal().iter().map(|d| 2.0 * d.ln()).sum();
        Some((0.5 * (right.dot(&x) - logarithm), x))
    };
    let least = (noise * noise).max(f64::MIN_POSITIVE);
    let Some((_, first)) = solve(least) else { return };
    let missed = (&left - &columns * first).norm_squared() / left.len() as f64;
    let Some((gain, x)) = solve(least.max(missed)) else { return };
    found.gain += gain;
    for (f, x) in figures.into_iter().zip(x.iter()) {
        let value = f.assumed + f.unit * x;
        match f.recording {
            Some(k) => found.offsets.push((f.name, k, value)),
            None => found.values.push((f.name, value)),
        }
    }
}

fn figures(loaded: &Loaded, name: &str, sensor: &SensorData, shown: &[f64], runs: &[usize]) -> Vec<Figure> {
    let mut all = Vec::new();
    let taken = sensor.believed_gain();
    if let Some(g) = sensor.gain {
        let deviation = g.doubt.unwrap_or(GAIN);
        all.push(Figure {
            name: format!("{name}.gain"),
            recording: None,
            assumed: g.value,
            unit: g.value * deviation,
            column: shown.iter().map(|h| deviation * h).collect(),
        });
    }
    for (k, r) in loaded.train().iter().enumerate() {
        let Some((c, o)) = r.channel(name).and_then(|c| Some((c, c.sensor.offset?))) else { continue };
        let range = c.range().map_or(0.0, |(low, high)| high - low);
        let unit = o.doubt.unwrap_or(OFFSET * range).max(1e-12);
        let column = runs.iter().map(|run| if *run == k { unit / taken } else { 0.0 }).collect();
        all.push(Figure {
            name: format!("{name}.offset"),
            recording: Some(k),
            assumed: o.value,
            unit,
            column,
        });
    }
    all
}
