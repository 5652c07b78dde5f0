//! Dry friction of the motor where the nominal model has none.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Level, with a viscous companion.
pub(super) struct MotorFrictionColumns;

impl EffectLaw for MotorFrictionColumns {
    fn id(&self) -> &'static str {
        "motor-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let own = along.frame.dry_level() > 0.0;
        (!own).then(|| LawShape::new("motor-friction", "level", &[])).into_iter().collect()
    }
    fn terms(&self, along: &JointAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let (unit, usual) = (along.unit, along.sizes.motor_speed);
        let dry = along.on_motor(|w, i| -unit * w.sign[i]);
        let viscous = along.on_motor(|w, i| -unit * w.speed[i] / usual);
        Some(LawTerms::new(vec![(dry, 0.3, 0.5), (viscous, 0.3, 0.5)], true))
    }
}
