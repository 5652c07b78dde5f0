//! The innovations filter: gains once for a recording, then one pass for each column.
//!
//! Readings of a node are taken one after the other, so that nothing is inverted. Gains and variances depend on the noise
//! alone, not on what was read: every column passes the same ones (EST-3, EST-4).

use nalgebra::{SMatrix, SVector};

use crate::system::System;

/// Columns that pass side by side.
const LANES: usize = 8;

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

    /// What a unit of each unknown takes from the innovations: forces at the places in each step, errors of the readings,
    /// one after the other; either may be empty. Columns pass side by side.
    pub fn columns<const P: usize>(
        &self,
        system: &System<N, P>,
        columns: &[(&[[f64; P]], &[f64])],
    ) -> Vec<Vec<f64>> {
        columns.chunks(LANES).flat_map(|lanes| self.lanes(system, lanes)).collect()
    }

    fn lanes<const P: usize>(
        &self,
        system: &System<N, P>,
        columns: &[(&[[f64; P]], &[f64])],
    ) -> Vec<Vec<f64>> {
        let readings = system.readings();
        let mut whitened = vec![Vec::with_capacity(readings); columns.len()];
        let mut x = [[0.0; LANES]; N];
        let mut at = 0;
        for (k, (node, gains)) in system.nodes.iter().zip(&self.gains).enumerate() {
            if k > 0 {
                let step = &system.steps[k - 1];
                let mut f = [[0.0; LANES]; P];
                for (lane, (forces, _)) in columns.iter().enumerate() {
                    if let Some(force) = forces.get(k - 1) {
                        (0..P).for_each(|p| f[p][lane] = force[p]);
                    }
                }
                let mut next = [[0.0; LANES]; N];
                for (i, next) in next.iter_mut().enumerate() {
                    for (j, x) in x.iter().enumerate() {
                        let a = step.transition[(i, j)];
                        (0..LANES).for_each(|l| next[l] += a * x[l]);
                    }
                    for (p, f) in f.iter().enumerate() {
                        let b = step.forces[(i, p)];
                        (0..LANES).for_each(|l| next[l] += b * f[l]);
                    }
                }
                x = next;
            }
            for (reading, gain) in node.iter().zip(gains) {
                let mut innovation = [0.0; LANES];
                for (lane, (_, errors)) in columns.iter().enumerate() {
                    innovation[lane] = -errors.get(at).copied().unwrap_or(0.0);
                }
                for (x, h) in x.iter().zip(reading.row.iter()) {
                    (0..LANES).for_each(|l| innovation[l] -= h * x[l]);
                }
                for (x, g) in x.iter_mut().zip(gain.gain.iter()) {
                    (0..LANES).for_each(|l| x[l] += g * innovation[l]);
                }
                let scale = 1.0 / gain.variance.sqrt();
                for (whitened, innovation) in whitened.iter_mut().zip(innovation) {
                    whitened.push(innovation * scale); // (EST-4)
                }
                at += 1;
            }
        }
        whitened
    }
}

/// ln p(y) of a recording whose innovations these are.
pub fn log_likelihood(log_determinant: f64, whitened: &[f64]) -> f64 {
    -0.5 * (log_determinant + whitened.iter().map(|e| e * e).sum::<f64>())
}
