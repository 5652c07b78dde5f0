//! A cable pulls on the load.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// A line over the load's angle, with companions of other powers.
pub(super) struct CableStiffnessColumns;

impl EffectLaw for CableStiffnessColumns {
    fn id(&self) -> &'static str {
        "cable-stiffness"
    }
    fn shapes(&self, _: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        vec![LawShape::new("load", "powers", &[])]
    }
    fn terms(&self, along: &JointAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let unit = along.unit;
        let size = along.gear_ratio * along.sizes.load_angle;
        let of = |p: i32| along.on_load(|r| r.by_node(|t| unit * (r.load[t] / size).powi(p)));
        let terms = vec![(of(1), -0.2, 0.5), (of(0), 0.0, 0.3), (of(3), 0.0, 0.2), (of(2), 0.0, 0.1)];
        Some(LawTerms::new(terms, false))
    }
}
