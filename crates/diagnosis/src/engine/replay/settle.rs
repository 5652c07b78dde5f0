//! Where a recording begins: first states, and offsets where declared so, by the smallest gap of a free run.

use std::collections::BTreeMap;

use trueup_identification::lsq::{SolverOptions, minimise};
use trueup_identification::parallel;
use trueup_identification::predict::{KeptLaws, PredictError};

use super::remembered::RememberedRuns;
use super::{CompleteModel, FittedReplay, ModelKey, NEAR, ReplayedReadings};
use crate::engine::hypothesis::PosedHypothesis;
use crate::engine::problem::{BalanceProblem, BalanceTarget, BalanceUnknown, Compared};
use crate::engine::search::CaseSearch;

/// Times what is missed at most that all channels may miss, so that the noise of some does not outweigh others.
const EVENLY: f64 = 3.0;
/// Factor on a first state's prior standard deviation where the gap determines it.
const VAGUELY: f64 = 10.0;
/// Shares of a recording from which its first state is found, where all of it at once does not determine it.
const GROWING: [f64; 3] = [0.1, 0.25, 0.5];

/// Whichever misses less.
pub(super) fn nearer(
    one: Result<(f64, FittedReplay), PredictError>,
    other: Result<(f64, FittedReplay), PredictError>,
) -> Result<(f64, FittedReplay), PredictError> {
    match (one, other) {
        (Ok(one), Ok(other)) => Ok(if other.0 < one.0 { other } else { one }),
        (one, other) => one.or(other),
    }
}

impl CompleteModel {
    /// The states of its causes when a recording begins, as unknowns of that recording alone: of one for fitting from where its
    /// fit has them, of others from where the last of those has them.
    fn initial(&self, own: Option<usize>) -> Vec<BalanceUnknown> {
        let s = &self.stated;
        let of_cause = |(posed, begin): (&PosedHypothesis, &usize)| {
            posed.initial.iter().map(|k| begin + k).collect::<Vec<_>>()
        };
        let mut all: BTreeMap<&str, BalanceUnknown> = BTreeMap::new();
        for k in s.posed.iter().zip(&s.begin).flat_map(of_cause) {
            let u = &s.unknowns[k];
            if own.is_none_or(|own| u.run == Some(own)) {
                let start = u.scale.value(self.theta[k]).0;
                all.insert(&u.name, BalanceUnknown { run: Some(0), start, ..u.clone() });
            }
        }
        all.into_values().collect()
    }
}

impl CaseSearch<'_> {
    /// Simulates recordings freely, first states and declared offsets estimated again.
    ///
    /// # Errors
    /// The model cannot be simulated.
    pub fn fitted_replay(
        &self,
        complete: &CompleteModel,
        runs: &[Compared],
    ) -> Result<Vec<FittedReplay>, PredictError> {
        parallel::map(runs, |run| self.settle(complete, run)).into_iter().collect()
    }

    /// What they show then.
    ///
    /// # Errors
    /// See [`Self::fitted_replay`].
    pub fn replay(
        &self,
        complete: &CompleteModel,
        runs: &[Compared],
    ) -> Result<ReplayedReadings, PredictError> {
        Ok(self.fitted_replay(complete, runs)?.into_iter().map(|s| s.shown).collect())
    }

    /// What is unknown of one recording once everything else is set.
    pub(crate) fn alone<'b>(&self, complete: &'b CompleteModel, run: &'b Compared) -> BalanceProblem<'b> {
        let stated = &complete.stated;
        // Parameters of the whole are set; what shifts signals stays an unknown that is held.
        let train = &self.case.train;
        let whole = BalanceProblem {
            ties: stated.ties.clone(),
            unknowns: stated.unknowns.clone(),
            ..BalanceProblem::free(&stated.model, stated.nominal.clone(), train)
        };
        // What acts in one recording for fitting only does not act in those held out.
        let own = train.iter().position(|t| t.run.name == run.run.name);
        let nominal = whole.parameters(own.unwrap_or(usize::MAX), &complete.theta);
        let mut unknowns = self.first_states((&stated.model, &nominal), run, 0, |_| true);
        unknowns.extend(complete.initial(own));
        for (u, x) in stated.unknowns.iter().zip(&complete.theta).filter(|(u, _)| u.run.is_none()) {
            let value = u.scale.value(*x).0;
            if u.target.shifts() || u.target.is_of_sensor() {
                unknowns.push(BalanceUnknown {
                    start: value,
                    lower: value,
                    upper: value,
                    prior: None,
                    ..u.clone()
                });
            }
        }
        for output in &self.case.offsets {
            if let Some(c) = run.run.channels.iter().find(|c| c.output == *output) {
                unknowns.push(self.offset(c, 0));
            }
        }
        BalanceProblem { unknowns, ..BalanceProblem::free(&stated.model, nominal, std::slice::from_ref(run)) }
    }

    /// Lets a recording begin where it runs freely with the smallest gap: a wrong model's readings do not determine by their
    /// noise where the motion began, and a replay is judged by the gap.
    fn settle(&self, complete: &CompleteModel, run: &Compared) -> Result<FittedReplay, PredictError> {
        // Other recordings may be gone when the next ones are computed.
        let own = self.case.train.iter().chain(&self.case.holdout).position(|own| std::ptr::eq(own, run));
        let Some(at) = own else { return self.settle_anew(complete, run) };
        self.memory.get_or((ModelKey::of(complete), at), || self.settle_anew(complete, run))
    }

    fn settle_anew(&self, complete: &CompleteModel, run: &Compared) -> Result<FittedReplay, PredictError> {
        let laws = KeptLaws::default();
        let mut problem = BalanceProblem { laws: Some(&laws), ..self.alone(complete, run) };
        // The smallest gap, whatever the prior; what nothing shows still stays near.
        for prior in problem.unknowns.iter_mut().filter_map(|u| u.prior.as_mut()) {
            prior.deviation *= VAGUELY;
        }
        let (start, runs) = (problem.start(), RememberedRuns::default());
        let mut best = self.settle_from((&mut problem, &runs), start, run);
        if let Some(start) = self.begun(&problem, run) {
            best = nearer(best, self.settle_from((&mut problem, &runs), start, run));
        }
        let far = |missed: f64| missed >= NEAR * self.noise(run);
        if let Ok((missed, there)) = &best
            && far(*missed)
            && let Some(start) = self.turned(&problem, run, &there.theta)
        {
            best = nearer(best, self.settle_from((&mut problem, &runs), start, run));
        }
        // Stops and slips far along the way hide where it began.
        if let Ok((missed, _)) = &best
            && far(*missed)
            && let Ok(start) = self.grown(&problem, run)
            // It is worth a fit where it is not far worse as it is.
            && runs.shown(&problem, &start, true).is_ok_and(|shown| self.missed(&shown, run) < NEAR * *missed)
        {
            best = nearer(best, self.settle_from((&mut problem, &runs), start, run));
        }
        Ok(best?.1)
    }

    /// Where a recording begins by its first readings, then by more and more of them.
    pub(super) fn grown(
        &self,
        problem: &BalanceProblem<'_>,
        run: &Compared,
    ) -> Result<Vec<f64>, PredictError> {
        let mut theta = problem.start();
        for share in GROWING {
            let part = run.until(share, problem.model.sizes().inputs);
            let mut begun = BalanceProblem {
                unknowns: problem.unknowns.clone(),
                laws: problem.laws,
                ..BalanceProblem::free(problem.model, problem.nominal.clone(), std::slice::from_ref(&part))
            };
            theta = self.evenly((&mut begun, &RememberedRuns::default()), theta, &part, (6, 1e-3))?;
        }
        Ok(theta)
    }

    /// Solves from `start`, all channels allowed to miss as much as they do together.
    fn evenly(
        &self,
        (problem, runs): (&mut BalanceProblem<'_>, &RememberedRuns),
        start: Vec<f64>,
        run: &Compared,
        (max_iterations, cost_tolerance): (usize, f64),
    ) -> Result<Vec<f64>, PredictError> {
        let missed =
            self.missed(&runs.shown(problem, &start, true)?, run) / run.run.channels.len().max(1) as f64;
        let noise = run.run.channels.iter().map(|c| self.noise_of(c)).fold(0.0, f64::max);
        let share = EVENLY * (missed + noise).sqrt();
        let ranges = (0..self.case.model.sizes().outputs).map(|o| share * self.sizes.range(o));
        problem.allowed = vec![ranges.collect()];
        let options =
            SolverOptions { max_iterations, cost_tolerance, radius: 10.0, ..SolverOptions::default() };
        runs.minimum(problem, &start, options)
    }

    /// The same from one start, and what it misses.
    pub(super) fn settle_from(
        &self,
        (problem, runs): (&mut BalanceProblem<'_>, &RememberedRuns),
        start: Vec<f64>,
        run: &Compared,
    ) -> Result<(f64, FittedReplay), PredictError> {
        let mut theta = start;
        for limits in [(3, 3e-3), (8, 1e-4)] {
            theta = self.evenly((problem, runs), theta, run, limits)?;
        }
        let shown = runs.shown(problem, &theta, false)?;
        let missed = self.missed(&shown, run);
        let first = problem.unknowns.iter().map(|u| u.name.clone()).zip(theta.iter().copied()).collect();
        let offset = |(u, x): (&BalanceUnknown, &f64)| match u.target {
            BalanceTarget::Offset(output) => Some((output, u.scale.value(*x).0)),
            _ => None,
        };
        let offsets = problem.unknowns.iter().zip(&theta).filter_map(offset).collect();
        let parameters = problem.parameters(0, &theta);
        let allowed = problem.allowed.clone();
        Ok((missed, FittedReplay { shown, parameters, offsets, theta, first, allowed }))
    }

    /// Where what a recording does not show begins when it prescribes what it shows: a free run may end elsewhere (of a satellite that
    /// no sensor shows). `None`: it shows everything.
    fn begun(&self, problem: &BalanceProblem<'_>, run: &Compared) -> Option<Vec<f64>> {
        let prescribed = self.prescribed.iter().find(|prescribed| prescribed.name == run.run.name)?;
        let coordinates = self.case.subject.coordinates(problem.model, &problem.nominal);
        let links = prescribed.links(problem.model, &coordinates);
        links.unprescribed().next()?;
        let prescribed = BalanceProblem {
            prescribed: vec![(prescribed, links)],
            unknowns: problem.unknowns.clone(),
            ..BalanceProblem::free(problem.model, problem.nominal.clone(), problem.runs)
        };
        let from = |start: &[f64]| {
            let options = SolverOptions {
                max_iterations: 10,
                cost_tolerance: 1e-4,
                radius: 10.0,
                ..SolverOptions::default()
            };
            minimise(&prescribed, start, options).ok()
        };
        let best = from(&prescribed.start())?;
        let other = self.turned(problem, run, &best.0).and_then(|start| from(&start));
        Some(other.filter(|other| other.1 < best.1).unwrap_or(best).0)
    }

    /// The same first states, what no sensor shows and nothing holds turning the other way: its rate enters by its square above all,
    /// so that a fit that has its sign wrong stays there. `None`: all is seen or held.
    fn turned(&self, problem: &BalanceProblem<'_>, run: &Compared, theta: &[f64]) -> Option<Vec<f64>> {
        let prescribed = self.prescribed.iter().find(|prescribed| prescribed.name == run.run.name)?;
        let coordinates = self.case.subject.coordinates(problem.model, &problem.nominal);
        let unprescribed: Vec<usize> = prescribed.links(problem.model, &coordinates).unprescribed().collect();
        let drifting_starts = unprescribed.iter().map(|c| &coordinates[*c]).filter(|c| c.spring.is_none());
        let rates: Vec<usize> = drifting_starts.filter_map(|c| Some(c.start?[1])).collect();
        let turns =
            |u: &BalanceUnknown| matches!(u.target, BalanceTarget::Parameter(at) if rates.contains(&at));
        let mut start = theta.to_vec();
        for (x, u) in start.iter_mut().zip(&problem.unknowns).filter(|(_, u)| turns(u)) {
            *x = u.scale.coordinate(-u.scale.value(*x).0);
        }
        (start != theta).then_some(start)
    }

    /// The first states of what drifts in each recording by the model as it is: by recording and state.
    pub(in crate::engine) fn drifting_starts(&self) -> BTreeMap<(String, String), f64> {
        let Ok(stated) = self.state(&[]) else { return BTreeMap::new() };
        let theta = stated.begin_with(&[]);
        let complete = CompleteModel { stated, theta };
        let runs = self.case.train.iter().chain(&self.case.holdout);
        let begun = |run: &Compared| {
            let problem = self.alone(&complete, run);
            self.turned(&problem, run, &vec![1.0; problem.unknowns.len()])?;
            let there = self.begun(&problem, run)?;
            let all = problem.unknowns.iter().zip(there);
            let value =
                |(u, x): (&BalanceUnknown, f64)| ((run.run.name.clone(), u.name.clone()), u.scale.value(x).0);
            Some(all.map(value).collect::<Vec<_>>())
        };
        runs.filter_map(begun).flatten().collect()
    }
}
