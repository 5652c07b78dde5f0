//! Free-running simulations: the last polish of a fit, and the gap on recordings that were never fitted.

use std::collections::BTreeMap;

use trueup_identification::lsq::{Options, solve};
use trueup_identification::predict::PredictError;
use trueup_identification::unknown::Scale;
use trueup_numerics::hybrid::Hybrid;

use super::problem::{Compared, Comparison, Target, Unknown};
use super::search::{Fitted, Search, Stated};
use super::subject::Model;

/// Free-running simulation of recordings: readings by recording, channel after channel.
pub type Replayed = Vec<Vec<Vec<f64>>>;

/// A model with everything set, ready to run freely.
#[derive(Clone, Debug)]
pub struct Complete {
    /// Set of causes and unknowns.
    pub stated: Stated,
    /// Coordinates of the unknowns.
    pub theta: Vec<f64>,
}

impl Search<'_> {
    /// What is not known of a recording before it is simulated: first states, and offsets where declared so.
    pub fn first_states(
        &self,
        model: &Model,
        run: &Compared,
        index: usize,
        which: impl Fn(usize) -> bool,
    ) -> Vec<Unknown> {
        let named = self.case.subject.parameters(model);
        let old = self.case.subject.parameters(&self.case.model);
        let mut all = Vec::new();
        for (_, c) in self.case.coordinates.iter().enumerate().filter(|c| which(c.0)) {
            let Some(start) = c.start else { continue };
            let sigma = run.run.channels.iter().find_map(|ch| {
                let f = c.positions.iter().find(|p| p.0 == ch.output)?.1;
                Some((ch.sigma / f, ch.t.get(1).map_or(0.01, |t| t - ch.t[0])))
            });
            for (k, at) in start.into_iter().enumerate() {
                let Some(name) = old.get(at).map(|n| n.name.clone()) else { continue };
                let Some(at) = named.iter().position(|n| n.name == name) else { continue };
                let value = run.known.iter().find(|(i, _)| *i == start[k]).map_or(0.0, |k| k.1);
                // What a few dozen readings give; nobody measures it: as much as it may be.
                let doubt = match (sigma, k) {
                    (Some((s, _)), 0) => 5.0 * s,
                    (Some((s, h)), _) => 10.0 * s / (8.0 * h).max(0.05),
                    (None, 0) => 0.05 * self.typical(c.positions.first().map(|p| p.0)),
                    (None, _) => 0.1 * self.typical(c.positions.first().map(|p| p.0)),
                };
                let doubt = doubt.max(1e-12);
                all.push(Unknown {
                    name,
                    unit: String::new(),
                    target: Target::Parameter(at),
                    run: Some(index),
                    start: value,
                    scale: Scale::Linear(doubt),
                    lower: f64::NEG_INFINITY,
                    upper: f64::INFINITY,
                    prior: Some((value / doubt, 3.0)),
                });
            }
        }
        all
    }

    fn typical(&self, output: Option<usize>) -> f64 {
        output.map_or(1.0, |o| self.sizes.range(o))
    }

    /// Fits a set once more, free-running, from where the recordings led it. The better of the two on the recordings for
    /// fitting is what comes back.
    pub fn polish(&self, from: &Fitted, iterations: usize) -> Complete {
        let before = Complete { stated: from.stated.clone(), theta: from.theta.clone() };
        let mut unknowns = from.stated.unknowns.clone();
        let own = unknowns.len();
        for (index, run) in self.case.train.iter().enumerate() {
            unknowns.extend(self.first_states(&from.stated.model, run, index, |_| true));
        }
        let problem = Comparison {
            model: &from.stated.model,
            nominal: from.stated.nominal.clone(),
            ties: from.stated.ties.clone(),
            runs: &self.case.train,
            led: Vec::new(),
            unknowns,
            held: BTreeMap::new(),
        };
        let mut start = problem.start();
        start[..own].copy_from_slice(&from.theta);
        let options =
            Options { max_iterations: iterations, cost_tolerance: 1e-3, radius: 1.0, ..Options::default() };
        let Ok(found) = solve(&problem, &start, options) else { return before };
        let after = Complete { stated: from.stated.clone(), theta: found.x[..own].to_vec() };
        let cost = |c: &Complete| {
            self.replay(c, &self.case.train).map_or(f64::INFINITY, |r| self.misfit(&r, &self.case.train))
        };
        if cost(&after) <= cost(&before) { after } else { before }
    }

    /// Sum of squares of relative errors, over channels.
    pub fn misfit(&self, replayed: &Replayed, runs: &[Compared]) -> f64 {
        let mut sum = 0.0;
        for (run, shown) in runs.iter().zip(replayed) {
            for (channel, shown) in run.run.channels.iter().zip(shown) {
                let range = self.sizes.range(channel.output).max(1e-300);
                let squares =
                    channel.y.iter().zip(shown).map(|(y, s)| ((s - y) / range).powi(2)).sum::<f64>();
                sum += squares / channel.y.len().max(1) as f64;
            }
        }
        sum
    }

    /// Simulates recordings freely, first states and declared offsets estimated anew.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn replay(&self, complete: &Complete, runs: &[Compared]) -> Result<Replayed, PredictError> {
        let stated = &complete.stated;
        // Parameters of the whole are set; what shifts signals stays an unknown that is held.
        let whole = Comparison {
            model: &stated.model,
            nominal: stated.nominal.clone(),
            ties: stated.ties.clone(),
            runs: &self.case.train,
            led: Vec::new(),
            unknowns: stated.unknowns.clone(),
            held: BTreeMap::new(),
        };
        runs.iter()
            .map(|run| {
                // What acts in one recording for fitting only does not act in those held out.
                let own = self.case.train.iter().position(|t| t.run.name == run.run.name);
                let nominal = whole.parameters(own.unwrap_or(usize::MAX), &complete.theta);
                let one = [run.clone()];
                let mut unknowns = self.first_states(&stated.model, run, 0, |_| true);
                for (u, x) in stated.unknowns.iter().zip(&complete.theta) {
                    let value = u.scale.value(*x).0;
                    let held = matches!(
                        u.target,
                        Target::SensorDelay(_)
                            | Target::InputDelay(_)
                            | Target::InputLag(_)
                            | Target::Offset(_)
                    ) && u.run.is_none();
                    if held {
                        let prior = None;
                        unknowns.push(Unknown {
                            start: value,
                            lower: value,
                            upper: value,
                            prior,
                            ..u.clone()
                        });
                    }
                }
                for output in &self.case.offsets {
                    if run.run.channels.iter().any(|c| c.output == *output) {
                        unknowns.push(super::search::offset(*output, 0, 0.1 * self.sizes.range(*output)));
                    }
                }
                let problem = Comparison {
                    model: &stated.model,
                    nominal,
                    ties: Vec::new(),
                    runs: &one,
                    led: Vec::new(),
                    unknowns,
                    held: BTreeMap::new(),
                };
                let start = problem.start();
                let options =
                    Options { max_iterations: 12, cost_tolerance: 1e-5, radius: 3.0, ..Options::default() };
                let theta = solve(&problem, &start, options).map_or(start, |found| found.x);
                let differences = problem.errors(0, &theta)?;
                let mut begin = 0;
                Ok(run
                    .run
                    .channels
                    .iter()
                    .map(|c| {
                        let shown =
                            differences[begin..][..c.y.len()].iter().zip(&c.y).map(|(d, y)| d + y).collect();
                        begin += c.y.len();
                        shown
                    })
                    .collect())
            })
            .collect()
    }

    /// Standard deviation that noise alone leaves in each channel of each recording: that of the sensor, and that of the
    /// measured inputs carried through the simulation.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn floors(
        &self,
        complete: &Complete,
        runs: &[Compared],
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, PredictError> {
        runs.iter()
            .map(|run| {
                let inputs: Vec<Vec<f64>> = run.run.drives.iter().map(|d| d.u.clone()).collect();
                let deviation: Vec<f64> = run
                    .run
                    .drives
                    .iter()
                    .map(|d| self.case.input_noise.get(d.input).copied().unwrap_or(0.0))
                    .collect();
                let carried = crate::floor::carried(&inputs, &deviation, 4, seed, |inputs| {
                    let mut noisy = run.run.clone();
                    noisy.drives.iter_mut().zip(inputs).for_each(|(d, u)| d.u.clone_from(u));
                    let one = [Compared::new(noisy, run.known.clone(), complete.stated.model.sizes().inputs)];
                    Ok(self.replay(complete, &one)?.swap_remove(0))
                })?;
                Ok(run.run.channels.iter().zip(carried).map(|(c, carried)| c.sigma.hypot(carried)).collect())
            })
            .collect()
    }
}
