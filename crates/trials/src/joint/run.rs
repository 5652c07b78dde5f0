//! Runs of a joint: RK4 at a fixed step; where the motor stops or breaks away, the step is cut by bisection.

use super::plant::{StickMode, TrialJoint};
use super::values::JointState;

/// A fine record of a run.
#[derive(Clone, Debug, Default)]
pub(crate) struct Track {
    pub(crate) time: Vec<f64>,
    pub(crate) state: Vec<JointState>,
    /// Torque of the spring, motor side.
    pub(crate) spring: Vec<f64>,
}

impl Track {
    fn push(&mut self, t: f64, x: &JointState, spring: f64) {
        self.time.push(t);
        self.state.push(*x);
        self.spring.push(spring);
    }
    /// motorAngle, loadAngle, motorVelocity, transmissionTorque at `t`, on the line between two steps.
    pub(crate) fn at(&self, t: f64, channel: usize) -> f64 {
        let value = |i: usize| match channel {
            0 => self.state[i][0],
            1 => self.state[i][2],
            2 => self.state[i][1],
            _ => self.spring[i],
        };
        let i = self.time.partition_point(|s| *s < t);
        if i == 0 {
            return value(0);
        }
        if i >= self.time.len() {
            return value(self.time.len() - 1);
        }
        between((self.time[i - 1], value(i - 1)), (self.time[i], value(i)), t)
    }
}

/// At `t`, on the line between two instants with their values.
pub(super) fn between((a, x): (f64, f64), (b, y): (f64, f64), t: f64) -> f64 {
    let s = if b > a { (t - a) / (b - a) } else { 1.0 };
    x * (1.0 - s) + y * s
}

/// A run under way.
pub(crate) struct JointRun {
    pub(crate) joint: TrialJoint,
    pub(crate) time: f64,
    pub(crate) state: JointState,
    pub(super) mode: StickMode,
    /// Commands held since these instants.
    held: Vec<(f64, f64)>,
    step: f64,
    pub(crate) track: Track,
}

impl JointRun {
    /// From this state at time `time` with steps of at most `step` s.
    pub(crate) fn new(mut joint: TrialJoint, time: f64, state: JointState, step: f64) -> Self {
        joint.rest(&state);
        let mode = if state[1] == 0.0 { StickMode::Stuck } else { StickMode::Slides(state[1].signum()) };
        let mut run =
            Self { joint, time, state, mode, held: vec![(time, 0.0)], step, track: Track::default() };
        run.note();
        run
    }

    fn note(&mut self) {
        let spring = self.joint.spring(self.time, &self.state).0;
        self.track.push(self.time, &self.state, spring);
    }

    /// Only `u` is commanded, and was at all times.
    pub(super) fn take(&mut self, u: f64) {
        self.held.clear();
        self.held.push((self.time, u));
    }

    /// The command that held at `t`.
    #[inline]
    fn command(&self, t: f64) -> f64 {
        // The newest first: nearly always it is the one.
        let at = self.held.iter().rev().find(|(begin, _)| *begin <= t);
        at.map_or(self.held[0].1, |(_, u)| *u)
    }

    fn rk4(&self, h: f64, mode: StickMode) -> JointState {
        let (t, x) = (self.time, &self.state);
        let past = |s| self.command(s);
        let along = |k: &JointState, s: f64| -> JointState { std::array::from_fn(|i| x[i] + s * k[i]) };
        let k1 = self.joint.rates(t, x, mode, past);
        let k2 = self.joint.rates(t + 0.5 * h, &along(&k1, 0.5 * h), mode, past);
        let k3 = self.joint.rates(t + 0.5 * h, &along(&k2, 0.5 * h), mode, past);
        let k4 = self.joint.rates(t + h, &along(&k3, h), mode, past);
        std::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// How far the motor is from leaving its mode; negative: it has left.
    fn margin(&self, t: f64, x: &JointState, mode: StickMode) -> f64 {
        match mode {
            StickMode::Slides(way) => x[1] * way,
            StickMode::Stuck => {
                let (applied, limit) = self.joint.hold(t, x, |s| self.command(s));
                limit - applied.abs()
            }
        }
    }

    fn settle(&mut self) {
        self.state[1] = 0.0;
        if self.joint.rigid {
            self.state[3] = 0.0;
        }
        let (applied, limit) = self.joint.hold(self.time, &self.state, |s| self.command(s));
        self.mode =
            if applied.abs() <= limit { StickMode::Stuck } else { StickMode::Slides(applied.signum()) };
    }

    /// A step of `h` s.
    pub(super) fn advance(&mut self, mut h: f64) {
        for _ in 0..20 {
            if self.mode == StickMode::Stuck && self.margin(self.time, &self.state, StickMode::Stuck) < 0.0 {
                self.settle();
            }
            let mode = self.mode;
            let x = self.rk4(h, mode);
            if self.margin(self.time + h, &x, mode) >= 0.0 {
                return self.accept(h, x);
            }
            let (mut low, mut high) = (0.0, h);
            for _ in 0..24 {
                let middle = 0.5 * (low + high);
                let x = self.rk4(middle, mode);
                if self.margin(self.time + middle, &x, mode) >= 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            let x = self.rk4(high, mode);
            self.accept(high, x);
            self.settle();
            h -= high;
            if h <= 0.0 {
                return;
            }
        }
        // Chatter within one step: held for the rest of it.
        self.state[1] = 0.0;
        let x = self.rk4(h, StickMode::Stuck);
        self.accept(h, x);
    }

    fn accept(&mut self, h: f64, x: JointState) {
        self.time += h;
        self.state = x;
        self.joint.commit(&x);
    }

    /// On to `until` under the current `u`.
    pub(crate) fn hold(&mut self, until: f64, u: f64) {
        self.held.push((self.time, u));
        let length = until - self.time;
        if length <= 0.0 {
            return;
        }
        let steps = (length / self.step).ceil().max(1.0);
        let begin = self.time;
        for i in 1..=steps as usize {
            let to = if i == steps as usize { until } else { begin + length * i as f64 / steps };
            self.advance(to - self.time);
            self.note();
        }
    }
}

/// What the joint does from `state` under currents held from each of these times on.
pub(crate) fn replay(
    joint: TrialJoint,
    state: JointState,
    time: &[f64],
    current: &[f64],
    step: f64,
) -> Track {
    let mut run = JointRun::new(joint, time[0], state, step);
    for (pair, u) in time.windows(2).zip(current) {
        run.hold(pair[1], *u);
    }
    run.track
}
