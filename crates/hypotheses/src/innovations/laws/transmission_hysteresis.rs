//! Friction inside the transmission: the torque of a twist depends on where it came from.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::operator::dahl;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Length `x` in rad of twist, with companions of four times and a quarter of it.
pub(super) struct TransmissionHysteresisColumns;

impl EffectLaw for TransmissionHysteresisColumns {
    fn id(&self) -> &'static str {
        "transmission-hysteresis"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        let lengths = [0.02, 0.05, 0.12, 0.3].map(|x| x * along.sizes.twist);
        lengths.map(|x| LawShape::new("transmission", "length", &[("x", x)])).to_vec()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let x = shape.value("x");
        let of = |k: f64| along.in_spring(|r| dahl(&r.twist, k * x).iter().map(|z| along.unit * z).collect());
        let terms = vec![(of(1.0), 0.2, 0.5), (of(4.0), 0.2, 0.5), (of(0.25), 0.0, 0.3)];
        Some(LawTerms::new(terms, true).in_spring())
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("x", 0.35)]
    }
}
