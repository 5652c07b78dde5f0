//! Typical sizes of a joint and its recordings: what is large for this torque, this speed, this deflection.

use trueup_estimation::run::Run;
use trueup_models::effect::Measure;
use trueup_models::joint::{input, output, parameter as q};

/// Typical sizes of a joint and its recordings.
#[derive(Clone, Debug)]
pub struct Sizes {
    torque: f64,
    crest: f64,
    speed: f64,
    angle: f64,
    stiffness: f64,
    mode: f64,
    gear: f64,
    load_inertia: f64,
    duration: f64,
    ranges: [f64; output::COUNT],
}

impl Sizes {
    /// Of recordings about trajectories, with these parameters.
    pub fn new(runs: &[Run], p: &[f64], flexible: bool) -> Self {
        let rms = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v * v, n + 1.0));
            f64::sqrt(sum / f64::max(count, 1.0)).max(1e-12)
        };
        let torque = rms(&mut runs
            .iter()
            .flat_map(|r| &r.recording.inputs)
            .map(|u| u[input::MOTOR_CURRENT] * p[q::TORQUE_CONSTANT]));
        let peak = runs.iter().flat_map(|r| &r.recording.inputs).map(|u| u[input::MOTOR_CURRENT].abs());
        let crest = peak.fold(0.0, f64::max) * p[q::TORQUE_CONSTANT] / torque;
        let speed = rms(&mut runs.iter().flat_map(|r| &r.trajectory).map(|x| x[1]));
        let n = p[q::GEAR_RATIO];
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) =
                values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (f64::min(a, v), f64::max(b, v)));
            (high - low).max(1e-12)
        };
        let angle = range(&mut runs.iter().flat_map(|r| &r.trajectory).map(|x| (x[0] - x[2]) / n));
        // A rigid joint's spring, if it has one: a motor mode of some 15 Hz.
        let stiffness = if flexible { p[q::STIFFNESS] } else { p[q::MOTOR_INERTIA] * 94.0f64.powi(2) };
        let mode = (stiffness * (1.0 / p[q::MOTOR_INERTIA] + n * n / p[q::LOAD_INERTIA])).sqrt();
        let duration = runs.iter().map(|r| r.recording.dt * r.recording.nodes() as f64).fold(0.0, f64::max);
        let mut ranges = [1.0; output::COUNT];
        for (output, to) in ranges.iter_mut().enumerate() {
            let channels = || runs.iter().filter_map(|r| r.recording.channel(output));
            if channels().next().is_some() {
                *to = range(&mut channels().flat_map(|c| c.samples.iter().flatten()).map(|s| s.value));
            }
        }
        Self {
            torque,
            crest,
            speed,
            angle,
            stiffness,
            mode,
            gear: n,
            load_inertia: p[q::LOAD_INERTIA],
            duration,
            ranges,
        }
    }
    /// Typical motor torque, N.m.
    pub fn torque(&self) -> f64 {
        self.torque
    }
    /// Largest motor torque, in units of the typical one.
    pub fn crest(&self) -> f64 {
        self.crest
    }
    /// Typical torques at the places.
    pub fn torques(&self) -> [f64; 2] {
        [self.torque, self.torque * self.gear]
    }
    /// A size; of a reading: that of `output`.
    pub fn get(&self, m: Measure, output: Option<usize>) -> f64 {
        let deflection = self.torque / self.stiffness;
        match m {
            Measure::Torque => self.torque,
            Measure::Speed => self.speed,
            Measure::Deflection => deflection,
            Measure::DeflectionRate => deflection * self.mode * 0.1,
            Measure::LoadTorque => self.torque * self.gear,
            Measure::LoadAngle => self.angle,
            Measure::LoadSpeed => self.speed / self.gear,
            Measure::LoadInertia => self.load_inertia,
            Measure::Duration => self.duration,
            Measure::Mode => self.mode,
            Measure::Reading => output.map_or(1.0, |o| self.ranges[o]),
            _ => 1.0,
        }
    }
}
