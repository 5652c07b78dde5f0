//! Columns of forces and reading errors, sixteen next to each other in single precision, with the gains of a recording.

use pulp::Simd;

use super::any_size;
use super::filter::{arrays, row};
use super::filter_data::{FilterGains, FilterLane, LANES, LaneBlock, LaneStream, in_single};
use super::kernel::{SizedKernel, run};
use super::linear::PlantStep;

/// Numbers of each reading in single precision, next to each other, for all passes with these gains: its row, its gains, how much of
/// forces it shows, and 1 over the deviation of its innovation. Within a pass, converting them costs as much as the sums do.
pub fn single_rows(gains: &FilterGains<'_>, out: &mut Vec<f32>) {
    run(gains.input.sizes(), RowConversion { gains, out });
}

struct RowConversion<'a, 'b> {
    gains: &'a FilterGains<'b>,
    out: &'a mut Vec<f32>,
}

/// Numbers of a reading, filled up to whole vectors of eight.
const fn row_width(states: usize, forces: usize) -> usize {
    (2 * states + forces + 1).next_multiple_of(8)
}

impl SizedKernel for RowConversion<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) {
        let (gains, width) = (self.gains, row_width(N, F));
        let input = &gains.input;
        self.out.resize(width * gains.variance.len(), 0.0);
        for (at, to) in self.out.chunks_exact_mut(width).enumerate() {
            if input.variance[at] <= 0.0 {
                continue;
            }
            let (h, gain): ([f64; N], [f64; N]) = (row(&input.rows.h, at), row(&gains.gain, at));
            let direct: [f64; F] = row(&input.rows.direct, at);
            for i in 0..N {
                to[i] = in_single(h[i]);
                to[N + i] = in_single(gain[i]);
            }
            for k in 0..F {
                to[2 * N + k] = in_single(direct[k]);
            }
            to[2 * N + F] = (1.0 / gains.variance[at].sqrt()) as f32;
        }
    }
    /// The kernel for any sizes takes them as they are.
    #[inline(always)]
    fn run_any<S: Simd>(self, _: S) {
        self.out.clear();
    }
}

/// Passes streams of one recording, two side by side: one alone would wait for its own results. They differ in their
/// gains or in their columns.
pub fn pass_streams(streams: &mut [LaneStream<'_>]) {
    for some in streams.chunks_mut(2) {
        some.iter_mut().for_each(|s| s.out.resize(s.gains.variance.len(), [0.0; LANES]));
        let sizes = some[0].gains.input.sizes();
        match some {
            [a, b] => run(sizes, LanePass([a, b])),
            [a] => run(sizes, LanePass([a])),
            _ => {}
        }
    }
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
    #[inline(always)]
    fn run_any<S: Simd>(self, simd: S) {
        for stream in self.0 {
            any_size::lanes(simd, stream);
        }
    }
}

type SingleStep<const N: usize, const F: usize> = ([[f32; N]; N], [[f32; F]; N]);

/// Matrices of a mode in single precision.
fn single_step<const N: usize, const F: usize>(step: &PlantStep) -> SingleStep<N, F> {
    let (a, b) = arrays(step);
    (a.map(single), b.map(single))
}

/// `factor` times `x`.
#[inline(always)]
fn times<S: Simd>(simd: S, factor: f32, x: S::f32s) -> S::f32s {
    simd.mul_f32s(simd.splat_f32s(factor), x)
}

/// `sum` plus `factor` times `x`, not fused.
#[inline(always)]
fn plus<S: Simd>(simd: S, sum: S::f32s, factor: f32, x: S::f32s) -> S::f32s {
    simd.add_f32s(sum, times(simd, factor, x))
}

/// Numbers of a row in single precision.
#[inline(always)]
fn single<const N: usize>(x: [f64; N]) -> [f32; N] {
    let mut out = [0.0; N];
    for i in 0..N {
        out[i] = in_single(x[i]);
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
    let width = row_width(N, F);
    let rows: [&[f32]; K] = core::array::from_fn(|s| streams[s].rows);
    let blocks: [&LaneBlock; K] = core::array::from_fn(|s| streams[s].block);
    let input = &streams[0].gains.input;
    let steps: Vec<SingleStep<N, F>> = input.steps.iter().map(single_step).collect();
    let zero = simd.splat_f32s(0.0);
    let (mut z, mut before) = ([[zero; N]; K], [[zero; F]; K]);
    for t in 0..input.order.nodes() {
        if t > 0 {
            let step = &steps[input.order.after(t - 1)];
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
            for s in 0..K {
                let row = &rows[s][width * at..][..width];
                let mut e = lanes_of(simd, &blocks[s].readings[c], t, part);
                for k in 0..F {
                    let direct = row[2 * N + k];
                    if direct != 0.0 {
                        e = plus(simd, e, 0.5 * direct, now[s][k]);
                        e = plus(simd, e, 0.5 * direct, before[s][k]);
                    }
                }
                let mut other = times(simd, row[N / 2], z[s][N / 2]);
                e = plus(simd, e, row[0], z[s][0]);
                for i in 1..N / 2 {
                    e = plus(simd, e, row[i], z[s][i]);
                    other = plus(simd, other, row[N / 2 + i], z[s][N / 2 + i]);
                }
                e = simd.add_f32s(e, other);
                for i in 0..N {
                    z[s][i] = simd.sub_f32s(z[s][i], times(simd, row[N + i], e));
                }
                if input.counted[at] {
                    // (EST-4)
                    let whitened = simd.splat_f32s(row[2 * N + F]);
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
    let mut next = [simd.splat_f32s(0.0); N];
    for i in 0..N {
        // Latent forces follow nothing but themselves.
        if i >= N - F {
            next[i] = times(simd, a[i][i], z[i]);
            continue;
        }
        // Two chains of sums wait for each other less than one.
        let mut other = times(simd, b[i][0], before[0]);
        for k in 1..F {
            other = plus(simd, other, b[i][k], before[k]);
        }
        next[i] = times(simd, a[i][0], z[0]);
        other = plus(simd, other, a[i][N / 2], z[N / 2]);
        for k in 1..N / 2 {
            next[i] = plus(simd, next[i], a[i][k], z[k]);
            other = plus(simd, other, a[i][N / 2 + k], z[N / 2 + k]);
        }
        next[i] = simd.add_f32s(next[i], other);
    }
    next
}
