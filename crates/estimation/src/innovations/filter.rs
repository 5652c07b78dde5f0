//! Gains once for all columns, then a pass of the same gains for each column.
//!
//! Readings of a node are taken one after the other. Column 0, what was read, passes in double precision; the others pass
//! next to each other in single precision, [`LANES`] at a time.

use std::rc::Rc;

use super::kernel::{SizeError, SizedKernel, run};
use super::linear::{PlantStep, ReadingRows};

/// Columns that pass next to each other.
pub const LANES: usize = 16;

/// A linear system along a recording.
#[derive(Clone, Debug)]
pub struct FilterInput<'a> {
    /// Steps, by mode.
    pub steps: &'a [PlantStep],
    /// Covariance of what a step adds, by mode.
    pub noise: Vec<Vec<f64>>,
    /// Mode of the step after each node.
    pub mode: &'a [u8],
    /// Variance of an unknown force on coordinate `unknown_on` in the step after each node.
    pub unknown: &'a [f64],
    /// That coordinate, and the state that is its position.
    pub unknown_on: (usize, usize),
    /// Readings.
    pub rows: &'a ReadingRows,
    /// Variance of each reading; 0: there is none.
    pub variance: Vec<f64>,
    /// Which readings count.
    pub counted: &'a [bool],
    /// Covariance of the first state.
    pub first: Vec<f64>,
    /// Number of coordinates.
    pub forces: usize,
    /// Channels.
    pub channels: usize,
}

/// Gains of a recording.
#[derive(Clone, Debug)]
pub struct FilterGains<'a> {
    /// Of what.
    pub input: FilterInput<'a>,
    /// Gain of each reading, `size` numbers each.
    pub gain: Rc<[f64]>,
    /// Variance of each innovation; 1 without a reading.
    pub variance: Rc<[f64]>,
    /// Covariance of each node before its readings; empty unless requested.
    pub predicted: Vec<f64>,
}

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
    ///
    /// # Errors
    /// Where no kernel has these sizes.
    pub fn new(input: FilterInput<'a>, keep: bool) -> Result<Self, SizeError> {
        let size = input.size();
        let rows = input.mode.len() * input.channels;
        let (mut gain, mut variance, mut predicted) = (vec![0.0; rows * size], vec![1.0; rows], Vec::new());
        let recursion = Riccati {
            input: &input,
            gain: &mut gain,
            variance: &mut variance,
            predicted: keep.then_some(&mut predicted),
        };
        run(size, input.forces, recursion)?;
        Ok(Self { input, gain: gain.into(), variance: variance.into(), predicted })
    }
}

impl FilterInput<'_> {
    /// States with latents.
    pub fn size(&self) -> usize {
        self.first.len().isqrt()
    }
    /// Readings that are there and count.
    pub fn counted_rows(&self) -> Vec<usize> {
        (0..self.counted.len()).filter(|k| self.counted[*k] && self.variance[*k] > 0.0).collect()
    }
}

struct Riccati<'a> {
    input: &'a FilterInput<'a>,
    gain: &'a mut [f64],
    variance: &'a mut [f64],
    predicted: Option<&'a mut Vec<f64>>,
}

impl SizedKernel for Riccati<'_> {
    type Output = ();
    #[inline(always)]
    fn run<const N: usize, const F: usize>(self) {
        riccati::<N, F>(self);
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
    for t in 0..input.mode.len() {
        if t > 0 {
            let mode = usize::from(input.mode[t - 1]);
            let ((a, b), q, x) = (&steps[mode], &noise[mode], input.unknown[t - 1]);
            let transposed = &transposes[mode];
            let mut moved: Square<N> = [[0.0; N]; N];
            for i in 0..N {
                // Latent forces follow nothing but themselves.
                let from = if i < N - F { 0..N } else { i..i + 1 };
                for k in from {
                    for j in 0..N {
                        moved[i][j] += a[i][k] * p[k][j];
                    }
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
            let mut k = g;
            for i in 0..N {
                k[i] /= s;
            }
            for i in 0..N {
                for j in 0..N {
                    p[i][j] -= g[i] * g[j] / s;
                }
            }
            gain[N * at..N * (at + 1)].copy_from_slice(&k);
            variance[at] = s;
        }
    }
}

/// The data column along a recording: what was read, and what is known to push.
#[derive(Clone, Debug)]
pub struct DataColumn {
    /// Force of each coordinate over the step after each node, N.m.
    pub forces: Vec<Vec<f64>>,
    /// Readings by node and channel.
    pub readings: Vec<f64>,
    /// First state with latents.
    pub first: Vec<f64>,
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
///
/// # Errors
/// Where no kernel has these sizes.
pub fn data_innovations(gains: &FilterGains<'_>, data: &DataColumn) -> Result<Vec<f64>, SizeError> {
    let mut out = vec![0.0; gains.variance.len()];
    run(gains.input.size(), gains.input.forces, DataPass { gains, data, out: &mut out })?;
    Ok(out)
}

struct DataPass<'a> {
    gains: &'a FilterGains<'a>,
    data: &'a DataColumn,
    out: &'a mut [f64],
}

impl SizedKernel for DataPass<'_> {
    type Output = ();
    #[inline(always)]
    fn run<const N: usize, const F: usize>(self) {
        pass_data::<N, F>(self.gains, self.data, self.out);
    }
}

#[inline(always)]
fn pass_data<const N: usize, const F: usize>(g: &FilterGains<'_>, data: &DataColumn, out: &mut [f64]) {
    let input = &g.input;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let mut x: [f64; N] = row(&data.first, 0);
    let mut before = [0.0; F];
    for t in 0..input.mode.len() {
        if t > 0 {
            x = moved(&steps[usize::from(input.mode[t - 1])], &x, &before);
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

/// Numbers of the lanes, one each.
pub type Lane = [f32; LANES];

/// [`LANES`] columns along a recording.
#[derive(Clone, Debug, Default)]
pub struct LaneBlock {
    /// Force of each coordinate over the step after each node; empty: none of these columns has one there.
    pub forces: Vec<Vec<Lane>>,
    /// Reading error of each channel at each node; empty: none.
    pub readings: Vec<Vec<Lane>>,
}

/// Whitened innovations of a block of columns, by node and channel; 0 where nothing counts.
///
/// # Errors
/// Where no kernel has these sizes.
pub fn lane_innovations(
    gains: &FilterGains<'_>,
    block: &LaneBlock,
    out: &mut Vec<Lane>,
) -> Result<(), SizeError> {
    out.clear();
    out.resize(gains.variance.len(), [0.0; LANES]);
    run(gains.input.size(), gains.input.forces, LanePass { gains, block, out })
}

struct LanePass<'a> {
    gains: &'a FilterGains<'a>,
    block: &'a LaneBlock,
    out: &'a mut [Lane],
}

impl SizedKernel for LanePass<'_> {
    type Output = ();
    #[inline(always)]
    fn run<const N: usize, const F: usize>(self) {
        pass_lanes::<N, F>(self.gains, self.block, self.out);
    }
}

#[inline(always)]
fn add(sum: &mut Lane, factor: f32, x: &Lane) {
    for l in 0..LANES {
        sum[l] += factor * x[l];
    }
}

#[inline(always)]
fn lane_of(all: &[Lane], node: usize) -> Lane {
    if all.is_empty() { [0.0; LANES] } else { all[node] }
}

#[inline(always)]
fn pass_lanes<const N: usize, const F: usize>(g: &FilterGains<'_>, block: &LaneBlock, out: &mut [Lane]) {
    let input = &g.input;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let (mut z, mut before) = ([[0f32; LANES]; N], [[0f32; LANES]; F]);
    for t in 0..input.mode.len() {
        if t > 0 {
            let (a, b) = &steps[usize::from(input.mode[t - 1])];
            let mut next = [[0f32; LANES]; N];
            for i in 0..N {
                // Latent forces follow nothing but themselves.
                if i >= N - F {
                    add(&mut next[i], a[i][i] as f32, &z[i]);
                    continue;
                }
                // Two chains of sums wait for each other less than one.
                let mut other = [0f32; LANES];
                for k in 0..F {
                    add(&mut other, b[i][k] as f32, &before[k]);
                }
                for k in 0..N / 2 {
                    add(&mut next[i], a[i][k] as f32, &z[k]);
                    add(&mut other, a[i][N / 2 + k] as f32, &z[N / 2 + k]);
                }
                add(&mut next[i], 1.0, &other);
            }
            z = next;
        }
        let mut now = [[0f32; LANES]; F];
        for k in 0..F {
            now[k] = lane_of(&block.forces[k], t);
        }
        for c in 0..input.channels {
            let at = input.channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let mut e = lane_of(&block.readings[c], t);
            let direct: [f64; F] = row(&input.rows.direct, at);
            let (h, gain): ([f64; N], [f64; N]) = (row(&input.rows.h, at), row(&g.gain, at));
            for k in 0..F {
                let half = (0.5 * direct[k]) as f32;
                if half != 0.0 {
                    add(&mut e, half, &now[k]);
                    add(&mut e, half, &before[k]);
                }
            }
            let mut other = [0f32; LANES];
            for i in 0..N / 2 {
                add(&mut e, h[i] as f32, &z[i]);
                add(&mut other, h[N / 2 + i] as f32, &z[N / 2 + i]);
            }
            add(&mut e, 1.0, &other);
            for i in 0..N {
                add(&mut z[i], -gain[i] as f32, &e);
            }
            if input.counted[at] {
                let r = (1.0 / g.variance[at].sqrt()) as f32; // (EST-4)
                for l in 0..LANES {
                    out[at][l] = e[l] * r;
                }
            }
        }
        before = now;
    }
}
