//! The variables of the contact models: what each is, and where its values are in the vectors.

use super::outcome::OUTCOME;
use crate::layout::AllowedValues::{self, NotNegative, Positive};
use crate::layout::{
    FIXED, INITIAL, InputStart, Items, LayoutState, Parameter, Shows, layout, state, tunable,
};

/// What moves the jaws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Closing {
    /// A schedule of `closingTime` from the start on.
    #[default]
    Schedule,
    /// The inputs `close` and `closeRate`.
    Command,
    /// The input `motorTorque` on jaws that have an inertia (CON-11).
    Motor,
}

/// How a ball is fixed to the hand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mount {
    /// Rigidly.
    #[default]
    Rigid,
    /// By springs and dampers, axial (the hand's x) and lateral (y): the dummy gripper of one ball.
    Elastic,
    /// P1 rigidly; the others are rollers of two carriages, one on each jaw, that slide on springs (CON-12).
    Carriages,
}

/// What the balls may touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PortShape {
    /// A ball about the port.
    #[default]
    Ball,
    /// A plate through the port, without end.
    Plate,
    /// A bar along the port's y with round ends: a section of a docking ring (CON-13).
    Bar,
}

/// What carries the hand of a `CaptureScene`, in the order of its choice.
pub static CHASER: Items = Items {
    name: "Chaser",
    text: "What carries the hand",
    items: &[
        ("body", "one rigid body with its arm"),
        ("planar", "the planar manipulator: the hand is at its tip, with the axes of its last link"),
        ("spatial", "the robot `chaser` in space: the hand is at its tip, with the axes of its last body"),
    ],
};

/// What is fixed of a gripper when a model is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GripperStructure {
    /// Balls of the gripper, P1 first.
    pub balls: usize,
    /// What moves them.
    pub closing: Closing,
    /// How they are fixed.
    pub mount: Mount,
    /// What they may touch.
    pub against: PortShape,
}

impl Default for GripperStructure {
    fn default() -> Self {
        Self { balls: 3, closing: Closing::Schedule, mount: Mount::Rigid, against: PortShape::Ball }
    }
}

impl GripperStructure {
    fn scheduled(&self) -> bool {
        self.closing == Closing::Schedule
    }
    fn commanded(&self) -> bool {
        self.closing == Closing::Command
    }
    fn driven(&self) -> bool {
        self.closing == Closing::Motor
    }
    fn elastic(&self) -> bool {
        self.mount == Mount::Elastic
    }
    pub(super) fn sliding(&self) -> bool {
        self.mount == Mount::Carriages
    }
    fn spindle(&self) -> bool {
        self.driven() && self.sliding()
    }
    fn plate(&self) -> bool {
        self.against == PortShape::Plate
    }
    fn bar(&self) -> bool {
        self.against == PortShape::Bar
    }
}

/// What moves the jaws, in the order of [`Closing`].
pub static CLOSING: Items = Items {
    name: "Closing",
    text: "What moves the jaws",
    items: &[
        ("schedule", "a schedule of closingTime from the start on"),
        ("command", "the inputs close and closeRate"),
        ("motor", "the input motorTorque on jaws with inertia, friction and stops"),
    ],
};

/// How a ball is fixed, in the order of [`Mount`].
pub static MOUNT: Items = Items {
    name: "EndBallMount",
    text: "How a ball is fixed to the hand",
    items: &[
        ("rigid", "rigidly"),
        ("elastic", "by springs and dampers, one ball only: the dummy gripper"),
        ("carriages", "P1 rigidly, the others as rollers of carriages that slide on the jaws by springs"),
    ],
};

/// What the balls may touch, in the order of [`PortShape`].
pub static AGAINST: Items = Items {
    name: "Against",
    text: "What the balls may touch",
    items: &[
        ("ball", "a ball about the port"),
        ("plate", "a plate through the port, without end"),
        (
            "bar",
            "a bar along the port's y with round ends: a section of a docking ring; in space along portAxis",
        ),
        ("cylinder", "in space: a cylinder with flat ends"),
        ("ring", "in space: a docking ring"),
    ],
};

/// When carriages are locked (S2 section 3.2).
pub static RIGIDIZATION: Items = Items {
    name: "Rigidization",
    text: "When the carriages are locked",
    items: &[
        ("closed", "while the jaws are closed, which they stay unless they are driven open"),
        ("never", "never: they stay on their springs"),
    ],
};
/// The item of [`RIGIDIZATION`] that locks them.
pub const LOCKS: f64 = 1.0;

/// The two modes of S2's gripper.
pub static OPERATION: Items = Items {
    name: "OperationMode",
    text: "Mode of a gripper with carriages",
    items: &[
        ("soft-contact", "the carriages slide on their springs"),
        ("rigidization", "carriages and jaws are locked"),
    ],
};

/// Which damper the law has.
pub static DAMPING: Items = Items {
    name: "Damping",
    text: "Damper of the contact law",
    items: &[
        ("printed", "as printed in S2 (20): eta_n v_n while balls approach; the force jumps where they meet"),
        ("hunt-crossley", "eta_n v_n delta/delta_ref both ways, never pulling: no jump"),
    ],
};
/// The item of [`DAMPING`] without a jump.
pub const HUNT_CROSSLEY: f64 = 2.0;

const ZERO: InputStart = &[];

/// A list of parameters that begins with those of the contact's law, in the plane or in space.
macro_rules! contact_layout {
    ($(#[$doc:meta])* $type:ident of Parameter, $s:ident: $structure:ty: $($others:tt)*) => {
        layout! {
            $(#[$doc])*
            $type of Parameter, $s: $structure:
            stiffness "stiffness" [], "N/m", tunable(Positive), "Of the contact, k (CON-2)";
            damping "normalDamping" [], "N.s/m", tunable(NotNegative), "Of the contact, eta_n (CON-2)";
            damping_law "damping" [], "", Parameter::fixed(AllowedValues::Item(&DAMPING)), "Damper of the contact (CON-3)";
            reference "referencePenetration" [], "m", tunable(Positive), "delta_ref: depth at which the damping hunt-crossley is eta_n";
            friction "frictionCoefficient" [], "1", tunable(NotNegative), "Of the contact; 0 in S2";
            slip_speed "slipSpeed" [], "m/s", tunable(Positive), "Slip at which friction has 0.7 of its level: below it creeps instead of sticking";
            $($others)*
        }
    };
}
pub(super) use contact_layout;

contact_layout! {
    /// Where parameters of a gripper and of its contact begin.
    Parameters of Parameter, s: GripperStructure:
    ball_radius "ballRadius" [s.balls], "m", Parameter::fixed(Positive), "r_i (CON-1)";
    open "ballPositionOpen" [s.balls, 2], "m", FIXED, "From the end effector, its axes, jaws open";
    closed "ballPositionClosed" [s.balls, 2], "m", FIXED, "From the end effector, its axes, jaws closed";
    ball_mass "ballMass" [s.balls], "kg", Parameter::fixed(NotNegative),
        "Moves on an elastic mount; of a rigid one it counts in the relative kinetic energy alone (CON-6)";
    closing_time "closingTime" [] if s.scheduled(), "s", Parameter::fixed(Positive), "From open to closed";
    hold_force "holdForceLimit" [] if s.scheduled(), "N", tunable(Positive),
        "Force against a jaw's way at which the jaws stop, for good";
    jaw_inertia "jawInertia" [] if s.driven(), "kg.m2", tunable(Positive), "Of jaws and drive, against jawPosition (CON-11)";
    jaw_friction "jawFriction" [] if s.driven(), "N.m.s", tunable(NotNegative), "Viscous, against the rate of jawPosition (CON-11)";
    motor_limit "motorTorqueLimit" [] if s.driven(), "N.m", tunable(Positive), "Largest motorTorque";
    spindle_turns "spindleTurns" [] if s.spindle(), "1", Parameter::fixed(Positive), "Turns of the spindle, right and left thread, from open to closed; motorTorque acts on it (CON-14)";
    carriage_direction "carriageDirection" [2] if s.sliding(), "1", FIXED, "Way of the carriage of P2, P4, .. in the hand's axes, taken with length 1; that of P3, P5, .. is mirrored (CON-12)";
    carriage_stiffness "carriageStiffness" [] if s.sliding(), "N/m", tunable(NotNegative), "Spring between carriage and jaw, K_s (CON-12)";
    carriage_damping "carriageDamping" [] if s.sliding(), "N.s/m", tunable(Positive), "Damper between carriage and jaw, C_s (CON-12)";
    carriage_travel "carriageTravel" [] if s.sliding(), "m", Parameter::fixed(Positive), "To the stop on either side of the initial position (CON-12)";
    rigidization "rigidization" [] if s.sliding(), "", Parameter::fixed(AllowedValues::Item(&RIGIDIZATION)), "When the carriages are locked (CON-14)";
    port_radius "portBallRadius" [] if !s.plate(), "m", Parameter::fixed(Positive), "r_j: the docking port's ball, or half the bar's thickness (CON-1)";
    bar_half "portBarHalfLength" [] if s.bar(), "m", Parameter::fixed(NotNegative), "From the port to the centre of the bar's round end, along the port's y (CON-13)";
    port_normal "portNormal" [2] if s.plate(), "1", FIXED, "Outward normal of the plate through the port, port's axes, taken with length 1";
    mount_stiffness "mountStiffness" [2] if s.elastic(), "N/m", tunable(Positive), "Of the end ball's mount, axial and lateral (CON-8)";
    mount_damping "mountDamping" [2] if s.elastic(), "N.s/m", tunable(NotNegative), "Of the end ball's mount, axial and lateral (CON-8)";
    target_mass "targetMass" [], "kg", tunable(Positive), "Target; without a body of its own for the relative kinetic energy alone (CON-6)";
    target_inertia "targetInertia" [], "kg.m2", tunable(Positive), "Target about its centre of mass; as targetMass";
    target_center "targetCenterOfMass" [2], "m", FIXED, "Target's centre of mass from the port, target's axes; as targetMass";
}

layout! {
    /// Where inputs that move the jaws begin.
    Command of InputStart, s: GripperStructure:
    close "close" [] if s.commanded(), "1", ZERO, "Jaws: 0 open, 1 closed; beyond is taken as the end";
    close_rate "closeRate" [] if s.commanded(), "1/s", ZERO, "Rate of close, for the velocities of the balls";
    motor_torque "motorTorque" [] if s.driven(), "N.m", ZERO, "Drives jawPosition, closing; beyond motorTorqueLimit is taken as that";
}

layout! {
    /// Where the inputs of `GripperContact` begin, behind [`Command`].
    Poses of InputStart, _s: GripperStructure:
    host_position "hostPosition" [2], "m", ZERO, "End effector, inertial frame";
    host_attitude "hostAttitude" [], "rad", ZERO, "Of the end effector";
    host_velocity "hostVelocity" [2], "m/s", ZERO, "Of the end effector, inertial frame";
    host_rate "hostRate" [], "rad/s", ZERO, "Of the end effector";
    port_position "portPosition" [2], "m", &[0.12, 0.01], "The target's port, inertial frame";
    port_attitude "portAttitude" [], "rad", ZERO, "Of the target";
    port_velocity "portVelocity" [2], "m/s", ZERO, "Of the port, inertial frame";
    port_rate "portRate" [], "rad/s", ZERO, "Of the target";
}

layout! {
    /// Where parameters of `GripperContact` begin, behind those of its gripper.
    HostParameters of Parameter, _s: ():
    mass "hostMass" [], "kg", tunable(NotNegative), "End effector with what moves as one with it, for the warning of long steps alone; 0: taken as endless";
}

layout! {
    /// Where outputs of a gripper begin.
    Outputs of Shows, s: GripperStructure:
    host_force "hostForce" [2], "N", Shows::All, "On the end effector at its reference point, inertial frame, F_ee";
    host_torque "hostTorque" [], "N.m", Shows::All, "On the end effector about its reference point, T_ee";
    port_force "portForce" [2], "N", Shows::All, "On the target at the port, inertial frame";
    port_torque "portTorque" [], "N.m", Shows::All, "On the target about the port";
    force "contactForce" [s.balls], "N", Shows::All, "Normal force on the ball, F_n (CON-2)";
    penetration "penetration" [s.balls], "m", Shows::All, "Depth delta; below 0 the gap (CON-1)";
    approach "approachSpeed" [s.balls], "m/s", Shows::All, "v_n, above 0 while they approach (CON-1)";
    in_contact "inContact" [s.balls], "", Shows::Flag, "The ball touches (CON-3)";
    jaw_position "jawPosition" [], "1", Shows::All, "0 open, 1 closed";
    jaw_energy "jawKineticEnergy" [] if s.driven(), "J", Shows::All, "Of jaws and drive (CON-11)";
    carriage_position "carriagePosition" [2] if s.sliding(), "m", Shows::State("carriagePosition"), "Carriages on their jaws along their way (CON-12)";
    operation "operationMode" [] if s.sliding(), "", Shows::Item(&OPERATION), "Soft contact or rigidization (CON-14)";
    elastic_energy "elasticEnergy" [], "J", Shows::All, "Of contacts and mounts";
    dissipated_energy "dissipatedEnergy" [], "J", Shows::State("dissipatedEnergy"), "Taken by dampers and friction since the start";
    jaw_work "jawWork" [], "J", Shows::State("jawWork"), "Done by what moves the jaws since the start";
    relative_energy "relativeKineticEnergy" [], "J", Shows::All, "Of target and jaws against the end effector (CON-6)";
    relative_energy_printed "relativeKineticEnergyAsPrinted" [], "J", Shows::All, "As relativeKineticEnergy with the sign that S2 (21) prints (CON-6)";
    outcome "outcome" [], "", Shows::Item(&OUTCOME), "What the capture would be if it ended now";
}

layout! {
    /// Where states of a gripper begin.
    States of LayoutState, s: GripperStructure:
    closing "closing" [] if s.scheduled(), "1", state("1/s", 1.0, Shows::Flag), "share of the closing time that is over";
    jaw "jaw" [] if s.driven(), "1", state("1/s", 1.0, Shows::All), "jaws: 0 open, 1 closed (CON-11)";
    jaw_rate "jawRate" [] if s.driven(), "1/s", state("1/s2", 0.1, Shows::All), "rate of the jaws (CON-11)";
    carriage "carriagePosition" [2] if s.sliding(), "m", state("m/s", 1e-3, Shows::All), "carriages on their jaws along their way (CON-12)";
    dissipated_energy "dissipatedEnergy" [], "J", state("N.m/s", 1e-3, Shows::All), "energy taken by dampers and friction";
    jaw_work "jawWork" [], "J", state("N.m/s", 1e-3, Shows::All), "work of what moves the jaws";
    first_speed "firstSpeed" [], "m/s", state("m/s2", 1e-3, Shows::Flag), "relative speed of port and end effector at the start";
    first_angle "firstAngle" [], "rad", state("rad/s", 0.1, Shows::Flag), "attitude of the target against the end effector at the start";
    begin "beginTime" [], "s", state("1", 1.0, Shows::Flag), "time of the start";
    last_contact "lastContact" [], "s", state("1", 1.0, Shows::Flag), "time when the last contact ended";
    ball_displacement "ballDisplacement" [2] if s.elastic(), "m", state("m/s", 1e-4, Shows::All), "end ball on its mount, end effector's axes (CON-8)";
    ball_velocity "ballVelocity" [2] if s.elastic(), "m/s", state("m/s2", 1e-3, Shows::All), "end ball, inertial frame; unused without mass (CON-8)";
}

layout! {
    /// Where parameters of a rigid chaser begin.
    ChaserParameters of Parameter, _s: ():
    mass "chaserMass" [], "kg", tunable(Positive), "Chaser with its arm, one rigid body";
    inertia "chaserInertia" [], "kg.m2", tunable(Positive), "Chaser about its centre of mass";
    end_effector "endEffectorPosition" [2], "m", FIXED, "From the chaser's centre of mass, chaser's axes";
    position "initialChaserPosition" [2], "m", INITIAL, "Centre of mass at the start";
    attitude "initialChaserAttitude" [], "rad", INITIAL, "At the start";
    velocity "initialChaserVelocity" [2], "m/s", INITIAL, "Of the centre of mass at the start";
    rate "initialChaserRate" [], "rad/s", INITIAL, "At the start";
}

layout! {
    /// Where inputs of a rigid chaser begin.
    ChaserInputs of InputStart, _s: ():
    force "chaserForce" [2], "N", ZERO, "On the chaser at its centre of mass, inertial frame";
    torque "chaserTorque" [], "N.m", ZERO, "On the chaser";
}

layout! {
    /// Where outputs of a rigid chaser begin.
    ChaserOutputs of Shows, _s: ():
    position "chaserPosition" [2], "m", Shows::State("chaserPosition"), "Centre of mass";
    attitude "chaserAttitude" [], "rad", Shows::State("chaserAttitude"), "Of the chaser";
    velocity "chaserVelocity" [2], "m/s", Shows::State("chaserVelocity"), "Of the centre of mass";
    rate "chaserRate" [], "rad/s", Shows::State("chaserRate"), "Of the chaser";
    linear_momentum "linearMomentum" [2], "kg.m/s", Shows::States, "Of chaser, target and a ball on a mount";
    angular_momentum "angularMomentum" [], "kg.m2/s", Shows::States, "Of chaser, target and a ball on a mount, about the inertial origin";
    kinetic_energy "kineticEnergy" [], "J", Shows::States, "Of chaser, target and a ball on a mount";
}

layout! {
    /// Where states of a rigid chaser begin.
    ChaserStates of LayoutState, _s: ():
    position "chaserPosition" [2], "m", state("m/s", 1e-3, Shows::State("chaserVelocity")), "the chaser's centre of mass";
    attitude "chaserAttitude" [], "rad", state("rad/s", 1e-3, Shows::State("chaserRate")), "the chaser's attitude";
    velocity "chaserVelocity" [2], "m/s", state("m/s2", 1e-3, Shows::All), "the chaser's velocity";
    rate "chaserRate" [], "rad/s", state("rad/s2", 1e-3, Shows::All), "the chaser's rate";
}

layout! {
    /// Where parameters of `CaptureScene` begin, behind those of its gripper and its chaser.
    SceneParameters of Parameter, _s: ():
    port_offset "initialPortOffset" [2], "m", INITIAL, "The port from the end effector at the start, end effector's axes";
    port_angle "initialPortAngle" [], "rad", INITIAL, "Attitude of the target against the end effector at the start";
    target_velocity "initialTargetVelocity" [2], "m/s", INITIAL, "Of the target's centre of mass at the start";
    target_rate "initialTargetRate" [], "rad/s", INITIAL, "Of the target at the start";
}

layout! {
    /// Where outputs of `CaptureScene` begin, behind those of its gripper and its chaser.
    SceneOutputs of Shows, _s: ():
    target_position "targetPosition" [2], "m", Shows::State("targetPosition"), "Centre of mass";
    target_attitude "targetAttitude" [], "rad", Shows::State("targetAttitude"), "Of the target";
    target_velocity "targetVelocity" [2], "m/s", Shows::State("targetVelocity"), "Of the centre of mass";
    target_rate "targetRate" [], "rad/s", Shows::State("targetRate"), "Of the target";
    port_offset "portOffset" [2], "m", Shows::States, "The port from the end effector, end effector's axes";
    port_angle "portAngle" [], "rad", Shows::States, "Attitude of the target against the end effector";
}

layout! {
    /// Where states of `CaptureScene` begin, behind those of its gripper and its chaser.
    SceneStates of LayoutState, _s: ():
    target_position "targetPosition" [2], "m", state("m/s", 1e-3, Shows::State("targetVelocity")), "the target's centre of mass";
    target_attitude "targetAttitude" [], "rad", state("rad/s", 1e-3, Shows::State("targetRate")), "the target's attitude";
    target_velocity "targetVelocity" [2], "m/s", state("m/s2", 1e-3, Shows::All), "the target's velocity";
    target_rate "targetRate" [], "rad/s", state("rad/s2", 1e-3, Shows::All), "the target's rate";
}

layout! {
    /// Where parameters of `FreeBody` begin.
    BodyParameters of Parameter, ports: usize:
    mass "mass" [], "kg", tunable(Positive), "m";
    inertia "inertia" [], "kg.m2", tunable(Positive), "About the centre of mass, I";
    port "portPosition" [*ports, 2], "m", tunable(AllowedValues::Any), "Docking point from the centre of mass, body axes";
    position "initialPosition" [2], "m", INITIAL, "Centre of mass at the start";
    attitude "initialAttitude" [], "rad", INITIAL, "At the start";
    velocity "initialVelocity" [2], "m/s", INITIAL, "Of the centre of mass at the start";
    rate "initialRate" [], "rad/s", INITIAL, "At the start";
}

layout! {
    /// Where inputs of `FreeBody` begin.
    BodyInputs of InputStart, ports: usize:
    force "portForce" [*ports, 2], "N", ZERO, "At the docking point, inertial frame (CON-9)";
    torque "portTorque" [*ports], "N.m", ZERO, "About the docking point (CON-9)";
}

layout! {
    /// Where outputs of `FreeBody` begin.
    BodyOutputs of Shows, ports: usize:
    position "position" [2], "m", Shows::State("position"), "Centre of mass, inertial frame";
    attitude "attitude" [], "rad", Shows::State("attitude"), "Of the body";
    velocity "velocity" [2], "m/s", Shows::State("velocity"), "Of the centre of mass";
    rate "rate" [], "rad/s", Shows::State("rate"), "Of the body";
    port_point "portPoint" [*ports, 2], "m", Shows::States, "Docking point, inertial frame";
    port_attitude "portAttitude" [*ports], "rad", Shows::States, "Of the body, for each docking point";
    port_velocity "portVelocity" [*ports, 2], "m/s", Shows::States, "Of the docking point, inertial frame";
    port_rate "portRate" [*ports], "rad/s", Shows::States, "Of the body, for each docking point";
    linear_momentum "linearMomentum" [2], "kg.m/s", Shows::States, "m v";
    angular_momentum "angularMomentum" [], "kg.m2/s", Shows::States, "About the inertial origin";
    kinetic_energy "kineticEnergy" [], "J", Shows::States, "Of the body";
}

layout! {
    /// Where states of `FreeBody` begin.
    BodyStates of LayoutState, _ports: usize:
    position "position" [2], "m", state("m/s", 1e-3, Shows::State("velocity")), "the centre of mass";
    attitude "attitude" [], "rad", state("rad/s", 1e-3, Shows::State("rate")), "the attitude";
    velocity "velocity" [2], "m/s", state("m/s2", 1e-3, Shows::All), "the velocity";
    rate "rate" [], "rad/s", state("rad/s2", 1e-3, Shows::All), "the rate";
}
