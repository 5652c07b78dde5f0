//! The fixed point of a hypothesis about its trajectory: amplitudes, intensities, parameters, trajectory, and again.
//!
//! ```text
//! columns along the trajectory -> evidence L, amplitudes -> intensities q <- q (power / expected power)^0.7, L again
//! parameters move (logarithms of what is positive) -> trajectory by the smoother, with the forces of all columns
//! ```
//!
//! It ends when L rises by less than a nat; the best L of all rounds counts.

use super::frame::TrajectoryFrame;
use super::plant::TrajectoryError;
use super::run::LawTangent;
use crate::innovations::column::AppliedLaw;
use crate::innovations::filter_data::SmoothedRecording;

/// Bounds of the ratio of a latent's power to what is expected of it.
const RATIO: [f64; 2] = [0.03, 30.0];
/// Exponent of that ratio: as the first intensities are found, and in a round of a fit.
const EXPONENT: [f64; 2] = [0.5, 0.7];
/// Smoothings from the readings to a first trajectory.
const SMOOTHINGS: usize = 3;
/// Times that intensities move in a round, and the change of their logarithms below which they stay.
const INNER: (usize, f64) = (2, 0.05);
/// Standard deviations of what is held, over the prior ones.
const HELD: f64 = 1e-3;

/// Where a fit had its best evidence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TrajectoryFit {
    /// Log evidence, nats.
    pub evidence: f64,
    /// Amplitudes of the laws, one after the other.
    pub amplitudes: Vec<f64>,
    /// Intensities.
    pub intensities: Vec<f64>,
    /// All parameters.
    pub theta: Vec<f64>,
    /// Amplitudes of gains, offsets and delays.
    pub doubted: Vec<f64>,
    /// Squares that are left, per reading.
    pub squares: f64,
    /// Readings that count.
    pub count: usize,
}

/// Makes the laws of a hypothesis along the present trajectories.
pub type TrajectoryLaws<'a> = &'a dyn Fn(&TrajectoryFrame) -> Vec<AppliedLaw>;
/// Tangents of laws at these amplitudes, one entry a recording; empty: none.
pub type TrajectoryTangents<'a> = &'a dyn Fn(&TrajectoryFrame, &[AppliedLaw], &[f64]) -> Vec<LawTangent>;

/// Power of each latent's scores over what is expected of it, over all recordings.
fn ratios(smoothed: &[SmoothedRecording]) -> Vec<f64> {
    let latents = smoothed.first().map_or(0, |s| s.powers.len());
    let sum = |j: usize, k: usize| smoothed.iter().map(|s| s.powers[j][k]).sum::<f64>();
    (0..latents).map(|j| sum(j, 0) / (sum(j, 1) + 1e-300)).collect()
}

impl TrajectoryFrame {
    /// Intensities moved by the ratios of the latents' powers.
    fn moved_intensities(&self, q: &[f64], smoothed: &[SmoothedRecording], exponent: f64) -> Vec<f64> {
        let moved = q.iter().zip(ratios(smoothed)).zip(self.bounds());
        moved
            .map(|((q, r), [low, high])| (q * r.clamp(RATIO[0], RATIO[1]).powf(exponent)).clamp(low, high)) // (EST-15)
            .collect()
    }

    /// From the readings to a trajectory of the model, intensities on the way.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn start(&mut self) -> Result<(), TrajectoryError> {
        for _ in 0..SMOOTHINGS {
            let smoothed = self.smoothed_with_powers(&self.all_gains(&self.intensities, true), None);
            self.intensities = self.moved_intensities(&self.intensities, &smoothed, EXPONENT[0]);
            self.follow(smoothed, None, &[])?;
        }
        Ok(())
    }

    /// Fits a hypothesis in at most `rounds` rounds from intensities `q`; `tangents` of its laws; `held`: with the parameters at their
    /// nominal values.
    ///
    /// # Errors
    /// See [`TrajectoryError`].
    pub fn fit(
        &mut self,
        make: TrajectoryLaws<'_>,
        tangents: Option<TrajectoryTangents<'_>>,
        q: &[f64],
        rounds: usize,
        held: bool,
    ) -> Result<TrajectoryFit, TrajectoryError> {
        let mut q = q.to_vec();
        let mut best: Option<TrajectoryFit> = None;
        let mut before = f64::NEG_INFINITY;
        for round in 0..rounds {
            let laws = make(self);
            let (mut columns, mut priors) = self.nuisances();
            let nuisances = columns.len();
            if held {
                priors.deviation.iter_mut().for_each(|d| *d *= HELD);
            }
            let narrowed: Vec<AppliedLaw> = laws.iter().map(AppliedLaw::narrowed).collect();
            let priors = priors.with_laws(&narrowed, &mut columns);
            let packed = self.packed(&columns);
            let (mut evidence, mut amplitudes) = (f64::NEG_INFINITY, Vec::new());
            for inner in 0..INNER.0 {
                let last = round + 1 == rounds && inner + 1 == INNER.0;
                let gains = self.all_gains(&q, !last);
                let found = self.evidence_with(&packed, &priors, &gains).1;
                (evidence, amplitudes) = (found.log, found.amplitudes);
                if best.as_ref().is_none_or(|b| evidence > b.evidence) {
                    best = Some(TrajectoryFit {
                        evidence,
                        amplitudes: amplitudes[nuisances..].to_vec(),
                        intensities: q.clone(),
                        theta: self.moved(&amplitudes, false),
                        doubted: amplitudes[self.unknown.len()..nuisances].to_vec(),
                        squares: found.squares / found.count.max(1) as f64,
                        count: found.count,
                    });
                }
                if last {
                    break;
                }
                let own = self.own_forces(&columns, &amplitudes);
                let smoothed = self.smoothed_with_powers(&gains, Some(&own));
                let moved = self.moved_intensities(&q, &smoothed, EXPONENT[1]);
                let calm = moved.iter().zip(&q).all(|(a, b)| (a / b).ln().abs() < INNER.1);
                q = moved;
                if calm {
                    break;
                }
            }
            if round > 0 && evidence < before + 1.0 || round + 1 == rounds {
                break;
            }
            before = evidence;
            let parameters = self.unknown.len();
            let all = self.own_forces(&columns, &amplitudes);
            let own = self.own_forces(&columns[parameters..], &amplitudes[parameters..]);
            let laws = tangents.map_or_else(Vec::new, |t| t(self, &laws, &amplitudes[nuisances..]));
            let smoothed = self.smoothed(&self.all_gains(&q, true), Some(&all));
            self.theta = self.moved(&amplitudes, true);
            self.follow(smoothed, Some(&own), &laws)?;
        }
        Ok(best.unwrap_or_default())
    }

    /// All parameters after a step of the unknowns, the first of these amplitudes; `within`: as far as it is trusted.
    pub(super) fn moved(&self, amplitudes: &[f64], within: bool) -> Vec<f64> {
        let mut theta = self.theta.clone();
        for (u, step) in self.unknown.iter().zip(amplitudes) {
            theta[u.index] =
                if within { u.moved_within(&self.theta, *step) } else { u.moved(&self.theta, *step) };
        }
        theta
    }
}
