//! Opens the keys and counts.

use super::said;
use super::scored::Scored;
use super::table::Answers;
use crate::case::{TrialPlant, TrialSplit, TruthKey};
use crate::error::TrialError;
use crate::files;

/// A share with its 95 % Wilson interval.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// How many.
    pub hits: usize,
    /// Of how many.
    pub of: usize,
}

impl Share {
    /// Among these.
    fn of(list: impl Iterator<Item = bool>) -> Self {
        list.fold(Self::default(), |s, hit| Self { hits: s.hits + usize::from(hit), of: s.of + 1 })
    }
    /// Point estimate; nothing without cases.
    pub fn rate(self) -> Option<f64> {
        (self.of > 0).then(|| self.hits as f64 / self.of as f64)
    }
    /// Wilson (1927), eq. for z = 1.96.
    pub fn interval(self) -> Option<[f64; 2]> {
        let (n, p, z) = (self.of as f64, self.rate()?, 1.959_963_984_540_054);
        let middle = (p + z * z / (2.0 * n)) / (1.0 + z * z / n);
        let half = z / (1.0 + z * z / n) * (p * (1.0 - p) / n + z * z / (4.0 * n * n)).sqrt();
        Some([(middle - half).max(0.0), (middle + half).min(1.0)])
    }
}

/// Which way a figure should go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ScoreTarget {
    /// At least; both marks.
    Least(f64, f64),
    /// At most; both marks.
    Most(f64, f64),
    /// Within.
    Within(f64, f64),
    /// Only reported.
    Told,
}

impl ScoreTarget {
    /// Below the first mark the work is not done.
    pub fn met(self, value: f64) -> Option<bool> {
        match self {
            Self::Least(first, _) => Some(value >= first),
            Self::Most(first, _) => Some(value <= first),
            Self::Within(low, high) => Some(value >= low && value <= high),
            Self::Told => None,
        }
    }
}

/// A line of the scorecard.
#[derive(Clone, Debug, PartialEq)]
pub struct ScorecardLine {
    /// What is counted.
    pub what: &'static str,
    /// As a share of cases.
    pub share: Option<Share>,
    /// The figure.
    pub value: Option<f64>,
    /// What it should be.
    pub aim: ScoreTarget,
}

/// The scorecard of one plant.
#[derive(Clone, Debug)]
pub struct Card {
    /// The plant.
    pub plant: TrialPlant,
    /// Cases per split, and how many of them have a result.
    pub counts: Vec<(TrialSplit, usize, usize)>,
    /// All lines.
    pub lines: Vec<ScorecardLine>,
    /// Truth, what was reported instead or as well, how often.
    pub confusion: Vec<(String, String, usize)>,
    /// Per effect: cases, named first by class.
    pub by_effect: Vec<(String, Share)>,
    /// Wall times in s, sorted.
    pub seconds: Vec<f64>,
}

fn median(mut list: Vec<f64>) -> Option<f64> {
    list.sort_by(f64::total_cmp);
    let n = list.len();
    (n > 0).then(|| 0.5 * (list[(n - 1) / 2] + list[n / 2]))
}

/// Expected calibration error over ten bins of (probability, true).
pub(crate) fn calibration(claims: &[(f64, bool)]) -> Option<f64> {
    if claims.is_empty() {
        return None;
    }
    let mut bins = [(0.0, 0.0, 0usize); 10];
    for (p, hit) in claims {
        let b = &mut bins[((p * 10.0) as usize).min(9)];
        *b = (b.0 + p, b.1 + f64::from(u8::from(*hit)), b.2 + 1);
    }
    Some(bins.iter().map(|(p, hits, _)| (p - hits).abs()).sum::<f64>() / claims.len() as f64)
}

/// Opens the keys of the cases that have a result, and counts, per plant.
///
/// # Errors
/// A key that is not the sealed one, a file that cannot be read.
pub fn score(answers: &Answers) -> Result<Vec<Card>, TrialError> {
    let (mut all, mut waiting) = (Vec::new(), Vec::new());
    for name in files::cases(&answers.trials)? {
        let (key, _) = files::open(&answers.trials, &name)?;
        match said::read(&answers.results, &name)? {
            Some(said) => all.push(Scored { key, said }),
            None => waiting.push(key),
        }
    }
    let mut cards = Vec::new();
    for plant in TrialPlant::ALL {
        let (mine, rest): (Vec<_>, Vec<_>) = all.into_iter().partition(|s| s.key.plant == plant);
        all = rest;
        if !mine.is_empty() {
            cards.push(card(plant, &mine, &waiting));
        }
    }
    Ok(cards)
}

fn card(plant: TrialPlant, all: &[Scored], waiting: &[TruthKey]) -> Card {
    let of = |split: TrialSplit| all.iter().filter(move |s| s.key.split == split);
    let clear = || of(TrialSplit::Single).filter(|s| s.key.ratio >= 3.0);
    let share =
        |what, share: Share, aim| ScorecardLine { what, share: Some(share), value: share.rate(), aim };
    let figure = |what, value, aim| ScorecardLine { what, share: None, value, aim };

    let sizes: Vec<f64> = clear().filter_map(|s| s.first().map(|id| s.said.class(id).len() as f64)).collect();
    let separated = of(TrialSplit::Parameters)
        .map(|s| s.said.verdict == "parameters")
        .chain(clear().map(Scored::gap_seen));
    let (mut covered, mut claims) = (Vec::new(), Vec::new());
    for s in all {
        for e in &s.said.effects {
            let there = s.key.effects.contains(&e.id);
            if s.said.verdict == "effects" {
                claims.extend(e.probability.map(|p| (p, there)));
            }
            let Some(truths) = s.key.amplitudes.get(&e.id).filter(|_| there && s.said.verdict == "effects")
            else {
                continue;
            };
            for (name, value) in truths {
                let found = e.parameters.iter().find(|(n, _)| n.split('[').next() == Some(name));
                if let Some([low, high]) = found.and_then(|(_, a)| a.ci95) {
                    covered.push(low.is_none_or(|l| l <= *value) && high.is_none_or(|h| h >= *value));
                }
            }
        }
    }
    let ranked = |s: &Scored| s.said.ranked().iter().take(3).any(|id| *id == s.truth());
    let in_library = || {
        all.iter()
            .filter(|s| matches!(s.key.split, TrialSplit::Single | TrialSplit::Pairs) && s.key.ratio >= 3.0)
    };
    let lines = vec![
        share(
            "effect named first, by class of at most 3",
            Share::of(clear().map(Scored::by_class)),
            ScoreTarget::Least(0.90, 0.97),
        ),
        figure(
            "- mean size of that class",
            (!sizes.is_empty()).then(|| sizes.iter().sum::<f64>() / sizes.len() as f64),
            ScoreTarget::Told,
        ),
        share("- by its exact id", Share::of(clear().map(Scored::exact)), ScoreTarget::Told),
        share(
            "first, or in an ambiguous set of at most 3",
            Share::of(clear().map(|s| s.by_class() || s.ambiguous_with_truth(3))),
            ScoreTarget::Least(0.93, 0.98),
        ),
        share(
            "among the first three candidates",
            Share::of(clear().map(ranked)),
            ScoreTarget::Least(0.97, 0.995),
        ),
        share(
            "ambiguous though it can be distinguished",
            Share::of(clear().map(|s| s.said.verdict == "ambiguous")),
            ScoreTarget::Most(0.10, 0.10),
        ),
        share("gap detected", Share::of(clear().map(Scored::gap_seen)), ScoreTarget::Least(0.97, 0.995)),
        share(
            "false alarm where there is no gap",
            Share::of(of(TrialSplit::None).map(|s| s.said.verdict != "no-gap")),
            ScoreTarget::Most(0.02, 0.005),
        ),
        share("parameters against effects", Share::of(separated), ScoreTarget::Least(0.95, 0.99)),
        share(
            "two effects: both found",
            Share::of(of(TrialSplit::Pairs).map(Scored::both)),
            ScoreTarget::Least(0.80, 0.95),
        ),
        share(
            "two effects: exactly these two",
            Share::of(of(TrialSplit::Pairs).map(Scored::right)),
            ScoreTarget::Least(0.65, 0.85),
        ),
        share(
            "outside the library: unknown",
            Share::of(of(TrialSplit::Outside).map(Scored::right)),
            ScoreTarget::Least(0.85, 0.95),
        ),
        share(
            "inside the library, but called unknown",
            Share::of(in_library().map(|s| s.said.verdict == "unknown")),
            ScoreTarget::Most(0.05, 0.05),
        ),
        share(
            "not identifiable: ambiguous, the truth in the set",
            Share::of(of(TrialSplit::Unidentifiable).map(Scored::right)),
            ScoreTarget::Least(0.95, 0.98),
        ),
        share(
            "component (and joint) of single effects",
            Share::of(clear().map(Scored::located)),
            ScoreTarget::Told,
        ),
        share(
            "95 % intervals of amplitudes that cover",
            Share::of(covered.into_iter()),
            ScoreTarget::Within(0.90, 0.98),
        ),
        figure("expected calibration error", calibration(&claims), ScoreTarget::Most(0.05, 0.03)),
        figure(
            "median share of the gap that is closed, single effects",
            median(clear().filter_map(|s| s.said.gap.overall.as_ref()?.closed).collect()),
            ScoreTarget::Least(0.85, 0.95),
        ),
        share(
            "rig: what is off by its name, an effect first or ambiguous",
            Share::of(of(TrialSplit::Rig).map(Scored::right)),
            ScoreTarget::Least(0.85, 0.85),
        ),
        share(
            "rig: `parameters` though none is off",
            Share::of(
                of(TrialSplit::Rig)
                    .filter(|s| s.key.moved.is_empty())
                    .map(|s| s.said.verdict == "parameters"),
            ),
            ScoreTarget::Most(0.0, 0.0),
        ),
        share(
            "diagnoses that failed",
            Share::of(all.iter().map(|s| s.said.failed)),
            ScoreTarget::Most(0.0, 0.0),
        ),
    ];
    let mut confusion: Vec<(String, String, usize)> = Vec::new();
    let mut by_effect: Vec<(String, Share)> = Vec::new();
    for s in all.iter().filter(|s| s.key.split != TrialSplit::Pairs) {
        let truth = match s.key.split {
            TrialSplit::Single => s.truth().to_owned(),
            TrialSplit::Rig => format!("({}) {}", s.key.split.name(), s.key.told()),
            TrialSplit::Outside | TrialSplit::Unidentifiable => {
                format!("({}) {}", s.key.split.name(), s.truth())
            }
            other => format!("({})", other.name()),
        };
        let told = s.first().map_or_else(|| format!("({})", s.said.verdict), str::to_owned);
        match confusion.iter_mut().find(|(a, b, _)| *a == truth && *b == told) {
            Some((_, _, n)) => *n += 1,
            None => confusion.push((truth, told, 1)),
        }
    }
    for s in clear() {
        let at = match by_effect.iter().position(|(id, _)| id == s.truth()) {
            Some(at) => at,
            None => {
                by_effect.push((s.truth().to_owned(), Share::default()));
                by_effect.len() - 1
            }
        };
        by_effect[at].1.of += 1;
        by_effect[at].1.hits += usize::from(s.by_class());
    }
    confusion.sort();
    by_effect.sort_by(|a, b| a.0.cmp(&b.0));
    let mut seconds: Vec<f64> = all.iter().map(|s| s.said.took.seconds).filter(|s| *s > 0.0).collect();
    seconds.sort_by(f64::total_cmp);
    let counts = TrialSplit::ALL
        .into_iter()
        .map(|split| {
            let done = of(split).count();
            (split, done + waiting.iter().filter(|k| k.plant == plant && k.split == split).count(), done)
        })
        .collect();
    Card { plant, counts, lines, confusion, by_effect, seconds }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A rig's case with this key and that result.
    fn right(key: &str, said: &str) -> bool {
        let head = "case = 'a'\nplant = 'joint'\nsplit = 'rig'\nratio = 5.0\nseed = 1\nindex = 0\ncomponents = ['load']\n";
        let key = toml::from_str(&format!("{head}{key}")).unwrap();
        Scored { key, said: serde_json::from_str(said).unwrap() }.right()
    }

    #[test]
    fn what_is_off_on_a_rig_counts_by_its_name_and_value() {
        let key =
            "verdict = 'parameters'\neffects = []\n[moved]\n'motorCurrent.gain' = { from = 1.0, to = 1.2 }\n";
        let told = |verdict: &str, name: &str, value: f64, low: f64, high: f64| {
            let said = format!(
                r#"{{"verdict": "{verdict}", "parameters": {{"{name}": {{"value": {value}, "ci95": [{low}, {high}]}}}}}}"#
            );
            right(key, &said)
        };
        let gain = "motorCurrent.gain";
        assert!(told("parameters", gain, 1.17, 1.1, 1.25));
        // Within 10 %, though not within its interval.
        assert!(told("parameters", gain, 1.14, 1.13, 1.15));
        // Nearer to the nominal value, whatever its interval.
        assert!(!told("parameters", gain, 1.09, 0.9, 1.3));
        assert!(!told("parameters", "loadInertia", 1.2, 1.1, 1.3));
        assert!(!told("effects", gain, 1.2, 1.1, 1.3));
    }

    #[test]
    fn an_effect_of_a_rig_is_first_or_among_few() {
        let hand = "verdict = 'effects'\neffects = ['external-force']\n";
        let said = |verdict: &str, ids: &[&str]| {
            let ids: Vec<String> = ids.iter().map(|id| format!(r#"{{"id": "{id}"}}"#)).collect();
            format!(r#"{{"verdict": "{verdict}", "effects": [{}]}}"#, ids.join(", "))
        };
        assert!(right(hand, &said("effects", &["external-force"])));
        assert!(right(hand, &said("ambiguous", &["gravity-torque", "external-force"])));
        assert!(!right(hand, &said("effects", &["gravity-torque", "external-force"])));
        assert!(!right(hand, &said("parameters", &[])));
        assert!(!right(hand, &said("unknown", &[])));
        let drift = "verdict = 'effects'\neffects = ['friction-drift']\n";
        assert!(right(drift, &said("effects", &["friction-drift"])) && !right(drift, &said("unknown", &[])));
        assert!(!right(drift, &said("parameters", &[])));
        let nothing = "verdict = 'no-gap'\neffects = []\n";
        assert!(right(nothing, &said("no-gap", &[])) && !right(nothing, &said("parameters", &[])));
    }
}
