//! The variable table of `FlexibleArm`, and arms as configurations.

use crate::builder::Builder;
use crate::experiment::TOLERANCE;
use crate::space::{constants, differing, encoded, structure};
use crate::structure::chosen;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{Experiment, ModelTable};
use trueup_models::flexible_arm::layout::{
    AXIAL, AXIAL_CHOICE, DRIVE, DRIVE_CHOICE, FIXED, LINKS_CHOICE, SHAPES_CHOICE, SOLVER, SOLVER_CHOICE,
    inputs, outputs, parameters,
};
use trueup_models::flexible_arm::presets::{self, delian};
use trueup_models::flexible_arm::{FlexibleArm, Structure};
use trueup_models::space::design::Design;
use trueup_models::space::layout::{COUPLING, States};
use trueup_numerics::hybrid::Hybrid;

/// Items of the choices.
const BY_TORQUE: usize = 2;
const RIGID: usize = 2;
const STIFFENING: usize = 2;
/// Whose structure is given body by body.
const PARENT: &str = "parent";

/// Size of the steps of Co-Simulation where they are fixed, s.
pub(crate) const STEP: f64 = 1e-3;

/// What is chosen in addition to a structure that is given body by body.
const BESIDE: [&str; 3] = [DRIVE_CHOICE, AXIAL_CHOICE, SOLVER_CHOICE];

/// The item that is chosen of one of [`BESIDE`].
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
    if c.structure.iter().any(|s| s.0 == PARENT) {
        let by_current = item(c, DRIVE_CHOICE) != Some(BY_TORQUE);
        let own: Vec<_> = c.structure.iter().filter(|s| !BESIDE.contains(&s.0.as_str())).cloned().collect();
        let mut robot = structure(&Configuration { structure: own, ..c.clone() })?;
        robot.axial_stiffening = item(c, AXIAL_CHOICE) == Some(STIFFENING);
        let arm = FlexibleArm::new(Structure { robot, by_current })?;
        let start = arm.defaults();
        return Ok((arm, start));
    }
    let chosen = chosen(c)?;
    let mut design = delian();
    if !c.joint_flexible.is_empty() {
        design.flex(&c.joint_flexible)?;
    }
    if let Some(n) = chosen(SHAPES_CHOICE) {
        design.flexures.iter_mut().for_each(|f| (f.shapes.x, f.shapes.y) = (n, n));
    }
    if chosen(LINKS_CHOICE) == Some(RIGID) {
        design = design.stiffened();
    }
    design.axial_stiffening = chosen(AXIAL_CHOICE) == Some(STIFFENING);
    let by_current = chosen(DRIVE_CHOICE) != Some(BY_TORQUE);
    let arm = FlexibleArm::new(Structure { robot: design.structure(), by_current })?;
    let start = presets::parameters(&arm, &design);
    Ok((arm, start))
}

/// The configuration of a model of this arm, its motors driven by currents.
///
/// # Errors
/// A structure that cannot be had, with the remedy.
pub fn of_arm(design: &Design) -> Result<Configuration, String> {
    let design = Design { held: true, ..design.clone() };
    let arm = FlexibleArm::new(Structure { robot: design.structure(), by_current: true })?;
    let own = arm.defaults();
    let mut wanted = own.clone();
    let of_bodies = design.parameters();
    wanted[..of_bodies.len()].copy_from_slice(&of_bodies);
    Ok(Configuration {
        joint_flexible: arm.structure().robot.flexible.clone(),
        structure: encoded_arm(&arm.structure().robot),
        start: differing(&table(&arm, &own, false), &own, &wanted),
        ..Configuration::of("FlexibleArm")
    })
}

/// A structure, body by body.
fn encoded_arm(robot: &trueup_models::space::Structure) -> Vec<(String, Vec<u32>)> {
    let mut all = encoded(robot);
    if robot.axial_stiffening {
        all.push((AXIAL_CHOICE.to_owned(), vec![STIFFENING as u32]));
    }
    all
}

/// The table of a model with those start values (in the model's order), its steps of fixed size or not.
pub(crate) fn table(arm: &FlexibleArm, start: &[f64], fixed: bool) -> ModelTable {
    let s = arm.structure();
    let experiment = Experiment { stop_time: 0.2, tolerance: TOLERANCE, step_size: 1e-3 };
    let text = "Arm on the ground with flexible joints and links, stick-slip in its motors (DELIAN, eq. 1-6)";
    let mut b = Builder::new("FlexibleArm", text, experiment);
    b.items(&COUPLING);
    let kind = b.items(&DRIVE);
    let item = if s.by_current { 1.0 } else { BY_TORQUE as f64 };
    b.constant(DRIVE_CHOICE, kind, &[], &[item], "What the motors are driven by (fixed when packed)");
    let kind = b.items(&AXIAL);
    let item = if s.robot.axial_stiffening { STIFFENING as f64 } else { 1.0 };
    b.constant(
        AXIAL_CHOICE,
        kind,
        &[],
        &[item],
        "Whether loads along the links stiffen them (fixed when packed)",
    );
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
