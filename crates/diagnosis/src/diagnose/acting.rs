//! Recordings as the nominal model has them with each of their inputs, and without.

use std::borrow::Cow;

use trueup_identification::sensors::SensorSet;

use crate::engine::balance::{GriddedRecording, Links};
use crate::engine::problem::Compared;
use crate::engine::search::CaseSearch;

/// A recording with what the nominal model misses in it.
pub(super) struct Acting<'a> {
    pub prescribed: &'a GriddedRecording,
    run: &'a Compared,
    search: &'a CaseSearch<'a>,
    links: Links,
    /// Per channel simulated less measured, by instant.
    pub with: Vec<Vec<f64>>,
    /// The same without each input; `None`: it is not recorded.
    silent: Vec<Option<Vec<Vec<f64>>>>,
}

impl<'a> Acting<'a> {
    /// All recordings that the model can be compared with, those held out too: nothing is fitted.
    pub(super) fn all(search: &'a CaseSearch<'a>) -> Vec<Self> {
        let runs = search.case.train.iter().chain(&search.case.holdout);
        search
            .prescribed
            .iter()
            .zip(runs)
            .filter_map(|(prescribed, run)| Self::new(search, prescribed, run))
            .collect()
    }

    fn new(search: &'a CaseSearch<'a>, prescribed: &'a GriddedRecording, run: &'a Compared) -> Option<Self> {
        let links = prescribed.links(&search.case.model, &search.case.coordinates);
        let mut own = Self { prescribed, run, search, links, with: Vec::new(), silent: Vec::new() };
        own.with = own.missed(prescribed)?;
        own.silent = (0..prescribed.inputs.len()).map(|input| own.silenced(&[input])).collect();
        Some(own)
    }

    fn missed(&self, prescribed: &GriddedRecording) -> Option<Vec<Vec<f64>>> {
        let case = self.search.case;
        let sizes = case.model.sizes();
        let mut p = case.nominal.clone();
        self.run.known.iter().for_each(|(i, v)| p[*i] = *v);
        prescribed.missing(&case.model, &self.links, &p, &SensorSet::none(sizes.inputs, sizes.outputs)).ok()
    }

    /// What is missed without these inputs; `None`: one of them is not recorded.
    pub(super) fn without(&self, inputs: &[usize]) -> Option<Cow<'_, [Vec<f64>]>> {
        match inputs {
            [one] => self.silent.get(*one)?.as_deref().map(Cow::Borrowed),
            several => self.silenced(several).map(Cow::Owned),
        }
    }

    fn silenced(&self, inputs: &[usize]) -> Option<Vec<Vec<f64>>> {
        if inputs.iter().any(|i| self.prescribed.inputs[*i].is_empty()) {
            return None;
        }
        let mut silent = self.prescribed.clone();
        inputs.iter().for_each(|i| silent.inputs[*i].fill(0.0));
        self.missed(&silent)
    }

    /// Channels that are compared as accelerations.
    pub(super) fn accelerated(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.prescribed.channels.len()).filter(|c| self.prescribed.shows_acceleration(&self.links, *c))
    }

    /// The channel that shows an output, if it is compared as an acceleration.
    pub(super) fn showing(&self, output: usize) -> Option<usize> {
        self.accelerated().find(|at| self.prescribed.channels[*at].output == output)
    }

    /// Power of what accelerates a channel, over that of its measured acceleration.
    pub(super) fn share(&self, along: &[f64], at: usize) -> f64 {
        let square = |x: &[f64]| x[self.prescribed.counts.clone()].iter().map(|x| x * x).sum::<f64>();
        square(along) / square(&self.prescribed.channels[at].ddy).max(f64::MIN_POSITIVE)
    }

    /// What an input accelerates a channel by.
    pub(super) fn along(&self, input: usize, at: usize) -> Option<Vec<f64>> {
        let silent = self.silent.get(input)?.as_ref()?;
        Some(self.with[at].iter().zip(&silent[at]).map(|(a, b)| a - b).collect())
    }

    /// What all inputs together accelerate a channel by.
    pub(super) fn driven(&self, at: usize) -> Vec<f64> {
        let mut sum = vec![0.0; self.prescribed.t.len()];
        for input in 0..self.silent.len() {
            if let Some(along) = self.along(input, at) {
                sum.iter_mut().zip(along).for_each(|(s, a)| *s += a);
            }
        }
        sum
    }

    /// The output that an input accelerates most, compared with how it moves, over all recordings.
    pub(super) fn most_driven(all: &[Self], input: usize) -> Option<usize> {
        let share = |output: usize| -> f64 {
            let of = |a: &Self| {
                let at = a.showing(output)?;
                Some(a.share(&a.along(input, at)?, at))
            };
            all.iter().filter_map(of).sum()
        };
        let outputs = all.iter().flat_map(|a| a.accelerated().map(|at| a.prescribed.channels[at].output));
        let shares = outputs.map(|o| (o, share(o))).filter(|s| s.1.is_finite() && s.1 > 0.0);
        shares.max_by(|a, b| a.1.total_cmp(&b.1)).map(|s| s.0)
    }
}

/// Outputs that have a channel in every recording: one that does not move in one of them has none there.
pub(super) fn shown_everywhere(all: &[Acting<'_>]) -> Vec<usize> {
    let Some((first, others)) = all.split_first() else { return Vec::new() };
    let shows = |a: &Acting<'_>, output: usize| a.prescribed.channels.iter().any(|c| c.output == output);
    let mut outputs: Vec<usize> = first.prescribed.channels.iter().map(|c| c.output).collect();
    outputs.retain(|output| others.iter().all(|a| shows(a, *output)));
    outputs.sort_unstable();
    outputs.dedup();
    outputs
}

/// The motion at an instant as regressors: 1, then of these outputs position, rate and the rate's sign (0 within three deviations).
pub(super) fn motion(prescribed: &GriddedRecording, outputs: &[usize], k: usize) -> Vec<f64> {
    let sign = |v: f64, deviation: f64| if v.abs() > 3.0 * deviation { v.signum() } else { 0.0 };
    let mut row = vec![1.0];
    for output in outputs {
        if let Some(s) = prescribed.channels.iter().find(|c| c.output == *output) {
            row.extend([s.y[k], s.dy[k], sign(s.dy[k], s.rate_sigma)]);
        }
    }
    row
}
