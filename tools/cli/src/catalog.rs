//! What can be packed: the models with their presets and effects.

use trueup_models::effect::{self, EffectChoice, PlantKind, Spec};
use trueup_models::flexible_arm::presets as arm;
use trueup_models::presets::{PRESETS, ValuePreset};
use trueup_models::space::presets as robots;

/// A model.
#[derive(Clone, Copy)]
pub(crate) struct CatalogModel {
    pub(crate) name: &'static str,
    pub(crate) description: &'static str,
}

/// An effect and the models in which it can act.
pub(crate) struct CatalogEffect {
    pub(crate) id: &'static str,
    pub(crate) description: &'static str,
    pub(crate) models: Vec<String>,
    /// Where it can act, if in several places: `id:place`.
    pub(crate) places: Vec<&'static str>,
}

pub(crate) fn models() -> impl Iterator<Item = CatalogModel> {
    let model = |name, description| CatalogModel { name, description };
    [
        model("TwoMassJoint", "flexible geared joint with true stick-slip"),
        model("PlanarManipulator", "free-floating planar manipulator with rigid and flexible joints"),
        model("SpatialFreeFlyer", "base with arms in space: joints, thrusters, wrenches at the tips"),
        model(ARM, "arm on the ground with flexible joints and links, stick-slip in its motors (DELIAN)"),
        model("FreeBody", "rigid body that floats in the plane, with docking points"),
        model("GripperContact", "contact of a gripper of balls with a docking port, bodies from elsewhere"),
        model(CAPTURE, "chaser, gripper and target in one: a capture in the plane or in space"),
        model(
            CONTROLLER,
            "control of a robot in space: hands by the generalized Jacobian, base free or held",
        ),
        model("JointController", "P/PI and wave-based control of one joint"),
        model(ARM_CONTROLLER, "the same control law for every joint of an arm"),
    ]
    .into_iter()
}

/// Values of the parameters of this model, by a name.
pub(crate) fn presets(model: &str) -> impl Iterator<Item = &'static ValuePreset> {
    PRESETS.iter().filter(move |p| p.model == model)
}

/// The controller of an arm, for any number of joints.
pub(crate) const ARM_CONTROLLER: &str = "ManipulatorController";

/// The model whose presets are robots.
pub(crate) const FLYER: &str = "SpatialFreeFlyer";

/// The model of arms on the ground.
pub(crate) const ARM: &str = "FlexibleArm";

/// The model whose chaser may be an arm.
pub(crate) const CAPTURE: &str = "CaptureScene";

/// The model that controls robots in space.
pub(crate) const CONTROLLER: &str = "SpaceController";

/// Whether a model is made of a robot's bodies.
pub(crate) fn of_robots(model: &str) -> bool {
    [FLYER, ARM, CONTROLLER, CAPTURE].contains(&model)
}

/// Names of all presets of this model, robots included, with where they are from.
pub(crate) fn preset_names(model: &str) -> Vec<(&'static str, &'static str)> {
    let of_values = presets(model).map(|p| (p.name, p.source));
    let robots =
        robots::PRESETS.iter().filter(|_| [FLYER, CONTROLLER].contains(&model)).map(|p| (p.name, p.source));
    let delian =
        (arm::DELIAN, "ESA's DELIAN arm: what its paper prints, and what is assumed (docs/flexible-arm.md)");
    of_values.chain(robots).chain((model == ARM).then_some(delian)).collect()
}

/// What of the model's structure is chosen by name.
pub(crate) fn choices(model: &str) -> &'static [fmu_library::StructureOption] {
    fmu_library::choices(model)
}

/// Every effect, in the order in which they act.
pub(crate) fn effects() -> impl Iterator<Item = CatalogEffect> {
    effect::ALL.iter().map(|e| e.spec()).map(|s| CatalogEffect {
        id: s.id,
        description: s.summary,
        models: s.plants.iter().map(|p| named(s, *p)).collect(),
        places: places(s),
    })
}

/// Names of an effect's places, each once: some are other places in space.
fn places(effect: &'static Spec) -> Vec<&'static str> {
    let mut names = Vec::new();
    for place in effect.places {
        if !names.contains(&place.name) {
            names.push(place.name);
        }
    }
    names
}

/// One of these effects brings the friction of motors to a robot in space.
pub(crate) fn bring_friction(ids: &[String]) -> bool {
    ids.iter().filter_map(|id| EffectChoice::parse(id, PlantKind::Space).ok()).any(|c| c.spec().friction)
}

/// Why an effect of that id does not act in this model, whose chaser is a robot in space or not.
pub(crate) fn misfit(model: &str, in_space: bool, id: &str) -> Option<String> {
    let plant = plant_of(model, in_space)?;
    EffectChoice::parse(id, plant).err().map(|why| why.to_string())
}

/// Those of the ids that act in this model, in the order in which they act, each once; `None` where one does not. A capture's chaser is
/// a robot in space or not.
pub(crate) fn in_order(model: &str, in_space: bool, ids: &[String]) -> Option<Vec<String>> {
    if ids.is_empty() {
        return Some(Vec::new());
    }
    let plant = plant_of(model, in_space)?;
    let asked: Option<Vec<_>> = ids.iter().map(|id| EffectChoice::parse(id, plant).ok()).collect();
    let asked = asked?;
    let named = |c: EffectChoice| asked.iter().position(|a| *a == c).map(|i| ids[i].clone());
    Some(EffectChoice::all(plant).filter_map(named).collect())
}

/// The model, with the base that it has to have.
fn named(effect: &Spec, plant: PlantKind) -> String {
    let base = if effect.acts_in(plant, false) { "" } else { " with base=fixed" };
    format!("{}{base}", model_of(plant))
}

/// An effect that acts in this model requires a fixed base.
pub(crate) fn wants_fixed_base(model: &str, id: &str) -> bool {
    let of = |plant| EffectChoice::parse(id, plant).is_ok_and(|c| !c.spec().acts_in(plant, false));
    [PlantKind::Joint, PlantKind::Arm].into_iter().any(|p| model_of(p) == model && of(p))
}

/// What effects see in this model: a capture has an arm or a robot in space, unless its chaser is rigid.
fn plant_of(model: &str, in_space: bool) -> Option<PlantKind> {
    let captures = if in_space { PlantKind::Space } else { PlantKind::Arm };
    let of = |p: &PlantKind| model_of(*p) == model || *p == captures && model == CAPTURE;
    [PlantKind::Joint, PlantKind::Arm, PlantKind::Space].into_iter().find(of)
}

fn model_of(plant: PlantKind) -> &'static str {
    match plant {
        PlantKind::Joint => "TwoMassJoint",
        PlantKind::Arm => "PlanarManipulator",
        PlantKind::Space => FLYER,
    }
}
