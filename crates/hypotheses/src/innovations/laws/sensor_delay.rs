//! A reading is late.

use trueup_estimation::innovations::column::FilterColumn;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `delay` by `d` s, of one channel or of all that one instrument reads; form `rest`: half a step per unit amplitude, of a channel
/// that was put back already.
pub(super) struct SensorDelayColumns {
    /// Delays that are looked for, s.
    delays: &'static [f64],
    /// First step of the search.
    step: f64,
    /// Whether the trajectory is as late as the readings: then it shows now what they show after the delay.
    follows: bool,
}

impl SensorDelayColumns {
    pub(super) const JOINT: Self = Self {
        delays: &[
            0.0007, 0.0012, 0.002, 0.0032, 0.005, 0.0075, 0.01, 0.015, 0.02, 0.027, 0.035, 0.045, 0.06, 0.08,
        ],
        step: 0.15,
        follows: true,
    };
    pub(super) const ARM: Self = Self {
        delays: &[0.003, 0.006, 0.012, 0.02, 0.03, 0.045, 0.065, 0.09, 0.13, 0.19, 0.27, 0.38, 0.5],
        step: 0.2,
        follows: false,
    };
}

/// A reading error of each of these channels.
fn of_all(channels: &[usize], error: impl Fn(usize) -> FilterColumn) -> FilterColumn {
    let mut all = channels.iter().map(|c| error(*c));
    let Some(mut column) = all.next() else { return Vec::new() };
    for more in all {
        column.iter_mut().zip(more).for_each(|(part, more)| part.readings.extend(more.readings));
    }
    column
}

impl EffectLaw for SensorDelayColumns {
    fn id(&self) -> &'static str {
        "sensor-delay"
    }
    fn is_late(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for group in &along.late_together {
            let place = along.channels[group[0]].place;
            let shape = |d: &f64| LawShape::new(place, "delay", &[("d", *d)]).of(group);
            all.extend(self.delays.iter().map(shape));
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let channels = sensor::channels(along, shape);
        if channels.is_empty() {
            return None;
        }
        if shape.form == "rest" {
            let rest = |c: usize| {
                along.of_reading(c, |k, t, _| -0.5 * along.runs[k].steps[t] * along.shown_rate(k, c, t))
            };
            return Some(LawTerms::new(vec![(of_all(&channels, rest), 0.0, 1.0)], &[]));
        }
        let d = shape.value("d");
        // (COL-23)
        let [now, then] = if self.follows { [0.0, d] } else { [-d, 0.0] };
        let late = |c: usize| {
            let at = |k: usize, time: f64| along.shown_at(k, c, time);
            along.of_reading(c, |k, _, time| at(k, time + now) - at(k, time + then))
        };
        Some(LawTerms::of_fixed_size(of_all(&channels, late), 0.15))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        shape.get("d").map(|_| Refinement::relative("d", self.step)).into_iter().collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        // Of a channel that was put back by `d`, what is left is half a step per unit amplitude.
        let step = fit.along.runs.first().map_or(0.0, |r| r.steps[0]);
        let rest = if fit.put_back { 0.5 * step * fit.amplitude(0) } else { 0.0 };
        vec![LawValue::new("delay", (fit.number("d") + rest).max(0.0))]
    }
}
