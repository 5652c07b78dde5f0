//! Noise of the measured inputs, carried through the free-running simulation.
//!
//! A drive whose current is read with noise is simulated with that noise, which an integrating plant turns into drift:
//! residuals then err together, over seconds. Linearised about the simulated motion, the error e of the states obeys
//! e+ = F e + G w with w one white sample per sample of a noisy input, and what a reading shows of it is C e + v. A
//! Kalman filter without initial uncertainty (how a run begins is an unknown of the fit) turns such residuals into innovations
//! of unit variance, each independent of all before: least squares is then efficient, its cost a likelihood, and a
//! residual of 1 is the noise floor.
//!
//! F and G come from one simulation on duals whose derivatives begin again at every sample; events bring the jump of the
//! sensitivities with them. What it gets wrong: the motion is taken to be close to the true one, and noise of an input
//! that goes linearly between its samples is taken to hold (half a sample of delay).

use nalgebra::{DMatrix, DVector};
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant};

use crate::predict::{InputMap, PredictError, PredictionPlan, SimulationMoment, follow};
use crate::run::{IdentificationRun, InputDrive};

/// How a reading enters the filter: residuals are in the readings' deviations.
#[derive(Clone, Debug)]
struct FilterReading {
    /// Among the residuals of the run.
    row: usize,
    /// What it shows of the error.
    shows: DVector<f64>,
    /// Kalman gain.
    gain: DVector<f64>,
    /// 1 over the innovation's deviation.
    scale: f64,
}

/// From one instant to the next.
#[derive(Clone, Debug)]
struct LinearStep {
    /// The error from the last instant to this one.
    transition: DMatrix<f64>,
    readings: Vec<FilterReading>,
}

/// What carried noise does to the residuals of one recording.
#[derive(Clone, Debug)]
pub struct CarriedNoise {
    steps: Vec<LinearStep>,
    size: usize,
    /// Standard deviation of what the noise does to each reading, in the reading's own.
    deviation: Vec<f64>,
}

impl CarriedNoise {
    /// Residuals, or a column of their derivatives, become innovations.
    pub fn whiten(&self, v: &mut [f64]) {
        let mut e = DVector::zeros(self.size);
        let mut next = e.clone();
        for step in &self.steps {
            next.gemv(1.0, &step.transition, &e, 0.0);
            std::mem::swap(&mut e, &mut next);
            for reading in &step.readings {
                let innovation = v[reading.row] - reading.shows.dot(&e);
                e.axpy(innovation, &reading.gain, 1.0);
                v[reading.row] = innovation * reading.scale;
            }
        }
    }
    /// How far the noise of the inputs moves each reading of the simulation (standard deviation, in units of the
    /// reading's own), the run beginning as it did.
    pub fn deviation(&self) -> &[f64] {
        &self.deviation
    }
}

/// One instant of the linearised simulation.
struct LinearInstant {
    /// The error from the last instant to this one.
    transition: DMatrix<f64>,
    /// Whether each noisy input has a new sample.
    fresh: Vec<bool>,
    /// The rows of its readings among the residuals, and what each shows of the error, in its own deviation.
    readings: Vec<(usize, DVector<f64>)>,
}

/// The carried noise of a recording at `theta`; `None` where no input is declared to be noisy.
///
/// # Errors
/// See [`PredictError`].
pub fn carried(
    model: &dyn Plant,
    recording: &IdentificationRun,
    plan: &PredictionPlan,
    p: &[f64],
    map: &InputMap<f64>,
) -> Result<Option<CarriedNoise>, PredictError> {
    let drives: Vec<_> = recording.drives.iter().filter(|d| d.sigma > 0.0 && d.t.len() > 1).collect();
    if drives.is_empty() {
        return Ok(None);
    }
    let size = model.sizes().states + drives.len();
    let mut instants = Vec::with_capacity(plan.nodes());
    for begin in (0..size).step_by(LANES) {
        linearise(model, (recording, &drives), plan, (p, map), begin, &mut instants)?;
    }
    let sigma: Vec<f64> = drives.iter().map(|d| d.sigma).collect();
    Ok(filter(instants, &sigma, size, plan.len()))
}

/// The columns from `begin` on, as many as a dual has derivatives, of all transitions and of what all readings show.
fn linearise(
    model: &dyn Plant,
    (recording, drives): (&IdentificationRun, &[&InputDrive]),
    plan: &PredictionPlan,
    (p, map): (&[f64], &InputMap<f64>),
    begin: usize,
    instants: &mut Vec<LinearInstant>,
) -> Result<(), PredictError> {
    let states = model.sizes().states;
    let size = states + drives.len();
    let lanes = begin..size.min(begin + LANES);
    let constant = |v: &[f64]| -> Vec<Lanes> { v.iter().map(|v| Dual::constant(*v)).collect() };
    let along = |i: usize| core::array::from_fn(|k| f64::from(begin + k == i));
    let map = InputMap { gain: constant(&map.gain), bias: constant(&map.bias) };
    // The next sample of each noisy drive.
    let mut next = vec![0; drives.len()];
    let mut at = 0;
    follow(model, plan, &constant(p), &map, recording.at_rest, &mut |m: SimulationMoment<Lanes>| match m {
        SimulationMoment::Begin { t, x, u } => {
            at += 1;
            if instants.len() < at {
                let fresh = drives.iter().zip(&mut next).map(|(d, next)| {
                    let before = *next;
                    while *next < d.t.len() && d.t[*next] <= t + 1e-9 {
                        *next += 1;
                    }
                    *next > before
                });
                let fresh: Vec<bool> = fresh.collect();
                let mut transition = DMatrix::zeros(size, size);
                // Noise that holds since the last sample stays, new samples bring their own.
                for j in (0..drives.len()).filter(|&j| !fresh[j]) {
                    transition[(states + j, states + j)] = 1.0;
                }
                instants.push(LinearInstant { transition, fresh, readings: Vec::new() });
            }
            for i in 0..states {
                if at > 1 {
                    lanes.clone().for_each(|j| instants[at - 1].transition[(i, j)] = x[i].eps[j - begin]);
                }
                x[i].eps = along(i);
            }
            for (j, d) in drives.iter().enumerate() {
                u[d.input].eps = along(states + j);
            }
        }
        SimulationMoment::Reading { channel, sample, y } => {
            let Some(instant) = at.checked_sub(1).and_then(|i| instants.get_mut(i)) else { return };
            let row = plan.channels()[channel] + sample;
            let known = instant.readings.iter().position(|(r, _)| *r == row);
            let place = known.unwrap_or_else(|| {
                instant.readings.push((row, DVector::zeros(size)));
                instant.readings.len() - 1
            });
            let sigma = recording.channels[channel].deviation(sample);
            lanes.clone().for_each(|j| instant.readings[place].1[j] = y.eps[j - begin] / sigma);
        }
    })?;
    Ok(())
}

/// The filter's gains along the instants; `None` where a figure is not finite.
fn filter(instants: Vec<LinearInstant>, sigma: &[f64], size: usize, readings: usize) -> Option<CarriedNoise> {
    let states = size - sigma.len();
    let mut covariance = DMatrix::<f64>::zeros(size, size);
    let mut free = covariance.clone();
    let mut deviation = vec![0.0; readings];
    let mut steps = Vec::with_capacity(instants.len());
    for LinearInstant { transition, fresh, readings } in instants {
        for p in [&mut covariance, &mut free] {
            *p = &transition * &*p * transition.transpose();
            for j in (0..sigma.len()).filter(|&j| fresh[j]) {
                p[(states + j, states + j)] = sigma[j].powi(2);
            }
        }
        if !transition.iter().all(|v| v.is_finite()) {
            return None;
        }
        let mut read = Vec::with_capacity(readings.len());
        for (row, shows) in readings {
            deviation[row] = (shows.dot(&(&free * &shows))).max(0.0).sqrt();
            let along = &covariance * &shows;
            let variance = 1.0 + shows.dot(&along).max(0.0);
            let gain = &along / variance;
            covariance -= &gain * along.transpose();
            covariance.fill_lower_triangle_with_upper_triangle();
            if !variance.is_finite() {
                return None;
            }
            read.push(FilterReading { row, shows, gain, scale: 1.0 / variance.sqrt() });
        }
        steps.push(LinearStep { transition, readings: read });
    }
    Some(CarriedNoise { steps, size, deviation })
}
