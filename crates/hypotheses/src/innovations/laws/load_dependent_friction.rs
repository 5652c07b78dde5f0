//! Friction that grows with the torque that is transmitted.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Per unit of the transmitted torque.
pub(super) struct LoadDependentFrictionColumns {
    /// Whether the torque of the drive takes the place of that of the spring.
    drive: bool,
    /// Lengths that are looked for, rad; none: the frame's own dry pair.
    lengths: &'static [f64],
}

impl LoadDependentFrictionColumns {
    pub(super) const JOINT: Self = Self { drive: false, lengths: &[] };
    pub(super) const ARM: Self = Self { drive: true, lengths: &[2e-4, 1e-3] };
}

impl EffectLaw for LoadDependentFrictionColumns {
    fn id(&self) -> &'static str {
        "load-dependent-friction"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let mut shapes = along.at_dry_joints("torque", self.lengths);
        shapes.retain(|s| self.drive || along.joints[s.joint()].stiffness > 0.0);
        shapes
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        // (COL-7)
        let column = along.on_motor_by_run(shape.joint(), |k, m| {
            let z = m.sliding(shape.get("x"));
            let drive = &along.runs[k].drives[shape.joint()];
            let torque = |i: usize| if self.drive { drive.gain * drive.means[i] } else { m.torque[i] };
            m.each(|i| -z[i] * torque(i).abs())
        });
        Some(LawTerms::new(vec![(column, 0.15, 0.2)], &[0]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        vec![LawValue::new("loadFrictionCoefficient", fit.amplitude(0))]
    }
}
