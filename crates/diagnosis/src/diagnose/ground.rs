//! What gaps are compared with: held-out recordings without any effect, and what chance leaves of them.

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF, FisherSnedecor};
use trueup_signals::process::overall;

use crate::engine::free::{FreeRun, NEAR};
use crate::engine::problem::Compared;
use crate::engine::replay::{DRAWS, ReplayedReadings};
use crate::engine::search::{CaseSearch, FittedSet};
use crate::floor::{self, GapShares, Pooled};

/// How far a channel exceeds what chance leaves, where all together do not: then channels count by their floors.
const EXCEEDS: f64 = 1.5;

/// The model as it is and with its own parameters fitted, on the held-out recordings.
pub(super) struct ComparisonBasis<'a> {
    /// What fits and simulates.
    pub search: &'a CaseSearch<'a>,
    /// Held-out recordings.
    pub runs: &'a [Compared],
    /// With the parameters as they were given.
    pub before: ReplayedReadings,
    /// With them fitted.
    pub tuned: ReplayedReadings,
    /// The free-running fit of them.
    pub fitted: Option<FittedSet>,
    /// What the better of both misses of the recordings for fitting.
    pub misfit: f64,
    /// What noise leaves, by recording and channel.
    pub floors: Vec<Vec<f64>>,
    /// What the gap of each channel counts by, by name; empty: all alike.
    pub weights: BTreeMap<String, f64>,
}

impl<'a> ComparisonBasis<'a> {
    /// Channels are weighed alike, unless a gap that is plain in one of them drowns in the noise of others.
    pub(super) fn new(
        search: &'a CaseSearch<'a>,
        runs: &'a [Compared],
        shown: [ReplayedReadings; 2],
        (fitted, misfit): (Option<FittedSet>, f64),
        floors: Vec<Vec<f64>>,
    ) -> Self {
        let [before, tuned] = shown;
        let weights = BTreeMap::new();
        let plain = Self { search, runs, before, tuned, fitted, misfit, floors, weights };
        let pooled = plain.pooled(&plain.before);
        let own = pooled.each();
        let chance = plain.chance(&pooled, NEAR).into_iter();
        let chance: Vec<f64> = chance.map(|floor| floor.max(1e-12)).collect();
        let before: Vec<f64> = own.iter().map(|g| g.before).collect();
        let masked = overall(&before) <= overall(&chance);
        let exceeds = before.iter().zip(&chance).any(|(gap, chance)| *gap > EXCEEDS * chance);
        if !(masked && exceeds) {
            return plain;
        }
        let floors = own.iter().map(|g| 1.0 / g.floor.max(1e-12));
        let weights = pooled.channels().map(str::to_owned).zip(floors).collect();
        Self { weights, ..plain }
    }

    /// What the gap of a channel counts by; nothing, where the others are weighed and it does not vary.
    fn weight(&self, channel: &str) -> f64 {
        let alike = f64::from(u8::from(self.weights.is_empty()));
        self.weights.get(channel).copied().unwrap_or(alike)
    }

    /// Held-out recordings with `after` instead of the model with causes.
    fn pooled<'b>(&'b self, after: &'b ReplayedReadings) -> Pooled<'b> {
        let measured = |run: usize, channel: usize| &self.runs[run].run.channels[channel].y[..];
        self.compared(measured, [&self.before, &self.tuned, after])
    }

    /// Simulations compared with what was `measured`, by recording and channel.
    pub(super) fn compared<'b>(
        &'b self,
        measured: impl Fn(usize, usize) -> &'b [f64],
        [before, tuned, after]: [&'b ReplayedReadings; 3],
    ) -> Pooled<'b> {
        let mut all = Vec::new();
        for (r, run) in self.runs.iter().enumerate() {
            for (c, channel) in run.run.channels.iter().enumerate() {
                all.push(floor::ReplayedChannel {
                    recording: &run.run.name,
                    channel: &channel.name,
                    measured: measured(r, c),
                    before: &before[r][c],
                    tuned: &tuned[r][c],
                    after: &after[r][c],
                    floor: self.floors[r][c],
                });
            }
        }
        Pooled::new(&all)
    }

    /// Figures of all channels that vary, in one.
    pub(super) fn together(&self, pooled: &Pooled<'_>, each: impl Iterator<Item = f64>) -> Option<f64> {
        let weighed = pooled.channels().zip(each).map(|(channel, figure)| self.weight(channel) * figure);
        overall(&weighed.collect::<Vec<_>>())
    }

    /// What is claimed runs further off than the refitted model does, by more than chance: both gaps.
    pub(super) fn worse(&self, after: &ReplayedReadings) -> Option<[f64; 2]> {
        let free = self.free(after)?;
        free.does_worse().then_some([free.after, free.tuned])
    }

    /// Gaps with `after` instead of the model with causes.
    pub(super) fn free(&self, after: &ReplayedReadings) -> Option<FreeRun> {
        let pooled = self.pooled(after);
        let own = pooled.each();
        let figure = |of: fn(&GapShares) -> f64| self.together(&pooled, own.iter().map(of));
        Some(FreeRun {
            before: figure(|g| g.before)?,
            tuned: figure(|g| g.tuned)?,
            after: figure(|g| g.after)?,
            floor: figure(|g| g.floor)?,
            chance: self.together(&pooled, self.chance(&pooled, NEAR).into_iter())?,
        })
    }

    /// Gap as it is reported, all channels alike.
    pub(super) fn gap(&self, shown: &ReplayedReadings) -> Option<f64> {
        overall(&self.pooled(shown).each().iter().map(|g| g.after).collect::<Vec<_>>())
    }

    /// Gaps that chance exceeds once in two hundred cases, the sensors' noise being so many times what is declared.
    fn chance(&self, pooled: &Pooled<'_>, sensors: f64) -> Vec<f64> {
        pooled.floors(&self.seldom(sensors).concat())
    }

    /// Deviations that chance exceeds once in two hundred cases: noise of the sensors is many readings, noise that was
    /// carried along is about one number a recording, known from as many draws. `sensors`: times what is declared of them
    /// that their noise may be.
    fn seldom(&self, sensors: f64) -> Vec<Vec<f64>> {
        let runs = self.runs.len().max(1) as f64;
        let quantile = FisherSnedecor::new(runs, runs * f64::from(DRAWS))
            .map_or(f64::INFINITY, |f| f.inverse_cdf(0.995));
        let of = |(run, floors): (&Compared, &Vec<f64>)| {
            let channels = run.run.channels.iter().zip(floors);
            let both = channels.map(|(c, floor)| {
                let (sensor, carried) = (c.sigma.powi(2), (floor.powi(2) - c.sigma.powi(2)).max(0.0));
                (sensors.powi(2) * sensor + quantile * carried).sqrt()
            });
            both.collect()
        };
        self.runs.iter().zip(&self.floors).map(of).collect()
    }
}
