//! Friction that grows with the torque that is transmitted.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Per unit of the spring's torque.
pub(super) struct LoadDependentFrictionColumns;

impl EffectLaw for LoadDependentFrictionColumns {
    fn id(&self) -> &'static str {
        "load-dependent-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let own = along.frame.dry_level() > 0.0 && along.stiffness > 0.0;
        own.then(|| LawShape::new("motor-friction", "torque", &[])).into_iter().collect()
    }
    fn terms(&self, along: &JointAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let (k, d) = (along.stiffness, along.damping);
        let column = along.on_motor(|w, i| -w.sign[i] * (k * w.twist[i] + d * w.twist_rate[i]).abs());
        Some(LawTerms::new(vec![(column, 0.15, 0.2)], true))
    }
}
