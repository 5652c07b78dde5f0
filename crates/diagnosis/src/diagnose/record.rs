//! decision.json: what a verdict was decided from, so that it can be decided again without a fit or a simulation.
//!
//! Every set that was fitted with its posterior (mean and standard deviation of its unknowns), its evidence, what its
//! balances leave by octave, and the gap of its free run where it had one. What is lost: numbers that are not finite, which
//! JSON has not; they come back as NaN.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_models::joint::TwoMassJoint;

use super::claim::{candidates, effects, indistinguishable};
use super::estimate::SetEstimate;
use super::innovations::JudgedCase;
use crate::engine::decide::{FreeRun, FreeRunResults, LeftOut, Thresholds, decide};
use crate::engine::hypothesis::{Hypothesis, HypothesisClaim, Times};
use crate::engine::search::{FittedSet, Octave, PosedSet};
use crate::engine::select::SearchResult;
use crate::engine::subject::EngineModel;
use crate::json::number;
use crate::outcome::{CandidateCause, Claimed, UnknownShare, Verdict};

/// Name of the file next to diagnosis.json.
pub const FILE: &str = "decision.json";
/// Its schema.
const SCHEMA: &str = "trueup.decision/1";

/// What a verdict was decided from.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DecisionRecord {
    /// `trueup.decision/1`.
    pub schema: String,
    /// The plant is an arm, no joint.
    pub arm: bool,
    /// The innovations engine decided, from this; `None`: balances and free runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub innovations: Option<JudgedCase>,
    /// Why balances decided where the innovations engine would have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instead: Option<String>,
    /// Why no causes were compared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_compared: Option<String>,
    /// Excess of the nominal model as it is: power over that of a perfect model, less 1.
    #[serde(deserialize_with = "number")]
    pub raw_excess: f64,
    /// Gaps of free runs without effects.
    pub free: FreeRun,
    /// Every recording has one channel alone.
    pub one_sensor: bool,
    /// Nothing added.
    pub plain: RecordedSet,
    /// What the search chose.
    pub best: RecordedSet,
    /// Every set that was fitted.
    pub sets: Vec<RecordedSet>,
    /// How far the free runs of two sets are apart, as a gap: their places in `sets`, then the figure.
    pub apart: Vec<(usize, usize, f64)>,
    /// Leave-one-out over the recordings for fitting: which set was to be claimed (`null`: `best`), and what it misses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_out: Option<(Option<usize>, LeftOut)>,
}

/// A set that was fitted.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RecordedSet {
    /// Its causes.
    pub causes: Vec<RecordedCause>,
    /// Its unknowns.
    pub posterior: Vec<RecordedEstimate>,
    /// log of its evidence, up to a constant that all sets share.
    #[serde(deserialize_with = "number")]
    pub evidence: f64,
    /// Sum of squares over its readings, whitened.
    #[serde(deserialize_with = "number")]
    pub chi2: f64,
    /// How many readings there are.
    #[serde(deserialize_with = "number")]
    pub readings: f64,
    /// By octave what is left, and what a perfect model would leave.
    pub octaves: Vec<Octave>,
    /// Sum of squares over its priors.
    #[serde(deserialize_with = "number")]
    pub prior2: f64,
    /// What its unknowns cost: -1/2 log det(1 + Lambda^-1 F).
    #[serde(deserialize_with = "number")]
    pub occam: f64,
    /// Gap of its free run on held-out recordings, where it had one,
    pub gap: Option<f64>,
    /// and recording by recording what that leaves above the floor, as a power.
    pub by_recording: Option<Vec<f64>>,
}

/// A cause.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RecordedCause {
    /// Effect with its place (`sensor-delay:motorAngle`), a parameter, or an offset.
    pub kind: CauseKind,
    /// Effect id of the contract, or the parameter's name.
    pub id: String,
    /// Where it acts.
    pub component: String,
    /// Which joint or element, from 0.
    pub site: usize,
    /// The arm has it per joint.
    pub per_joint: bool,
    /// How often it comes.
    pub times: Times,
    /// It acts at a joint without a spring.
    pub rigid: bool,
    /// It makes a recorded signal late; where nothing is given, what the effect itself declares.
    #[serde(default)]
    pub shifted: Option<bool>,
}

/// What a cause is.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CauseKind {
    /// `id` or `id:place` of the library.
    Effect(String),
    /// By its index in the model without effects.
    Parameter(usize),
    /// By the index of the output.
    Offset(usize),
}

/// An unknown of a set.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RecordedEstimate {
    /// Name.
    pub name: String,
    /// Mean, in `unit`.
    #[serde(deserialize_with = "number")]
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Standard deviation of the coordinate that it was estimated in (a logarithm where it has a sign).
    #[serde(deserialize_with = "number")]
    pub deviation: f64,
}

/// What was decided again.
#[derive(Clone, Debug, Serialize)]
pub struct Redecided {
    /// The verdict.
    pub verdict: Verdict,
    /// What is claimed, without amplitudes.
    pub effects: Vec<Claimed>,
    /// Ranked.
    pub candidates: Vec<CandidateCause>,
    /// Sets that cannot be distinguished.
    pub indistinguishable: Vec<Vec<String>>,
    /// None of these.
    pub unknown: UnknownShare,
    /// Gap with what is claimed, as sets are compared by it.
    pub after: f64,
}

impl DecisionRecord {
    /// Of a search and the free runs of some of its sets.
    pub(super) fn new(
        plant: PlantKind,
        found: &SearchResult,
        raw_excess: f64,
        free: FreeRun,
        ran: &dyn FreeRunResults,
    ) -> Self {
        let set = |at: Option<usize>, f: &FittedSet| {
            let after = |at| (ran.after(at), ran.each(at));
            let (gap, by_recording) = at.map_or((None, None), after);
            RecordedSet { gap, by_recording, ..RecordedSet::of(f) }
        };
        let ran_freely: Vec<usize> = (0..found.sets.len()).filter(|at| ran.after(*at).is_some()).collect();
        let pairs = ran_freely.iter().flat_map(|a| ran_freely.iter().map(move |b| (*a, *b)));
        Self {
            schema: SCHEMA.into(),
            arm: plant == PlantKind::Arm,
            innovations: None,
            instead: None,
            not_compared: None,
            raw_excess,
            free,
            one_sensor: ran.one_sensor(),
            plain: set(None, &found.plain),
            best: set(None, &found.best),
            sets: found.sets.iter().enumerate().map(|(at, f)| set(Some(at), f)).collect(),
            apart: pairs.filter_map(|(a, b)| Some((a, b, ran.apart(a, b)?))).collect(),
            left_out: None,
        }
    }

    /// Reads one.
    ///
    /// # Errors
    /// It is none, or of another version of the schema.
    pub fn parse(text: &str) -> Result<Self, String> {
        let record: Self = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if record.schema == SCHEMA {
            return Ok(record);
        }
        Err(format!("its schema is {}, this program reads {SCHEMA}: run the diagnosis again", record.schema))
    }

    /// Decides again.
    ///
    /// # Errors
    /// An effect that the library has not, or a verdict that was not made from what is kept.
    pub fn decide(&self, limits: &Thresholds) -> Result<Redecided, String> {
        if self.innovations.is_some() {
            return Err("the innovations engine decided it, by evidences that these thresholds do not judge: run the diagnosis again".into());
        }
        let plant = if self.arm { PlantKind::Arm } else { PlantKind::Joint };
        let sets: Result<_, String> = self.sets.iter().map(|s| s.fitted(plant)).collect();
        let mut found =
            SearchResult { plain: self.plain.fitted(plant)?, best: self.best.fitted(plant)?, sets: sets? };
        let mut free = self.free;
        let decision = decide(&mut found, self.raw_excess, &mut free, self, limits);
        let of = |set: &FittedSet| SetEstimate::new(set, None);
        let present = decision.verdict == Verdict::Unknown;
        Ok(Redecided {
            verdict: decision.verdict,
            effects: effects(plant, &found, &of(&found.best), &of, &decision),
            candidates: candidates(plant, &found, &decision),
            indistinguishable: indistinguishable(&found, &decision),
            unknown: UnknownShare { present, probability: decision.unknown, place: None },
            after: free.after,
        })
    }
}

impl FreeRunResults for DecisionRecord {
    fn after(&self, set: usize) -> Option<f64> {
        self.sets[set].gap
    }
    fn apart(&self, a: usize, b: usize) -> Option<f64> {
        self.apart.iter().find(|p| (p.0, p.1) == (a, b)).map(|p| p.2)
    }
    fn one_sensor(&self) -> bool {
        self.one_sensor
    }
    fn each(&self, set: usize) -> Option<Vec<f64>> {
        self.sets[set].by_recording.clone()
    }
    fn left_out(&self, set: Option<usize>, _: &FittedSet) -> Option<LeftOut> {
        self.left_out.filter(|l| l.0 == set).map(|l| l.1)
    }
}

impl RecordedSet {
    fn of(f: &FittedSet) -> Self {
        let estimates = f.stated.unknowns.iter().zip(f.theta.iter().zip(f.deviations()));
        Self {
            causes: f.stated.set.iter().map(RecordedCause::of).collect(),
            posterior: estimates
                .map(|(u, (x, deviation))| RecordedEstimate {
                    name: u.name.clone(),
                    value: u.scale.value(*x).0,
                    unit: u.unit.clone(),
                    deviation,
                })
                .collect(),
            evidence: f.evidence(1.0),
            chi2: f.chi2,
            readings: f.count(),
            octaves: f.octaves.clone(),
            prior2: f.prior2,
            occam: f.occam,
            gap: None,
            by_recording: None,
        }
    }
    /// As far as a decision looks at it.
    fn fitted(&self, plant: PlantKind) -> Result<FittedSet, String> {
        let model = TwoMassJoint::new::<&str>(true, &[]).map_err(|e| e.to_string())?;
        let set: Result<Vec<_>, _> = self.causes.iter().map(|c| c.hypothesis(plant)).collect();
        Ok(FittedSet {
            stated: PosedSet::of_causes(set?, EngineModel::joint(model)),
            theta: Vec::new(),
            residuals: DVector::zeros(0),
            jacobian: DMatrix::zeros(0, 0),
            information: DMatrix::zeros(0, 0),
            // Where there are no octaves.
            readings: self.readings as usize,
            chi2: self.chi2,
            octaves: self.octaves.clone(),
            prior2: self.prior2,
            occam: self.occam,
            tightening: 1.0,
        })
    }
}

impl RecordedCause {
    fn of(h: &Hypothesis) -> Self {
        let kind = match h.claim {
            HypothesisClaim::Effect(choice) => CauseKind::Effect(choice.id()),
            HypothesisClaim::Parameter(index) => CauseKind::Parameter(index),
            HypothesisClaim::Offset(output) => CauseKind::Offset(output),
        };
        Self {
            kind,
            id: h.id.clone(),
            component: h.component.clone(),
            site: h.site,
            per_joint: h.per_joint,
            times: h.times,
            rigid: h.rigid,
            shifted: Some(h.shifted),
        }
    }
    fn hypothesis(&self, plant: PlantKind) -> Result<Hypothesis, String> {
        let claim = match &self.kind {
            CauseKind::Effect(id) => {
                HypothesisClaim::Effect(EffectChoice::parse(id, plant).map_err(|e| e.to_string())?)
            }
            CauseKind::Parameter(index) => HypothesisClaim::Parameter(*index),
            CauseKind::Offset(output) => HypothesisClaim::Offset(*output),
        };
        Ok(Hypothesis {
            claim,
            id: self.id.clone(),
            component: self.component.clone(),
            site: self.site,
            per_joint: self.per_joint,
            times: self.times,
            rigid: self.rigid,
            shifted: self.shifted.unwrap_or(matches!(claim, HypothesisClaim::Effect(c) if c.spec().shifts)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::made::{FreeRunGaps, fitted, found, free};

    /// Sets with what they leave, in floors, and the gap of their free run.
    type MadeSet<'a> = [(&'a str, f64, Option<f64>)];

    /// Verdict, claims with their probability, gap.
    type Decided = (Verdict, Vec<(String, f64)>, f64);

    fn decided_twice(sets: &MadeSet<'_>, chosen: Option<usize>, with: f64) -> [Decided; 2] {
        let fits = sets.iter().map(|s| fitted(s.0, s.1, 40.0)).collect();
        let mut found = found(fits, chosen, 40.0);
        let gaps = sets.iter().map(|s| s.2).collect();
        let left_out = Some(LeftOut { tuned: 5.0, with, noise: 1.0 });
        let ran = FreeRunGaps { gaps, apart: Some(0.3), left_out, ..FreeRunGaps::default() };
        let (raw, mut free) = (found.plain.excess(), free(10.0));
        let mut record = DecisionRecord::new(PlantKind::Joint, &found, raw, free, &ran);
        let first = decide(&mut found, raw, &mut free, &ran, &Thresholds::default());
        record.left_out = first.left_out;
        let text = serde_json::to_string(&record).unwrap();
        let again = DecisionRecord::parse(&text).unwrap().decide(&Thresholds::default()).unwrap();
        let of = |set: &FittedSet| SetEstimate::new(set, None);
        let claims = |list: Vec<Claimed>| list.into_iter().map(|c| (c.id, c.probability)).collect();
        [
            (
                first.verdict,
                claims(effects(PlantKind::Joint, &found, &of(&found.best), &of, &first)),
                free.after,
            ),
            (again.verdict, claims(again.effects), again.after),
        ]
    }

    #[test]
    fn what_is_decided_again_is_the_same_to_the_bit() {
        let cases: [(Verdict, &MadeSet<'_>, Option<usize>); 4] = [
            (Verdict::Effects, &[("backlash", 1.0, Some(1.1)), ("motorInertia", 60.0, None)], Some(0)),
            (
                Verdict::Ambiguous,
                &[("backlash", 1.0, Some(1.1)), ("cable-stiffness", 1.05, Some(1.12))],
                Some(0),
            ),
            (Verdict::Unknown, &[("sensor-delay:motorAngle", 60.0, Some(9.0))], Some(0)),
            (
                Verdict::Effects,
                &[("backlash gravity-torque", 1.0, Some(1.1)), ("backlash", 50.0, Some(6.0))],
                Some(0),
            ),
        ];
        for (expected, sets, chosen) in cases {
            let [first, again] = decided_twice(sets, chosen, 1.1);
            assert_eq!(first.0, expected, "{sets:?}");
            assert_eq!(first, again, "{sets:?}");
        }
        // Worse where a recording was left out.
        let [first, again] = decided_twice(cases[0].1, cases[0].2, 5.5);
        assert_eq!(first.0, Verdict::Unknown);
        assert_eq!(first, again);
    }

    #[test]
    fn what_is_not_finite_or_of_another_schema_is_read_as_such() {
        let found = found(vec![fitted("backlash", f64::INFINITY, 40.0)], Some(0), 40.0);
        let ran = FreeRunGaps { gaps: vec![None], ..FreeRunGaps::default() };
        let record = DecisionRecord::new(PlantKind::Joint, &found, 1.0, free(10.0), &ran);
        let text = serde_json::to_string(&record).unwrap();
        assert!(DecisionRecord::parse(&text).unwrap().sets[0].chi2.is_nan());
        let old = text.replace("trueup.decision/1", "trueup.decision/0");
        assert!(DecisionRecord::parse(&old).unwrap_err().contains("run the diagnosis again"));
    }
}
