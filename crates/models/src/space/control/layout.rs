//! The variables of [`SpaceController`](super::SpaceController): what each is, and where its values are in the vectors.
//! Those of the robot that it drives have the names of `SpatialFreeFlyer`'s, so that equal names connect.

use super::super::structure::RobotStructure;
use crate::layout::AllowedValues::{Any, Item, NotNegative, Positive};
use crate::layout::{InputStart, Items, LayoutState, Parameter, Shows, layout, tunable};

/// How the base moves while the hands follow their references.
pub static BASE_CONTROL: Items = Items {
    name: "BaseControl",
    text: "How the base moves while the hands follow their references",
    items: &[
        ("free", "it floats: generalized Jacobian, with the momentum that base and joints have (CTS-2)"),
        ("attitude", "its rate is held at baseRateReference by baseTorque, its centre floats (CTS-3)"),
        (
            "moving",
            "something else moves it: Jacobian of the arm, with the base's velocity as measured (CTS-4)",
        ),
        ("fixed", "Jacobian of the arm alone, as if the base did not move: for comparison"),
        (
            "reactionless",
            "it floats, and joints move only as its rate stays at baseRateReference; hands follow as far as that leaves them free (CTS-12)",
        ),
    ],
};

/// What turns the base.
pub static BASE_ACTUATOR: Items = Items {
    name: "BaseActuator",
    text: "What turns the base with baseControl attitude",
    items: &[
        ("wheels", "baseTorque: reaction wheels"),
        ("thrusters", "thrusterForce: thrusters, on and off while samplePeriod > 0 (CTS-10, CTS-11)"),
    ],
};
/// Item of [`BASE_ACTUATOR`]: thrusters.
pub const THRUSTERS: f64 = 2.0;

/// Items of [`BASE_CONTROL`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BaseControl {
    /// Floats.
    Free,
    /// Its rate is controlled.
    Attitude,
    /// Moved by something else.
    Moving,
    /// Taken as fixed.
    Fixed,
    /// Floats, and the joints do not turn it.
    Reactionless,
}

impl BaseControl {
    /// The item of that number (from 1).
    pub fn from_number(number: f64) -> Option<Self> {
        let all = [Self::Free, Self::Attitude, Self::Moving, Self::Fixed, Self::Reactionless];
        all.into_iter().enumerate().find(|(k, _)| (k + 1) as f64 == number).map(|(_, item)| item)
    }
}

layout! {
    /// Where the controller's own parameters begin, behind those of the robot.
    Parameters of Parameter, s: RobotStructure:
    base_control "baseControl" [] if !s.held, "", Parameter::fixed(Item(&BASE_CONTROL)),
        "How the base moves while the hands follow their references (CTS-2 to CTS-4, CTS-12)";
    task_weight "taskWeight" [s.tips.len(), 6], "1", tunable(NotNegative),
        "Weight of each component of a hand's reference, linear, then angular, base axes; 0: not controlled (CTS-5)";
    threshold "singularityThreshold" [], "1", tunable(NotNegative),
        "sigma_0: smallest singular value of the weighted Jacobian below which the inverse is damped (CTS-6)";
    damping "dampingFactor" [], "1", tunable(Positive),
        "lambda_0: damping of the inverse at a singular value of 0 (CTS-6)";
    rate_limit "jointVelocityLimit" [s.bodies()], "rad/s", tunable(Positive),
        "Largest rate of a joint; all joints are slowed by the same factor, so that hands keep their direction (CTS-7; m/s)";
    velocity_gain "velocityGain" [s.bodies()], "1/s", tunable(NotNegative),
        "K_v: acceleration per error of the joint's rate (CTS-8)";
    tracking_gain "trackingGain" [s.bodies()], "1/s2", tunable(NotNegative),
        "K_x: acceleration per integral of that error (CTS-8)";
    torque_limit "torqueLimit" [s.bodies()], "N.m", tunable(Positive),
        "Largest magnitude of a joint's torque; the integral does not wind up at it (CTS-9; N)";
    base_velocity_gain "baseVelocityGain" [] if !s.held, "1/s", tunable(NotNegative),
        "Angular acceleration per error of the base's rate, with baseControl attitude (CTS-8)";
    base_tracking_gain "baseTrackingGain" [] if !s.held, "1/s2", tunable(NotNegative),
        "Angular acceleration per integral of that error: holds the attitude (CTS-8)";
    base_torque_limit "baseTorqueLimit" [] if !s.held, "N.m", tunable(Positive),
        "Largest magnitude of a component of the base's torque, base axes (CTS-9)";
    base_actuator "baseActuator" [] if !s.held && s.thrusters > 0, "", Parameter::fixed(Item(&BASE_ACTUATOR)),
        "What turns the base with baseControl attitude";
    wheel_axis "wheelAxis" [3] if !s.held && s.thrusters > 0, "1", tunable(Any),
        "Axis of a wheel next to the thrusters, base axes: it takes the torque about it, up to baseTorqueLimit; 0: no wheel (CTS-10)";
    thruster_level "thrusterForceLimit" [s.thrusters] if !s.held, "N", tunable(Positive),
        "Force of a thruster that is on; the largest one while samplePeriod is 0 (CTS-10)";
    least_impulse "minimumImpulse" [s.thrusters] if !s.held, "N.s", tunable(NotNegative),
        "Smallest impulse of a thruster; less than one sample counts as one (CTS-11)";
    specific_impulse "specificImpulse" [] if !s.held && s.thrusters > 0, "s", tunable(Positive),
        "Impulse per weight of propellant: its mass is the impulse over 9.80665 m/s2 times that";
    contact_normal "contactNormal" [s.tips.len(), 3], "1", tunable(Any),
        "Direction of a hand's force while contactForceReference is not 0, inertial axes (CTS-14)";
    contact_damping "contactDamping" [s.tips.len()], "N.s/m", tunable(NotNegative),
        "Force per velocity of a pushing hand along contactNormal, against that of its reference (CTS-14)";
    vibration_gain "vibrationGain" [] if !s.held && s.modes() > s.linked(), "1/(kg.m2.s)", tunable(NotNegative),
        "Rates of the joints per torque of the bent appendages: the arms damp them (CTS-13; 1/(kg.s) of a prismatic joint)";
    base_vibration_gain "baseVibrationGain" [] if !s.held && s.modes() > s.linked(), "1/(kg.m2.s)", tunable(NotNegative),
        "Rate of the base per torque of the bent appendages, with baseControl attitude: the base damps them (CTS-13)";
    sample_period "samplePeriod" [], "s", Parameter::fixed(NotNegative),
        "Sample period of the controller, outputs to the plant held in between; 0: continuous";
}

layout! {
    /// Where inputs begin.
    Inputs of InputStart, s: RobotStructure:
    joint_angle "jointAngle" [s.bodies()], "rad", &[], "q_i of the robot (m of a prismatic joint)";
    joint_velocity "jointVelocity" [s.bodies()], "rad/s", &[], "d(q_i)/dt of the robot (m/s of a prismatic joint)";
    base_quaternion "baseQuaternion" [4] if !s.held, "1", &[1.0, 0.0, 0.0, 0.0], "Base axes to inertial ones, Q: w, x, y, z";
    base_velocity "baseVelocity" [3] if !s.held, "m/s", &[], "Of the base's centre of mass, inertial axes";
    base_angular_velocity "baseAngularVelocity" [3] if !s.held, "rad/s", &[], "omega, base axes: what a gyro reads";
    tip_velocity_reference "tipVelocityReference" [s.tips.len(), 6], "", &[],
        "Velocity of each hand (m/s), then its angular velocity (rad/s), inertial axes (CTS-1)";
    joint_velocity_reference "jointVelocityReference" [s.bodies()], "rad/s", &[],
        "Rates that joints have where the hands' references leave them free (CTS-5; m/s)";
    torque_feedforward "torqueFeedforward" [s.bodies()], "N.m", &[],
        "u_ref of a planned trajectory, added to the joint's torque (CTS-8; N)";
    base_rate_reference "baseRateReference" [3] if !s.held, "rad/s", &[],
        "omega that the base is to have with baseControl attitude or reactionless, base axes (CTS-3, CTS-12)";
    contact_force_reference "contactForceReference" [s.tips.len()], "N", &[],
        "Force that a hand is to exert along contactNormal, where its velocity is then left free; 0: it follows its velocity (CTS-14)";
    modal_coordinate "modalCoordinate" [s.modes() - s.linked()] if !s.held, "m", &[], "eta of the appendages (rad of torsion; CTS-13)";
}

layout! {
    /// Where outputs begin.
    Outputs of Shows, s: RobotStructure:
    joint_torque "jointTorque" [s.bodies()], "N.m", Shows::All, "On the motors, joint side: u_ref + u_contr within torqueLimit (CTS-8; N)";
    base_torque "baseTorque" [3] if !s.held, "N.m", Shows::All, "On the base, inertial axes, by reaction wheels; 0 unless baseControl is attitude (CTS-8)";
    thruster_force "thrusterForce" [s.thrusters] if !s.held, "N", Shows::All, "Of each thruster, 0 unless baseActuator is thrusters (CTS-10, CTS-11)";
    thruster_pulses "thrusterPulses" [s.thrusters] if !s.held, "1", Shows::States, "How often each was turned on so far, while samplePeriod > 0 (CTS-11)";
    propellant "propellant" [] if !s.held && s.thrusters > 0, "kg", Shows::States, "Used by the thrusters so far";
    joint_velocity_command "jointVelocityCommand" [s.bodies()], "rad/s", Shows::All, "Rates that the joints are to have now (CTS-5; m/s)";
    tip_velocity_error "tipVelocityError" [s.tips.len(), 6], "", Shows::All,
        "What damping, weights and limits leave of the hands' references: reference less what those rates give, inertial axes (CTS-5)";
    smallest_singular_value "smallestSingularValue" [], "1", Shows::All, "Of the weighted Jacobian (CTS-6)";
    damping_used "dampingUsed" [], "1", Shows::All, "lambda of the damped inverse, 0 away from singularities (CTS-6)";
}

layout! {
    /// Where states begin.
    States of LayoutState, s: RobotStructure:
    tracking "tracking" [s.bodies()], "rad", LayoutState::new("rad/s", 0.001, Shows::All), "integral of the joints' error of rate";
    base_tracking "baseTracking" [3] if !s.held, "rad", LayoutState::new("rad/s", 0.001, Shows::All), "integral of the base's error of rate, base axes";
    held_torque "heldTorque" [s.bodies()], "N.m", LayoutState::new("N.m/s", 1.0, Shows::Flag), "jointTorque of the last sample, while samplePeriod > 0";
    held_base_torque "heldBaseTorque" [3] if !s.held, "N.m", LayoutState::new("N.m/s", 1.0, Shows::Flag), "baseTorque of the last sample";
    held_thruster "heldThrusterForce" [s.thrusters] if !s.held, "N", LayoutState::new("N/s", 1.0, Shows::Flag), "thrusterForce of the last sample";
    owed "thrusterImpulse" [s.thrusters] if !s.held, "N.s", LayoutState::new("N", 0.1, Shows::Flag), "impulse that is due";
    left "thrusterSamples" [s.thrusters] if !s.held, "1", LayoutState::new("1/s", 1.0, Shows::Flag), "samples for which the thruster stays on";
    pulses "thrusterPulses" [s.thrusters] if !s.held, "1", LayoutState::new("1/s", 1.0, Shows::Flag), "how often the thruster was turned on";
    propellant "propellant" [] if !s.held && s.thrusters > 0, "kg", LayoutState::new("kg/s", 1e-3, Shows::All), "propellant used";
}
