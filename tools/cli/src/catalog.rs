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

/// Every effect, in the order in which they act.
pub(crate) fn effects() -> impl Iterator<Item = Effect> {
    effect::ALL.iter().map(|e| e.spec()).map(|s| Effect {
        id: s.id,
        description: s.summary,
        models: s.plants.iter().map(|p| model_of(*p)).collect(),
    })
}

fn model_of(plant: Plant) -> &'static str {
    match plant {
        Plant::Joint => "TwoMassJoint",
        Plant::Arm => "PlanarManipulator",
    }
}
