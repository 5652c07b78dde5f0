//! Runs of an arm: RK4 at a fixed step, torques held.

use super::plant::{ArmState, LINKS, TrialArm};

/// A run under way, with a record of every step.
pub(crate) struct ArmRun {
    pub(crate) arm: TrialArm,
    pub(crate) time: f64,
    pub(crate) state: ArmState,
    held: Vec<(f64, [f64; LINKS])>,
    step: f64,
    pub(crate) track: Vec<(f64, ArmState)>,
}

impl ArmRun {
    pub(crate) fn new(mut arm: TrialArm, time: f64, state: ArmState, step: f64) -> Self {
        arm.rest(&state);
        Self { arm, time, state, held: vec![(time, [0.0; LINKS])], step, track: vec![(time, state)] }
    }

    fn rk4(&self, h: f64) -> ArmState {
        let (t, x) = (self.time, &self.state);
        let past = |j: usize, s: f64| {
            let at = self.held.iter().rev().find(|(begin, _)| *begin <= s);
            at.map_or(self.held[0].1[j], |(_, u)| u[j])
        };
        let along = |k: &ArmState, s: f64| -> ArmState { std::array::from_fn(|i| x[i] + s * k[i]) };
        let k1 = self.arm.rates(t, x, past);
        let k2 = self.arm.rates(t + 0.5 * h, &along(&k1, 0.5 * h), past);
        let k3 = self.arm.rates(t + 0.5 * h, &along(&k2, 0.5 * h), past);
        let k4 = self.arm.rates(t + h, &along(&k3, h), past);
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// On to `until` under these torques.
    pub(crate) fn hold(&mut self, until: f64, u: [f64; LINKS]) {
        self.held.push((self.time, u));
        let length = until - self.time;
        if length <= 0.0 {
            return;
        }
        let steps = (length / self.step).ceil().max(1.0) as usize;
        let begin = self.time;
        for i in 1..=steps {
            let to = if i == steps { until } else { begin + length * i as f64 / steps as f64 };
            let x = self.rk4(to - self.time);
            (self.time, self.state) = (to, x);
            self.arm.commit(&x);
            self.track.push((to, x));
        }
    }
}

/// State `index` at `t`, on the line between two steps.
pub(crate) fn at(track: &[(f64, ArmState)], t: f64, index: usize) -> f64 {
    let i = track.partition_point(|s| s.0 < t);
    if i == 0 {
        return track[0].1[index];
    }
    let Some((b, y)) = track.get(i) else { return track[track.len() - 1].1[index] };
    let (a, x) = &track[i - 1];
    let s = if b > a { (t - a) / (b - a) } else { 1.0 };
    x[index] * (1.0 - s) + y[index] * s
}
