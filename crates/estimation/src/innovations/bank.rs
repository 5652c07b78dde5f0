//! Gains at several intensities at once: one recursion, an intensity in each lane.
//!
//! The recursion waits for its own results; lanes that do not wait for each other cost little more than one of them.

use pulp::Simd;

use super::any_size;
use super::filter::{Square, arrays, row};
use super::filter_data::{FilterGains, FilterInput, Riccati};
use super::kernel::{SizedKernel, run};

/// Intensities that are filtered side by side.
pub const BANK: usize = 8;

type WideSquare<S, const N: usize> = [[<S as Simd>::f64s; N]; N];

/// Gains for inputs of one recording that differ in noise, variances of readings and first covariance only; without the
/// covariances that a smoother needs. The same numbers as [`FilterGains::new`] has, but for rounding.
pub fn gains_of_bank(inputs: Vec<FilterInput<'_>>) -> Vec<FilterGains<'_>> {
    let mut out = Vec::with_capacity(inputs.len());
    let mut left = inputs.into_iter().peekable();
    while left.peek().is_some() {
        let mut some: Vec<FilterInput<'_>> = left.by_ref().take(BANK).collect();
        if some.len() == 1 {
            out.extend(some.pop().map(|one| FilterGains::new(one, false)));
            continue;
        }
        let (size, sizes) = (some[0].size(), some[0].sizes());
        let rows = some[0].variance.len();
        let mut gains: Vec<(Vec<f64>, Vec<f64>)> =
            some.iter().map(|_| (vec![0.0; rows * size], vec![1.0; rows])).collect();
        run(sizes, BankRecursion { inputs: &some, gains: &mut gains });
        let made = some.into_iter().zip(gains);
        out.extend(made.map(|(input, (gain, variance))| FilterGains {
            input,
            gain: gain.into(),
            variance: variance.into(),
            predicted: Vec::new(),
        }));
    }
    out
}

struct BankRecursion<'a, 'b> {
    inputs: &'a [FilterInput<'b>],
    /// Gain and variance of each.
    gains: &'a mut [(Vec<f64>, Vec<f64>)],
}

impl SizedKernel for BankRecursion<'_, '_> {
    type Output = ();
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(self, simd: S) {
        let some = self.inputs.chunks(S::F64_LANES).zip(self.gains.chunks_mut(S::F64_LANES));
        for (inputs, gains) in some {
            recursion::<S, N, F>(simd, inputs, gains);
        }
    }
    #[inline(always)]
    fn run_any<S: Simd>(self, _: S) {
        for (input, (gain, variance)) in self.inputs.iter().zip(self.gains) {
            any_size::riccati(Riccati { input, gain, variance, predicted: None });
        }
    }
}

/// A number of each input, side by side; lanes without an input repeat the last.
#[inline(always)]
fn beside<S: Simd>(simd: S, inputs: &[FilterInput<'_>], of: impl Fn(&FilterInput<'_>) -> f64) -> S::f64s {
    let mut out = simd.splat_f64s(0.0);
    let last = inputs.len() - 1;
    for (lane, x) in pulp::bytemuck::cast_slice_mut(core::slice::from_mut(&mut out)).iter_mut().enumerate() {
        *x = of(&inputs[lane.min(last)]);
    }
    out
}

/// A matrix of each input, side by side.
#[inline(always)]
fn squares<S: Simd, const N: usize>(
    simd: S,
    inputs: &[FilterInput<'_>],
    of: impl Fn(&FilterInput<'_>, usize) -> f64,
) -> WideSquare<S, N> {
    core::array::from_fn(|i| core::array::from_fn(|j| beside(simd, inputs, |input| of(input, N * i + j))))
}

/// `sum` plus `factor` times `x`, not fused.
#[inline(always)]
fn plus<S: Simd>(simd: S, sum: S::f64s, factor: f64, x: S::f64s) -> S::f64s {
    simd.add_f64s(sum, simd.mul_f64s(simd.splat_f64s(factor), x))
}

#[inline(always)]
fn recursion<S: Simd, const N: usize, const F: usize>(
    simd: S,
    inputs: &[FilterInput<'_>],
    gains: &mut [(Vec<f64>, Vec<f64>)],
) {
    let shared = &inputs[0];
    let steps: Vec<(Square<N>, [[f64; F]; N])> = shared.steps.iter().map(arrays::<N, F>).collect();
    let mut noise: Vec<WideSquare<S, N>> = Vec::with_capacity(steps.len());
    for mode in 0..steps.len() {
        noise.push(squares(simd, inputs, |input, at| input.noise[mode][at]));
    }
    let mut p: WideSquare<S, N> = squares(simd, inputs, |input, at| input.first[at]);
    let (on, position) = shared.unknown_on;
    let alike = inputs.iter().all(|input| input.variance == shared.variance);
    for t in 0..shared.order.nodes() {
        if t > 0 {
            let mode = shared.order.after(t - 1);
            let unknown = (shared.unknown[t - 1], on, position);
            p = predicted::<S, N, F>(simd, &p, &steps[mode], &noise[mode], unknown);
        }
        for at in shared.channels * t..shared.channels * (t + 1) {
            if shared.variance[at] <= 0.0 {
                continue;
            }
            let h: [f64; N] = row(&shared.rows.h, at);
            let own = shared.variance[at];
            let r =
                if alike { simd.splat_f64s(own) } else { beside(simd, inputs, |input| input.variance[at]) };
            let (s, k) = correct::<S, N>(simd, &mut p, &h, r);
            let s: &[f64] = pulp::bytemuck::cast_slice(core::slice::from_ref(&s));
            let k: &[f64] = pulp::bytemuck::cast_slice(&k);
            for (w, (gain, variance)) in gains.iter_mut().enumerate() {
                variance[at] = s[w];
                for i in 0..N {
                    gain[N * at + i] = k[S::F64_LANES * i + w];
                }
            }
        }
    }
}

/// One step on: A P A' + Q, and the variance `x` of an unknown force.
#[inline(always)]
fn predicted<S: Simd, const N: usize, const F: usize>(
    simd: S,
    p: &WideSquare<S, N>,
    (a, b): &(Square<N>, [[f64; F]; N]),
    noise: &WideSquare<S, N>,
    (x, on, position): (f64, usize, usize),
) -> WideSquare<S, N> {
    // Latent forces follow nothing but themselves. Loops whose ends are known are unrolled.
    let mut moved = *p;
    for i in 0..N - F {
        for j in 0..N {
            let mut sum = simd.splat_f64s(0.0);
            for k in 0..N {
                sum = plus(simd, sum, a[i][k], p[k][j]);
            }
            moved[i][j] = sum;
        }
    }
    for i in N - F..N {
        for j in 0..N {
            moved[i][j] = simd.mul_f64s(simd.splat_f64s(a[i][i]), p[i][j]);
        }
    }
    let mut next = *noise;
    for i in 0..N {
        for j in 0..=i {
            let mut sum = simd.add_f64s(noise[i][j], simd.splat_f64s(x * b[i][on] * b[j][on]));
            if j < N - F {
                for k in 0..N {
                    sum = plus(simd, sum, a[j][k], moved[i][k]);
                }
            } else {
                sum = plus(simd, sum, a[j][j], moved[i][j]);
            }
            (next[i][j], next[j][i]) = (sum, sum);
        }
    }
    // When within the step it acted is not known either.
    let late = simd.splat_f64s(0.1 * x * b[position][on].powi(2));
    next[position][position] = simd.add_f64s(next[position][position], late);
    next
}

/// A reading of row `h` and variance `r`: the variance of its innovation, and its gains.
#[inline(always)]
fn correct<S: Simd, const N: usize>(
    simd: S,
    p: &mut WideSquare<S, N>,
    h: &[f64; N],
    r: S::f64s,
) -> (S::f64s, [S::f64s; N]) {
    let zero = simd.splat_f64s(0.0);
    let (mut g, mut expected) = ([zero; N], zero);
    for i in 0..N {
        for j in 0..N {
            g[j] = plus(simd, g[j], h[i], p[i][j]);
        }
    }
    for i in 0..N {
        expected = plus(simd, expected, h[i], g[i]);
    }
    let s = simd.add_f64s(r, expected);
    let inverse = simd.div_f64s(simd.splat_f64s(1.0), s);
    let mut k = g;
    for i in 0..N {
        k[i] = simd.mul_f64s(g[i], inverse);
    }
    for i in 0..N {
        for j in 0..=i {
            p[i][j] = simd.sub_f64s(p[i][j], simd.mul_f64s(k[i], g[j]));
            p[j][i] = p[i][j];
        }
    }
    (s, k)
}
