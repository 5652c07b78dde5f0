//! A reading drifts with time.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `time` (saturates with the time constant `time` in s, with a line), form `later` (a line that begins after the share `k` of the
/// longest recording, with a line from the beginning), form `late` (the same, with what settles from there), form `line` (with its
/// square), form `wander` (period `time` in s).
pub(super) struct SensorDriftColumns {
    /// Time constants that are looked for, s.
    times: &'static [f64],
    /// Form of what begins later, and the shares after which it does.
    later: (&'static str, &'static [f64]),
    /// Periods, s; none: neither `line` nor `wander`.
    periods: &'static [f64],
    /// Whether a drift is that of the node; else of the time of the reading.
    at_nodes: bool,
    /// Prior standard deviations.
    deviations: [f64; 2],
    /// First steps of the search: of a time, of a share.
    steps: [f64; 2],
}

/// Time constant with which form `late` settles, s.
const SETTLES: f64 = 0.5;
/// Longest recordings in which a drift along a line is the beginning of one that settles.
const LONG: f64 = 10.0;

impl SensorDriftColumns {
    pub(super) const JOINT: Self = Self {
        times: &[1.0, 2.0, 3.5, 6.0],
        later: ("later", &[0.2, 0.35, 0.5, 0.65, 0.8]),
        periods: &[],
        at_nodes: true,
        deviations: [5.0, 5.0],
        steps: [0.3, 0.2],
    };
    pub(super) const ARM: Self = Self {
        times: &[1.5, 3.0, 6.0],
        later: ("late", &[0.12, 0.25, 0.4, 0.55, 0.7]),
        periods: &[5.0, 7.0, 9.0, 12.0],
        at_nodes: false,
        deviations: [1.5, 0.7],
        steps: [0.25, 0.25],
    };
}

impl EffectLaw for SensorDriftColumns {
    fn id(&self) -> &'static str {
        "sensor-drift"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let mut forms = Vec::new();
        forms.extend(self.times.iter().map(|x| ("time", vec![("time", *x)])));
        forms.extend(self.later.1.iter().map(|x| (self.later.0, vec![("k", *x)])));
        if !self.periods.is_empty() {
            forms.push(("line", Vec::new()));
        }
        forms.extend(self.periods.iter().map(|x| ("wander", vec![("time", *x)])));
        forms.into_iter().flat_map(|(form, values)| sensor::shapes(along, form, &values)).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let channel = *sensor::channels(along, shape).first()?;
        let (unit, duration) = (along.channels[channel].error, along.duration);
        let of = |f: &dyn Fn(f64) -> f64| {
            let at =
                |k: usize, t: usize, time: f64| if self.at_nodes { along.runs[k].times[t] } else { time };
            along.of_reading(channel, |k, t, time| unit * f(at(k, t, time)))
        };
        let (time, begin) = (shape.value("time"), shape.value("k") * duration);
        let later = |t: f64| (t - begin).max(0.0);
        let line = |t: f64| t / duration;
        let [sd, other] = self.deviations;
        // (COL-24)
        let terms = match shape.form {
            "time" => [(of(&|t| 1.0 - (-t / time).exp()), sd), (of(&line), other)],
            "later" => [(of(&|t| later(t) / duration), sd), (of(&line), other)],
            "late" => {
                let settles = of(&|t| 1.0 - (-later(t) / SETTLES).exp());
                [(of(&|t| later(t) / duration), sd), (settles, other)]
            }
            "wander" => {
                let turn = 2.0 * std::f64::consts::PI / time;
                [(of(&|t| (turn * t).sin()), sd), (of(&|t| (turn * t).cos() - 1.0), sd)]
            }
            _ => [(of(&line), sd), (of(&|t| line(t).powi(2)), other)],
        };
        Some(LawTerms::new(terms.map(|(column, sd)| (column, 0.0, sd)).to_vec(), &[]))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        let names = [("time", self.steps[0]), ("k", self.steps[1])];
        let own = names.into_iter().filter(|(name, _)| shape.get(name).is_some());
        own.map(|(name, step)| Refinement::relative(name, step)).collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (duration, a) = (fit.along.duration, [0, 1].map(|k| fit.amplitude(k) * fit.reading_unit()));
        let (time, begin) = (fit.number("time"), fit.number("k") * duration);
        // Rate, time constant and begin of what is larger: the form, or its line. What goes to and fro begins as it does.
        let larger = |form: f64, line: f64| form.abs() > line.abs();
        let line = [a[1] / duration, LONG * duration, 0.0];
        let [rate, settles, start] = match fit.shape.form {
            "time" if larger(a[0] / time, line[0]) => [a[0] / time, time, 0.0],
            "later" if larger(a[0], a[1]) => [a[0] / duration, LONG * duration, begin],
            "late" if larger(a[0] * (1.0 - fit.number("k")), a[1]) => {
                [a[0] / duration, LONG * duration, begin]
            }
            "late" => [a[1] / SETTLES, SETTLES, begin],
            "line" => [(a[0] + a[1]) / duration, LONG * duration, 0.0],
            "wander" => [2.0 * std::f64::consts::PI * a[0] / time, 0.25 * time, 0.0],
            _ => line,
        };
        vec![
            LawValue::new("driftRate", rate),
            LawValue::new("driftTime", settles),
            LawValue::new("driftStart", start),
        ]
    }
}
