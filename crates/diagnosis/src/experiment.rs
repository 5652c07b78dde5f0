//! The next experiment: of a small menu of inputs the one that distinguishes causes which the recordings do not.
//!
//! Every input is played to the most likely model, which is read with the sensors' noise; then the model and its rivals are
//! fitted to that recording as they would be to a real one, within what the recordings at hand leave open. The input that is
//! proposed has the greatest lead of the truth over the best rival (T-optimal design: A.C. Atkinson, V.V. Fedorov,
//! Biometrika 62, 1975), by the odds of the residual powers of their equation errors.

mod menu;

use crate::engine::unknown::UnknownPrior;
use std::collections::BTreeSet;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};
use trueup_identification::lsq::SolverOptions;
use trueup_identification::parallel;
use trueup_identification::run::{IdentificationRun, InputDrive, OutputChannel};
use trueup_signals::Recording;

use crate::engine::decide::{APART, Decision};
use crate::engine::hypothesis::Hypothesis;
use crate::engine::problem::{BalanceProblem, BalanceUnknown, Compared};
use crate::engine::recordings::PreparedCase;
use crate::engine::result::SearchResult;
use crate::engine::search::{CaseSearch, FittedSet};
use crate::outcome::{NextExperiment, Verdict};
use menu::InputCourse;

/// The file that its inputs are written to.
pub const FILE: &str = "next-experiment.csv";
/// Where nothing on the menu would distinguish them.
pub const NOTHING: &str = "no input of the menu, within what was recorded, is expected to distinguish the causes: record larger motions, \
                           or another quantity";
/// Longest experiment in s.
const LONGEST: f64 = 20.0;
/// A joint may leave the range in which it was recorded by this many times that range.
const BEYOND: f64 = 1.0;
/// Rivals that are looked at.
const RIVALS: usize = 2;
/// Fewer readings that count are none.
const LEAST: f64 = 100.0;
/// How much of the log-likelihood ratio of the residual powers counts: the rest is attributed to form.
const TRUST: f64 = 0.05;
/// Of the noise that is drawn.
const SEEDS: [u64; 2] = [1, 2];

/// An input over time.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedExperiment {
    /// FMU variable.
    pub name: String,
    /// Times in s.
    pub time: Vec<f64>,
    /// Values in the variable's unit.
    pub value: Vec<f64>,
}

/// An experiment with its predicted result.
#[derive(Clone, Debug, PartialEq)]
pub struct ProposedExperiment {
    /// The entry of `diagnosis.json`.
    pub entry: NextExperiment,
    /// Its inputs, on the same times.
    pub inputs: Vec<SimulatedExperiment>,
}

/// The inputs as a recording's file.
///
/// # Errors
/// Of the writer.
pub fn csv(inputs: &[SimulatedExperiment]) -> Result<Vec<u8>, std::io::Error> {
    let channel =
        |i: &SimulatedExperiment| trueup_signals::Channel::new(&i.name, "", i.time.clone(), i.value.clone());
    let recording = Recording { channels: inputs.iter().map(channel).collect(), ..Recording::default() };
    let mut out = Vec::new();
    recording.to_csv(&mut out)?;
    Ok(out)
}

/// What is to be distinguished, and on what ground.
struct Setting<'a> {
    search: &'a CaseSearch<'a>,
    /// Inputs that drove the plant: index, largest value, how it goes between samples.
    driven: Vec<(usize, f64)>,
    /// A recording that the new one is to be like.
    like: &'a Compared,
    step: f64,
    length: f64,
}

/// Proposes an experiment where causes were not distinguished; `None` where there is nothing to distinguish, or nothing on the
/// menu that would.
pub fn propose(
    search: &CaseSearch<'_>,
    found: &SearchResult,
    decision: &Decision,
) -> Option<ProposedExperiment> {
    if decision.verdict != Verdict::Ambiguous {
        return None;
    }
    let (at, rivals) = decision.rivals.iter().enumerate().find_map(|(i, list)| {
        let near = list.iter().filter(|r| -r.1 < APART).map(|r| &found.sets[r.0]);
        // Causes that differ only in the form of a law are distinguished by no recording.
        let own = &found.best.stated.set[i];
        let apart = |f: &&FittedSet| other(found, f).is_some_and(|o| !o.same_friction(own));
        let near: Vec<&FittedSet> = near.filter(apart).take(RIVALS).collect();
        (!near.is_empty()).then_some((i, near))
    })?;
    let setting = Setting::new(search)?;
    let mut separates = vec![found.best.stated.set[at].id.clone()];
    separates.extend(rivals.iter().filter_map(|f| Some(other(found, f)?.id.clone())));
    let mut named = BTreeSet::new();
    separates.retain(|id| named.insert(id.clone()));
    let courses = menu::courses(&setting.driven, setting.step, setting.length, &setting.favoured(&rivals));
    let tried = parallel::map(&courses, |c| Some((setting.least(&found.best, &rivals, c)?, c)));
    let (promise, course) = tried.into_iter().flatten().max_by(|a, b| a.0.odds.total_cmp(&b.0.odds))?;
    // Odds that are there already count.
    let odds = promise.odds + decision.rivals[at].first().map_or(0.0, |r| -r.1);
    let spread = promise.spread.hypot((2.0 * promise.odds.max(0.0)).sqrt()).max(1e-9);
    let probability = Normal::standard().cdf((odds - APART) / spread);
    if promise.odds <= 0.0 || probability < 0.5 {
        return None;
    }
    let inputs: Vec<SimulatedExperiment> = course
        .inputs
        .iter()
        .map(|(input, value)| SimulatedExperiment {
            name: search.case.subject.inputs()[*input].clone(),
            time: (0..value.len()).map(|k| tidy(k as f64 * setting.step)).collect(),
            value: value.clone(),
        })
        .collect();
    let names: Vec<&str> = inputs.iter().map(|i| i.name.as_str()).collect();
    let why = format!(
        "{} of what was recorded, on {}, for {:.0} s from rest: fitted to what the likelier model would show, its best rival still \
         leaves {:.3} times as much as that model itself.",
        course.what,
        names.join(", "),
        setting.length,
        promise.ratio
    );
    let entry = NextExperiment { why, separates, input: FILE.into(), probability: Some(probability) };
    Some(ProposedExperiment { entry, inputs })
}

/// Without the last digits of a product.
fn tidy(t: f64) -> f64 {
    (t * 1e9).round() / 1e9
}

/// What a rival set has instead of one of the chosen causes.
fn other<'a>(found: &SearchResult, f: &'a FittedSet) -> Option<&'a Hypothesis> {
    f.stated.set.iter().find(|o| !found.best.stated.set.contains(o))
}

/// The predicted result of an input.
#[derive(Clone, Copy, Debug)]
struct InputPromise {
    /// Odds (natural logarithm) of the truth over the rival.
    odds: f64,
    /// By how much they vary with the noise.
    spread: f64,
    /// RMS that the rival leaves over that of the truth.
    ratio: f64,
}

impl<'a> Setting<'a> {
    fn new(search: &'a CaseSearch<'a>) -> Option<Self> {
        let train = &search.case.train;
        let like = train.first()?;
        let mut driven: Vec<(usize, f64)> = Vec::new();
        for d in train.iter().flat_map(|r| &r.run.drives) {
            let most = d.u.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
            match driven.iter_mut().find(|(input, _)| *input == d.input) {
                Some((_, known)) => *known = known.max(most),
                None => driven.push((d.input, most)),
            }
        }
        driven.retain(|(_, most)| *most > 0.0);
        let length = |r: &Compared| {
            let ends = r.run.channels.iter().filter_map(|c| Some(c.t.last()? - c.t.first()?));
            ends.fold(0.0, f64::max)
        };
        let step = like.run.channels.iter().filter_map(|c| crate::engine::coordinate::median_step(&c.t));
        let step = step.fold(f64::INFINITY, f64::min);
        let length = train.iter().map(length).fold(0.0, f64::max).min(LONGEST);
        (step.is_finite() && step > 0.0 && length > 20.0 * step && !driven.is_empty()).then_some(Self {
            search,
            driven,
            like,
            step,
            length,
        })
    }

    /// Inputs of the joints that the rivals are about.
    fn favoured(&self, rivals: &[&FittedSet]) -> Vec<usize> {
        let inputs = self.search.case.subject.inputs();
        let sites = rivals.iter().flat_map(|f| &f.stated.set).filter(|h| h.per_joint).map(|h| h.site + 1);
        let name = |site: usize| format!("jointTorque[{site}]");
        let mut all: Vec<usize> = sites.filter_map(|s| inputs.iter().position(|i| *i == name(s))).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The recording that would be made, without readings yet.
    fn blank(&self, course: &InputCourse) -> Compared {
        let run = &self.like.run;
        let count = (self.length / self.step).floor() as usize + 1;
        let t: Vec<f64> = (0..count).map(|k| self.step * k as f64).collect();
        let channels =
            run.channels.iter().map(|c| OutputChannel { t: t.clone(), y: vec![0.0; count], ..c.clone() });
        let drives = course.inputs.iter().map(|(input, value)| InputDrive {
            input: *input,
            t: t.clone(),
            u: value.clone(),
            between: run.drives.iter().find(|d| d.input == *input).map(|d| d.between).unwrap_or_default(),
            ..InputDrive::default()
        });
        let (channels, drives) = (channels.collect(), drives.collect());
        let new = IdentificationRun {
            name: FILE.into(),
            channels,
            drives,
            start: 0.0,
            ..IdentificationRun::default()
        };
        // From rest where it was.
        let speeds: Vec<usize> =
            self.search.case.coordinates.iter().filter_map(|c| Some(c.start?[1])).collect();
        let still = |(i, v): &(usize, f64)| (*i, if speeds.contains(i) { 0.0 } else { *v });
        let known = self.like.known.iter().map(still).collect();
        Compared::new(new, known, self.search.case.model.sizes().inputs)
    }

    /// The recording that a model as it was fitted would make, read with noise. `None`: it cannot be simulated, or would
    /// leave the range that is known.
    fn made(&self, truth: &FittedSet, course: &InputCourse, seed: u64) -> Option<Compared> {
        let runs = [self.blank(course)];
        let mut stated = truth.stated.clone();
        stated.nominal = self.search.compare(&truth.stated).parameters(0, &truth.theta);
        let (unknowns, theta): (Vec<BalanceUnknown>, Vec<f64>) = (stated.unknowns.iter().zip(&truth.theta))
            .filter(|(u, _)| u.run.is_none())
            .map(|(u, x)| (u.clone(), *x))
            .unzip();
        let model = BalanceProblem {
            ties: stated.ties,
            unknowns,
            ..BalanceProblem::free(&stated.model, stated.nominal, &runs)
        };
        let mut run = runs[0].run.clone();
        run.channels.iter_mut().zip(model.shown(0, &theta).ok()?).for_each(|(c, y)| c.y = y);
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        self.search.case.read_noisily(&mut run, &mut rng);
        if !run.channels.iter().all(|c| self.inside(c)) {
            return None;
        }
        Some(Compared::new(run, runs[0].known.clone(), self.search.case.model.sizes().inputs))
    }

    /// Power that a set of causes leaves of a recording, fitted to it within what the recordings at hand leave open.
    fn left(new: &CaseSearch<'_>, f: &FittedSet) -> Option<(f64, f64)> {
        let mut stated = new.state(&f.stated.set).ok()?;
        let sd = f.deviations();
        for u in stated.unknowns.iter_mut().filter(|u| u.run.is_none() && u.lower < u.upper) {
            let known = f.stated.unknowns.iter().position(|o| o.name == u.name && o.run.is_none());
            if let Some(k) = known.filter(|k| sd[*k] > 0.0) {
                u.prior = Some(UnknownPrior::normal(f.theta[k], sd[k]));
            }
        }
        let start = new.begin_with(&stated, f);
        let options = SolverOptions {
            max_iterations: 6,
            cost_tolerance: 1e-4,
            radius: 1.0,
            ..SolverOptions::default()
        };
        let fitted = new.fit(stated, &start, options).ok()?;
        Some(((fitted.chi2 + fitted.prior2) / fitted.count(), fitted.count()))
    }

    /// The predicted odds of the course against the nearest rival, over several draws of the noise.
    fn least(&self, truth: &FittedSet, rivals: &[&FittedSet], course: &InputCourse) -> Option<InputPromise> {
        let draws = SEEDS.map(|seed| {
            let train = vec![self.made(truth, course, seed)?];
            let case = PreparedCase { train, holdout: Vec::new(), ..self.search.case.clone() };
            let new = CaseSearch::new(&case, seed).ok()?;
            let (own, count) = Self::left(&new, truth)?;
            let all: Option<Vec<f64>> = rivals.iter().map(|r| Some(Self::left(&new, r)?.0 / own)).collect();
            let ratio = all?.into_iter().fold(f64::INFINITY, f64::min);
            // A plant at rest gives no information.
            let odds = 0.5 * TRUST * count * ratio.ln();
            (odds.is_finite() && count >= LEAST).then_some((odds, ratio.sqrt()))
        });
        let draws: Vec<(f64, f64)> = draws.into_iter().collect::<Option<_>>()?;
        let mean = |f: &dyn Fn(&(f64, f64)) -> f64| draws.iter().map(f).sum::<f64>() / draws.len() as f64;
        let odds = mean(&|d| d.0);
        let spread = mean(&|d| (d.0 - odds).powi(2)).sqrt() * std::f64::consts::SQRT_2;
        Some(InputPromise { odds, spread, ratio: mean(&|d| d.1) })
    }

    /// Whether a channel stays near where it was recorded.
    fn inside(&self, predicted: &OutputChannel) -> bool {
        let same = self.search.case.train.iter().flat_map(|r| &r.run.channels);
        let readings = same.filter(|c| c.output == predicted.output).flat_map(|c| &c.y);
        let (low, high) =
            readings.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(*y), h.max(*y)));
        let more = BEYOND * (high - low);
        predicted.y.iter().all(|y| (low - more..=high + more).contains(y))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_inputs_is_a_recording() {
        let played = |name: &str, value: [f64; 3]| SimulatedExperiment {
            name: name.into(),
            time: vec![0.0, tidy(3.0 * 0.1), 0.6],
            value: value.to_vec(),
        };
        let inputs =
            [played("jointTorque[1]", [0.0, 0.25, -0.5]), played("jointTorque[2]", [1.0, 0.0, 1e-9])];
        let text = String::from_utf8(csv(&inputs).unwrap()).unwrap();
        assert_eq!(text, "time,jointTorque[1],jointTorque[2]\n0.0,0.0,1.0\n0.3,0.25,0.0\n0.6,-0.5,1e-9\n");
    }
}
