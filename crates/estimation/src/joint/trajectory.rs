//! Where a joint was, from its readings: first from each sensor alone, then by the model.

use nalgebra::{SMatrix, SVector};
use trueup_models::joint::{output, parameter};

use super::{Model, PLACES, Recording, STATES, Trajectory};
use crate::filter::{Filter, log_likelihood};
use crate::smoother::{Smoothed, smooth};
use crate::system::{Reading, Step, System};

/// Position and speed of one sensor, pushed by white acceleration of the intensity that is most likely.
fn kinematic(read: &[Option<f64>], variance: f64, dt: f64) -> Vec<[f64; 2]> {
    let first = read.iter().flatten().next().copied().unwrap_or(0.0);
    let range = read.iter().flatten().map(|v| (v - first).abs()).fold(variance.sqrt(), f64::max);
    let duration = dt * read.len() as f64;
    let of = |intensity: f64| {
        let step = Step::<2, 1> {
            transition: SMatrix::from_row_slice(&[1.0, dt, 0.0, 1.0]),
            push: SVector::zeros(),
            noise: SMatrix::from_row_slice(&[dt * dt / 3.0, 0.5 * dt, 0.5 * dt, 1.0]) * (intensity * dt),
            forces: SMatrix::zeros(),
        };
        let node = |v: &Option<f64>| {
            let reading = v.map(|v| Reading { row: SVector::from([1.0, 0.0]), value: v - first, variance });
            reading.into_iter().collect()
        };
        System::<2, 1> {
            start: SVector::zeros(),
            start_covariance: SMatrix::from_diagonal(&SVector::from([
                range.powi(2),
                (range / dt.sqrt()).powi(2),
            ])),
            steps: vec![step; read.len().saturating_sub(1)],
            nodes: read.iter().map(node).collect(),
        }
    };
    // In units of an acceleration that crosses the range once in the whole recording.
    let unit = (range / duration.powi(2)).powi(2) * duration;
    let likelihood = |exponent: i32| {
        let system = of(unit * 10f64.powi(exponent));
        let filter = Filter::new(&system);
        log_likelihood(filter.log_determinant, &filter.data(&system, false).whitened)
    };
    let best = (-2..16).map(|e| (e, likelihood(e))).max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |b| b.0);
    let system = of(unit * 10f64.powi(best));
    let filter = Filter::new(&system);
    let smoothed = smooth(&system, &filter, &filter.data(&system, true), false);
    smoothed.states.iter().map(|x| [x[0] + first, x[1]]).collect()
}

/// The trajectory that the sensors show, each by itself. A sensor without readings is taken to follow the other one
/// through a stiff gear. Nothing moves where neither angle was read.
pub fn sensed_trajectory(model: &Model, recording: &Recording) -> Trajectory {
    let n = model.p[parameter::GEAR_RATIO];
    let [motor, load] = [output::MOTOR_ANGLE, output::LOAD_ANGLE].map(|output| {
        let channel = recording.channel(output)?;
        let read: Vec<Option<f64>> = channel.samples.iter().map(|s| s.map(|s| s.value)).collect();
        let seen = read.iter().flatten().count() > 1;
        seen.then(|| kinematic(&read, channel.variance, recording.dt))
    });
    let follow = |x: &[f64; 2], by: f64| [x[0] * by, x[1] * by];
    let (motor, load) = match (motor, load) {
        (Some(m), Some(l)) => (m, l),
        (Some(m), None) => (m.clone(), m.iter().map(|x| follow(x, 1.0 / n)).collect()),
        (None, Some(l)) => (l.iter().map(|x| follow(x, n)).collect(), l),
        (None, None) => return vec![[0.0; STATES]; recording.nodes()],
    };
    let node = |(m, l): (&[f64; 2], &[f64; 2])| {
        if model.joint.flexible() { [m[0], m[1], m[0] - n * l[0], l[1]] } else { [m[0], m[1], 0.0, m[1] / n] }
    };
    motor.iter().zip(&load).map(node).collect()
}

/// The trajectory and the latent torques that a smoother found about another trajectory.
pub fn smoothed_trajectory<const N: usize>(
    trajectory: &[[f64; STATES]],
    found: &Smoothed<N, PLACES>,
) -> (Trajectory, Vec<[f64; PLACES]>) {
    let moved = trajectory.iter().zip(&found.states).map(|(x, d)| core::array::from_fn(|i| x[i] + d[i]));
    let held = found.states.iter().map(|d| core::array::from_fn(|p| d[N - PLACES + p]));
    let mut held: Vec<[f64; PLACES]> = held.collect();
    held.pop();
    (moved.collect(), held)
}
