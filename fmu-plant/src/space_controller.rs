//! The variable table of `SpaceController`, and robots as its configurations: those of `SpatialFreeFlyer` by another name.

use crate::builder::PlantTableBuilder;
use crate::space::{constants, differing, encoded, structure};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{ModelTable, TableExperiment};
use trueup_fmi_export::reference::Schedule;
use trueup_models::space::control::SpaceController;
use trueup_models::space::control::layout::{Inputs, Outputs, Parameters, States};
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::COUPLING;
use trueup_models::space::presets;
use trueup_numerics::hybrid::Hybrid;

/// Of its default experiment.
const TOLERANCE: f64 = 1e-6;

/// The model of a configuration, and start values of its parameters before those of the configuration.
pub(crate) fn build(c: &Configuration) -> Result<(SpaceController, Vec<f64>), String> {
    if let Some(effect) = c.effects.first() {
        return Err(format!(
            "SpaceController takes no effects, `{effect}` neither; they belong to the plants"
        ));
    }
    if c.structure.is_empty() {
        let design = presets::chaser();
        let joints = design.links.len();
        if !c.joint_flexible.is_empty() && c.joint_flexible.len() != joints {
            let given = c.joint_flexible.len();
            return Err(format!("jointFlexible has {given} entries; {} has {joints} joints", design.name));
        }
        let model = SpaceController::new(design.structure())?;
        let start = model.parameters(&design);
        return Ok((model, start));
    }
    let model = SpaceController::new(structure(c)?)?;
    let start = model.defaults();
    Ok((model, start))
}

/// The configuration of a controller of this robot.
///
/// # Errors
/// A structure that cannot be had, with the remedy.
pub fn controller_of_design(design: &RobotDesign) -> Result<Configuration, String> {
    let model = SpaceController::new(design.structure())?;
    let own = model.defaults();
    Ok(Configuration {
        structure: encoded(model.structure()),
        joint_flexible: model.structure().flexible.clone(),
        start: differing(&table(&model, &own), &own, &model.parameters(design)),
        ..Configuration::of(SpaceController::NAME)
    })
}

/// The table of a model with those start values (in the model's order).
pub(crate) fn table(model: &SpaceController, start: &[f64]) -> ModelTable {
    let s = model.structure();
    let experiment = TableExperiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let text =
        "Control of a robot in space: hands by the generalized Jacobian (on-orbit contact, eq. 12, 13, 17)";
    let mut b = PlantTableBuilder::new(SpaceController::NAME, text, experiment);
    b.items(&COUPLING);
    constants(&mut b, s);
    let all: Vec<_> = model.robot_parameters().into_iter().chain(Parameters::list(s)).collect();
    b.parameters(&all, start);
    b.inputs(&Inputs::list(s));
    b.outputs(&Outputs::list(s));
    b.moved(&States::list(s));
    b.terminal(
        "drive",
        "What drives the joints, and their sensors",
        &["jointTorque", "jointAngle", "jointVelocity"],
    );
    if !s.held {
        let members = ["baseTorque", "baseQuaternion", "baseVelocity", "baseAngularVelocity"];
        b.terminal("base", "What turns the base, and its sensors", &members);
    }
    b.finish(model.sizes().indicators)
}

/// Inputs of the reference experiment: the first hand moves out and back, or the first joint of a robot without hands.
pub(crate) fn schedule(c: &Configuration) -> Schedule<'static> {
    let hands = c.structure.is_empty() || structure(c).is_ok_and(|s| !s.tips.is_empty());
    if hands {
        &[
            (1.0, "tipVelocityReference[1,1]", -0.05),
            (4.0, "tipVelocityReference[1,2]", 0.03),
            (6.0, "tipVelocityReference[1,1]", 0.0),
            (8.0, "tipVelocityReference[1,2]", 0.0),
        ]
    } else {
        &[(1.0, "jointVelocityReference[1]", 0.05), (6.0, "jointVelocityReference[1]", 0.0)]
    }
}
