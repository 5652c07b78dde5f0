//! The result of a diagnosis: `diagnosis.json`, schema `trueup.diagnosis/1`.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;
use trueup_identification::packed::PackedModel;
use trueup_signals::Finding;

mod figures;
pub use figures::*;

/// What the gap is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Nothing beyond the sensors' noise.
    NoGap,
    /// Refitting what the model already has is enough.
    Parameters,
    /// The listed effects.
    Effects,
    /// The data do not distinguish the members of a set.
    Ambiguous,
    /// A real effect is there that no candidate explains.
    Unknown,
}

impl From<EvidenceVerdict> for Verdict {
    fn from(of: EvidenceVerdict) -> Self {
        match of {
            EvidenceVerdict::NoGap => Self::NoGap,
            EvidenceVerdict::Parameters => Self::Parameters,
            EvidenceVerdict::Effects => Self::Effects,
            EvidenceVerdict::Ambiguous => Self::Ambiguous,
            EvidenceVerdict::Unknown => Self::Unknown,
        }
    }
}

/// Gaps: RMS(simulated - measured) / RMS(measured - its mean) over held-out recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeldOutGap {
    /// Nominal parameters.
    pub before: f64,
    /// Own parameters refitted, nothing added.
    pub tuned: f64,
    /// With the effects.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
    /// (before - after) / (before - floor).
    pub closed: Option<f64>,
    /// 95 % interval of `closed`.
    pub ci95: Option<[f64; 2]>,
    /// The same where the run begins again every few periods of the slowest mode; `null` where recordings hold no two
    /// such windows or the model cannot be simulated in them.
    #[serde(default)]
    pub window: Option<WindowGap>,
    /// The same in the channel's unit; of a channel alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms: Option<ChannelRms>,
}

/// A [`HeldOutGap`] of runs that begin again in every window, from first states that are estimated there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WindowGap {
    /// Length of a window, s.
    pub seconds: f64,
    /// Nominal parameters.
    pub before: f64,
    /// Own parameters refitted, nothing added.
    pub tuned: f64,
    /// With the effects.
    pub after: f64,
    /// What noise alone leaves.
    pub floor: f64,
    /// (before - after) / (before - floor); `null` where before <= floor.
    pub closed: Option<f64>,
}

/// Overall and by channel.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GapReport {
    /// Root mean square over the channels.
    pub overall: Option<HeldOutGap>,
    /// By channel.
    pub channels: BTreeMap<String, HeldOutGap>,
    /// The same of what the sensors show together, by name: the twist of a transmission. Not part of `overall`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub derived: BTreeMap<String, HeldOutGap>,
    /// Channels without variation, left out.
    #[serde(default)]
    pub left_out: Vec<String>,
}

/// A component's share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ComponentShare {
    /// As in the list of effects.
    pub id: String,
    /// Share of the excess over the floor.
    pub share: f64,
    /// Which joint, from 1 (arms).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<usize>,
}
/// A channel's share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChannelShare {
    /// FMU variable.
    pub name: String,
    /// Share of the excess.
    pub share: f64,
}
/// A stretch of time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntervalShare {
    /// Recording.
    pub recording: String,
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// Share of the excess.
    pub share: f64,
}
/// An operating regime.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegimeShare {
    /// Variable.
    pub variable: String,
    /// From; open: `null`.
    pub low: Option<f64>,
    /// To; open: `null`.
    pub high: Option<f64>,
    /// Unit of both; empty where it is not known.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub unit: String,
    /// Share of the excess.
    pub share: f64,
}
/// A band of frequencies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BandShare {
    /// Hz.
    pub low_hz: f64,
    /// Hz.
    pub high_hz: f64,
    /// Share of the excess.
    pub share: f64,
}

/// Where the gap is.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GapLocation {
    /// By component.
    pub components: Vec<ComponentShare>,
    /// By channel.
    pub channels: Vec<ChannelShare>,
    /// By time.
    pub intervals: Vec<IntervalShare>,
    /// By regime.
    pub regimes: Vec<RegimeShare>,
    /// By frequency.
    pub bands: Vec<BandShare>,
    /// Of a free-floating arm: `internal` while its momentum stays, `external` where it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

/// What the sensors distinguish by the structure of the equations alone.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SensorFindings {
    /// Components that show; those of one set are distinguished only by the form of an effect.
    pub classes: Vec<Vec<String>>,
    /// Components whose faults no balance of measured quantities shows.
    pub hidden: Vec<String>,
}

/// A value with its interval.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ClaimedAmount {
    /// Value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// 95 % interval; an open end is `null`.
    pub ci95: [Option<f64>; 2],
    /// Why it has no interval: [`AT_BOUND`] or [`NOT_DETERMINED`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The user's value; none of what the nominal model does not have.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<f64>,
    /// Standard deviation of the user's value, in the unit; none where it is assumed known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_deviation: Option<f64>,
    /// The value on both sides of the gear; none where there is no gear or the value has no other side.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sides: Option<GearSides>,
}

/// An estimate at a limit of the search.
pub const AT_BOUND: &str = "at the bound of the search";
/// An estimate that the recordings say nothing of.
pub const NOT_DETERMINED: &str = "not determined by these recordings";

impl ClaimedAmount {
    /// A value with the interval `ci95` that an estimate has within the bounds of its search. An end on a bound is open, for
    /// there the search ends, not the uncertainty; an interval without width is none.
    pub fn within([lower, upper]: [f64; 2], value: f64, unit: String, ci95: [f64; 2]) -> Self {
        let on = |x: f64, bound: f64| {
            bound.is_finite() && (x - bound).abs() <= 1e-6 * bound.abs().max(f64::MIN_POSITIVE)
        };
        let open = |x: f64| !x.is_finite() || x <= lower || x >= upper || on(x, lower) || on(x, upper);
        let [low, high] = ci95;
        let reason = if on(value, lower) || on(value, upper) || value < lower || value > upper {
            Some(AT_BOUND)
        } else if open(low) && open(high) || high - low <= 1e-12 * value.abs() {
            Some(NOT_DETERMINED)
        } else {
            None
        };
        let end = |x: f64| (reason.is_none() && !open(x)).then_some(x);
        let ci95 = [end(low), end(high)];
        Self { value, unit, ci95, reason: reason.map(Into::into), ..Self::default() }
    }

    /// Whether it was refitted without an interval, within the bounds of the search, and moved by less than half a standard deviation, or by
    /// 1 % where there is none: a list need not name it.
    pub fn hardly_moved(&self) -> bool {
        let free = self.reason.as_deref().is_some_and(|reason| reason != AT_BOUND);
        self.nominal.filter(|_| free).is_some_and(|nominal| {
            let by = self.nominal_deviation.map_or(0.01 * nominal.abs(), |d| 0.5 * d);
            (self.value - nominal).abs() < by
        })
    }
}

/// A claimed effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claimed {
    /// Effect id.
    pub id: String,
    /// Where it acts.
    pub component: String,
    /// Which joint, from 1; of the joint model 1.
    pub joint: Option<usize>,
    /// That it is there.
    pub probability: f64,
    /// Its parameters.
    pub parameters: BTreeMap<String, ClaimedAmount>,
    /// How much of the held-out gap it closes by itself; of one of several, of the equation error.
    pub closed_alone: Option<f64>,
}

/// A candidate, whether claimed or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CandidateCause {
    /// Effect id.
    pub id: String,
    /// Where it would act.
    pub component: String,
    /// Which joint, from 1; none where it would act at no joint.
    pub joint: Option<usize>,
    /// That it is there.
    pub probability: f64,
    /// log of the evidence over that of nothing added.
    pub evidence: f64,
    /// Held-out gap of the claim that has it; `null` of all others.
    pub holdout_gap: Option<f64>,
}

impl CandidateCause {
    /// The same effect at the same place.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.id == other.id && self.component == other.component && self.joint == other.joint
    }
}

/// None of these.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct UnknownShare {
    /// Something is there that no candidate explains.
    pub present: bool,
    /// How surely.
    pub probability: f64,
    /// The component in which most of it shows, where one dominates.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<String>,
}

/// The experiment that would distinguish them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NextExperiment {
    /// In words.
    pub why: String,
    /// What it distinguishes.
    pub separates: Vec<String>,
    /// Recording of its inputs.
    pub input: String,
    /// Predicted probability that it will.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
}

/// How bad a finding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OutcomeSeverity {
    /// Good to know.
    Note,
    /// Figures may be wrong.
    Warning,
    /// It caps the verdict at `unknown`.
    Grave,
}

impl From<trueup_signals::Severity> for OutcomeSeverity {
    fn from(severity: trueup_signals::Severity) -> Self {
        match severity {
            trueup_signals::Severity::Note => Self::Note,
            trueup_signals::Severity::Warning => Self::Warning,
            trueup_signals::Severity::Grave | trueup_signals::Severity::Error => Self::Grave,
        }
    }
}

/// Something that was noticed of a recording, the case or the figures.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct NoticedMistake {
    /// How bad.
    pub severity: OutcomeSeverity,
    /// What kind, by a name that stays.
    pub kind: String,
    /// File, as the case names it.
    pub file: String,
    /// Its line, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u64>,
    /// Channel or column.
    pub channel: Option<String>,
    /// What, and what to do.
    pub text: String,
}

impl NoticedMistake {
    /// Findings of a case in this folder, the worst first.
    pub fn of(findings: &[Finding], folder: &Path) -> Vec<Self> {
        let mut all: Vec<&Finding> = findings.iter().collect();
        all.sort_by_key(|f| Reverse(f.severity));
        let one = |f: &Finding| {
            let at = f.time.map_or(String::new(), |t| format!("at {t} s: "));
            let mend = if f.mend.is_empty() { String::new() } else { format!("; {}", f.mend) };
            Self {
                severity: f.severity.into(),
                kind: f.kind.id(),
                file: f.file.strip_prefix(folder).unwrap_or(&f.file).display().to_string(),
                line: f.line,
                channel: f.channel.clone(),
                text: format!("{at}{}{mend}", f.what),
            }
        };
        all.into_iter().map(one).collect()
    }
}

/// What was read, so that a diagnosis can be tied to its data.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DiagnosisInputs {
    /// SHA-256 of the list of files below, one a line: hash, two blanks, name (what `sha256sum` prints).
    pub sha256: String,
    /// By name in the case's folder: SHA-256 of the file.
    pub files: BTreeMap<String, String>,
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    /// `trueup.diagnosis/1`.
    pub schema: String,
    /// Model.
    pub model: String,
    /// What the gap is.
    pub verdict: Verdict,
    /// How large.
    pub gap: GapReport,
    /// What these sensors can distinguish at all.
    #[serde(default)]
    pub sensors: SensorFindings,
    /// Where.
    #[serde(rename = "where")]
    pub location: GapLocation,
    /// What is claimed, most probable first.
    pub effects: Vec<Claimed>,
    /// Ranked.
    pub candidates: Vec<CandidateCause>,
    /// The plant's own, refitted.
    pub parameters: BTreeMap<String, ClaimedAmount>,
    /// Correlation of the estimates of parameters and effects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<EstimateCorrelation>,
    /// Parts of the square of the overall gap before, by what the reported model misses without each; empty without a gap.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub budget: Vec<ErrorPart>,
    /// The reported model, as `trueup fmu pack --from diagnosis.json` packs it; none where nothing was concluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<PackedModel>,
    /// Sets that these recordings do not distinguish.
    pub indistinguishable: Vec<Vec<String>>,
    /// None of these.
    pub unknown: UnknownShare,
    /// When recordings held out part from the model; requested by `--watch`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watch: Option<Vec<Departure>>,
    /// What to do next.
    pub next_experiment: Option<NextExperiment>,
    /// Files of the augmented model.
    pub augmented: Option<Vec<String>>,
    /// The verdict is `unknown` because of a grave finding, whatever the evidence for another one.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub capped: bool,
    /// Why no causes were compared, so that the verdict is `unknown`; `None`: they were, or a grave finding is in the way.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub not_compared: Option<String>,
    /// What was noticed, the worst first.
    #[serde(default)]
    pub findings: Vec<NoticedMistake>,
    /// What was read.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inputs: Option<DiagnosisInputs>,
    /// Additional remarks.
    #[serde(default)]
    pub notes: Vec<String>,
}

/// A stretch of time in which a recording parts from the model by more than any recording for fitting does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Departure {
    /// Which recording.
    pub recording: String,
    /// Where it shows.
    pub component: String,
    /// At which joint of an arm, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint: Option<usize>,
    /// s.
    pub start: f64,
    /// s.
    pub end: f64,
    /// How much of an input would do the same, on the mean.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub like: Option<SimilarCause>,
}

/// So much more of an input.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SimilarCause {
    /// FMU variable.
    pub input: String,
    /// How much more.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

/// The note of a case without a hold-out.
pub const NO_HOLDOUT: &str = "the case has no hold-out: the figures are of the recordings for fitting";

/// The schema's name.
pub const SCHEMA: &str = "trueup.diagnosis/1";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_interval_ends_on_a_bound_or_has_no_width() {
        let interval = |value, ci95| {
            let a = ClaimedAmount::within([0.0, 10.0], value, "N.m".into(), ci95);
            (a.ci95, a.reason)
        };
        assert_eq!(interval(3.0, [2.0, 4.0]), ([Some(2.0), Some(4.0)], None));
        assert_eq!(interval(3.0, [0.0, 4.0]), ([None, Some(4.0)], None));
        assert_eq!(interval(3.0, [2.0, f64::INFINITY]), ([Some(2.0), None], None));
        assert_eq!(interval(10.0, [9.0, 10.0]), ([None, None], Some(AT_BOUND.into())));
        assert_eq!(interval(0.0, [0.0, 0.0]), ([None, None], Some(AT_BOUND.into())));
        assert_eq!(interval(3.0, [3.0, 3.0]), ([None, None], Some(NOT_DETERMINED.into())));
        assert_eq!(interval(3.0, [0.0, 10.0]), ([None, None], Some(NOT_DETERMINED.into())));
        // A search without bounds ends nowhere.
        let free = ClaimedAmount::within([f64::NEG_INFINITY, f64::INFINITY], 3.0, "N.m".into(), [2.0, 4.0]);
        assert_eq!((free.ci95, free.reason), ([Some(2.0), Some(4.0)], None));
        assert_eq!(interval(3.0, [f64::NAN, f64::NAN]), ([None, None], Some(NOT_DETERMINED.into())));
    }
}
