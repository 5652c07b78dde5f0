//! The robot as the controller sees it, base axes: inertia, Jacobians, inverse dynamics. Links and appendages are straight, joints
//! rigid.

use super::super::composite::{BASE, forces};
use super::super::instant::RobotInstant;
use super::super::model::SpatialFreeFlyer;
use super::super::spatial::{SpatialFrame, SpatialMotion};
use super::super::tree::PerBody;
use super::super::vector::{Matrix3, Vector3, add, cross, three, times, zero};
use super::super::{MAX_BODIES, MAX_DOFS, MAX_MODES_OF_ALL, MAX_THRUSTERS, MAX_TIPS};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// Most states of a robot whose joints are rigid.
const MAX_STATES: usize = 13 + 2 * (MAX_BODIES + MAX_MODES_OF_ALL);
/// Most inputs.
const MAX_INPUTS: usize = MAX_BODIES + MAX_THRUSTERS + 6 + 6 * MAX_TIPS;

/// What is measured: q, d(q)/dt of the joints, of the base Q, velocity (inertial axes) and rate (base axes), eta.
#[derive(Clone, Copy, Debug)]
pub(super) struct RobotMeasurements<'a, T> {
    pub(super) angles: &'a [T],
    pub(super) rates: &'a [T],
    pub(super) base: [T; 4 + 3 + 3],
    /// Modal coordinates of the appendages.
    pub(super) modes: [T; MAX_MODES_OF_ALL],
}

/// Velocity of the base's centre of mass, then its rate; or force and torque.
pub(super) type BaseSix<T> = [T; BASE];

/// The robot at one instant.
pub(super) struct ControlledPose<T> {
    moving: RobotInstant<T>,
    frames: PerBody<SpatialFrame<T>>,
    /// M_bb, row by row.
    pub(super) base_inertia: [T; BASE * BASE],
    /// M_bq, joint by joint.
    pub(super) coupling: [BaseSix<T>; MAX_BODIES],
    /// Diagonal of M_qq.
    pub(super) joint_inertia: [T; MAX_BODIES],
    /// Velocity and rate of the base.
    pub(super) base_motion: BaseSix<T>,
    /// M_be eta: what the bent appendages would push the base by, were eta their acceleration.
    pub(super) bending: BaseSix<T>,
}

/// A robot placed by its measured motion, or at rest at the measured pose.
fn placed<T: Scalar>(
    plant: &SpatialFreeFlyer,
    p: &[T],
    measured: &RobotMeasurements<'_, T>,
    moves: bool,
) -> RobotInstant<T> {
    let (s, row) = (plant.structure(), &plant.state);
    let n = s.bodies();
    let mut x = [T::zero(); MAX_STATES];
    x[row.joint_angle..][..n].copy_from_slice(measured.angles);
    if moves {
        x[row.joint_velocity..][..n].copy_from_slice(measured.rates);
    }
    if !s.held {
        x[row.base_quaternion..][..4].copy_from_slice(&measured.base[..4]);
        if moves {
            x[row.base_velocity..][..3].copy_from_slice(&measured.base[4..7]);
            x[row.base_angular_velocity..][..3].copy_from_slice(&measured.base[7..]);
        }
    }
    let u = [T::zero(); MAX_INPUTS];
    let mut now = RobotInstant::new();
    now.set(plant, &At { t: T::zero(), x: &x, u: &u, p, modes: &[] });
    now
}

fn six<T: Scalar>(linear: Vector3<T>, angular: Vector3<T>) -> BaseSix<T> {
    let ([a, b, c], [d, e, f]) = (linear, angular);
    [a, b, c, d, e, f]
}

impl<T: Scalar> ControlledPose<T> {
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    pub(super) fn new(plant: &SpatialFreeFlyer, p: &[T], measured: &RobotMeasurements<'_, T>) -> Self {
        let n = plant.structure().bodies();
        let moving = placed(plant, p, measured, true);
        let frames = plant.structure().tree.frames(SpatialFrame::identity(), &moving.placed);
        let velocity = moving.placed[0].velocity;
        let mut pose = Self {
            frames,
            base_inertia: [T::zero(); BASE * BASE],
            coupling: [[T::zero(); BASE]; MAX_BODIES],
            joint_inertia: [T::zero(); MAX_BODIES],
            base_motion: six(velocity.linear, velocity.angular),
            bending: [T::zero(); BASE],
            moving,
        };
        // At rest forces are linear in the accelerations: a column of M for each.
        let rest = placed(plant, p, measured, false);
        let mut out = [T::zero(); MAX_DOFS];
        let still = [T::zero(); MAX_BODIES];
        forces(&rest.snapshot(plant), (SpatialMotion::zero(), &still, &still), &measured.modes, &mut out);
        pose.bending.copy_from_slice(&out[..BASE]); // (CTS-13)
        let none = [T::zero(); MAX_MODES_OF_ALL];
        for k in 0..BASE + n {
            let mut unit = [T::zero(); MAX_DOFS];
            unit[k] = T::one();
            let base = SpatialMotion { linear: three(&unit, 0), angular: three(&unit, 3) };
            let joints = &unit[BASE..][..MAX_BODIES];
            forces(&rest.snapshot(plant), (base, joints, joints), &none, &mut out);
            for i in 0..BASE {
                if k < BASE {
                    pose.base_inertia[i * BASE + k] = out[i];
                } else {
                    pose.coupling[k - BASE][i] = out[i];
                }
            }
            if k >= BASE {
                pose.joint_inertia[k - BASE] = out[k];
            }
        }
        pose
    }

    /// Base axes to inertial ones.
    pub(super) fn rotation(&self) -> &Matrix3<T> {
        &self.moving.placed[0].frame.rotation
    }

    /// Momentum, and angular momentum about the base's centre of mass, base axes (CTS-2).
    pub(super) fn momentum(&self, rates: &[T]) -> BaseSix<T> {
        let mut h = [T::zero(); BASE];
        for i in 0..BASE {
            for k in 0..BASE {
                h[i] += self.base_inertia[i * BASE + k] * self.base_motion[k];
            }
            for (column, rate) in self.coupling.iter().zip(rates) {
                h[i] += column[i] * *rate; // (CTS-2)
            }
        }
        h
    }

    /// Solves M_bb a = b for each of `right`; leaves them where M_bb is none, which parameters that pass their check never give.
    pub(super) fn by_base_inertia(&self, right: &mut [BaseSix<T>]) {
        let mut factors = self.base_inertia;
        if ldl_factor(&mut factors, BASE).is_ok() {
            right.iter_mut().for_each(|b| ldl_solve(&factors, BASE, b));
        }
    }

    /// The tip's motion by the base's, base axes: J_s of (CTS-1).
    pub(super) fn carried(&self, point: Vector3<T>, base: &BaseSix<T>) -> BaseSix<T> {
        let angular = three(base, 3);
        six(add(three(base, 0), cross(angular, point)), angular) // (CTS-1)
    }

    /// A point of a body from the base's centre of mass, base axes.
    pub(super) fn point(&self, body: usize, offset: Vector3<T>) -> Vector3<T> {
        let at = &self.frames[body];
        add(at.origin, times(&at.rotation, offset))
    }

    /// The motion of a point carried by the joint of `body` per unit of its rate, base axes: a column of J_M.
    pub(super) fn by_joint(&self, plant: &SpatialFreeFlyer, body: usize, point: Vector3<T>) -> BaseSix<T> {
        let now = self.moving.snapshot(plant);
        now.tree.point_by_joint(body, &self.frames[body], now.bodies[body].axis, point)
    }

    /// Force and torque on the base and torques of the joints that these accelerations take, base axes; of the base spatial ones.
    pub(super) fn inverse_dynamics(
        &self,
        plant: &SpatialFreeFlyer,
        base: &BaseSix<T>,
        joints: &[T; MAX_BODIES],
    ) -> [T; MAX_DOFS] {
        let mut out = [T::zero(); MAX_DOFS];
        let base = SpatialMotion { linear: three(base, 0), angular: three(base, 3) };
        let none = [T::zero(); MAX_MODES_OF_ALL];
        forces(&self.moving.snapshot(plant), (base, joints, joints), &none, &mut out); // (CTS-8)
        out
    }

    /// Spatial acceleration of a base that is not accelerated: held in a field of gravity, or moved evenly.
    pub(super) fn unaccelerated(&self) -> BaseSix<T> {
        match self.moving.held {
            Some(held) => six(held.linear, held.angular),
            None => six(cross(three(&self.base_motion, 0), three(&self.base_motion, 3)), zero()),
        }
    }
}
