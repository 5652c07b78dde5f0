//! The drive follows its command late: a first-order lag, or a dead time.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// `lag` or `delay` in s.
pub(super) struct ActuatorLagColumns;

const LAGS: [f64; 12] = [0.0012, 0.002, 0.0032, 0.005, 0.008, 0.014, 0.02, 0.028, 0.038, 0.05, 0.065, 0.09];
const DELAYS: [f64; 14] =
    [0.0007, 0.0012, 0.002, 0.0032, 0.005, 0.008, 0.012, 0.016, 0.02, 0.026, 0.032, 0.04, 0.05, 0.06];

impl EffectLaw for ActuatorLagColumns {
    fn id(&self) -> &'static str {
        "actuator-lag"
    }
    fn shapes(&self, _: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let lags = LAGS.iter().map(|x| LawShape::new("actuator", "lag", &[("lag", *x)]));
        let delays = DELAYS.iter().map(|x| LawShape::new("actuator", "delay", &[("delay", *x)]));
        lags.chain(delays).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let column = match shape.get("lag") {
            Some(lag) => along.of_current(|i| i.lagged(lag)),
            None => along.of_current(|i| i.delayed(shape.value("delay"))),
        };
        Some(LawTerms::of_fixed_size(column, 0.15))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        vec![if shape.form == "lag" {
            Refinement::relative("lag", 0.25)
        } else {
            Refinement::relative("delay", 0.2)
        }]
    }
}
