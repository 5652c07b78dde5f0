//! Orders of the motor's shaft that stand out in what is missing.

use trueup_models::effect::Plant;
use trueup_models::{arm, joint};

use super::hypothesis::Hypothesis;
use super::problem::Compared;
use super::search::{Fitted, Search};
use trueup_identification::sizes::range;
use trueup_numerics::order::descending;

/// Orders that are looked at closely.
const CLOSELY: usize = 2;
/// Highest order.
const HIGHEST: f64 = 40.0;
/// Over more turns than this lines are too narrow to be scanned for: whole and half orders only.
const TURNS: f64 = 60.0;
/// Readings whose pointers turn together.
const BLOCK: usize = 128;

impl Search<'_> {
    /// Where to look for the order of a cause that repeats with the shaft; `None`: the recordings cannot be followed.
    pub(crate) fn orders(&self, base: &Fitted, h: &Hypothesis) -> Option<Vec<f64>> {
        let problem = self.compare(&base.stated);
        let (mut power, mut step): (Vec<[f64; 3]>, f64) = (Vec::new(), 0.0);
        for run in 0..self.case.train.len() {
            let led = &self.led[run];
            let missing = problem.missing(run, &base.theta).ok()?;
            let (channel, factor) = self.shaft(led.channels.iter().map(|c| c.output), h)?;
            // The motor's own balance where it is measured.
            let phase: Vec<f64> =
                led.channels[channel].y[led.counts.clone()].iter().map(|y| y * factor).collect();
            let turns = range(&phase) / std::f64::consts::TAU;
            if power.is_empty() {
                step = if turns < TURNS { 0.4 / turns.max(1.0) } else { 0.5 };
                power = vec![[0.0; 3]; (HIGHEST / step) as usize];
            }
            let plain = led.counted(&missing[channel]);
            // Differences bring out fast lines, the series itself slow ones; a gear error goes with the torque it carries.
            let mut quick: Vec<f64> = plain.windows(2).map(|w| w[1] - w[0]).collect();
            quick.push(0.0);
            let mut drives = self.case.subject.drives(h.site).filter_map(|input| led.inputs.get(input));
            let drive = drives.find(|u| !u.is_empty());
            let carried: Vec<f64> = drive.map_or_else(
                || vec![0.0; plain.len()],
                |u| u[led.counts.clone()].iter().zip(&plain).map(|(u, v)| u * v).collect(),
            );
            add_lines(&mut power, step, &phase, [&plain, &quick, &carried]);
        }
        let mut looks = Vec::new();
        for which in 0..3 {
            let at = |k: usize| power.get(k).map_or(0.0, |p| p[which]);
            let peak = |k: &usize| at(*k) >= k.checked_sub(1).map_or(0.0, at) && at(*k) >= at(k + 1);
            let mut best: Vec<usize> = (0..power.len()).filter(peak).collect();
            descending(&mut best, |item| at(*item));
            looks.extend(best.into_iter().take(CLOSELY).map(|k| (k + 1) as f64 * step));
        }
        // What stands out may be the double of an order. Counts of a coarse encoder repeat with the angle too.
        looks.extend(looks.clone().into_iter().map(|k| 0.5 * k));
        let (coarsest, finest) = (self.coarsest(h), self.finest(h));
        looks.retain(|k| (coarsest..=finest).contains(k));
        looks.sort_by(f64::total_cmp);
        looks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        Some(looks)
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

    /// The lowest order that comes round twice in some recording: what does not is no repeat.
    pub(crate) fn coarsest(&self, h: &Hypothesis) -> f64 {
        let turns = |run: &Compared| {
            let (channel, factor) = self.shaft(run.run.channels.iter().map(|c| c.output), h)?;
            Some(range(&run.run.channels[channel].y) * factor.abs() / std::f64::consts::TAU)
        };
        let most = self.case.train.iter().filter_map(turns).fold(0.0, f64::max);
        // A sensor's error is known to come round with its own turn.
        let known = h.sensed(self.case).is_some() || most == 0.0;
        h.least_order().max(if known { 0.0 } else { 2.0 / most })
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

/// Adds to `power` how much of each series goes with `step`, twice that, ... times the phase, as a share of the whole.
fn add_lines(power: &mut [[f64; 3]], step: f64, phase: &[f64], series: [&[f64]; 3]) {
    let mut sums = vec![[[0.0; 2]; 3]; power.len()];
    let (mut turn, mut at) = ([[0.0; 2]; BLOCK], [[0.0; 2]; BLOCK]);
    // Each order turns the pointers of the one before by as much again.
    for (block, phase) in phase.chunks(BLOCK).enumerate() {
        for (turn, p) in turn.iter_mut().zip(phase) {
            let (s, c) = (step * p).sin_cos();
            *turn = [c, s];
        }
        at.fill([1.0, 0.0]);
        let values = |of: &[f64]| -> [f64; BLOCK] {
            let mut all = [0.0; BLOCK];
            all.iter_mut().zip(&of[block * BLOCK..]).for_each(|(a, v)| *a = *v);
            all
        };
        let [plain, quick, carried] = [values(series[0]), values(series[1]), values(series[2])];
        for sums in &mut sums {
            for i in 0..BLOCK {
                let ([c, s], [dc, ds]) = (at[i], turn[i]);
                at[i] = [c * dc - s * ds, s * dc + c * ds];
                for (sum, v) in sums.iter_mut().zip([plain[i], quick[i], carried[i]]) {
                    sum[0] += v * at[i][0];
                    sum[1] += v * at[i][1];
                }
            }
        }
    }
    let whole = series.map(|s| s.iter().map(|v| v * v).sum::<f64>().max(f64::MIN_POSITIVE));
    for (power, sums) in power.iter_mut().zip(sums) {
        (0..3).for_each(|k| power[k] += (sums[k][0].powi(2) + sums[k][1].powi(2)) / whole[k]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_fourier_sums_over_the_angle() {
        let phase: Vec<f64> = (0..1000).map(|k| 40.0 * (0.003 * f64::from(k)).sin()).collect();
        let series: Vec<f64> = phase.iter().map(|p| (3.0 * p + 0.4).sin() + 0.2 * (7.5 * p).cos()).collect();
        let squares: Vec<f64> = series.iter().map(|v| v * v).collect();
        let mut power = vec![[0.0; 3]; 100];
        add_lines(&mut power, 0.1, &phase, [&series, &squares, &vec![0.0; 1000]]);
        for (k, power) in power.iter().enumerate() {
            let order = 0.1 * (k + 1) as f64;
            for (found, series) in power.iter().zip([&series, &squares]) {
                let (mut a, mut b, mut whole) = (0.0, 0.0, 0.0);
                for (v, p) in series.iter().zip(&phase) {
                    (a, b, whole) = (a + v * (order * p).sin(), b + v * (order * p).cos(), whole + v * v);
                }
                let exact = (a * a + b * b) / whole;
                assert!((found - exact).abs() < 1e-9 * (1.0 + exact), "order {order}: {found}, not {exact}");
            }
            assert_eq!(power[2], 0.0);
        }
        let strongest = (0..100).max_by(|a, b| power[*a][0].total_cmp(&power[*b][0]));
        assert_eq!(strongest, Some(29));
    }
}
