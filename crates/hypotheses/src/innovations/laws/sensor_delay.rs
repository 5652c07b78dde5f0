//! A reading is late.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `delay` by `d` s; form `rest`: half a step per unit amplitude, of a channel that was put back already.
pub(super) struct SensorDelayColumns;

const DELAYS: [f64; 14] =
    [0.0007, 0.0012, 0.002, 0.0032, 0.005, 0.0075, 0.01, 0.015, 0.02, 0.027, 0.035, 0.045, 0.06, 0.08];

impl EffectLaw for SensorDelayColumns {
    fn id(&self) -> &'static str {
        "sensor-delay"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let at = |place| DELAYS.map(|d| LawShape::new(place, "delay", &[("d", d)]));
        sensor::angles(along).into_iter().flat_map(at).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (channel, state) = sensor::channel(along, shape)?;
        if shape.form == "rest" {
            let speed = |k: usize, t: usize| {
                let r = &along.runs[k];
                if state == 0 { r.motor_speed[t] } else { r.load_speed[t] }
            };
            let column = along.of_reading(channel, |k, t, _| -0.5 * along.runs[k].dt * speed(k, t));
            return Some(LawTerms::new(vec![(column, 0.0, 1.0)], false));
        }
        let d = shape.value("d");
        let column = along.of_reading(channel, |k, _, time| {
            along.angle_at(k, state, time) - along.angle_at(k, state, time + d)
        });
        Some(LawTerms::of_fixed_size(column, 0.15))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        shape.get("d").map(|_| Refinement::relative("d", 0.15)).into_iter().collect()
    }
}
