//! The variable table of `TwoMassJoint`.

use crate::builder::PlantTableBuilder;
use crate::experiment::TOLERANCE;
use trueup_fmi::table::{BoundaryType, ModelTable, TableExperiment};
use trueup_models::effect::PlantKind;
use trueup_models::joint::{
    GEARBOX, GEARBOX_CHOICE, JointLayout, TWO_STAGES, TwoMassJoint, TwoStageJoint, input, output, parameter,
    states,
};
use trueup_models::presets;
use trueup_numerics::hybrid::Hybrid;

/// The table of a joint of that structure; start values: DELIAN's joint 1. `gear_ratio` is the one packed, if
/// it is another, for the nominal values.
pub(crate) fn table(model: &TwoMassJoint, gear_ratio: Option<f64>) -> ModelTable {
    let mut b = begun(model);
    let s = model.layout(gear_ratio);
    b.parameters(&parameter::list(&s), &presets::delian(1).unwrap_or_default());
    moved(&mut b, model, &s);
    plugs(&mut b);
    b.finish(model.sizes().indicators)
}

/// The same of one with a gearbox of two stages.
pub(crate) fn two_stage_table(model: &TwoStageJoint, gear_ratio: f64) -> ModelTable {
    let mut b = begun(model.joint());
    let kind = b.items(&GEARBOX);
    b.constant(
        GEARBOX_CHOICE,
        kind,
        &[],
        &[f64::from(TWO_STAGES)],
        "What describes the transmission (fixed when packed)",
    );
    b.parameters(&model.parameters(), &model.defaults());
    moved(&mut b, model.joint(), &model.layout(Some(gear_ratio)));
    b.outputs(&TwoStageJoint::shown());
    plugs(&mut b);
    b.finish(model.sizes().indicators)
}

fn begun(model: &TwoMassJoint) -> PlantTableBuilder {
    let experiment = TableExperiment { stop_time: 2.0, tolerance: TOLERANCE, step_size: 1e-3 };
    let mut b = PlantTableBuilder::new(
        "TwoMassJoint",
        "Two-mass flexible joint with stick-slip friction (Comi et al., DELIAN, section 3.2)",
        experiment,
    );
    b.constant("jointFlexible", BoundaryType::Boolean, &[], &[f64::from(model.flexible())], "The joint has its spring; false: one rigid geared mass, motorAngle = n loadAngle (fixed when packed)");
    b
}

/// All but the parameters.
fn moved(b: &mut PlantTableBuilder, model: &TwoMassJoint, s: &JointLayout) {
    b.inputs(&input::list(s));
    b.outputs(&output::list(s));
    b.moved(&states(s));
    b.effects(model.effects(), PlantKind::Joint);
}

fn plugs(b: &mut PlantTableBuilder) {
    b.terminal(
        "drive",
        "What a joint controller is wired to",
        &["motorCurrent", "motorAngle", "motorVelocity", "loadAngle", "loadVelocity"],
    );
    b.terminal("load", "What acts on the load", &["externalTorque", "loadAngle", "loadVelocity"]);
}
