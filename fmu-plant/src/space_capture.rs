//! `CaptureScene` with a robot in space: its variable table and its configurations.

use crate::builder::{self, PlantTableBuilder};
use crate::space;
use crate::structure::{BALLS, CHASES, CLOSES, MOUNTED, SPATIAL, TOUCHES, chosen};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, ModelTable, TableExperiment};
use trueup_models::contact::Closing;
use trueup_models::contact::spatial::layout::{
    HandCommand, HandOutputs, HandParameters, HandStates, TargetOutputs, TargetParameters, TargetStates,
};
use trueup_models::contact::spatial::{SolidShape, SpatialCaptureScene, SpatialGripperStructure};
use trueup_models::effect::PlantKind;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::{COUPLING, Inputs, Outputs, Parameters, States};
use trueup_numerics::hybrid::Hybrid;

/// Relative tolerance of the default experiment: as of the robot alone.
const TOLERANCE: f64 = 1e-6;

/// Its arm at the start, rad: bent, so that no joint is singular.
const BENT: [f64; 6] = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];

/// The configuration of a capture by this robot, what is chosen of the scene by name.
///
/// # Errors
/// A structure that cannot be had, with the remedy.
pub fn capture_of_design(
    design: &RobotDesign,
    chosen: &[(String, Vec<u32>)],
) -> Result<Configuration, String> {
    if !chosen.iter().any(|(name, item)| name == CHASES && item[..] == [SPATIAL]) {
        return Err(format!("a robot is the chaser in space: give {CHASES}=spatial"));
    }
    let own = space::of_design(design)?;
    Ok(Configuration {
        model: "CaptureScene".to_owned(),
        structure: [chosen.to_vec(), own.structure].concat(),
        ..own
    })
}

/// The model of a configuration, and start values of its parameters.
pub(crate) fn build(c: &Configuration) -> Result<(SpatialCaptureScene, Vec<f64>), String> {
    let (of_robot, of_scene) = c.structure.iter().cloned().partition(|(name, _)| space::of_bodies(name));
    let scene = Configuration { structure: of_scene, ..c.clone() };
    let choice = chosen(&scene)?;
    if choice(MOUNTED).is_some_and(|m| m != 1) {
        return Err(format!(
            "`{MOUNTED}` = elastic and carriages are in the plane: leave it out in space, or give chaser=body or planar"
        ));
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
    let (robot, mut own) = space::build(&Configuration { structure: of_robot, ..c.clone() })?;
    if space::has_bodies(c) {
        // Where its hand is decides where the target begins.
        space::assign(&space::table(&robot, &own), &c.start, &mut own);
    } else {
        let at = Parameters::new(robot.structure());
        for begin in [at.initial_joint_angle, at.initial_motor_angle] {
            own[begin..begin + BENT.len()].copy_from_slice(&BENT);
        }
    }
    let scene = SpatialCaptureScene::new(robot, structure)?;
    let start = scene.defaults(&own);
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
    let (of_friction, friction_outputs) = m.robot().friction_lists();
    let effects = |b: &mut PlantTableBuilder, part| {
        b.effect_parts(m.robot().effects(), PlantKind::Space, &[part]);
    };
    b.parameters(&HandParameters::list(s), of_hand);
    b.parameters(&[Parameters::list(robot), of_friction].concat(), of_robot);
    effects(&mut b, builder::PARAMETER);
    b.parameters(&TargetParameters::list(&()), of_target);
    b.inputs(&HandCommand::list(s));
    b.inputs(&Inputs::list(robot));
    effects(&mut b, builder::INPUT);
    b.retell("tipForce", "At the tip in addition to the contact, inertial axes");
    b.retell("tipTorque", "On the tip's body in addition to the contact, inertial axes");
    b.outputs(&HandOutputs::list(s));
    b.outputs(&[Outputs::list(robot), friction_outputs].concat());
    b.retell("linearMomentum", "Of robot and target, inertial axes, P (SFF-9)");
    b.retell("angularMomentum", "Of robot and target about the inertial origin, L (SFF-9), rotors included");
    b.retell("kineticEnergy", "Of robot and target, T, rotors included (SFF-8)");
    effects(&mut b, builder::OUTPUT);
    b.outputs(&TargetOutputs::list(&()));
    b.moved(&HandStates::list(s));
    b.moved(&States::list(robot));
    effects(&mut b, builder::STATE);
    b.moved(&TargetStates::list(&()));
    b.terminal(
        "drive",
        "What a manipulator controller is wired to",
        &["jointTorque", "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"],
    );
    b.finish(m.sizes().indicators)
}
