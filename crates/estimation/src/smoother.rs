//! The smoother of Bryson and Frazier in its modified form: one backward pass, nothing inverted.
//!
//! Its co-state is the score: the derivative of the log likelihood by whatever enters at an instant. So it tells what a
//! force of any course would gain, before one is tried.

use nalgebra::{SMatrix, SVector};

use crate::filter::{Filter, Pass};
use crate::system::System;

/// States at all nodes, given all readings.
#[derive(Clone, Debug)]
pub struct Smoothed<const N: usize, const P: usize> {
    /// Means.
    pub states: Vec<SVector<f64, N>>,
    /// Covariances; empty where bands were not asked for.
    pub covariances: Vec<SMatrix<f64, N, N>>,
    /// d ln p / d f for a force at each place in each step.
    pub scores: Vec<SVector<f64, P>>,
    /// Variance of these scores where the model is right.
    pub score_variances: Vec<SVector<f64, P>>,
    /// Squares of the scores of what drives each latent force, summed, and what is expected of that sum: equal where the
    /// force's intensity is likeliest.
    pub latent_score: SVector<f64, P>,
    /// What is expected of it.
    pub latent_information: SVector<f64, P>,
}

/// Smooths what passed a filter, its states kept; `bands`: with the states' covariances.
///
/// The result is empty where the states of the pass were not kept.
pub fn smooth<const N: usize, const P: usize>(
    system: &System<N, P>,
    filter: &Filter<N>,
    pass: &Pass<N>,
    bands: bool,
) -> Smoothed<N, P> {
    let nodes = pass.states.len();
    let mut all = Smoothed {
        states: vec![SVector::zeros(); nodes],
        covariances: vec![SMatrix::zeros(); if bands { nodes } else { 0 }],
        scores: vec![SVector::zeros(); nodes.saturating_sub(1)],
        score_variances: vec![SVector::zeros(); nodes.saturating_sub(1)],
        latent_score: SVector::zeros(),
        latent_information: SVector::zeros(),
    };
    let mut at = pass.whitened.len();
    // d ln p / d x of what was read from here on, and its covariance.
    let mut score = SVector::<f64, N>::zeros();
    let mut information = SMatrix::<f64, N, N>::zeros();
    for k in (0..nodes).rev() {
        for (reading, gain) in system.nodes[k].iter().zip(&filter.gains[k]).rev() {
            at -= 1;
            let h = &reading.row;
            let deviation = gain.variance.sqrt();
            score += h * (pass.whitened[at] / deviation - gain.gain.dot(&score));
            // (1 - K h')' I (1 - K h') + h h' / S, without products of matrices.
            let along = information * gain.gain;
            let of = gain.gain.dot(&along) + 1.0 / gain.variance;
            let half = along - h * (0.5 * of);
            information -= half * h.transpose() + h * half.transpose();
        }
        let p = &filter.covariances[k];
        all.states[k] = pass.states[k] + p * score; // (EST-6)
        if let Some(band) = all.covariances.get_mut(k) {
            *band = p - p * information * p;
        }
        if k > 0 {
            let step = &system.steps[k - 1];
            for p in 0..P {
                let at = N - P + p;
                all.latent_score[p] += score[at].powi(2);
                all.latent_information[p] += information[(at, at)]; // (EST-7)
            }
            all.scores[k - 1] = step.forces.tr_mul(&score);
            let along = information * step.forces;
            all.score_variances[k - 1] = SVector::from_fn(|p, _| step.forces.column(p).dot(&along.column(p)));
            score = step.transition.tr_mul(&score);
            information = step.transition.tr_mul(&(information * step.transition));
        }
    }
    all
}
