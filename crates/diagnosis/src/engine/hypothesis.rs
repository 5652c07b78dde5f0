//! What may be missing: effects of the library, each with what is unknown about it.

mod known;
mod pose;

use std::collections::{BTreeMap, BTreeSet};

use trueup_identification::run::IdentificationRun;
use trueup_identification::sizes::TypicalSizes;
use trueup_identification::unknown::Scale;
use trueup_models::arm::PayloadParameter;
use trueup_models::effect::{self, EffectChoice, Measure, ParameterRole, ParameterSpec, Scope};
use trueup_models::joint;

use super::problem::{BalanceTarget, BalanceUnknown};
use super::recordings::PreparedCase;
use super::unknown::UnknownPrior;
pub use pose::PosedHypothesis;

/// How often a push comes, or how often what has a first state of its own begins; whatever is neither acts all along.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Times {
    /// Once, at the same time in all recordings; a first state is that of an effect which begins again in each.
    Once,
    /// Several times, at the same times in all recordings.
    Several,
    /// Once in each recording, with times and sizes, or with a first state, of its own.
    EachRun,
}

/// One possible cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Hypothesis {
    /// The effect that is missing.
    pub choice: EffectChoice,
    /// Its id of the contract.
    pub id: String,
    /// Where it acts.
    pub component: String,
    /// Which joint or element, from 0.
    pub site: usize,
    /// Whether the arm has it per joint.
    pub per_joint: bool,
    /// How often it occurs (impulses).
    pub times: Times,
    /// It acts at a joint without a spring, where motor and link are one body.
    pub rigid: bool,
    /// It makes a recorded signal late, which can be shifted instead.
    pub shifted: bool,
}

impl Hypothesis {
    /// Effects that the model has to be built with.
    pub fn effects(&self) -> impl Iterator<Item = String> {
        self.packed().filter(|_| !self.shifts())
    }
    /// Effects that an FMU has to be packed with: what the search makes by shifting signals it has as effects.
    pub fn packed(&self) -> impl Iterator<Item = String> {
        let own = Some(self.choice).filter(|_| self.loosens().is_none());
        own.into_iter().chain(self.along()).map(|c| c.id())
    }
    /// What an arm has along with the effect.
    pub fn along(&self) -> Option<EffectChoice> {
        let id = self.choice.spec().along.filter(|_| self.per_joint)?;
        EffectChoice::parse(id, effect::PlantKind::Arm).ok()
    }
    /// The joint of an arm that it makes flexible: by the structure, for the effect makes all so that are rigid.
    pub fn loosens(&self) -> Option<usize> {
        (self.choice.spec().loosens() && self.per_joint).then_some(self.site)
    }
    /// The same cause in the same place, however its times are shared.
    pub fn same_place(&self, other: &Self) -> bool {
        self.choice == other.choice && self.site == other.site
    }
    /// Friction of the same rigid joint: no balance holds one that does not hold the other, and a law's form is no place.
    pub fn same_friction(&self, other: &Self) -> bool {
        let brakes = |h: &Self| matches!(h.id.as_str(), "motor-friction" | "load-friction");
        self.rigid && other.rigid && self.site == other.site && brakes(self) && brakes(other)
    }
    /// A push that comes and goes: when is found from what is missing.
    pub fn is_push(&self) -> bool {
        self.choice.spec().pulses > 0
    }

    /// It has a first state of its own, by which it may go on from one recording to the next.
    pub fn begins(&self) -> bool {
        self.choice.parameters().iter().any(|s| s.role == ParameterRole::Initial)
    }
    /// A command or a reading that is late: simulated by shifting signals in time; the FMU has it as an effect.
    pub fn shifts(&self) -> bool {
        self.shifted
    }

    /// The output that a sensor's error adds to.
    pub fn sensed(&self, p: &PreparedCase) -> Option<usize> {
        let choice = self.choice;
        if choice.scope() != Scope::Channel {
            return None;
        }
        let place = choice.place().map_or("", |p| p.name);
        elements_of(p, place).into_iter().find(|e| e.0 == self.site).map(|e| e.1)
    }

    /// The least that this order can be.
    pub fn least_order(&self) -> f64 {
        self.order().map_or(0.0, |p| p.min)
    }
    fn order(&self) -> Option<&'static ParameterSpec> {
        self.choice.spec().parameters.iter().find(|p| p.order)
    }
    /// Its name with the joint.
    pub fn label(&self) -> String {
        let place = self.choice.place().map_or(String::new(), |p| format!(":{}", p.name));
        let each = match self.times {
            Times::Once => "",
            Times::Several => " (several)",
            Times::EachRun => " (each run)",
        };
        if self.per_joint {
            format!("{}{place}[{}]{each}", self.id, self.site + 1)
        } else {
            format!("{}{place}{each}", self.id)
        }
    }
}

fn shown(runs: &[super::problem::Compared], output: usize) -> bool {
    runs.iter().any(|r| r.run.channels.iter().any(|c| c.output == output))
}
fn driven(run: &IdentificationRun, input: usize) -> bool {
    run.drives.iter().any(|d| d.input == input)
}

/// Parameters that may be refitted: index, name. Lengths of time and first states are not among them.
pub fn own_parameters(p: &PreparedCase) -> Vec<usize> {
    use joint::parameter as j;
    let names = p.subject.parameters(&p.model);
    match p.subject.plant {
        effect::PlantKind::Joint => {
            let v = &p.nominal;
            let mut all = vec![j::MOTOR_INERTIA, j::LOAD_INERTIA, j::TORQUE_CONSTANT];
            if p.subject.flexible[0] {
                all.extend([j::STIFFNESS, j::DAMPING]);
            }
            all.extend([j::COULOMB_FRICTION, j::VISCOUS_FRICTION]);
            if v[j::STATIC_FRICTION] > v[j::COULOMB_FRICTION] {
                all.push(j::STATIC_FRICTION);
            }
            if p.doubt.contains_key("gearRatio") {
                all.push(j::GEAR_RATIO);
            }
            all.retain(|i| v[*i] > 0.0);
            all.extend(known::parameters(p));
            all
        }
        effect::PlantKind::Arm | effect::PlantKind::Space => {
            const OWN: &[&str] = &[
                "baseMass",
                "baseInertia",
                "linkMass",
                "linkInertia",
                "linkCenterOfMass",
                "motorInertia",
                "jointStiffness",
                "jointDamping",
            ];
            let base = |n: &str| n.split('[').next().unwrap_or(n).to_owned();
            let held = |n: &str| p.subject.fixed_base && matches!(n, "baseMass" | "baseInertia");
            (0..names.len())
                .filter(|i| {
                    let name = base(&names[*i].name);
                    let spring = matches!(name.as_str(), "motorInertia" | "jointStiffness" | "jointDamping");
                    let element = names[*i]
                        .name
                        .split('[')
                        .nth(1)
                        .and_then(|e| e.trim_end_matches(']').parse::<usize>().ok());
                    let flexible = element.is_some_and(|e| p.subject.flexible[e - 1]);
                    OWN.contains(&name.as_str())
                        && !held(&name)
                        && p.nominal[*i] != 0.0
                        && (!spring || flexible)
                        || p.doubt.contains_key(&names[*i].name)
                            && (p.nominal[*i] != 0.0 || PayloadParameter::named(&names[*i].name).is_some())
                })
                .chain(known::parameters(p))
                .collect::<BTreeSet<_>>()
                .into_iter()
                .collect()
        }
    }
}

/// The unknown of a parameter of the plant with that relative standard deviation.
pub fn parameter(p: &PreparedCase, index: usize, doubt: f64) -> BalanceUnknown {
    let named = &p.subject.parameters(&p.model)[index];
    let start = p.nominal[index];
    let (scale, prior) = if start > 0.0 {
        (Scale::Log, (start.ln(), doubt))
    } else {
        (Scale::Linear(start.abs()), (start.signum(), doubt))
    };
    let (lower, upper) =
        if start > 0.0 { (start * 0.02, start * 50.0) } else { (start * 50.0, start * 0.02) };
    // An angle has no share of itself that it could be off by.
    let (scale, prior, lower, upper) = match p.model.effects().absolute_doubt(index) {
        true => (Scale::Linear(1.0), (start, doubt), f64::NEG_INFINITY, f64::INFINITY),
        false => (scale, prior, lower, upper),
    };
    // Nor has a payload: it may be none.
    let (scale, prior, lower, upper) = match PayloadParameter::named(&named.name) {
        Some(own) => (Scale::Linear(doubt), (start / doubt, 1.0), own.min, f64::INFINITY),
        None => (scale, prior, lower, upper),
    };
    BalanceUnknown {
        name: named.name.clone(),
        unit: named.unit.to_owned(),
        target: BalanceTarget::Parameter(index),
        run: None,
        start,
        scale,
        lower,
        upper,
        prior: Some(UnknownPrior::normal(prior.0, prior.1)),
    }
}

/// Everything that may be the cause.
pub fn all(p: &PreparedCase) -> Vec<Hypothesis> {
    let mut list = Vec::new();
    let joints = p.subject.joints();
    for choice in p.subject.choices() {
        let spec = choice.spec();
        let sites = match choice.scope() {
            Scope::Joint => joints,
            _ => 1,
        };
        for site in 0..sites {
            if spec.compliant && !p.subject.flexible[site] {
                continue;
            }
            let h = |component: &str, site: usize, per_joint: bool| Hypothesis {
                choice,
                id: spec.id.to_owned(),
                component: component.to_owned(),
                site,
                per_joint,
                times: Times::Once,
                rigid: choice.scope() == Scope::Joint && !p.subject.flexible[site],
                // What a servo commands is not recorded.
                shifted: spec.shifts && (choice.scope() == Scope::Channel || p.subject.servo(site).is_none()),
            };
            if choice.scope() == Scope::Channel {
                // One element of an output each.
                for (element, output, name) in elements_of(p, choice.place().map_or("", |p| p.name)) {
                    let indexed = name.contains('[');
                    // How late it is is estimated anyway.
                    let late = choice.spec().shifts
                        && p.sensors.iter().any(|u| u.target == BalanceTarget::TotalSensorDelay(output));
                    if shown(&p.train, output) && !late {
                        list.push(h(&format!("sensor:{name}"), element, indexed));
                    }
                }
                continue;
            }
            if !possible(p, &choice, site) {
                continue;
            }
            let per_joint = p.subject.plant == effect::PlantKind::Arm && choice.scope() == Scope::Joint;
            let once = h(choice.component(), site, per_joint);
            list.push(once.clone());
            if once.is_push() {
                list.push(Hypothesis { times: Times::Several, ..once.clone() });
            }
            if (once.is_push() || once.begins()) && p.train.len() > 1 {
                list.push(Hypothesis { times: Times::EachRun, ..once });
            }
        }
    }
    list
}

fn elements_of(p: &PreparedCase, channel: &str) -> Vec<(usize, usize, String)> {
    let outputs = p.subject.outputs();
    let named = outputs.iter().enumerate().filter(|(_, n)| n.split('[').next() == Some(channel));
    named.enumerate().map(|(element, (output, name))| (element, output, name.clone())).collect()
}

/// It is not there already, and something would show it.
fn possible(p: &PreparedCase, choice: &EffectChoice, site: usize) -> bool {
    let flexible = p.subject.flexible[site];
    if known::acts(p, choice, site) {
        return false;
    }
    if choice.spec().loosens() {
        return !flexible;
    }
    // What holds a fixed base takes any force; a field pulls at the links as well.
    if p.subject.fixed_base && choice.component() == "base" && !choice.spec().field {
        return false;
    }
    let commanded = || p.train.iter().any(|c| p.subject.drives(site).any(|input| driven(&c.run, input)));
    if choice.spec().on_command && !commanded() {
        return false;
    }
    match (choice.spec().id, p.subject.plant) {
        ("motor-friction", effect::PlantKind::Joint) => {
            p.nominal[joint::parameter::COULOMB_FRICTION] == 0.0
                && p.nominal[joint::parameter::VISCOUS_FRICTION] == 0.0
        }
        ("stribeck-friction", effect::PlantKind::Joint) => {
            p.nominal[joint::parameter::STATIC_FRICTION] <= p.nominal[joint::parameter::COULOMB_FRICTION]
        }
        // Friction of the plant that it has none of: only as motor-friction.
        ("asymmetric-friction" | "friction-drift" | "presliding-friction", effect::PlantKind::Joint) => {
            p.nominal[joint::parameter::COULOMB_FRICTION] > 0.0
        }
        (
            "asymmetric-friction" | "friction-drift" | "presliding-friction" | "stribeck-friction",
            effect::PlantKind::Arm,
        ) => known::rubs(p, site),
        _ => true,
    }
}

/// Which joint a cause is at, from 1. What is counted of a reading of the base is its axis.
pub(crate) fn joint_of(h: &Hypothesis, plant: effect::PlantKind) -> Option<usize> {
    let counted = h.per_joint && !h.component.starts_with("sensor:base");
    match plant {
        effect::PlantKind::Joint => Some(1),
        effect::PlantKind::Arm | effect::PlantKind::Space => counted.then_some(h.site + 1),
    }
}
