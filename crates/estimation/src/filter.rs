//! The innovations filter: gains once for a recording, then one pass for each column.
//!
//! Readings of a node are taken one after the other, so that nothing is inverted. Gains and variances depend on the noise
//! alone, not on what was read: every column passes the same ones (EST-3, EST-4).

use nalgebra::{SMatrix, SVector};

use crate::system::System;

/// What one reading does to the states.
#[derive(Clone, Debug)]
pub struct Gain<const N: usize> {
    /// Per unit of its innovation.
    pub gain: SVector<f64, N>,
    /// Variance of its innovation.
    pub variance: f64,
}

/// Gains and variances along a recording.
#[derive(Clone, Debug)]
pub struct Filter<const N: usize> {
    /// Of each node's readings.
    pub gains: Vec<Vec<Gain<N>>>,
    /// Covariance of the states at each node before its readings.
    pub covariances: Vec<SMatrix<f64, N, N>>,
    /// Sum of ln(2 pi S) of all innovations.
    pub log_determinant: f64,
}

/// What passed the filter.
#[derive(Clone, Debug)]
pub struct Pass<const N: usize> {
    /// Innovations over their standard deviations, reading by reading.
    pub whitened: Vec<f64>,
    /// The states at each node before its readings; empty where they were not asked for.
    pub states: Vec<SVector<f64, N>>,
}

impl<const N: usize> Filter<N> {
    /// Of a recording.
    pub fn new<const P: usize>(system: &System<N, P>) -> Self {
        let mut p = system.start_covariance;
        let mut gains = Vec::with_capacity(system.nodes.len());
        let mut covariances = Vec::with_capacity(system.nodes.len());
        let mut log_determinant = 0.0;
        for (k, readings) in system.nodes.iter().enumerate() {
            if k > 0 {
                let step = &system.steps[k - 1];
                p = step.transition * p * step.transition.transpose() + step.noise;
                p = (p + p.transpose()) * 0.5;
            }
            covariances.push(p);
            let mut node = Vec::with_capacity(readings.len());
            for reading in readings {
                let along = p * reading.row;
                let variance = reading.row.dot(&along) + reading.variance;
                let gain = along / variance;
                p -= gain * along.transpose();
                log_determinant += (std::f64::consts::TAU * variance).ln();
                node.push(Gain { gain, variance });
            }
            gains.push(node);
        }
        Self { gains, covariances, log_determinant }
    }

    /// The innovations of what was read, e = (y - H x) / sqrt S.
    pub fn data<const P: usize>(&self, system: &System<N, P>, keep: bool) -> Pass<N> {
        let mut x = system.start;
        let mut pass = Pass { whitened: Vec::with_capacity(system.readings()), states: Vec::new() };
        for (k, (readings, gains)) in system.nodes.iter().zip(&self.gains).enumerate() {
            if k > 0 {
                let step = &system.steps[k - 1];
                x = step.transition * x + step.push;
            }
            if keep {
                pass.states.push(x);
            }
            for (reading, gain) in readings.iter().zip(gains) {
                let innovation = reading.value - reading.row.dot(&x);
                x += gain.gain * innovation;
                pass.whitened.push(innovation / gain.variance.sqrt()); // (EST-3)
            }
        }
        pass
    }

    /// What a unit of something unknown takes from the innovations: `forces` at the places in each step, `errors` of the
    /// readings, one after the other; either may be empty.
    pub fn column<const P: usize>(
        &self,
        system: &System<N, P>,
        forces: &[SVector<f64, P>],
        errors: &[f64],
    ) -> Vec<f64> {
        let mut x = SVector::<f64, N>::zeros();
        let mut whitened = Vec::with_capacity(system.readings());
        for (k, (readings, gains)) in system.nodes.iter().zip(&self.gains).enumerate() {
            if k > 0 {
                let step = &system.steps[k - 1];
                x = step.transition * x;
                if let Some(f) = forces.get(k - 1) {
                    x += step.forces * f;
                }
            }
            for (reading, gain) in readings.iter().zip(gains) {
                let error = errors.get(whitened.len()).copied().unwrap_or(0.0);
                let innovation = -(reading.row.dot(&x) + error);
                x += gain.gain * innovation;
                whitened.push(innovation / gain.variance.sqrt()); // (EST-4)
            }
        }
        whitened
    }
}

/// ln p(y) of a recording whose innovations these are.
pub fn log_likelihood(log_determinant: f64, whitened: &[f64]) -> f64 {
    -0.5 * (log_determinant + whitened.iter().map(|e| e * e).sum::<f64>())
}
