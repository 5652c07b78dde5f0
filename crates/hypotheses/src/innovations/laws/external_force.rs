//! Impulses on the base, the tip, a link or a motor.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Raised cosines, each with its begin and width in s, at the same times in all recordings or each in one of them. They are found by
/// pursuit of the scores, by no grid.
pub(super) struct ExternalForceColumns {
    /// Prior standard deviation of the amplitudes.
    deviation: f64,
}

impl ExternalForceColumns {
    pub(super) const JOINT: Self = Self { deviation: 1.0 };
    pub(super) const ARM: Self = Self { deviation: 2.0 };
}

/// Impulses on a place.
pub fn pushes_at(place: &'static str, pulses: Vec<[f64; 2]>) -> LawShape {
    LawShape { pulses, ..LawShape::new(place, "pulses", &[]) }
}

fn pulse(time: f64, [begin, width]: [f64; 2]) -> f64 {
    let inside = time > begin && time < begin + width;
    // (COL-22)
    if inside { 0.5 * (1.0 - (2.0 * PI * (time - begin) / width).cos()) } else { 0.0 }
}

/// Columns of one impulse: one an axis of the place.
fn columns(along: &PlantAlong<'_>, shape: &LawShape, of: [f64; 2]) -> Option<Vec<FilterColumn>> {
    let j = &along.joints[shape.joint()];
    Some(match shape.place {
        "base" => {
            let base = along.base.as_ref()?;
            let axis = |i: usize| along.over_time(base.coordinates[i], |t| base.force[i] * pulse(t, of));
            (0..3).map(axis).collect()
        }
        "tip" => (0..2).map(|axis| along.on_tip(axis, |t| pulse(t, of))).collect::<Option<_>>()?,
        "actuator" => vec![along.over_time(j.motor, |t| j.torque * pulse(t, of))],
        _ => vec![along.over_time(j.link, |t| j.torque * pulse(t, of))],
    })
}

impl EffectLaw for ExternalForceColumns {
    fn id(&self) -> &'static str {
        "external-force"
    }
    fn is_impulses(&self) -> bool {
        true
    }
    fn shapes(&self, _: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        Vec::new()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let mut terms = Vec::new();
        for (n, p) in shape.pulses.iter().enumerate() {
            for mut column in columns(along, shape, *p)? {
                if let Some(only) = shape.only.get(n) {
                    let others = column.iter_mut().enumerate().filter(|(k, _)| k != only);
                    others.for_each(|(_, part)| *part = ColumnPart::default());
                }
                terms.push((column, 0.0, self.deviation));
            }
        }
        Some(LawTerms::new(terms, &[]))
    }
}
