//! Friction that differs by direction.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// A torque against the positive direction wherever it slides.
pub(super) struct AsymmetricFrictionColumns;

impl EffectLaw for AsymmetricFrictionColumns {
    fn id(&self) -> &'static str {
        "asymmetric-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let own = along.frame.dry_level() > 0.0;
        own.then(|| LawShape::new("motor-friction", "asymmetry", &[])).into_iter().collect()
    }
    fn terms(&self, along: &JointAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let unit = along.unit;
        let column = along.on_motor(|w, i| -unit * w.sign[i].abs());
        Some(LawTerms::new(vec![(column, 0.0, 0.2)], false))
    }
}
