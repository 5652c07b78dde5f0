//! Play between motor and load.

use trueup_estimation::innovations::numeric::sign;

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Whole play `gap` in rad on the motor's side.
pub(super) struct BacklashColumns;

impl EffectLaw for BacklashColumns {
    fn id(&self) -> &'static str {
        "backlash"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        let ratio = (2.2f64 / 0.015).ln() / 17.0;
        let even = (0..18).map(|k| 0.015 * (ratio * f64::from(k)).exp()).chain([3.0, 4.5, 7.0]);
        even.map(|x| LawShape::new("transmission", "gap", &[("gap", x * along.sizes.twist)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (k, d, half) = (along.stiffness, along.damping, 0.5 * shape.value("gap"));
        let column = along.in_spring(|r| {
            r.by_node(|t| {
                let (twist, rate) = (r.twist[t], r.twist_rate[t]);
                let inside = f64::from(u8::from(twist.abs() < half));
                k * (sign(twist) * (twist.abs() - half).max(0.0) - twist) - d * rate * inside
            })
        });
        Some(LawTerms::of_fixed_size(column, 0.1).in_spring())
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("gap", 0.12)]
    }
}
