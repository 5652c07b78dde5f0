//! What is stiff in a robot whose base is held, for implicit steps: springs and dampers of its joints and modes and what
//! brakes its motors, against its mass matrix (LNK-10).
//!
//! Left out, for it is not stiff: how weight and inertia change with the pose, Coriolis and centrifugal forces.

use super::composite::{BASE, mass_matrix};
use super::instant::RobotInstant;
use super::model::SpatialFreeFlyer;
use super::prescribed::PrescribedAccelerations;
use trueup_numerics::hybrid::At;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// What acts on a motor's velocity (of a rigid joint: the joint's) in addition to its spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Brake {
    /// A damper, N.m.s/rad, joint side.
    Viscous(f64),
    /// It sticks: whatever holds it.
    Stuck,
}

/// Rows of the room behind the matrix: S, g K of what acts on a velocity alone; 1 where it is free to change, else 0; S, g K of
/// the springs between joints and motors.
struct StiffRows<'a> {
    both: &'a mut [f64],
    spring: &'a mut [f64],
    free: &'a mut [f64],
    cross_both: &'a mut [f64],
    cross_spring: &'a mut [f64],
    g: &'a mut f64,
}

impl SpatialFreeFlyer {
    /// Velocities of a robot whose base is held: of joints, motors, modes.
    fn velocities(&self) -> usize {
        let s = self.structure();
        s.bodies() + s.springs() + s.modes()
    }

    /// Numbers that [`Self::factor_stiff`] needs room for.
    pub fn stiff_room(&self) -> usize {
        let n = self.velocities();
        (BASE + n).pow(2) + 3 * n + 2 * self.structure().springs() + 1
    }

    /// The matrix and what follows it.
    fn rows<'a>(&self, room: &'a mut [f64]) -> Option<(&'a mut [f64], StiffRows<'a>)> {
        let (n, springs) = (self.velocities(), self.structure().springs());
        let (matrix, rest) = room.split_at_mut_checked((BASE + n).pow(2))?;
        let (both, rest) = rest.split_at_mut_checked(n)?;
        let (spring, rest) = rest.split_at_mut_checked(n)?;
        let (free, rest) = rest.split_at_mut_checked(n)?;
        let (cross_both, rest) = rest.split_at_mut_checked(springs)?;
        let (cross_spring, rest) = rest.split_at_mut_checked(springs)?;
        let g = rest.first_mut()?;
        Some((matrix, StiffRows { both, spring, free, cross_both, cross_spring, g }))
    }

    /// Factors of M + g D + g^2 K into `room`, which is as long as [`Self::stiff_room`] gives, and the rates into `dx`; `brake`
    /// gives for each joint (from 0) what acts on its motor, `prescribed` which motors have given accelerations. The base must be held.
    ///
    /// # Errors
    /// The row of a pivot that is not positive.
    pub fn factor_stiff(
        &self,
        at: &At<f64>,
        prescribed: PrescribedAccelerations<'_, f64>,
        (g, brake): (f64, impl Fn(usize) -> Brake),
        room: &mut [f64],
        dx: &mut [f64],
    ) -> Result<(), usize> {
        let (n, joints) = (self.velocities(), self.structure().bodies());
        let Some((matrix, rows)) = self.rows(room) else { return Err(0) };
        let mut now = RobotInstant::new();
        now.set(self, at);
        now.prescribe(self, &prescribed);
        self.accelerate_prescribed(&now, at, &prescribed, dx, &mut []);
        mass_matrix(&now.snapshot(self), matrix);
        let whole = BASE + n;
        for i in 0..n {
            let from = (BASE + i) * whole + BASE;
            matrix.copy_within(from..from + n, i * n);
        }
        *rows.g = g;
        [&mut *rows.both, &mut *rows.spring].into_iter().for_each(|row| row.fill(0.0));
        rows.free.fill(1.0);
        let element = |stiffness: f64, damping: f64| (g * (damping + g * stiffness), g * stiffness);
        for j in 0..joints {
            let motor = self.motor_row(j).map(|row| row - self.state.joint_angle);
            match brake(j) {
                Brake::Viscous(damping) => rows.both[motor.unwrap_or(j)] = g * damping,
                Brake::Stuck => rows.free[motor.unwrap_or(j)] = 0.0,
            }
            let Some(motor) = motor else { continue };
            let p = &self.parameter;
            let (both, spring) = element(at.p[p.joint_stiffness + j], at.p[p.joint_damping + j]);
            (rows.cross_both[motor - joints], rows.cross_spring[motor - joints]) = (both, spring);
            for (a, b, s) in [(j, j, both), (motor, motor, both), (j, motor, -both), (motor, j, -both)] {
                matrix[a * n + b] += s;
            }
        }
        let modes = now.appendages.modes();
        for (i, mode) in (n - modes.len()..n).zip(modes) {
            (rows.both[i], rows.spring[i]) = element(mode.stiffness, mode.damping);
        }
        for i in 0..n {
            matrix[i * n + i] += rows.both[i];
            if rows.free[i] == 0.0 {
                (0..n).for_each(|k| (matrix[i * n + k], matrix[k * n + i]) = (0.0, 0.0));
                matrix[i * n + i] = 1.0;
            }
        }
        ldl_factor(matrix, n).map_err(|e| e.index)
    }

    /// (1 - g A) y' = y in place, `room` as [`Self::factor_stiff`] left it: (M + S) w = S y_v + g K y_q, y_v' = y_v - w,
    /// y_q' = y_q + g y_v' (LNK-10).
    pub fn solve_stiff(&self, room: &[f64], y: &mut [f64]) {
        let (n, joints, whole) = (self.velocities(), self.structure().bodies(), BASE + self.velocities());
        let (matrix, rest) = room.split_at(whole * whole);
        let row = |k: usize| &rest[k * n..][..n];
        let (both, spring, free, crossing) = (row(0), row(1), row(2), &rest[3 * n..]);
        let (position, velocity) = y.split_at_mut(n);
        let mut w = [0.0; super::MAX_DOFS];
        let w = &mut w[..n];
        for i in 0..n {
            w[i] = both[i] * velocity[i] + spring[i] * position[i];
        }
        let springs = self.structure().springs();
        for j in 0..joints {
            let Some(motor) = self.motor_row(j).map(|row| row - self.state.joint_angle) else { continue };
            let (both, spring) = (crossing[motor - joints], crossing[springs + motor - joints]);
            let pull = both * (velocity[j] - velocity[motor]) + spring * (position[j] - position[motor]);
            w[j] += pull;
            w[motor] -= pull;
        }
        w.iter_mut().zip(free).for_each(|(w, free)| *w *= free);
        ldl_solve(matrix, n, w);
        let g = crossing[2 * springs];
        for i in 0..n {
            velocity[i] -= w[i]; // (LNK-10)
            position[i] += g * velocity[i];
        }
    }
}
