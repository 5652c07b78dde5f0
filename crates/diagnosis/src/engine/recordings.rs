//! A case with its recordings as numbers that a model can be compared with.

use super::unknown::UnknownPrior;
use std::collections::BTreeMap;

use rand::Rng;
use trueup_identification::model::{ModelError, PlantQuantity, SimulatedPlant};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_identification::sensor_unknowns::{SensorFigure, SensorOf, SensorUnknown, sought};
use trueup_identification::unknown::Scale;
use trueup_models::plants::PlantStructure;
use trueup_models::{arm, effect, joint};
use trueup_signals::noise;
use trueup_signals::{Case, Interpolation, Loaded, ParameterValue, PriorGuess, Recording, SensorData};

use super::coordinate::CoordinateReadings;
use super::problem::{BalanceTarget, BalanceUnknown, Compared};
use super::subject::{DiagnosisSubject, EngineModel};
use super::unknown::WRONG;
use crate::floor::coloured;

/// A case that cannot be diagnosed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UnfitCase {
    /// Not one of the plants.
    #[error("there is no diagnosis for the model {0:?}; it is made for the plants of docs/cases.md")]
    Model(String),
    /// The requested structure cannot be built.
    #[error("{0}")]
    Structure(String),
    /// A parameter with an inadmissible value.
    #[error("{0}")]
    Parameter(#[from] ModelError),
    /// The same of a recording.
    #[error("{0}: {1}")]
    Recording(String, ModelError),
    /// A channel whose noise is not known.
    #[error(
        "{recording}: nothing is known of the noise of {channel}, and its readings do not show it; declare [channels.{channel}] noise or resolution"
    )]
    Noise {
        /// Recording.
        recording: String,
        /// FMU variable.
        channel: String,
    },
    /// No recording to learn from.
    #[error("train is empty; name at least one recording that may be used for fitting")]
    Empty,
    /// Nothing to compare.
    #[error(
        "{0}: no channel is an output of the model; name the columns as the FMU names its outputs, or map them in the sidecar"
    )]
    NoOutput(String),
    /// Nothing moves.
    #[error(
        "{0}: every output stays at one value: there is nothing to compare; record a motion, or leave the recording out"
    )]
    Still(String),
}

/// A case ready for diagnosis.
#[derive(Clone, Debug)]
pub struct PreparedCase {
    /// The plant as the user declares it.
    pub subject: DiagnosisSubject,
    /// Without effects, but for those that are known.
    pub model: EngineModel,
    /// Its nominal parameters.
    pub nominal: Vec<f64>,
    /// Relative standard deviation per parameter, where declared.
    pub doubt: BTreeMap<String, f64>,
    /// Recordings for fitting.
    pub train: Vec<Compared>,
    /// Recordings for the figures reported.
    pub holdout: Vec<Compared>,
    /// Its coordinates.
    pub coordinates: Vec<CoordinateReadings>,
    /// Its inputs, with their units.
    pub inputs: Vec<PlantQuantity>,
    /// Its outputs, with theirs.
    pub outputs: Vec<PlantQuantity>,
    /// Standard deviation of the noise of measured inputs, by input.
    pub input_noise: Vec<f64>,
    /// Correlation of the noise of a reading with that of the next, by output.
    pub correlation: Vec<f64>,
    /// The same by input.
    pub input_correlation: Vec<f64>,
    /// Outputs whose constant reading offset is to be estimated, for each recording separately.
    pub offsets: Vec<usize>,
    /// Gains and delays of sensors, and offsets of inputs, that are to be estimated: the same in all recordings.
    pub sensors: Vec<BalanceUnknown>,
}

impl DiagnosisSubject {
    /// The plant that a case names, with its structure.
    ///
    /// # Errors
    /// It names none of ours.
    pub fn of(case: &Case) -> Result<Self, UnfitCase> {
        let known = case.known_effects().into_iter().map(str::to_owned).collect();
        let model = SimulatedPlant::of_case(case, &[])?;
        let PlantStructure { flexible, fixed_base, payload, .. } = model.structure().clone();
        Ok(Self { plant: model.effect_plant(), flexible, fixed_base, payload, known })
    }
}

impl PreparedCase {
    /// Reads a simulated recording with the noise and the resolution of its sensors, inputs with theirs.
    pub fn read_noisily(&self, run: &mut IdentificationRun, rng: &mut impl Rng) {
        for c in &mut run.channels {
            let white = (c.sigma.powi(2) - c.resolution.powi(2) / 12.0).max(0.0).sqrt();
            let correlation = self.correlation.get(c.output).copied().unwrap_or(0.0);
            for (y, noise) in c.y.iter_mut().zip(coloured(correlation, rng)) {
                *y += white * noise;
                if c.resolution > 0.0 {
                    *y = (*y / c.resolution).round() * c.resolution;
                }
            }
        }
        for d in &mut run.drives {
            let [sigma, correlation] = self.input_noise_of(d.input);
            d.u.iter_mut().zip(coloured(correlation, rng)).for_each(|(u, noise)| *u += sigma * noise);
        }
    }

    /// Deviation of a measured input's noise, and its correlation with that of the next reading.
    pub fn input_noise_of(&self, input: usize) -> [f64; 2] {
        [&self.input_noise, &self.input_correlation].map(|list| list.get(input).copied().unwrap_or(0.0))
    }

    /// From a case with its recordings.
    ///
    /// # Errors
    /// See [`UnfitCase`].
    pub fn new(loaded: &Loaded) -> Result<Self, UnfitCase> {
        let case = &loaded.case;
        let subject = DiagnosisSubject::of(case)?;
        let model = subject.model(&[] as &[&str]).map_err(UnfitCase::Structure)?;
        let names = subject.parameters(&model);
        let mut nominal = subject.defaults(&model);
        let reader = trueup_identification::model::SimulatedPlant::of_case(case, &[])?;
        let index: BTreeMap<&str, usize> =
            names.iter().enumerate().map(|(i, n)| (n.name.as_str(), i)).collect();
        let given = |parameters: &BTreeMap<String, ParameterValue>| -> Result<Vec<(usize, f64)>, ModelError> {
            let values = reader.set(&reader.defaults(), parameters)?;
            let read = |name: &String| Some((*index.get(name.as_str())?, values[reader.parameter(name)?]));
            Ok(parameters.keys().filter_map(read).collect())
        };
        given(&case.parameters)?.into_iter().for_each(|(i, v)| nominal[i] = v);
        if subject.payload.is_some() {
            // Its centre follows from the link's length, unless the case gives it.
            let all = reader.set(&reader.defaults(), &case.parameters)?;
            for p in &arm::PAYLOAD {
                let own = index.get(p.name).copied().zip(reader.parameter(p.name));
                own.iter().for_each(|(i, k)| nominal[*i] = all[*k]);
            }
        }
        let doubt: BTreeMap<String, f64> =
            names.iter().filter_map(|n| Some((n.name.clone(), case.doubt(&n.name)?))).collect();
        if matches!(model, EngineModel::Joint(_)) && case.number("staticFriction").is_none() {
            nominal[joint::parameter::STATIC_FRICTION] = nominal[joint::parameter::COULOMB_FRICTION];
        }
        let coordinates = subject.coordinates(&model, &nominal);
        let inputs = subject.inputs();
        let compared = |list: Vec<&Recording>| -> Result<Vec<Compared>, UnfitCase> {
            list.into_iter()
                .map(|r| {
                    let run = run(loaded, &subject, r)?;
                    let mut known = first_states(&subject, &model, &nominal, &coordinates, &run);
                    let own = given(&r.parameters);
                    for (i, v) in own.map_err(|e| UnfitCase::Recording(r.name.clone(), e))? {
                        known.retain(|(k, _)| *k != i);
                        known.push((i, v));
                    }
                    Ok(Compared::new(run, known, model.sizes().inputs))
                })
                .collect()
        };
        let (train, holdout) = (compared(loaded.train())?, compared(loaded.holdout())?);
        if train.is_empty() {
            return Err(UnfitCase::Empty);
        }
        let input_noise = inputs
            .iter()
            .map(|name| crate::floor::input(loaded, name).map_or(0.0, |f| f.deviation))
            .collect();
        let input_correlation = inputs.iter().map(|name| noise::correlation(loaded, name)).collect();
        let outputs = subject.outputs();
        let correlation = outputs.iter().map(|name| noise::correlation(loaded, name)).collect();
        let estimated = |name: &String| {
            loaded.recordings.values().any(|r| r.channel(name).is_some_and(|c| c.sensor.offset.is_some()))
        };
        let offsets = outputs.iter().enumerate().filter(|(_, n)| estimated(n)).map(|(i, _)| i).collect();
        let sensors = sensors(&reader, &train);
        Ok(Self {
            subject,
            model,
            nominal,
            doubt,
            sensors,
            inputs: reader.inputs().to_vec(),
            outputs: reader.outputs().to_vec(),
            train,
            holdout,
            coordinates,
            input_noise,
            correlation,
            input_correlation,
            offsets,
        })
    }
}

/// Gains and delays of sensors, and offsets of inputs, in these recordings: one of all where all have the same guess, else one of each
/// that has any.
fn sensors(model: &trueup_identification::model::SimulatedPlant, train: &[Compared]) -> Vec<BalanceUnknown> {
    let one = |(s, run): (SensorUnknown, Option<usize>)| {
        let PriorGuess { value, doubt } = s.guess;
        let channel = match s.of {
            SensorOf::Input(i) => &model.inputs()[i],
            SensorOf::Output(i) => &model.outputs()[i],
        };
        let (target, unit) = match (s.of, s.figure) {
            // They are estimated for each recording separately.
            (SensorOf::Output(_), SensorFigure::Offset) => return None,
            (SensorOf::Output(i), SensorFigure::Gain) => (BalanceTarget::Gain(i), "1"),
            (SensorOf::Output(i), SensorFigure::Delay) => (BalanceTarget::TotalSensorDelay(i), "s"),
            (SensorOf::Input(i), SensorFigure::Offset) => (BalanceTarget::InputOffset(i), channel.unit),
            (SensorOf::Input(i), SensorFigure::Gain) => (BalanceTarget::InputGain(i), "1"),
            (SensorOf::Input(i), SensorFigure::Delay) => (BalanceTarget::InputSensorDelay(i), "s"),
        };
        let share = s.figure == SensorFigure::Gain;
        let [a, b] = [0.02 * value, 50.0 * value];
        let free = if share { (a.min(b), a.max(b)) } else { (f64::NEG_INFINITY, f64::INFINITY) };
        let (lower, upper) = s.bounds().unwrap_or(free);
        Some(BalanceUnknown {
            name: format!("{}.{}", channel.name, s.figure.name()),
            unit: unit.into(),
            target,
            run,
            start: value,
            scale: Scale::Linear(s.size),
            lower,
            upper,
            prior: Some(UnknownPrior::normal(
                value / s.size,
                if share { doubt.unwrap_or(WRONG) } else { 1.0 },
            )),
        })
    };
    let each = |s: SensorUnknown| -> Vec<(SensorUnknown, Option<usize>)> {
        let all: Vec<(usize, Option<PriorGuess>)> =
            train.iter().enumerate().filter_map(|(k, c)| Some((k, guess_in(&c.run, &s)?))).collect();
        if all.iter().all(|(_, g)| *g == Some(s.guess)) {
            return vec![(s, None)];
        }
        let own = |(k, guess): (usize, Option<PriorGuess>)| {
            let guess = guess?;
            let size = if s.figure == SensorFigure::Gain { guess.value.abs() } else { s.size };
            Some((SensorUnknown { guess, size, ..s }, Some(k)))
        };
        all.into_iter().filter_map(own).collect()
    };
    sought(train.iter().map(|c| &c.run)).into_iter().flat_map(each).filter_map(one).collect()
}

/// What a recording assumes of this figure, if it has the channel.
fn guess_in(run: &IdentificationRun, s: &SensorUnknown) -> Option<Option<PriorGuess>> {
    let of = |gain, offset, late| match s.figure {
        SensorFigure::Gain => gain,
        SensorFigure::Offset => offset,
        SensorFigure::Delay => late,
    };
    match s.of {
        SensorOf::Input(i) => run.drives.iter().find(|d| d.input == i).map(|d| of(d.gain, d.offset, d.late)),
        SensorOf::Output(o) => {
            run.channels.iter().find(|c| c.output == o).map(|c| of(c.gain, c.offset, c.late))
        }
    }
}

fn run(loaded: &Loaded, subject: &DiagnosisSubject, r: &Recording) -> Result<IdentificationRun, UnfitCase> {
    let (inputs, outputs) = (subject.inputs(), subject.outputs());
    let mut run = IdentificationRun { name: r.name.clone(), start: r.start, ..IdentificationRun::default() };
    for c in &r.channels {
        if let Some(input) = inputs.iter().position(|n| *n == c.name) {
            let between = match c.interpolation {
                Interpolation::Linear => InputInterpolation::Linear,
                Interpolation::Hold => InputInterpolation::Hold,
            };
            let t = c.time.iter().map(|t| t - c.sensor.delay).collect();
            let SensorData { offset, gain, late, .. } = c.sensor;
            let sigma = 0.0;
            run.drives.push(InputDrive { input, t, u: c.believed(), between, sigma, offset, gain, late });
        } else if let Some(output) = outputs.iter().position(|n| *n == c.name) {
            let quiet = c.range().is_none_or(|(low, high)| high <= low);
            if quiet {
                continue;
            }
            let (y, size) = (c.believed(), c.sensor.believed_gain().abs());
            let sigma = noise::floor(loaded, &c.name)
                .map(|f| f.deviation / size)
                .filter(|d| *d > 0.0)
                .or_else(|| rough(&y))
                .ok_or_else(|| UnfitCase::Noise { recording: r.name.clone(), channel: c.name.clone() })?;
            run.channels.push(OutputChannel {
                name: c.name.clone(),
                output,
                t: c.time.clone(),
                y,
                sigma,
                delay: c.sensor.delay,
                resolution: c.sensor.resolution.unwrap_or(0.0) / size,
                spread: Vec::new(),
                offset: c.sensor.offset,
                gain: c.sensor.gain,
                late: c.sensor.late,
            });
        }
    }
    if run.channels.is_empty() {
        if r.channels.iter().any(|c| outputs.contains(&c.name)) {
            return Err(UnfitCase::Still(r.name.clone()));
        }
        return Err(UnfitCase::NoOutput(r.name.clone()));
    }
    Ok(run)
}

/// Noise where it is not declared: from third differences, which a smooth motion does not have.
fn rough(y: &[f64]) -> Option<f64> {
    let mut d: Vec<f64> = y.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    if d.len() < 20 {
        return None;
    }
    let middle = d.len() / 2;
    let median = *d.select_nth_unstable_by(middle, f64::total_cmp).1;
    // White noise of deviation s makes third differences of deviation s sqrt(20); the median of |N(0, 1)| is 0.6745.
    (median > 0.0).then(|| median / (0.6745 * 20f64.sqrt()))
}

/// Position and velocity of every coordinate at the start, from a parabola through its first readings; of those that
/// no sensor measures as of the neighbour: the load as the motor has it.
pub(super) fn first_states(
    subject: &DiagnosisSubject,
    model: &EngineModel,
    nominal: &[f64],
    coordinates: &[CoordinateReadings],
    run: &IdentificationRun,
) -> Vec<(usize, f64)> {
    let mut found: Vec<Option<[f64; 2]>> = Vec::new();
    for c in coordinates {
        let seen = |list: &[(usize, f64)]| {
            list.iter().find_map(|(o, f)| {
                let channel = run.channels.iter().find(|ch| ch.output == *o)?;
                let fit = parabola(channel, run.start)?;
                Some([fit[0] / f, fit[1] / f])
            })
        };
        let (position, velocity) = (seen(&c.positions), seen(&c.velocities));
        found.push(match (position, velocity) {
            (Some(p), Some(v)) => Some([p[0], v[0]]),
            (p, None) => p,
            (None, Some(v)) => Some([0.0, v[0]]),
        });
    }
    // Of two that share a spring one follows the other.
    if let (effect::PlantKind::Joint, [a, b]) = (subject.plant, &mut found[..]) {
        let n = nominal[joint::parameter::GEAR_RATIO];
        match (*a, *b) {
            (Some(m), None) => *b = Some([m[0] / n, m[1] / n]),
            (None, Some(l)) => *a = Some([l[0] * n, l[1] * n]),
            _ => {}
        }
    }
    if let EngineModel::Arm(m) = model {
        let mut row = 3;
        for flexible in m.flexible() {
            if *flexible {
                match (found[row], found[row + 1]) {
                    (Some(j), None) => found[row + 1] = Some(j),
                    (None, Some(j)) => found[row] = Some(j),
                    _ => {}
                }
            }
            row += 1 + usize::from(*flexible);
        }
    }
    let mut known = Vec::new();
    for (c, v) in coordinates.iter().zip(found) {
        let (Some(start), Some(v)) = (c.start, v) else { continue };
        known.extend(start.into_iter().zip(v));
        if let Some(end) = &c.other_end {
            let channel = end.shown.and_then(|output| run.channels.iter().find(|c| c.output == output));
            let seen = channel.and_then(|c| parabola(c, run.start)).unwrap_or(v.map(|v| v / end.gear));
            known.extend(end.start.into_iter().zip(seen));
        }
    }
    known
}

/// Deviations by which an estimate from more readings may differ from one from fewer.
const AGREES: f64 = 3.0;

/// Value and slope at `start` of the least-squares parabola through the first readings of a channel: through twice as many
/// as long as all estimates so far are compatible (Lepski's rule), for a slope that is wrong by noise may put a
/// free run into another minimum.
fn parabola(channel: &OutputChannel, start: f64) -> Option<[f64; 2]> {
    let least = channel.t.iter().take_while(|t| **t <= start + 0.05).count().clamp(8, 60);
    let most = (channel.t.len() / 4).max(least.min(channel.t.len()));
    if most < 3 {
        return channel.y.first().map(|y| [*y, 0.0]);
    }
    let mut ranges: Vec<[[f64; 2]; 2]> = Vec::new();
    for n in std::iter::successors(Some(least.min(most)), |n| Some(2 * n)).take_while(|n| *n <= most) {
        let own = parabola_of(channel, start, n)?;
        let agrees =
            |old: &[[f64; 2]; 2]| (0..2).all(|j| (own[0][j] - old[0][j]).abs() <= AGREES * old[1][j]);
        if !ranges.iter().all(agrees) {
            break;
        }
        ranges.push(own);
    }
    ranges.last().map(|s| s[0])
}

/// The same through so many readings; and their deviations.
fn parabola_of(channel: &OutputChannel, start: f64, n: usize) -> Option<[[f64; 2]; 2]> {
    let span = (channel.t[n - 1] - start).max(f64::MIN_POSITIVE);
    let rows = nalgebra::DMatrix::from_fn(n, 3, |i, j| {
        ((channel.t[i] - channel.delay - start) / span).powi(j as i32)
    });
    let y = nalgebra::DVector::from_fn(n, |i, _| channel.y[i] - channel.y[0]);
    let variance = rows.tr_mul(&rows).try_inverse();
    let fit = rows.svd(true, true).solve(&y, 1e-12).ok()?;
    let deviation = |j: usize| variance.as_ref().map_or(0.0, |v| channel.sigma * v[(j, j)].sqrt());
    Some([[fit[0] + channel.y[0], fit[1] / span], [deviation(0), deviation(1) / span]])
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::StandardNormal;

    #[test]
    fn first_slopes_are_nearly_as_good_as_with_the_best_number_of_readings() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(4);
        let t: Vec<f64> = (0..700).map(|k| f64::from(k) * 0.02).collect();
        for bend in [0.0, 0.05, 1.0, 20.0] {
            // Of each number of readings, and of the rule: how far the slope is off.
            let mut errors = vec![Vec::new(); 6];
            for _ in 0..200 {
                let noise: Vec<f64> =
                    t.iter().map(|_| 0.0025 * rng.sample::<f64, _>(StandardNormal)).collect();
                let y = t.iter().zip(noise).map(|(t, e)| 0.1 + 0.02 * t + bend * t.powi(3) + e).collect();
                let channel = OutputChannel { t: t.clone(), y, sigma: 0.0025, ..OutputChannel::default() };
                let fixed = (0..5).map(|k| parabola_of(&channel, 0.0, 8 << k).unwrap()[0]);
                let all = fixed.chain([parabola(&channel, 0.0).unwrap()]);
                errors.iter_mut().zip(all).for_each(|(e, s)| e.push((s[1] - 0.02).powi(2)));
            }
            let rms: Vec<f64> = errors.iter().map(|e| (e.iter().sum::<f64>() / 200.0).sqrt()).collect();
            let best = rms[..5].iter().fold(f64::INFINITY, |m, v| m.min(*v));
            assert!(rms[5] < 2.0 * best, "bend {bend}: {rms:?}");
        }
    }
}
