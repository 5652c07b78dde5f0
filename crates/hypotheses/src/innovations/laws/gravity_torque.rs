//! The load has weight.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Sine and cosine of the load's angle.
pub(super) struct GravityTorqueColumns;

impl EffectLaw for GravityTorqueColumns {
    fn id(&self) -> &'static str {
        "gravity-torque"
    }
    fn shapes(&self, _: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        vec![LawShape::new("load", "weight", &[])]
    }
    fn terms(&self, along: &JointAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let (unit, n) = (along.unit, along.gear_ratio);
        let of = |f: fn(f64) -> f64| along.on_load(|r| r.by_node(|t| unit * f(r.load[t] / n)));
        Some(LawTerms::new(vec![(of(f64::sin), 0.0, 0.5), (of(f64::cos), 0.0, 0.5)], false))
    }
}
