//! Noise of the measured inputs, carried through the free-running simulation.
//!
//! A drive whose current is read with noise is simulated with that noise, which an integrating plant turns into drift:
//! residuals then err together, over seconds. Linearised about the simulated motion, the error e of the states obeys
//! e+ = F e + G w with w one white sample per sample of a noisy input, and what a reading shows of it is C e + v. A
//! Kalman filter without initial doubt (how a run begins is an unknown of the fit) turns such residuals into innovations
//! of unit variance, each independent of all before: least squares is then efficient, its cost a likelihood, and a
//! residual of 1 is the noise floor.
//!
//! F and G come from one simulation on duals whose derivatives begin anew at every sample; events bring the jump of the
//! sensitivities with them. What it gets wrong: the motion is taken to be close to the true one, and noise of an input
//! that goes linearly between its samples is taken to hold (half a sample of delay).

use nalgebra::{DMatrix, DVector};
use trueup_numerics::{Dual, Scalar};

use crate::plant::Plant;
use crate::predict::{InputMap, Moment, Plan, PredictError, follow};
use crate::run::Run;

/// How a reading enters the filter: residuals are in the readings' deviations.
#[derive(Clone, Debug)]
struct Reading {
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
struct Step {
    /// The error from the last instant to this one.
    transition: DMatrix<f64>,
    readings: Vec<Reading>,
}

/// What carried noise does to the residuals of one recording.
#[derive(Clone, Debug)]
pub struct Carried {
    steps: Vec<Step>,
    size: usize,
    /// Standard deviation of what the noise does to each reading, in the reading's own.
    deviation: Vec<f64>,
}

impl Carried {
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

/// The carried noise of a recording at `theta`; `None` where no input is declared to be noisy.
///
/// # Errors
/// See [`PredictError`].
pub fn carried<M: Plant>(
    model: &M,
    recording: &Run,
    plan: &Plan,
    p: &[f64],
    map: &InputMap<f64>,
) -> Result<Option<Carried>, PredictError> {
    let noisy = recording.drives.iter().filter(|d| d.sigma > 0.0 && d.t.len() > 1).count();
    if noisy == 0 {
        return Ok(None);
    }
    match model.sizes().states + noisy {
        0..=4 => linearised::<M, 4>(model, recording, plan, p, map),
        5..=6 => linearised::<M, 6>(model, recording, plan, p, map),
        7..=10 => linearised::<M, 10>(model, recording, plan, p, map),
        11..=20 => linearised::<M, 20>(model, recording, plan, p, map),
        21..=40 => linearised::<M, 40>(model, recording, plan, p, map),
        _ => Ok(None),
    }
}

fn linearised<M: Plant, const N: usize>(
    model: &M,
    recording: &Run,
    plan: &Plan,
    p: &[f64],
    map: &InputMap<f64>,
) -> Result<Option<Carried>, PredictError> {
    let states = model.sizes().states;
    let drives: Vec<_> = recording.drives.iter().filter(|d| d.sigma > 0.0 && d.t.len() > 1).collect();
    let size = states + drives.len();
    let constant = |v: &[f64]| -> Vec<Dual<N>> { v.iter().map(|v| Dual::constant(*v)).collect() };
    let map = InputMap { gain: constant(&map.gain), bias: constant(&map.bias) };
    // The next sample of each noisy drive.
    let mut next = vec![0; drives.len()];
    let mut covariance = DMatrix::<f64>::zeros(size, size);
    let mut free = covariance.clone();
    let mut carried =
        Carried { steps: Vec::with_capacity(plan.nodes()), size, deviation: vec![0.0; plan.len()] };
    let mut finite = true;
    follow(model, plan, &constant(p), &map, recording.at_rest, &mut |m: Moment<Dual<N>>| match m {
        Moment::Begin { t, x, u } => {
            // Noise that holds since the last sample stays, new samples bring their own.
            let mut transition = DMatrix::zeros(size, size);
            let fresh: Vec<bool> = (drives.iter().zip(&mut next))
                .map(|(d, next)| {
                    let before = *next;
                    while *next < d.t.len() && d.t[*next] <= t + 1e-9 {
                        *next += 1;
                    }
                    *next > before
                })
                .collect();
            if !carried.steps.is_empty() {
                for i in 0..states {
                    (0..size).for_each(|j| transition[(i, j)] = x[i].eps[j]);
                }
            }
            for j in (0..drives.len()).filter(|&j| !fresh[j]) {
                transition[(states + j, states + j)] = 1.0;
            }
            for p in [&mut covariance, &mut free] {
                *p = &transition * &*p * transition.transpose();
                for j in (0..drives.len()).filter(|&j| fresh[j]) {
                    p[(states + j, states + j)] = drives[j].sigma.powi(2);
                }
            }
            finite &= transition.iter().all(|v| v.is_finite());
            carried.steps.push(Step { transition, readings: Vec::new() });
            for i in 0..states {
                x[i].eps = [0.0; N];
                x[i].eps[i] = 1.0;
            }
            for (j, d) in drives.iter().enumerate() {
                u[d.input].eps = [0.0; N];
                u[d.input].eps[states + j] = 1.0;
            }
        }
        Moment::Reading { channel, sample, y } => {
            let sigma = recording.channels[channel].deviation(sample);
            let shows = DVector::from_fn(size, |i, _| y.eps[i] / sigma);
            let row = plan.channels()[channel] + sample;
            carried.deviation[row] = (shows.dot(&(&free * &shows))).max(0.0).sqrt();
            let along = &covariance * &shows;
            let variance = 1.0 + shows.dot(&along).max(0.0);
            let gain = &along / variance;
            covariance -= &gain * along.transpose();
            covariance.fill_lower_triangle_with_upper_triangle();
            finite &= variance.is_finite();
            let reading = Reading { row, shows, gain, scale: 1.0 / variance.sqrt() };
            if let Some(step) = carried.steps.last_mut() {
                step.readings.push(reading);
            }
        }
    })?;
    Ok(finite.then_some(carried))
}
