//! The variable table of `FlexibleArm`, and arms as configurations.

use crate::builder::PlantTableBuilder;
use crate::experiment::TOLERANCE;
use crate::space::{STIFFENING, constants, differing, encoded, is_robot, stiffening, structure};
use crate::structure::chosen;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{ModelTable, TableExperiment};
use trueup_models::flexible_arm::layout::{
    AXIAL_CHOICE, DRIVE, DRIVE_CHOICE, FIXED, LINKS_CHOICE, SHAPES_CHOICE, SOLVER, SOLVER_CHOICE, inputs,
    outputs, parameters,
};
use trueup_models::flexible_arm::presets::{self, delian};
use trueup_models::flexible_arm::{FlexibleArm, FlexibleArmStructure};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::{COUPLING, States};
use trueup_numerics::hybrid::Hybrid;

/// Items of the choices.
const BY_TORQUE: usize = 2;
const RIGID: usize = 2;
/// Size of the steps of Co-Simulation where they are fixed, s.
pub(crate) const STEP: f64 = 1e-3;

/// The item of a structural choice, given body by body or not.
fn item(c: &Configuration, choice: &str) -> Option<usize> {
    c.structure.iter().find(|s| s.0 == choice).and_then(|s| s.1.first()).map(|item| *item as usize)
}

/// Whether a configuration requires steps of fixed size.
pub(crate) fn fixed(c: &Configuration) -> bool {
    item(c, SOLVER_CHOICE) == Some(FIXED)
}

/// The model of a configuration, and start values of its parameters before those of the configuration.
pub(crate) fn build(c: &Configuration) -> Result<(FlexibleArm, Vec<f64>), String> {
    if let Some(effect) = c.effects.first() {
        return Err(format!("no effect acts in FlexibleArm yet, `{effect}` neither"));
    }
    if is_robot(c) {
        let by_current = item(c, DRIVE_CHOICE) != Some(BY_TORQUE);
        let arm = FlexibleArm::new(FlexibleArmStructure { robot: structure(c)?, by_current })?;
        let start = arm.defaults();
        return Ok((arm, start));
    }
    let chosen = chosen(c)?;
    let mut design = delian();
    if !c.joint_flexible.is_empty() {
        design.flex(&c.joint_flexible)?;
    }
    let design = linked(design, &chosen)?;
    let by_current = chosen(DRIVE_CHOICE) != Some(BY_TORQUE);
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current })?;
    let start = presets::parameters(&arm, &design);
    Ok((arm, start))
}

/// The design with links as they are chosen by name.
fn linked(mut design: RobotDesign, chosen: &impl Fn(&str) -> Option<usize>) -> Result<RobotDesign, String> {
    if let Some(n) = chosen(SHAPES_CHOICE) {
        if design.flexures.is_empty() {
            return Err(format!(
                "{SHAPES_CHOICE} = {n}: {} has no link that is a beam; leave it out",
                design.name
            ));
        }
        // None stays none: along there the link does not bend.
        let shapes = design.flexures.iter_mut().flat_map(|f| [&mut f.shapes.x, &mut f.shapes.y]);
        shapes.filter(|s| **s > 0).for_each(|s| *s = n);
    }
    if chosen(LINKS_CHOICE) == Some(RIGID) {
        design = design.stiffened();
    }
    design.axial_stiffening = chosen(AXIAL_CHOICE).map(|item| item == STIFFENING).or(design.axial_stiffening);
    Ok(design)
}

/// The design with what [`crate::choices`] lets one choose of the links of `FlexibleArm`.
///
/// # Errors
/// A choice that there is not, with the remedy.
pub fn with_links(design: RobotDesign, choices: &[(String, Vec<u32>)]) -> Result<RobotDesign, String> {
    let asked = Configuration { structure: choices.to_vec(), ..Configuration::of("FlexibleArm") };
    linked(design, &chosen(&asked)?)
}

/// The configuration of a model of this arm on the ground, with what these choose of its drive and of its solver.
///
/// # Errors
/// A structure that cannot be had, with the remedy.
pub fn of_arm(design: &RobotDesign, choices: &[(String, Vec<u32>)]) -> Result<Configuration, String> {
    let design = RobotDesign { held: true, ..design.clone() };
    let arm = FlexibleArm::new(FlexibleArmStructure { robot: design.structure(), by_current: true })?;
    let own = arm.defaults();
    let mut wanted = own.clone();
    let of_bodies = design.parameters();
    wanted[..of_bodies.len()].copy_from_slice(&of_bodies);
    let beside = choices.iter().filter(|c| [DRIVE_CHOICE, SOLVER_CHOICE].contains(&c.0.as_str())).cloned();
    Ok(Configuration {
        joint_flexible: arm.structure().robot.flexible.clone(),
        structure: encoded(&arm.structure().robot).into_iter().chain(beside).collect(),
        start: differing(&table(&arm, &own, false), &own, &wanted),
        ..Configuration::of("FlexibleArm")
    })
}

/// The table of a model with those start values (in the model's order), its steps of fixed size or not.
pub(crate) fn table(arm: &FlexibleArm, start: &[f64], fixed: bool) -> ModelTable {
    let s = arm.structure();
    let experiment = TableExperiment { stop_time: 0.2, tolerance: TOLERANCE, step_size: 1e-3 };
    let text = "Arm on the ground with flexible joints and links, stick-slip in its motors (DELIAN, eq. 1-6)";
    let mut b = PlantTableBuilder::new("FlexibleArm", text, experiment);
    b.items(&COUPLING);
    let kind = b.items(&DRIVE);
    let item = if s.by_current { 1.0 } else { BY_TORQUE as f64 };
    b.constant(DRIVE_CHOICE, kind, &[], &[item], "What the motors are driven by (fixed when packed)");
    stiffening(&mut b, &s.robot);
    let kind = b.items(&SOLVER);
    let item = if fixed { FIXED as f64 } else { 1.0 };
    b.constant(SOLVER_CHOICE, kind, &[], &[item], "How Co-Simulation integrates (fixed when packed)");
    constants(&mut b, &s.robot);
    b.parameters(&parameters(s), start);
    b.inputs(&inputs(s));
    b.outputs(&outputs(s));
    b.moved(&States::list(&s.robot));
    let driven = if s.by_current { "motorCurrent" } else { "jointTorque" };
    let drive = [driven, "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"];
    b.terminal("drive", "What a manipulator controller is wired to", &drive);
    if !s.robot.tips.is_empty() {
        b.terminal(
            "tip",
            "What is held at the tips",
            &["tipForce", "tipTorque", "tipPosition", "tipQuaternion", "tipVelocity", "tipAngularVelocity"],
        );
    }
    b.finish(arm.sizes().indicators)
}
