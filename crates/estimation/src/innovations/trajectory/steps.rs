//! A step about a trajectory: the exponential of the mean tangent of both ends, and what the model does in it.

use super::plant::{TrajectoryPlant, TrajectoryPoint};

/// Rows of the rates' tangent times the step, below which the series of the exponential is used.
const SERIES: f64 = 0.4;
/// Halvings of a step at most.
const HALVINGS: u32 = 12;

/// Tangent of the accelerations at a node.
#[derive(Clone, Debug, Default)]
pub(super) struct NodeTangent {
    /// By coordinates and rates, n x 2n.
    pub(super) by_state: Vec<f64>,
    /// By forces, n x n.
    pub(super) by_force: Vec<f64>,
}

impl NodeTangent {
    /// With the tangent of laws: forces on the coordinates by coordinates and rates, n x 2n.
    pub(super) fn with_laws(mut self, laws: &[f64]) -> Self {
        let n = self.by_force.len().isqrt();
        for i in 0..n {
            for j in 0..n {
                let share = self.by_force[n * i + j];
                for k in 0..2 * n {
                    self.by_state[2 * n * i + k] += share * laws[2 * n * j + k];
                }
            }
        }
        self
    }
}

/// `to` = `a` `b`; `a` rows x inner, `b` inner x columns.
fn product(a: &[f64], b: &[f64], inner: usize, to: &mut [f64]) {
    let columns = b.len() / inner;
    to.fill(0.0);
    for (to, a) in to.chunks_mut(columns).zip(a.chunks(inner)) {
        for (a, b) in a.iter().zip(b.chunks(columns)) {
            to.iter_mut().zip(b).for_each(|(to, b)| *to += a * b);
        }
    }
}

/// A (2n x 2n) and B (2n x n) over a step of `dt` s between two nodes.
pub(super) fn step_between(from: &NodeTangent, to: &NodeTangent, dt: f64) -> [Vec<f64>; 2] {
    let n = from.by_force.len().isqrt();
    let width = 2 * n;
    let mean = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect() };
    let (f, w) = (mean(&from.by_state, &to.by_state), mean(&from.by_force, &to.by_force)); // (EST-12)
    // A position moves as fast as the root of its stiffness.
    let size = |row: &[f64]| {
        row[..n].iter().map(|x| x.abs().sqrt()).sum::<f64>() + row[n..].iter().map(|x| x.abs()).sum::<f64>()
    };
    let largest = f.chunks(width).map(size).fold(0.0, f64::max);
    let mut halvings = 0;
    while largest * dt * 0.5f64.powi(halvings as i32) > SERIES && halvings < HALVINGS {
        halvings += 1;
    }
    let h = dt * 0.5f64.powi(halvings as i32);
    // The rates: E = (0 1; f), Q = (0; w); a = exp(E h), b = integral of exp(E s) Q, both to the fourth order.
    let rates_of = |v: &[f64], columns: usize| -> Vec<f64> {
        let mut out = vec![0.0; width * columns];
        let (top, bottom) = out.split_at_mut(n * columns);
        top.copy_from_slice(&v[n * columns..]);
        product(&f, v, width, bottom);
        out
    };
    let series = |first: Vec<f64>, columns: usize| {
        let (mut term, mut sum) = (first.clone(), first);
        for k in 2..=4 {
            term = rates_of(&term, columns);
            term.iter_mut().for_each(|x| *x *= h / f64::from(k));
            sum.iter_mut().zip(&term).for_each(|(s, x)| *s += x);
        }
        sum
    };
    let mut first = vec![0.0; width * width];
    (0..n).for_each(|i| first[width * i + n + i] = h);
    first[n * width..].iter_mut().zip(&f).for_each(|(x, f)| *x = f * h);
    let mut a = series(first, width);
    (0..width).for_each(|i| a[(width + 1) * i] += 1.0);
    let mut first = vec![0.0; width * n];
    first[n * n..].iter_mut().zip(&w).for_each(|(x, w)| *x = w * h);
    let mut b = series(first, n);
    let (mut square, mut further) = (vec![0.0; width * width], vec![0.0; width * n]);
    for _ in 0..halvings {
        product(&a, &b, width, &mut further);
        b.iter_mut().zip(&further).for_each(|(b, x)| *b += x);
        product(&a, &a, width, &mut square);
        std::mem::swap(&mut a, &mut square);
    }
    [a, b]
}

/// The state a step of `dt` s after `time` by the model (Runge-Kutta of the fourth order over each part), with its torques and these forces.
pub(super) fn model_step<'a>(
    plant: &TrajectoryPlant,
    theta: &[f64],
    state: &[f64],
    torques: impl ExactSizeIterator<Item = &'a [f64]>,
    force: &[f64],
    [time, dt]: [f64; 2],
) -> Vec<f64> {
    let n = state.len() / 2;
    let h = dt / torques.len() as f64;
    let mut x = state.to_vec();
    for (part, torque) in torques.enumerate() {
        let begin = time + h * part as f64;
        let rates = |x: &[f64], time: f64| -> Vec<f64> {
            let a = plant.accelerations(TrajectoryPoint { theta, state: x, torque, time }, force);
            x[n..].iter().copied().chain(a).collect()
        };
        let moved = |by: f64, k: &[f64]| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
        let k1 = rates(&x, begin);
        let k2 = rates(&moved(0.5 * h, &k1), begin + 0.5 * h);
        let k3 = rates(&moved(0.5 * h, &k2), begin + 0.5 * h);
        let k4 = rates(&moved(h, &k3), begin + h);
        for i in 0..x.len() {
            x[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
        }
    }
    x
}
