//! The law at one instant: rates of the joints for the hands' references, torques for those rates.

use super::super::attitude::unit;
use super::super::composite::BASE;
use super::super::model::SpatialFreeFlyer;
use super::super::vector::{add, cross, dot, scale, sub, three, times, transposed_times};
use super::super::{MAX_BODIES, MAX_THRUSTERS, MAX_TIPS};
use super::inverse::{MAX_ROWS, TaskJacobian, damping};
use super::layout::BaseControl;
use super::pose::{BaseSix, ControlledPose, RobotMeasurements};
use super::reactionless::{JointRow, along, axis, not_turning};
use super::thrusters::{ControlledThruster, allocated};
use arrayvec::ArrayVec;
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
    /// What turns the base, if it is no wheels.
    pub(super) thrusters: Option<&'a [ControlledThruster<T>]>,
    /// Axis of a wheel next to them, base axes, or 0.
    pub(super) wheel: [T; 3],
    /// Direction of the force of each tip, inertial axes, and the damping along it.
    pub(super) normal: &'a [T],
    pub(super) contact_damping: &'a [T],
    /// Of the appendages, by the joints and by the base.
    pub(super) vibration: T,
    pub(super) base_vibration: T,
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
    /// Force of each tip on what it touches, N.
    pub(super) forces: &'a [T],
}

/// Rates that the joints are to have.
#[derive(Clone, Debug)]
pub(super) struct ResolvedRates<T> {
    pub(super) rates: [T; MAX_BODIES],
    /// Six per tip, inertial axes: reference less what the rates give.
    pub(super) error: [T; MAX_ROWS],
    pub(super) smallest: T,
    pub(super) damping: T,
    /// Torques of the joints for the forces of the tips.
    pub(super) push: [T; MAX_BODIES],
    /// Accelerations by which the hands stay while what they push moves the base.
    pub(super) yielding: [T; MAX_BODIES],
    /// Torque that keeps the base from turning by those forces, base axes.
    pub(super) base_push: [T; 3],
}

/// Torques on joints and base, and rates of the integrals of the errors.
#[derive(Clone, Debug)]
pub(super) struct SpaceCommand<T> {
    pub(super) torques: [T; MAX_BODIES],
    /// Of wheels, inertial axes.
    pub(super) base_torque: [T; 3],
    /// Of each thruster, N.
    pub(super) thrusters: [T; MAX_THRUSTERS],
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
    /// Integrals of the errors of joints and base.
    pub(super) tracking: &'a [T],
    pub(super) base_tracking: &'a [T],
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
            BaseControl::Free | BaseControl::Reactionless => {
                let mut own = [self.pose.momentum(self.measured.rates)];
                self.pose.by_base_inertia(&mut own);
                answer.own = own[0]; // (CTS-2)
                answer.by_joint = self.pose.coupling;
                self.pose.by_base_inertia(&mut answer.by_joint[..n]);
            }
            BaseControl::Attitude => {
                // P alone is left of the momentum: wheels change the rest. Its matrix is the mass.
                let (momentum, m) = (self.pose.momentum(self.measured.rates), &self.pose.base_inertia);
                let base = self.base_rate();
                answer.own[3..].copy_from_slice(&base);
                for i in 0..3 {
                    let turned = (0..3).fold(T::zero(), |sum, k| sum + m[i * BASE + 3 + k] * base[k]);
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

    /// omega that the base is to have: its reference, and what damps the appendages (CTS-13).
    fn base_rate(&self) -> [T; 3] {
        let damped = if self.settings.base == BaseControl::Attitude {
            self.about_center(&self.pose.bending)
        } else {
            [T::zero(); 3]
        };
        core::array::from_fn(|i| self.reference.base[i] + self.settings.base_vibration * damped[i]) // (CTS-13)
    }

    /// Torque about the whole system's centre of mass of a wrench at the base's.
    fn about_center(&self, wrench: &BaseSix<T>) -> [T; 3] {
        let m = &self.pose.base_inertia;
        core::array::from_fn(|i| {
            (0..3).fold(wrench[3 + i], |sum, k| sum - m[(3 + i) * BASE + k] * wrench[k] / m[0])
        })
    }

    /// The base's acceleration by a wrench on it, the joints still.
    fn yields(&self, wrench: BaseSix<T>) -> BaseSix<T> {
        let mut given = [wrench];
        match self.settings.base {
            BaseControl::Free | BaseControl::Reactionless => self.pose.by_base_inertia(&mut given),
            BaseControl::Attitude => {
                given[0] = core::array::from_fn(|i| {
                    if i < 3 { wrench[i] / self.pose.base_inertia[0] } else { T::zero() }
                });
            }
            BaseControl::Moving | BaseControl::Fixed => given[0] = [T::zero(); BASE],
        }
        given[0]
    }

    /// Rates where the hands leave the joints free, and orthonormal directions in which joints may move for the hands.
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    fn freedom(
        &self,
        answer: &BaseAnswer<T>,
        directions: &mut ArrayVec<JointRow<T>, MAX_BODIES>,
    ) -> JointRow<T> {
        let (s, set) = (self.plant.structure(), &self.settings);
        let n = s.bodies();
        let mut rates = [T::zero(); MAX_BODIES];
        for (j, (rate, by)) in rates.iter_mut().zip(&answer.by_joint).take(n).enumerate() {
            let power = by.iter().zip(&self.pose.bending).fold(T::zero(), |sum, (r, s)| sum + *r * *s);
            *rate = self.reference.joints[j] - set.vibration * power; // (CTS-13)
        }
        if set.base == BaseControl::Reactionless {
            let turning = [3, 4, 5].map(|row| answer.by_joint.map(|column| column[row]));
            let rest = core::array::from_fn(|i| answer.own[3 + i] - self.reference.base[i]);
            not_turning(&turning, rest, &mut rates, n, directions);
            return rates;
        }
        // Joints of arms whose hands are controlled move for them, the others as they are to.
        let mut active = [false; MAX_BODIES];
        let controlled = |a: &usize| set.weight[6 * a..][..6].iter().any(|w| w.value() > 0.0);
        for a in (0..s.tips.len()).filter(controlled) {
            s.tree.arm(s.tips[a]).for_each(|body| active[body - 1] = true);
        }
        directions.extend((0..n).filter(|j| active[*j]).map(axis));
        rates
    }

    /// The direction of a hand's force, base axes, where it has one.
    fn pushes(&self, a: usize) -> Option<[T; 3]> {
        let normal = unit(three(self.settings.normal, 3 * a));
        let pushes = self.reference.forces[a].value() != 0.0;
        pushes.then(|| transposed_times(self.pose.rotation(), normal))
    }

    /// Rates of the joints for the references (CTS-1 to CTS-7, CTS-12 to CTS-14).
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    pub(super) fn resolved(&self) -> ResolvedRates<T> {
        let (s, set) = (self.plant.structure(), &self.settings);
        let (n, weight) = (s.bodies(), set.weight);
        let answer = self.base_answer();
        let mut directions = ArrayVec::new();
        let mut rates = self.freedom(&answer, &mut directions);
        let mut jacobian = [[[T::zero(); BASE]; MAX_BODIES]; MAX_TIPS];
        let (mut own, mut points) = ([[T::zero(); BASE]; MAX_TIPS], [[T::zero(); 3]; MAX_TIPS]);
        let mut error = [T::zero(); MAX_ROWS];
        let mut task = TaskJacobian::new();
        let mut wanted = [T::zero(); MAX_ROWS];
        let (mut push, mut reaction) = ([T::zero(); MAX_BODIES], [T::zero(); BASE]);
        // Acceleration along the normal that the integrals require.
        let mut asked = [[T::zero(); 3]; MAX_TIPS];
        task.columns = directions.len();
        for (a, tip) in s.tips.iter().enumerate() {
            let offset = three(self.p, self.plant.parameter.tip_offset + 3 * a);
            let point = self.pose.point(*tip, offset);
            points[a] = point;
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
            if let Some(normal) = self.pushes(a) {
                let toward = |j: usize| dot(normal, three(&jacobian[a][j], 0));
                let now = motion(&own[a], &jacobian[a][..n], self.measured.rates);
                let slower = dot(normal, three(&error, 6 * a)) - dot(normal, three(&now, 0))
                    + dot(normal, three(&given, 0));
                // Along the normal the hand moves as it does.
                (0..3).for_each(|i| error[6 * a + i] -= slower * normal[i]); // (CTS-14)
                let force = self.reference.forces[a] + set.contact_damping[a] * slower;
                let turn = cross(point, normal);
                for i in 0..3 {
                    reaction[i] -= force * normal[i];
                    reaction[3 + i] -= force * turn[i];
                }
                (0..n).for_each(|j| push[j] += force * toward(j)); // (CTS-14)
                let integral = (0..n)
                    .fold(T::zero(), |sum, j| sum + toward(j) * set.tracking_gain[j] * self.tracking[j]);
                asked[a] = scale(integral, normal);
            }
            for row in (0..BASE).filter(|row| weight[6 * a + row].value() > 0.0) {
                let (w, k) = (weight[6 * a + row], task.rows);
                wanted[k] = w * error[6 * a + row];
                let mut by_rate = [T::zero(); MAX_BODIES];
                by_rate.iter_mut().zip(&jacobian[a][..n]).for_each(|(b, column)| *b = w * column[row]);
                let columns = task.element[k].iter_mut().zip(&directions);
                columns.for_each(|(element, direction)| *element = along(&by_rate, direction));
                task.rows += 1;
            }
        }
        let smallest = task.smallest_singular_value();
        let damping = if task.rows == 0 { T::zero() } else { damping(smallest, set.threshold, set.damping) };
        let along_directions = |task: &TaskJacobian<T>, wanted: &[T], rates: &mut JointRow<T>| {
            let mut shares = [T::zero(); MAX_BODIES];
            task.solve(damping * damping, wanted, &mut shares[..directions.len()]);
            for (share, direction) in shares.iter().zip(&directions) {
                rates.iter_mut().zip(direction).for_each(|(r, d)| *r += *share * *d);
            }
        };
        along_directions(&task, &wanted[..task.rows], &mut rates); // (CTS-5)
        // All slow down by one factor: the hands keep their direction.
        let share = |j: usize| rates[j].abs() / set.rate_limit[j];
        let most = (0..n).map(share).fold(T::one(), T::max);
        rates.iter_mut().for_each(|r| *r /= most); // (CTS-7)
        // What is pushed back moves the base; the hands stay.
        let mut yielding = [T::zero(); MAX_BODIES];
        if (0..s.tips.len()).any(|a| self.pushes(a).is_some()) {
            let moved = self.yields(reaction);
            let mut row = 0;
            for a in 0..s.tips.len() {
                let carried = self.pose.carried(points[a], &moved);
                for i in (0..BASE).filter(|i| weight[6 * a + i].value() > 0.0) {
                    let asked = if i < 3 { asked[a][i] } else { T::zero() };
                    wanted[row] = -weight[6 * a + i] * (carried[i] + asked); // (CTS-14)
                    row += 1;
                }
            }
            along_directions(&task, &wanted[..task.rows], &mut yielding);
        }
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
        let base_push = self.about_center(&reaction).map(|t| -t);
        ResolvedRates { rates, error, smallest, damping, push, yielding, base_push }
    }

    /// Torques for those rates, with the integrals of the errors so far (CTS-8, CTS-9).
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    pub(super) fn command(&self, resolved: &ResolvedRates<T>) -> SpaceCommand<T> {
        let (set, n) = (&self.settings, self.plant.structure().bodies());
        let mut wanted = [T::zero(); MAX_BODIES];
        let error = |j: usize| resolved.rates[j] - self.measured.rates[j];
        for j in 0..n {
            wanted[j] = set.velocity_gain[j] * error(j) + set.tracking_gain[j] * self.tracking[j]; // (CTS-8)
            wanted[j] += resolved.yielding[j];
        }
        let mut base = self.pose.unaccelerated();
        let mut out = SpaceCommand {
            torques: [T::zero(); MAX_BODIES],
            base_torque: [T::zero(); 3],
            thrusters: [T::zero(); MAX_THRUSTERS],
            tracking: [T::zero(); MAX_BODIES],
            base_tracking: [T::zero(); 3],
        };
        let base_rate = self.base_rate();
        let of_base: [T; 3] = core::array::from_fn(|i| base_rate[i] - self.pose.base_motion[3 + i]);
        let controlled = set.base == BaseControl::Attitude;
        match set.base {
            BaseControl::Free | BaseControl::Reactionless => {
                base = [T::zero(); BASE];
                let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
                let mut answer = [core::array::from_fn(|i| -met[i])];
                self.pose.by_base_inertia(&mut answer); // (CTS-8)
                base = answer[0];
            }
            BaseControl::Attitude => {
                base = [T::zero(); BASE];
                for i in 0..3 {
                    base[3 + i] = set.of_base[0] * of_base[i] + set.of_base[1] * self.base_tracking[i];
                }
                let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
                (0..3).for_each(|i| base[i] = -met[i] / self.pose.base_inertia[i * (BASE + 1)]);
            }
            BaseControl::Moving | BaseControl::Fixed => {}
        }
        let met = self.pose.inverse_dynamics(self.plant, &base, &wanted);
        for j in 0..n {
            let torque = self.reference.torques[j] + met[BASE + j] + resolved.push[j]; // (CTS-8, CTS-14)
            out.torques[j] = within(torque, set.torque_limit[j]); // (CTS-9)
            let lost = (out.torques[j] - torque) / self.pose.joint_inertia[j];
            out.tracking[j] = error(j) + back(lost, set.velocity_gain[j]);
        }
        if controlled {
            let inertia = &self.pose.base_inertia;
            let torque = add(three(&met, 3), resolved.base_push);
            let given = match set.thrusters {
                Some(thrusters) => {
                    let by_wheel = scale(within(dot(set.wheel, torque), set.of_base[2]), set.wheel);
                    let (forces, given) = allocated(thrusters, sub(torque, by_wheel));
                    out.thrusters = forces;
                    out.base_torque = times(self.pose.rotation(), by_wheel); // (CTS-10)
                    add(given, by_wheel)
                }
                None => torque.map(|t| within(t, set.of_base[2])), // (CTS-9)
            };
            for i in 0..3 {
                let lost = (given[i] - torque[i]) / inertia[(3 + i) * (BASE + 1)];
                out.base_tracking[i] = of_base[i] + back(lost, set.of_base[0]);
            }
            if set.thrusters.is_none() {
                out.base_torque = times(self.pose.rotation(), given);
            }
        }
        out
    }
}

/// What an integral loses while an acceleration is lost at a limit, so that it does not wind up (CTS-9).
fn back<T: Scalar>(lost: T, gain: T) -> T {
    if gain.value() > 0.0 { lost / gain } else { T::zero() } // (CTS-9)
}
