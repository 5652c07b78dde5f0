//! The variables of [`FlexibleArm`](super::FlexibleArm) in addition to those of its bodies.

use super::structure::FlexibleArmStructure;
use crate::layout::AllowedValues::{Any, NotNegative};
use crate::layout::{InputStart, Items, LayoutEntry, Parameter, Shows, layout};
use crate::space::layout as space;

/// Name of the structural choice [`DRIVE`].
pub const DRIVE_CHOICE: &str = "drive";
/// Name of the structural constant: per body the numbers of shapes of its link.
pub const LINK_MODES: &str = "linkModes";

/// What comes in for the motors.
pub static DRIVE: Items = Items {
    name: "ArmDrive",
    text: "What the motors are driven by",
    items: &[("current", "currents of the motors, A"), ("torque", "torques of the motors, joint side, N.m")],
};

/// Name of the structural choice [`LINKS`].
pub const LINKS_CHOICE: &str = "links";
/// Name of the structural choice of how many shapes each link has in each direction of bending.
pub const SHAPES_CHOICE: &str = "linkShapes";

/// Name of the structural choice [`SOLVER`].
pub const SOLVER_CHOICE: &str = "solver";

/// How Co-Simulation integrates.
pub static SOLVER: Items = Items {
    name: "ArmSolver",
    text: "How Co-Simulation integrates between the arm's events",
    items: &[
        ("adaptive", "explicit steps, as short as the tolerance requires"),
        ("fixed", "implicit steps of 1 ms at most, of second order: faster than real time"),
    ],
};
/// Item of [`SOLVER`]: fixed.
pub const FIXED: usize = 2;

/// Name of the structural choice [`AXIAL`].
pub const AXIAL_CHOICE: &str = "axialStiffening";

/// Whether loads along links stiffen them.
pub static AXIAL: Items = Items {
    name: "ArmAxialStiffening",
    text: "Whether loads along the links stiffen or soften them",
    items: &[
        ("off", "they do not: links bend without being shortened"),
        ("on", "they do: bending shortens links"),
    ],
};

/// Whether links bend.
pub static LINKS: Items = Items {
    name: "ArmLinks",
    text: "Whether the links bend",
    items: &[("flexible", "they bend and twist"), ("rigid", "they do not; their mass is their bodies'")],
};

layout! {
    /// Where parameters begin that the bodies have not.
    Parameters of Parameter, s: FlexibleArmStructure:
    torque_constant "torqueConstant" [s.robot.bodies()] if s.by_current, "N.m/A", Parameter::tunable(Any),
        "K_t, at the motor: its torque on the joint's side is gearRatio K_t I (LNK-6)";
    coulomb_friction "coulombFriction" [s.robot.bodies()], "N.m", Parameter::tunable(NotNegative), "At the motor, joint side, tau_c (S3 eq. 3)";
    static_friction "staticFriction" [s.robot.bodies()], "N.m", Parameter::tunable(NotNegative),
        "Break-away level, joint side, tau_s (S3 eq. 4); taken as tau_c where it is below";
    viscous_friction "viscousFriction" [s.robot.bodies()], "N.m.s/rad", Parameter::tunable(NotNegative), "At the motor, joint side, D_m (S3 eq. 3)";
}

layout! {
    /// Where outputs begin that the bodies have not.
    Outputs of Shows, s: FlexibleArmStructure:
    motor_torque "motorTorque" [s.robot.bodies()], "N.m", Shows::All, "Of the motors, joint side, friction not counted (LNK-6)";
    transmission_torque "transmissionTorque" [s.robot.bodies()], "N.m", Shows::States,
        "Of the joint's spring and damper on the body, joint side, tau_lm (S3 4.1); 0 of a rigid joint";
    friction_torque "frictionTorque" [s.robot.bodies()], "N.m", Shows::All, "At the motors, joint side; positive against forward motion";
    sticking "sticking" [s.robot.bodies()], "", Shows::Flag, "The motor sticks (S3 eq. 4)";
    tip_deflection "tipDeflection" [3] if !s.robot.tips.is_empty(), "m", Shows::States,
        "The tip against that of the rigid arm at the same motor angles, inertial axes (LNK-7)";
}

/// All parameters, in order.
pub fn parameters(s: &FlexibleArmStructure) -> Vec<LayoutEntry<Parameter>> {
    [space::Parameters::list(&s.robot), Parameters::list(s)].concat()
}

/// All inputs, in order.
pub fn inputs(s: &FlexibleArmStructure) -> Vec<LayoutEntry<InputStart>> {
    let mut all = space::Inputs::list(&s.robot);
    if let Some(drive) = all.iter_mut().find(|e| e.name == "jointTorque").filter(|_| s.by_current) {
        (drive.name, drive.unit) = ("motorCurrent", "A");
        drive.text = "Of the motors; positive turns the joint forward (LNK-6)";
    }
    all
}

/// All outputs, in order.
pub fn outputs(s: &FlexibleArmStructure) -> Vec<LayoutEntry<Shows>> {
    [space::Outputs::list(&s.robot), Outputs::list(s)].concat()
}
