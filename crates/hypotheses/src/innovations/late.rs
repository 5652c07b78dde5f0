//! A late channel in a frame of its own: its readings are put back by whole nodes, and the rest of the delay is a column.

use std::cell::RefCell;
use std::rc::Rc;

use trueup_estimation::innovations::frame::InnovationsFrame;

use super::candidate::applied;
use super::hypothesis::{FittedEffect, SharedFrame};
use super::joint_along::UsualSizes;
use super::laws::law_of;
use super::shape::LawShape;

/// Delays tried first, s.
const DELAYS: [f64; 5] = [0.002, 0.006, 0.012, 0.024, 0.048];
/// Least and largest delay, s.
const BOUNDS: [f64; 2] = [2e-4, 0.09];
/// First step of the search, relative, its shrinking, and its rounds.
const SEARCH: (f64, f64, usize) = (0.35, 0.55, 4);
/// Nats that the prior of a delay costs, about.
const PRIOR: f64 = 3.0;

/// Frames of several delays, of which the best is kept.
struct DelaySearch<'a> {
    of: &'a InnovationsFrame,
    channel: usize,
    /// Parameters and intensities with which frames begin.
    start: &'a [f64],
    q: &'a [f64],
    tried: Vec<(f64, f64)>,
    best: Option<(f64, InnovationsFrame)>,
}

impl DelaySearch<'_> {
    fn frame(&self, delay: f64) -> InnovationsFrame {
        let f = self.of;
        let mut z = InnovationsFrame::new(&f.intake, f.plant.clone(), Some((self.channel, delay)));
        z.start.copy_from_slice(self.start);
        z.theta.copy_from_slice(self.start);
        (z.rest, z.creep, z.white, z.scale) = (f.rest, f.creep, f.white, f.scale);
        z.q = self.q.to_vec();
        z.q = z.settle_signs(self.q, 2);
        z
    }
    fn look(&mut self, delay: f64) {
        let delay = (delay.clamp(BOUNDS[0], BOUNDS[1]) * 1e5).round_ties_even() / 1e5;
        if self.tried.iter().any(|t| t.0 == delay) {
            return;
        }
        let z = self.frame(delay);
        self.tried.push((delay, z.evidence));
        if self.best.as_ref().is_none_or(|b| z.evidence > b.1.evidence) {
            self.best = Some((delay, z));
        }
    }
}

/// Where the search for a delay begins.
#[derive(Clone, Copy)]
pub struct DelayStart<'a> {
    /// By how much a screen has the channel late, or its drive, s.
    pub delay: f64,
    /// Parameters; `None`: those with which hypotheses begin.
    pub theta: Option<&'a [f64]>,
}

/// The hypothesis that a channel is late.
pub fn late_channel(
    frame: &SharedFrame,
    place: &'static str,
    sizes: &UsualSizes,
    q: &[f64],
    begin: DelayStart<'_>,
) -> Option<FittedEffect> {
    let screened = begin.delay;
    let f = frame.borrow().clone();
    let channel = place.strip_prefix("sensor:").and_then(|name| f.intake.channel(name));
    let (Some(channel), Some(law)) = (channel, law_of("sensor-delay")) else { return None };
    let mut search = DelaySearch { of: &f, channel, start: &f.start, q, tried: Vec::new(), best: None };
    // What a frame gains without a delay is none.
    let mut undelayed = search.frame(0.0);
    undelayed.settle(true);
    search.start = begin.theta.unwrap_or(&f.start);
    let mut first: Vec<f64> = DELAYS.iter().copied().chain([screened]).collect();
    first.sort_unstable_by(f64::total_cmp);
    for delay in first {
        search.look(delay);
    }
    let mut step = SEARCH.0;
    for _ in 0..SEARCH.2 {
        let best = search.best.as_ref().map_or(screened, |b| b.0);
        search.look(best * (1.0 - step));
        search.look(best * (1.0 + step));
        step *= SEARCH.1;
    }
    let parts = vec![(law, LawShape::new(place, "rest", &[]))];
    let make = |f: &InnovationsFrame| applied(&parts, f, sizes);
    let (delay, z) = search.best.take()?;
    let half = |z: &InnovationsFrame| 0.5 * z.runs.first().map_or(0.0, |r| r.dt);
    let fitted = |mut z: InnovationsFrame| {
        z.settle(true);
        let fit = z.fit(&make, &z.q.clone(), 4, true);
        z.start.clone_from(&fit.theta);
        (z, fit)
    };
    let (z, fit) = fitted(z);
    let rest = |fit: &trueup_estimation::innovations::fixed_point::FixedPoint| {
        fit.amplitudes.first().copied().unwrap_or(0.0)
    };
    let moved = ((delay + half(&z) * rest(&fit)) * 1e7).round_ties_even() / 1e7;
    // Where nothing moved the frame goes on as it is.
    let next = if moved == delay { z } else { search.frame(moved) };
    let (z, fit) = fitted(next);
    let delay = moved + half(&z) * rest(&fit);
    let evidence = fit.evidence - PRIOR - (undelayed.evidence - f.evidence).max(0.0);
    Some(FittedEffect {
        id: "sensor-delay",
        place,
        shape: LawShape::new(place, "delay", &[("d", delay)]),
        parts,
        evidence,
        of_fit: fit.evidence,
        fit,
        frame: Rc::new(RefCell::new(z)),
    })
}
