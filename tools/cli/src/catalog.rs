//! What can be packed: the models with their presets and effects.

use trueup_models::effect::{self, Plant};
use trueup_models::presets::{PRESETS, Preset};

/// A model.
#[derive(Clone, Copy)]
pub(crate) struct Model {
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
}

/// An effect and the models in which it can act.
pub(crate) struct Effect {
    pub(crate) id: &'static str,
    pub(crate) description: &'static str,
    pub(crate) models: Vec<&'static str>,
}

pub(crate) fn models() -> impl Iterator<Item = Model> {
    let model = |name, description| Model { name, description };
    [
        model("TwoMassJoint", "flexible geared joint with true stick-slip"),
        model("PlanarManipulator", "free-floating planar manipulator with rigid and flexible joints"),
        model("JointController", "P/PI and wave-based control of one joint"),
        model("ManipulatorController", "the same control law for every joint of an arm"),
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
