//! decision.json: what a verdict was decided from.
//!
//! The numbers of the judgement, the gaps of free runs without effects, and every set that was fitted with the values of its unknowns.

use serde::Serialize;

use super::innovations::JudgedCase;
use crate::engine::free::FreeRun;
use crate::engine::hypothesis::Hypothesis;
use crate::engine::problem::BalanceUnknown;
use crate::engine::result::SearchResult;
use crate::engine::search::FittedSet;

/// Name of the file next to diagnosis.json.
pub const FILE: &str = "decision.json";
/// Its schema.
pub(super) const SCHEMA: &str = "trueup.decision/2";

/// What a verdict was decided from.
#[derive(Clone, Debug, Serialize)]
pub struct DecisionRecord {
    /// `trueup.decision/2`.
    pub schema: String,
    /// The judgement; `None`: no causes were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub innovations: Option<JudgedCase>,
    /// Excess of the nominal model as it is: power of the equation errors over that of a perfect model, less 1. Of an FMU there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raw_excess: Option<f64>,
    /// Gaps of free runs without effects.
    pub free: FreeRun,
    /// Nothing added.
    pub plain: RecordedSet,
    /// What was chosen.
    pub best: RecordedSet,
    /// Every set that was fitted.
    pub sets: Vec<RecordedSet>,
}

/// A set that was fitted.
#[derive(Clone, Debug, Serialize)]
pub struct RecordedSet {
    /// Its causes.
    pub causes: Vec<RecordedCause>,
    /// Its unknowns.
    pub posterior: Vec<RecordedEstimate>,
    /// What its equation errors leave, as [`DecisionRecord::raw_excess`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excess: Option<f64>,
}

/// A cause.
#[derive(Clone, Debug, Serialize)]
pub struct RecordedCause {
    /// Effect id of the contract.
    pub id: String,
    /// Where it acts.
    pub component: String,
    /// Which joint or element, from 1; `None`: the plant has it once.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<usize>,
}

/// An unknown of a set.
#[derive(Clone, Debug, Serialize)]
pub struct RecordedEstimate {
    /// Name.
    pub name: String,
    /// Mean, in `unit`.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard deviation of the coordinate that it was estimated in (a logarithm where it has a sign).
    pub deviation: f64,
}

impl DecisionRecord {
    /// Of a search.
    pub(super) fn new(found: &SearchResult, raw_excess: f64, free: FreeRun) -> Self {
        Self {
            schema: SCHEMA.into(),
            innovations: None,
            raw_excess: Some(raw_excess),
            free,
            plain: RecordedSet::of(&found.plain),
            best: RecordedSet::of(&found.best),
            sets: found.sets.iter().map(RecordedSet::of).collect(),
        }
    }
}

impl RecordedSet {
    fn of(f: &FittedSet) -> Self {
        let estimates = f.stated.unknowns.iter().zip(f.theta.iter().zip(f.deviations()));
        let estimate = |(u, (x, deviation)): (&BalanceUnknown, (&f64, f64))| {
            let (name, unit) = (u.name.clone(), u.unit.clone());
            RecordedEstimate { name, value: u.scale.value(*x).0, unit, deviation }
        };
        Self {
            causes: f.stated.set.iter().map(RecordedCause::of).collect(),
            posterior: estimates.map(estimate).collect(),
            excess: Some(f.excess()),
        }
    }
}

impl RecordedCause {
    fn of(h: &Hypothesis) -> Self {
        let joint = h.per_joint.then_some(h.site + 1);
        Self { id: h.id.clone(), component: h.component.clone(), joint }
    }
}
