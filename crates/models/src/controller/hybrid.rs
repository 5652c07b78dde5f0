//! The control law as a hybrid model: continuous or sampled, for n joints.

use super::{Strategy, input, law::Joint, parameter, state};
use trueup_numerics::{
    Scalar,
    hybrid::{At, Hybrid, Sizes, Update},
};

/// Modes: the states were set from the inputs (0, 1); number of the next sample, high and low part; per joint
/// the limit reached (-1, 0, +1; 0 while sampled).
const INITIALISED: usize = 0;
const SAMPLE: usize = 1;
const SATURATION: usize = 3;
const LOW_BITS: u32 = 30;

/// The control law for each of `joints` joints; inputs, outputs, states and parameters variable by variable.
///
/// Outputs: the torque on each motor in N.m, limited. With `gearRatio` 1 and `torqueConstant` 1 that is the
/// load-referred torque itself.
///
/// Rates follow the frozen modes. Outputs are limited by their value, which is the same where the modes fit,
/// and right also where inputs have jumped and no event was handled yet; for the same reason, an output at an
/// instant with a sample due is what the sample will give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ManipulatorController {
    /// Number of joints, at least 1.
    pub joints: usize,
}

/// The control law for one joint; the output is the motor's current in A, limited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JointController;

fn gather<T: Scalar, const K: usize>(v: &[T], n: usize, j: usize) -> [T; K] {
    core::array::from_fn(|i| v[i * n + j])
}

fn scatter<T: Scalar>(values: &[T], to: &mut [T], n: usize, j: usize) {
    for (i, v) in values.iter().enumerate() {
        to[i * n + j] = *v;
    }
}

/// A time short of a sample instant by this share of the period counts as that instant: what adding up a
/// step, again and again, makes of k T_s.
const EARLY: f64 = 1e-6;

/// The last sample instant at or before `t` is this times `period`.
fn last_sample(t: f64, period: f64) -> f64 {
    (t / period + EARLY).floor()
}

fn next_sample(modes: &[i32]) -> f64 {
    f64::from(modes[SAMPLE]) * f64::from(1u32 << LOW_BITS) + f64::from(modes[SAMPLE + 1])
}

fn set_next_sample(modes: &mut [i32], number: f64) {
    let high = (number / f64::from(1u32 << LOW_BITS)).floor();
    modes[SAMPLE] = high as i32;
    modes[SAMPLE + 1] = (number - high * f64::from(1u32 << LOW_BITS)) as i32;
}

impl ManipulatorController {
    fn period<T: Scalar>(&self, p: &[T]) -> T {
        p[parameter::COUNT * self.joints]
    }

    fn strategy<T: Scalar>(&self, p: &[T]) -> Strategy {
        Strategy::from_number(p[parameter::COUNT * self.joints + 1].value()).unwrap_or(Strategy::PPi)
    }

    /// Joint `j`; before the first update with the states that it will set.
    fn joint<T: Scalar>(&self, x: &[T], u: &[T], p: &[T], modes: &[i32], j: usize) -> Joint<T> {
        let n = self.joints;
        let (strategy, p, u) = (self.strategy(p), gather(p, n, j), gather(u, n, j));
        let mut joint = Joint { strategy, p, u, x: gather(x, n, j) };
        if modes[INITIALISED] == 0 {
            joint.x = joint.initial_states();
        }
        joint
    }

    /// Whether a sample is due at `t`.
    fn due(&self, t: f64, p: &[f64], modes: &[i32]) -> bool {
        let period = self.period(p);
        period > 0.0 && last_sample(t, period) >= next_sample(modes)
    }

    /// Conditions between parameters, on top of the bounds of each: the index of the parameter and what is
    /// wrong with it.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        let n = self.joints;
        let (at, period) = (parameter::COUNT * n, self.period(p));
        if Strategy::from_number(p[at + 1]).is_none() {
            let number = p[at + 1];
            return Err((
                at + 1,
                format!("strategy is {number}: choose 1 (P_PI), 2 (WBC), 3 (VWBC) or 4 (VWBC_WASHOUT)"),
            ));
        }
        if self.strategy(p) == Strategy::PPi {
            return Ok(());
        }
        for j in 0..n {
            let omega = p[parameter::WAVE_FREQUENCY * n + j];
            if omega * period > super::waves::LARGEST_STEP {
                let longest = super::waves::LARGEST_STEP / omega;
                return Err((
                    at,
                    format!(
                        "samplePeriod {period} s is too long for the waves of joint {} at waveFrequency {omega} \
                         rad/s, whose sampled filters would be unstable: take at most {longest:.3e} s",
                        j + 1
                    ),
                ));
            }
        }
        Ok(())
    }
}

impl Hybrid for ManipulatorController {
    fn sizes(&self) -> Sizes {
        let n = self.joints;
        Sizes {
            states: state::COUNT * n,
            inputs: input::COUNT * n,
            parameters: parameter::COUNT * n + 2,
            outputs: n,
            modes: SATURATION + n,
            indicators: 2 * n,
        }
    }

    fn start<T: Scalar>(&self, _p: &[T], x: &mut [T]) {
        // The waves start from the inputs: see `update`.
        x.fill(T::zero());
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        modes.fill(0);
        let period = self.period(at.p);
        if period > 0.0 {
            set_next_sample(modes, last_sample(at.t, period));
        }
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        if self.period(at.p).value() > 0.0 {
            dx.fill(T::zero());
            return;
        }
        for j in 0..self.joints {
            let joint = self.joint(at.x, at.u, at.p, at.modes, j);
            scatter(&joint.rates(at.modes[SATURATION + j]), dx, self.joints, j);
        }
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let period = self.period(at.p).value();
        let held = period > 0.0 && last_sample(at.t.value(), period) < next_sample(at.modes);
        for j in 0..self.joints {
            let joint = self.joint(at.x, at.u, at.p, at.modes, j);
            y[j] = if held {
                joint.x[state::HELD_OUTPUT]
            } else {
                let command = joint.command();
                command.limited() / command.per_output
            };
        }
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z.fill(T::one());
        if self.period(at.p).value() > 0.0 {
            return;
        }
        for j in 0..self.joints {
            let margins = self.joint(at.x, at.u, at.p, at.modes, j).command().margins();
            scatter(&margins, z, self.joints, j);
        }
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> Update {
        let n = self.joints;
        let mut change = Update::default();
        if modes[INITIALISED] == 0 {
            for j in 0..n {
                let initial = self.joint(x, u, p, modes, j).x;
                scatter(&initial, x, n, j);
            }
            modes[INITIALISED] = 1;
            change = Update { modes: true, states: true };
        }
        let period = self.period(p);
        if self.due(t, p, modes) {
            for j in 0..n {
                let next = self.joint(x, u, p, modes, j).sample(period);
                scatter(&next, x, n, j);
            }
            set_next_sample(modes, last_sample(t, period) + 1.0);
            change = Update { modes: true, states: true };
        }
        if period > 0.0 {
            return change;
        }
        for j in 0..n {
            let [above, below] = self.joint(x, u, p, modes, j).command().margins();
            let saturation = i32::from(above <= 0.0) - i32::from(below <= 0.0);
            change.modes |= saturation != modes[SATURATION + j];
            modes[SATURATION + j] = saturation;
        }
        change
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let period = self.period(p);
        (period > 0.0).then(|| next_sample(modes) * period)
    }
}

const ONE: ManipulatorController = ManipulatorController { joints: 1 };

impl JointController {
    /// As [`ManipulatorController::check`].
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        ONE.check(p)
    }
}

trueup_numerics::delegate_hybrid!(JointController { _ => ONE });
