//! Friction that falls with speed out of rest.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Speed `speed` in rad/s over which it falls, with exponent `k`.
pub(super) struct StribeckFrictionColumns;

/// A shape of it.
pub fn stribeck(speed: f64, k: f64) -> LawShape {
    LawShape::new("motor-friction", "stribeck", &[("speed", speed), ("k", k)])
}

impl EffectLaw for StribeckFrictionColumns {
    fn id(&self) -> &'static str {
        "stribeck-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.frame.dry_level() <= 0.0 {
            return Vec::new();
        }
        let speeds = [0.01, 0.02, 0.035, 0.05, 0.075, 0.12, 0.2].map(|x| x * along.sizes.motor_speed);
        speeds.iter().flat_map(|v| [1.0, 2.0].map(|k| stribeck(*v, k))).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (unit, speed, k) = (along.unit, shape.value("speed"), shape.value("k"));
        let falls = |v: f64| (-(v.abs() / speed).powf(k)).exp();
        let column = along.on_motor(|w, i| -unit * w.sign[i] * falls(w.speed[i]));
        Some(LawTerms::new(vec![(column, 0.5, 0.7)], true))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("speed", 0.35)]
    }
}
