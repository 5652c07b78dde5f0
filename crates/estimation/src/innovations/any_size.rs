//! Filter and columns for any sizes: states, then latent forces, then latent errors of the readings.
//!
//! What the plant does couples states and latent forces; a latent follows nothing but itself. Rows are slices, so that the
//! compiler takes them by vectors.

use pulp::Simd;

use super::filter_data::{DataColumn, FilterGains, FilterInput, FilterLane, LANES, LaneStream, Riccati};

/// Sizes of an input.
#[derive(Clone, Copy)]
pub(super) struct AnySizes {
    /// States with latents.
    pub(super) all: usize,
    /// States without latents.
    pub(super) plain: usize,
    /// States without latents, and latent forces: what a step couples.
    pub(super) coupled: usize,
    /// Coordinates.
    pub(super) forces: usize,
}

impl AnySizes {
    pub(super) fn of(input: &FilterInput<'_>) -> Self {
        let (plain, forces) = (input.plain(), input.forces);
        Self { all: input.size(), plain, coupled: plain + forces, forces }
    }
}

/// Sums that a product of vectors has side by side.
const SIDE: usize = 8;

/// Product of two vectors of the same length. The order of its sums does not depend on the vector units of the processor.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(SIDE), b.chunks_exact(SIDE));
    let mut sum = 0.0;
    for (a, b) in a.remainder().iter().zip(b.remainder()) {
        sum += a * b;
    }
    let mut sums = [0.0; SIDE];
    for (a, b) in a.zip(b) {
        for i in 0..SIDE {
            sums[i] += a[i] * b[i];
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    sum + (((a + e) + (c + g)) + ((b + f) + (d + h)))
}

/// `to` plus `factor` times `x`.
#[inline(always)]
pub(super) fn add(to: &mut [f64], factor: f64, x: &[f64]) {
    for (to, x) in to.iter_mut().zip(x) {
        *to += factor * x;
    }
}

/// `to` = sum of `factors` times the first rows of a matrix; what is added up stays in registers.
#[inline(always)]
pub(super) fn combine(to: &mut [f64], factors: &[f64], rows: &[f64], width: usize) {
    let mut first = 0;
    let mut blocks = to.chunks_exact_mut(SIDE);
    for to in &mut blocks {
        let mut sums = [0.0; SIDE];
        for (k, factor) in factors.iter().enumerate() {
            let row = &rows[width * k + first..][..SIDE];
            for i in 0..SIDE {
                sums[i] += factor * row[i];
            }
        }
        to.copy_from_slice(&sums);
        first += SIDE;
    }
    let to = blocks.into_remainder();
    to.fill(0.0);
    for (k, factor) in factors.iter().enumerate() {
        add(to, *factor, &rows[width * k + first..][..to.len()]);
    }
}

/// Gains and variances of the innovations.
#[inline(always)]
pub(super) fn riccati(out: Riccati<'_>) {
    let Riccati { input, gain, variance, mut predicted } = out;
    let n = AnySizes::of(input);
    let (all, plain) = (n.all, n.plain);
    let mut p = input.first.clone();
    let (mut moved, mut next) = (vec![0.0; all * plain], vec![0.0; plain * plain]);
    let (mut g, mut k) = (vec![0.0; all], vec![0.0; all]);
    if let Some(kept) = predicted.as_mut() {
        kept.reserve_exact(all * all * input.order.nodes());
    }
    for t in 0..input.order.nodes() {
        if t > 0 {
            predict(input, n, t - 1, &mut p, &mut moved, &mut next);
        }
        if let Some(kept) = predicted.as_mut() {
            kept.extend(&p);
        }
        for at in input.channels * t..input.channels * (t + 1) {
            let r = input.variance[at];
            if r <= 0.0 {
                continue;
            }
            let h = &input.rows.h[all * at..all * (at + 1)];
            g.fill(0.0);
            for (i, h) in h.iter().enumerate().filter(|(_, h)| **h != 0.0) {
                // The covariance is symmetric: by its rows.
                add(&mut g, *h, &p[all * i..all * (i + 1)]);
            }
            let s = r + dot(h, &g);
            k.iter_mut().zip(&g).for_each(|(k, g)| *k = g / s);
            for (i, k) in k.iter().enumerate() {
                add(&mut p[all * i..all * (i + 1)], -k, &g);
            }
            gain[all * at..all * (at + 1)].copy_from_slice(&k);
            variance[at] = s;
        }
    }
}

/// Covariance one step on: A P A' + Q, and the variance of an unknown force.
#[inline(always)]
fn predict(
    input: &FilterInput<'_>,
    n: AnySizes,
    t: usize,
    p: &mut [f64],
    moved: &mut [f64],
    next: &mut [f64],
) {
    let (all, plain) = (n.all, n.plain);
    let at = input.order.after(t);
    let (step, q) = (&input.steps[at], &input.noise[at]);
    let unknown = input.unknown.get(t).copied().unwrap_or(0.0);
    let (on, position) = input.unknown_on;
    let a = |i: usize| &step.a[all * i..all * (i + 1)];
    let pushed = |i: usize| step.b[n.forces * i + on];
    for i in 0..plain {
        combine(&mut moved[all * i..all * (i + 1)], &a(i)[..n.coupled], p, all);
    }
    for i in 0..plain {
        for j in 0..=i {
            let sum = dot(&moved[all * i..][..n.coupled], &a(j)[..n.coupled]) + q[all * i + j];
            let sum = if unknown > 0.0 { sum + unknown * pushed(i) * pushed(j) } else { sum };
            (next[plain * i + j], next[plain * j + i]) = (sum, sum);
        }
    }
    for l in plain..all {
        let kept = a(l)[l];
        for j in 0..plain {
            let x = kept * moved[all * j + l];
            (p[all * l + j], p[all * j + l]) = (x, x);
        }
        for m in plain..all {
            p[all * l + m] = kept * a(m)[m] * p[all * l + m] + q[all * l + m];
        }
    }
    for i in 0..plain {
        p[all * i..][..plain].copy_from_slice(&next[plain * i..][..plain]);
    }
    if unknown > 0.0 {
        // When within the step it acted is not known either.
        p[(all + 1) * position] += 0.1 * unknown * pushed(position).powi(2);
    }
}

/// A state one step on, with the force of the step.
#[inline(always)]
pub(super) fn moved(
    input: &FilterInput<'_>,
    n: AnySizes,
    t: usize,
    x: &mut [f64],
    next: &mut [f64],
    data: &DataColumn,
) {
    let step = &input.steps[input.order.after(t)];
    for (i, next) in next[..n.plain].iter_mut().enumerate() {
        let pushed: f64 = (0..n.forces).map(|k| step.b[n.forces * i + k] * data.forces[k][t]).sum();
        let own = dot(&step.a[n.all * i..][..n.coupled], &x[..n.coupled]);
        *next = own + pushed + step.defect.get(i).copied().unwrap_or(0.0);
    }
    x[..n.plain].copy_from_slice(&next[..n.plain]);
    for (l, x) in x.iter_mut().enumerate().skip(n.plain) {
        *x *= step.a[(n.all + 1) * l];
    }
}

/// A reading less what forces and state say of it.
#[inline(always)]
pub(super) fn error_of(input: &FilterInput<'_>, n: AnySizes, at: usize, x: &[f64], data: &DataColumn) -> f64 {
    let t = at / input.channels;
    let direct = &input.rows.direct[n.forces * at..n.forces * (at + 1)];
    let pushed = direct.iter().enumerate().filter(|(_, d)| **d != 0.0).map(|(k, d)| {
        let before = if t > 0 { data.forces[k][t - 1] } else { 0.0 };
        0.5 * d * (data.forces[k][t] + before)
    });
    data.readings[at] - pushed.sum::<f64>() - dot(&input.rows.h[n.all * at..n.all * (at + 1)], x)
}

/// Whitened innovations of the data.
#[inline(always)]
pub(super) fn data(g: &FilterGains<'_>, data: &DataColumn, out: &mut [f64]) {
    let input = &g.input;
    let n = AnySizes::of(input);
    let (mut x, mut next) = (data.first.clone(), vec![0.0; n.all]);
    for t in 0..input.order.nodes() {
        if t > 0 {
            moved(input, n, t - 1, &mut x, &mut next, data);
        }
        for at in input.channels * t..input.channels * (t + 1) {
            if input.variance[at] <= 0.0 {
                continue;
            }
            let e = error_of(input, n, at, &x, data);
            add(&mut x, e, &g.gain[n.all * at..n.all * (at + 1)]);
            if input.counted[at] {
                out[at] = e / g.variance[at].sqrt(); // (EST-3)
            }
        }
    }
}

/// `to` plus `factor` times `x`, all lanes.
#[inline(always)]
fn add_lanes<S: Simd>(simd: S, to: &mut FilterLane, factor: f64, x: &FilterLane) {
    let factor = simd.splat_f32s(factor as f32);
    for (to, x) in S::as_mut_simd_f32s(to).0.iter_mut().zip(S::as_simd_f32s(x).0) {
        *to = simd.add_f32s(*to, simd.mul_f32s(factor, *x));
    }
}

/// Sum of `factors` times `rows`, all lanes; what is added up stays in registers.
#[inline(always)]
fn combine_lanes<S: Simd>(simd: S, to: &mut FilterLane, factors: &[f64], rows: &[FilterLane]) {
    for (part, to) in S::as_mut_simd_f32s(to).0.iter_mut().enumerate() {
        let mut sum = simd.splat_f32s(0.0);
        for (factor, row) in factors.iter().zip(rows) {
            let x = S::as_simd_f32s(row).0[part];
            sum = simd.add_f32s(sum, simd.mul_f32s(simd.splat_f32s(*factor as f32), x));
        }
        *to = sum;
    }
}

/// Whitened innovations of a block of columns.
#[inline(always)]
pub(super) fn lanes<S: Simd>(simd: S, stream: &mut LaneStream<'_>) {
    const ZERO: FilterLane = [0.0; LANES];
    let (gains, block) = (stream.gains, stream.block);
    let input = &gains.input;
    let n = AnySizes::of(input);
    let (mut z, mut next) = (vec![ZERO; n.all], vec![ZERO; n.plain]);
    let force = |k: usize, t: usize| block.forces[k].get(t).unwrap_or(&ZERO);
    for t in 0..input.order.nodes() {
        if t > 0 {
            let step = &input.steps[input.order.after(t - 1)];
            for (i, next) in next.iter_mut().enumerate() {
                combine_lanes(simd, next, &step.a[n.all * i..][..n.coupled], &z);
                for k in (0..n.forces).filter(|k| !block.forces[*k].is_empty()) {
                    add_lanes(simd, next, step.b[n.forces * i + k], force(k, t - 1));
                }
            }
            z[..n.plain].copy_from_slice(&next);
            for (l, z) in z.iter_mut().enumerate().skip(n.plain) {
                let kept = step.a[(n.all + 1) * l] as f32;
                z.iter_mut().for_each(|z| *z *= kept);
            }
        }
        for c in 0..input.channels {
            let at = input.channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let mut e = *block.readings[c].get(t).unwrap_or(&ZERO);
            for (k, d) in input.rows.direct[n.forces * at..][..n.forces].iter().enumerate() {
                if *d != 0.0 {
                    add_lanes(simd, &mut e, 0.5 * d, force(k, t));
                    if t > 0 {
                        add_lanes(simd, &mut e, 0.5 * d, force(k, t - 1));
                    }
                }
            }
            let h = input.rows.h[n.all * at..][..n.all].iter().zip(&z);
            h.filter(|(h, _)| **h != 0.0).for_each(|(h, z)| add_lanes(simd, &mut e, *h, z));
            for (z, gain) in z.iter_mut().zip(&gains.gain[n.all * at..]) {
                add_lanes(simd, z, -gain, &e);
            }
            if input.counted[at] {
                // (EST-4)
                let whitened = (1.0 / gains.variance[at].sqrt()) as f32;
                stream.out[at] = e.map(|e| e * whitened);
            }
        }
    }
}
