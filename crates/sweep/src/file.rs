//! The content of a sweep's file (docs/sweeps.md).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use trueup_cosim::InputMistake;
use trueup_cosim::system::{Algorithm, RunSettings, SourceSpan};

use crate::design::sobol::MOST as MOST_SOBOL;
use crate::error::SweepError;
use crate::mistakes::SweepMistakes;
use crate::value::FactorValue;

/// A sweep as its author wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepFile {
    /// The file.
    pub file: PathBuf,
    /// What is run: an FMU, a system as TOML or SSP.
    pub system: PathBuf,
    /// How the factors are varied.
    pub kind: SweepKind,
    /// How many runs; of a grid or a list the factors say it.
    pub runs: u64,
    /// Of what is drawn. A Sobol sequence without a seed is not shifted.
    pub seed: Option<u64>,
    /// The sweep's settings of when and how to run; they override the system's.
    pub run: RunSettings,
    /// What is varied, in the order of the file.
    pub factors: Vec<SweepFactor>,
    /// What is kept of each run, in the order of the file.
    pub outputs: Vec<Output>,
}

/// How factors are varied.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SweepKind {
    /// All combinations; the last factor changes fastest.
    Grid,
    /// The k-th run takes the k-th value of each.
    List,
    /// As many layers of each factor as runs, each used once.
    LatinHypercube,
    /// Sobol's sequence with the direction numbers of Joe and Kuo.
    Sobol,
}

/// Something that is varied.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepFactor {
    /// Name of its column.
    pub name: String,
    /// What it sets: `component.variable`, an element of it, of an FMU alone `variable`; several get the same value.
    pub variables: Vec<String>,
    /// Which values it takes.
    pub values: FactorValues,
    /// Where it was given.
    pub place: SourceSpan,
}

/// Which values a factor takes.
#[derive(Clone, Debug, PartialEq)]
pub enum FactorValues {
    /// From one number to another, both included in a grid.
    Range(Range),
    /// These.
    List(Vec<FactorValue>),
}

/// Numbers from one to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// First, in the variable's unit.
    pub from: f64,
    /// Last, in the variable's unit.
    pub to: f64,
    /// How many, in a grid.
    pub points: u64,
    /// Equal ratios instead of equal differences.
    pub log: bool,
}

/// A number that is kept of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    /// Name of its column.
    pub name: String,
    /// Of which variable: `component.variable` or an element of it.
    pub variable: String,
    /// What of it.
    pub take: Take,
    /// Where it was given.
    pub place: SourceSpan,
}

/// What is kept of a variable's course.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Take {
    /// The last value.
    Final,
    /// The least value.
    Min,
    /// The largest value.
    Max,
    /// The mean over time, of the line between rows.
    Mean,
    /// The root of the mean square over time, of the line between rows.
    Rms,
    /// When it first rises above a level, s; none if it never does.
    Above(f64),
    /// When it first falls below a level, s; none if it never does.
    Below(f64),
    /// From when on it stays above a level, s; none if it does not at the end.
    StaysAbove(f64),
    /// From when on it stays below a level, s; none if it does not at the end.
    StaysBelow(f64),
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawSweep {
    system: String,
    design: SweepKind,
    #[schemars(with = "Option<u64>")]
    runs: Option<Spanned<u64>>,
    seed: Option<u64>,
    #[serde(default)]
    run: RawRun,
    #[schemars(with = "BTreeMap<String, RawFactor>")]
    factors: Spanned<BTreeMap<Spanned<String>, RawFactor>>,
    #[schemars(with = "BTreeMap<String, RawOutput>")]
    outputs: Spanned<BTreeMap<Spanned<String>, RawOutput>>,
}

#[derive(Deserialize, JsonSchema, Default)]
#[serde(deny_unknown_fields)]
struct RawRun {
    start: Option<f64>,
    stop: Option<f64>,
    step: Option<f64>,
    tolerance: Option<f64>,
    #[schemars(with = "Option<String>")]
    algorithm: Option<Spanned<String>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawFactor {
    variable: Option<OneOrMore>,
    #[schemars(with = "Option<Vec<serde_json::Value>>")]
    values: Option<Vec<toml::Value>>,
    from: Option<f64>,
    to: Option<f64>,
    points: Option<u64>,
    spacing: Option<Spacing>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(untagged)]
enum OneOrMore {
    One(String),
    More(Vec<String>),
}

#[derive(Deserialize, JsonSchema, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Spacing {
    Linear,
    Log,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RawOutput {
    variable: Option<String>,
    #[serde(default)]
    take: RawTake,
    above: Option<f64>,
    below: Option<f64>,
}

#[derive(Deserialize, JsonSchema, Default, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum RawTake {
    #[default]
    Final,
    Min,
    Max,
    Mean,
    Rms,
    Time,
    Settled,
}

/// JSON Schema of a sweep's file, by what its reader takes.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(RawSweep).to_value()
}

/// Columns that every table has in addition to factors and outputs.
pub(crate) const OWN: [&str; 2] = ["run", "reason"];
/// More runs would not fit the memory of a merge.
const MOST: u64 = 100_000_000;

impl SweepFile {
    /// Reads a file. Paths in it are relative to its folder.
    ///
    /// # Errors
    /// [`SweepError::File`] if it cannot be read, else [`SweepError::Mistakes`] with lines.
    pub fn read(file: &Path) -> Result<Self, SweepError> {
        let text = std::fs::read_to_string(file).map_err(|e| {
            let mend = "name a sweep's file, see docs/sweeps.md";
            SweepError::at(file, format!("{e}; {mend}"))
        })?;
        Self::parse(&text, file)
    }

    /// Reads a text of this file.
    ///
    /// # Errors
    /// [`SweepError::Mistakes`] with lines.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SweepError> {
        let mut mistakes = SweepMistakes::of(file, text);
        let raw: RawSweep = match toml::from_str(text) {
            Ok(raw) => raw,
            Err(e) => {
                mistakes.wrong(e.span().unwrap_or(0..0), e.message().replace('\n', "; "));
                return Err(SweepError::Mistakes(mistakes.list));
            }
        };
        let sweep = raw.said(file, &mut mistakes);
        if mistakes.list.is_empty() {
            Ok(sweep)
        } else {
            mistakes.list.sort_by_key(|m| m.place.line);
            Err(SweepError::Mistakes(mistakes.list))
        }
    }

    /// The folder of its logs: next to it, `NAME.runs`.
    pub fn folder(&self) -> PathBuf {
        self.file.with_extension("runs")
    }
}

impl RawSweep {
    fn said(self, file: &Path, mistakes: &mut SweepMistakes) -> SweepFile {
        let run = self.run.said(mistakes);
        let (factors_at, outputs_at) = (self.factors.span(), self.outputs.span());
        let kind = self.design;
        let factors: Vec<SweepFactor> = in_order(self.factors.into_inner())
            .into_iter()
            .map(|(name, raw)| raw.said(name, kind, mistakes))
            .collect();
        let outputs: Vec<Output> = in_order(self.outputs.into_inner())
            .into_iter()
            .map(|(name, raw)| raw.said(name, mistakes))
            .collect();
        if factors.is_empty() {
            mistakes.wrong(factors_at, "[factors] is empty; name what is varied");
        }
        if outputs.is_empty() {
            mistakes.wrong(outputs_at, "[outputs] is empty; name what is kept of each run");
        }
        if kind == SweepKind::Sobol && factors.len() > MOST_SOBOL {
            let more = format!("a Sobol sequence has {MOST_SOBOL} factors at most; use \"latin-hypercube\"");
            mistakes.wrong(0..0, more);
        }
        varied_once(&factors, mistakes);
        let mut names: Vec<(&str, &SourceSpan)> =
            factors.iter().map(|f| (f.name.as_str(), &f.place)).collect();
        names.extend(outputs.iter().map(|o| (o.name.as_str(), &o.place)));
        for (i, (name, place)) in names.iter().enumerate() {
            let taken = OWN.contains(name) || names[..i].iter().any(|(before, _)| before == name);
            if taken {
                let message = format!("the column `{name}` is there already; give this one another name");
                mistakes.list.push(InputMistake { place: (*place).clone(), message });
            }
        }
        let runs = runs(kind, self.runs, &factors, mistakes);
        let folder = file.parent().unwrap_or(Path::new(""));
        let system = folder.join(self.system);
        SweepFile { file: file.into(), system, kind, runs, seed: self.seed, run, factors, outputs }
    }
}

/// A variable has one value in a run: two factors on it, or on an array and an element of it, would leave one of them without effect.
fn varied_once(factors: &[SweepFactor], mistakes: &mut SweepMistakes) {
    let stem =
        |name: &str| name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).map(|(stem, _)| stem.to_owned());
    let meet = |a: &str, b: &str| a == b || stem(a).as_deref() == Some(b) || stem(b).as_deref() == Some(a);
    let mut seen: Vec<(&str, &SweepFactor)> = Vec::new();
    for factor in factors {
        for variable in &factor.variables {
            if let Some((_, other)) = seen.iter().find(|(before, _)| meet(before, variable)) {
                let (name, first, place) = (&factor.name, &other.name, &other.place);
                let message = if std::ptr::eq(*other, factor) {
                    format!("`{name}` names `{variable}` twice; take one out")
                } else {
                    format!(
                        "`{variable}` is varied by `{first}` already, see {place}; take it out of one of the two"
                    )
                };
                mistakes.list.push(InputMistake { place: factor.place.clone(), message });
            }
            seen.push((variable, factor));
        }
    }
}

/// How many runs there are.
fn runs(
    kind: SweepKind,
    said: Option<Spanned<u64>>,
    factors: &[SweepFactor],
    mistakes: &mut SweepMistakes,
) -> u64 {
    let lengths = factors.iter().map(|f| match &f.values {
        FactorValues::Range(r) => r.points,
        FactorValues::List(list) => list.len() as u64,
    });
    let span = said.as_ref().map_or(0..0, Spanned::span);
    let runs = match (kind, said.map(Spanned::into_inner)) {
        (SweepKind::Grid | SweepKind::List, Some(_)) => {
            mistakes.wrong(
                span,
                "of a grid or a list the factors define how many runs there are; take `runs` out",
            );
            return 0;
        }
        (SweepKind::Grid, None) => lengths.fold(1, u64::saturating_mul),
        (SweepKind::List, None) => {
            let (least, most) = lengths.fold((u64::MAX, 0), |(a, b), n| (a.min(n), b.max(n)));
            if least != most && mistakes.list.is_empty() {
                let mend = "a list has as many values of each factor";
                mistakes
                    .wrong(span.clone(), format!("{mend}; here are {least} of one and {most} of another"));
            }
            most
        }
        (SweepKind::LatinHypercube | SweepKind::Sobol, Some(runs)) => runs,
        (SweepKind::LatinHypercube | SweepKind::Sobol, None) => {
            mistakes.wrong(span, "this design needs `runs = N`");
            return 0;
        }
    };
    if runs == 0 && mistakes.list.is_empty() {
        mistakes.wrong(span.clone(), "there is no run; `runs` is 1 or more, and no list of values is empty");
    }
    if runs > MOST {
        mistakes.wrong(span, format!("these are {runs} runs; {MOST} are the most"));
    }
    runs
}

/// As they are in the file.
fn in_order<T>(map: BTreeMap<Spanned<String>, T>) -> Vec<(Spanned<String>, T)> {
    let mut all: Vec<_> = map.into_iter().collect();
    all.sort_by_key(|(name, _)| name.span().start);
    all
}

impl RawRun {
    fn said(self, mistakes: &mut SweepMistakes) -> RunSettings {
        let Self { start, stop, step, tolerance, algorithm } = self;
        let place = mistakes.place(0..0);
        let algorithm = algorithm.and_then(|word| {
            let parsed = word.get_ref().parse::<Algorithm>();
            parsed.map_err(|why| mistakes.wrong(word.span(), format!("`algorithm`: {why}"))).ok()
        });
        RunSettings { start, stop, step, tolerance, algorithm, event_rows: Some(true), place }
    }
}

impl RawFactor {
    fn said(self, name: Spanned<String>, kind: SweepKind, mistakes: &mut SweepMistakes) -> SweepFactor {
        let span = name.span();
        let name = name.into_inner();
        let variables = match self.variable {
            None => vec![name.clone()],
            Some(OneOrMore::One(one)) => vec![one],
            Some(OneOrMore::More(list)) => list,
        };
        let log = self.spacing == Some(Spacing::Log);
        let values = match (self.values, self.from, self.to) {
            (Some(list), None, None) if self.points.is_none() && self.spacing.is_none() => {
                let values: Option<Vec<FactorValue>> = list.iter().map(FactorValue::of).collect();
                if values.is_none() {
                    mistakes.wrong(
                        span.clone(),
                        format!("`{name}`: values are finite numbers, true, false or texts"),
                    );
                }
                FactorValues::List(values.unwrap_or_default())
            }
            (None, Some(from), Some(to)) => {
                let points = self.points.unwrap_or(0);
                let grid = kind == SweepKind::Grid;
                if !(to - from).is_finite() {
                    mistakes.wrong(span.clone(), format!("`{name}`: `from` and `to` are finite numbers"));
                } else if log && (from <= 0.0 || to <= 0.0) {
                    let mend = "let `from` and `to` be above 0, or take `spacing` out";
                    mistakes.wrong(span.clone(), format!("`{name}`: equal ratios lead to no 0; {mend}"));
                }
                if kind == SweepKind::List {
                    mistakes.wrong(span.clone(), format!("`{name}`: a list needs `values = [...]`"));
                } else if grid && points < 2 {
                    let mend = "write `points = N`, 2 or more, or `values = [...]`";
                    mistakes.wrong(span.clone(), format!("`{name}`: how many points has it? {mend}"));
                } else if !grid && self.points.is_some() {
                    let mend = "`points` belongs to a grid; take it out";
                    mistakes.wrong(span.clone(), format!("`{name}`: {mend}"));
                }
                FactorValues::Range(Range { from, to, points, log })
            }
            _ => {
                let mend = "write either `values = [...]`, or `from` and `to`";
                mistakes.wrong(span.clone(), format!("`{name}`: which values does it take? {mend}"));
                FactorValues::List(Vec::new())
            }
        };
        SweepFactor { name, variables, values, place: mistakes.place(span) }
    }
}

impl RawOutput {
    fn said(self, name: Spanned<String>, mistakes: &mut SweepMistakes) -> Output {
        let span = name.span();
        let name = name.into_inner();
        let take = match (self.take, self.above, self.below) {
            (RawTake::Final, None, None) => Take::Final,
            (RawTake::Min, None, None) => Take::Min,
            (RawTake::Max, None, None) => Take::Max,
            (RawTake::Mean, None, None) => Take::Mean,
            (RawTake::Rms, None, None) => Take::Rms,
            (RawTake::Time, Some(level), None) if level.is_finite() => Take::Above(level),
            (RawTake::Time, None, Some(level)) if level.is_finite() => Take::Below(level),
            (RawTake::Settled, Some(level), None) if level.is_finite() => Take::StaysAbove(level),
            (RawTake::Settled, None, Some(level)) if level.is_finite() => Take::StaysBelow(level),
            (RawTake::Time | RawTake::Settled, ..) => {
                let mend = "write either `above = X` or `below = X`";
                mistakes.wrong(span.clone(), format!("`{name}`: the time of what? {mend}"));
                Take::Final
            }
            _ => {
                let mend = "`above` and `below` belong to `take = \"time\"` and `take = \"settled\"`";
                mistakes.wrong(span.clone(), format!("`{name}`: {mend}"));
                Take::Final
            }
        };
        Output {
            variable: self.variable.unwrap_or_else(|| name.clone()),
            name,
            take,
            place: mistakes.place(span),
        }
    }
}
