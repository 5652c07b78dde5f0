//! A spring that is no line: cubic with a fifth power, or of two slopes.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `power`, or form `slopes` with the twist `bend` in rad at which the slope changes.
pub(super) struct NonlinearStiffnessColumns;

impl EffectLaw for NonlinearStiffnessColumns {
    fn id(&self) -> &'static str {
        "nonlinear-stiffness"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        let slopes = [0.12, 0.22, 0.35, 0.5, 0.7, 0.9].map(|x| x * along.sizes.twist);
        let slopes = slopes.map(|b| LawShape::new("transmission", "slopes", &[("bend", b)]));
        [LawShape::new("transmission", "power", &[])].into_iter().chain(slopes).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (k, usual) = (along.stiffness, along.sizes.twist);
        let of = |f: &dyn Fn(f64) -> f64| along.in_spring(|r| r.by_node(|t| k * f(r.twist[t])));
        let terms = match shape.get("bend") {
            Some(b) => vec![(of(&|x| x.clamp(-b, b)), 0.0, 0.7), (of(&|x| x), 0.0, 0.5)],
            None => [2, 4].map(|p| (of(&|x| x * (x / usual).powi(p)), 0.0, 0.7)).to_vec(),
        };
        Some(LawTerms::new(terms, false).in_spring())
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        shape.get("bend").map(|_| Refinement::relative("bend", 0.25)).into_iter().collect()
    }
}
