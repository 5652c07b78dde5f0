//! Orders of ripple at the motors of a chain: peaks in the spectrum of the score of a motor's torque over its angle.

use realfft::RealFftPlanner;

use trueup_estimation::innovations::numeric::quantile;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;

use super::spectrum::{OrderPeaks, add_power, highest};

/// Highest order of all.
const HIGHEST: f64 = 450.0;
/// Turns of an order within the range of the motor, at least.
const TURNS: f64 = 4.0;
/// Step of the angle that is reached or exceeded so often at nodes is the shortest wave of two bins.
const LONG_STEPS: f64 = 0.9;
/// Peaks, and the number of orders below which there are none.
const PEAKS: (usize, usize) = (3, 20);

/// Of each joint of a frame.
pub fn chain_orders(frame: &TrajectoryFrame) -> Vec<OrderPeaks> {
    let of = |motor: &usize| OrderPeaks { ripple: peaks(frame, *motor), ..OrderPeaks::default() };
    frame.plant.drives.iter().map(of).collect()
}

fn peaks(frame: &TrajectoryFrame, motor: usize) -> Vec<f64> {
    let width = frame.coordinates() + frame.channels();
    let angle = |k: usize| -> Vec<f64> {
        let r = &frame.runs[k];
        (0..r.nodes.len()).map(|t| r.q(t)[motor]).collect()
    };
    let angles: Vec<Vec<f64>> = (0..frame.runs.len()).map(angle).collect();
    let (low, high) = angles.iter().flatten().fold((f64::MAX, f64::MIN), |(a, b), q| (a.min(*q), b.max(*q)));
    let (span, steps) = (high - low, angles.iter().flat_map(|q| q.windows(2).map(|w| (w[1] - w[0]).abs())));
    let bin = 0.5 * quantile(steps.collect(), LONG_STEPS).max(1e-6);
    let bins = (TURNS * span / bin + 64.0).log2().ceil().exp2() as usize;
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(bins);
    let mut power = vec![0.0; bins / 2 + 1];
    for (r, angle) in frame.runs.iter().zip(&angles) {
        let score = |t: usize| r.scores.get(width * t + motor).copied().unwrap_or(0.0);
        add_power(&mut power, &*fft, (low, bin), angle, score);
    }
    let order = |k: usize| 2.0 * std::f64::consts::PI * k as f64 / (bins as f64 * bin);
    let inside: Vec<usize> =
        (0..power.len()).filter(|k| order(*k) > TURNS / span && order(*k) < HIGHEST).collect();
    if inside.len() <= PEAKS.1 {
        return Vec::new();
    }
    let found = highest(inside.iter().map(|k| power[*k]).collect(), PEAKS.0);
    found.into_iter().map(|i| order(inside[i])).collect()
}
