//! Which orders of a shaft recordings can show.

use std::f64::consts::{PI, TAU};

use trueup_models::effect::{PlantKind, SEARCHED_ORDERS};
use trueup_models::{arm, joint};

use super::hypothesis::Hypothesis;
use super::problem::Compared;
use super::search::CaseSearch;
use trueup_identification::run::{IdentificationRun, OutputChannel};
use trueup_identification::sizes::range;

/// Share of the readings that are slow enough for an order to show: two of them or more a period.
const SLOW: f64 = 0.25;

impl CaseSearch<'_> {
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
