//! What is claimed: effects with their amplitudes, candidates, parameters, what could not be distinguished.

use std::collections::BTreeMap;

use trueup_identification::packed::{PackedModel, PackedValue};
use trueup_models::effect;
use trueup_plant::PlantQuantity;

use super::AugmentedModel;
use super::began::FreeRunStart;
use super::estimate::SetEstimate;
use crate::engine::decide::Decision;
use crate::engine::hypothesis::{Hypothesis, joint_of};
use crate::engine::problem::{BalanceTarget, BalanceUnknown};
use crate::engine::replay::CompleteModel;
use crate::engine::result::SearchResult;
use crate::engine::search::{CaseSearch, FittedSet};
use crate::engine::subject::EngineModel;
use crate::outcome::{CandidateCause, Claimed, ClaimedAmount, Verdict};
use trueup_numerics::order::descending;

/// Probabilities of the `i`-th cause that is claimed and of its alternatives: at most one of them is true, so that
/// together they are no more than what `unknown` leaves.
fn probabilities(found: &SearchResult, decision: &Decision, i: usize) -> impl Fn(f64) -> f64 {
    let own = decision.probability[i];
    let mut seen: Vec<&Hypothesis> = found.best.stated.set.iter().collect();
    let mut sum = own;
    for (at, odds) in decision.rivals.get(i).into_iter().flatten() {
        let other = found.best.replaced_in(&found.sets[*at]);
        if let Some(h) = other.filter(|h| !seen.iter().any(|s| s.same_place(h))) {
            seen.push(h);
            sum += own * odds.exp();
        }
    }
    let share = ((1.0 - decision.unknown.clamp(0.0, 1.0)) / sum.max(f64::MIN_POSITIVE)).min(1.0);
    move |odds| own * odds.exp() * share
}

/// Rivals of a claimed effect that are reported with it.
const RIVALS: usize = 2;

/// What is claimed. `best` is the estimate of the chosen set, `of` makes that of a rival's.
pub(super) fn effects(
    plant: effect::PlantKind,
    found: &SearchResult,
    best: &SetEstimate,
    of: &dyn Fn(&FittedSet) -> SetEstimate,
    decision: &Decision,
) -> Vec<Claimed> {
    let rivals = match decision.verdict {
        Verdict::Effects => 0,
        Verdict::Ambiguous => RIVALS,
        _ => return Vec::new(),
    };
    let mut all: Vec<Claimed> = Vec::new();
    for (i, h) in found.best.stated.set.iter().enumerate() {
        let probability = probabilities(found, decision, i);
        all.push(best.claimed(h, probability(0.0), plant, found));
        let others = decision.close(found, i).filter(|r| r.cause.id != h.id).take(rivals);
        for r in others {
            let rival = of(r.set);
            // One effect may act at several joints.
            for cause in found.best.all_replaced_in(r.set) {
                let c = rival.claimed(cause, probability(r.odds), plant, found);
                if !all.iter().any(|o| o.id == c.id && o.component == c.component && o.joint == c.joint) {
                    all.push(c);
                }
            }
        }
    }
    descending(&mut all, |item| item.probability);
    all
}

pub(super) fn candidates(
    plant: effect::PlantKind,
    found: &SearchResult,
    decision: &Decision,
) -> Vec<CandidateCause> {
    let mut all: Vec<CandidateCause> = Vec::new();
    let mut add = |h: &Hypothesis, probability: f64, evidence: f64| {
        let joint = joint_of(h, plant);
        let (id, component) = (h.id.clone(), h.component.clone());
        let c = CandidateCause { id, component, joint, probability, evidence, holdout_gap: None };
        if !all.iter().any(|o| o.is_same(&c)) {
            all.push(c);
        }
    };
    let base = found.plain.evidence(1.0);
    if decision.verdict != Verdict::NoGap {
        let mut chosen: Vec<(usize, &Hypothesis)> = found.best.stated.set.iter().enumerate().collect();
        descending(&mut chosen, |item| decision.probability[item.0]);
        for (i, h) in &chosen {
            add(h, probabilities(found, decision, *i)(0.0), found.best.evidence(1.0) - base);
        }
        for (i, _) in &chosen {
            let probability = probabilities(found, decision, *i);
            for (at, odds) in &decision.rivals[*i] {
                let f = &found.sets[*at];
                for other in found.best.all_replaced_in(f) {
                    add(other, probability(*odds), f.evidence(1.0) - base);
                }
            }
        }
    }
    for f in found.sets.iter().filter(|f| f.stated.set.len() == 1) {
        add(&f.stated.set[0], 0.0, f.evidence(1.0) - base);
    }
    all
}

/// The plant's own parameters and what was estimated of its sensors.
pub(super) fn parameters(best: &SetEstimate) -> BTreeMap<String, ClaimedAmount> {
    let stated = best.stated();
    let own = stated.begin.first().copied().unwrap_or(stated.unknowns.len());
    let fitted = |u: &BalanceUnknown| u.run.is_none() && u.lower < u.upper;
    let shared = stated.unknowns[..own].iter().enumerate().filter(|(_, u)| fitted(u));
    let mut all: BTreeMap<String, ClaimedAmount> =
        shared.map(|(k, u)| (u.name.clone(), best.amount(k, 0.0))).collect();
    let offsets = stated.unknowns[..own].iter().enumerate();
    let mut each: BTreeMap<&str, Vec<ClaimedAmount>> = BTreeMap::new();
    for (k, u) in offsets.filter(|(_, u)| u.run.is_some() && matches!(u.target, BalanceTarget::Offset(_))) {
        each.entry(&u.name).or_default().push(best.amount(k, 0.0));
    }
    all.extend(each.into_iter().filter_map(|(name, amounts)| Some((name.to_owned(), of_all(amounts)?))));
    // What follows another parameter has its value: static friction that is the Coulomb friction, unless an effect has it exceed that.
    let named = &stated.model.plant().table().parameters;
    let exceeds = |which: usize| {
        stated.unknowns.iter().any(|u| matches!(u.target, BalanceTarget::Above { at, .. } if at == which))
    };
    for (which, whom) in stated.ties.iter().filter(|(which, _)| !exceeds(*which)) {
        if let Some(amount) = all.get(&named[*whom].name).cloned() {
            all.entry(named[*which].name.clone()).or_insert(amount);
        }
    }
    all
}

/// What is estimated for each recording separately as one figure: the mean, with all that any of them allows.
fn of_all(amounts: Vec<ClaimedAmount>) -> Option<ClaimedAmount> {
    let value = amounts.iter().map(|a| a.value).sum::<f64>() / amounts.len() as f64;
    let end = |i: usize, worse: fn(f64, f64) -> f64| {
        amounts.iter().map(|a| a.ci95[i]).reduce(|a, b| Some(worse(a?, b?)))
    };
    let ci95 = [end(0, f64::min)?, end(1, f64::max)?];
    let reason = amounts.iter().find_map(|a| a.reason.clone());
    Some(ClaimedAmount { value, ci95, reason, ..amounts.into_iter().next()? })
}

pub(super) fn indistinguishable(found: &SearchResult, decision: &Decision) -> Vec<Vec<String>> {
    if decision.verdict != Verdict::Ambiguous {
        return Vec::new();
    }
    let mut sets = Vec::new();
    for (i, h) in found.best.stated.set.iter().enumerate() {
        let mut set = vec![h.id.clone()];
        let others = decision.close(found, i).map(|r| r.cause);
        set.extend(others.map(|o| o.id.clone()));
        let set = distinct(set);
        if set.len() > 1 {
            sets.push(set);
        }
    }
    sets
}

/// Effects that are claimed in one place and fit as well in another.
pub(super) fn elsewhere(plant: effect::PlantKind, found: &SearchResult, decision: &Decision) -> Vec<String> {
    if !matches!(decision.verdict, Verdict::Effects | Verdict::Ambiguous) {
        return Vec::new();
    }
    let place = |h: &Hypothesis| match joint_of(h, plant) {
        Some(joint) if h.per_joint => format!("{} of joint {joint}", h.component),
        _ => h.component.clone(),
    };
    let mut notes = Vec::new();
    for (i, h) in found.best.stated.set.iter().enumerate() {
        let others = decision.close(found, i).map(|r| r.cause);
        let places = distinct(others.filter(|o| o.id == h.id).map(place).filter(|p| *p != place(h)));
        if !places.is_empty() {
            notes.push(format!("{} fits as well at {} as at {}", h.id, places.join(", "), place(h)));
        }
    }
    notes
}

/// Without repeats, each where it came first.
fn distinct<T: PartialEq>(list: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut all = Vec::new();
    for item in list {
        if !all.contains(&item) {
            all.push(item);
        }
    }
    all
}

pub(super) fn augmented(
    search: &CaseSearch<'_>,
    after: &CompleteModel,
    began: Option<&FreeRunStart>,
) -> AugmentedModel {
    let stated = &after.stated;
    let problem = search.compare(stated);
    let values = problem.parameters(0, &after.theta);
    // An FMU has the link and what it carries in one.
    let values = match &stated.model {
        EngineModel::Arm(m) => m.merged(&values),
        EngineModel::Joint(_) => values,
    };
    let named = search.case.subject.parameters(&stated.model);
    let mut all: Vec<(String, f64)> =
        named.iter().zip(values).filter(|(n, _)| !n.is_initial()).map(|(n, v)| (n.name.clone(), v)).collect();
    // A replay that estimates what sensors show has the rest as the first recording has it.
    if let Some(began) = began {
        all.extend(began.states.iter().filter(|(name, _)| began.hidden.contains(name)).cloned());
    }
    let effects = search.case.subject.with_known(stated.set.iter().flat_map(Hypothesis::packed));
    for i in 0..stated.set.len() {
        for (own, x) in stated.posed[i].unknowns.iter().zip(&after.theta[stated.begin[i]..]) {
            if own.target.shifts() {
                all.push((own.name.clone(), own.scale.value(*x).0));
            }
        }
    }
    let flexible = match &stated.model {
        EngineModel::Arm(m) => m.flexible().to_vec(),
        EngineModel::Joint(_) => search.case.subject.flexible.clone(),
    };
    let subject = &search.case.subject;
    let claim = |h: &Hypothesis| (h.id.clone(), h.component.clone(), joint_of(h, subject.plant));
    let claims = stated.set.iter().map(claim).collect();
    let (fixed_base, payload) = (subject.fixed_base, subject.payload);
    AugmentedModel { effects, flexible, fixed_base, values: all, claims, payload }
}

impl AugmentedModel {
    /// As it is packed; `case`: whose diagnosis added effects.
    pub(super) fn packed(
        &self,
        model: &str,
        case: Option<String>,
        parameters: &[PlantQuantity],
    ) -> PackedModel {
        let quantity = |name: &str| parameters.iter().find(|q| q.name == name);
        let value = |(name, value): &(String, f64)| match quantity(name) {
            Some(q) => PackedModel::named(std::slice::from_ref(q), &[*value]).next(),
            None => Some((name.clone(), PackedValue::Number(*value))),
        };
        let initial = |(name, value): &(String, f64)| {
            let begins = quantity(name).is_some_and(PlantQuantity::is_initial);
            begins.then(|| (name.clone(), PackedValue::Number(*value)))
        };
        let finite = self.values.iter().filter(|v| v.1.is_finite());
        PackedModel {
            model: model.to_owned(),
            robot: None,
            held: false,
            case,
            effects: self.effects.clone(),
            flexible: self.flexible.clone(),
            structure: PackedModel::base(self.fixed_base),
            start: finite.filter_map(|v| initial(v).or_else(|| value(v))).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::hypothesis::Times;
    use crate::engine::made::{fitted, found};

    /// The first of these sets claimed, the others not distinguished from it, likeliest first.
    fn ambiguous(sets: &[&str]) -> (SearchResult, Decision) {
        let rivals = (1..sets.len()).map(|at| (at, -0.1 * at as f64)).collect();
        let decision = Decision {
            verdict: Verdict::Ambiguous,
            rivals: vec![rivals],
            probability: vec![0.5],
            explained: 1.0,
            unknown: 0.0,
        };
        (found(sets.iter().map(|set| fitted(set, 1.0, 10.0)).collect(), Some(0), 10.0), decision)
    }

    #[test]
    fn indistinguishable_causes_are_named_once() {
        let sets =
            ["backlash[1]", "motor-friction[1]", "backlash[2]", "motor-friction[2]", "cable-stiffness[1]"];
        let (found, decision) = ambiguous(&sets);
        assert_eq!(indistinguishable(&found, &decision), [["backlash", "motor-friction", "cable-stiffness"]]);
        // The same effect elsewhere is no other.
        let (found, decision) = ambiguous(&["backlash[1]", "backlash[2]"]);
        assert!(indistinguishable(&found, &decision).is_empty());
    }

    #[test]
    fn one_of_a_set_or_none_is_certain() {
        let (found, mut decision) = ambiguous(&["backlash[1]", "motor-friction[1]", "cable-stiffness[1]"]);
        (decision.probability, decision.unknown) = (vec![0.9], 0.1);
        let all = candidates(effect::PlantKind::Joint, &found, &decision);
        let sum: f64 = all.iter().map(|c| c.probability).sum();
        assert!((sum - 0.9).abs() < 1e-12, "{sum}: 0.9 exp(-0.1 k) were 2.45");
        assert!(all[0].probability > all[1].probability && all[1].probability > all[2].probability);
        // Of rivals that hardly count nothing is taken.
        decision.rivals = vec![vec![(1, -9.0)]];
        decision.probability = vec![0.5];
        assert_eq!(candidates(effect::PlantKind::Joint, &found, &decision)[0].probability, 0.5);
    }

    #[test]
    fn what_acts_at_no_joint_is_a_candidate_at_none() {
        let (mut found, mut decision) = ambiguous(&["backlash[2]", "motor-friction[2]"]);
        decision.rivals[0] = vec![(1, 0.0)];
        let joints = |found: &SearchResult| -> Vec<Option<usize>> {
            candidates(effect::PlantKind::Arm, found, &decision).iter().map(|c| c.joint).collect()
        };
        assert_eq!(joints(&found), [Some(2), Some(2)]);
        found.sets[1].stated.set[0].per_joint = false;
        assert_eq!(joints(&found), [Some(2), None]);
        // An axis is no joint.
        found.sets[1].stated.set[0].per_joint = true;
        found.sets[1].stated.set[0].component = "sensor:basePosition[2]".into();
        assert_eq!(joints(&found), [Some(2), None]);
    }

    #[test]
    fn an_effect_at_several_joints_has_rivals_at_all_of_them() {
        let motors = "motor-friction[1] motor-friction[3]";
        let (mut found, mut decision) = ambiguous(&[motors, "load-friction[1] load-friction[3]"]);
        found.best = fitted(motors, 1.0, 10.0);
        let rivals = decision.rivals[0].clone();
        (decision.rivals, decision.probability) = (vec![rivals; 2], vec![0.8; 2]);
        let all = candidates(effect::PlantKind::Arm, &found, &decision);
        let named: Vec<(&str, Option<usize>)> = all.iter().map(|c| (&*c.id, c.joint)).collect();
        let [motor, load] = ["motor-friction", "load-friction"];
        assert_eq!(named, [(motor, Some(1)), (motor, Some(3)), (load, Some(1)), (load, Some(3))]);
        let own = SetEstimate::new(&found.best, None);
        let claims =
            effects(effect::PlantKind::Arm, &found, &own, &|set| SetEstimate::new(set, None), &decision);
        let claimed: Vec<(&str, Option<usize>)> = claims.iter().map(|c| (&*c.id, c.joint)).collect();
        assert_eq!(claimed, named);
    }

    #[test]
    fn a_place_is_named_once() {
        let (mut found, decision) =
            ambiguous(&["backlash[1]", "backlash[2]", "motor-friction[1]", "backlash[3]", "backlash[2]"]);
        // Another form of the same cause.
        found.sets[4].stated.set[0].times = Times::EachRun;
        let notes = elsewhere(effect::PlantKind::Arm, &found, &decision);
        let place = &found.best.stated.set[0].component;
        let note = format!(
            "backlash fits as well at {place} of joint 2, {place} of joint 3 as at {place} of joint 1"
        );
        assert_eq!(notes, [note]);
    }
}
