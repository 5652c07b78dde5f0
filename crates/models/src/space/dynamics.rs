//! Accelerations, mass matrix and bias of `SpatialFreeFlyer`.

use super::articulated::SweepResult;
use super::attitude::{self, four};
use super::composite::{forces, mass_matrix, rotor_rows};
use super::instant::RobotInstant;
use super::joint_drive::{Moves, Rotor};
use super::model::SpatialFreeFlyer;
use super::prescribed::PrescribedAccelerations;
use super::spatial::SpatialMotion;
use super::tree::Joints;
use super::vector::{add, cross, times};
use super::{MAX_DOFS, MAX_STATES};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

impl SpatialFreeFlyer {
    /// M (SFF-8) into `m`, row by row; returns the number of its rows. They are the base's velocity and its rate, both in
    /// **base axes**, the joints, the motors of flexible joints, the modes.
    pub fn mass_matrix<T: Scalar>(&self, at: &At<T>, m: &mut [T]) -> usize {
        let mut now = RobotInstant::new();
        now.set(self, at);
        mass_matrix(&now.snapshot(self), m);
        rotor_rows(&self.structure.tree, &now.drives).1 + self.structure.modes()
    }

    /// C v (SFF-11) into `out`: the forces of a motion without accelerations, rows as in [`Self::mass_matrix`].
    pub fn bias<T: Scalar>(&self, at: &At<T>, out: &mut [T]) {
        let mut now = RobotInstant::new();
        now.set(self, at);
        let none = [T::zero(); MAX_DOFS];
        forces(&now.snapshot(self), (SpatialMotion::zero(), &none, &none), &none, out);
    }

    /// Stiffness of all modes, N/m (N.m/rad), in the order of the coordinates.
    pub fn modal_stiffness(&self, p: &[f64]) -> Vec<f64> {
        let mut now = RobotInstant::new();
        let (x, u) = (self.at_rest(p), vec![0.0; self.sizes.inputs]);
        now.set(self, &At { t: 0.0, x: &x, u: &u, p, modes: &[] });
        now.appendages.modes().iter().map(|m| m.stiffness).collect()
    }

    /// How far the end of the link of this body (from 1) is turned by bending, rad; twist counts.
    pub fn end_turn(&self, x: &[f64], p: &[f64], body: usize) -> f64 {
        let mut now = RobotInstant::new();
        let u = vec![0.0; self.sizes.inputs];
        now.set(self, &At { t: 0.0, x, u: &u, p, modes: &[] });
        let [w, a, b, c] = now.end_turn(body);
        2.0 * (a * a + b * b + c * c).sqrt().atan2(w)
    }

    fn at_rest(&self, p: &[f64]) -> Vec<f64> {
        let mut x = vec![0.0; self.sizes.states];
        self.start(p, &mut x);
        x
    }

    /// How velocities jump where these motors (by joint, from 0; of a rigid joint, the joint itself) change theirs by so much at once: an
    /// impulse at each of them, everything else free. The other rows of `jump` are 0.
    pub fn impulse(&self, at: At<f64>, motors: &[(usize, f64)], jump: &mut [f64]) {
        let mut x = [0.0; MAX_STATES];
        x[..self.state.base_velocity].copy_from_slice(&at.x[..self.state.base_velocity]);
        let x = &x[..at.x.len()];
        let mut now = RobotInstant::new();
        now.set(self, &At { x, ..at });
        now.rest(self.structure.held);
        for (j, change) in motors {
            match self.spring[*j] {
                Some(_) => now.drives[*j].rotor = Rotor::Prescribed(*change),
                None => now.drives[*j].moves = Moves::Prescribed(*change),
            }
        }
        self.accelerate(&now, &At { x, ..at }, jump);
        jump[..self.state.base_velocity].fill(0.0);
    }

    /// Rates of the states where some accelerations are given.
    #[inline(never)]
    pub fn rates_prescribed<T: Scalar>(
        &self,
        at: At<T>,
        prescribed: PrescribedAccelerations<'_, T>,
        dx: &mut [T],
    ) {
        self.rates_with_torques(at, prescribed, dx, &mut []);
    }

    /// The same, and the torques on the prescribed motors in addition to those of their springs, N.m, joint side, where there is room
    /// for all joints; 0 of the others.
    #[inline(never)]
    pub fn rates_with_torques<T: Scalar>(
        &self,
        at: At<T>,
        prescribed: PrescribedAccelerations<'_, T>,
        dx: &mut [T],
        needed: &mut [T],
    ) {
        let mut now = RobotInstant::new();
        now.set(self, &at);
        now.prescribe(self, &prescribed);
        self.accelerate_prescribed(&now, &at, &prescribed, dx, needed);
    }

    /// The same at an instant with those prescribed.
    pub(super) fn accelerate_prescribed<T: Scalar>(
        &self,
        now: &RobotInstant<T>,
        at: &At<T>,
        prescribed: &PrescribedAccelerations<'_, T>,
        dx: &mut [T],
        needed: &mut [T],
    ) {
        let rotor = self.accelerate(now, at, dx);
        needed.fill(T::zero());
        for (j, _) in prescribed.motors.iter().filter(|(j, _)| self.spring[*j].is_some()) {
            if let Some(needed) = needed.get_mut(*j) {
                *needed = rotor[*j];
            }
        }
        if !self.effects.is_empty() {
            self.effect_rates(at, dx);
        }
    }

    /// Rates of the states of the robot at this instant; gives what was found of the rotors.
    #[inline]
    fn accelerate<T: Scalar>(&self, now: &RobotInstant<T>, at: &At<T>, dx: &mut [T]) -> Joints<T> {
        let (row, n, base) = (&self.state, self.structure.bodies(), now.placed[0]);
        let (omega, v) = (base.velocity.angular, base.velocity.linear);
        let modes = self.structure.modes();
        let mut rotor = Joints::new();
        rotor.extend((0..n).map(|_| T::zero()));
        let (before, modal) = dx.split_at_mut(row.modal_velocity);
        let joint = &mut before[row.joint_velocity..][..n];
        let out = SweepResult { joint, rotor: &mut rotor, modal: &mut modal[..modes] };
        let found = now.accelerations(self, out);
        if !self.structure.held {
            dx[row.base_position..][..3].copy_from_slice(&at.x[row.base_velocity..][..3]);
            let turning = attitude::rate(four(at.x, row.base_quaternion), omega);
            dx[row.base_quaternion..][..4].copy_from_slice(&turning);
            let own = add(found.linear, cross(omega, v));
            dx[row.base_velocity..][..3].copy_from_slice(&times(&base.frame.rotation, own));
            dx[row.base_angular_velocity..][..3].copy_from_slice(&found.angular);
        }
        for j in 0..n {
            dx[row.joint_angle + j] = at.x[row.joint_velocity + j];
            if let Some(k) = self.spring[j] {
                dx[row.motor_angle + k] = at.x[row.motor_velocity + k];
                dx[row.motor_velocity + k] = match now.drives[j].rotor {
                    Rotor::Prescribed(acceleration) => acceleration,
                    Rotor::Geared | Rotor::Driven(_) => rotor[j],
                };
            }
        }
        dx[row.modal_coordinate..][..modes].copy_from_slice(&at.x[row.modal_velocity..][..modes]);
        rotor
    }
}

impl Hybrid for SpatialFreeFlyer {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let (from, to) = (&self.parameter, &self.state);
        let mut copy = |from: usize, to: usize, count: usize| {
            x[to..][..count].copy_from_slice(&p[from..][..count]);
        };
        let n = self.structure.bodies();
        copy(from.initial_joint_angle, to.joint_angle, n);
        copy(from.initial_joint_velocity, to.joint_velocity, n);
        for (j, k) in self.spring.iter().enumerate().filter_map(|(j, k)| k.map(|k| (j, k))) {
            copy(from.initial_motor_angle + j, to.motor_angle + k, 1);
            copy(from.initial_motor_velocity + j, to.motor_velocity + k, 1);
        }
        let (linked, of_base) = (self.structure.linked(), self.structure.modes() - self.structure.linked());
        copy(from.initial_modal_coordinate, to.modal_coordinate, of_base);
        copy(from.initial_modal_velocity, to.modal_velocity, of_base);
        copy(from.initial_link_coordinate, to.link_coordinate, linked);
        copy(from.initial_link_velocity, to.link_velocity, linked);
        if !self.structure.held {
            copy(from.initial_base_position, to.base_position, 3);
            copy(from.initial_base_velocity, to.base_velocity, 3);
            copy(from.initial_base_angular_velocity, to.base_angular_velocity, 3);
            let q = attitude::normalized(four(p, from.initial_base_quaternion));
            x[to.base_quaternion..][..4].copy_from_slice(&q);
        }
        if !self.effects.is_empty() {
            self.start_effects(p, x);
        }
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        if !modes.is_empty() {
            self.start_effect_modes(at, modes);
        }
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_prescribed(at, PrescribedAccelerations::none(), dx);
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.outputs_prescribed(at, PrescribedAccelerations::none(), y, &mut []);
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        if !z.is_empty() {
            self.effect_indicators(&at, z);
        }
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        if modes.is_empty() { EventUpdate::default() } else { self.update_effects(t, x, u, p, modes) }
    }

    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.effects.next_event(p, modes)
    }
}
