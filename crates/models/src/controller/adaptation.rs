//! The wave frequency as it adapts: by a schedule over an angle, or by recursive least squares from the encoders.
//!
//! A load of inertia J behind a spring K obeys J θ1'' = K δ with δ = θ0 − θ1, so that K/J is the slope of a straight
//! line. Both sides go through the same stable band pass F, so that nothing is differentiated, and a constant
//! load, the pose and a slow motion are washed out:
//!
//! ```text
//! F = s/(s + ω_l) (ω_u/(s + ω_u))²,   y = s² F θ1,   φ = F δ,   both over the threshold     (CTL-9)
//! e' = ω_l (φ² − e),   the gate is open while e > 1                                        (CTL-10)
//! P_yφ' = λ (y φ − P_yφ),   P_φφ' = λ (φ² − P_φφ),   held while the gate is shut            (CTL-11)
//! target = ratio √(P_yφ/P_φφ), projected on [min, max]                                     (CTL-12)
//! ω_n' = λ (target − ω_n), held while the gate is shut                                     (CTL-13)
//! ```
//!
//! CTL-11 is recursive least squares of one coefficient with exponential forgetting; P starts at the wave
//! frequency with the weight of a twist at the threshold, so P_φφ never vanishes. CTL-10 is its dead zone: without
//! excitation sensors show their resolution, not the joint. Whatever is measured, ω_n stays within [min, max]
//! and moves by λ (max − min) per second at most.

use trueup_numerics::Scalar;

/// Knots of a schedule.
pub const KNOTS: usize = 9;

/// Order of the parameters that each joint has: parameter i of joint j is at `first(n) + i * n + j`.
pub mod parameter {
    use super::KNOTS;
    use crate::controller;

    /// See [`super::Adaptation`]: 1 schedule, 2 estimate.
    pub const ADAPTATION: usize = 0;
    /// λ in 1/s; 0: ω_n stays, and none of this is evaluated.
    pub const RATE: usize = 1;
    /// Least ω_n in rad/s.
    pub const MIN: usize = 2;
    /// Largest ω_n in rad/s.
    pub const MAX: usize = 3;
    /// ω_n over the estimated mode.
    pub const RATIO: usize = 4;
    /// Root mean square in rad of the filtered twist below which nothing is learnt.
    pub const THRESHOLD: usize = 5;
    /// Parameters per joint; behind them the schedules.
    pub const COUNT: usize = 6;

    /// The first one, behind the sample period and the strategy.
    pub const fn first(n: usize) -> usize {
        controller::parameter::COUNT * n + 2
    }
    /// Angles of the knots in rad: knot k of joint j at `schedule_angle(n) + j * KNOTS + k`.
    pub const fn schedule_angle(n: usize) -> usize {
        first(n) + COUNT * n
    }
    /// ω_n at the knots in rad/s, likewise.
    pub const fn schedule_frequency(n: usize) -> usize {
        schedule_angle(n) + KNOTS * n
    }
    /// Number (from 1) of the joint over whose angle the schedule runs, per joint; a single joint has none.
    pub const fn schedule_joint(n: usize) -> usize {
        schedule_frequency(n) + KNOTS * n
    }
    /// Behind the last one.
    pub const fn end(n: usize) -> usize {
        schedule_joint(n) + if n > 1 { n } else { 0 }
    }
}

/// Order of the states: state i of joint j is at `first(n) + i * n + j`.
pub mod state {
    use crate::controller;

    /// ω_n less the parameter `waveFrequency`, in rad/s.
    pub const OFFSET: usize = 0;
    /// Lags in rad that make s² F of θ1: one at ω_l, two at ω_u.
    pub const LOAD: usize = 1;
    /// Lags in rad that make F of δ: one at ω_l, two at ω_u.
    pub const TWIST: usize = 4;
    /// e.
    pub const EXCITATION: usize = 7;
    /// P_yφ in 1/s².
    pub const CORRELATION: usize = 8;
    /// P_φφ.
    pub const POWER: usize = 9;
    /// States per joint.
    pub const COUNT: usize = 10;

    /// The first one, behind those of the law.
    pub const fn first(n: usize) -> usize {
        controller::state::COUNT * n
    }
}

/// Where the wave frequency comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adaptation {
    /// From a table over an angle.
    Schedule = 1,
    /// From motor and load encoder.
    Estimate = 2,
}

impl Adaptation {
    /// The kind with that number (1 or 2).
    pub fn from_number(number: f64) -> Option<Self> {
        [Self::Schedule, Self::Estimate].into_iter().find(|a| f64::from(*a as u8) == number)
    }
}

/// The table at `angle`: linear between the knots, held beyond the first and the last one. `angles` ascend.
pub fn scheduled<T: Scalar>(angles: &[T; KNOTS], frequencies: &[T; KNOTS], angle: T) -> T {
    let last = KNOTS - 1;
    if angle <= angles[0] {
        return frequencies[0];
    }
    if angle >= angles[last] {
        return frequencies[last];
    }
    // `angle` is within: at the latest the last knot is above it.
    let k = (1..last).find(|k| angle < angles[*k]).unwrap_or(last);
    let share = (angle - angles[k - 1]) / (angles[k] - angles[k - 1]);
    frequencies[k - 1] + (frequencies[k] - frequencies[k - 1]) * share // (CTL-14)
}

/// One joint that adapts (λ > 0) at one instant; arrays in the order of [`parameter`] and [`state`].
#[derive(Clone, Copy, Debug)]
pub struct AdaptiveJoint<T> {
    /// Parameters of the joint.
    pub p: [T; parameter::COUNT],
    /// States of the joint.
    pub x: [T; state::COUNT],
    /// The parameter `waveFrequency` in rad/s.
    pub start: T,
    /// θ1 in rad.
    pub load: T,
    /// δ = θ0 − θ1 in rad.
    pub twist: T,
    /// The value of the schedule, in rad/s; `None`: estimate.
    pub scheduled: Option<T>,
}

/// First order lag of `u` over `exponent` time constants with `u` held.
fn lag<T: Scalar>(y: T, u: T, exponent: T) -> T {
    u + (y - u) * (-exponent).exp()
}

impl<T: Scalar> AdaptiveJoint<T> {
    /// Within [min, max].
    fn projected(&self, omega: T) -> T {
        omega.max(self.p[parameter::MIN]).min(self.p[parameter::MAX])
    }

    /// ω_n that the waves use, in rad/s.
    pub fn used(&self) -> T {
        self.projected(self.start + self.x[state::OFFSET])
    }

    /// Whether ω_n moves, with the gate open or not.
    pub fn active(&self, gate: bool) -> bool {
        gate || self.scheduled.is_some()
    }

    /// The gate is open where this is > 0.
    pub fn margin(&self) -> T {
        self.x[state::EXCITATION] - 1.0
    }

    /// At rest with the present twist; the least squares as if `start` had been measured.
    pub fn initial_states(&self) -> [T; state::COUNT] {
        let mut x = [T::zero(); state::COUNT];
        if self.scheduled.is_none() {
            x[state::LOAD] = self.load;
            x[state::TWIST] = self.twist;
            x[state::CORRELATION] = (self.start / self.p[parameter::RATIO]).powi(2);
            x[state::POWER] = T::one();
        }
        x
    }

    /// ω_l and ω_u: modes are looked for where the bounds of ω_n allow them.
    fn corners(&self) -> [T; 2] {
        [parameter::MIN, parameter::MAX].map(|i| self.p[i] / self.p[parameter::RATIO])
    }

    /// What ω_n goes to, by the least squares or by the schedule.
    fn target(&self, correlation: T, power: T) -> T {
        let omega = self.scheduled.unwrap_or_else(|| {
            // A slope < 0 is no mode: the projection takes it to the lower bound.
            (correlation / power).max(T::zero()).sqrt() * self.p[parameter::RATIO]
        });
        self.projected(omega) // (CTL-12)
    }

    /// What enters the lags of θ1, and what leaves the last one as a high pass: s² F θ1 over ω_u².
    fn load_chain(&self) -> [T; 4] {
        let [a, b, c] = core::array::from_fn(|i| self.x[state::LOAD + i]);
        [self.load, self.load - a, self.load - a - b, self.load - a - b - c]
    }

    /// Rates of the states of the continuous law.
    pub fn rates(&self, gate: bool) -> [T; state::COUNT] {
        let (mut dx, x) = ([T::zero(); state::COUNT], &self.x);
        let ([low, high], rate) = (self.corners(), self.p[parameter::RATE]);
        let active = self.active(gate);
        if self.scheduled.is_none() {
            let (load, twist) = (self.load_chain(), self.twist - x[state::TWIST]);
            dx[state::LOAD] = low * load[1];
            dx[state::LOAD + 1] = high * load[2];
            dx[state::LOAD + 2] = high * load[3];
            dx[state::TWIST] = low * twist;
            dx[state::TWIST + 1] = high * (twist - x[state::TWIST + 1]);
            dx[state::TWIST + 2] = high * (x[state::TWIST + 1] - x[state::TWIST + 2]);
            let [y, phi] =
                [load[3] * high * high, x[state::TWIST + 2]].map(|v| v / self.p[parameter::THRESHOLD]); // (CTL-9)
            dx[state::EXCITATION] = low * (phi * phi - x[state::EXCITATION]); // (CTL-10)
            if active {
                dx[state::CORRELATION] = rate * (y * phi - x[state::CORRELATION]); // (CTL-11)
                dx[state::POWER] = rate * (phi * phi - x[state::POWER]);
            }
        }
        if active {
            let target = self.target(x[state::CORRELATION], x[state::POWER]);
            dx[state::OFFSET] = rate * (target - self.used()); // (CTL-13)
        }
        dx
    }

    /// The states after a sample of period `h` in s.
    ///
    /// Each lag is exact for a held input and stable for any period. High passes by `u − lag` and low passes of the
    /// same lag differ by (z − 1)/(1 − E): with one low pass taken after its step and one before, y is the second
    /// central difference of what φ is made of, over h² and without any delay between the two.
    pub fn sample(&self, h: T) -> [T; state::COUNT] {
        let mut x = self.x;
        let ([low, high], rate) = (self.corners(), self.p[parameter::RATE] * h);
        if self.scheduled.is_none() {
            let load = self.load_chain();
            for (i, corner) in [low, high, high].into_iter().enumerate() {
                x[state::LOAD + i] = lag(x[state::LOAD + i], load[i], corner * h);
            }
            let twist = self.twist - x[state::TWIST];
            x[state::TWIST] = lag(x[state::TWIST], self.twist, low * h);
            x[state::TWIST + 1] = lag(x[state::TWIST + 1], twist, high * h);
            let per_second = (-(-high * h).exp() + 1.0) / h;
            let [y, phi] = [load[3] * per_second * per_second, x[state::TWIST + 2]]
                .map(|v| v / self.p[parameter::THRESHOLD]);
            x[state::TWIST + 2] = lag(x[state::TWIST + 2], x[state::TWIST + 1], high * h);
            x[state::EXCITATION] = lag(x[state::EXCITATION], phi * phi, low * h);
            // The gate as it is now, so that the learnt value and the reported one agree.
            if self.active(x[state::EXCITATION] > T::one()) {
                x[state::CORRELATION] = lag(x[state::CORRELATION], y * phi, rate);
                x[state::POWER] = lag(x[state::POWER], phi * phi, rate);
            }
        }
        if self.active(x[state::EXCITATION] > T::one()) {
            let target = self.target(x[state::CORRELATION], x[state::POWER]);
            x[state::OFFSET] = lag(self.used(), target, rate) - self.start;
        }
        x
    }
}
