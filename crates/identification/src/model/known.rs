//! Effects that a case declares.

use trueup_models::effect::{EffectChoice, Neutral, ParameterRole, PlantKind, Scope};
use trueup_signals::{Case, base_name, element_name};

use super::{ModelError, SimulatedPlant};

/// Level at which dry friction breaks away.
const BREAKAWAY: &str = "staticFriction";

/// Whether every known effect can be one and has a size, and whether gravity has a base that holds against it.
pub(super) fn check(model: &SimulatedPlant, case: &Case) -> Result<(), ModelError> {
    let plant = model.effect_plant();
    let falls = case.parameters.iter().find(|(name, value)| {
        let named = model.parameter(name).is_some() && base_name(name) == "gravity";
        named
            && model.arm().is_some()
            && !model.structure().fixed_base
            && value.number().is_some_and(|g| g != 0.0)
    });
    if let Some((name, value)) = falls {
        return Err(ModelError::Parameter {
            name: name.clone(),
            what: format!(
                "it is {value}, and the base floats: it would fall; write base = \"fixed\", or give 0"
            ),
        });
    }
    for known in &case.effects {
        let choice = EffectChoice::parse(&known.id, plant)?;
        let spec = choice.spec();
        let refuse =
            |what: String| Err(ModelError::Parameter { name: format!("effects.{}", known.id), what });
        if spec.loosens() {
            return refuse(
                "that a joint is flexible is its structure; write jointFlexible in [parameters]".into(),
            );
        }
        let indexed = plant != PlantKind::Joint && choice.scope() == Scope::Joint;
        match known.joint {
            Some(j) if !indexed && (plant != PlantKind::Joint || j > 1) => {
                return refuse(format!("it occurs once in {}; remove joint = {j}", case.model));
            }
            Some(j) if j > model.structure().flexible.len() => {
                let n = model.structure().flexible.len();
                return refuse(format!("there is no joint {j}; the model has {n}"));
            }
            _ => {}
        }
        // What an effect has of the plant's, and the level at which the friction that it brings along breaks away.
        let mut brought: Vec<&str> = spec.borrows.iter().flat_map(|b| [b.joint_name, b.arm_name]).collect();
        brought.extend(Some(BREAKAWAY).filter(|_| spec.friction && plant != PlantKind::Joint));
        // Whose parameter is it?
        let own = |name: &str| {
            let base = base_name(name);
            let named = choice.parameters().iter().any(|s| choice.variable(s.name) == base);
            named || brought.contains(&base)
        };
        if let Some(other) = known.given.iter().find(|g| !own(g)) {
            let mut all: Vec<String> = choice.parameters().iter().map(|s| choice.variable(s.name)).collect();
            all.extend(
                brought.iter().filter(|n| model.elements(n).next().is_some()).map(|n| (*n).to_owned()),
            );
            all.dedup();
            return refuse(format!(
                "{other} is no parameter of this effect, which has {}; correct it, or move it to [parameters]",
                all.join(", ")
            ));
        }
        let element = |base: &str| match known.joint.filter(|_| indexed) {
            Some(j) => element_name(base, &[j]),
            None => base.to_owned(),
        };
        let has = |name: &str| case.parameters.keys().any(|p| p == name || base_name(p) == name);
        let sizes = choice.parameters().iter().filter(|s| s.role == ParameterRole::Amplitude);
        let sizes: Vec<String> = sizes.map(|s| choice.variable(s.name)).collect();
        let borrowed = spec.borrows.iter().filter(|b| b.neutral != Neutral::Structure);
        let borrowed =
            borrowed.map(|b| if plant == PlantKind::Joint { b.joint_name } else { b.arm_name }.to_owned());
        let all: Vec<String> = sizes.into_iter().chain(borrowed).map(|name| element(&name)).collect();
        if !all.is_empty() && !all.iter().any(|name| has(name)) {
            let joint = if indexed && known.joint.is_none() { ", and `joint`" } else { "" };
            return refuse(format!(
                "its size is not given; give the prior value of {}, with a `doubt`{joint}",
                all.join(" or ")
            ));
        }
    }
    Ok(())
}
