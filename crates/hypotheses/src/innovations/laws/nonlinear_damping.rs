//! Damping of the transmission as a power of the rate of twist.

use trueup_estimation::innovations::numeric::sign;
use trueup_estimation::innovations::two_mass::parameter;

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Exponent `p`.
pub(super) struct NonlinearDampingColumns;

impl EffectLaw for NonlinearDampingColumns {
    fn id(&self) -> &'static str {
        "nonlinear-damping"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        [0.4, 1.5, 2.0, 3.0].map(|p| LawShape::new("transmission", "power", &[("p", p)])).to_vec()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (usual, p) = (along.sizes.twist_rate, shape.value("p"));
        let unit = along.nominal(parameter::DAMPING).max(2e-4 * along.stiffness) * usual;
        let power = |v: f64| unit * sign(v) * (v.abs() / usual).powf(p);
        let column = along.in_spring(|r| r.by_node(|t| power(r.twist_rate[t])));
        Some(LawTerms::new(vec![(column, 3.0, 10.0)], true).in_spring())
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("p", 0.2)]
    }
}
