//! The control law as a hybrid model: continuous or sampled, for n joints.

use super::{Strategy, adaptation, input, law::ControlledJoint, output, parameter, state};
use crate::sampling::{is_due, last_sample, next_sample, set_next_sample};
use trueup_numerics::{
    Scalar,
    hybrid::{At, EventUpdate, Hybrid, ModelSizes},
};

/// Modes: the states were set from the inputs (0, 1); number of the next sample, high and low part; per joint
/// the limit reached (-1, 0, +1; 0 while sampled); per joint whether there is excitation to learn from (0, 1; 0 while
/// sampled).
const INITIALISED: usize = 0;
const SAMPLE: usize = 1;
const SATURATION: usize = 3;

/// The control law for each of `joints` joints; inputs, outputs, states and parameters variable by variable.
///
/// Behind the inputs of [`input`] is a torque per joint that is added, load-referred, in N.m.
///
/// Outputs: the torque on each motor in N.m, limited; with `gearRatio` 1 and `torqueConstant` 1 that is the
/// load-referred torque itself. Then the wave frequency used of each joint, and whether it adapts.
///
/// Rates follow the frozen modes. Outputs are limited by their value, which is the same where the modes fit,
/// and right also where inputs have jumped and no event was handled yet; for the same reason, an output at an
/// instant with a sample due is what the sample will give.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ManipulatorController {
    /// Number of joints, at least 1.
    pub joints: usize,
}

fn gather<T: Scalar, const K: usize>(v: &[T], n: usize, j: usize) -> [T; K] {
    core::array::from_fn(|i| v[i * n + j])
}

fn scatter<T: Scalar>(values: &[T], to: &mut [T], n: usize, j: usize) {
    for (i, v) in values.iter().enumerate() {
        to[i * n + j] = *v;
    }
}

impl ManipulatorController {
    pub(super) fn period<T: Scalar>(&self, p: &[T]) -> T {
        p[parameter::COUNT * self.joints]
    }

    pub(super) fn strategy<T: Scalar>(&self, p: &[T]) -> Strategy {
        Strategy::from_number(p[parameter::COUNT * self.joints + 1].value()).unwrap_or(Strategy::PPi)
    }

    /// Joint `j`; before the first update with the states that it will set.
    fn joint<T: Scalar>(&self, x: &[T], u: &[T], p: &[T], modes: &[i32], j: usize) -> ControlledJoint<T> {
        let n = self.joints;
        let omega =
            self.adaptation(x, u, p, modes, j).map_or(p[parameter::WAVE_FREQUENCY * n + j], |a| a.used());
        // Of one joint by itself there is none.
        let feedforward = u.get(input::COUNT * n + j).copied().unwrap_or_default();
        let (strategy, p, u) = (self.strategy(p), gather(p, n, j), gather(u, n, j));
        let mut joint = ControlledJoint { strategy, p, u, x: gather(x, n, j), omega, feedforward };
        if modes[INITIALISED] == 0 {
            joint.x = joint.initial_states();
        }
        joint
    }

    /// The adaptation of joint `j`, if it adapts; before the first update with the states that it will set.
    fn adaptation<T: Scalar>(
        &self,
        x: &[T],
        u: &[T],
        p: &[T],
        modes: &[i32],
        j: usize,
    ) -> Option<adaptation::AdaptiveJoint<T>> {
        use adaptation::{Adaptation, parameter as a};
        let n = self.joints;
        if !self.strategy(p).adapts() || p[a::first(n) + a::RATE * n + j].value() <= 0.0 {
            return None;
        }
        let own: [T; a::COUNT] = gather(&p[a::first(n)..], n, j);
        let (load, motor) = (u[input::LOAD_ANGLE * n + j], u[input::MOTOR_ANGLE * n + j]);
        let schedule = Adaptation::from_number(own[a::ADAPTATION].value()) == Some(Adaptation::Schedule);
        let mut joint = adaptation::AdaptiveJoint {
            p: own,
            x: gather(&x[adaptation::state::first(n)..], n, j),
            start: p[parameter::WAVE_FREQUENCY * n + j],
            load,
            twist: motor / p[parameter::GEAR_RATIO * n + j] - load,
            scheduled: schedule.then(|| {
                let angle = u[input::LOAD_ANGLE * n + self.schedule_joint(p, j)];
                let row = |first: usize| core::array::from_fn(|k| p[first + j * adaptation::KNOTS + k]);
                adaptation::scheduled(&row(a::schedule_angle(n)), &row(a::schedule_frequency(n)), angle)
            }),
        };
        if modes[INITIALISED] == 0 {
            joint.x = joint.initial_states();
        }
        Some(joint)
    }

    /// Index (from 0) of the joint over whose angle the schedule of joint `j` runs.
    fn schedule_joint<T: Scalar>(&self, p: &[T], j: usize) -> usize {
        let n = self.joints;
        let number = p.get(adaptation::parameter::schedule_joint(n) + j).map(|number| number.value());
        // A number that `check` would have refused is the joint itself.
        number.map(|number| number as usize).filter(|k| (1..=n).contains(k)).map_or(j, |k| k - 1)
    }
}

impl Hybrid for ManipulatorController {
    fn sizes(&self) -> ModelSizes {
        let n = self.joints;
        ModelSizes {
            states: (state::COUNT + adaptation::state::COUNT) * n,
            inputs: (input::COUNT + 1) * n,
            parameters: adaptation::parameter::end(n),
            outputs: output::COUNT * n,
            modes: SATURATION + 2 * n,
            indicators: 3 * n,
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
            set_next_sample(&mut modes[SAMPLE..], last_sample(at.t, period));
        }
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        dx.fill(T::zero());
        if self.period(at.p).value() > 0.0 {
            return;
        }
        let n = self.joints;
        let (law, adapting) = dx.split_at_mut(adaptation::state::first(n));
        for j in 0..n {
            let joint = self.joint(at.x, at.u, at.p, at.modes, j);
            let adaptation = self.adaptation(at.x, at.u, at.p, at.modes, j);
            let moving = adaptation.map(|a| a.rates(at.modes[SATURATION + n + j] > 0));
            let growth = moving.map(|dx| dx[adaptation::state::OFFSET] / joint.omega);
            scatter(&joint.rates(at.modes[SATURATION + j], growth), law, n, j);
            moving.iter().for_each(|dx| scatter(dx, adapting, n, j));
        }
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let period = self.period(at.p).value();
        let held = period > 0.0 && !is_due(at.t.value(), period, &at.modes[SAMPLE..]);
        let n = self.joints;
        for j in 0..n {
            let joint = self.joint(at.x, at.u, at.p, at.modes, j);
            y[output::COMMAND * n + j] = if held {
                joint.x[state::HELD_OUTPUT]
            } else {
                let command = joint.command();
                command.limited() / command.per_output
            };
            let (mut omega, mut active) = (joint.omega, false);
            if let Some(mut a) = self.adaptation(at.x, at.u, at.p, at.modes, j) {
                if period > 0.0 && !held {
                    a.x = a.sample(self.period(at.p));
                }
                omega = a.used();
                active = a.active(if period > 0.0 {
                    a.margin().value() > 0.0
                } else {
                    at.modes[SATURATION + n + j] > 0
                });
            }
            y[output::WAVE_FREQUENCY_USED * n + j] = omega;
            y[output::ADAPTATION_ACTIVE * n + j] = T::constant(f64::from(active));
        }
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        z.fill(T::one());
        if self.period(at.p).value() > 0.0 {
            return;
        }
        let n = self.joints;
        for j in 0..n {
            let margins = self.joint(at.x, at.u, at.p, at.modes, j).command().margins();
            scatter(&margins, z, n, j);
            if let Some(a) = self.adaptation(at.x, at.u, at.p, at.modes, j)
                && a.scheduled.is_none()
            {
                z[2 * n + j] = a.margin();
            }
        }
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let n = self.joints;
        let mut change = EventUpdate::default();
        if modes[INITIALISED] == 0 {
            for j in 0..n {
                let initial = self.joint(x, u, p, modes, j).x;
                let adapting = self.adaptation(x, u, p, modes, j).map(|a| a.x);
                scatter(&initial, x, n, j);
                if let Some(adapting) = adapting {
                    scatter(&adapting, &mut x[adaptation::state::first(n)..], n, j);
                }
            }
            modes[INITIALISED] = 1;
            change = EventUpdate { modes: true, states: true };
        }
        let period = self.period(p);
        if is_due(t, period, &modes[SAMPLE..]) {
            for j in 0..n {
                let adapting = self.adaptation(x, u, p, modes, j).map(|a| a.sample(period));
                let joint = self.joint(x, u, p, modes, j);
                let omega = p[parameter::WAVE_FREQUENCY * n + j];
                let next = adapting.map(|a| omega + a[adaptation::state::OFFSET]);
                scatter(&joint.sample(period, next), x, n, j);
                if let Some(adapting) = adapting {
                    scatter(&adapting, &mut x[adaptation::state::first(n)..], n, j);
                }
            }
            set_next_sample(&mut modes[SAMPLE..], last_sample(t, period) + 1.0);
            change = EventUpdate { modes: true, states: true };
        }
        if period > 0.0 {
            return change;
        }
        for j in 0..n {
            let [above, below] = self.joint(x, u, p, modes, j).command().margins();
            let saturation = i32::from(above <= 0.0) - i32::from(below <= 0.0);
            change.modes |= saturation != modes[SATURATION + j];
            modes[SATURATION + j] = saturation;
            let adaptation = self.adaptation(x, u, p, modes, j).filter(|a| a.scheduled.is_none());
            let gate = i32::from(adaptation.is_some_and(|a| a.margin() > 0.0));
            change.modes |= gate != modes[SATURATION + n + j];
            modes[SATURATION + n + j] = gate;
        }
        change
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        let period = self.period(p);
        (period > 0.0).then(|| next_sample(&modes[SAMPLE..]) * period)
    }
}
