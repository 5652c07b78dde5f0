//! Orders of the motor's shaft that are prominent in what is missing.

use std::f64::consts::{PI, TAU};

use realfft::RealFftPlanner;
use trueup_models::effect::{PlantKind, SEARCHED_ORDERS};
use trueup_models::{arm, joint};

use super::hypothesis::Hypothesis;
use super::problem::Compared;
use super::search::{CaseSearch, FittedSet};
use trueup_identification::run::{IdentificationRun, OutputChannel};
use trueup_identification::sizes::range;
use trueup_numerics::order::descending;

/// Orders that are looked at closely.
const CLOSELY: usize = 2;
/// Share of the readings that are slow enough for an order to show: two of them or more a period.
const SLOW: f64 = 0.25;
/// Over more turns than this lines are too narrow to be scanned for: whole and half orders only.
const TURNS: f64 = 60.0;
/// Cells of the angle in a period of the highest order: what is spread over four of them errs by 4e-4 there.
const CELLS: usize = 8;

impl CaseSearch<'_> {
    /// Where to look for the order of a cause that repeats with the shaft; `None`: the recordings cannot be followed.
    pub(crate) fn orders(&self, base: &FittedSet, h: &Hypothesis) -> Option<Vec<f64>> {
        let problem = self.compare(&base.stated);
        let (mut power, mut step): (Vec<[f64; 3]>, f64) = (Vec::new(), 0.0);
        for run in 0..self.case.train.len() {
            let prescribed = &self.prescribed[run];
            let missing = problem.missing(run, &base.theta).ok()?;
            let (channel, factor) = self.shaft(prescribed.channels.iter().map(|c| c.output), h)?;
            // The motor's own balance where it is measured.
            let phase: Vec<f64> = prescribed.channels[channel].y[prescribed.counts.clone()]
                .iter()
                .map(|y| y * factor)
                .collect();
            let turns = range(&phase) / TAU;
            if power.is_empty() {
                step = if turns < TURNS { 0.4 / turns.max(1.0) } else { 0.5 };
                power = vec![[0.0; 3]; (self.finest(h) / step) as usize];
            }
            let plain = prescribed.counted(&missing[channel]);
            // Differences bring out fast lines, the series itself slow ones; a gear error goes with the torque it carries.
            let mut quick: Vec<f64> = plain.windows(2).map(|w| w[1] - w[0]).collect();
            quick.push(0.0);
            let mut drives =
                self.case.subject.drives(h.site).filter_map(|input| prescribed.inputs.get(input));
            let drive = drives.find(|u| !u.is_empty());
            let carried: Vec<f64> = drive.map_or_else(
                || vec![0.0; plain.len()],
                |u| u[prescribed.counts.clone()].iter().zip(&plain).map(|(u, v)| u * v).collect(),
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
        // A prominent order may be the double of an order. Counts of a coarse encoder repeat with the angle too.
        looks.extend(looks.clone().into_iter().map(|k| 0.5 * k));
        let (coarsest, finest) = (self.coarsest(h), self.finest(h));
        looks.retain(|k| (coarsest..=finest).contains(k));
        looks.sort_by(f64::total_cmp);
        looks.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        Some(looks)
    }

    /// The highest order that the readings show: in eight counts a period of a coarse encoder, and in two readings a period
    /// while the shaft turns as slowly as in a quarter of some recording.
    pub(crate) fn finest(&self, h: &Hypothesis) -> f64 {
        let shafts: Vec<(&OutputChannel, f64)> =
            self.case.train.iter().filter_map(|run| self.shaft_of(&run.run, h)).collect();
        let counts = shafts.iter().filter_map(|(c, factor)| {
            let resolution = c.resolution * factor;
            (resolution > 0.0).then(|| TAU / resolution / 8.0)
        });
        let sampled = shafts.iter().filter_map(|(c, factor)| Some(PI / (slowest_quarter(c)? * factor)));
        let sampled = sampled.fold(0.0, f64::max);
        let sampled = if sampled > 0.0 { sampled } else { f64::INFINITY };
        counts.fold(SEARCHED_ORDERS[1], f64::min).min(sampled)
    }

    fn shaft_of<'b>(&self, run: &'b IdentificationRun, h: &Hypothesis) -> Option<(&'b OutputChannel, f64)> {
        let (channel, factor) = self.shaft(run.channels.iter().map(|c| c.output), h)?;
        Some((&run.channels[channel], factor.abs()))
    }

    /// In which range orders are looked for, over all causes that have one; `None`: there are none.
    pub(crate) fn searched_orders(&self) -> Option<[f64; 2]> {
        let own = self.causes.iter().filter(|h| h.has_order());
        let each = own.map(|h| [self.coarsest(h).max(SEARCHED_ORDERS[0]), self.finest(h)]);
        each.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
    }

    /// The lowest order that repeats at least once in some recording: what does not is no repeat.
    pub(crate) fn coarsest(&self, h: &Hypothesis) -> f64 {
        let turns = |run: &Compared| {
            let (channel, factor) = self.shaft(run.run.channels.iter().map(|c| c.output), h)?;
            Some(range(&run.run.channels[channel].y) * factor.abs() / TAU)
        };
        let most = self.case.train.iter().filter_map(turns).fold(0.0, f64::max);
        // A sensor's error is known to repeat with its own turn.
        let known = h.sensed(self.case).is_some() || most == 0.0;
        h.least_order().max(if known { 0.0 } else { 2.0 / most })
    }

    /// The largest angle that the shaft of a cause turns through in a recording, rad.
    pub(crate) fn angle_turned(&self, h: &Hypothesis) -> f64 {
        let of = |run: &Compared| self.shaft_of(&run.run, h).map(|(c, factor)| range(&c.y) * factor);
        self.case.train.iter().filter_map(of).fold(0.0, f64::max)
    }

    /// The channel that shows the motor of a joint, and turns of the shaft per unit of it; of a sensor's error its own.
    fn shaft(&self, outputs: impl Iterator<Item = usize>, h: &Hypothesis) -> Option<(usize, f64)> {
        let all: Vec<usize> = outputs.collect();
        let find = |o: usize| all.iter().position(|x| *x == o);
        if let Some(own) = h.sensed(self.case) {
            return find(own).map(|c| (c, 1.0));
        }
        match self.case.subject.plant {
            PlantKind::Joint => {
                let n = self.case.nominal[joint::parameter::GEAR_RATIO];
                find(joint::output::MOTOR_ANGLE)
                    .map(|c| (c, 1.0))
                    .or_else(|| find(joint::output::LOAD_ANGLE).map(|c| (c, n)))
            }
            PlantKind::Arm | PlantKind::Space => {
                let n = self.case.subject.joints();
                let ratio = self.case.nominal[arm::parameter::gear_ratio(n) + h.site];
                find(arm::output::motor_angle(n) + h.site)
                    .or_else(|| find(arm::output::joint_angle(n) + h.site))
                    .map(|c| (c, ratio))
            }
        }
    }
}

/// How far an angle turns between two readings at the most while it is in the slowest quarter of them, as the median of a few
/// readings in a row has it.
fn slowest_quarter(c: &OutputChannel) -> Option<f64> {
    const ROW: usize = 8;
    let mut moved: Vec<f64> = c.y.windows(ROW + 1).map(|w| (w[ROW] - w[0]).abs() / ROW as f64).collect();
    if moved.is_empty() {
        return None;
    }
    let at = ((moved.len() - 1) as f64 * SLOW) as usize;
    let own = *moved.select_nth_unstable_by(at, f64::total_cmp).1;
    (own > 0.0).then_some(own)
}

/// Adds to `power` how much of each series goes with `step`, twice that, ... times the phase, as a share of the whole: sums of
/// Fourier over uneven angles, spread over even ones by cubic splines (Beylkin 1995) and transformed at once.
fn add_lines(power: &mut [[f64; 3]], step: f64, phase: &[f64], series: [&[f64]; 3]) {
    let cells = (CELLS * (power.len() + 1)).next_power_of_two();
    let fft = RealFftPlanner::<f64>::new().plan_fft_forward(cells);
    let (mut grid, mut lines) = (fft.make_input_vec(), fft.make_output_vec());
    for (which, series) in series.into_iter().enumerate() {
        grid.fill(0.0);
        for (p, v) in phase.iter().zip(series) {
            let at = (p * step / TAU).rem_euclid(1.0) * cells as f64;
            let (cell, u) = (at.floor() as usize, at.fract());
            for (k, w) in spline(u).into_iter().enumerate() {
                grid[(cell + cells + k - 1) % cells] += v * w;
            }
        }
        let whole = series.iter().map(|v| v * v).sum::<f64>().max(f64::MIN_POSITIVE);
        if fft.process(&mut grid, &mut lines).is_err() {
            continue;
        }
        for (k, power) in power.iter_mut().enumerate() {
            // What the spline takes off: sinc^4.
            let x = PI * (k + 1) as f64 / cells as f64;
            power[which] += lines[k + 1].norm_sqr() / (x.sin() / x).powi(8) / whole;
        }
    }
}

/// Weights of a cubic spline at `u` between the second and the third of four cells.
fn spline(u: f64) -> [f64; 4] {
    let v = 1.0 - u;
    let inner = |x: f64| 2.0 / 3.0 - x * x * (1.0 - 0.5 * x);
    [v.powi(3) / 6.0, inner(u), inner(v), u.powi(3) / 6.0]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Torque that repeats 300 times a turn, of a shaft that turns five times, found among orders up to 400.
    #[test]
    fn a_high_order_is_found_where_it_is() {
        let phase: Vec<f64> = (0..9000).map(|k| 0.0035 * f64::from(k)).collect();
        let series: Vec<f64> = phase.iter().map(|p| (300.0 * p).sin()).collect();
        let mut power = vec![[0.0; 3]; 5000];
        add_lines(&mut power, 0.08, &phase, [&series, &series, &series]);
        let strongest = (0..5000).max_by(|a, b| power[*a][0].total_cmp(&power[*b][0])).unwrap();
        assert!(((strongest + 1) as f64 * 0.08 - 300.0).abs() < 0.08, "{strongest}");
    }

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
                // Of a series of 1000 readings a line that has all of it comes to 500.
                assert!((found - exact).abs() < 1e-3 * (1.0 + exact), "order {order}: {found}, not {exact}");
            }
            assert_eq!(power[2], 0.0);
        }
        let strongest = (0..100).max_by(|a, b| power[*a][0].total_cmp(&power[*b][0]));
        assert_eq!(strongest, Some(29));
    }
}
