//! The variables of a capture in space: what each is, and where its values are in the vectors.

use crate::contact::layout::{Closing, DAMPING, contact_layout};
use crate::contact::outcome::OUTCOME;
use crate::layout::AllowedValues::{self, NotNegative, Positive};
use crate::layout::{FIXED, INITIAL, InputStart, LayoutState, Parameter, Shows, layout, state, tunable};

/// What is about the target's port.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SolidShape {
    /// A ball.
    #[default]
    Ball,
    /// A plate through the port, without end.
    Plate,
    /// A bar with round ends.
    Bar,
    /// A cylinder with flat ends.
    Cylinder,
    /// A docking ring.
    Ring,
}

/// What is fixed of a hand in space when it is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SpatialGripperStructure {
    /// Balls of the hand, P1 first.
    pub balls: usize,
    /// What moves them; no motor.
    pub closing: Closing,
    /// What they may touch.
    pub against: SolidShape,
}

impl Default for SpatialGripperStructure {
    fn default() -> Self {
        Self { balls: 3, closing: Closing::Schedule, against: SolidShape::Ball }
    }
}

impl SpatialGripperStructure {
    fn scheduled(&self) -> bool {
        self.closing == Closing::Schedule
    }
    fn commanded(&self) -> bool {
        self.closing == Closing::Command
    }
    fn thick(&self) -> bool {
        self.against != SolidShape::Plate
    }
    fn directed(&self) -> bool {
        self.against != SolidShape::Ball
    }
    fn long(&self) -> bool {
        matches!(self.against, SolidShape::Bar | SolidShape::Cylinder)
    }
    fn ring(&self) -> bool {
        self.against == SolidShape::Ring
    }
}

contact_layout! {
    /// Where parameters of a hand and of its contact begin.
    HandParameters of Parameter, s: SpatialGripperStructure:
    ball_radius "ballRadius" [s.balls], "m", Parameter::fixed(Positive), "r_i (CON-15)";
    open "ballPositionOpen" [s.balls, 3], "m", FIXED, "From the end effector, axes of the tip's body, jaws open";
    closed "ballPositionClosed" [s.balls, 3], "m", FIXED, "From the end effector, axes of the tip's body, jaws closed";
    closing_time "closingTime" [] if s.scheduled(), "s", Parameter::fixed(Positive), "From open to closed";
    hold_force "holdForceLimit" [] if s.scheduled(), "N", tunable(Positive), "Force against a jaw's way at which the jaws stop, for good";
    port_radius "portBallRadius" [] if s.thick(), "m", Parameter::fixed(Positive), "r_j: of the ball, bar or cylinder about the port, or of the ring's section (CON-15)";
    port_axis "portAxis" [3] if s.directed(), "1", FIXED, "Outward normal of the plate, or axis of bar, cylinder or ring, port's axes, taken with length 1 (CON-15)";
    port_half "portHalfLength" [] if s.long(), "m", Parameter::fixed(Positive), "From the port to the end along the axis; of a bar to the centre of its round end (CON-15)";
    ring_radius "portRingRadius" [] if s.ring(), "m", Parameter::fixed(Positive), "Of the ring's middle circle about the port (CON-15)";
    target_mass "targetMass" [], "kg", tunable(Positive), "Target";
    target_inertia "targetInertia" [3, 3], "kg.m2", tunable(AllowedValues::Any), "Target about its centre of mass, target's axes (CON-16)";
    target_center "targetCenterOfMass" [3], "m", FIXED, "Target's centre of mass from the port, target's axes";
}

layout! {
    /// Where inputs that move the jaws begin.
    HandCommand of InputStart, s: SpatialGripperStructure:
    close "close" [] if s.commanded(), "1", &[], "Jaws: 0 open, 1 closed; beyond is taken as the end";
    close_rate "closeRate" [] if s.commanded(), "1/s", &[], "Rate of close, for the velocities of the balls";
}

layout! {
    /// Where outputs of a hand begin.
    HandOutputs of Shows, s: SpatialGripperStructure:
    host_force "hostForce" [3], "N", Shows::All, "On the end effector at its reference point, inertial axes, F_ee";
    host_torque "hostTorque" [3], "N.m", Shows::All, "On the end effector about its reference point, inertial axes, T_ee";
    port_force "portForce" [3], "N", Shows::All, "On the target at the port, inertial axes";
    port_torque "portTorque" [3], "N.m", Shows::All, "On the target about the port, inertial axes";
    force "contactForce" [s.balls], "N", Shows::All, "Normal force on the ball, F_n (CON-2)";
    normal "contactNormal" [s.balls, 3], "1", Shows::All, "From the ball into the target, inertial axes (CON-15)";
    penetration "penetration" [s.balls], "m", Shows::All, "Depth delta; below 0 the gap (CON-15)";
    approach "approachSpeed" [s.balls], "m/s", Shows::All, "v_n, above 0 while they approach (CON-15)";
    in_contact "inContact" [s.balls], "", Shows::Flag, "The ball touches (CON-3)";
    jaw_position "jawPosition" [], "1", Shows::All, "0 open, 1 closed";
    elastic_energy "elasticEnergy" [], "J", Shows::All, "Of contacts";
    dissipated_energy "dissipatedEnergy" [], "J", Shows::State("dissipatedEnergy"), "Taken by the contacts' dampers and friction since the start";
    jaw_work "jawWork" [], "J", Shows::State("jawWork"), "Done by what moves the jaws since the start";
    relative_energy "relativeKineticEnergy" [], "J", Shows::All, "Of the target against the end effector (CON-6)";
    outcome "outcome" [], "", Shows::Item(&OUTCOME), "What the capture would be if it ended now";
}

layout! {
    /// Where states of a hand begin.
    HandStates of LayoutState, s: SpatialGripperStructure:
    closing "closing" [] if s.scheduled(), "1", state("1/s", 1.0, Shows::Flag), "share of the closing time that is over";
    dissipated_energy "dissipatedEnergy" [], "J", state("N.m/s", 1e-3, Shows::All), "energy taken by dampers and friction";
    jaw_work "jawWork" [], "J", state("N.m/s", 1e-3, Shows::All), "work of what moves the jaws";
    first_speed "firstSpeed" [], "m/s", state("m/s2", 1e-3, Shows::Flag), "relative speed of port and end effector at the start";
    first_attitude "firstAttitude" [3, 3], "1", state("1/s", 1.0, Shows::Flag), "target's axes in those of the end effector at the start";
    begin "beginTime" [], "s", state("1", 1.0, Shows::Flag), "time of the start";
    last_contact "lastContact" [], "s", state("1", 1.0, Shows::Flag), "time when the last contact ended";
}

layout! {
    /// Where parameters of the target begin, behind those of hand and robot.
    TargetParameters of Parameter, _s: ():
    port_offset "initialPortOffset" [3], "m", INITIAL, "The port from the end effector at the start, axes of the tip's body";
    port_quaternion "initialPortQuaternion" [4], "1", INITIAL, "Target's axes to those of the tip's body at the start: w, x, y, z";
    velocity "initialTargetVelocity" [3], "m/s", INITIAL, "Of the target's centre of mass at the start, inertial axes";
    rate "initialTargetAngularVelocity" [3], "rad/s", INITIAL, "Of the target at the start, target's axes";
}

layout! {
    /// Where outputs of the target begin, behind those of hand and robot.
    TargetOutputs of Shows, _s: ():
    position "targetPosition" [3], "m", Shows::State("targetPosition"), "Centre of mass, inertial axes";
    quaternion "targetQuaternion" [4], "1", Shows::States, "Target's axes to inertial ones: w, x, y, z";
    velocity "targetVelocity" [3], "m/s", Shows::State("targetVelocity"), "Of the centre of mass, inertial axes";
    rate "targetAngularVelocity" [3], "rad/s", Shows::State("targetAngularVelocity"), "Of the target, target's axes";
    port_offset "portOffset" [3], "m", Shows::States, "The port from the end effector, axes of the tip's body";
}

layout! {
    /// Where states of the target begin, behind those of hand and robot.
    TargetStates of LayoutState, _s: ():
    position "targetPosition" [3], "m", state("m/s", 1e-3, Shows::State("targetVelocity")), "the target's centre of mass";
    quaternion "targetQuaternion" [4], "1", state("1/s", 1.0, Shows::States), "the target's attitude";
    velocity "targetVelocity" [3], "m/s", state("m/s2", 1e-3, Shows::All), "the target's velocity";
    rate "targetAngularVelocity" [3], "rad/s", state("rad/s2", 1e-3, Shows::All), "the target's rate, target's axes";
}
