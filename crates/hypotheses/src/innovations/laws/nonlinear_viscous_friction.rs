//! Friction as a power of speed.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Exponent `p`.
pub(super) struct NonlinearViscousFrictionColumns;

impl EffectLaw for NonlinearViscousFrictionColumns {
    fn id(&self) -> &'static str {
        "nonlinear-viscous-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.frame.dry_level() <= 0.0 {
            return Vec::new();
        }
        let shape = |p: f64| LawShape::new("motor-friction", "power", &[("p", p)]);
        [0.5, 1.5, 2.0, 3.0].map(shape).to_vec()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (unit, usual, p) = (along.unit, along.sizes.motor_speed, shape.value("p"));
        let column = along.on_motor(|w, i| -unit * w.sign[i] * (w.speed[i].abs() / usual).powf(p));
        Some(LawTerms::new(vec![(column, 0.0, 0.5)], false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("p", 0.2)]
    }
}
