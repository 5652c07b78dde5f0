//! Smoothed states of a recording (modified Bryson-Frazier), with the scores of its forces and readings.

use pulp::Simd;

use super::any_smoother;
use super::filter::{Square, arrays, dot, error_of, moved, row};
use super::filter_data::{DataColumn, FilterGains, SmoothedRecording};
use super::kernel::{SizedKernel, run, run_any_size};

/// Smooths a recording; `data` has its forces as they push and its first state.
pub fn smooth_recording(gains: &FilterGains<'_>, data: &DataColumn) -> SmoothedRecording {
    run(gains.input.sizes(), Smoothing { gains, data, powers: false })
}

/// The same with the powers of the latents' scores.
pub fn smooth_with_powers(gains: &FilterGains<'_>, data: &DataColumn) -> SmoothedRecording {
    run_any_size(Smoothing { gains, data, powers: true })
}

struct Smoothing<'a> {
    gains: &'a FilterGains<'a>,
    data: &'a DataColumn,
    powers: bool,
}

impl SizedKernel for Smoothing<'_> {
    type Output = SmoothedRecording;
    #[inline(always)]
    fn run<S: Simd, const N: usize, const F: usize>(self, _: S) -> SmoothedRecording {
        smooth::<N, F>(self.gains, self.data)
    }
    #[inline(always)]
    fn run_any<S: Simd>(self, _: S) -> SmoothedRecording {
        any_smoother::smooth(self.gains, self.data, self.powers)
    }
}

#[inline(always)]
fn smooth<const N: usize, const F: usize>(g: &FilterGains<'_>, data: &DataColumn) -> SmoothedRecording {
    let input = &g.input;
    let (nodes, channels) = (input.order.nodes(), input.channels);
    let width = F + channels;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let mut predicted = vec![[0.0; N]; nodes];
    let mut errors = vec![0.0; nodes * channels];
    let mut x: [f64; N] = row(&data.first, 0);
    let mut before = [0.0; F];
    for t in 0..nodes {
        if t > 0 {
            x = moved(&steps[input.order.after(t - 1)], &x, &before);
        }
        predicted[t] = x;
        let now: [f64; F] = data.force(t);
        for at in channels * t..channels * (t + 1) {
            if input.variance[at] <= 0.0 {
                continue;
            }
            let e = error_of(input.rows, at, data.readings[at], &x, [&now, &before]);
            errors[at] = e;
            let gain: [f64; N] = row(&g.gain, at);
            for i in 0..N {
                x[i] += gain[i] * e;
            }
        }
        before = now;
    }
    let (mut states, mut scores) = (vec![0.0; N * nodes], vec![0.0; width * nodes]);
    let mut l = [0.0; N];
    for t in (0..nodes).rev() {
        for c in (0..channels).rev() {
            let at = channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let (h, gain): ([f64; N], [f64; N]) = (row(&input.rows.h, at), row(&g.gain, at));
            let s = errors[at] / g.variance[at] + dot(&gain, &l);
            for i in 0..N {
                l[i] -= h[i] * s;
            }
            scores[width * t + F + c] = s;
            for k in 0..F {
                let direct = 0.5 * input.rows.direct[F * at + k] * s;
                scores[width * t + k] += direct;
                if t > 0 {
                    scores[width * (t - 1) + k] += direct;
                }
            }
        }
        for i in 0..N {
            let p: [f64; N] = row(&g.predicted, N * t + i);
            states[N * t + i] = predicted[t][i] - dot(&p, &l); // (EST-6)
        }
        if t > 0 {
            let (a, b) = &steps[input.order.after(t - 1)];
            let mut earlier = [0.0; N];
            for k in 0..N {
                for i in 0..F {
                    scores[width * (t - 1) + i] -= b[k][i] * l[k];
                }
                for i in 0..N {
                    earlier[i] += a[k][i] * l[k];
                }
            }
            l = earlier;
        }
    }
    SmoothedRecording { states, scores, powers: Vec::new() }
}
