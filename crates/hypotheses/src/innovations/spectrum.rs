//! Orders of ripple, gear error and eccentricity: peaks in the spectra of the scores over the motor's angle.

use std::f64::consts::PI;

use realfft::{RealFftPlanner, RealToComplex};

use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::numeric::median;
use trueup_estimation::innovations::recording::NodeRecording;

use super::along::PlantAlong;

/// Orders below which the spectrum has [`BINS`] bins of the angle in a turn, with how many peaks of each kind are kept in which
/// band: slow orders are strong where anything drifts, and would hide the others.
const BANDS: [([f64; 2], usize); 2] = [([0.2, 0.4], 1), ([0.4, 12.5], 4)];
/// Bins of the angle in a turn, for these bands.
const BINS: f64 = 64.0;
/// Highest order of all.
const HIGHEST: f64 = 400.0;
/// Peaks of each kind among the orders above those bands.
const FAST_PEAKS: usize = 4;
/// Half the width of the running median, in orders.
const NEAR: f64 = 0.25;

/// Orders per turn of the motor at which the scores peak.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct OrderPeaks {
    /// Of the torque of the motor.
    pub ripple: Vec<f64>,
    /// Of the error of the gear.
    pub gear: Vec<f64>,
    /// Of the reading of the motor's angle.
    pub reading: Vec<f64>,
}

impl OrderPeaks {
    /// Of a frame's scores.
    pub fn of(frame: &InnovationsFrame, along: &PlantAlong<'_>) -> Self {
        let mut all = Self::default();
        all.add(&OrderSpectra::new(frame, along, BINS), &BANDS);
        let [_, usual] = BANDS[1].0;
        let highest = sampled_order(frame).min(HIGHEST);
        if highest > usual {
            all.add(&OrderSpectra::new(frame, along, 2.5 * highest), &[([usual, highest], FAST_PEAKS)]);
        }
        all
    }

    fn add(&mut self, spectra: &OrderSpectra, bands: &[([f64; 2], usize)]) {
        for (to, power) in
            [&mut self.ripple, &mut self.gear, &mut self.reading].into_iter().zip(&spectra.powers)
        {
            for (band, peaks) in bands {
                to.extend(spectra.peaks(power, *band, *peaks));
            }
        }
    }
}

/// Order of which nodes show two points a period at the median speed of sliding. Above it, at that speed, a lower order looks the
/// same.
fn sampled_order(frame: &InnovationsFrame) -> f64 {
    let sliding = |r: &NodeRecording| -> Vec<f64> {
        let speed = r.state(1);
        (0..r.nodes).filter(|t| r.signs.mode[*t] == 0).map(|t| (speed[t] * r.dt).abs()).collect()
    };
    let steps: Vec<f64> = frame.runs.iter().flat_map(sliding).collect();
    if steps.is_empty() { 0.0 } else { PI / (median(steps) + 1e-300) }
}

/// Power of the scores by order, summed over recordings.
struct OrderSpectra {
    /// Torque of the motor, error of the gear, reading of the motor's angle.
    powers: [Vec<f64>; 3],
    /// From one order to the next.
    step: f64,
}

impl OrderSpectra {
    /// With these bins of the angle in a turn.
    fn new(frame: &InnovationsFrame, along: &PlantAlong<'_>, bins_of_turn: f64) -> Self {
        let joint = &along.joints[0];
        let width = 2.0 * PI / bins_of_turn;
        let bins = (joint.range / width * 4.0 + 64.0).log2().ceil().exp2() as usize;
        let mut powers = [(); 3].map(|()| vec![0.0; bins / 2 + 1]);
        let reading = frame.intake.channel_of(0).map_or(0, |c| frame.coordinates() + c);
        let fft = RealFftPlanner::<f64>::new().plan_fft_forward(bins);
        for run in &frame.runs {
            let (motor, load, shown) = (run.score(0), run.score(1), run.score(reading));
            let angle = run.state(0);
            let least = angle.iter().copied().fold(f64::INFINITY, f64::min);
            let slides = |t: usize| f64::from(u8::from(run.signs.mode[t] == 0));
            let kinds: [&dyn Fn(usize) -> f64; 3] =
                [&|t| motor[t] * slides(t), &|t| joint.stiffness * (load[t] - motor[t] * slides(t)), &|t| {
                    shown[t]
                }];
            for (power, kind) in powers.iter_mut().zip(kinds) {
                add_power(power, &*fft, (least, width), &angle, kind);
            }
        }
        Self { powers, step: 2.0 * PI / (bins as f64 * width) }
    }

    /// Orders of the highest peaks between two orders: as many over the running median, and as many as they are.
    fn peaks(&self, power: &[f64], [low, high]: [f64; 2], peaks: usize) -> Vec<f64> {
        let order = |k: usize| k as f64 * self.step;
        let inside: Vec<usize> = (0..power.len()).filter(|k| order(*k) > low && order(*k) < high).collect();
        if inside.is_empty() {
            return Vec::new();
        }
        let half = ((NEAR / self.step) as usize).max(1);
        let q: Vec<f64> = inside.iter().map(|k| power[*k]).collect();
        let largest = q.iter().copied().fold(0.0, f64::max);
        let middle = running_median(&q, half);
        let over = q.iter().zip(middle).map(|(q, m)| q / (m + 1e-30 * largest + 1e-300)).collect();
        let all = highest(over, peaks).into_iter().chain(highest(q, peaks));
        all.map(|i| order(inside[i])).collect()
    }
}

/// Adds the power by order of a series over an angle, by node, summed in bins from the least angle on, of this width.
pub(super) fn add_power(
    power: &mut [f64],
    fft: &dyn RealToComplex<f64>,
    (least, width): (f64, f64),
    angle: &[f64],
    of_node: impl Fn(usize) -> f64,
) {
    let mut series = fft.make_input_vec();
    for (t, angle) in angle.iter().enumerate() {
        if let Some(x) = series.get_mut(((angle - least) / width) as usize) {
            *x += of_node(t);
        }
    }
    let mut spectrum = fft.make_output_vec();
    // Lengths are those that were planned.
    if fft.process(&mut series, &mut spectrum).is_ok() {
        power.iter_mut().zip(&spectrum).for_each(|(p, z)| *p += z.norm_sqr());
    }
}

/// These orders in addition to usual ones: to four digits, increasing, each once.
pub fn with_usual(peaks: &[f64], usual: &[f64]) -> Vec<f64> {
    let rounded = |x: &f64| (x * 1e4).round_ties_even() / 1e4;
    let mut all: Vec<f64> = peaks.iter().chain(usual).map(rounded).collect();
    all.sort_unstable_by(f64::total_cmp);
    all.dedup();
    all
}

/// Median of `2 half + 1` values, reflected at the ends. Values in the window are counted by their ranks in a Fenwick tree.
fn running_median(q: &[f64], half: usize) -> Vec<f64> {
    let n = q.len();
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| q[*a].total_cmp(&q[*b]));
    let mut rank = vec![0; n];
    order.iter().enumerate().for_each(|(r, k)| rank[*k] = r);
    let reflected = |k: isize| {
        let k = k.rem_euclid(2 * n as isize) as usize;
        if k < n { k } else { 2 * n - 1 - k }
    };
    let mut tree = vec![0isize; n + 1];
    let add = |tree: &mut Vec<isize>, k: isize, by: isize| {
        let mut i = rank[reflected(k)] + 1;
        while i <= n {
            tree[i] += by;
            i += i & i.wrapping_neg();
        }
    };
    let top = (n + 1).next_power_of_two() / 2;
    let middle = |tree: &[isize]| {
        let (mut i, mut left, mut step) = (0, half as isize + 1, top);
        while step > 0 {
            if i + step <= n && tree[i + step] < left {
                i += step;
                left -= tree[i];
            }
            step /= 2;
        }
        q[order[i.min(n - 1)]]
    };
    let half = half as isize;
    (-half..=half).for_each(|k| add(&mut tree, k, 1));
    let mut out = Vec::with_capacity(n);
    for k in 0..n as isize {
        out.push(middle(&tree));
        add(&mut tree, k - half, -1);
        add(&mut tree, k + half + 1, 1);
    }
    out
}

/// Indices of the highest values, none within 8 of another.
pub(super) fn highest(mut y: Vec<f64>, peaks: usize) -> Vec<usize> {
    let mut out = Vec::new();
    for _ in 0..peaks {
        let best = y.iter().enumerate().fold(None, |m: Option<(usize, f64)>, (i, v)| match m {
            Some((_, b)) if b >= *v => m,
            _ => Some((i, *v)),
        });
        let Some((i, _)) = best else { break };
        out.push(i);
        let end = (i + 9).min(y.len());
        y[i.saturating_sub(8)..end].fill(0.0);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_running_median_is_that_of_the_sorted_window() {
        let q: Vec<f64> = (0..50).map(|k| f64::from(k * 37 % 50 / 2)).collect();
        let at = |k: i32| {
            q[if k < 0 {
                -1 - k
            } else if k > 49 {
                99 - k
            } else {
                k
            } as usize]
        };
        for (k, m) in running_median(&q, 3).iter().enumerate() {
            let mut window: Vec<f64> = (k as i32 - 3..=k as i32 + 3).map(at).collect();
            window.sort_by(f64::total_cmp);
            assert_eq!(*m, window[3]);
        }
    }
}
