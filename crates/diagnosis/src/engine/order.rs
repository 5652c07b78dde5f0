//! Orders of the motor's shaft that stand out in what is missing.

use trueup_models::effect::Plant;
use trueup_models::{arm, joint};

use super::hypothesis::Hypothesis;
use super::problem::Unknown;
use super::search::{Fitted, Search};

/// Orders that are looked at closely.
const CLOSELY: usize = 2;
/// Highest order.
const HIGHEST: f64 = 40.0;
/// Over more turns than this lines are too narrow to be scanned for: whole and half orders only.
const TURNS: f64 = 60.0;

impl Search<'_> {
    /// Which unknown of a cause is an order of the shaft, and where to look for it, best first.
    pub(crate) fn orders(
        &self,
        base: &Fitted,
        h: &Hypothesis,
        unknowns: &[Unknown],
    ) -> Option<(usize, Vec<f64>)> {
        let at =
            unknowns.iter().position(|u| u.name.split('[').next().is_some_and(|n| n.ends_with("Order")))?;
        let problem = self.compare(&base.stated);
        let mut power: Vec<(f64, [f64; 3])> = Vec::new();
        for run in 0..self.case.train.len() {
            let led = &self.led[run];
            let missing = problem.missing(run, &base.theta).ok()?;
            let (channel, factor) = self.shaft(led.channels.iter().map(|c| c.output), h)?;
            // The motor's own balance where it is measured.
            let phase: Vec<f64> =
                led.channels[channel].y[led.counts.clone()].iter().map(|y| y * factor).collect();
            let turns = phase.iter().fold(f64::NEG_INFINITY, |m, v| m.max(*v))
                - phase.iter().fold(f64::INFINITY, |m, v| m.min(*v));
            let turns = turns / std::f64::consts::TAU;
            if power.is_empty() {
                let step = if turns < TURNS { 0.4 / turns.max(1.0) } else { 0.5 };
                power = (1..=(HIGHEST / step) as usize).map(|k| (k as f64 * step, [0.0; 3])).collect();
            }
            let plain = led.counted(&missing[channel]);
            // Differences bring out fast lines, the series itself slow ones; a gear error goes with the torque it carries.
            let quick: Vec<f64> = plain.windows(2).map(|w| w[1] - w[0]).collect();
            let drive = led.inputs.iter().skip(self.driven(h)).find(|u| !u.is_empty());
            let carried: Vec<f64> = drive.map_or_else(Vec::new, |u| {
                u[led.counts.clone()].iter().zip(&plain).map(|(u, v)| u * v).collect()
            });
            for (which, series) in [&plain, &quick, &carried].into_iter().enumerate() {
                let whole: f64 = series.iter().map(|v| v * v).sum::<f64>().max(f64::MIN_POSITIVE);
                for (order, sums) in &mut power {
                    let (mut a, mut b) = (0.0, 0.0);
                    for (v, p) in series.iter().zip(&phase) {
                        let (s, c) = (*order * p).sin_cos();
                        a += v * s;
                        b += v * c;
                    }
                    sums[which] += (a * a + b * b) / whole;
                }
            }
        }
        let mut looks = Vec::new();
        for which in 0..3 {
            let at = |k: usize| power.get(k).map_or(0.0, |p| p.1[which]);
            let peak = |k: &usize| at(*k) >= k.checked_sub(1).map_or(0.0, at) && at(*k) >= at(k + 1);
            let mut best: Vec<usize> = (0..power.len()).filter(peak).collect();
            best.sort_by(|a, b| at(*b).total_cmp(&at(*a)));
            looks.extend(best.into_iter().take(CLOSELY).map(|k| power[k].0));
        }
        // What stands out may be the double of an order. Counts of a coarse encoder repeat with the angle too.
        looks.extend(looks.clone().into_iter().map(|k| 0.5 * k));
        looks.retain(|k| *k <= self.finest(h));
        looks.sort_by(f64::total_cmp);
        looks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        Some((at, looks))
    }

    /// The highest order that the counts of the encoders show, in eight counts a period.
    pub(crate) fn finest(&self, h: &Hypothesis) -> f64 {
        let runs = &self.case.train;
        let counts = runs.iter().filter_map(|run| {
            let outputs = run.run.channels.iter().map(|c| c.output);
            let (channel, factor) = self.shaft(outputs, h)?;
            let resolution = run.run.channels[channel].resolution * factor;
            (resolution > 0.0).then(|| std::f64::consts::TAU / resolution / 8.0)
        });
        counts.fold(HIGHEST, f64::min)
    }

    /// The input that drives a joint.
    fn driven(&self, h: &Hypothesis) -> usize {
        match self.case.subject.plant {
            Plant::Joint => joint::input::MOTOR_CURRENT,
            Plant::Arm => arm::input::joint_torque(self.case.subject.joints()) + h.site,
        }
    }

    /// The channel that shows the motor of a joint, and turns of the shaft per unit of it; of a sensor's error its own.
    fn shaft(&self, outputs: impl Iterator<Item = usize>, h: &Hypothesis) -> Option<(usize, f64)> {
        let all: Vec<usize> = outputs.collect();
        let find = |o: usize| all.iter().position(|x| *x == o);
        if let Some(own) = h.sensed(self.case) {
            return find(own).map(|c| (c, 1.0));
        }
        match self.case.subject.plant {
            Plant::Joint => {
                let n = self.case.nominal[joint::parameter::GEAR_RATIO];
                find(joint::output::MOTOR_ANGLE)
                    .map(|c| (c, 1.0))
                    .or_else(|| find(joint::output::LOAD_ANGLE).map(|c| (c, n)))
            }
            Plant::Arm => {
                let n = self.case.subject.joints();
                let ratio = self.case.nominal[arm::parameter::gear_ratio(n) + h.site];
                find(arm::output::motor_angle(n) + h.site)
                    .or_else(|| find(arm::output::joint_angle(n) + h.site))
                    .map(|c| (c, ratio))
            }
        }
    }
}
