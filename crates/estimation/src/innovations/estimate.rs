//! The model alone, fitted until its parameters no longer move, with their uncertainty.
//!
//! ```text
//! x <- x + a,  a = A^-1 b     Gauss-Newton; trajectory smoothed again in each round, columns along it, then c = -de/dx with the gains in hand
//! cov(x) = A^-1               A = G_11 + diag(1 / sd^2), with the noise that has the best evidence
//! cov(p) = J A^-1 J'          p: numbers as they are reported, J: their derivatives by x
//! ```

use std::rc::Rc;

use nalgebra::DMatrix;

use super::evidence::{AmplitudePriors, TRUST, log_evidence, posterior_covariance};
use super::filter::data_innovations;
use super::frame::InnovationsFrame;
use super::gram::{BaseGram, PackedColumns, PassedBase};
use super::signs::DrySigns;

/// Rounds at most, and the step, in standard errors, below which a fit ends.
pub(super) const ROUNDS: (usize, f64) = (25, 0.02);
/// Factors by which figures of noise move, one after the other.
pub(super) const FACTORS: [f64; 4] = [4.0, 1.8, 1.3, 1.1];
/// Rounds with columns along the smoothed trajectory, and steps of derivatives after these, in standard errors.
pub(super) const ALONG: usize = 1;
pub(super) const SMALL: f64 = 0.2;
/// Nats that do not count.
pub(super) const LITTLE: f64 = 0.02;
/// Times that noise is determined and the parameters are fitted again.
const AGAIN: usize = 2;
/// Bounds of the white force and of the latents, in usual forces: of a model that lacks nothing they are next to nothing.
const FORCES: [[f64; 2]; 2] = [[1e-6, 0.2], [1e-6, 20.0]];
/// Bounds of the variance of a channel's readings, over that of the intake.
pub(super) const READINGS: [f64; 2] = [0.25, 16.0];
/// Speeds of rest that are tried along the smoothed trajectory, over that in hand.
const RESTS: [f64; 6] = [1.0, 0.5, 0.25, 0.12, 0.06, 0.03];
/// Step of derivatives of reported numbers.
const STEP: f64 = 1e-6;

/// A number that was estimated.
#[derive(Clone, Debug, PartialEq)]
pub struct EstimatedNumber {
    /// FMU variable, or a channel with `.gain`, `.offset` or `.delay`.
    pub name: String,
    /// Recording that has it, by index among those for fitting; `None`: all of them.
    pub recording: Option<usize>,
    /// Value in its unit.
    pub value: f64,
}

/// Innovations of a channel in one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct ChannelInnovations {
    /// Recording, by index among those for fitting.
    pub recording: usize,
    /// Name of the channel.
    pub channel: String,
    /// Innovations over their standard deviations, in the order of time.
    pub whitened: Vec<f64>,
    /// Standard deviation of a reading by the evidence, over that with which the intake began.
    pub noise: f64,
}

/// Where a fit of the model alone ended.
#[derive(Clone, Debug)]
pub struct InnovationsEstimate {
    /// What was estimated: parameters first.
    pub numbers: Vec<EstimatedNumber>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// What is left.
    pub innovations: Vec<ChannelInnovations>,
    /// Standard deviations of the latent forces by the evidence, in usual forces of their coordinates: names and values.
    pub latents: Vec<(String, f64)>,
    /// Log evidence, nats.
    pub evidence: f64,
    /// Rounds of the last fit.
    pub rounds: usize,
    /// Whether the parameters no longer move.
    pub ended: bool,
}

/// Parameters where a fit ended.
struct RefittedNull {
    zeros: Vec<f64>,
    amplitudes: Vec<f64>,
    covariance: DMatrix<f64>,
    evidence: f64,
    rounds: usize,
    ended: bool,
}

impl InnovationsFrame {
    /// Fits the parameters of the model alone from those in hand, determines the noise by the evidence, and fits them again. `zeros`: what
    /// the rig adds to readings, then differences of the encoders' zeros, in units of their columns.
    pub fn estimate(&mut self, zeros: Vec<f64>) -> InnovationsEstimate {
        let begun: Vec<f64> = self.intake.channels.iter().map(|c| c.variance).collect();
        let mut found = self.refit(zeros);
        self.refine_rest(&found.zeros);
        for _ in 0..AGAIN {
            self.refine_noise(&begun);
            found = self.refit(found.zeros);
        }
        let (packed, _) = self.packed(&[]);
        let passed = self.pass_base(&packed, &self.q.clone());
        let noise = |c: usize| (self.intake.channels[c].variance * self.scale / begun[c]).sqrt();
        let mut innovations = Vec::new();
        for (k, e) in passed.innovations.iter().enumerate() {
            let rows =
                || e.chunks(passed.gram.stride()).enumerate().filter(|(at, _)| self.is_counted(k, *at));
            innovations.extend((0..self.channels()).map(|c| {
                ChannelInnovations {
                    recording: k,
                    channel: self.intake.channels[c].name.clone(),
                    whitened: rows()
                        .filter(|(at, _)| at % self.channels() == c)
                        .map(|(_, row)| left_of(row, &found.amplitudes))
                        .collect(),
                    noise: noise(c),
                }
            }));
        }
        let RefittedNull { zeros, covariance, evidence, rounds, ended, .. } = found;
        let jacobian = self.derivatives(&zeros);
        let coordinates = self.plant.coordinates().iter().map(|c| c.name.to_owned());
        InnovationsEstimate {
            numbers: self.numbers(&self.theta, &zeros),
            covariance: &jacobian * covariance * jacobian.transpose(),
            innovations,
            latents: coordinates.zip(self.q.iter().copied()).collect(),
            evidence,
            rounds,
            ended,
        }
    }

    /// Whether a reading is there and counts, by node and channel.
    fn is_counted(&self, recording: usize, at: usize) -> bool {
        let r = &self.runs[recording];
        r.counted[at] && r.count[at] > 0.0
    }

    /// Numbers as they are reported; `zeros`: as in [`Self::estimate`].
    fn numbers(&self, theta: &[f64], zeros: &[f64]) -> Vec<EstimatedNumber> {
        let own = self.plant.parameters();
        let of_plant = self.unknown.iter().filter(|k| **k < own.len());
        let of_plant = of_plant.map(|k| (own[*k].name.to_owned(), None, theta[*k]));
        let (rig, numbers) = (&self.intake.rig, &theta[own.len()..]);
        let common = rig.reported(numbers, zeros).into_iter().map(|(name, value)| (name, None, value));
        let single = rig.reported_of_single(numbers, zeros).into_iter();
        let single = single.map(|(name, recording, value)| (name, Some(recording), value));
        let all = of_plant.chain(common).chain(single).filter(|n| !n.0.is_empty());
        all.map(|(name, recording, value)| EstimatedNumber { name, recording, value }).collect()
    }

    /// Derivatives of these numbers by relative changes of the unknowns, then by the numbers that add.
    fn derivatives(&self, zeros: &[f64]) -> DMatrix<f64> {
        let values = |theta: &[f64], zeros: &[f64]| -> Vec<f64> {
            self.numbers(theta, zeros).iter().map(|n| n.value).collect()
        };
        let unknowns = self.unknown.len();
        let columns: Vec<Vec<f64>> = (0..unknowns + zeros.len())
            .map(|i| {
                let [before, after] = [-STEP, STEP].map(|h| {
                    let (mut theta, mut zeros) = (self.theta.clone(), zeros.to_vec());
                    match self.unknown.get(i) {
                        Some(k) => theta[*k] *= 1.0 + h,
                        None => zeros[i - unknowns] += h,
                    }
                    values(&theta, &zeros)
                });
                after.iter().zip(before).map(|(a, b)| (a - b) / (2.0 * STEP)).collect()
            })
            .collect();
        DMatrix::from_fn(columns.first().map_or(0, Vec::len), columns.len(), |i, j| columns[j][i])
    }

    fn refit(&mut self, mut zeros: Vec<f64>) -> RefittedNull {
        let mut rounds = 0;
        loop {
            let q = self.q.clone();
            self.put_in_force(&[], &[], &zeros, &q);
            let (packed, priors) = self.packed(&[]);
            let mut passed = self.pass_base(&packed, &q);
            if rounds >= ALONG {
                let steps = self.small_steps(&covariance_of(&passed.gram, &priors));
                self.differentiate(&mut passed, &q, &steps);
            }
            let found = log_evidence(&passed.gram, &priors);
            let covariance = covariance_of(&passed.gram, &priors);
            let mut far = 0.0f64;
            for (i, k) in self.unknown.iter().enumerate() {
                let step = found.amplitudes[i].clamp(-TRUST, TRUST);
                far = far.max(step.abs() / covariance[(i, i)].sqrt());
                self.theta[*k] *= 1.0 + step; // (EST-21)
            }
            zeros = found.amplitudes[self.unknown.len()..].to_vec();
            rounds += 1;
            let ended = far < ROUNDS.1 && rounds > ALONG;
            if ended || rounds == ROUNDS.0 {
                let (evidence, amplitudes) = (found.log, found.amplitudes);
                return RefittedNull { zeros, amplitudes, covariance, evidence, rounds, ended };
            }
        }
    }

    /// Speed of rest, and with it sliding and rest at each node, from the smoothed speed: it resolves more than the readings do.
    fn refine_rest(&mut self, zeros: &[f64]) {
        if self.breakaway() <= 0.0 {
            return;
        }
        let at = |f: &mut Self| {
            let q = f.q.clone();
            f.put_in_force(&[], &[], zeros, &q);
            let base = f.packed(&[]);
            f.evidence_in_hand(&base)
        };
        let mut best = (at(self), self.rest, self.signs());
        let begun = self.rest;
        for share in RESTS {
            self.restore_signs(&best.2);
            at(self);
            self.rest = share * begun;
            self.signs_from_states();
            let evidence = at(self);
            if evidence > best.0 + 1.0 {
                best = (evidence, self.rest, self.signs());
            }
        }
        self.rest = best.1;
        self.restore_signs(&best.2);
        at(self);
    }

    /// Relative changes of the unknowns that are small next to their standard errors.
    fn small_steps(&self, covariance: &DMatrix<f64>) -> Vec<f64> {
        (0..self.unknown.len()).map(|i| (SMALL * covariance[(i, i)].sqrt()).clamp(1e-9, 1e-2)).collect()
    }

    /// Columns of the unknowns as derivatives of the innovations, with the gains in hand: of a reading they depend on what was read before
    /// it alone. Along the smoothed trajectory they depend on its noise, too, and where columns are nearly parallel what is estimated is
    /// biased by that.
    fn differentiate(&mut self, passed: &mut PassedBase, q: &[f64], steps: &[f64]) {
        let kept = self.theta.clone();
        for (i, k) in self.unknown.clone().into_iter().enumerate() {
            let [before, after] = [-steps[i], steps[i]].map(|h| {
                self.theta[k] = kept[k] * (1.0 + h);
                self.linearise();
                let data = self.data().into_iter().enumerate();
                let of = |(r, d)| data_innovations(&passed.gains_of(r, self.filter_input(r, q)), &d);
                data.map(of).collect::<Vec<_>>()
            });
            self.theta[k] = kept[k];
            let slope = |r: usize, at: usize| (before[r][at] - after[r][at]) / (2.0 * steps[i]); // (EST-21)
            passed.replace(1 + i, |r, at| if self.is_counted(r, at) { slope(r, at) } else { 0.0 });
        }
        self.linearise();
        passed.multiply();
    }

    /// Variance of the readings of each channel, white force, intensities, and variance of the force at turns, each by the evidence; `begun`: variances of the intake.
    fn refine_noise(&mut self, begun: &[f64]) {
        let base = self.packed(&[]);
        let mut best = self.evidence_in_hand(&base);
        let figures = self.noise_figures();
        for factor in FACTORS {
            for figure in &figures {
                for by in [factor, 1.0 / factor] {
                    loop {
                        let kept = self.moved_noise(*figure, by, begun);
                        let found = self.evidence_in_hand(&base);
                        if found <= best + LITTLE {
                            self.restore_noise(*figure, kept);
                            break;
                        }
                        best = found;
                    }
                }
            }
        }
    }
    fn evidence_in_hand(&mut self, base: &(PackedColumns, AmplitudePriors)) -> f64 {
        let q = self.q.clone();
        self.best_of(base, &[q]).found.log
    }

    fn noise_figures(&self) -> Vec<NoiseFigure> {
        let latents = (0..self.coordinates()).map(NoiseFigure::Latent);
        let readings = (0..self.channels()).map(NoiseFigure::Reading);
        readings.chain([NoiseFigure::White]).chain(latents).chain([NoiseFigure::Turns]).collect()
    }

    /// Moves a figure by a factor; what it was.
    fn moved_noise(&mut self, figure: NoiseFigure, by: f64, begun: &[f64]) -> KeptNoise {
        let moved = |x: &mut f64, [low, high]: [f64; 2]| {
            let kept = *x;
            *x = (kept * by).clamp(low, high);
            KeptNoise::Value(kept)
        };
        match figure {
            NoiseFigure::White => moved(&mut self.white, FORCES[0]),
            NoiseFigure::Latent(k) => moved(&mut self.q[k], FORCES[1]),
            NoiseFigure::Reading(c) => {
                let variance = &mut Rc::make_mut(&mut self.intake).channels[c].variance;
                moved(variance, READINGS.map(|x| x * begun[c]))
            }
            NoiseFigure::Turns => {
                let kept = self.signs();
                for r in &mut self.runs {
                    Rc::make_mut(&mut r.signs).unknown.iter_mut().for_each(|x| *x *= by);
                }
                KeptNoise::Signs(kept)
            }
        }
    }
    fn restore_noise(&mut self, figure: NoiseFigure, kept: KeptNoise) {
        match (figure, kept) {
            (NoiseFigure::White, KeptNoise::Value(x)) => self.white = x,
            (NoiseFigure::Latent(k), KeptNoise::Value(x)) => self.q[k] = x,
            (NoiseFigure::Reading(c), KeptNoise::Value(x)) => {
                Rc::make_mut(&mut self.intake).channels[c].variance = x;
            }
            (_, KeptNoise::Signs(signs)) => self.restore_signs(&signs),
            (NoiseFigure::Turns, _) => {}
        }
    }
}

/// Covariance of the amplitudes; of what cannot be inverted nothing is known.
pub(super) fn covariance_of(gram: &BaseGram, priors: &AmplitudePriors) -> DMatrix<f64> {
    let n = priors.mean.len();
    posterior_covariance(gram, priors).unwrap_or_else(|| DMatrix::from_diagonal_element(n, n, f64::INFINITY))
}

/// What columns at these amplitudes leave of an innovation, the first of a row.
pub(super) fn left_of(row: &[f64], amplitudes: &[f64]) -> f64 {
    row[0] - row[1..].iter().zip(amplitudes).map(|(e, a)| e * a).sum::<f64>()
}

/// A figure of noise that the evidence decides.
#[derive(Clone, Copy, Debug)]
enum NoiseFigure {
    White,
    Latent(usize),
    Reading(usize),
    Turns,
}

/// What a figure was.
enum KeptNoise {
    Value(f64),
    Signs(Vec<Rc<DrySigns>>),
}
