//! Forces and accelerations at one instant: (M + J*) dv/dt = Q - C v (S0 eq. 9, ARM-7).

use super::chain::{dot, quarter};
use super::layout::{input, parameter};
use super::model::PlanarManipulator;
use super::motion::ArmMotion;
use super::rotor;
use super::solve::Symmetric;
use super::{MAX_BODIES, MAX_DOFS, MAX_LINKS};
use crate::drive::{BaseMotion, DriveTrain, Spring};
use crate::friction::{self, Levels, SMOOTH, STUCK};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

/// All torques and accelerations.
pub(super) struct ArmForces<T> {
    pub(super) acceleration: [T; MAX_DOFS],
    pub(super) springs: [Spring<T>; MAX_LINKS],
    /// Friction torque of each motor, against positive motion.
    pub(super) friction: [T; MAX_LINKS],
    /// What friction has to balance for a motor to go on sticking; of the sliding ones it is 0.
    pub(super) applied: [T; MAX_LINKS],
}

impl PlanarManipulator {
    pub(super) fn motion<'a, T: Scalar>(&self, at: &At<'a, T>) -> ArmMotion<'a, T> {
        let mut motion = ArmMotion::unmoved(at);
        self.move_to(at, &mut motion);
        motion
    }
    /// [`Self::motion`] in place: what is returned is copied.
    pub(super) fn move_to<'a, T: Scalar>(&self, at: &At<'a, T>, motion: &mut ArmMotion<'a, T>) {
        let n = self.links();
        let (q, rest) = at.x.split_at(self.dofs());
        let v = &rest[..self.dofs()];
        (motion.q, motion.v) = (q, v);
        motion.chain = self.chain(at.p);
        motion.turned = motion.chain.turned(q, v);
        let base = BaseMotion {
            t: at.t,
            position: [q[0], q[1]],
            attitude: q[2],
            velocity: [v[0], v[1]],
            rate: v[2],
        };
        let ArmMotion { turned, drives, .. } = motion;
        for j in 0..n {
            let (motor, joint) = (self.motor(j), 3 + j);
            let command = at.u[input::joint_torque(n) + j];
            drives[j] = DriveTrain {
                t: at.t,
                command,
                torque: command,
                ratio: T::one(),
                shaft: at.p[parameter::gear_ratio(n) + j],
                joint_rate: v[joint],
                base,
                theta: q[motor],
                omega: v[motor],
                epsilon: q[motor] - q[joint],
                epsilon_dot: v[motor] - v[joint],
                link_angle: turned.angle[j + 1],
                link_rate: turned.rate[j + 1],
                ..DriveTrain::default()
            };
            let d = &mut drives[j];
            self.effects().gear(at, j, d);
            if self.friction_effects() {
                d.carried = if self.flexible()[j] {
                    self.spring(at, j, d).torque()
                } else {
                    self.effects().actuator(at, j, d)
                };
                d.levels = self.levels(at, j, d, friction::direction(SMOOTH, d.omega));
            }
        }
    }

    /// M* + J* (ARM-2, ARM-5, ARM-6).
    pub(super) fn mass<T: Scalar>(&self, p: &[T], motion: &ArmMotion<T>) -> Symmetric<T> {
        let mut m = Symmetric::zero();
        self.add_mass(p, motion, &mut m);
        m
    }
    /// The same into a matrix of zeros: a matrix that is returned is copied.
    fn add_mass<T: Scalar>(&self, p: &[T], motion: &ArmMotion<T>, m: &mut Symmetric<T>) {
        let n = self.links();
        motion.chain.add_mass(&motion.turned, m);
        for j in 0..n {
            let share = rotor::share(p[parameter::motor_coupling(n)], p[parameter::gear_ratio(n) + j]);
            rotor::add_inertia(m, j, self.motor(j), p[parameter::motor_inertia(n) + j], share);
        }
    }

    pub(super) fn spring<T: Scalar>(&self, at: &At<T>, joint: usize, d: &DriveTrain<T>) -> Spring<T> {
        let n = self.links();
        let (k, b) = (at.p[parameter::joint_stiffness(n) + joint], at.p[parameter::joint_damping(n) + joint]);
        self.effects().spring(at, joint, d, Spring::linear(k, b, d))
    }

    /// Generalized forces less C v, without friction (ARM-7, ARM-8); the springs on the way.
    pub(super) fn forces<T: Scalar>(
        &self,
        at: &At<T>,
        motion: &ArmMotion<T>,
        mass: &Symmetric<T>,
        springs: &mut [Spring<T>; MAX_LINKS],
    ) -> [T; MAX_DOFS] {
        let (n, u, effects) = (self.links(), at.u, self.effects());
        let ArmMotion { turned, drives, .. } = motion;
        let mut f = [T::zero(); MAX_DOFS];
        turned.bias(&mut f);
        f.iter_mut().for_each(|f| *f = -*f);

        let base = &drives[0].base;
        let (on_base, on_tip) = (effects.base(at, base), effects.tip(at, base));
        let tip_force =
            [u[input::tip_force(n)] + on_tip.force[0], u[input::tip_force(n) + 1] + on_tip.force[1]];
        for i in 0..2 {
            f[i] += u[input::base_force(n) + i] + on_base.force[i] + tip_force[i];
        }
        let mut absolute = [T::zero(); MAX_BODIES];
        for k in 0..=n {
            absolute[k] = dot(quarter(turned.arm[k]), tip_force);
        }
        absolute[0] += u[input::base_torque(n)] + on_base.torque;
        absolute[n] += u[input::tip_torque(n)] + on_tip.torque;
        for j in 0..n {
            absolute[j + 1] += effects.link_torque(at, j, &drives[j]);
        }
        turned.add_absolute(&absolute, &mut f);

        for j in 0..n {
            let motor = self.motor(j);
            f[motor] += effects.actuator(at, j, &drives[j]);
            springs[j] = self.spring(at, j, &drives[j]);
            if self.flexible()[j] {
                let torque = springs[j].torque();
                f[motor] -= torque * (-drives[j].slope + 1.0);
                f[3 + j] += torque;
            }
            f[3 + j] += effects.joint_torque(at, j, &drives[j]);
        }
        let field = self.field(at);
        for i in 0..self.dofs() {
            f[i] += mass.at(i, 0) * field[0] + mass.at(i, 1) * field[1];
        }
        f
    }

    pub(super) fn friction_mode(&self, modes: &[i32], joint: usize) -> i32 {
        if self.has_friction() { modes[joint] } else { SMOOTH }
    }
    /// The rows that are solved for: all but those of sticking motors and of a fixed base; how many.
    pub(super) fn free(&self, modes: &[i32], rows: &mut [usize; MAX_DOFS]) -> usize {
        let mut count = 0;
        for row in self.fixed_rows()..self.dofs() {
            if !(0..self.links()).any(|j| self.motor(j) == row && self.friction_mode(modes, j) == STUCK) {
                rows[count] = row;
                count += 1;
            }
        }
        count
    }

    /// Friction levels of a motor in direction +1 or -1.
    pub(super) fn levels<T: Scalar>(
        &self,
        at: &At<T>,
        joint: usize,
        d: &DriveTrain<T>,
        way: f64,
    ) -> Levels<T> {
        let n = self.links();
        let own = friction::paper(
            at.p[parameter::coulomb_friction(n) + joint],
            at.p[parameter::static_friction(n) + joint],
            at.p[parameter::viscous_friction(n) + joint],
            d.omega * way,
        );
        self.effects().friction(at, joint, d, way, own)
    }

    /// Solves for the accelerations; a sticking motor has none, its friction is the reaction (ARM-9).
    pub(super) fn balance<T: Scalar>(&self, at: &At<T>, motion: &ArmMotion<T>) -> ArmForces<T> {
        self.balance_prescribed(at, motion, &[], &[])
    }

    /// The same where these rows have accelerations that are given, whatever force that takes (ARM-14); one that sticks keeps to
    /// that. `force`: further forces on the rows that a base has free, in their order; empty: none.
    pub(super) fn balance_prescribed<T: Scalar>(
        &self,
        at: &At<T>,
        motion: &ArmMotion<T>,
        prescribed: &[(usize, T)],
        force: &[T],
    ) -> ArmForces<T> {
        let n = self.links();
        let mut mass = Symmetric::zero();
        self.add_mass(at.p, motion, &mut mass);
        let mut springs = [Spring::default(); MAX_LINKS];
        let mut f = self.forces(at, motion, &mass, &mut springs);
        f[self.fixed_rows()..].iter_mut().zip(force).for_each(|(own, more)| *own += *more);
        let mut friction_torque = [T::zero(); MAX_LINKS];
        if self.has_friction() {
            for j in (0..n).filter(|j| at.modes[*j] != STUCK) {
                let d = &motion.drives[j];
                let way = friction::direction(at.modes[j], d.omega);
                friction_torque[j] = self.levels(at, j, d, way).braking() * way;
                f[self.motor(j)] -= friction_torque[j];
            }
        }
        let mut rows = [0; MAX_DOFS];
        let mut count = self.free(at.modes, &mut rows);
        let mut acceleration = f;
        if !prescribed.is_empty() {
            let mut given = [T::zero(); MAX_DOFS];
            let (all, of) = (rows, count);
            let moves = |row: &usize| all[..of].contains(row);
            prescribed.iter().filter(|l| moves(&l.0)).for_each(|(row, a)| given[*row] = *a);
            count = 0;
            for row in all.into_iter().take(of) {
                if prescribed.iter().any(|l| l.0 == row) {
                    acceleration[row] = given[row];
                } else {
                    // M_ff a_f = Q_f - C_f v - M_fl a_l
                    acceleration[row] -= mass.row_times(row, &given[..self.dofs()]);
                    rows[count] = row;
                    count += 1;
                }
            }
        }
        // Not positive definite: the accelerations are NaN, which the caller refuses.
        let _ = mass.solve(&rows[..count], &mut acceleration);
        acceleration[..self.fixed_rows()].fill(T::zero());
        let mut applied = [T::zero(); MAX_LINKS];
        if self.has_friction() {
            for j in (0..n).filter(|j| at.modes[*j] == STUCK) {
                acceleration[self.motor(j)] = T::zero();
            }
            for j in (0..n).filter(|j| at.modes[*j] == STUCK) {
                let row = self.motor(j);
                applied[j] = f[row] - mass.row_times(row, &acceleration[..self.dofs()]);
                friction_torque[j] = applied[j];
            }
        }
        ArmForces { acceleration, springs, friction: friction_torque, applied }
    }
}
