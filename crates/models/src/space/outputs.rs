//! The outputs of [`SpatialFreeFlyer`].

use super::articulated::SweepResult;
use super::attitude::{Quaternion, about_axis, four, normalized, product as turned_by, unit};
use super::composite::momentum;
use super::flexible::Modal;
use super::instant::RobotInstant;
use super::joint_drive::{Moves, Rotor};
use super::measures::Arms;
use super::model::SpatialFreeFlyer;
use super::prescribed::PrescribedAccelerations;
use super::spatial::{Rigid, SpatialFrame};
use super::transmitted::transmitted;
use super::tree::{JointType, Joints, PerBody};
use super::vector::{Vector3, add, cross, dot, scale, sub, three, times, zero};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

impl SpatialFreeFlyer {
    /// Outputs where some accelerations are given; `needed` as of [`Self::rates_with_torques`].
    #[inline(never)]
    pub fn outputs_prescribed<T: Scalar>(
        &self,
        at: At<T>,
        prescribed: PrescribedAccelerations<'_, T>,
        y: &mut [T],
        needed: &mut [T],
    ) {
        let at = &at;
        let mut now = RobotInstant::new();
        now.set(self, at);
        now.prescribe(self, &prescribed);
        let frames = now.frames(self);
        let base = &frames[0];
        let mut put = |begin: usize, values: &[T]| y[begin..][..values.len()].copy_from_slice(values);
        self.moved(at, (&now, &frames), &mut put);
        self.appendages(at, base, &mut put);
        let mut found = Joints::from_iter((0..self.structure().bodies()).map(|_| T::zero()));
        self.reactions(at, &now, &mut put, &mut found);
        let fit = needed.len().min(found.len());
        needed[..fit].copy_from_slice(&found[..fit]);
        self.totals(at, (&now, &frames), &mut put);
        if self.structure().analysis {
            self.analysis(at, &now, &mut put);
        }
        if !self.effects.is_empty() {
            self.effect_outputs(at, &found, y);
        }
    }

    /// The outputs of base, joints and tips alone: what sensors look at.
    pub(super) fn readings<T: Scalar>(&self, at: &At<T>, y: &mut [T]) {
        let mut now = RobotInstant::new();
        now.place(self, at);
        let frames = now.frames(self);
        self.moved(at, (&now, &frames), &mut |begin: usize, values: &[T]| {
            y[begin..][..values.len()].copy_from_slice(values);
        });
    }

    fn moved<T: Scalar>(
        &self,
        at: &At<T>,
        (now, frames): (&RobotInstant<T>, &[SpatialFrame<T>]),
        put: &mut impl FnMut(usize, &[T]),
    ) {
        let (to, base) = (&self.output, &frames[0]);
        put(to.base_position, &base.origin);
        put(to.base_velocity, &times(&base.rotation, now.placed[0].velocity.linear));
        put(to.base_angular_velocity, &now.placed[0].velocity.angular);
        self.joints(at, put);
        self.tips(at, (now, frames), put);
    }

    fn joints<T: Scalar>(&self, at: &At<T>, put: &mut impl FnMut(usize, &[T])) {
        let (to, row) = (&self.output, &self.state);
        for j in 0..self.structure().bodies() {
            let (q, rate) = (at.x[row.joint_angle + j], at.x[row.joint_velocity + j]);
            let motor = self.motor_row(j);
            put(to.joint_angle + j, &[q]);
            put(to.joint_velocity + j, &[rate]);
            put(to.motor_angle + j, &[motor.map_or(q, |m| at.x[m])]);
            put(
                to.motor_velocity + j,
                &[motor.map_or(rate, |m| at.x[row.motor_velocity + m - row.motor_angle])],
            );
        }
    }

    /// Attitudes of all bodies, not as matrices turned back: their signs do not jump.
    pub(super) fn attitudes<T: Scalar>(&self, at: &At<T>, now: &RobotInstant<T>) -> PerBody<Quaternion<T>> {
        let s = self.structure();
        let q = |v: &[T], begin: usize| normalized(four(v, begin));
        let base = if s.held {
            q(at.p, self.parameter.initial_base_quaternion)
        } else {
            q(at.x, self.state.base_quaternion)
        };
        let mut all = PerBody::new();
        all.push(base);
        for i in 1..=s.bodies() {
            let mount = q(at.p, self.parameter.joint_orientation + 4 * (i - 1));
            let parent = s.tree.parent[i - 1];
            let carried = turned_by(turned_by(all[parent], now.end_turn(parent)), mount);
            let own = match s.tree.joint[i - 1] {
                JointType::Prismatic => carried,
                JointType::Revolute => {
                    let axis = unit(three(at.p, self.parameter.joint_axis + 3 * (i - 1)));
                    turned_by(carried, about_axis(axis, at.x[self.state.joint_angle + i - 1]))
                }
            };
            all.push(own);
        }
        all
    }

    fn tips<T: Scalar>(
        &self,
        at: &At<T>,
        (now, frames): (&RobotInstant<T>, &[SpatialFrame<T>]),
        put: &mut impl FnMut(usize, &[T]),
    ) {
        let to = &self.output;
        let attitudes = self.attitudes(at, now);
        put(to.base_quaternion, &attitudes[0]);
        for (a, tip) in self.structure().tips.iter().enumerate() {
            let (frame, velocity) = (&frames[*tip], now.carrier_velocity(*tip));
            let offset = now.displaced(*tip, three(at.p, self.parameter.tip_offset + 3 * a));
            let point = add(velocity.linear, cross(velocity.angular, offset)); // (SFF-7)
            put(to.tip_position + 3 * a, &add(frame.origin, times(&frame.rotation, offset)));
            put(to.tip_quaternion + 4 * a, &turned_by(attitudes[*tip], now.end_turn(*tip)));
            put(to.tip_velocity + 3 * a, &times(&frame.rotation, point));
            put(to.tip_angular_velocity + 3 * a, &times(&frame.rotation, velocity.angular));
        }
    }

    fn appendages<T: Scalar>(&self, at: &At<T>, base: &SpatialFrame<T>, put: &mut impl FnMut(usize, &[T])) {
        let (s, row, to, modes) = (self.structure(), &self.state, &self.output, self.structure().modes());
        let eta = &at.x[row.modal_coordinate..][..modes];
        let rates = &at.x[row.modal_velocity..][..modes];
        let of_base = modes - s.linked();
        put(to.modal_coordinate, &eta[..of_base]);
        put(to.modal_velocity, &rates[..of_base]);
        put(to.link_coordinate, &eta[of_base..]);
        put(to.link_velocity, &rates[of_base..]);
        let mut first = 0;
        for (k, shapes) in s.appendages.iter().enumerate() {
            let tip = self.beam(at, k).tip(*shapes, &eta[first..][..shapes.modes()]);
            put(to.appendage_tip + 3 * k, &add(base.origin, times(&base.rotation, tip)));
            first += shapes.modes();
        }
    }

    fn reactions<T: Scalar>(
        &self,
        at: &At<T>,
        now: &RobotInstant<T>,
        put: &mut impl FnMut(usize, &[T]),
        needed: &mut [T],
    ) {
        let (s, to) = (self.structure(), &self.output);
        let mut joint = Joints::from_iter((0..s.bodies()).map(|_| T::zero()));
        let (mut rotor, mut modal) = (joint.clone(), Modal::from_iter((0..s.modes()).map(|_| T::zero())));
        let out = SweepResult { joint: &mut joint, rotor: &mut rotor, modal: &mut modal };
        let base = now.accelerations(self, out);
        // Of a prescribed motion the torque was found.
        needed.fill(T::zero());
        for (j, (found, drive)) in rotor.iter_mut().zip(&now.drives).enumerate() {
            let acceleration = match (drive.rotor, drive.moves) {
                (Rotor::Prescribed(of_rotor), _) => of_rotor,
                (Rotor::Geared, Moves::Prescribed(of_joint)) => of_joint,
                _ => continue,
            };
            if let Some(needed) = needed.get_mut(j) {
                *needed = *found;
            }
            *found = acceleration;
        }
        let given = (base, &joint[..], &rotor[..], &modal[..]);
        let by_joint = transmitted(&now.snapshot(self), &now.applied, given);
        // What a carrier gives, it gets back.
        let minus = T::constant(-1.0);
        let mut whole = by_joint[0].times(minus);
        for i in (1..=s.bodies()).filter(|i| s.tree.parent[i - 1] == 0) {
            whole = whole.plus(by_joint[i].times(minus));
        }
        let inertial = |v: Vector3<T>| times(&now.placed[0].frame.rotation, v);
        put(to.reaction_force, &inertial(whole.force));
        put(to.reaction_torque, &inertial(whole.torque));
        for (a, tip) in s.tips.iter().enumerate() {
            let first = s.tree.first_of_arm(*tip);
            let of_arm = by_joint[first].times(minus);
            let mount = three(at.p, self.parameter.joint_position + 3 * (first - 1));
            put(to.arm_force + 3 * a, &inertial(of_arm.force));
            put(to.arm_torque + 3 * a, &inertial(sub(of_arm.torque, cross(mount, of_arm.force))));
        }
    }

    fn analysis<T: Scalar>(&self, at: &At<T>, now: &RobotInstant<T>, put: &mut impl FnMut(usize, &[T])) {
        let (s, to, p) = (self.structure(), &self.output, &self.parameter);
        let robot = now.snapshot(self);
        let arms = Arms::of(&robot, s.held);
        for (a, tip) in s.tips.iter().enumerate() {
            let [force, torque, both] = arms.measures(&robot, *tip, three(at.p, p.arm_mount + 3 * a));
            put(to.force_measure + a, &[force]);
            put(to.torque_measure + a, &[torque]);
            put(to.combined_measure + a, &[both]);
            let (smallest, all) = arms.dexterity(&robot, *tip, three(at.p, p.tip_offset + 3 * a));
            put(to.jacobian_smallest + a, &[smallest]);
            put(to.manipulability + a, &[all]);
        }
    }

    fn totals<T: Scalar>(
        &self,
        at: &At<T>,
        (now, frames): (&RobotInstant<T>, &[SpatialFrame<T>]),
        put: &mut impl FnMut(usize, &[T]),
    ) {
        let (s, to) = (self.structure(), &self.output);
        let base = &frames[0];
        let robot = now.snapshot(self);
        let (h, kinetic) = momentum(&robot);
        let linear = times(&base.rotation, h.force);
        put(to.linear_momentum, &linear);
        put(
            to.angular_momentum,
            &add(times(&base.rotation, h.torque), cross(base.origin, linear)), // (SFF-9)
        );
        put(to.kinetic_energy, &[kinetic]);
        let (mut mass, mut first) = (robot.base.mass, scale(robot.base.mass, base.origin));
        let mut count = |rigid: &Rigid<T>, frame: &SpatialFrame<T>| {
            mass += rigid.mass;
            first = add(first, add(scale(rigid.mass, frame.origin), times(&frame.rotation, rigid.first)));
        };
        (1..=s.bodies()).for_each(|i| count(&robot.bodies[i].rigid, &frames[i]));
        let appendages = robot.flexing.parts.iter().zip(robot.flexing.now);
        appendages.for_each(|(part, bent)| count(&bent.rigid, &frames[part.on]));
        put(to.center_of_mass, &scale(T::one() / mass, first));
        let field = if s.held { three(at.p, self.parameter.gravity) } else { zero() };
        let eta = &at.x[self.state.modal_coordinate..][..s.modes()];
        let bent = now.appendages.potential(eta);
        put(to.potential_energy, &[self.spring_energy(at) + bent - dot(field, first)]);
    }
}
