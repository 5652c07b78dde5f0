//! The drive gives no more than a limit.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::place::JointPlace;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// `limit` in the unit of the recorded input.
pub(super) struct CurrentSaturationColumns {
    /// Limits that are looked for, in largest drives.
    limits: &'static [f64],
    /// Prior standard deviation of the amplitude.
    deviation: f64,
    /// First step of the search.
    step: f64,
}

impl CurrentSaturationColumns {
    pub(super) const JOINT: Self = Self {
        limits: &[
            0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65, 0.7, 0.75, 0.8, 0.85, 0.9,
            0.95, 0.975, 0.985,
        ],
        deviation: 0.15,
        step: 0.05,
    };
    pub(super) const ARM: Self = Self {
        limits: &[0.15, 0.25, 0.35, 0.45, 0.55, 0.65, 0.75, 0.84, 0.91, 0.96],
        deviation: 0.2,
        step: 0.06,
    };
}

impl EffectLaw for CurrentSaturationColumns {
    fn id(&self) -> &'static str {
        "current-saturation"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let at = |(k, j): (usize, &JointPlace)| {
            let shape = |x: &f64| LawShape::new("actuator", "limit", &[("limit", x * j.drive)]).at(&[k]);
            self.limits.iter().map(shape).collect::<Vec<_>>()
        };
        along.joints.iter().enumerate().flat_map(at).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        // (COL-3)
        let column = along.of_drives(shape.joints(), |drive| drive.limited(shape.value("limit")));
        Some(LawTerms::of_fixed_size(column, self.deviation))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("limit", self.step)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let gain = fit.along.runs.first().map_or(1.0, |r| r.drives[fit.joint].gain);
        vec![LawValue::new("saturationTorque", fit.number("limit") * gain)]
    }
}
