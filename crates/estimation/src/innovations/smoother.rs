//! Smoothed states of a recording (modified Bryson-Frazier), with the scores of its forces and readings.

use super::filter::{DataColumn, FilterGains, Square, arrays, row};
use super::kernel::{SizeError, SizedKernel, run};

/// A smoothed recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SmoothedRecording {
    /// States with latents, `size` numbers a node.
    pub states: Vec<f64>,
    /// d log p / d (force of each coordinate, reading error of each channel), by node.
    pub scores: Vec<f64>,
}

/// Smooths a recording; `data` has its forces as they push and its first state.
///
/// # Errors
/// Where no kernel has these sizes.
pub fn smooth_recording(gains: &FilterGains<'_>, data: &DataColumn) -> Result<SmoothedRecording, SizeError> {
    run(gains.input.size(), gains.input.forces, Smoothing { gains, data })
}

struct Smoothing<'a> {
    gains: &'a FilterGains<'a>,
    data: &'a DataColumn,
}

impl SizedKernel for Smoothing<'_> {
    type Output = SmoothedRecording;
    #[inline(always)]
    fn run<const N: usize, const F: usize>(self) -> SmoothedRecording {
        smooth::<N, F>(self.gains, self.data)
    }
}

#[inline(always)]
fn smooth<const N: usize, const F: usize>(g: &FilterGains<'_>, data: &DataColumn) -> SmoothedRecording {
    let input = &g.input;
    let (nodes, channels) = (input.mode.len(), input.channels);
    let width = F + channels;
    let steps: Vec<(Square<N>, [[f64; F]; N])> = input.steps.iter().map(arrays).collect();
    let mut predicted = vec![[0.0; N]; nodes];
    let mut errors = vec![0.0; nodes * channels];
    let mut x: [f64; N] = row(&data.first, 0);
    let force = |t: usize| -> [f64; F] { core::array::from_fn(|k| data.forces[k][t]) };
    for t in 0..nodes {
        let before = if t > 0 { force(t - 1) } else { [0.0; F] };
        if t > 0 {
            let (a, b) = &steps[usize::from(input.mode[t - 1])];
            x = core::array::from_fn(|i| {
                let pushed: f64 = (0..F).map(|k| b[i][k] * before[k]).sum();
                pushed + (0..N).map(|k| a[i][k] * x[k]).sum::<f64>()
            });
        }
        predicted[t] = x;
        let now = force(t);
        for at in channels * t..channels * (t + 1) {
            if input.variance[at] <= 0.0 {
                continue;
            }
            let mut e = data.readings[at];
            e -= (0..F).map(|k| 0.5 * input.rows.direct[F * at + k] * (now[k] + before[k])).sum::<f64>();
            e -= (0..N).map(|i| input.rows.h[N * at + i] * x[i]).sum::<f64>();
            errors[at] = e;
            (0..N).for_each(|i| x[i] += g.gain[N * at + i] * e);
        }
    }
    let (mut states, mut scores) = (vec![0.0; N * nodes], vec![0.0; width * nodes]);
    let mut l = [0.0; N];
    for t in (0..nodes).rev() {
        for c in (0..channels).rev() {
            let at = channels * t + c;
            if input.variance[at] <= 0.0 {
                continue;
            }
            let s = errors[at] / g.variance[at] + (0..N).map(|i| g.gain[N * at + i] * l[i]).sum::<f64>();
            (0..N).for_each(|i| l[i] -= input.rows.h[N * at + i] * s);
            scores[width * t + F + c] = s;
            for k in 0..F {
                let direct = 0.5 * input.rows.direct[F * at + k] * s;
                scores[width * t + k] += direct;
                if t > 0 {
                    scores[width * (t - 1) + k] += direct;
                }
            }
        }
        let p = &g.predicted[N * N * t..N * N * (t + 1)];
        for i in 0..N {
            let corrected: f64 = (0..N).map(|k| p[N * i + k] * l[k]).sum();
            states[N * t + i] = predicted[t][i] - corrected;
        }
        if t > 0 {
            let (a, b) = &steps[usize::from(input.mode[t - 1])];
            for k in 0..F {
                scores[width * (t - 1) + k] -= (0..N).map(|i| b[i][k] * l[i]).sum::<f64>();
            }
            l = core::array::from_fn(|i| (0..N).map(|k| a[k][i] * l[k]).sum());
        }
    }
    SmoothedRecording { states, scores }
}
