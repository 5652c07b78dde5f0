//! A plant about its trajectory: steps with their noise, and rows of readings.
//!
//! ```text
//! z = (x, d),  d' = -d / MEMORY + noise,  stationary standard deviations q
//! z+ = A z + B f + noise of covariance Q          A = exp(F dt), B likewise
//! reading of state k at time tau after its node:  H = e_k (1 + F m1 + F^2 m2 + F^3 m3),
//! Dr = m1 e_k B + m2 e_k F B + m3 e_k F^2 B       times the mean of the forces of the step before and of this step
//! ```

use nalgebra::DMatrix;

use super::plant::ForcedPlant;

/// Memory of the latent forces, s.
pub const MEMORY: f64 = 0.05;

/// Force on the coordinates that is proportional to the plant's states (coordinates x states, rows of rows): the tangent of
/// laws that a hypothesis has in force.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Feedback(pub Vec<f64>);

impl Feedback {
    /// Whether nothing is fed back.
    pub fn is_none(&self) -> bool {
        self.0.iter().all(|g| *g == 0.0)
    }
    /// The sum of both.
    pub fn with(&self, other: &Self) -> Self {
        if other.0.is_empty() {
            return self.clone();
        }
        let own = self.0.iter().copied().chain(std::iter::repeat(0.0));
        Self(other.0.iter().zip(own).map(|(a, b)| a + b).collect())
    }
}

/// What the plant with its latents is about a point.
#[derive(Clone, Copy)]
pub struct LinearPoint<'a> {
    /// The plant.
    pub plant: &'a dyn ForcedPlant,
    /// Its parameters.
    pub theta: &'a [f64],
    /// Tangent of laws.
    pub feedback: &'a Feedback,
}

impl LinearPoint<'_> {
    /// Number of states with the latents.
    pub fn size(&self) -> usize {
        self.plant.states() + self.plant.coordinates().len()
    }

    /// F and B in continuous time, states with the latents.
    fn rates(&self, stuck: &[bool]) -> (DMatrix<f64>, DMatrix<f64>) {
        let (n, forces, size) = (self.plant.states(), stuck.len(), self.size());
        let (mut by_state, mut by_force) = (vec![0.0; n * n], vec![0.0; n * forces]);
        self.plant.tangent(self.theta, stuck, &mut by_state, &mut by_force);
        let b = DMatrix::from_row_slice(n, forces, &by_force);
        let mut f = DMatrix::from_row_slice(n, n, &by_state);
        if !self.feedback.0.is_empty() {
            f += &b * DMatrix::from_row_slice(forces, n, &self.feedback.0);
            for (c, _) in self.plant.coordinates().iter().zip(stuck).filter(|(_, s)| **s) {
                f.column_mut(c.velocity).fill(0.0);
            }
        }
        let mut full = DMatrix::zeros(size, size);
        full.view_mut((0, 0), (n, n)).copy_from(&f);
        full.view_mut((0, n), (n, forces)).copy_from(&b);
        (n..size).for_each(|i| full[(i, i)] = -1.0 / MEMORY);
        let mut inputs = DMatrix::zeros(size, forces);
        inputs.view_mut((0, 0), (n, forces)).copy_from(&b);
        (full, inputs)
    }
}

/// A step without its noise; `a` size x size, `b` size x coordinates.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantStep {
    /// Which coordinates rest.
    pub stuck: Vec<bool>,
    /// Transition.
    pub a: Vec<f64>,
    /// Effect of forces that are constant over the step.
    pub b: Vec<f64>,
    /// What the states have in addition, those without latents: of a step about a trajectory what the model does from its node, less
    /// the next node. Empty: nothing; steps of modes have none.
    pub defect: Vec<f64>,
}

/// Which step follows each node of a recording.
#[derive(Clone, Copy, Debug)]
pub enum StepOrder<'a> {
    /// By mode: that of the step after each node, for a plant that is linear but for its modes.
    ByMode(&'a [u8]),
    /// Each node has a step of its own, but for the last of so many.
    Own(usize),
}

impl StepOrder<'_> {
    /// Number of nodes.
    #[inline(always)]
    pub fn nodes(&self) -> usize {
        match self {
            Self::ByMode(modes) => modes.len(),
            Self::Own(nodes) => *nodes,
        }
    }
    /// Index of the step after a node.
    #[inline(always)]
    pub fn after(&self, node: usize) -> usize {
        match self {
            Self::ByMode(modes) => usize::from(modes[node]),
            Self::Own(_) => node,
        }
    }
}

fn row_major(m: &DMatrix<f64>) -> Vec<f64> {
    m.transpose().as_slice().to_vec()
}

impl PlantStep {
    /// A step of `dt` s with these coordinates at rest.
    pub fn new(point: &LinearPoint<'_>, stuck: &[bool], dt: f64) -> Self {
        let (size, forces) = (point.size(), stuck.len());
        let (f, b) = point.rates(stuck);
        let mut joined = DMatrix::zeros(size + forces, size + forces);
        joined.view_mut((0, 0), (size, size)).copy_from(&(f * dt));
        joined.view_mut((0, size), (size, forces)).copy_from(&(b * dt));
        let step = joined.exp(); // (EST-1)
        let mut a = step.view((0, 0), (size, size)).into_owned();
        let b = step.view((0, size), (size, forces)).into_owned();
        for c in point.plant.coordinates().iter().zip(stuck).filter(|(_, s)| **s).map(|(c, _)| c) {
            a.row_mut(c.velocity).fill(0.0);
            a.column_mut(c.velocity).fill(0.0);
        }
        Self { stuck: stuck.to_vec(), a: row_major(&a), b: row_major(&b), defect: Vec::new() }
    }

    /// Covariance of what a step adds. `white`: standard deviation of a white force on each coordinate, N.m; `latent`: stationary
    /// standard deviation of each latent force, N.m; `rest`: speed that counts as rest, rad/s.
    pub fn noise(
        &self,
        plant: &dyn ForcedPlant,
        dt: f64,
        white: &[f64],
        latent: &[f64],
        rest: f64,
    ) -> Vec<f64> {
        let forces = white.len();
        let size = self.b.len() / forces;
        let kept = (-dt / MEMORY).exp();
        let mut q = vec![0.0; size * size];
        for (c, w) in white.iter().enumerate() {
            let b = |i: usize| self.b[forces * i + c];
            for (i, j) in (0..size).flat_map(|i| (0..size).map(move |j| (i, j))) {
                q[size * i + j] += w * w * b(i) * b(j);
            }
        }
        for (c, l) in latent.iter().enumerate() {
            let i = size - forces + c;
            q[(size + 1) * i] = l * l * (1.0 - kept * kept); // (EST-2)
        }
        let held = || plant.coordinates().iter().zip(&self.stuck).filter(|(_, s)| **s).map(|(c, _)| c);
        for (c, d) in held().flat_map(|c| held().map(move |d| (c, d))) {
            q[size * c.velocity + d.velocity] = rest * rest;
            q[size * c.position + d.position] = (rest * dt).powi(2);
        }
        q
    }
}

/// Rows of all readings of a recording, one after the other by node and channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReadingRows {
    /// H, `size` numbers each.
    pub h: Vec<f64>,
    /// Dr, one number a coordinate each.
    pub direct: Vec<f64>,
}

impl ReadingRows {
    /// The rows of each channel times its factor; with so many states, and so many coordinates.
    pub fn scale(&mut self, factors: &[f64], [size, forces]: [usize; 2]) {
        if factors.iter().all(|f| *f == 1.0) {
            return;
        }
        for (all, numbers) in [(&mut self.h, size), (&mut self.direct, forces)] {
            let rows = all.chunks_mut(numbers).zip(factors.iter().cycle());
            rows.for_each(|(row, f)| row.iter_mut().for_each(|x| *x *= f));
        }
    }

    /// Of readings that are these sums of the plant's states, with `moments` (m1, m2, m3 of their times by node and channel), where `mode` of each node is an
    /// index of `modes`.
    pub fn new(
        point: &LinearPoint<'_>,
        shown: &[Vec<f64>],
        modes: &[Vec<bool>],
        mode: &[u8],
        moments: &[[f64; 3]],
    ) -> Self {
        let (size, forces) = (point.size(), point.plant.coordinates().len());
        // e_k F^j for j of 0 to 3, and the same times B, by mode and channel.
        let mut parts = Vec::new();
        for stuck in modes {
            let (f, b) = point.rates(stuck);
            for sum in shown {
                let mut row = DMatrix::zeros(1, size);
                sum.iter().enumerate().for_each(|(k, x)| row[(0, k)] = *x);
                let mut powers = vec![row];
                (0..3).for_each(|j| powers.push(&powers[j] * &f));
                let direct: Vec<_> = powers[..3].iter().map(|p| p * &b).collect();
                parts.push((powers, direct));
            }
        }
        let mut out = Self::default();
        for (t, m) in mode.iter().enumerate() {
            for c in 0..shown.len() {
                let (powers, direct) = &parts[shown.len() * usize::from(*m) + c];
                let x = moments[shown.len() * t + c];
                out.h.extend(
                    (0..size).map(|i| {
                        powers[0][i] + x[0] * powers[1][i] + x[1] * powers[2][i] + x[2] * powers[3][i]
                    }),
                );
                out.direct.extend(
                    (0..forces).map(|i| x[0] * direct[0][i] + x[1] * direct[1][i] + x[2] * direct[2][i]),
                );
            }
        }
        out
    }
}
