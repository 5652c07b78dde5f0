//! Free runs over windows of a recording: the model begins again every few periods of its slowest mode. A run of a whole
//! recording through stick and slip is not followed even by the true model; these are.

use core::f64::consts::TAU;
use core::ops::Range;

use trueup_identification::parallel;
use trueup_identification::predict::{KeptLaws, PredictError};
use trueup_identification::run::IdentificationRun;
use trueup_models::effect::Measure;

use super::remembered::RememberedRuns;
use super::settle::nearer;
use super::{CompleteModel, FittedReplay, ModelKey, NEAR, ReplayedReadings};
use crate::engine::coordinate::median_step;
use crate::engine::problem::{BalanceProblem, BalanceTarget, Compared};
use crate::engine::recordings::first_states;
use crate::engine::search::CaseSearch;

/// Length of a window without a slowest mode, s.
const LENGTH: f64 = 1.0;
/// Periods of the slowest mode in a window.
const PERIODS: f64 = 3.0;
/// Readings of every channel that a window has at least.
const READINGS: f64 = 20.0;

/// Readings before a window by which it is found where it begins.
const BEFORE: f64 = 4.0;
/// Factor on the prior standard deviation of first states of a window, compared with that of a recording: they are found
/// in the midst of a motion.
const VAGUELY: f64 = 1e3;

/// A window of a recording, run from first states of its own.
#[derive(Clone, Debug)]
pub struct Window {
    /// Which of the recordings it is of.
    pub of: usize,
    /// Its readings and inputs.
    run: Compared,
    fitted_replay: FittedReplay,
}

impl Window {
    /// Mean square of what it misses of each channel that is read in it, in the channels' units.
    pub fn missed(&self) -> impl Iterator<Item = f64> {
        self.missed_by_channel().map(|(_, missed)| missed)
    }

    /// The same with the channels' indices.
    pub fn missed_by_channel(&self) -> impl Iterator<Item = (usize, f64)> {
        let channels = self.run.run.channels.iter().zip(&self.fitted_replay.shown).enumerate();
        channels.filter(|(_, (c, _))| !c.y.is_empty()).map(|(k, (c, shown))| {
            let squares = c.y.iter().zip(shown).map(|(y, s)| (s - y).powi(2)).sum::<f64>();
            (k, squares / c.y.len() as f64)
        })
    }
}

fn last(run: &Compared) -> f64 {
    run.run.channels.iter().filter_map(|c| c.t.last()).fold(run.run.start, |a, t| a.max(*t))
}

impl CaseSearch<'_> {
    /// Length of the windows of a case, s: periods of the slowest spring of the nominal model (without one a
    /// second), so that every channel has readings. `None`: no recording holds two.
    pub fn window(&self) -> Option<f64> {
        let all = || self.case.train.iter().chain(&self.case.holdout);
        let flexible = self.case.subject.flexible.iter().enumerate().filter(|(_, spring)| **spring);
        let slowest = flexible.map(|(site, _)| self.sizes.get(site, Measure::Mode)).reduce(f64::min);
        let steps = all().flat_map(|r| &r.run.channels).filter_map(|c| median_step(&c.t));
        let least = READINGS * steps.fold(0.0, f64::max);
        let seconds = slowest.map_or(LENGTH, |mode| PERIODS * TAU / mode).max(least);
        all().any(|r| last(r) - r.run.start >= 2.0 * seconds).then_some(seconds)
    }

    /// A model through windows of recordings, first states of each estimated from its readings. `fitted_replay`: how the whole
    /// recordings ran, where causes go on from one window to the next.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn in_windows(
        &self,
        complete: &CompleteModel,
        runs: &[Compared],
        seconds: f64,
        fitted_replay: Option<&[FittedReplay]>,
    ) -> Result<Vec<Window>, PredictError> {
        let make = || self.windows_of(complete, runs, seconds, fitted_replay);
        // Where no cause goes on from one window to the next it does not matter how the whole ran.
        let alone = fitted_replay.is_none() || complete.stated.posed.iter().all(|p| p.initial.is_empty());
        match self.part_of(runs).filter(|_| alone) {
            Some(part) => self.memory.get_or((ModelKey::of(complete), part, seconds), make),
            None => make(),
        }
    }

    fn windows_of(
        &self,
        complete: &CompleteModel,
        runs: &[Compared],
        seconds: f64,
        fitted_replay: Option<&[FittedReplay]>,
    ) -> Result<Vec<Window>, PredictError> {
        let cut = |(of, run): (usize, &Compared)| {
            self.cut_into(complete, run, seconds).into_iter().map(move |window| (of, window))
        };
        let all: Vec<(usize, Compared)> = runs.iter().enumerate().flat_map(cut).collect();
        let laws = KeptLaws::default();
        let one = |(of, run): (usize, Compared)| {
            let mut problem = BalanceProblem { laws: Some(&laws), ..self.alone(complete, &run) };
            hold_first(complete, &mut problem, fitted_replay.map(|s| &s[of]));
            for prior in problem.unknowns.iter_mut().filter_map(|u| u.prior.as_mut()) {
                prior.deviation *= VAGUELY;
            }
            let (start, runs) = (problem.start(), RememberedRuns::default());
            let mut best = self.settle_from((&mut problem, &runs), start, &run);
            // It may end away from the best where something sticks or goes through play.
            if best.as_ref().is_ok_and(|b| b.0 >= NEAR * self.noise(&run))
                && let Ok(start) = self.grown(&problem, &run)
            {
                best = nearer(best, self.settle_from((&mut problem, &runs), start, &run));
            }
            let fitted_replay = best?.1;
            Ok(Window { of, fitted_replay, run: run.clone() })
        };
        parallel::map(all, one).into_iter().collect()
    }

    /// A recording in windows. A window of a model with late readings begins earlier by as much.
    fn cut_into(&self, complete: &CompleteModel, run: &Compared, seconds: f64) -> Vec<Compared> {
        let span = last(run) - run.run.start;
        let count = (span / seconds).round().max(1.0) as u32;
        let unknowns = complete.stated.unknowns.iter().zip(&complete.theta);
        let late = unknowns.filter(|(u, _)| {
            matches!(u.target, BalanceTarget::SensorDelay(_) | BalanceTarget::TotalSensorDelay(_))
        });
        let late = late.map(|(u, x)| u.scale.value(*x).0).fold(0.0, f64::max);
        let late = run.run.channels.iter().map(|c| c.delay).fold(0.0, f64::max) + late;
        let steps = run.run.channels.iter().filter_map(|c| median_step(&c.t));
        let before = BEFORE * steps.fold(0.0, f64::max);
        let edge = |k: u32| if k < count { run.run.start + f64::from(k) * seconds } else { f64::INFINITY };
        let window = |k: u32| {
            let mut own = part(&run.run, edge(k)..edge(k + 1));
            if k == 0 {
                return Compared::new(own, run.known.clone(), self.case.model.sizes().inputs);
            }
            own.start = (own.start - late).max(run.run.start);
            // What acts late or lags may come from as long before as a window lasts.
            for d in &mut own.drives {
                let from = d.t.partition_point(|t| *t < edge(k) - seconds).saturating_sub(1);
                let to = (d.t.partition_point(|t| *t < edge(k + 1) + seconds) + 1).min(d.t.len());
                (d.t, d.u) = (d.t[from..to].to_vec(), d.u[from..to].to_vec());
            }
            // Readings on both sides of where it begins show how fast it moves there.
            let about = part(&run.run, (own.start - before).max(run.run.start)..edge(k + 1));
            let about = IdentificationRun { start: own.start, ..about };
            let case = self.case;
            let known = first_states(&case.subject, &case.model, &case.nominal, &case.coordinates, &about);
            Compared::new(own, known, case.model.sizes().inputs)
        };
        (0..count).map(window).filter(|w| !w.is_empty()).collect()
    }

    /// Standard deviation that noise alone leaves in windows, by recording and channel.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn window_floors(
        &self,
        complete: &CompleteModel,
        windows: &[Window],
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        let laws = KeptLaws::default();
        let one = |(k, w): (usize, &Window)| {
            let (runs, fitted_replay) =
                (std::slice::from_ref(&w.run), std::slice::from_ref(&w.fitted_replay));
            // There are many windows: noise is drawn once in each.
            let found =
                self.floors_around(&laws, complete, runs, fitted_replay, (seed.wrapping_add(k as u64), 1))?;
            Ok(found.into_iter().next().unwrap_or_default())
        };
        let found: Result<Vec<Vec<f64>>, PredictError> =
            parallel::map(windows.iter().enumerate(), one).into_iter().collect();
        let mut sums: Vec<Vec<[f64; 2]>> = Vec::new();
        for (w, floors) in windows.iter().zip(found?) {
            sums.resize(sums.len().max(w.of + 1), Vec::new());
            let own = &mut sums[w.of];
            own.resize(floors.len(), [0.0; 2]);
            for ((sum, floor), channel) in own.iter_mut().zip(floors).zip(&w.run.run.channels) {
                let n = channel.t.len() as f64;
                *sum = [sum[0] + n * floor * floor, sum[1] + n];
            }
        }
        let root = |own: Vec<[f64; 2]>| own.iter().map(|s| (s[0] / s[1].max(1.0)).sqrt()).collect();
        Ok(sums.into_iter().map(root).collect())
    }
}

/// The readings of a recording within these times, with its inputs and its name; it begins where they do.
fn part(whole: &IdentificationRun, within: Range<f64>) -> IdentificationRun {
    let first = whole.start == within.start;
    let mut run = IdentificationRun { start: within.start, at_rest: whole.at_rest && first, ..whole.clone() };
    for c in &mut run.channels {
        let kept = c.t.partition_point(|t| *t < within.start)..c.t.partition_point(|t| *t < within.end);
        c.t = c.t[kept.clone()].to_vec();
        c.y = c.y[kept.clone()].to_vec();
        c.spread = c.spread.get(kept).unwrap_or_default().to_vec();
    }
    run
}

/// First states of causes belong to the whole recording, whose time windows keep.
fn hold_first(
    complete: &CompleteModel,
    problem: &mut BalanceProblem<'_>,
    fitted_replay: Option<&FittedReplay>,
) {
    let stated = &complete.stated;
    let own = stated.posed.iter().zip(&stated.begin);
    let own = own.flat_map(|(p, begin)| p.initial.iter().map(move |k| begin + k));
    let names: Vec<&str> = own.map(|k| &*stated.unknowns[k].name).collect();
    for u in problem.unknowns.iter_mut().filter(|u| names.contains(&&*u.name)) {
        let first = fitted_replay.and_then(|s| s.first.iter().find(|f| f.0 == u.name));
        let first = first.map_or(u.start, |f| u.scale.value(f.1).0);
        (u.start, u.lower, u.upper, u.prior) = (first, first, first, None);
    }
}

/// What windows show, one after the other, as of whole recordings.
pub fn joined(windows: &[Window]) -> ReplayedReadings {
    let mut all: ReplayedReadings = Vec::new();
    for w in windows {
        all.resize(all.len().max(w.of + 1), Vec::new());
        let own = &mut all[w.of];
        own.resize(own.len().max(w.fitted_replay.shown.len()), Vec::new());
        own.iter_mut().zip(&w.fitted_replay.shown).for_each(|(all, shown)| all.extend(shown));
    }
    all
}
