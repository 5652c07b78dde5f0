//! A linear system along a recording, with latent forces as its last states.

use nalgebra::{SMatrix, SVector};

/// From one node of time to the next: x+ = transition x + push + forces f + w, w ~ N(0, noise).
#[derive(Clone, Debug)]
pub struct Step<const N: usize, const P: usize> {
    /// Of the states, latent forces among them.
    pub transition: SMatrix<f64, N, N>,
    /// What is known.
    pub push: SVector<f64, N>,
    /// Covariance of what is not.
    pub noise: SMatrix<f64, N, N>,
    /// What a force at each place, held over the step, adds to the states.
    pub forces: SMatrix<f64, N, P>,
}

impl<const N: usize, const P: usize> Default for Step<N, P> {
    fn default() -> Self {
        Self {
            transition: SMatrix::zeros(),
            push: SVector::zeros(),
            noise: SMatrix::zeros(),
            forces: SMatrix::zeros(),
        }
    }
}

/// A reading at a node: value = row . x + v, v ~ N(0, variance).
#[derive(Clone, Debug)]
pub struct Reading<const N: usize> {
    /// What it shows.
    pub row: SVector<f64, N>,
    /// What was read.
    pub value: f64,
    /// Of its noise, above 0.
    pub variance: f64,
}

/// A recording as a linear time-varying system of `N` states, the last `P` of them latent forces (EST-1).
#[derive(Clone, Debug)]
pub struct System<const N: usize, const P: usize> {
    /// Mean of the states at the first node.
    pub start: SVector<f64, N>,
    /// Their covariance.
    pub start_covariance: SMatrix<f64, N, N>,
    /// One fewer than nodes.
    pub steps: Vec<Step<N, P>>,
    /// The readings of each node, none where one is missing.
    pub nodes: Vec<Vec<Reading<N>>>,
}

impl<const N: usize, const P: usize> System<N, P> {
    /// How many readings there are.
    pub fn readings(&self) -> usize {
        self.nodes.iter().map(Vec::len).sum()
    }
    /// Its latent forces are these, over steps of `dt`.
    pub fn set_latent(&mut self, latent: &[Latent; P], dt: f64) {
        for (place, l) in latent.iter().enumerate() {
            let (at, (rho, noise)) = (N - P + place, l.over(dt));
            self.start_covariance[(at, at)] = l.deviation.powi(2);
            for step in &mut self.steps {
                step.transition[(at, at)] = rho;
                step.noise[(at, at)] = noise;
            }
        }
    }
}

/// A latent force of limited bandwidth: an Ornstein-Uhlenbeck process (Matern 1/2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Latent {
    /// Standard deviation, in the force's unit.
    pub deviation: f64,
    /// Correlation time, s.
    pub time: f64,
}

impl Latent {
    /// What is left of it after `dt`, and the variance that comes in its place: d+ = rho d + w.
    pub fn over(&self, dt: f64) -> (f64, f64) {
        let rho = (-dt / self.time).exp();
        (rho, self.deviation.powi(2) * (1.0 - rho * rho)) // (EST-2)
    }
}
