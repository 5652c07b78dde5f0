//! A recording along the smoothed trajectory: series by node, and motion within the steps.

use std::cell::OnceCell;

use trueup_estimation::innovations::numeric::sign;

use super::drive::DriveAlong;
use super::operator::dahl;
use super::place::{JointPlace, MotionInStep};
use super::spline::CubicSpline;

/// Values at moments of a recording: at nodes, or at the middles of the parts of each step.
#[derive(Clone, Debug, Default)]
pub struct JointMotion {
    /// Time since the first node, s.
    pub time: Vec<f64>,
    /// Angle of the motor.
    pub motor: Vec<f64>,
    /// Its speed; 0 where the frame has it at rest.
    pub motor_speed: Vec<f64>,
    /// Angle of the link.
    pub link: Vec<f64>,
    /// Its speed.
    pub link_speed: Vec<f64>,
    /// Twist.
    pub twist: Vec<f64>,
    /// Rate of twist.
    pub twist_rate: Vec<f64>,
    /// Torque of the spring as the model has it, N.m.
    pub torque: Vec<f64>,
    /// Sign of the nominal plant's dry friction; empty: the frame has none.
    pub sign: Vec<f64>,
}

impl JointMotion {
    /// A value at each moment.
    pub fn each(&self, f: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.time.len()).map(f).collect()
    }
}

/// Position and rate of a coordinate at the middles of the parts of each step.
#[derive(Clone, Debug, Default)]
pub struct CoordinateMotion {
    /// Position.
    pub position: Vec<f64>,
    /// Rate.
    pub rate: Vec<f64>,
}

/// A recording along the trajectory.
#[derive(Clone, Debug, Default)]
pub struct RunAlong {
    /// Times of nodes since the first one, s.
    pub times: Vec<f64>,
    /// Step after each node, s; the last one repeated.
    pub steps: Vec<f64>,
    /// Parts of a step.
    pub parts: usize,
    /// Positions by coordinate and node.
    pub positions: Vec<Vec<f64>>,
    /// Rates by coordinate and node.
    pub rates: Vec<Vec<f64>>,
    /// The model's own accelerations at both ends of each step, by coordinate; empty: no law of this plant needs them.
    pub accelerations: Vec<[Vec<f64>; 2]>,
    /// Signs of the nominal plant's dry friction by node; empty: it has none.
    pub signs: Vec<f64>,
    /// Mean time of the readings after their node, by channel, s.
    pub moments: Vec<Vec<f64>>,
    /// What channels of the tip show, by channel; of others empty.
    pub shown: Vec<Vec<f64>>,
    /// Drives, by joint.
    pub drives: Vec<DriveAlong>,
    /// Forces of the hypothesis in hand, by coordinate and node; empty: none.
    pub own_forces: Vec<Vec<f64>>,
    /// Reading errors of the hypothesis in hand, by channel and node; empty: none.
    pub own_readings: Vec<Vec<f64>>,
    /// Motion of each joint at nodes and within steps, as it is needed.
    pub(super) joints: Vec<[OnceCell<JointMotion>; 2]>,
    /// Motion of each coordinate within steps, as it is needed.
    pub(super) coordinates: Vec<OnceCell<CoordinateMotion>>,
    pub(super) splines: Vec<OnceCell<CubicSpline>>,
}

impl RunAlong {
    /// Of these series, the rest empty.
    pub fn new(
        times: Vec<f64>,
        steps: Vec<f64>,
        parts: usize,
        positions: Vec<Vec<f64>>,
        rates: Vec<Vec<f64>>,
    ) -> Self {
        Self { times, steps, parts, positions, rates, ..Self::default() }
    }
    /// Motion is computed again where it is needed.
    pub(super) fn forget_motion(&mut self, joints: usize, channels: usize) {
        self.joints = vec![Default::default(); joints];
        self.coordinates = vec![OnceCell::new(); self.positions.len()];
        self.splines = vec![OnceCell::new(); channels];
    }
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.times.len()
    }
    /// A series by node.
    pub fn by_node(&self, f: impl Fn(usize) -> f64) -> Vec<f64> {
        (0..self.nodes()).map(f).collect()
    }
    /// The node after a node; the last one has none.
    pub(super) fn next(&self, node: usize) -> usize {
        (node + 1).min(self.nodes() - 1)
    }
    /// Values at the middles of the parts of all steps.
    fn by_part(&self, f: impl Fn(usize, f64) -> f64) -> Vec<f64> {
        let x = |part: usize| (part as f64 + 0.5) / self.parts as f64;
        (0..self.nodes())
            .flat_map(|t| (0..self.parts).map(move |p| (t, p)))
            .map(|(t, p)| f(t, x(p)))
            .collect()
    }
    /// A series on straight lines between nodes, at the middles of the parts.
    pub fn straight(&self, series: &[f64]) -> Vec<f64> {
        self.by_part(|t, x| series[t] + (series[self.next(t)] - series[t]) * x)
    }
    /// Positions on cubics between nodes, at the middles of the parts.
    fn cubic(&self, q: &[f64], v: &[f64]) -> Vec<f64> {
        self.by_part(|t, x| {
            let (h, n) = (hermite(x), self.next(t));
            if n == t {
                q[t]
            } else {
                q[t] * h[0] + q[n] * h[2] + self.steps[t] * (v[t] * h[1] + v[n] * h[3])
            }
        })
    }
    /// Means over the steps of values by part.
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        let parts = values.len() / self.nodes().max(1);
        values.chunks_exact(parts.max(1)).map(|c| c.iter().sum::<f64>() / parts as f64).collect()
    }
    /// Motion of a coordinate within the steps.
    pub fn within(&self, coordinate: usize) -> &CoordinateMotion {
        self.coordinates[coordinate].get_or_init(|| {
            let (q, v) = (&self.positions[coordinate], &self.rates[coordinate]);
            CoordinateMotion { position: self.cubic(q, v), rate: self.straight(v) }
        })
    }
    /// Times at the middles of the parts, since the first node, s.
    pub fn part_times(&self) -> Vec<f64> {
        self.by_part(|t, x| self.times[t] + self.steps[t] * x)
    }

    /// Lengths of the parts of all steps, s.
    pub fn part_lengths(&self) -> Vec<f64> {
        self.by_part(|t, _| self.steps[t] / self.parts as f64)
    }
    /// The model's own acceleration of a coordinate, linear within each step, at the middles of the parts.
    pub fn acceleration_within(&self, coordinate: usize) -> Vec<f64> {
        let [begin, end] = &self.accelerations[coordinate];
        self.by_part(|t, x| begin[t] + (end[t] - begin[t]) * x)
    }

    pub(super) fn joint_at_nodes(&self, j: &JointPlace) -> JointMotion {
        let [motor, link] = [j.motor, j.link].map(|c| (self.positions[c].clone(), self.rates[c].clone()));
        let mut m =
            JointMotion { time: self.times.clone(), sign: self.signs.clone(), ..JointMotion::default() };
        m.twist = difference(&motor.0, &link.0);
        m.twist_rate = difference(&motor.1, &link.1);
        (m.motor, m.motor_speed, m.link, m.link_speed) = (motor.0, motor.1, link.0, link.1);
        m.with_torque(j)
    }
    pub(super) fn joint_within(&self, j: &JointPlace, motion: MotionInStep) -> JointMotion {
        let (motor, link) = (self.within(j.motor).clone(), self.within(j.link).clone());
        let mut m = JointMotion { time: self.part_times(), ..JointMotion::default() };
        (m.motor, m.motor_speed, m.link, m.link_speed) =
            (motor.position, motor.rate, link.position, link.rate);
        if motion == MotionInStep::Straight {
            let twist = difference(&self.positions[j.motor], &self.positions[j.link]);
            m.twist = self.straight(&twist);
        } else {
            m.twist = difference(&m.motor, &m.link);
        }
        m.twist_rate = difference(&m.motor_speed, &m.link_speed);
        if let [_, ..] = self.signs[..] {
            let at = |i: usize| {
                let t = i / self.parts;
                (self.signs[t], self.signs[self.next(t)])
            };
            m.sign = m.each(|i| match at(i) {
                (a, b) if a * b < 0.0 => sign(m.motor_speed[i]),
                (a, b) => 0.5 * (a + b),
            });
            m.motor_speed = m.each(|i| if at(i) == (0.0, 0.0) { 0.0 } else { m.motor_speed[i] });
        }
        m.with_torque(j)
    }
}

impl JointMotion {
    /// Sign of dry friction: of the frame's own dry pair, or Dahl's operator of a length along the motor's angle.
    pub fn sliding(&self, length: Option<f64>) -> Vec<f64> {
        length.map_or_else(|| self.sign.clone(), |x| dahl(&self.motor, x))
    }
    fn with_torque(mut self, j: &JointPlace) -> Self {
        self.torque = self.each(|i| j.stiffness * self.twist[i] + j.damping * self.twist_rate[i]);
        self
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// Values of the cubic with value and slope at both ends: of the first value and slope, then of the second.
pub(super) fn hermite(x: f64) -> [f64; 4] {
    let y = 1.0 - x;
    [(1.0 + 2.0 * x) * y * y, x * y * y, x * x * (3.0 - 2.0 * x), x * x * (x - 1.0)]
}
