//! The law at one instant: rates of the joints for the hands' references, torques for those rates.

use super::super::composite::BASE;
use super::super::model::SpatialFreeFlyer;
use super::super::vector::{three, times, transposed_times};
use super::super::{MAX_BODIES, MAX_TIPS};
use super::inverse::{MAX_ROWS, TaskJacobian, damping};
use super::layout::BaseControl;
use super::pose::{BaseSix, ControlledPose, RobotMeasurements};
use trueup_numerics::Scalar;

/// What the user sets.
#[derive(Clone, Copy, Debug)]
pub(super) struct ControlSettings<'a, T> {
    pub(super) base: BaseControl,
    /// Six per tip.
    pub(super) weight: &'a [T],
    pub(super) threshold: T,
    pub(super) damping: T,
    /// Per joint.
    pub(super) rate_limit: &'a [T],
    pub(super) velocity_gain: &'a [T],
    pub(super) tracking_gain: &'a [T],
    pub(super) torque_limit: &'a [T],
    /// Velocity gain, tracking gain, limit of the torque.
    pub(super) of_base: [T; 3],
}

/// References.
#[derive(Clone, Copy, Debug)]
pub(super) struct ControlReferences<'a, T> {
    /// Six per tip, inertial axes.
    pub(super) tips: &'a [T],
    pub(super) joints: &'a [T],
    pub(super) torques: &'a [T],
    /// Base axes.
    pub(super) base: [T; 3],
}

/// Rates that the joints are to have.
#[derive(Clone, Debug)]
pub(super) struct ResolvedRates<T> {
    pub(super) rates: [T; MAX_BODIES],
    /// Six per tip, inertial axes: reference less what the rates give.
    pub(super) error: [T; MAX_ROWS],
    pub(super) smallest: T,
    pub(super) damping: T,
}

/// Torques on joints and base, and rates of the integrals of the errors.
#[derive(Clone, Debug)]
pub(super) struct SpaceCommand<T> {
    pub(super) torques: [T; MAX_BODIES],
    /// Inertial axes.
    pub(super) base_torque: [T; 3],
    pub(super) tracking: [T; MAX_BODIES],
    pub(super) base_tracking: [T; 3],
}

/// The robot with its settings at one instant.
pub(super) struct ControlLaw<'a, T> {
    pub(super) plant: &'a SpatialFreeFlyer,
    /// Of the robot.
    pub(super) p: &'a [T],
    pub(super) measured: RobotMeasurements<'a, T>,
    pub(super) settings: ControlSettings<'a, T>,
    pub(super) reference: ControlReferences<'a, T>,
    pub(super) pose: &'a ControlledPose<T>,
}

/// How the base answers: its motion is `own` less the joints' rates times `by_joint`.
struct BaseAnswer<T> {
    own: BaseSix<T>,
    by_joint: [BaseSix<T>; MAX_BODIES],
}

fn within<T: Scalar>(value: T, limit: T) -> T {
    value.min(limit).max(-limit)
}

/// The motion of a tip: without the joints' rates, and by each of them.
fn motion<T: Scalar>(own: &BaseSix<T>, jacobian: &[BaseSix<T>], rates: &[T]) -> BaseSix<T> {
    core::array::from_fn(|row| {
        jacobian.iter().zip(rates).fold(own[row], |sum, (column, rate)| sum + column[row] * *rate)
    })
}

impl<T: Scalar> ControlLaw<'_, T> {
    fn base_answer(&self) -> BaseAnswer<T> {
        let n = self.plant.structure().bodies();
        let mut answer = BaseAnswer { own: [T::zero(); BASE], by_joint: [[T::zero(); BASE]; MAX_BODIES] };
        match self.settings.base {
            BaseControl::Free => {
                let mut own = [self.pose.momentum(self.measured.rates)];
                self.pose.by_base_inertia(&mut own);
                answer.own = own[0]; // (CTS-2)
                answer.by_joint = self.pose.coupling;
                self.pose.by_base_inertia(&mut answer.by_joint[..n]);
            }
            BaseControl::Attitude => {
                // P alone is left of the momentum: wheels change the rest. Its matrix is the mass.
                let (momentum, m) = (self.pose.momentum(self.measured.rates), &self.pose.base_inertia);
                answer.own[3..].copy_from_slice(&self.reference.base);
                for i in 0..3 {
                    let turned =
                        (0..3).fold(T::zero(), |sum, k| sum + m[i * BASE + 3 + k] * self.reference.base[k]);
                    answer.own[i] = (momentum[i] - turned) / m[i * (BASE + 1)]; // (CTS-3)
                    for (to, column) in answer.by_joint.iter_mut().zip(&self.pose.coupling).take(n) {
                        to[i] = column[i] / m[i * (BASE + 1)];
                    }
                }
            }
            BaseControl::Moving => answer.own = self.pose.base_motion, // (CTS-4)
            BaseControl::Fixed => {}
        }
        answer
    }

    /// Rates of the joints for the references (CTS-1 to CTS-7).
    pub(super) fn resolved(&self) -> ResolvedRates<T> {
        let (s, weight) = (self.plant.structure(), self.settings.weight);
        let n = s.bodies();
        let answer = self.base_answer();
        let controlled = |a: usize| weight[6 * a..][..6].iter().any(|w| w.value() > 0.0);
        // Joints of arms whose hands are controlled move for them, the others as they are to.
        let mut active = [false; MAX_BODIES];
        for a in (0..s.tips.len()).filter(|a| controlled(*a)) {
            s.tree.arm(s.tips[a]).for_each(|body| active[body - 1] = true);
        }
        let mut rates = [T::zero(); MAX_BODIES];
        rates[..n].copy_from_slice(self.reference.joints);
        let mut jacobian = [[[T::zero(); BASE]; MAX_BODIES]; MAX_TIPS];
        let mut own = [[T::zero(); BASE]; MAX_TIPS];
        let mut error = [T::zero(); MAX_ROWS];
        let mut task = TaskJacobian::new();
        let mut wanted = [T::zero(); MAX_ROWS];
        task.columns = active[..n].iter().filter(|a| **a).count();
        for (a, tip) in s.tips.iter().enumerate() {
            let offset = three(self.p, self.plant.parameter.tip_offset + 3 * a);
            let point = self.pose.point(*tip, offset);
            for body in s.tree.arm(*tip) {
                jacobian[a][body - 1] = self.pose.by_joint(self.plant, body, point);
            }
            for (column, by) in jacobian[a][..n].iter_mut().zip(&answer.by_joint) {
                let carried = self.pose.carried(point, by);
                column.iter_mut().zip(carried).for_each(|(c, carried)| *c -= carried); // (CTS-1)
            }
            own[a] = self.pose.carried(point, &answer.own);
            let given = motion(&own[a], &jacobian[a][..n], &rates);
            for half in 0..2 {
                let reference = three(self.reference.tips, 6 * a + 3 * half);
                let reference = transposed_times(self.pose.rotation(), reference);
                for i in 0..3 {
                    let row = 3 * half + i;
                    error[6 * a + row] = reference[i] - given[row];
                }
            }
            for row in (0..BASE).filter(|row| weight[6 * a + row].value() > 0.0) {
                let (w, k) = (weight[6 * a + row], task.rows);
                wanted[k] = w * error[6 * a + row];
                let columns = (0..n).filter(|j| active[*j]);
                columns.enumerate().for_each(|(c, j)| task.element[k][c] = w * jacobian[a][j][row]);
                task.rows += 1;
            }
        }
        let smallest = task.smallest_singular_value();
        let damping = if task.rows == 0 {
            T::zero()
        } else {
            damping(smallest, self.settings.threshold, self.settings.damping)
        };
        let mut more = [T::zero(); MAX_BODIES];
        let more = &mut more[..task.columns];
        task.solve(damping * damping, &wanted[..task.rows], more);
        let moved = (0..n).filter(|j| active[*j]);
        moved.zip(more.iter()).for_each(|(j, more)| rates[j] += *more); // (CTS-5)
        // All slow down by one factor: the hands keep their direction.
        let share = |j: usize| rates[j].abs() / self.settings.rate_limit[j];
        let most = (0..n).map(share).fold(T::one(), T::max);
        rates.iter_mut().for_each(|r| *r /= most); // (CTS-7)
        for a in 0..s.tips.len() {
            let given = motion(&own[a], &jacobian[a][..n], &rates);
            for half in 0..2 {
                let turned = times(self.pose.rotation(), three(&given, 3 * half));
                for i in 0..3 {
                    let row = 6 * a + 3 * half + i;
                    error[row] = self.reference.tips[row] - turned[i];
                }
            }
        }
        ResolvedRates { rates, error, smallest, damping }
    }

    /// Torques for those rates, with the integrals of the errors so far (CTS-8, CTS-9).
    pub(super) fn command(
        &self,
        resolved: &ResolvedRates<T>,
        tracking: &[T],
        base_tracking: &[T],
    ) -> SpaceCommand<T> {
        let (set, n) = (&self.settings, self.plant.structure().bodies());
        let mut wanted = [T::zero(); MAX_BODIES];
        let error = |j: usize| resolved.rates[j] - self.measured.rates[j];
        for j in 0..n {
            wanted[j] = set.velocity_gain[j] * error(j) + set.tracking_gain[j] * tracking[j]; // (CTS-8)
        }
        let mut base = self.pose.unaccelerated();
        let mut out = SpaceCommand {
            torques: [T::zero(); MAX_BODIES],
            base_torque: [T::zero(); 3],
            tracking: [T::zero(); MAX_BODIES],
            base_tracking: [T::zero(); 3],
        };
        let of_base: [T; 3] = core::array::from_fn(|i| self.reference.base[i] - self.pose.base_motion[3 + i]);
        let controlled = set.base == BaseControl::Attitude;
        match set.base {
            BaseControl::Free => {
                base = [T::zero(); BASE];
                let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
                let mut answer = [core::array::from_fn(|i| -met[i])];
                self.pose.by_base_inertia(&mut answer); // (CTS-8)
                base = answer[0];
            }
            BaseControl::Attitude => {
                base = [T::zero(); BASE];
                for i in 0..3 {
                    base[3 + i] = set.of_base[0] * of_base[i] + set.of_base[1] * base_tracking[i];
                }
                let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
                (0..3).for_each(|i| base[i] = -met[i] / self.pose.base_inertia[i * (BASE + 1)]);
            }
            BaseControl::Moving | BaseControl::Fixed => {}
        }
        let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
        for j in 0..n {
            let torque = self.reference.torques[j] + met[BASE + j]; // (CTS-8)
            out.torques[j] = within(torque, set.torque_limit[j]); // (CTS-9)
            let lost = (out.torques[j] - torque) / self.pose.joint_inertia[j];
            out.tracking[j] = error(j) + back(lost, set.velocity_gain[j]);
        }
        if controlled {
            let inertia = &self.pose.base_inertia;
            let mut given = [T::zero(); 3];
            for i in 0..3 {
                given[i] = within(met[3 + i], set.of_base[2]); // (CTS-9)
                let lost = (given[i] - met[3 + i]) / inertia[(3 + i) * (BASE + 1)];
                out.base_tracking[i] = of_base[i] + back(lost, set.of_base[0]);
            }
            out.base_torque = times(self.pose.rotation(), given);
        }
        out
    }
}

/// What an integral loses while an acceleration is lost at a limit, so that it does not wind up (CTS-9).
fn back<T: Scalar>(lost: T, gain: T) -> T {
    if gain.value() > 0.0 { lost / gain } else { T::zero() } // (CTS-9)
}
