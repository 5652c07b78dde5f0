//! Effects that are fitted together with the model's parameters: where their parameters are, how large they are likely to be, and
//! where a search for them begins.

use trueup_models::effect::{
    EffectChoice, Measure, Neutral, ParameterRole, ParameterSpec, PlacedEffect, PlantKind, Scope,
};
use trueup_signals::{Case, base_name};

use super::unknowns::CommonUnknown;
use super::{IdentifyError, SearchStart};
use crate::model::SimulatedPlant;
use crate::run::IdentificationRun;
use crate::sizes::{Rig, TypicalSizes};
use crate::unknown::{FitTarget, FitUnknown, Scale};

/// Deviation of the logarithm of an unknown shape, and of an angle in rad.
const SHAPELESS: f64 = 2.0;
/// Multiples of its size that a shape is tried at.
const SHAPES: &[f64] = &[0.1, 0.3, 1.0, 4.0];
/// Multiples of its usual size that an effect as a whole is tried at: sizes follow the torque of the motor, and a spring that is
/// released holds more.
const LARGER: [f64; 2] = [5.0, 25.0];

/// What is fitted of them.
pub(super) struct Effects {
    /// Their unknowns, all requested.
    pub(super) fitted: Vec<CommonUnknown>,
    /// Parameter and value of each further start, with its meaning.
    looks: Vec<(String, usize, f64)>,
    /// Parameters that grow with the effect's size, and from where.
    sized: Vec<(usize, f64)>,
}

/// The effects that a case names to be fitted, in a model that has them; units of measure go into `nominal`.
pub(super) fn of(
    model: &SimulatedPlant,
    case: &Case,
    nominal: &mut [f64],
    runs: &[IdentificationRun],
) -> Result<Effects, IdentifyError> {
    let mut all = Effects { fitted: Vec::new(), looks: Vec::new(), sized: Vec::new() };
    let list: Vec<&IdentificationRun> = runs.iter().collect();
    let plain = nominal.to_vec();
    let rig = Rig {
        plant: model.effect_plant(),
        flexible: &model.structure().flexible,
        values: &plain,
        runs: &list,
    };
    let sizes = TypicalSizes::of(&rig);
    for id in &case.with {
        let choice = EffectChoice::parse(id, model.effect_plant()).map_err(crate::model::ModelError::from)?;
        let spec = choice.spec();
        let refuse = |what: &str| Err(IdentifyError::Unknowns(format!("{id} {what}")));
        if case.known_effects().contains(&id.as_str()) {
            return refuse(
                "is in [effects] too: there it has values and standard deviations, here none; name it once",
            );
        }
        if spec.loosens() {
            return refuse("is a spring; write jointFlexible = true, and fit its stiffness and damping");
        }
        if spec.pulses > 0 {
            return refuse("comes and goes at times that a fit does not find; see `trueup diagnose`");
        }
        let Some(placed) = model.effects().iter().find(|e| e.choice == choice) else { continue };
        // In the spring of a joint that has none it does nothing.
        let acts = |site: &usize| !spec.compliant || model.structure().flexible.get(*site).is_none_or(|f| *f);
        for site in (0..placed.sites).filter(acts) {
            let size = |m: Measure| match m {
                Measure::Reading => sizes.range(placed.channel + site),
                m => sizes.get(if choice.scope() == Scope::Channel { 0 } else { site }, m),
            };
            for (k, s) in choice.parameters().iter().enumerate() {
                let at = placed.begin.parameters + k * placed.sites + site;
                all.one(model, case, nominal, at, s, s.scale.value(size));
            }
            all.borrowed(model, case, placed, site, &size);
        }
    }
    Ok(all)
}

impl Effects {
    fn one(
        &mut self,
        model: &SimulatedPlant,
        case: &Case,
        nominal: &mut [f64],
        at: usize,
        s: &ParameterSpec,
        size: f64,
    ) {
        let q = &model.parameters()[at];
        let given = case.number(&q.name);
        let search = s.search_in(model.effect_plant());
        let looks = |usual: &'static [f64]| if search.looks.is_empty() { usual } else { search.looks };
        let (lower, upper) = (s.min, s.max.min(search.most));
        let by_log = |start: f64, prior: Option<(f64, f64)>| FitUnknown {
            lower: lower.max(1e-5 * start),
            upper: upper.min(1e5 * start),
            prior,
            ..FitUnknown::positive(&q.name, at, start)
        };
        let linear = |start: f64, scale: f64| FitUnknown {
            start,
            lower,
            upper,
            scale: Scale::Linear(scale),
            ..FitUnknown::free(&q.name, FitTarget::Parameter(at), None, scale)
        };
        let first = |looks: &[f64]| looks.get(looks.len() / 2).copied().unwrap_or(1.0);
        let angle = s.role == ParameterRole::Shape && !s.log && s.unit == "rad";
        let (unknown, factors) = match s.role {
            ParameterRole::Reference => {
                nominal[at] = given.unwrap_or(size);
                return;
            }
            // Every recording begins again, or as in the case.
            ParameterRole::Initial => {
                nominal[at] = given.unwrap_or(0.0);
                return;
            }
            ParameterRole::Amplitude if s.neutral.is_infinite() || s.log => {
                let looks = looks(&[0.6, 1.0, 1.6]);
                (by_log(given.unwrap_or(first(looks) * size), None), looks)
            }
            ParameterRole::Amplitude => {
                let looks = looks(&[1.0]);
                (linear(given.unwrap_or(s.neutral + first(looks) * size), size), looks)
            }
            ParameterRole::Shape if s.log => {
                let start = given.unwrap_or(size);
                (by_log(start, Some((start.ln(), SHAPELESS))), looks(SHAPES))
            }
            ParameterRole::Shape if angle => {
                let start = given.unwrap_or(0.0);
                let u = FitUnknown { prior: given.map(|g| (g, SHAPELESS)), ..linear(start, 1.0) };
                (u, &[-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2, std::f64::consts::PI][..])
            }
            ParameterRole::Shape => {
                let start = given.unwrap_or(0.0);
                (
                    FitUnknown { prior: Some((start / size, SHAPELESS)), ..linear(start, size) },
                    looks(&[-1.0, 1.0]),
                )
            }
        };
        match s.role {
            ParameterRole::Amplitude if s.neutral.is_finite() && given.is_none() => {
                self.sized.push((at, s.neutral))
            }
            ParameterRole::Shape if s.log && given.is_none() => self.sized.push((at, 0.0)),
            _ => {}
        }
        let size = if angle { 1.0 } else { size };
        for f in factors.iter().filter(|_| given.is_none()) {
            let value =
                if s.role == ParameterRole::Amplitude && s.neutral.is_finite() { s.neutral } else { 0.0 }
                    + f * size;
            if value != unknown.start && value >= unknown.lower && value <= unknown.upper {
                self.looks.push((format!("{} at {value:.2e}", q.name), at, value));
            }
        }
        self.fitted.push(CommonUnknown { unknown, asked_for: true, doubt: None });
    }

    /// What a plant has along with the effect: friction of an arm.
    fn borrowed(
        &mut self,
        model: &SimulatedPlant,
        case: &Case,
        e: &PlacedEffect,
        site: usize,
        size: &impl Fn(Measure) -> f64,
    ) {
        if model.effect_plant() == PlantKind::Joint {
            return;
        }
        for b in e.spec().borrows {
            let name = format!("{}[{}]", b.arm_name, site + 1);
            let known = self.fitted.iter().any(|f| f.unknown.name == name);
            let (Some(at), false) = (model.parameter(&name), known) else { continue };
            let Neutral::Value(neutral) = b.neutral else { continue };
            let scale = b.scale.value(size);
            let start = case.number(&name).unwrap_or(neutral + scale);
            let free = FitUnknown::free(&name, FitTarget::Parameter(at), None, scale);
            let unknown = FitUnknown { start, lower: neutral, scale: Scale::Linear(scale), ..free };
            self.fitted.push(CommonUnknown { unknown, asked_for: true, doubt: None });
        }
    }

    /// Names of the plant's own parameters that the effects depend on, and without which they do nothing.
    pub(super) fn stands_on(model: &SimulatedPlant, case: &Case) -> Vec<&'static str> {
        if model.effect_plant() != PlantKind::Joint {
            return Vec::new();
        }
        let all = case.with.iter().filter_map(|id| EffectChoice::parse(id, PlantKind::Joint).ok());
        all.flat_map(|c| c.spec().borrows.iter().map(|b| b.joint_name))
            .filter(|n| base_name(n) == *n)
            .collect()
    }

    /// The case's own start with one of their parameters elsewhere, or all of them larger.
    pub(super) fn starts(&self, first: &SearchStart) -> Vec<SearchStart> {
        let start = |from: String, move_to: &dyn Fn(usize, f64) -> f64| SearchStart {
            from,
            values: first.values.iter().map(|v| (v.0, move_to(v.0, v.1))).collect(),
            cost: None,
            chosen: false,
        };
        let moved = |(what, at, value): &(String, usize, f64)| {
            start(what.clone(), &|i, v| if i == *at { *value } else { v })
        };
        let grown = |i: usize, v: f64, by: f64| {
            self.sized.iter().find(|s| s.0 == i).map_or(v, |(_, from)| from + by * (v - from))
        };
        let larger = LARGER.iter().filter(|_| !self.sized.is_empty());
        let larger = larger.map(|by| start(format!("effects {by} times as large"), &|i, v| grown(i, v, *by)));
        self.looks.iter().map(moved).chain(larger).collect()
    }
}
