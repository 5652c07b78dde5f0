//! Runs of an arm: RK4 at a fixed step, torques held; where a motor stops or breaks away, the step is cut by bisection.

use super::chain::JOINTS;
use super::plant::{HeldArm, HeldInstant, HeldMode};
use super::values::{HeldArmState, RATE};

/// Cuts of a step in halves where something happens in it.
const HALVES: usize = 26;
/// Events within a step, at the most.
const EVENTS: usize = 40;

/// A run under way, with a record of every step.
pub(crate) struct HeldArmRun {
    pub(crate) arm: HeldArm,
    pub(crate) time: f64,
    pub(crate) state: HeldArmState,
    modes: [HeldMode; JOINTS],
    held: Vec<(f64, [f64; JOINTS])>,
    step: f64,
    pub(crate) track: Vec<(f64, HeldArmState)>,
}

impl HeldArmRun {
    /// From this state at time `time` with steps of at most `step` s.
    pub(crate) fn new(mut arm: HeldArm, time: f64, state: HeldArmState, step: f64) -> Self {
        arm.rest(&state);
        let modes = std::array::from_fn(|j| match state[RATE + arm.values.motor(j)] {
            0.0 => HeldMode::Stuck,
            v => HeldMode::Slides(v.signum()),
        });
        let held = vec![(time, [0.0; JOINTS])];
        Self { arm, time, state, modes, held, step, track: vec![(time, state)] }
    }

    fn instant(&self, t: f64, x: &HeldArmState) -> HeldInstant {
        let past = |j: usize, s: f64| {
            let at = self.held.iter().rev().find(|(begin, _)| *begin <= s);
            at.map_or(self.held[0].1[j], |(_, u)| u[j])
        };
        self.arm.instant(t, x, &self.modes, past)
    }

    fn rk4(&self, h: f64, first: &HeldArmState) -> HeldArmState {
        let (t, x) = (self.time, &self.state);
        let along = |k: &HeldArmState, s: f64| -> HeldArmState { std::array::from_fn(|i| x[i] + s * k[i]) };
        let k1 = first;
        let k2 = self.instant(t + 0.5 * h, &along(k1, 0.5 * h)).rates;
        let k3 = self.instant(t + 0.5 * h, &along(&k2, 0.5 * h)).rates;
        let k4 = self.instant(t + h, &along(&k3, h)).rates;
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// All motors are still in their modes at `x`.
    fn stays(&self, t: f64, x: &HeldArmState) -> bool {
        let mut stuck = false;
        for (j, mode) in self.modes.iter().enumerate() {
            match mode {
                HeldMode::Stuck => stuck = true,
                HeldMode::Slides(way) if x[RATE + self.arm.values.motor(j)] * way >= 0.0 => {}
                HeldMode::Slides(_) => return false,
            }
        }
        !stuck || self.instant(t, x).holds.iter().all(|(applied, limit)| applied.abs() <= *limit)
    }

    /// Lets go, one after the other, of motors that friction cannot hold; the instant then.
    fn release(&mut self) -> HeldInstant {
        loop {
            let now = self.instant(self.time, &self.state);
            let over = |j: &usize| {
                let (applied, limit) = now.holds[*j];
                self.modes[*j] == HeldMode::Stuck && applied.abs() > limit
            };
            let most = (0..JOINTS).filter(over).max_by(|a, b| {
                let excess = |j: usize| now.holds[j].0.abs() - now.holds[j].1;
                excess(*a).total_cmp(&excess(*b))
            });
            match most {
                Some(j) => self.modes[j] = HeldMode::Slides(now.holds[j].0.signum()),
                None => return now,
            }
        }
    }

    /// A step of `h` s.
    fn advance(&mut self, mut h: f64) {
        for _ in 0..EVENTS {
            let first = self.release().rates;
            let x = self.rk4(h, &first);
            if !x.iter().all(|v| v.is_finite()) || self.stays(self.time + h, &x) {
                return self.accept(h, x);
            }
            let (mut low, mut high) = (0.0, h);
            for _ in 0..HALVES {
                let middle = 0.5 * (low + high);
                if self.stays(self.time + middle, &self.rk4(middle, &first)) {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let x = self.rk4(high, &first);
            self.accept(high, x);
            self.stop(0.0);
            h -= high;
            if h <= 0.0 {
                return;
            }
        }
        // Chatter within one step: what hardly moves is held for the rest of it.
        self.stop(1e-6);
        let x = self.rk4(h, &self.instant(self.time, &self.state).rates);
        self.accept(h, x);
    }

    /// Motors that have turned back, or are slower than this, are stuck.
    fn stop(&mut self, slow: f64) {
        for j in 0..JOINTS {
            let at = RATE + self.arm.values.motor(j);
            if let HeldMode::Slides(way) = self.modes[j]
                && (self.state[at] * way < 0.0 || self.state[at].abs() < slow)
            {
                self.state[at] = 0.0;
                self.modes[j] = HeldMode::Stuck;
            }
        }
    }

    fn accept(&mut self, h: f64, x: HeldArmState) {
        self.time += h;
        self.state = x;
        self.arm.commit(&x);
    }

    /// On to `until` under these torques.
    pub(crate) fn hold(&mut self, until: f64, u: [f64; JOINTS]) {
        self.held.push((self.time, u));
        let length = until - self.time;
        if length <= 0.0 {
            return;
        }
        let steps = (length / self.step).ceil().max(1.0) as usize;
        let begin = self.time;
        for i in 1..=steps {
            let to = if i == steps { until } else { begin + length * i as f64 / steps as f64 };
            self.advance(to - self.time);
            self.track.push((self.time, self.state));
        }
    }
}

/// State `index` at `t`, on the line between two steps.
pub(crate) fn at(track: &[(f64, HeldArmState)], t: f64, index: usize) -> f64 {
    let i = track.partition_point(|s| s.0 < t);
    if i == 0 {
        return track[0].1[index];
    }
    let Some((b, y)) = track.get(i) else { return track[track.len() - 1].1[index] };
    let (a, x) = &track[i - 1];
    let s = if b > a { (t - a) / (b - a) } else { 1.0 };
    x[index] * (1.0 - s) + y[index] * s
}
