//! An entry of the benchmark: one CSV, a row an item.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::{BenchNotice, BenchTier};
use crate::error::TrialError;
use crate::files;
use crate::judge::said::AnsweredClaim;

/// Columns of an entry, in any order.
pub(crate) const COLUMNS: [&str; 9] =
    ["case", "item", "name", "place", "recording", "time", "value", "low", "high"];
const VERDICTS: [&str; 5] = ["no-gap", "parameters", "effects", "ambiguous", "unknown"];
/// Rounding of probabilities that were written with few digits.
const ROUNDED: f64 = 1e-3;

/// A row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SubmissionRow {
    pub(crate) case: String,
    pub(crate) item: String,
    pub(crate) name: String,
    pub(crate) place: String,
    pub(crate) recording: String,
    pub(crate) time: Option<f64>,
    pub(crate) value: Option<f64>,
    pub(crate) low: Option<f64>,
    pub(crate) high: Option<f64>,
}

/// A value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct EnteredValue {
    pub(crate) interval: Option<[f64; 2]>,
}

/// What an entry has of one case.
#[derive(Clone, Debug, Default)]
pub(crate) struct CaseEntry {
    pub(crate) verdict: String,
    /// Probabilities of answers; pairs as `a+b`, sorted.
    pub(crate) answers: BTreeMap<String, f64>,
    pub(crate) effects: Vec<AnsweredClaim>,
    pub(crate) parameters: BTreeMap<String, EnteredValue>,
    /// Predictions by recording and reading, by time in 1e-5 s.
    pub(crate) outputs: BTreeMap<(String, String), BTreeMap<i64, f64>>,
    pub(crate) processor_seconds: Option<f64>,
}

/// A whole entry, checked against the benchmark that it is for.
#[derive(Clone, Debug)]
pub struct BenchEntry {
    pub(crate) cases: BTreeMap<String, CaseEntry>,
    /// SHA-256 of its file.
    pub hash: String,
}

/// The public part of a benchmark.
pub(crate) struct PublicBench {
    pub(crate) notice: BenchNotice,
    pub(crate) tiers: BTreeMap<String, BenchTier>,
    /// Times that are requested, by case and recording, in 1e-5 s.
    pub(crate) requested: BTreeMap<(String, String), BTreeSet<i64>>,
}

/// A time as the files have it, in 1e-5 s.
pub(crate) fn ticks(time: f64) -> i64 {
    (time * 1e5).round() as i64
}

/// The name of an answer: pairs in alphabetical order.
pub(crate) fn answer_name(ids: &[&str]) -> String {
    let mut sorted = ids.to_vec();
    sorted.sort_unstable();
    sorted.join("+")
}

impl PublicBench {
    pub(crate) fn read(public: &Path) -> Result<Self, TrialError> {
        let notice = BenchNotice::read(public)?;
        let (cases, times) = (public.join("cases.csv"), public.join("requested.csv"));
        let mut tiers = BTreeMap::new();
        for row in rows::<(String, BenchTier)>(&cases)? {
            tiers.insert(row.0, row.1);
        }
        let mut requested: BTreeMap<_, BTreeSet<i64>> = BTreeMap::new();
        for (case, recording, time) in rows::<(String, String, f64)>(&times)? {
            requested.entry((case, recording)).or_default().insert(ticks(time));
        }
        Ok(Self { notice, tiers, requested })
    }
}

fn rows<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<Vec<T>, TrialError> {
    let mut reader = csv::Reader::from_path(path).map_err(|e| TrialError::at(path, e))?;
    reader.deserialize().collect::<Result<_, _>>().map_err(|e| TrialError::at(path, e))
}

impl BenchEntry {
    /// Reads an entry for the benchmark whose public part is `public`.
    ///
    /// # Errors
    /// What is wrong, with file and line: an item that there is not, a case twice or of another benchmark, probabilities that do
    /// not add up, outputs at times that were not requested; a case without a verdict.
    pub fn read(public: &Path, file: &Path) -> Result<Self, TrialError> {
        Self::of(&PublicBench::read(public)?, file)
    }

    pub(crate) fn of(bench: &PublicBench, file: &Path) -> Result<Self, TrialError> {
        let text = files::text(file)?;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().map_err(|e| TrialError::at(file, e))?.clone();
        if let Some(missing) = COLUMNS.iter().find(|c| !header.iter().any(|h| h == **c)) {
            let why =
                format!("line 1: there is no column `{missing}`; the columns are {}", COLUMNS.join(","));
            return Err(TrialError::at(file, why));
        }
        if let Some(more) = header.iter().find(|h| !COLUMNS.contains(h)) {
            let why = format!("line 1: column `{more}` is none of {}", COLUMNS.join(","));
            return Err(TrialError::at(file, why));
        }
        let mut cases: BTreeMap<String, CaseEntry> = BTreeMap::new();
        let mut record = csv::StringRecord::new();
        loop {
            let line = reader.position().line();
            let at = |why: String| TrialError::at(file, format!("line {line}: {why}"));
            if !reader.read_record(&mut record).map_err(|e| TrialError::at(file, e))? {
                break;
            }
            let row: SubmissionRow = record.deserialize(Some(&header)).map_err(|e| at(e.to_string()))?;
            if !bench.tiers.contains_key(&row.case) {
                return Err(at(format!(
                    "case `{}` is not in this benchmark; cases.csv lists its cases",
                    row.case
                )));
            }
            cases.entry(row.case.clone()).or_default().take(&row, bench).map_err(at)?;
        }
        for (name, case) in &mut cases {
            case.complete(name, bench).map_err(|why| TrialError::at(file, format!("case {name}: {why}")))?;
        }
        let without: Vec<&str> =
            bench.tiers.keys().filter(|c| !cases.contains_key(*c)).map(String::as_str).collect();
        if let Some(first) = without.first() {
            let why = format!(
                "{} of {} cases have no verdict, {first} is the first; an entry answers every case, `unknown` where it has no answer",
                without.len(),
                bench.tiers.len()
            );
            return Err(TrialError::at(file, why));
        }
        Ok(Self { cases, hash: files::hash(text.as_bytes()) })
    }

    /// How many cases have items of each kind: verdicts, answers, effects, parameters, outputs, costs.
    pub fn counts(&self) -> [(&'static str, usize); 6] {
        let count = |has: &dyn Fn(&CaseEntry) -> bool| self.cases.values().filter(|c| has(c)).count();
        [
            ("verdict", self.cases.len()),
            ("answer", count(&|c| !c.answers.is_empty())),
            ("effect", count(&|c| !c.effects.is_empty())),
            ("parameter", count(&|c| !c.parameters.is_empty())),
            ("output", count(&|c| !c.outputs.is_empty())),
            ("cost", count(&|c| c.processor_seconds.is_some())),
        ]
    }
}

impl CaseEntry {
    fn take(&mut self, row: &SubmissionRow, bench: &PublicBench) -> Result<(), String> {
        let value =
            || row.value.filter(|v| v.is_finite()).ok_or_else(|| format!("`{}` has no value", row.item));
        let probability = || match value()? {
            p if (0.0..=1.0).contains(&p) => Ok(p),
            p => Err(format!("a probability of {p}; it is between 0 and 1")),
        };
        let name = if row.name.is_empty() { None } else { Some(row.name.clone()) };
        let named = || name.clone().ok_or_else(|| format!("`{}` has no name", row.item));
        match row.item.as_str() {
            "verdict" => {
                let verdict = named()?;
                if !VERDICTS.contains(&verdict.as_str()) {
                    return Err(format!("verdict `{verdict}` is none of {}", VERDICTS.join(", ")));
                }
                if !self.verdict.is_empty() {
                    return Err(format!("a second verdict of case {}", row.case));
                }
                self.verdict = verdict;
            }
            "answer" => {
                let (name, p) = (named()?, probability()?);
                let name = answer_name(&name.split('+').collect::<Vec<_>>());
                if self.answers.insert(name.clone(), p).is_some() {
                    return Err(format!("a second answer `{name}` of case {}", row.case));
                }
            }
            "effect" => {
                let (component, joint) = match row.place.split_once('/') {
                    None => (row.place.as_str(), None),
                    Some((component, joint)) => {
                        let joint =
                            joint.parse().map_err(|_| format!("`{}`: the joint is a number", row.place))?;
                        (component, Some(joint))
                    }
                };
                self.effects.push(AnsweredClaim {
                    id: named()?,
                    component: (!component.is_empty()).then(|| component.to_owned()),
                    joint,
                    probability: row.value.map(|_| probability()).transpose()?,
                    parameters: BTreeMap::new(),
                });
            }
            "parameter" => {
                let name = named()?;
                let _ = value()?;
                let interval = row.low.zip(row.high).map(|(low, high)| [low, high]);
                if interval.is_some_and(|[low, high]| low.is_nan() || low > high) {
                    return Err(format!("the interval of `{name}` ends before it begins"));
                }
                if self.parameters.insert(name.clone(), EnteredValue { interval }).is_some() {
                    return Err(format!("a second `{name}` of case {}", row.case));
                }
            }
            "output" => {
                let (name, value) = (named()?, value()?);
                let time = ticks(row.time.ok_or("`output` has no time")?);
                let times = bench.requested.get(&(row.case.clone(), row.recording.clone()));
                let times = times.ok_or_else(|| {
                    format!(
                        "`{}` is no hold-out recording of {}; requested.csv lists them",
                        row.recording, row.case
                    )
                })?;
                if !times.contains(&time) {
                    return Err(format!(
                        "{} s was not requested; requested.csv has the times",
                        row.time.unwrap_or(0.0)
                    ));
                }
                self.outputs.entry((row.recording.clone(), name)).or_default().insert(time, value);
            }
            "cost" => match value()? {
                seconds if seconds >= 0.0 => self.processor_seconds = Some(seconds),
                seconds => return Err(format!("{seconds} s of processor time")),
            },
            other => {
                return Err(format!(
                    "item `{other}` is none of verdict, answer, effect, parameter, output, cost"
                ));
            }
        }
        Ok(())
    }

    /// What can be judged of a case alone, when all its rows are in. A verdict without answers is one with certainty.
    fn complete(&mut self, name: &str, bench: &PublicBench) -> Result<(), String> {
        if self.verdict.is_empty() {
            return Err("it has items, but no verdict".into());
        }
        let claims = self.verdict == "effects" || self.verdict == "ambiguous";
        if claims == self.effects.is_empty() {
            return Err(match claims {
                true => format!("its verdict is `{}`, but there is no row `effect`", self.verdict),
                false => format!("its verdict is `{}`, but there are rows `effect`", self.verdict),
            });
        }
        for ((recording, reading), given) in &self.outputs {
            let requested =
                bench.requested.get(&(name.to_owned(), recording.clone())).map_or(0, BTreeSet::len);
            if given.len() < requested {
                return Err(format!(
                    "{} of {requested} times of `{reading}` in {recording} have an output; give all or none of a reading",
                    given.len()
                ));
            }
        }
        let sum: f64 = self.answers.values().sum();
        if sum > 1.0 + ROUNDED {
            return Err(format!("the probabilities of its answers add up to {sum}, more than 1"));
        }
        if self.answers.is_empty() {
            let ids: Vec<&str> = self.effects.iter().map(|e| e.id.as_str()).collect();
            self.answers = match self.verdict.as_str() {
                "effects" => BTreeMap::from([(answer_name(&ids), 1.0)]),
                "ambiguous" => ids.iter().map(|id| ((*id).to_owned(), 1.0 / ids.len() as f64)).collect(),
                verdict => BTreeMap::from([(verdict.to_owned(), 1.0)]),
            };
        }
        Ok(())
    }
}
