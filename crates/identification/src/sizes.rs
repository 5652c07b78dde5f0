//! Typical sizes of a plant and its recordings: what is large for this torque, this speed, this deflection.

use std::collections::BTreeMap;

use trueup_models::effect::{self, Measure};
use trueup_models::{arm, joint};

use crate::run::{IdentificationRun, OutputChannel};

/// A plant with values of its parameters, and recordings of it.
#[derive(Clone, Copy, Debug)]
pub struct Rig<'a> {
    /// Which plant.
    pub plant: effect::PlantKind,
    /// Which of its joints have a spring.
    pub flexible: &'a [bool],
    /// Its parameters, those of effects behind.
    pub values: &'a [f64],
    /// Recordings.
    pub runs: &'a [&'a IdentificationRun],
}

/// Typical sizes of a plant and its recordings.
#[derive(Clone, Debug)]
pub struct TypicalSizes {
    typical: BTreeMap<(usize, u8), f64>,
    /// Typical reading range per output.
    ranges: BTreeMap<usize, f64>,
    duration: f64,
}

impl TypicalSizes {
    /// Of a plant in these recordings.
    pub fn of(rig: &Rig<'_>) -> Self {
        let mut s = Self { typical: BTreeMap::new(), ranges: BTreeMap::new(), duration: 0.0 };
        for run in rig.runs {
            let ends = run.channels.iter().filter_map(|c| Some((*c.t.first()?, *c.t.last()?)));
            for (a, b) in ends {
                s.duration = s.duration.max(b - a);
            }
            for channel in &run.channels {
                let e = s.ranges.entry(channel.output).or_insert(0.0);
                *e = e.max(range(&channel.y));
            }
        }
        match rig.plant {
            effect::PlantKind::Joint => s.joint(rig),
            effect::PlantKind::Arm | effect::PlantKind::Space => s.arm(rig),
        }
        s
    }
    fn set(&mut self, site: usize, m: Measure, v: f64) {
        if v.is_finite() && v > 0.0 {
            self.typical.insert((site, m as u8), v);
        }
    }
    /// A size at a site; 1 where nothing is known.
    pub fn get(&self, site: usize, m: Measure) -> f64 {
        match m {
            Measure::Duration => self.duration.max(1e-3),
            _ => self.typical.get(&(site, m as u8)).copied().unwrap_or(1.0),
        }
    }
    /// Range of the readings of an output.
    pub fn range(&self, output: usize) -> f64 {
        self.ranges.get(&output).copied().unwrap_or(1.0)
    }

    fn joint(&mut self, rig: &Rig<'_>) {
        use joint::{input, output as o, parameter as q};
        let v = rig.values;
        let n = v[q::GEAR_RATIO];
        // A rigid joint's spring, if it has one: a motor mode of some 15 Hz.
        let rigid = v[q::MOTOR_INERTIA] * 94.0f64.powi(2);
        let k = if rig.flexible[0] { v[q::STIFFNESS] } else { rigid };
        let find =
            |output: usize| rig.runs.iter().flat_map(|r| &r.channels).filter(move |c| c.output == output);
        let speed = speed_of(find(o::MOTOR_ANGLE))
            .or_else(|| rms_of(find(o::MOTOR_VELOCITY)))
            .or_else(|| speed_of(find(o::LOAD_ANGLE)).map(|s| s * n))
            .or_else(|| rms_of(find(o::LOAD_VELOCITY)).map(|s| s * n))
            .unwrap_or(1.0);
        let angle = if self.ranges.contains_key(&o::LOAD_ANGLE) {
            self.range(o::LOAD_ANGLE)
        } else {
            self.range(o::MOTOR_ANGLE) / n
        };
        let mut torque = v[q::TORQUE_CONSTANT] * rms_input(rig.runs, input::MOTOR_CURRENT);
        if torque == 0.0 {
            torque = torque_of_motion(v[q::MOTOR_INERTIA] + v[q::LOAD_INERTIA] / (n * n), speed, n * angle);
        }
        let mode = (k * (1.0 / v[q::MOTOR_INERTIA] + n * n / v[q::LOAD_INERTIA])).sqrt();
        let deflection = torque / k;
        for (m, value) in [
            (Measure::Torque, torque),
            (Measure::Speed, speed),
            (Measure::Deflection, deflection),
            (Measure::DeflectionRate, deflection * mode * 0.1),
            (Measure::LoadTorque, torque * n),
            (Measure::LoadAngle, angle),
            (Measure::LoadSpeed, speed / n),
            (Measure::LoadInertia, v[q::LOAD_INERTIA]),
            (Measure::Mode, mode),
        ] {
            self.set(0, m, value);
        }
    }

    fn arm(&mut self, rig: &Rig<'_>) {
        use arm::{input as i, output as o, parameter as q};
        let n = rig.flexible.len();
        let v = rig.values;
        let find =
            |output: usize| rig.runs.iter().flat_map(|r| &r.channels).filter(move |c| c.output == output);
        let mass = v[q::base_mass(n)] + v[q::link_mass(n)..][..n].iter().sum::<f64>();
        let base_inertia = v[q::base_inertia(n)];
        let mut torques: Vec<f64> = (0..n).map(|j| rms_input(rig.runs, i::joint_torque(n) + j)).collect();
        if torques.iter().all(|t| *t == 0.0) {
            let moved = |j: usize| {
                speed_of(find(o::joint_angle(n) + j)).zip(self.ranges.get(&(o::joint_angle(n) + j)))
            };
            let torque = |j: usize| {
                moved(j)
                    .map_or(0.0, |(speed, range)| torque_of_motion(v[q::link_inertia(n) + j], speed, *range))
            };
            torques = (0..n).map(torque).collect();
        }
        let most = torques.iter().fold(0.0f64, |m, t| m.max(*t)).max(1e-6);
        let base_speed =
            (0..2).filter_map(|a| speed_of(find(o::base_position(n) + a))).fold(0.0, f64::max).max(1e-4);
        let base_rate = speed_of(find(o::base_attitude(n))).unwrap_or(1e-3);
        for j in 0..n {
            let speed =
                speed_of(find(o::joint_angle(n) + j)).or_else(|| speed_of(find(o::motor_angle(n) + j)));
            let speed = speed.unwrap_or(base_rate).max(1e-4);
            let torque = torques[j].max(0.02 * most);
            let inertia = v[q::link_inertia(n) + j].max(1e-9);
            // A rigid joint's spring, if it has one: a link's mode of some 1.5 Hz.
            let k = match rig.flexible[j] {
                true => v[q::joint_stiffness(n) + j].max(1e-6),
                false => inertia * 10f64.powi(2),
            };
            let mode = (k / inertia).sqrt();
            // Only the rate of a deflection goes by the heavier end of the spring, which swings slower.
            let slow = (k / v[q::motor_inertia(n) + j].max(inertia)).sqrt();
            let deflection = torque / k;
            let angle = self.range(o::joint_angle(n) + j);
            for (m, value) in [
                (Measure::Torque, torque),
                (Measure::Speed, speed),
                (Measure::Deflection, deflection),
                (Measure::DeflectionRate, deflection * slow * 0.1),
                (Measure::LoadTorque, torque),
                (Measure::LoadAngle, angle),
                (Measure::LoadSpeed, speed),
                (Measure::LoadInertia, inertia),
                (Measure::Mode, mode),
                (Measure::Force, mass * base_speed * base_speed / 0.05 + most),
                (Measure::Position, self.range(o::base_position(n)).max(self.range(o::base_position(n) + 1))),
                (Measure::Velocity, base_speed),
                (Measure::BaseTorque, most),
                (Measure::BaseAngle, self.range(o::base_attitude(n))),
                (Measure::BaseRate, base_rate),
                (Measure::BaseInertia, base_inertia),
                (Measure::Mass, mass),
            ] {
                self.set(j, m, value);
            }
        }
    }
}

/// What a sine of that speed (root mean square) and range takes of torque where it is not recorded, N.m.
fn torque_of_motion(inertia: f64, speed: f64, range: f64) -> f64 {
    inertia * 2.0 * speed * speed / range
}

/// From the smallest to the largest value.
pub fn range(y: &[f64]) -> f64 {
    y.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v)) - y.iter().fold(f64::INFINITY, |m, v| m.min(*v))
}
fn rms_input(runs: &[&IdentificationRun], input: usize) -> f64 {
    let all = runs.iter().flat_map(|r| &r.drives).filter(|d| d.input == input).flat_map(|d| &d.u);
    let (mut sum, mut count) = (0.0, 0.0f64);
    all.for_each(|u| (sum, count) = (sum + u * u, count + 1.0));
    (sum / count.max(1.0)).sqrt()
}
fn rms_of<'a>(channels: impl Iterator<Item = &'a OutputChannel>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    channels.flat_map(|c| &c.y).for_each(|y| (sum, count) = (sum + y * y, count + 1.0));
    (count > 0.0).then(|| f64::sqrt(sum / count))
}
/// Typical speed.
fn speed_of<'a>(channels: impl Iterator<Item = &'a OutputChannel>) -> Option<f64> {
    let (sum, count) =
        channels.map(|c| rates(&c.t, &c.y)).fold((0.0, 0.0), |all, one| (all.0 + one.0, all.1 + one.1));
    (count > 0.0).then(|| f64::sqrt(sum / count))
}

/// Sum of the squares of a series' rates, over at least 50 ms each, and how many there are.
pub fn rates(t: &[f64], y: &[f64]) -> (f64, f64) {
    let (mut sum, mut count, mut k) = (0.0, 0.0, 0);
    for i in 0..t.len() {
        if t[i] - t[k] >= 0.05 {
            sum += ((y[i] - y[k]) / (t[i] - t[k])).powi(2);
            count += 1.0;
            k = i;
        }
    }
    (sum, count)
}
