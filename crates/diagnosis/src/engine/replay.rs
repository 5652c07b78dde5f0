//! Free-running simulations: the last polish of a fit, and the gap on recordings that were never fitted.

mod remembered;
mod settle;
mod windows;

use std::convert::Infallible;

use super::unknown::UnknownPrior;
use nalgebra::DMatrix;
use remembered::RememberedRuns;
use trueup_identification::lsq::SolverOptions;
use trueup_identification::parallel;
use trueup_identification::predict::{KeptLaws, PredictError};
use trueup_identification::run::OutputChannel;
use trueup_identification::unknown::Scale;
use trueup_models::effect::Measure;
pub use windows::{Window, joined};

use super::hypothesis::Hypothesis;
use super::problem::{BalanceProblem, BalanceTarget, BalanceUnknown, Belief, Compared};
use super::search::{CaseSearch, FittedSet, PosedSet};
use super::subject::EngineModel;

/// A first state's standard deviation is at least this share of the range that is seen.
const UNSURE: f64 = 0.003;

/// Number of independent readings of a channel in a recording, of what a free run misses.
const INDEPENDENT: f64 = 100.0;
/// How much further than their deviation the balances' estimates may be off when nothing is left: free runs that bifurcate
/// would else drag what balances know.
const FURTHER: f64 = 3.0;
/// ... where a free run so held misses more than this times the noise (as powers), so many times that,
const NEAR: f64 = 4.0;
const LOOSE: f64 = 4.0;
/// if it misses no more than this share of it then.
const FAR_BETTER: f64 = 0.5;
/// How much of what is left is the law's form, by which estimates err more than by noise: in units of the noise's power.
const FURTHER_BY_FORM: f64 = 10.0;
/// Deviations of a channel's mean square by which chance alone may lift it above the noise that is declared.
const CHANCE: f64 = 3.0;

/// How often the inputs' noise is drawn to carry it along.
pub const DRAWS: u32 = 6;

/// Free-running simulation of recordings: readings by recording, channel after channel.
pub type ReplayedReadings = Vec<Vec<Vec<f64>>>;

/// A model with everything set, ready to run freely.
#[derive(Clone, Debug)]
pub struct CompleteModel {
    /// Set of causes and unknowns.
    pub stated: PosedSet,
    /// Coordinates of the unknowns.
    pub theta: Vec<f64>,
}

/// A model with its values. Of one case its equations follow from its causes.
#[derive(Clone, Debug, PartialEq)]
struct ModelKey {
    set: Vec<Hypothesis>,
    nominal: Vec<f64>,
    unknowns: Vec<BalanceUnknown>,
    theta: Vec<f64>,
}

impl ModelKey {
    fn of(complete: &CompleteModel) -> Self {
        let s = &complete.stated;
        let (set, unknowns) = (s.set.clone(), s.unknowns.clone());
        Self { set, nominal: s.nominal.clone(), unknowns, theta: complete.theta.clone() }
    }
}

/// A set fitted free-running.
#[derive(Clone, Debug)]
pub struct FreeRunFit {
    /// The set with everything set.
    pub complete: CompleteModel,
    /// What is left on the recordings for fitting ([`CaseSearch::misfit`]).
    pub misfit: f64,
    /// The free-running set where it ended; `None`: it cannot be simulated.
    pub fitted: Option<FittedSet>,
}

/// A recording that runs freely from where it fits best.
#[derive(Clone, Debug)]
pub struct FittedReplay {
    /// Readings in the channels' units, channel after channel.
    pub shown: Vec<Vec<f64>>,
    /// All parameters of the model in their units, first states among them.
    pub parameters: Vec<f64>,
    /// What constant offsets add to readings, by output, in its unit.
    pub offsets: Vec<(usize, f64)>,
    /// Coordinates of what was estimated for it.
    theta: Vec<f64>,
    /// First states and offsets among them by name.
    first: Vec<(String, f64)>,
    /// Deviations that the model was allowed.
    allowed: Vec<Vec<f64>>,
}

impl FittedSet {
    /// Where they miss an effect balances bias the parameters: only their priors limit them then.
    pub(super) fn is_unbiased(&self) -> bool {
        !self.stated.set.is_empty() || self.misses_little()
    }
    /// Replaces the priors of the unknowns that `stated` shares with this set by this set's posterior from the balances.
    /// `looser`: times as far as usual it may be off.
    pub(super) fn believe(&self, stated: &mut PosedSet, looser: f64) {
        let shared: Vec<(usize, usize)> =
            (stated.unknowns.iter().enumerate()).filter_map(|(k, u)| Some((k, self.place_of(u)?))).collect();
        // Of those that are shared alone: the others take what they will.
        let Some(all) = self.information.clone().cholesky().map(|c| c.inverse()) else { return };
        let n = shared.len();
        let own = DMatrix::from_fn(n, n, |i, j| all[(shared[i].1, shared[j].1)]);
        let Some(rows) = own.cholesky().and_then(|c| c.l().try_inverse()) else { return };
        let further = looser * FURTHER * (1.0 + FURTHER_BY_FORM * self.excess().max(0.0)).sqrt();
        shared.iter().for_each(|(k, _)| stated.unknowns[*k].prior = None);
        stated.belief = Some(Belief {
            of: shared.iter().map(|s| s.0).collect(),
            at: shared.iter().map(|s| self.theta[s.1]).collect(),
            rows: rows / further,
        });
    }
}

impl CaseSearch<'_> {
    /// What is not known of a recording before it is simulated: first states, and offsets where declared so.
    pub fn first_states(
        &self,
        (model, nominal): (&EngineModel, &[f64]),
        run: &Compared,
        index: usize,
        which: impl Fn(usize) -> bool,
    ) -> Vec<BalanceUnknown> {
        let named = self.case.subject.parameters(model);
        let old = self.case.subject.parameters(&self.case.model);
        let mut all = Vec::new();
        let coordinates = self.case.subject.coordinates(model, nominal);
        for (_, c) in coordinates.iter().enumerate().filter(|c| which(c.0)) {
            let Some(start) = c.start else { continue };
            // Deviation of a reading, time between two, and how far and how fast it goes.
            let seen = run.run.channels.iter().find_map(|ch| {
                let f = c.positions.iter().find(|p| p.0 == ch.output)?.1;
                let h = ch.t.get(1).map_or(0.01, |t| t - ch.t[0]);
                let apart = (0.05 / h).ceil().max(1.0);
                let moved = ch.y.windows(apart as usize + 1).map(|w| (w[apart as usize] - w[0]).abs());
                let fastest = moved.fold(0.0, f64::max) / (apart * h);
                Some((ch.sigma / f, h, self.sizes.range(ch.output) / f, fastest / f))
            });
            for (k, at) in start.into_iter().enumerate() {
                let Some(name) = named.get(at).map(|n| n.name.clone()) else { continue };
                let known = old.iter().position(|n| n.name == name);
                let value = run.known.iter().find(|(i, _)| Some(*i) == known).map_or(0.0, |k| k.1);
                // What a few dozen readings give, or a wrong model of what they show; no sensor measures it: as far as its
                // spring lets it go, or as much as may be.
                let spring = c.spring.map(|(site, moves)| {
                    let deflection = moves.abs() * self.sizes.get(site, Measure::Deflection);
                    [deflection, deflection * self.sizes.get(site, Measure::Mode)]
                });
                let doubt = match (seen, k) {
                    (Some((s, _, range, _)), 0) => (5.0 * s).max(UNSURE * range.abs()),
                    (Some((s, h, _, speed)), _) => (10.0 * s / (8.0 * h).max(0.05)).max(UNSURE * speed.abs()),
                    (None, _) if spring.is_some() => spring.map_or(0.0, |s| s[k]),
                    (None, 0) => 0.05 * self.typical(c.positions.first().map(|p| p.0)),
                    (None, _) => 0.1 * self.typical(c.positions.first().map(|p| p.0)),
                };
                let doubt = doubt.max(1e-12);
                let drifting_starts = seen
                    .is_none()
                    .then(|| self.drifting_starts.get(&(run.run.name.clone(), name.clone())))
                    .flatten();
                all.push(BalanceUnknown {
                    name,
                    unit: String::new(),
                    target: BalanceTarget::Parameter(at),
                    run: Some(index),
                    start: drifting_starts.copied().unwrap_or(value),
                    scale: Scale::Linear(doubt),
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                    prior: Some(UnknownPrior::normal(value / doubt, 3.0)),
                });
            }
        }
        all
    }

    fn typical(&self, output: Option<usize>) -> f64 {
        output.map_or(1.0, |o| self.sizes.range(o))
    }

    /// Fits a set once more, free-running, from the estimate that the recordings gave: first states alone, then everything.
    pub fn polish(&self, from: &FittedSet, iterations: usize) -> FreeRunFit {
        let before = CompleteModel { stated: from.stated.clone(), theta: from.theta.clone() };
        let key = (ModelKey::of(&before), from.information.clone(), iterations);
        let make = || Ok::<_, Infallible>(self.polish_from(before, from, iterations));
        match self.memory.get_or(key, make) {
            Ok(fit) => fit,
            Err(never) => match never {},
        }
    }

    fn polish_from(&self, before: CompleteModel, from: &FittedSet, iterations: usize) -> FreeRunFit {
        let train = &self.case.train;
        let Ok(fitted_replay) = self.fitted_replay(&before, train) else {
            return FreeRunFit { complete: before, misfit: f64::INFINITY, fitted: None };
        };
        let shown: ReplayedReadings = fitted_replay.iter().map(|s| s.shown.clone()).collect();
        let misfit = self.misfit(&shown, train);
        // Where a motion bifurcates (a stop before or behind a tooth) nothing is to be learnt: every recording counts by what
        // it misses itself.
        let allowed = shown.iter().zip(train).map(|(shown, run)| self.allowed(shown, run));
        let Ok(stated) = self.state_like(&from.stated.set, Some(allowed.collect())) else {
            return FreeRunFit { complete: before, misfit, fitted: None };
        };
        let mut start = self.begin_with(&stated, from);
        for (x, u) in start.iter_mut().zip(&stated.unknowns) {
            let of = u.run.and_then(|run| fitted_replay[run].first.iter().find(|f| f.0 == u.name));
            if let Some((_, there)) = of {
                *x = *there;
            }
        }
        let claims = !from.stated.set.is_empty();
        let known = from.is_unbiased();
        let held = |looser: f64| {
            let mut stated = stated.clone();
            if known {
                from.believe(&mut stated, looser);
            }
            stated
        };
        let found = self.polished(held(1.0), &start, iterations).filter(|f| f.misfit <= misfit);
        let Some(found) = found else {
            return FreeRunFit { complete: before, misfit, fitted: self.standing(held(1.0), start) };
        };
        if !claims || found.misfit < NEAR * geometric_mean(train.iter().map(|run| self.noise(run))) {
            return found;
        }
        // Balances with less weight have to make it far better.
        let theta = found.fitted.as_ref().map_or(&start, |f| &f.theta);
        let loose = self.polished(held(LOOSE), theta, iterations);
        loose.filter(|f| f.misfit < FAR_BETTER * found.misfit).unwrap_or(found)
    }

    /// Fits a free-running set from `start`.
    pub fn polished(&self, stated: PosedSet, start: &[f64], iterations: usize) -> Option<FreeRunFit> {
        let options = SolverOptions {
            max_iterations: iterations,
            cost_tolerance: 1e-3,
            radius: 1.0,
            ..SolverOptions::default()
        };
        let fitted = self.fit(stated, start, options).ok()?;
        let train = &self.case.train;
        let stated = self.state(&fitted.stated.set).ok()?;
        let theta = self.begin_with(&stated, &fitted);
        let problem = self.compare(&fitted.stated);
        let shown: Result<ReplayedReadings, PredictError> =
            parallel::map(0..train.len(), |run| problem.shown(run, &fitted.theta)).into_iter().collect();
        let misfit = self.misfit(&shown.ok()?, train);
        Some(FreeRunFit { complete: CompleteModel { stated, theta }, misfit, fitted: Some(fitted) })
    }

    /// Deviations that a model is allowed in addition to those of the readings, by output: what it misses of a recording beyond
    /// their noise, as the same share of each output's range. It lasts, so that only so many readings of a channel are
    /// independent; a model that misses nothing is judged by the noise alone.
    fn allowed(&self, shown: &[Vec<f64>], run: &Compared) -> Vec<f64> {
        let beyond = run.run.channels.iter().zip(shown).map(|(channel, shown)| {
            let n = channel.y.len().max(1) as f64;
            let noise = self.noise_of(channel) * (1.0 + CHANCE * (2.0 / n).sqrt());
            (self.mean_square(channel, shown) - noise).max(0.0)
        });
        let missed: f64 = beyond.sum();
        let channels = run.run.channels.len().max(1) as f64;
        let share = (missed / channels * (run.len() as f64 / channels / INDEPENDENT).max(1.0)).sqrt();
        (0..self.case.model.sizes().outputs).map(|o| share * self.sizes.range(o)).collect()
    }

    /// Mean square of a channel's errors in units of its output's range.
    pub fn mean_square(&self, channel: &OutputChannel, shown: &[f64]) -> f64 {
        let range = self.sizes.range(channel.output).max(1e-300);
        let squares = channel.y.iter().zip(shown).map(|(y, s)| ((s - y) / range).powi(2)).sum::<f64>();
        squares / channel.y.len().max(1) as f64
    }

    /// Mean square of a deviation in the same unit.
    pub fn power(&self, channel: &OutputChannel, deviation: f64) -> f64 {
        (deviation / self.sizes.range(channel.output).max(1e-300)).powi(2)
    }

    /// What its sensor's noise leaves of it.
    fn noise_of(&self, channel: &OutputChannel) -> f64 {
        self.power(channel, channel.sigma)
    }

    /// What the sensors' noise leaves of it over the channels of a recording.
    pub fn noise(&self, run: &Compared) -> f64 {
        run.run.channels.iter().map(|c| self.noise_of(c)).sum()
    }

    /// Its sum over the channels of a recording.
    fn missed(&self, shown: &[Vec<f64>], run: &Compared) -> f64 {
        run.run.channels.iter().zip(shown).map(|(channel, shown)| self.mean_square(channel, shown)).sum()
    }

    /// The same of several: their geometric mean, so that one in which a motion bifurcates does not outweigh the others.
    pub fn misfit(&self, replayed: &ReplayedReadings, runs: &[Compared]) -> f64 {
        geometric_mean(runs.iter().zip(replayed).map(|(run, shown)| self.missed(shown, run)))
    }

    /// Standard deviation that noise alone leaves in each channel of each recording: that of the sensor, and that of the
    /// measured inputs carried through the simulation.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn floors(
        &self,
        complete: &CompleteModel,
        runs: &[Compared],
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let make = || {
            let laws = KeptLaws::default();
            self.floors_around(&laws, complete, runs, &self.fitted_replay(complete, runs)?, (seed, DRAWS))
        };
        match self.part_of(runs) {
            Some(part) => self.memory.get_or((ModelKey::of(complete), part, seed), make),
            None => make(),
        }
    }

    /// Whether recordings are those for fitting or those held out; `None`: neither, they may be gone when others are computed.
    fn part_of(&self, runs: &[Compared]) -> Option<usize> {
        [&self.case.train, &self.case.holdout].iter().position(|own| std::ptr::eq(&own[..], runs))
    }

    /// The same around recordings that are determined already; noise is drawn so often from this seed.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub(super) fn floors_around(
        &self,
        laws: &KeptLaws,
        complete: &CompleteModel,
        runs: &[Compared],
        fitted_replay: &[FittedReplay],
        (seed, draws): (u64, u32),
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let floors = |(run, fitted_replay): (&Compared, &FittedReplay)| {
            let inputs: Vec<Vec<f64>> = run.run.drives.iter().map(|d| d.u.clone()).collect();
            let noise: Vec<[f64; 2]> =
                run.run.drives.iter().map(|d| self.case.input_noise_of(d.input)).collect();
            let options = SolverOptions {
                max_iterations: 4,
                cost_tolerance: 0.01,
                radius: 10.0,
                ..SolverOptions::default()
            };
            let carried = crate::floor::carried(&inputs, &noise, draws as usize, seed, |inputs| {
                let mut noisy = run.run.clone();
                noisy.drives.iter_mut().zip(inputs).for_each(|(d, u)| d.u.clone_from(u));
                let noisy = Compared::new(noisy, run.known.clone(), complete.stated.model.sizes().inputs);
                let problem = BalanceProblem {
                    allowed: fitted_replay.allowed.clone(),
                    laws: Some(laws),
                    ..self.alone(complete, &noisy)
                };
                // Part of the noise goes into the first states.
                let runs = RememberedRuns::default();
                let theta = runs.minimum(&problem, &fitted_replay.theta, options);
                runs.shown(&problem, &theta.unwrap_or_else(|_| fitted_replay.theta.clone()), false)
            })?;
            Ok(run.run.channels.iter().zip(carried).map(|(c, carried)| c.sigma.hypot(carried)).collect())
        };
        parallel::map(runs.iter().zip(fitted_replay), floors).into_iter().collect()
    }
}

fn geometric_mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = values.len().max(1) as f64;
    (values.map(|v| v.max(f64::MIN_POSITIVE).ln()).sum::<f64>() / n).exp()
}
