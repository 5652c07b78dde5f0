//! `CaptureScene` with a robot in space: its variable table and its configurations.

use crate::builder::PlantTableBuilder;
use crate::space;
use crate::structure::{BALLS, CLOSES, MOUNTED, SPATIAL, TOUCHES, chosen};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, ModelTable, TableExperiment};
use trueup_models::contact::Closing;
use trueup_models::contact::spatial::layout::{
    HandCommand, HandOutputs, HandParameters, HandStates, TargetOutputs, TargetParameters, TargetStates,
};
use trueup_models::contact::spatial::{SolidShape, SpatialCaptureScene, SpatialGripperStructure};
use trueup_models::space::layout::{COUPLING, Inputs, Outputs, Parameters, States};
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::Hybrid;

/// Relative tolerance of the default experiment: as of the robot alone.
const TOLERANCE: f64 = 1e-6;

/// Its arm at the start, rad: bent, so that no joint is singular.
const BENT: [f64; 6] = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];

/// The model of a configuration, and start values of its parameters.
pub(crate) fn build(c: &Configuration) -> Result<(SpatialCaptureScene, Vec<f64>), String> {
    let choice = chosen(c)?;
    if choice(MOUNTED).is_some_and(|m| m != 1) {
        return Err(format!(
            "`{MOUNTED}` = elastic and carriages are in the plane: leave it out in space, or give chaser=body or planar"
        ));
    }
    let mut design = presets::chaser();
    if !c.joint_flexible.is_empty() {
        design.flex(&c.joint_flexible)?;
    }
    let structure = SpatialGripperStructure {
        balls: choice(BALLS).unwrap_or(SpatialGripperStructure::default().balls),
        closing: match choice(CLOSES) {
            Some(2) => Closing::Command,
            Some(3) => Closing::Motor,
            _ => Closing::Schedule,
        },
        against: match choice(TOUCHES) {
            Some(2) => SolidShape::Plate,
            Some(3) => SolidShape::Bar,
            Some(4) => SolidShape::Cylinder,
            Some(5) => SolidShape::Ring,
            _ => SolidShape::Ball,
        },
    };
    let robot = SpatialFreeFlyer::new(design.structure())?;
    let mut of_robot = design.parameters();
    let at = Parameters::new(robot.structure());
    for begin in [at.initial_joint_angle, at.initial_motor_angle] {
        of_robot[begin..begin + BENT.len()].copy_from_slice(&BENT);
    }
    let scene = SpatialCaptureScene::new(robot, structure, &c.effects)?;
    let start = scene.defaults(&of_robot);
    Ok((scene, start))
}

/// The table of a model with those start values (in the model's order).
pub(crate) fn table(m: &SpatialCaptureScene, start: &[f64]) -> ModelTable {
    let experiment = TableExperiment { stop_time: 30.0, tolerance: TOLERANCE, step_size: 0.05 };
    let text =
        "Capture in space: robot, hand and target in one (dynamics of on-orbit capture, eq. 1-18, 20-22)";
    let mut b = PlantTableBuilder::new("CaptureScene", text, experiment);
    let (s, robot) = (m.structure(), m.robot().structure());
    b.constant("dimension", BoundaryType::Integer, &[], &[3.0], "The model moves in space");
    let numbers = [SPATIAL as usize, s.balls, s.closing as usize + 1, 1, s.against as usize + 1];
    b.structure("CaptureScene", &numbers);
    b.items(&COUPLING);
    space::constants(&mut b, robot);
    let (of_hand, rest) = start.split_at(HandParameters::new(s).count);
    let (of_robot, of_target) = rest.split_at(m.robot().sizes().parameters);
    b.parameters(&HandParameters::list(s), of_hand);
    b.parameters(&Parameters::list(robot), of_robot);
    b.parameters(&TargetParameters::list(&()), of_target);
    b.inputs(&HandCommand::list(s));
    b.inputs(&Inputs::list(robot));
    b.retell("tipForce", "At the tip in addition to the contact, inertial axes");
    b.retell("tipTorque", "On the tip's body in addition to the contact, inertial axes");
    b.outputs(&HandOutputs::list(s));
    b.outputs(&Outputs::list(robot));
    b.retell("linearMomentum", "Of robot and target, inertial axes, P (SFF-9)");
    b.retell("angularMomentum", "Of robot and target about the inertial origin, L (SFF-9), rotors included");
    b.retell("kineticEnergy", "Of robot and target, T, rotors included (SFF-8)");
    b.outputs(&TargetOutputs::list(&()));
    b.moved(&HandStates::list(s));
    b.moved(&States::list(robot));
    b.moved(&TargetStates::list(&()));
    b.effects(m.effects(), trueup_models::effect::PlantKind::Arm);
    b.terminal(
        "drive",
        "What a manipulator controller is wired to",
        &["jointTorque", "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"],
    );
    b.finish(m.sizes().indicators)
}
