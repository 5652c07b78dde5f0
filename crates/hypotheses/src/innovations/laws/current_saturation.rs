//! The drive gives no more than a limit of current.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// `limit` in A.
pub(super) struct CurrentSaturationColumns;

impl EffectLaw for CurrentSaturationColumns {
    fn id(&self) -> &'static str {
        "current-saturation"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let even = (0..18).map(|k| 0.1 + 0.05 * f64::from(k)).chain([0.975, 0.985]);
        even.map(|x| LawShape::new("actuator", "limit", &[("limit", x * along.sizes.current)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let limit = shape.value("limit");
        let clipped = |u: &[f64]| u.iter().map(|u| u.clamp(-limit, limit)).collect::<Vec<_>>();
        let column = along.of_current(|i| i.means_of(&clipped(&i.values)));
        Some(LawTerms::of_fixed_size(column, 0.15))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("limit", 0.05)]
    }
}
