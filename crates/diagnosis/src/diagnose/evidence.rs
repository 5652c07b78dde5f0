//! A verdict by the evidence of the innovations alone: no free run, no gap.

use std::collections::BTreeMap;

use trueup_hypotheses::innovations::search::{JointFindings, search_joint};
use trueup_hypotheses::innovations::verdict::{JointJudgement, JointVerdict, judge};
use trueup_models::joint::parameter;
use trueup_signals::Loaded;

use super::{DiagnoseError, input_scale};
use crate::engine::recordings::Prepared;
use crate::engine::search::Search;
use crate::outcome::{
    Amount, Candidate, Claimed, Diagnosis, GapReport, SCHEMA, Sensors, Unknown, Verdict, Where,
};

/// What the verdict leaves out.
const NOTE: &str =
    "by the evidence of the innovations: sizes of effects, gaps and where the gap lies are not said";

/// Diagnoses a joint by the innovations about its smoothed trajectory; `capped`: a grave finding lets nothing be concluded. What the
/// recordings show of their own channels caps it too, unless `force`.
///
/// # Errors
/// See [`DiagnoseError`].
pub fn diagnose_by_evidence(loaded: &Loaded, capped: bool, force: bool) -> Result<Diagnosis, DiagnoseError> {
    let case = Prepared::new(loaded)?;
    let noticed = input_scale::mistaken(&Search::new(&case, 1).map_err(DiagnoseError::Short)?);
    let capped = capped || !noticed.is_empty() && !force;
    let found = search_joint(loaded)?;
    let nothing = || DiagnoseError::Nominal("no hypothesis could be compared with them".into());
    let judged = judge(&found).ok_or_else(nothing)?;
    Ok(Diagnosis { findings: noticed, ..told(loaded, &found, &judged, capped) })
}

fn told(loaded: &Loaded, found: &JointFindings, judged: &JointJudgement, capped: bool) -> Diagnosis {
    let verdict = match judged.verdict {
        _ if capped => Verdict::Unknown,
        JointVerdict::NoGap => Verdict::NoGap,
        JointVerdict::Parameters => Verdict::Parameters,
        JointVerdict::Effects => Verdict::Effects,
        JointVerdict::Ambiguous => Verdict::Ambiguous,
        JointVerdict::Unknown => Verdict::Unknown,
    };
    let set = if capped { &[][..] } else { &judged.set[..] };
    let several = if verdict == Verdict::Ambiguous { set.len().max(1) as f64 } else { 1.0 };
    let probability = judged.probability / several;
    let claim = |(id, component): &(&str, &str)| Claimed {
        id: (*id).to_owned(),
        component: (*component).to_owned(),
        joint: Some(1),
        probability,
        parameters: BTreeMap::new(),
        closed_alone: None,
    };
    let candidate = |h: &trueup_hypotheses::innovations::hypothesis::FittedEffect| Candidate {
        id: h.id.to_owned(),
        component: h.place.to_owned(),
        joint: Some(1),
        probability: if set.contains(&h.key()) { probability } else { 0.0 },
        evidence: h.evidence - found.null.evidence,
        holdout_gap: None,
    };
    let theta = match (verdict, found.effects.first()) {
        (Verdict::Effects | Verdict::Ambiguous, Some(h)) => &h.fit.theta,
        _ => &found.null.theta,
    };
    let names = found.null.names.iter().zip(theta);
    let unit = |name: &str| parameter::NAMES.iter().find(|n| n.0 == name).map_or("", |n| n.1);
    let amount = |(name, value): (&&'static str, &f64)| {
        let amount = Amount { value: *value, unit: unit(name).to_owned(), ci95: [None, None], reason: None };
        ((*name).to_owned(), amount)
    };
    let ambiguous = verdict == Verdict::Ambiguous;
    let alike = set.iter().map(|s| s.0.to_owned()).collect();
    let unknown = verdict == Verdict::Unknown;
    Diagnosis {
        schema: SCHEMA.into(),
        model: loaded.case.model.clone(),
        verdict,
        gap: GapReport::default(),
        sensors: Sensors::default(),
        location: Where::default(),
        effects: set.iter().map(claim).collect(),
        candidates: found.effects.iter().map(candidate).collect(),
        parameters: names.map(amount).collect(),
        indistinguishable: if ambiguous { vec![alike] } else { Vec::new() },
        unknown: Unknown { present: unknown, probability: 1.0 - judged.probability, place: None },
        next_experiment: None,
        watch: None,
        augmented: None,
        capped,
        findings: Vec::new(),
        inputs: None,
        notes: vec![NOTE.into()],
    }
}
