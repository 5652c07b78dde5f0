//! What is between motor and link of one joint, as the equations and the effects see it.

use crate::friction::Levels;
use trueup_numerics::Scalar;

/// One joint's drive train at one instant. Angles and torques on the plant's own side of the gear:
/// referred to the motor for the two-mass joint, to the joint for the arm.
#[derive(Clone, Copy, Debug, Default)]
pub struct DriveTrain<T> {
    /// Time in s.
    pub t: T,
    /// Torque that the controller commands of the motor, N.m.
    pub command: T,
    /// Motor torque as it comes to the effect that looks at it, N.m.
    pub torque: T,
    /// Motor angle, rad.
    pub theta: T,
    /// Motor velocity, rad/s.
    pub omega: T,
    /// Angle on the drive's side per angle of the joint.
    pub ratio: T,
    /// Turns of the motor's shaft per turn of `theta`.
    pub shaft: T,
    /// Motor angle less link angle, both on the drive's side of the gear, less the gear's error, rad.
    pub epsilon: T,
    /// Its rate, rad/s.
    pub epsilon_dot: T,
    /// Change of the gear's error with `theta`: 1 - slope times the spring's torque acts on the motor.
    pub slope: T,
    /// Torque that the transmission carries, N.m; of a rigid joint the motor's. There at least where an effect is
    /// packed whose friction grows with it.
    pub carried: T,
    /// Motor friction in the direction of motion. There at least where rates of an effect of motor friction are
    /// computed.
    pub levels: Levels<T>,
    /// Velocity of the link against the body that carries it, load side, rad/s.
    pub joint_rate: T,
    /// Angle of the link itself (load side; for the arm against the inertial frame), rad.
    pub link_angle: T,
    /// Its rate, rad/s.
    pub link_rate: T,
    /// The base (arm only).
    pub base: BaseMotion<T>,
}

/// The compliant element of one joint while its torque is being put together:
/// torque = stiffness * deflection + damping * rate + extra (positive drives the link forward).
#[derive(Clone, Copy, Debug, Default)]
pub struct Spring<T> {
    /// N.m/rad.
    pub stiffness: T,
    /// N.m.s/rad.
    pub damping: T,
    /// What the spring is stretched by, rad; less than epsilon when there is play.
    pub deflection: T,
    /// What the damper is sheared by, rad/s.
    pub rate: T,
    /// Torque beyond the linear law, N.m.
    pub extra: T,
    /// Energy stored beyond the linear law, J.
    pub extra_energy: T,
    /// Not engaged (within the play), it carries nothing.
    pub engaged: bool,
}

impl<T: Scalar> BaseWrench<T> {
    /// Both at the same point.
    pub fn plus(self, o: Self) -> Self {
        Self {
            force: [self.force[0] + o.force[0], self.force[1] + o.force[1]],
            torque: self.torque + o.torque,
        }
    }
}

impl<T: Scalar> Spring<T> {
    /// The linear law of the drive: K epsilon + D d(epsilon)/dt.
    pub fn linear(stiffness: T, damping: T, drive: &DriveTrain<T>) -> Self {
        Self {
            stiffness,
            damping,
            deflection: drive.epsilon,
            rate: drive.epsilon_dot,
            extra: T::zero(),
            extra_energy: T::zero(),
            engaged: true,
        }
    }
    /// Torque on the link, and against the motor, N.m.
    pub fn torque(&self) -> T {
        self.stiffness * self.deflection + self.damping * self.rate + self.extra
    }
    /// Stored energy, J.
    pub fn energy(&self) -> T {
        self.stiffness * self.deflection * self.deflection * 0.5 + self.extra_energy
    }
}

/// A body of the free-floating base as effects see it; inertial frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct BaseMotion<T> {
    /// Time in s.
    pub t: T,
    /// Position of the centre of mass, m.
    pub position: [T; 2],
    /// Attitude, rad.
    pub attitude: T,
    /// Velocity of the centre of mass, m/s.
    pub velocity: [T; 2],
    /// Rate, rad/s.
    pub rate: T,
}

/// The base of a robot in space as effects see it.
#[derive(Clone, Copy, Debug)]
pub struct FlyerBase<T> {
    /// Time in s.
    pub t: T,
    /// Base axes to inertial ones.
    pub rotation: [[T; 3]; 3],
    /// Velocity of the centre of mass, inertial axes, m/s.
    pub velocity: [T; 3],
    /// Rate, inertial axes, rad/s.
    pub rate: [T; 3],
}

/// Force (inertial frame, N) at a point and torque about it (N.m).
#[derive(Clone, Copy, Debug, Default)]
pub struct BaseWrench<T> {
    /// N.
    pub force: [T; 2],
    /// N.m.
    pub torque: T,
}
