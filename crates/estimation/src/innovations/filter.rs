//! Gains once for all columns, then a pass of the same gains for each column.
//!
//! Readings of a node are taken one after the other. Column 0, what was read, passes in double precision; the others pass
//! next to each other in single precision ([`super::lanes`]).

use pulp::Simd;

use super::any_size;
use super::filter_data::{DataColumn, FilterGains, FilterInput, Riccati};
use super::kernel::{SizedKernel, run};
use super::linear::{PlantStep, ReadingRows};

pub(super) type Square<const N: usize> = [[f64; N]; N];

// Plain loops below: closures would be compiled apart, without the vector units.

/// Matrices of a mode as arrays.
#[inline(always)]
pub(super) fn arrays<const N: usize, const F: usize>(s: &PlantStep) -> (Square<N>, [[f64; F]; N]) {
    let (mut a, mut b) = ([[0.0; N]; N], [[0.0; F]; N]);
    for i in 0..N {
        a[i] = row(&s.a, i);
        b[i] = row(&s.b, i);
    }
    (a, b)
}

#[inline(always)]
pub(super) fn row<const N: usize>(all: &[f64], at: usize) -> [f64; N] {
    let mut out = [0.0; N];
    out.copy_from_slice(&all[N * at..N * (at + 1)]);
    out
}

#[inline(always)]
pub(super) fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}

/// A state one step on, with the force of the step.
#[inline(always)]
pub(super) fn moved<const N: usize, const F: usize>(
    (a, b): &(Square<N>, [[f64; F]; N]),
    x: &[f64; N],
    force: &[f64; F],
) -> [f64; N] {
    let mut next = [0.0; N];
    for i in 0..N {
        next[i] = dot(&b[i], force) + dot(&a[i], x);
    }
    next
}

/// A reading less what forces and state say of it.
#[inline(always)]
pub(super) fn error_of<const N: usize, const F: usize>(
    rows: &ReadingRows,
    at: usize,
    reading: f64,
    x: &[f64; N],
    forces: [&[f64; F]; 2],
) -> f64 {
    let (h, direct): ([f64; N], [f64; F]) = (row(&rows.h, at), row(&rows.direct, at));
    let mut pushed = 0.0;
    for k in 0..F {
        pushed += 0.5 * direct[k] * (forces[0][k] + forces[1][k]);
    }
    reading - pushed - dot(&h, x)
}

impl<'a> FilterGains<'a> {
    /// By the Riccati recursion; `keep`: with the covariances that a smoother needs.
    pub fn new(input: FilterInput<'a>, keep: bool) -> Self {
        let size = input.size();
        let rows = input.order.nodes() * input.channels;
        let (mut gain, mut variance, mut predicted) = (vec![0.0; rows * size], vec![1.0; rows], Vec::new());
        let recursion = Riccati {
            input: &input,
            gain: &mut gain,
            variance: &mut variance,
            predicted: keep.then_some(&mut predicted),
        };
        run(input.sizes(), recursion);
        Self { input, gain: gain.into(), variance: variance.into(), predicted }
    }
}

impl SizedKernel for Riccati<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) {
        riccati::<N, F>(self);
    }
    #[inline(always)]
    fn run_any<S: Simd>(self, _: S) {
        any_size::riccati(self);
    }
}

#[inline(always)]
fn riccati<const N: usize, const F: usize>(out: Riccati<'_>) {
    let Riccati { input, gain, variance, mut predicted } = out;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let square = |v: &Vec<f64>| -> Square<N> { core::array::from_fn(|i| row(v, i)) };
    let noise: Vec<Square<N>> = input.noise.iter().map(square).collect();
    let transpose = |(a, _): &(Square<N>, _)| -> Square<N> {
        core::array::from_fn(|k| core::array::from_fn(|j| a[j][k]))
    };
    let transposes: Vec<Square<N>> = steps.iter().map(transpose).collect();
    let mut p = square(&input.first);
    let (on, position) = input.unknown_on;
    for t in 0..input.order.nodes() {
        if t > 0 {
            let mode = input.order.after(t - 1);
            let ((a, b), q, x) = (&steps[mode], &noise[mode], input.unknown[t - 1]);
            let transposed = &transposes[mode];
            let mut moved: Square<N> = [[0.0; N]; N];
            for i in 0..N - F {
                for k in 0..N {
                    for j in 0..N {
                        moved[i][j] += a[i][k] * p[k][j];
                    }
                }
            }
            // Latent forces follow nothing but themselves.
            for i in N - F..N {
                for j in 0..N {
                    moved[i][j] = a[i][i] * p[i][j];
                }
            }
            for i in 0..N {
                let mut next = q[i];
                for j in 0..N {
                    next[j] += x * b[i][on] * b[j][on];
                }
                for k in 0..N {
                    for j in 0..N {
                        next[j] += moved[i][k] * transposed[k][j];
                    }
                }
                moved[i] = next;
            }
            for i in 0..N {
                for j in 0..=i {
                    (p[i][j], p[j][i]) = (moved[i][j], moved[i][j]);
                }
            }
            // When within the step it acted is not known either.
            p[position][position] += 0.1 * x * b[position][on].powi(2);
        }
        if let Some(all) = predicted.as_mut() {
            all.extend(p.as_flattened());
        }
        for at in input.channels * t..input.channels * (t + 1) {
            let r = input.variance[at];
            if r <= 0.0 {
                continue;
            }
            let h: [f64; N] = row(&input.rows.h, at);
            let mut g = [0.0; N];
            for i in 0..N {
                for j in 0..N {
                    // The covariance is symmetric: by its rows.
                    g[j] += p[i][j] * h[i];
                }
            }
            let s = r + dot(&h, &g);
            let inverse = 1.0 / s;
            let mut k = g;
            for i in 0..N {
                k[i] *= inverse;
            }
            for i in 0..N {
                for j in 0..N {
                    p[i][j] -= k[i] * g[j];
                }
            }
            gain[N * at..N * (at + 1)].copy_from_slice(&k);
            variance[at] = s;
        }
    }
}

impl DataColumn {
    /// Forces over the step after a node.
    #[inline(always)]
    pub(super) fn force<const F: usize>(&self, node: usize) -> [f64; F] {
        let mut out = [0.0; F];
        for k in 0..F {
            out[k] = self.forces[k][node];
        }
        out
    }
}

/// Whitened innovations of the data, by node and channel; 0 where nothing counts.
pub fn data_innovations(gains: &FilterGains<'_>, data: &DataColumn) -> Vec<f64> {
    let mut out = vec![0.0; gains.variance.len()];
    run(gains.input.sizes(), DataPass { gains, data, out: &mut out });
    out
}

struct DataPass<'a> {
    gains: &'a FilterGains<'a>,
    data: &'a DataColumn,
    out: &'a mut [f64],
}

impl SizedKernel for DataPass<'_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) {
        pass_data::<N, F>(self.gains, self.data, self.out);
    }
    #[inline(always)]
    fn run_any<S: Simd>(self, _: S) {
        any_size::data(self.gains, self.data, self.out);
    }
}

#[inline(always)]
fn pass_data<const N: usize, const F: usize>(g: &FilterGains<'_>, data: &DataColumn, out: &mut [f64]) {
    let input = &g.input;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let mut x: [f64; N] = row(&data.first, 0);
    let mut before = [0.0; F];
    for t in 0..input.order.nodes() {
        if t > 0 {
            x = moved(&steps[input.order.after(t - 1)], &x, &before);
        }
        let now: [f64; F] = data.force(t);
        for at in input.channels * t..input.channels * (t + 1) {
            if input.variance[at] <= 0.0 {
                continue;
            }
            let e = error_of(input.rows, at, data.readings[at], &x, [&now, &before]);
            let gain: [f64; N] = row(&g.gain, at);
            for i in 0..N {
                x[i] += gain[i] * e;
            }
            if input.counted[at] {
                out[at] = e / g.variance[at].sqrt(); // (EST-3)
            }
        }
        before = now;
    }
}
