//! The observer that keeps a simulation near a recording.
//!
//! A free-running simulation of a wrong model drifts away, and what it then misses says little about what is wrong
//! just now. So each measured coordinate is corrected at every reading by the gains of the steady Kalman filter of
//! dd(q) = white noise: what is left are innovations, and a missing torque shows in them while it acts. The
//! intensity of that noise, in units of what the sensor resolves within a sample (Kalata's tracking index), says how
//! wrong a model may be; 0 is the free-running simulation.

use nalgebra::{Matrix2, Vector2};
use trueup_identification::run::Run;
use trueup_models::effect::Plant;
use trueup_models::{arm, joint};

use super::subject::{Model, Subject};

/// A coordinate of the plant: how a correction enters its states, and which outputs show it.
#[derive(Clone, Debug, Default)]
pub struct Coordinate {
    /// States that move with a change of its position, with their factors.
    pub position: Vec<(usize, f64)>,
    /// Those that move with a change of its velocity.
    pub velocity: Vec<(usize, f64)>,
    /// Mode that holds it still while it is 0 (dry friction).
    pub held: Option<usize>,
    /// Outputs that show its position, as factor times it.
    pub positions: Vec<(usize, f64)>,
    /// Outputs that show its velocity.
    pub velocities: Vec<(usize, f64)>,
    /// Parameters that set its first position and velocity.
    pub start: Option<[usize; 2]>,
    /// Inputs that drive it: acceleration per unit.
    pub driven: Vec<(usize, f64)>,
}

impl Subject {
    /// The coordinates of a model of this plant with these parameters.
    pub fn coordinates(&self, model: &Model, p: &[f64]) -> Vec<Coordinate> {
        match (self.plant, model) {
            (Plant::Joint, Model::Joint(m)) => joint_coordinates(m.flexible(), p),
            (Plant::Arm, Model::Arm(m)) => arm_coordinates(m, p),
            _ => Vec::new(),
        }
    }
}

fn joint_coordinates(flexible: bool, values: &[f64]) -> Vec<Coordinate> {
    use joint::{input as i, output as o, parameter as p};
    let (n, j_m, j_l) = (values[p::GEAR_RATIO], values[p::MOTOR_INERTIA], values[p::LOAD_INERTIA]);
    let driven = values[p::TORQUE_CONSTANT] / if flexible { j_m } else { j_m + j_l / (n * n) };
    let motor = Coordinate {
        position: if flexible { vec![(0, 1.0), (2, 1.0)] } else { vec![(0, 1.0)] },
        velocity: vec![(1, 1.0)],
        held: Some(0),
        positions: vec![(o::MOTOR_ANGLE, 1.0)],
        velocities: vec![(o::MOTOR_VELOCITY, 1.0)],
        start: Some([p::INITIAL_MOTOR_ANGLE, p::INITIAL_MOTOR_VELOCITY]),
        driven: vec![(i::MOTOR_CURRENT, driven)],
    };
    if !flexible {
        let positions = vec![(o::MOTOR_ANGLE, 1.0), (o::LOAD_ANGLE, 1.0 / n)];
        let velocities = vec![(o::MOTOR_VELOCITY, 1.0), (o::LOAD_VELOCITY, 1.0 / n)];
        return vec![Coordinate { positions, velocities, ..motor }];
    }
    let load = Coordinate {
        position: vec![(2, -n)],
        velocity: vec![(3, 1.0)],
        held: None,
        positions: vec![(o::LOAD_ANGLE, 1.0)],
        velocities: vec![(o::LOAD_VELOCITY, 1.0)],
        start: Some([p::INITIAL_LOAD_ANGLE, p::INITIAL_LOAD_VELOCITY]),
        driven: vec![(i::EXTERNAL_TORQUE, 1.0 / j_l)],
    };
    vec![motor, load]
}

fn arm_coordinates(m: &arm::PlanarManipulator, values: &[f64]) -> Vec<Coordinate> {
    use arm::{input as i, output as o, parameter as p};
    let (n, dofs) = (m.links(), m.dofs());
    let of = |row: usize, position: usize, velocity: usize, start: [usize; 2]| Coordinate {
        position: vec![(row, 1.0)],
        velocity: vec![(dofs + row, 1.0)],
        held: None,
        positions: vec![(position, 1.0)],
        velocities: vec![(velocity, 1.0)],
        start: Some(start),
        driven: Vec::new(),
    };
    let mut all: Vec<Coordinate> = (0..2)
        .map(|i| {
            let start = [p::initial_base_position(n) + i, p::initial_base_velocity(n) + i];
            of(i, o::base_position(n) + i, o::base_velocity(n) + i, start)
        })
        .collect();
    let start = [p::initial_base_attitude(n), p::initial_base_rate(n)];
    all.push(of(2, o::base_attitude(n), o::base_rate(n), start));
    for j in 0..n {
        let start = [p::initial_joint_angle(n) + j, p::initial_joint_velocity(n) + j];
        let mut c = of(3 + j, o::joint_angle(n) + j, o::joint_velocity(n) + j, start);
        let motor = (o::motor_angle(n) + j, o::motor_velocity(n) + j);
        if m.flexible()[j] {
            all.push(c);
            let start = [p::initial_motor_angle(n) + j, p::initial_motor_velocity(n) + j];
            c = of(m.motor(j), motor.0, motor.1, start);
        } else {
            c.positions.push((motor.0, 1.0));
            c.velocities.push((motor.1, 1.0));
        }
        let inertia = if m.flexible()[j] { p::motor_inertia(n) } else { p::link_inertia(n) } + j;
        c.driven = vec![(i::joint_torque(n) + j, 1.0 / values[inertia].max(1e-9))];
        c.held = m.has_friction().then_some(j);
        all.push(c);
    }
    all
}

/// What the innovation of a channel does, and how large it is by itself.
#[derive(Clone, Copy, Debug)]
pub struct Gain {
    /// Which coordinate.
    pub coordinate: usize,
    /// Change of its position per unit of innovation.
    pub position: f64,
    /// Change of its velocity.
    pub velocity: f64,
    /// Standard deviation of the innovation of a perfect model: what noise of sensors and inputs makes of it.
    pub deviation: f64,
    /// How long it takes to forget a wrong start, s.
    pub memory: f64,
}

/// Gains of the channels of one recording; `None`: compared, but nothing is corrected by it.
pub type Gains = Vec<Option<Gain>>;

/// The gains for a recording, with one tracking index per coordinate; `noise` is that of the inputs.
pub fn gains(run: &Run, coordinates: &[Coordinate], index: &[f64], noise: &[f64]) -> Gains {
    let mut all: Gains = vec![None; run.channels.len()];
    for (c, coordinate) in coordinates.iter().enumerate() {
        // (channel, row of the measurement matrix, variance)
        let mut sensors = Vec::new();
        for (k, channel) in run.channels.iter().enumerate() {
            let find =
                |list: &[(usize, f64)]| list.iter().find(|(o, _)| *o == channel.output).map(|(_, f)| *f);
            if let Some(f) = find(&coordinate.positions) {
                sensors.push((k, Vector2::new(f, 0.0), channel.sigma * channel.sigma));
            } else if let Some(f) = find(&coordinate.velocities) {
                sensors.push((k, Vector2::new(0.0, f), channel.sigma * channel.sigma));
            }
        }
        let step = sensors
            .iter()
            .filter_map(|(k, ..)| median_step(&run.channels[*k].t))
            .fold(f64::INFINITY, f64::min);
        if !step.is_finite() {
            continue;
        }
        // What the best sensor resolves as an acceleration within a sample.
        let resolved = sensors
            .iter()
            .map(|(_, h, r)| {
                r.sqrt() / if h[0] != 0.0 { h[0].abs() * step * step } else { h[1].abs() * step }
            })
            .fold(f64::INFINITY, f64::min);
        let a = index[c] * resolved;
        let f = Matrix2::new(1.0, step, 0.0, 1.0);
        let g = Vector2::new(0.5 * step * step, step);
        let q = g * g.transpose() * (a * a);
        let mut p = q * 100.0 + Matrix2::identity() * (resolved * step * step).powi(2);
        let mut found = Vec::new();
        for _ in 0..20_000 {
            let before = p;
            p = f * p * f.transpose() + q;
            found.clear();
            // One after another, as if they came in this order.
            let mut first = p;
            for (k, h, r) in &sensors {
                let s = (h.transpose() * first * h)[0] + r;
                let gain = first * h / s;
                found.push((*k, gain, (h.transpose() * p * h)[0] + r));
                first -= gain * (h.transpose() * first);
            }
            p = first;
            if (p - before).abs().max() <= 1e-9 * p.abs().max() {
                break;
            }
        }
        // The same gains on a model that errs by the noise of its inputs only.
        let driving: f64 = (coordinate.driven.iter())
            .map(|(input, factor)| (factor * noise.get(*input).copied().unwrap_or(0.0)).powi(2))
            .sum();
        let q = g * g.transpose() * driving;
        let mut keep = Matrix2::identity();
        let mut own = Matrix2::zeros();
        for ((_, gain, _), (_, h, r)) in found.iter().zip(&sensors) {
            keep -= gain * h.transpose();
            own += gain * gain.transpose() * *r;
        }
        for _ in 0..20_000 {
            let before = p;
            p = keep * (f * p * f.transpose() + q) * keep.transpose() + own;
            if (p - before).abs().max() <= 1e-9 * p.abs().max() {
                break;
            }
        }
        let p = f * p * f.transpose() + q;
        for ((_, _, s), (_, h, r)) in found.iter_mut().zip(&sensors) {
            *s = (h.transpose() * p * h)[0] + r;
        }
        for (k, gain, s) in found {
            let share = if gain[0] > 0.0 { gain[0].min(1.0) } else { 0.01 };
            all[k] = Some(Gain {
                coordinate: c,
                position: gain[0],
                velocity: gain[1],
                deviation: s.sqrt(),
                memory: (6.0 * step / share).max(10.0 * step),
            });
        }
    }
    all
}

pub(crate) fn median_step(t: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_identification::run::Channel;

    #[test]
    fn gains_are_those_of_the_alpha_beta_filter() {
        // Kalata (1984): lambda^2 = beta^2 / (1 - alpha), beta = 2 (2 - alpha) - 4 sqrt(1 - alpha).
        let t: Vec<f64> = (0..100).map(|i| f64::from(i) * 0.01).collect();
        let channel =
            Channel { output: joint::output::MOTOR_ANGLE, y: t.clone(), t, sigma: 0.2, ..Channel::default() };
        let run = Run { channels: vec![channel], ..Run::default() };
        let coordinates = joint_coordinates(true, &[1.0; joint::parameter::COUNT]);
        for lambda in [0.003, 0.1, 1.0] {
            let g = gains(&run, &coordinates, &[lambda, lambda], &[])[0].unwrap();
            let (alpha, beta) = (g.position, g.velocity * 0.01);
            assert!((beta - (2.0 * (2.0 - alpha) - 4.0 * (1.0 - alpha).sqrt())).abs() < 1e-4 * beta);
            assert!((lambda * lambda - beta * beta / (1.0 - alpha)).abs() < 1e-3 * lambda * lambda);
            // Bar-Shalom et al. (2001), noise of an alpha-beta filter: variances of the filtered position and velocity
            // and their covariance, carried one step on.
            let d = alpha * (4.0 - beta - 2.0 * alpha);
            let (p, pv, v) = (
                (2.0 * alpha * alpha + beta * (2.0 - 3.0 * alpha)) / d,
                beta * (2.0 * alpha - beta) / d,
                2.0 * beta * beta / d,
            );
            let expected = 0.2 * (1.0 + p + 2.0 * pv + v).sqrt();
            assert!((g.deviation / expected - 1.0).abs() < 1e-3, "{} {expected}", g.deviation);
        }
    }
}
