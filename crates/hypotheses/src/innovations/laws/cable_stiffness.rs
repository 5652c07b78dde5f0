//! A cable pulls on the load.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// A line over the link's angle, with companions of other powers.
pub(super) struct CableStiffnessColumns;

impl EffectLaw for CableStiffnessColumns {
    fn id(&self) -> &'static str {
        "cable-stiffness"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        (0..along.joints.len()).map(|k| LawShape::new("load", "powers", &[]).at(&[k])).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let j = &along.joints[shape.joint()];
        let [middle, reach] = j.reach;
        // (COL-15)
        let of = |p: i32| {
            along.on_link(shape.joint(), |m| m.each(|i| j.torque * ((m.link[i] - middle) / reach).powi(p)))
        };
        let terms = vec![(of(1), -0.2, 0.5), (of(0), 0.0, 0.3), (of(3), 0.0, 0.2), (of(2), 0.0, 0.1)];
        Some(LawTerms::new(terms, &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let j = fit.place();
        let [middle, reach] = j.reach.map(|x| x / j.turns);
        let torque = j.torque * j.turns;
        let k = (-torque * fit.amplitude(0) / reach).max(f64::MIN_POSITIVE);
        vec![
            LawValue::new("cableStiffness", k),
            LawValue::new("cableAngle", middle + torque * fit.amplitude(1) / k),
        ]
    }
}
