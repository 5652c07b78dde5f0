//! Friction as a power of speed.

use trueup_estimation::innovations::numeric::sign;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Exponent `p`.
pub(super) struct NonlinearViscousFrictionColumns {
    /// Unit of the amplitude at the usual speed, in usual torques, and its prior standard deviation.
    unit: [f64; 2],
    /// Exponents that are looked for.
    exponents: &'static [f64],
}

impl NonlinearViscousFrictionColumns {
    pub(super) const JOINT: Self = Self { unit: [1.0, 0.5], exponents: &[0.5, 1.5, 2.0, 3.0] };
    pub(super) const ARM: Self = Self { unit: [0.3, 0.7], exponents: &[1.5, 2.0, 3.0] };
}

impl EffectLaw for NonlinearViscousFrictionColumns {
    fn id(&self) -> &'static str {
        "nonlinear-viscous-friction"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let powers = |shape: LawShape| {
            let power =
                move |p: &f64| LawShape::new("motor-friction", "power", &[("p", *p)]).at(&shape.joints);
            self.exponents.iter().map(power).collect::<Vec<_>>()
        };
        along.at_dry_joints("power", &[]).into_iter().flat_map(powers).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (j, p) = (&along.joints[shape.joint()], shape.value("p"));
        let (unit, usual) = (self.unit[0] * j.torque, j.motor_speed);
        // (COL-7)
        let column = along.on_motor(shape.joint(), |m| {
            let direction = |i: usize| m.sign.get(i).copied().unwrap_or_else(|| sign(m.motor_speed[i]));
            m.each(|i| -unit * direction(i) * (m.motor_speed[i].abs() / usual).powf(p))
        });
        Some(LawTerms::new(vec![(column, 0.0, self.unit[1])], &[]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("p", 0.2)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (j, p) = (fit.place(), fit.number("p"));
        let torque = LawValue::new("dragTorque", fit.amplitude(0) * self.unit[0] * j.torque);
        vec![torque.at_usual("dragReferenceSpeed", j.motor_speed, p), LawValue::new("dragExponent", p)]
    }
}
