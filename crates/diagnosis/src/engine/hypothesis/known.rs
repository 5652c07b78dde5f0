//! Effects that the user declares: part of the nominal model, their parameters among its own.

use trueup_models::effect::{EffectChoice, ParameterRole, PlacedEffect, PlantKind, Scope};

use crate::engine::recordings::PreparedCase;

/// Index in the model of the parameter `k` of an effect at a site.
fn at(e: &PlacedEffect, k: usize, site: usize) -> usize {
    e.begin.parameters + k * e.sites + site
}

/// Which of a model's sites an effect that is at so many of them has for a joint.
fn site_of(e: &PlacedEffect, joint: usize) -> usize {
    if e.sites > joint { joint } else { 0 }
}

/// The effect acts at a joint: it is known, and one of its sizes is not neutral there.
pub(super) fn acts(p: &PreparedCase, choice: &EffectChoice, joint: usize) -> bool {
    let known = p.model.effects().iter().find(|e| e.choice == *choice);
    let Some(e) = known else { return false };
    let site = site_of(e, joint);
    let sizes = choice.parameters().iter().enumerate().filter(|(_, s)| s.role == ParameterRole::Amplitude);
    let mut moved = sizes.map(|(k, s)| p.nominal[at(e, k, site)] != s.neutral).peekable();
    if moved.peek().is_some() {
        return moved.any(|m| m);
    }
    // All that it has is borrowed.
    p.subject.plant == PlantKind::Joint || choice.scope() != Scope::Joint || rubs(p, joint)
}

/// An arm has motor friction at a joint.
pub(super) fn rubs(p: &PreparedCase, joint: usize) -> bool {
    let name = format!("coulombFriction[{}]", joint + 1);
    let named = p.subject.parameters(&p.model);
    named.iter().position(|n| n.name == name).is_some_and(|i| p.nominal[i] > 0.0)
}

/// Parameters of known effects that act: sizes, and shapes whose values have a standard deviation; units of measure are none.
pub(super) fn parameters(p: &PreparedCase) -> Vec<usize> {
    let named = p.subject.parameters(&p.model);
    let mut all = Vec::new();
    for e in p.model.effects().iter() {
        for (k, s) in e.choice.parameters().iter().enumerate() {
            for site in (0..e.sites).filter(|site| acts(p, &e.choice, *site)) {
                let i = at(e, k, site);
                let doubted = p.doubt.contains_key(&named[i].name);
                let fits = match s.role {
                    ParameterRole::Amplitude => p.nominal[i] != s.neutral && p.nominal[i] != 0.0,
                    ParameterRole::Shape => doubted,
                    ParameterRole::Reference | ParameterRole::Initial => false,
                };
                if fits {
                    all.push(i);
                }
            }
        }
    }
    all
}
