//! Damping of the transmission as a power of the rate of twist.

use trueup_estimation::innovations::numeric::sign;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::of_spring;

/// Exponent `p`; with a length `x` in rad it grows with the twist, too.
pub(super) struct NonlinearDampingColumns {
    /// Exponents that are looked for.
    exponents: &'static [f64],
    /// Twists over which it grows that are looked for, in usual twists.
    growths: &'static [f64],
    /// Prior mean and standard deviation of the amplitude.
    prior: [f64; 2],
}

impl NonlinearDampingColumns {
    pub(super) const JOINT: Self =
        Self { exponents: &[0.4, 1.5, 2.0, 3.0], growths: &[], prior: [3.0, 10.0] };
    pub(super) const ARM: Self =
        Self { exponents: &[0.3, 0.5, 1.5, 2.0, 2.6, 3.2], growths: &[0.25], prior: [1.0, 1.5] };
}

impl EffectLaw for NonlinearDampingColumns {
    fn id(&self) -> &'static str {
        "nonlinear-damping"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.at_springs(|j| {
            let mut all = Vec::new();
            for p in self.exponents {
                all.push(LawShape::new("transmission", "power", &[("p", *p)]));
                let grows =
                    |x: &f64| LawShape::new("transmission", "power", &[("p", *p), ("x", x * j.twist)]);
                all.extend(self.growths.iter().map(grows));
            }
            all
        })
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let j = &along.joints[shape.joint()];
        let (usual, p) = (j.twist_rate, shape.value("p"));
        let unit = j.least_damping * usual;
        // (COL-11)
        let power = |v: f64| unit * sign(v) * (v.abs() / usual).powf(p);
        let column = along.in_spring(shape.joint(), |m| m.each(|i| power(m.twist_rate[i])));
        let [mean, sd] = self.prior;
        let mut terms = match shape.get("x") {
            None => LawTerms::new(vec![(column, mean, sd)], &[0]),
            Some(x) => {
                let grown = |w: f64| w * w / (w * w + x * x);
                let grows = along
                    .in_spring(shape.joint(), |m| m.each(|i| power(m.twist_rate[i]) * grown(m.twist[i])));
                LawTerms::new(vec![(column, 0.0, 1.0), (grows, mean, sd)], &[])
            }
        };
        terms.applied.spring = Some(shape.joint());
        Some(terms)
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        of_spring(self, along, shape, amplitudes)
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        let length = shape.get("x").map(|_| Refinement::relative("x", 0.4));
        [Refinement::relative("p", 0.2)].into_iter().chain(length).collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (j, p) = (fit.place(), fit.number("p"));
        // What grows with the twist is half of itself on the mean.
        let size = fit.amplitude(0) + 0.5 * fit.amplitude(1);
        let torque = LawValue::new("dampingTorque", size * j.least_damping * j.twist_rate);
        vec![torque.at_usual("dampingReferenceRate", j.twist_rate, p), LawValue::new("dampingExponent", p)]
    }
}
