//! The load has weight.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Sine and cosine of the attitude of a joint's link, on all joints up to it.
pub(super) struct GravityTorqueColumns {
    /// Prior standard deviation of the amplitudes.
    deviation: f64,
}

impl GravityTorqueColumns {
    pub(super) const JOINT: Self = Self { deviation: 0.5 };
    pub(super) const ARM: Self = Self { deviation: 0.7 };
}

impl EffectLaw for GravityTorqueColumns {
    fn id(&self) -> &'static str {
        "gravity-torque"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let held = if along.base.is_some() { 0 } else { along.joints.len() };
        (0..held).map(|k| LawShape::new("load", "weight", &[]).at(&[k])).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let unit = along.joints[shape.joint()].torque;
        let of = |f: fn(f64) -> f64| {
            along.up_to_link(shape.joint(), |attitude| attitude.iter().map(|x| unit * f(*x)).collect())
        };
        // (COL-14)
        let (sin, cos) = (of(f64::sin), of(f64::cos));
        Some(LawTerms::new(vec![(sin, 0.0, self.deviation), (cos, 0.0, self.deviation)], &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let [sine, cosine] = [0, 1].map(|k| fit.amplitude(k) * fit.place().torque * fit.place().turns);
        vec![
            LawValue::new("gravityTorque", sine.hypot(cosine)),
            LawValue::new("gravityAngle", cosine.atan2(-sine)),
        ]
    }
}
