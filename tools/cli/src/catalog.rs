//! What can be packed: the models of the two libraries with their presets and effects.

use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_models::effect::{self, Plant};
use trueup_models::presets::{PRESETS, Preset};

/// A model and the library that holds it.
#[derive(Clone, Copy)]
pub(crate) struct Model {
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
    /// Name of the library's crate.
    pub(crate) library: &'static str,
    /// The variable table of a configuration.
    pub(crate) table: fn(&Configuration) -> Result<ModelTable, String>,
    /// The result of its default experiment as CSV.
    pub(crate) reference: fn(&Configuration) -> Result<String, String>,
}

/// An effect and the models in which it can act.
pub(crate) struct Effect {
    pub(crate) id: &'static str,
    pub(crate) description: &'static str,
    pub(crate) models: Vec<&'static str>,
}

pub(crate) fn models() -> impl Iterator<Item = Model> {
    let plant = |name, description| Model {
        name,
        description,
        library: "fmu_plant",
        table: stub::table,
        reference: stub::reference,
    };
    let controller = |name, description| Model {
        name,
        description,
        library: "fmu_controller",
        table: stub::table,
        reference: stub::reference,
    };
    [
        plant("TwoMassJoint", "flexible geared joint with true stick-slip"),
        plant("PlanarManipulator", "free-floating planar manipulator with rigid and flexible joints"),
        controller("JointController", "P/PI and wave-based control of one joint"),
        controller("ManipulatorController", "the same control law for every joint of an arm"),
    ]
    .into_iter()
}

/// Presets of this model.
pub(crate) fn presets(model: &str) -> impl Iterator<Item = &'static Preset> {
    PRESETS.iter().filter(move |p| p.model == model)
}

/// Effects that can act in this model.
pub(crate) fn effects(model: &str) -> Vec<Effect> {
    let (plant, model) = match model {
        "TwoMassJoint" => (Plant::Joint, "TwoMassJoint"),
        "PlanarManipulator" => (Plant::Arm, "PlanarManipulator"),
        _ => return Vec::new(),
    };
    let specs = effect::ALL.iter().map(|e| e.spec()).filter(|s| s.plants.contains(&plant));
    specs.map(|s| Effect { id: s.id, description: s.summary, models: vec![model] }).collect()
}

/// Stands for the model libraries until they are there.
mod stub {
    use super::{Configuration, ModelTable};

    pub(super) fn table(c: &Configuration) -> Result<ModelTable, String> {
        Err(format!("{} is not built into this program yet", c.model))
    }
    pub(super) fn reference(c: &Configuration) -> Result<String, String> {
        Err(format!("{} is not built into this program yet", c.model))
    }
}
