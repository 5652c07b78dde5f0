//! The model of a chain alone, fitted until its parameters no longer move, with their uncertainty.

use std::rc::Rc;

use nalgebra::DMatrix;

use super::fit::TrajectoryFit;
use super::frame::TrajectoryFrame;
use super::plant::TrajectoryError;
use crate::innovations::column::FilterColumn;
use crate::innovations::estimate::{
    ALONG, ChannelInnovations, EstimatedNumber, InnovationsEstimate, LITTLE, READINGS, ROUNDS, SMALL,
    covariance_of, left_of,
};
use crate::innovations::evidence::{AmplitudePriors, log_evidence};
use crate::innovations::filter::data_innovations;
use crate::innovations::gram::{PackedColumns, PassedBase};

/// Factors by which figures of noise move, one after the other.
const FACTORS: [f64; 2] = [2.0, 1.2];
/// Least intensity of a latent, over its bound in a search of effects.
const LEAST: f64 = 1e-2;

/// A figure of noise that the evidence decides.
#[derive(Clone, Copy, Debug)]
enum TrajectoryNoise {
    /// Variance of the readings of a channel.
    Reading(usize),
    /// Variance of the white force on a coordinate.
    White(usize),
    /// Intensity of a latent.
    Latent(usize),
}

impl TrajectoryFrame {
    /// With these of its parameters only among the unknowns.
    pub fn only(&mut self, names: &[&str]) {
        let table = &self.plant.plant().table().parameters;
        let unknown = self.unknown.iter().filter(|u| names.contains(&&*table[u.index].name)).cloned();
        self.unknown = Rc::new(unknown.collect());
        self.forget_columns();
    }

    /// Fits the parameters of the model alone from a fit, determines the noise by the evidence, and fits them again.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn estimate(&mut self, fit: &TrajectoryFit) -> Result<InnovationsEstimate, TrajectoryError> {
        let begun: Vec<f64> = self.intake.channels.iter().map(|c| c.variance).collect();
        self.intensities.clone_from(&fit.intensities);
        self.refit()?;
        self.refine_noise(&begun);
        let (rounds, ended) = self.refit()?;
        let (_, priors, passed) = self.passed_null(false)?;
        let q = self.intensities.clone();
        let found = log_evidence(&passed.gram, &priors);
        let covariance = covariance_of(&passed.gram, &priors);
        let channels = self.channels();
        let mut innovations = Vec::new();
        for (k, e) in passed.innovations.iter().enumerate() {
            let readings = &self.runs[k].readings;
            let rows =
                || e.chunks(passed.gram.stride()).enumerate().filter(|(at, _)| readings.is_counted(*at));
            innovations.extend((0..channels).map(|c| {
                ChannelInnovations {
                    recording: k,
                    channel: self.intake.channels[c].name.clone(),
                    whitened: rows()
                        .filter(|(at, _)| at % channels == c)
                        .map(|(_, row)| left_of(row, &found.amplitudes))
                        .collect(),
                    noise: (self.intake.channels[c].variance / begun[c]).sqrt(),
                }
            }));
        }
        let numbers = self.numbers(&found.amplitudes);
        let covariance = DMatrix::from_fn(numbers.len(), numbers.len(), |i, j| {
            numbers[i].2 * numbers[j].2 * covariance[(numbers[i].0, numbers[j].0)]
        });
        let numbers = numbers.into_iter().map(|n| n.1).collect();
        let usual = self.usual_force.iter().zip(self.plant.plant().coordinates());
        let latents = q.iter().zip(usual).map(|(q, (usual, c))| (c.name.clone(), q / usual)).collect();
        Ok(InnovationsEstimate {
            numbers,
            covariance,
            innovations,
            latents,
            evidence: found.log,
            rounds,
            ended,
        })
    }

    /// What was estimated: by which amplitude, the number, and its derivative.
    fn numbers(&self, amplitudes: &[f64]) -> Vec<(usize, EstimatedNumber, f64)> {
        let table = &self.plant.plant().table().parameters;
        let own = self.unknown.len();
        let parameters = self.unknown.iter().enumerate().map(|(k, u)| {
            let (name, value) = (table[u.index].name.clone(), self.theta[u.index]);
            (k, EstimatedNumber { name, recording: None, value }, u.unit_at(&self.theta))
        });
        let doubted = self.doubted_numbers(&amplitudes[own..]).into_iter();
        parameters.chain(doubted.map(|(k, n, slope)| (own + k, n, slope))).collect()
    }

    /// Gauss-Newton until the parameters no longer move: rounds, and whether they do not.
    fn refit(&mut self) -> Result<(usize, bool), TrajectoryError> {
        let mut rounds = 0;
        loop {
            let along = rounds < ALONG;
            let (columns, priors, passed) = self.passed_null(along)?;
            let found = log_evidence(&passed.gram, &priors);
            let covariance = covariance_of(&passed.gram, &priors);
            let parameters = self.unknown.len();
            let far = |i: usize| found.amplitudes[i].abs() / covariance[(i, i)].sqrt();
            let far = (0..parameters).map(far).fold(0.0, f64::max);
            rounds += 1;
            let all = self.own_forces(&columns, &found.amplitudes);
            let own = self.own_forces(&columns[parameters..], &found.amplitudes[parameters..]);
            let smoothed = self.smoothed(&self.all_gains(&self.intensities, true), Some(&all));
            self.theta = self.moved(&found.amplitudes, true); // (EST-21)
            self.follow(smoothed, Some(&own), &[])?;
            let ended = far < ROUNDS.1 && !along;
            if ended || rounds == ROUNDS.0 {
                return Ok((rounds, ended));
            }
        }
    }

    /// Data and columns with the gains in hand; columns of the parameters `along` the smoothed trajectory, or as derivatives of the
    /// innovations.
    fn passed_null(
        &mut self,
        along: bool,
    ) -> Result<(Vec<FilterColumn>, AmplitudePriors, PassedBase), TrajectoryError> {
        let (columns, priors) = self.nuisances();
        let mut passed = self.pass_base(&self.packed(&columns), &self.intensities);
        if !along {
            let covariance = covariance_of(&passed.gram, &priors);
            self.differentiate(&mut passed, &covariance)?;
        }
        Ok((columns, priors, passed))
    }

    /// Columns of the parameters as derivatives of the innovations about the trajectory in hand, with the gains in hand: as those of a joint.
    fn differentiate(
        &self,
        passed: &mut PassedBase,
        covariance: &DMatrix<f64>,
    ) -> Result<(), TrajectoryError> {
        let mut moved = self.clone();
        for (i, u) in self.unknown.iter().enumerate() {
            let step = (SMALL * covariance[(i, i)].sqrt()).clamp(1e-9, 1e-2);
            let mut sides = [Vec::new(), Vec::new()];
            for (side, h) in sides.iter_mut().zip([-step, step]) {
                moved.theta.clone_from(&self.theta);
                moved.theta[u.index] = u.moved(&self.theta, h);
                moved.linearise(&[])?;
                for r in 0..moved.runs.len() {
                    let gains = passed.gains_of(r, moved.passed_input(r));
                    side.push(data_innovations(&gains, &moved.residual(r, None)));
                }
            }
            let slope = |r: usize, at: usize| (sides[0][r][at] - sides[1][r][at]) / (2.0 * step); // (EST-21)
            passed.replace(
                1 + i,
                |r, at| if self.runs[r].readings.is_counted(at) { slope(r, at) } else { 0.0 },
            );
        }
        passed.multiply();
        Ok(())
    }

    /// Data and the columns of all that is refitted, with their priors.
    fn packed_null(&mut self) -> (PackedColumns, AmplitudePriors) {
        let (columns, priors) = self.nuisances();
        (self.packed(&columns), priors)
    }

    /// Variance of the readings of each channel, white forces and intensities, each by the evidence.
    fn refine_noise(&mut self, begun: &[f64]) {
        let base = self.packed_null();
        let bounds = self.bounds();
        let mut best = self.evidence_in_hand(&base);
        let readings = (0..self.channels()).map(TrajectoryNoise::Reading);
        let forces = (0..self.coordinates()).map(TrajectoryNoise::White);
        let latents = (0..self.intensities.len()).map(TrajectoryNoise::Latent);
        let figures: Vec<TrajectoryNoise> = readings.chain(forces).chain(latents).collect();
        for factor in FACTORS {
            for figure in &figures {
                for by in [factor, 1.0 / factor] {
                    loop {
                        let kept = self.moved_noise(*figure, by, begun, &bounds);
                        let found = self.evidence_in_hand(&base);
                        if found <= best + LITTLE {
                            self.moved_noise(*figure, 1.0 / kept, begun, &bounds);
                            break;
                        }
                        best = found;
                    }
                }
            }
        }
    }
    fn evidence_in_hand(&self, (packed, priors): &(PackedColumns, AmplitudePriors)) -> f64 {
        self.evidence_with(packed, priors, &self.all_gains(&self.intensities, false)).1.log
    }

    /// Moves a figure by a factor within its bounds; by which.
    fn moved_noise(&mut self, figure: TrajectoryNoise, by: f64, begun: &[f64], bounds: &[[f64; 2]]) -> f64 {
        let moved = |x: &mut f64, low: f64, high: f64| {
            let kept = *x;
            *x = (kept * by).clamp(low, high);
            *x / kept
        };
        match figure {
            TrajectoryNoise::Reading(c) => {
                let variance = &mut Rc::make_mut(&mut self.intake).channels[c].variance;
                moved(variance, READINGS[0] * begun[c], READINGS[1] * begun[c])
            }
            TrajectoryNoise::White(k) => {
                let by = moved(&mut self.white[k], f64::MIN_POSITIVE, f64::MAX);
                self.renew_noise();
                by
            }
            TrajectoryNoise::Latent(k) => {
                let [low, high] = bounds[k];
                moved(&mut self.intensities[k], LEAST * low, high)
            }
        }
    }
}
