//! Friction that differs by direction.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// A torque against the positive direction wherever it slides; of the frame's own dry pair, or over a length `x` in rad.
pub(super) struct AsymmetricFrictionColumns {
    /// Unit of the amplitude, in usual torques, and its prior standard deviation.
    unit: [f64; 2],
    /// Lengths that are looked for, rad; none: the frame's own dry pair.
    lengths: &'static [f64],
}

impl AsymmetricFrictionColumns {
    pub(super) const JOINT: Self = Self { unit: [1.0, 0.2], lengths: &[] };
    pub(super) const ARM: Self = Self { unit: [0.1, 0.5], lengths: &[2e-4, 1e-3] };
}

impl EffectLaw for AsymmetricFrictionColumns {
    fn id(&self) -> &'static str {
        "asymmetric-friction"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.at_dry_joints("asymmetry", self.lengths)
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let unit = self.unit[0] * along.joints[shape.joint()].torque;
        // (COL-7)
        let column = along.on_motor(shape.joint(), |m| {
            let z = m.sliding(shape.get("x"));
            m.each(|i| -unit * z[i].abs())
        });
        Some(LawTerms::new(vec![(column, 0.0, self.unit[1])], &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let torque = fit.amplitude(0) * self.unit[0] * fit.place().torque;
        vec![LawValue::new("coulombAsymmetry", torque), LawValue::new("viscousAsymmetry", 0.0)]
    }
}
