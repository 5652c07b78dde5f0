//! Effects that are fitted together with the model's parameters: where their parameters are, how large they are likely to be, and
//! where a search for them begins.

use trueup_models::effect::{Choice, Measure, Neutral, ParameterSpec, Placed, Plant, Role, Scope};
use trueup_signals::{Case, base_name};

use super::unknowns::Fitted;
use super::{IdentifyError, Start};
use crate::model::Model;
use crate::run::Run;
use crate::sizes::{Rig, Sizes};
use crate::unknown::{Scale, Target, Unknown};

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
    pub(super) fitted: Vec<Fitted>,
    /// Parameter and value of each further start, with its meaning.
    looks: Vec<(String, usize, f64)>,
    /// Parameters that grow with the effect's size, and from where.
    sized: Vec<(usize, f64)>,
}

/// The effects that a case names to be fitted, in a model that has them; units of measure go into `nominal`.
pub(super) fn of(
    model: &Model,
    case: &Case,
    nominal: &mut [f64],
    runs: &[Run],
) -> Result<Effects, IdentifyError> {
    let mut all = Effects { fitted: Vec::new(), looks: Vec::new(), sized: Vec::new() };
    let list: Vec<&Run> = runs.iter().collect();
    let plain = nominal.to_vec();
    let rig = Rig {
        plant: model.effect_plant(),
        flexible: &model.structure().flexible,
        values: &plain,
        runs: &list,
    };
    let sizes = Sizes::of(&rig);
    for id in &case.with {
        let choice = Choice::parse(id, model.effect_plant()).map_err(crate::model::ModelError::from)?;
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
        model: &Model,
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
        let by_log = |start: f64, prior: Option<(f64, f64)>| Unknown {
            lower: lower.max(1e-5 * start),
            upper: upper.min(1e5 * start),
            prior,
            ..Unknown::positive(&q.name, at, start)
        };
        let linear = |start: f64, scale: f64| Unknown {
            start,
            lower,
            upper,
            scale: Scale::Linear(scale),
            ..Unknown::free(&q.name, Target::Parameter(at), None, scale)
        };
        let first = |looks: &[f64]| looks.get(looks.len() / 2).copied().unwrap_or(1.0);
        let angle = s.role == Role::Shape && !s.log && s.unit == "rad";
        let (unknown, factors) = match s.role {
            Role::Reference => {
                nominal[at] = given.unwrap_or(size);
                return;
            }
            // Every recording begins again, or as in the case.
            Role::Initial => {
                nominal[at] = given.unwrap_or(0.0);
                return;
            }
            Role::Amplitude if s.neutral.is_infinite() || s.log => {
                let looks = looks(&[0.6, 1.0, 1.6]);
                (by_log(given.unwrap_or(first(looks) * size), None), looks)
            }
            Role::Amplitude => {
                let looks = looks(&[1.0]);
                (linear(given.unwrap_or(s.neutral + first(looks) * size), size), looks)
            }
            Role::Shape if s.log => {
                let start = given.unwrap_or(size);
                (by_log(start, Some((start.ln(), SHAPELESS))), looks(SHAPES))
            }
            Role::Shape if angle => {
                let start = given.unwrap_or(0.0);
                let u = Unknown { prior: given.map(|g| (g, SHAPELESS)), ..linear(start, 1.0) };
                (u, &[-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2, std::f64::consts::PI][..])
            }
            Role::Shape => {
                let start = given.unwrap_or(0.0);
                (
                    Unknown { prior: Some((start / size, SHAPELESS)), ..linear(start, size) },
                    looks(&[-1.0, 1.0]),
                )
            }
        };
        match s.role {
            Role::Amplitude if s.neutral.is_finite() && given.is_none() => self.sized.push((at, s.neutral)),
            Role::Shape if s.log && given.is_none() => self.sized.push((at, 0.0)),
            _ => {}
        }
        let size = if angle { 1.0 } else { size };
        for f in factors.iter().filter(|_| given.is_none()) {
            let value =
                if s.role == Role::Amplitude && s.neutral.is_finite() { s.neutral } else { 0.0 } + f * size;
            if value != unknown.start && value >= unknown.lower && value <= unknown.upper {
                self.looks.push((format!("{} at {value:.2e}", q.name), at, value));
            }
        }
        self.fitted.push(Fitted { unknown, asked_for: true, doubt: None });
    }

    /// What a plant has along with the effect: friction of an arm.
    fn borrowed(
        &mut self,
        model: &Model,
        case: &Case,
        e: &Placed,
        site: usize,
        size: &impl Fn(Measure) -> f64,
    ) {
        if model.effect_plant() == Plant::Joint {
            return;
        }
        for b in e.spec().borrows {
            let name = format!("{}[{}]", b.arm_name, site + 1);
            let known = self.fitted.iter().any(|f| f.unknown.name == name);
            let (Some(at), false) = (model.parameter(&name), known) else { continue };
            let Neutral::Value(neutral) = b.neutral else { continue };
            let scale = b.scale.value(size);
            let start = case.number(&name).unwrap_or(neutral + scale);
            let free = Unknown::free(&name, Target::Parameter(at), None, scale);
            let unknown = Unknown { start, lower: neutral, scale: Scale::Linear(scale), ..free };
            self.fitted.push(Fitted { unknown, asked_for: true, doubt: None });
        }
    }

    /// Names of the plant's own parameters that the effects depend on, and without which they do nothing.
    pub(super) fn stands_on(model: &Model, case: &Case) -> Vec<&'static str> {
        if model.effect_plant() == Plant::Arm {
            return Vec::new();
        }
        let all = case.with.iter().filter_map(|id| Choice::parse(id, Plant::Joint).ok());
        all.flat_map(|c| c.spec().borrows.iter().map(|b| b.joint_name))
            .filter(|n| base_name(n) == *n)
            .collect()
    }

    /// The case's own start with one of their parameters elsewhere, or all of them larger.
    pub(super) fn starts(&self, first: &Start) -> Vec<Start> {
        let start = |from: String, move_to: &dyn Fn(usize, f64) -> f64| Start {
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
