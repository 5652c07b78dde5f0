//! From a recording to a [`IdentificationRun`]: which channels drive, which are compared, how sure each reading is; and how each run
//! begins, as unknowns with priors.

use nalgebra::{DMatrix, DVector};
use trueup_models::arm::parameter;
use trueup_signals::spline::Spline;
use trueup_signals::{Interpolation, Loaded, Recording, element_name, noise};

use crate::model::{CoordinateIndices, ModelError, SimulatedPlant};
use crate::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use crate::sensor_unknowns::OFFSET;
use crate::subject::IdentificationSubject;
use crate::unknown::{FitTarget, FitUnknown, Scale};

/// Standard deviation of a channel's readings by its name; `None`: not known.
pub type Noise<'a> = &'a dyn Fn(&str) -> Option<f64>;

/// A recording that cannot be simulated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecordedError {
    /// Nothing to compare.
    #[error(
        "{0}: no channel is an output of the model that can be compared; record motorAngle or loadAngle (joint), jointAngle or basePosition (arm)"
    )]
    NoOutput(String),
    /// A start value.
    #[error("{0}: {1}")]
    Parameter(String, ModelError),
    /// A joint whose motion is prescribed.
    #[error(
        "{0}: joint {1} has neither jointTorque[{1}] nor an angle of its motor with at least 5 samples: nothing drives it; record one of them"
    )]
    NotLed(String, usize),
    /// A weight that holds for no reading.
    #[error(
        "line {0}, `weight`: no recording for fitting has a reading there; correct `start` and `end` (s)"
    )]
    NothingWeighed(u64),
    /// All readings of a recording for fitting are left out.
    #[error("{0}: `weight` leaves out every reading; take it out of `train`, or give it a weight above 0")]
    NothingLeft(String),
}

/// What the readings of a channel err by when that is not declared: from their second differences.
///
/// Never below a millionth of their range, so that a reading without noise is no infinite weight.
pub fn guessed_noise(y: &[f64]) -> f64 {
    let least = y.iter().copied().fold(f64::INFINITY, f64::min);
    let most = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    noise::by_differences(&noise::second_differences(y), 6.0)
        .max(1e-6 * (most - least))
        .max(f64::MIN_POSITIVE)
}

/// A recording for this model; deviations by `noise`, else as the channel declares them, else guessed.
///
/// # Errors
/// See [`RecordedError`].
pub fn run(
    model: &SimulatedPlant,
    recording: &Recording,
    noise: Noise,
) -> Result<IdentificationRun, RecordedError> {
    let leading: Vec<String> =
        model.structure().led.iter().filter_map(|j| leader(model, recording, *j)).collect();
    let mut run = read(model, recording, noise, &leading)?;
    for j in &model.structure().led {
        lead(model, recording, noise, *j, &mut run)
            .ok_or_else(|| RecordedError::NotLed(run.name.clone(), j + 1))?;
    }
    Ok(run)
}

/// A recording for any subject; the channels of `leading` are left out.
fn read(
    model: &dyn IdentificationSubject,
    recording: &Recording,
    noise: Noise,
    leading: &[String],
) -> Result<IdentificationRun, RecordedError> {
    let mut run = IdentificationRun {
        name: recording.name.clone(),
        start: recording.start,
        ..IdentificationRun::default()
    };
    for channel in recording.channels.iter().filter(|c| !c.is_empty()) {
        let sensor = &channel.sensor;
        let (offset, gain, late) = (sensor.offset, sensor.gain, sensor.late);
        let size = sensor.believed_gain().abs();
        let deviation = || noise(&channel.name).or_else(|| channel.sensor.deviation()).map(|d| d / size);
        if let Some(input) = model.input(&channel.name) {
            let between = match channel.interpolation {
                Interpolation::Linear => InputInterpolation::Linear,
                Interpolation::Hold => InputInterpolation::Hold,
            };
            let t = channel.time.iter().map(|t| t - channel.sensor.delay).collect();
            let sigma = deviation().unwrap_or(0.0);
            run.drives.push(InputDrive {
                input,
                t,
                u: channel.believed(),
                between,
                sigma,
                offset,
                gain,
                late,
            });
        } else if let Some(output) = model.output(&channel.name) {
            if !model.compares(output) || leading.contains(&channel.name) {
                continue;
            }
            let y = channel.believed();
            run.channels.push(OutputChannel {
                name: channel.name.clone(),
                output,
                t: channel.time.clone(),
                sigma: deviation().filter(|s| *s > 0.0).unwrap_or_else(|| guessed_noise(&y)),
                y,
                delay: sensor.delay,
                resolution: sensor.resolution.unwrap_or(0.0) / size,
                spread: Vec::new(),
                offset,
                gain,
                late,
            });
        }
    }
    if run.is_empty() {
        return Err(RecordedError::NoOutput(run.name));
    }
    // The motion has to be there before the first reading that shows it.
    let first = run.channels.iter().filter_map(|c| Some(c.t.first()? - c.delay)).fold(run.start, f64::min);
    run.start = first;
    run.channels.iter_mut().for_each(OutputChannel::weigh_rests);
    let nothing = vec![f64::NAN; model.parameters().len()];
    let set = model.with_values(&nothing, &recording.parameters);
    let set = set.map_err(|e| RecordedError::Parameter(run.name.clone(), e))?;
    run.known = set.into_iter().enumerate().filter(|(_, v)| !v.is_nan()).collect();
    Ok(run)
}

/// The channel that shows how the motor of this joint moves.
fn leader(model: &SimulatedPlant, recording: &Recording, joint: usize) -> Option<String> {
    let motor = element_name("motorAngle", &[joint + 1]);
    let own = element_name("jointAngle", &[joint + 1]);
    let names = if model.structure().flexible[joint] { vec![motor] } else { vec![own, motor] };
    names.into_iter().find(|n| recording.channel(n).is_some_and(|c| c.len() >= 5))
}

/// The joints (from 0) that neither a torque nor the command of a servo drives in one of these recordings and whose motors' motion
/// is measured in all.
pub fn led(model: &SimulatedPlant, recordings: &[&Recording]) -> Vec<usize> {
    if model.arm().is_none() {
        return Vec::new();
    }
    let driven = |r: &Recording, j: usize| {
        ["jointTorque", "positionReference"].into_iter().any(|input| {
            let name = element_name(input, &[j + 1]);
            model.input(&name).is_some() && r.channel(&name).is_some()
        })
    };
    (0..model.structure().flexible.len())
        .filter(|&j| recordings.iter().any(|r| !driven(r, j)))
        .filter(|&j| recordings.iter().all(|r| leader(model, r, j).is_some()))
        .collect()
}

/// The measured motion of a prescribed motor as a drive, and where it begins: the smoothest curve within the noise.
fn lead(
    model: &SimulatedPlant,
    recording: &Recording,
    noise: Noise,
    joint: usize,
    run: &mut IdentificationRun,
) -> Option<()> {
    let channel = recording.channel(&leader(model, recording, joint)?)?;
    let sigma = noise(&channel.name)
        .or_else(|| channel.sensor.deviation())
        .unwrap_or_else(|| guessed_noise(&channel.values));
    let t: Vec<f64> = channel.time.iter().map(|t| t - channel.sensor.delay).collect();
    let spline = Spline::new(&t, &channel.values, sigma)?;
    let input = model.input(&element_name("motorAcceleration", &[joint + 1]))?;
    run.drives.push(InputDrive { input, t, u: spline.accelerations().to_vec(), ..InputDrive::default() });
    let [angle, rate, _] = spline.at(run.start);
    let n = model.structure().flexible.len();
    let begins = match model.structure().flexible[joint] {
        true => [parameter::initial_motor_angle(n), parameter::initial_motor_velocity(n)],
        false => [parameter::initial_joint_angle(n), parameter::initial_joint_velocity(n)],
    };
    for (begin, value) in begins.into_iter().zip([angle, rate]) {
        let index = begin + joint;
        run.known.retain(|k| k.0 != index);
        run.known.push((index, value));
    }
    Some(())
}

/// The training and the held-out recordings of a case; deviations from its noise floor.
///
/// # Errors
/// See [`RecordedError`].
pub fn runs(
    model: &SimulatedPlant,
    loaded: &Loaded,
) -> Result<(Vec<IdentificationRun>, Vec<IdentificationRun>), RecordedError> {
    both(loaded, |r, floor| run(model, r, floor))
}

/// The same for any subject; nothing is prescribed.
///
/// # Errors
/// See [`RecordedError`].
pub fn runs_of(
    model: &dyn IdentificationSubject,
    loaded: &Loaded,
) -> Result<(Vec<IdentificationRun>, Vec<IdentificationRun>), RecordedError> {
    both(loaded, |r, floor| read(model, r, floor, &[]))
}

fn both(
    loaded: &Loaded,
    one: impl Fn(&Recording, Noise) -> Result<IdentificationRun, RecordedError>,
) -> Result<(Vec<IdentificationRun>, Vec<IdentificationRun>), RecordedError> {
    let floor = |name: &str| noise::floor(loaded, name).map(|f| f.deviation);
    let all = |list: Vec<&Recording>| list.into_iter().map(|r| one(r, &floor)).collect::<Result<_, _>>();
    let mut train: Vec<IdentificationRun> = all(loaded.train())?;
    for stretch in &loaded.case.weights {
        if train.iter_mut().map(|run| run.weigh(stretch)).sum::<usize>() == 0 {
            return Err(RecordedError::NothingWeighed(stretch.line));
        }
    }
    let counts =
        |run: &IdentificationRun| run.channels.iter().flat_map(|c| &c.t).any(|t| run.weight(*t) > 0.0);
    if let Some(run) = train.iter().find(|run| !counts(run)) {
        return Err(RecordedError::NothingLeft(run.name.clone()));
    }
    Ok((train, all(loaded.holdout())?))
}

/// Value and rate of a channel when the run begins, each with a standard deviation, from its first readings.
struct Begin {
    value: (f64, f64),
    rate: (f64, f64),
}

/// Readings and seconds at most from which a beginning is read.
const FIRST: (usize, f64) = (25, 0.1);
/// Sensors repeat themselves and motions bend: what the first readings say is taken to be this many times less sure.
const CAUTION: f64 = 3.0;
/// First readings that are left out still give a beginning, by their noise times a thousand.
const LEAST_WEIGHT: f64 = 1e-6;

fn begin(channel: &OutputChannel, run: &IdentificationRun) -> Option<Begin> {
    let t: Vec<f64> = channel.t.iter().map(|t| t - channel.delay - run.start).collect();
    let short = t.partition_point(|v| *v <= t[0] + FIRST.1).min(FIRST.0);
    let m = short.max(4).min(t.len());
    // Readings that count for less give less, however little they are let give.
    let weight = channel.t[..m].iter().map(|t| run.weight(*t)).fold(1.0, f64::min).max(LEAST_WEIGHT);
    let sigma = channel.sigma / weight.sqrt();
    if m < 2 {
        let value = (*channel.y.first()?, CAUTION * sigma);
        return Some(Begin { value, rate: (0.0, f64::INFINITY) });
    }
    let fitted = |order: usize| -> Option<(DVector<f64>, DMatrix<f64>)> {
        let a = DMatrix::from_fn(m, order + 1, |i, j| t[i].powi(j as i32));
        let y = DVector::from_column_slice(&channel.y[..m]);
        let covariance = (a.tr_mul(&a)).try_inverse()? * sigma.powi(2);
        let x = &covariance * a.tr_mul(&y) / sigma.powi(2);
        Some((x, covariance))
    };
    // The motion may bend, or begin, within these readings: a line and a parabola differ by as much as that can do.
    let (x, c) = fitted(1)?;
    let bent = fitted(2).filter(|_| m > 3).map_or(x.clone(), |(x, _)| x);
    let sure = |k: usize| CAUTION * c[(k, k)].max(0.0).sqrt() + (bent[k] - x[k]).abs();
    Some(Begin { value: (x[0], sure(0) + 0.5 * channel.resolution), rate: (x[1], sure(1)) })
}

/// A prior as a linear unknown whose scale is that prior's standard deviation.
fn believed(name: &str, target: FitTarget, run: usize, (mean, sd): (f64, f64)) -> FitUnknown {
    let start = if mean.is_finite() { mean } else { 0.0 };
    FitUnknown {
        start,
        scale: Scale::Linear(sd),
        prior: Some((start / sd, 1.0)),
        ..FitUnknown::free(name, target, Some(run), sd)
    }
}

/// The channel that shows an output of a coordinate: of a rigid joint that of its motor, too.
fn shown_by<'a>(
    model: &dyn IdentificationSubject,
    coordinates: &[CoordinateIndices],
    run: &'a IdentificationRun,
    output: usize,
) -> Option<&'a OutputChannel> {
    let of = |output: usize| run.channels.iter().find(|c| c.output == output);
    let twin = || {
        let name = model.outputs()[output].name.strip_prefix("joint")?;
        let twin = model.output(&format!("motor{name}"))?;
        let apart = coordinates.iter().any(|c| [c.angle_output, c.velocity_output].contains(&twin));
        of(twin).filter(|_| !apart)
    };
    of(output).or_else(twin)
}

/// How each run begins, and what its sensors read off: initial states of all coordinates that the recording does not
/// give exactly, and the offsets that are to be estimated. `values` are all parameters of the model.
///
/// Priors come from the first readings, widened. What no sensor shows stays near the coordinate that it is joined to by
/// a spring.
pub fn nuisance(
    model: &dyn IdentificationSubject,
    values: &[f64],
    runs: &[IdentificationRun],
) -> Vec<FitUnknown> {
    let mut all = Vec::new();
    let coordinates = model.begins();
    for (r, run) in runs.iter().enumerate() {
        let of = |output: usize| shown_by(model, &coordinates, run, output);
        let mut found: Vec<[(f64, f64); 2]> = Vec::new();
        for c in &coordinates {
            let (angle, velocity) = (of(c.angle_output), of(c.velocity_output));
            let shown = angle.and_then(|c| begin(c, run));
            let direct = velocity.and_then(|c| begin(c, run)).map(|b| b.value);
            // What it would be behind a spring without strain; as unsure as the largest strain.
            let joined = c.follows.map(|(other, geared)| {
                let n = if geared { values[model.parameter("gearRatio").unwrap_or(0)] } else { 1.0 };
                let [(angle, sd), (rate, rate_sd)] = found[other];
                let strain = if geared { largest_twist(model, values, run) / n } else { 0.05 };
                [(angle / n, sd / n.abs() + strain), (rate / n, rate_sd / n.abs() + 30.0 * strain)]
            });
            let plain = [(values[c.angle], 0.1), (values[c.velocity], 0.1)];
            let fallback = joined.unwrap_or(plain);
            let mut value = shown.as_ref().map_or(fallback[0], |b| b.value);
            let off = angle.is_some_and(|c| c.offset.is_some());
            if off {
                value = (value.0, value.1 + offset_size(angle, values, model));
            }
            let rate = match (direct, shown.map(|b| b.rate)) {
                (Some(a), Some(b)) if b.1 < a.1 => b,
                (Some(a), _) => a,
                (None, Some(b)) if b.1.is_finite() => b,
                _ => fallback[1],
            };
            found.push([value, rate]);
            let given = |i: usize| run.known.iter().any(|(k, _)| *k == i);
            for (index, prior) in [(c.angle, value), (c.velocity, rate)] {
                if !given(index) && !run.at_rest {
                    let name = &model.parameters()[index].name;
                    all.push(believed(name, FitTarget::Parameter(index), r, (prior.0, prior.1.max(1e-12))));
                }
            }
        }
        for &(index, output) in model.shown_states() {
            let given = run.known.iter().any(|(k, _)| *k == index);
            let Some(c) = of(output).filter(|_| !given && !run.at_rest) else { continue };
            let Some(b) = begin(c, run) else { continue };
            let sd = b.value.1 + if c.offset.is_some() { offset_size(Some(c), values, model) } else { 0.0 };
            let name = &model.parameters()[index].name;
            all.push(believed(name, FitTarget::Parameter(index), r, (b.value.0, sd.max(1e-12))));
        }
        for (c, guess) in run.channels.iter().filter_map(|c| Some((c, c.offset?))) {
            let name = format!("{}.offset", c.name);
            let size = guess.doubt.unwrap_or_else(|| offset_size(Some(c), values, model));
            all.push(believed(&name, FitTarget::Offset(c.output), r, (guess.value, size)));
        }
        for (d, guess) in run.drives.iter().filter_map(|d| Some((d, d.offset?))) {
            let name = format!("{}.offset", model.inputs()[d.input].name);
            let largest = d.u.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            let size = guess.doubt.unwrap_or((OFFSET * largest).max(100.0 * d.sigma).max(1e-9));
            all.push(believed(&name, FitTarget::InputOffset(d.input), r, (guess.value, size)));
        }
    }
    all
}

/// Standard deviation of an offset that is to be estimated: wide against the sensor and against what it measures.
fn offset_size(channel: Option<&OutputChannel>, values: &[f64], model: &dyn IdentificationSubject) -> f64 {
    let Some(c) = channel else { return 0.0 };
    let least = c.y.iter().copied().fold(f64::INFINITY, f64::min);
    let most = c.y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let gear = model.parameter("gearRatio").filter(|_| c.name.starts_with("motor"));
    let turn = gear.map_or(1.0, |i| values[i].abs());
    (OFFSET * (most - least)).max(100.0 * c.sigma).max(1e-2 * turn)
}

/// The twist that the largest torque of the motor makes, motor side, rad.
fn largest_twist(model: &dyn IdentificationSubject, values: &[f64], run: &IdentificationRun) -> f64 {
    let value = |name: &str| model.parameter(name).map_or(0.0, |i| values[i]);
    let largest = |input: &str| {
        let drive = run.drives.iter().find(|d| Some(d.input) == model.input(input));
        drive.map_or(0.0, |d| d.u.iter().fold(0.0, |m: f64, v| m.max(v.abs())))
    };
    let torque = value("torqueConstant").abs() * largest("motorCurrent")
        + largest("externalTorque") / value("gearRatio").abs().max(1.0);
    (torque / value("stiffness").max(f64::MIN_POSITIVE)).clamp(1e-9, 1e3)
}
