//! The variable table of `PlanarManipulator`.

use crate::builder::PlantTableBuilder;
use crate::experiment::TOLERANCE;
use trueup_fmi::table::{BoundaryType, ModelTable, TableExperiment};
use trueup_models::arm::layout::states;
use trueup_models::arm::{
    BASE, BASE_CHOICE, BY_ACCELERATION, FIXED_BASE, InverseDynamics, JOINT_DRIVE, JOINT_DRIVE_CHOICE,
    PlanarManipulator, input, output, parameter,
};
use trueup_models::effect::PlantKind;
use trueup_numerics::hybrid::Hybrid;

const ONE: &[usize] = &[];

/// The table of a manipulator of that structure with those start values (in the model's order).
pub(crate) fn table(model: &PlanarManipulator, start: &[f64]) -> ModelTable {
    let mut b = begun(model);
    let s = model.layout();
    b.parameters(&parameter::list(&s), start);
    b.inputs(&input::list(&s));
    b.outputs(&output::list(&s));
    b.moved(&states(&s));
    b.effects(model.effects(), PlantKind::Arm);
    drive(&mut b);
    tip(&mut b);
    b.finish(model.sizes().indicators)
}

/// The same of one whose motors are driven by accelerations.
pub(crate) fn inverse_table(inverse: &InverseDynamics) -> ModelTable {
    let model = inverse.arm();
    let mut b = begun(model);
    let kind = b.items(&JOINT_DRIVE);
    b.constant(
        JOINT_DRIVE_CHOICE,
        kind,
        ONE,
        &[f64::from(BY_ACCELERATION)],
        "What drives the joints (fixed when packed)",
    );
    let s = model.layout();
    b.parameters(&parameter::list(&s), &model.defaults());
    let mut inputs = input::list(&s);
    inputs[0] = inverse.given();
    b.inputs(&inputs);
    b.outputs(&output::list(&s));
    b.outputs(&[inverse.found()]);
    b.moved(&states(&s));
    tip(&mut b);
    b.finish(model.sizes().indicators)
}

fn begun(model: &PlanarManipulator) -> PlantTableBuilder {
    let experiment = TableExperiment { stop_time: 10.0, tolerance: TOLERANCE, step_size: 1e-2 };
    let mut b = PlantTableBuilder::new(
        "PlanarManipulator",
        "Planar free-floating manipulator with flexible joints (CBK PAN test-bed, eq. 1-23)",
        experiment,
    );
    constants(&mut b, model);
    b
}

fn tip(b: &mut PlantTableBuilder) {
    b.terminal(
        "tip",
        "What is held at the tip",
        &["tipForce", "tipTorque", "tipPosition", "tipAttitude", "tipVelocity"],
    );
}

/// What is fixed when packed.
pub(crate) fn constants(b: &mut PlantTableBuilder, model: &PlanarManipulator) {
    let flexible: Vec<f64> = model.flexible().iter().map(|f| f64::from(*f)).collect();
    let n = flexible.len();
    b.constant(
        "numberOfLinks",
        BoundaryType::Integer,
        ONE,
        &[n as f64],
        "Number of links, n (fixed when packed)",
    );
    b.constant(
        "jointFlexible",
        BoundaryType::Boolean,
        &[n],
        &flexible,
        "The joint has its spring (fixed when packed)",
    );
    let kind = b.items(&BASE);
    let item = if model.has_fixed_base() { FIXED_BASE } else { 1 };
    b.constant(BASE_CHOICE, kind, ONE, &[f64::from(item)], "What becomes of the base (fixed when packed)");
}

/// What a controller is wired to.
pub(crate) fn drive(b: &mut PlantTableBuilder) {
    b.terminal(
        "drive",
        "What a manipulator controller is wired to",
        &["jointTorque", "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"],
    );
}

/// The structure of the CBK PAN test-bed: joint 1 flexible, joints 2 and 3 rigid.
pub const TEST_BED: [bool; 3] = [true, false, false];
