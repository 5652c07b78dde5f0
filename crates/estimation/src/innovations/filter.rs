//! Gains once for all columns, then a pass of the same gains for each column.
//!
//! Readings of a node are taken one after the other. Column 0, what was read, passes in double precision; the others pass
//! next to each other in single precision, [`LANES`] at a time.

use std::rc::Rc;

use pulp::Simd;

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
    pub gain: Rc<Vec<f64>>,
    /// Variance of each innovation; 1 without a reading.
    pub variance: Rc<Vec<f64>>,
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
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) {
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
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) {
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
pub type FilterLane = [f32; LANES];

/// [`LANES`] columns along a recording.
#[derive(Clone, Debug, Default)]
pub struct LaneBlock {
    /// Force of each coordinate over the step after each node; empty: none of these columns has one there.
    pub forces: Vec<Vec<FilterLane>>,
    /// Reading error of each channel at each node; empty: none.
    pub readings: Vec<Vec<FilterLane>>,
}

/// A block of columns that passes with gains of a recording.
pub struct LaneStream<'a> {
    /// Gains.
    pub gains: &'a FilterGains<'a>,
    /// Columns.
    pub block: &'a LaneBlock,
    /// Their whitened innovations, by node and channel; what was there before, where nothing counts.
    pub out: &'a mut Vec<FilterLane>,
}

/// Passes streams of one recording, two side by side: one alone would wait for its own results. They differ in their
/// gains or in their columns.
///
/// # Errors
/// Where no kernel has these sizes.
pub fn pass_streams(streams: &mut [LaneStream<'_>]) -> Result<(), SizeError> {
    for some in streams.chunks_mut(2) {
        some.iter_mut().for_each(|s| s.out.resize(s.gains.variance.len(), [0.0; LANES]));
        let (size, forces) = (some[0].gains.input.size(), some[0].gains.input.forces);
        match some {
            [a, b] => run(size, forces, LanePass([a, b]))?,
            [a] => run(size, forces, LanePass([a]))?,
            _ => {}
        }
    }
    Ok(())
}

struct LanePass<'a, 'b, const K: usize>([&'a mut LaneStream<'b>; K]);

impl<const K: usize> SizedKernel for LanePass<'_, '_, K> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(mut self, simd: S) {
        for part in 0..LANES / S::F32_LANES {
            pass_lanes::<S, N, F, K>(simd, &mut self.0, part);
        }
    }
}

type SingleStep<const N: usize, const F: usize> = ([[f32; N]; N], [[f32; F]; N]);

/// Matrices of a mode in single precision.
fn single_step<const N: usize, const F: usize>(step: &PlantStep) -> SingleStep<N, F> {
    let (a, b) = arrays(step);
    (a.map(single), b.map(single))
}

/// `sum` plus `factor` times `x`, not fused.
#[inline(always)]
fn plus<S: Simd>(simd: S, sum: S::f32s, factor: f32, x: S::f32s) -> S::f32s {
    simd.add_f32s(sum, simd.mul_f32s(simd.splat_f32s(factor), x))
}

/// Numbers of a row in single precision.
#[inline(always)]
fn single<const N: usize>(x: [f64; N]) -> [f32; N] {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = x[i] as f32;
    }
    out
}

/// A part of the lanes of a node, as wide as the vectors of the processor.
#[inline(always)]
fn lanes_of<S: Simd>(simd: S, all: &[FilterLane], node: usize, part: usize) -> S::f32s {
    if all.is_empty() { simd.splat_f32s(0.0) } else { S::as_simd_f32s(&all[node]).0[part] }
}

#[inline(always)]
fn pass_lanes<S: Simd, const N: usize, const F: usize, const K: usize>(
    simd: S,
    streams: &mut [&mut LaneStream<'_>; K],
    part: usize,
) {
    let gains: [&FilterGains<'_>; K] = core::array::from_fn(|s| streams[s].gains);
    let blocks: [&LaneBlock; K] = core::array::from_fn(|s| streams[s].block);
    let input = &gains[0].input;
    let steps: Vec<SingleStep<N, F>> = input.steps.iter().map(single_step).collect();
    let zero = simd.splat_f32s(0.0);
    let (mut z, mut before) = ([[zero; N]; K], [[zero; F]; K]);
    for t in 0..input.mode.len() {
        if t > 0 {
            let step = &steps[usize::from(input.mode[t - 1])];
            for s in 0..K {
                z[s] = moved_lanes(simd, step, &z[s], &before[s]);
            }
        }
        let mut now = [[zero; F]; K];
        for s in 0..K {
            for k in 0..F {
                now[s][k] = lanes_of(simd, &blocks[s].forces[k], t, part);
            }
        }
        for c in 0..input.channels {
            let at = input.channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let direct: [f32; F] = single(row(&input.rows.direct, at));
            let h: [f32; N] = single(row(&input.rows.h, at));
            for s in 0..K {
                let mut e = lanes_of(simd, &blocks[s].readings[c], t, part);
                for k in 0..F {
                    if direct[k] != 0.0 {
                        e = plus(simd, e, 0.5 * direct[k], now[s][k]);
                        e = plus(simd, e, 0.5 * direct[k], before[s][k]);
                    }
                }
                let mut other = zero;
                for i in 0..N / 2 {
                    e = plus(simd, e, h[i], z[s][i]);
                    other = plus(simd, other, h[N / 2 + i], z[s][N / 2 + i]);
                }
                e = simd.add_f32s(e, other);
                let gain: [f32; N] = single(row(&gains[s].gain, at));
                for i in 0..N {
                    z[s][i] = plus(simd, z[s][i], -gain[i], e);
                }
                if input.counted[at] {
                    // (EST-4)
                    let whitened = simd.splat_f32s((1.0 / gains[s].variance[at].sqrt()) as f32);
                    S::as_mut_simd_f32s(&mut streams[s].out[at]).0[part] = simd.mul_f32s(e, whitened);
                }
            }
        }
        before = now;
    }
}

/// States of lanes one step on.
#[inline(always)]
fn moved_lanes<S: Simd, const N: usize, const F: usize>(
    simd: S,
    (a, b): &SingleStep<N, F>,
    z: &[S::f32s; N],
    before: &[S::f32s; F],
) -> [S::f32s; N] {
    let zero = simd.splat_f32s(0.0);
    let mut next = [zero; N];
    for i in 0..N {
        // Latent forces follow nothing but themselves.
        if i >= N - F {
            next[i] = plus(simd, zero, a[i][i], z[i]);
            continue;
        }
        // Two chains of sums wait for each other less than one.
        let mut other = zero;
        for k in 0..F {
            other = plus(simd, other, b[i][k], before[k]);
        }
        for k in 0..N / 2 {
            next[i] = plus(simd, next[i], a[i][k], z[k]);
            other = plus(simd, other, a[i][N / 2 + k], z[N / 2 + k]);
        }
        next[i] = simd.add_f32s(next[i], other);
    }
    next
}
