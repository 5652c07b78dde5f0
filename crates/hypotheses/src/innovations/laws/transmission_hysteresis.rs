//! Friction inside the transmission: the torque of a twist depends on where it came from.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::operator::dahl;
use crate::innovations::shape::LawShape;
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::of_hysteresis;

/// Length `x` in rad of twist, with companions of other lengths.
pub(super) struct TransmissionHysteresisColumns {
    /// Unit of the amplitudes, in usual torques.
    unit: f64,
    /// Lengths that are looked for, in usual twists.
    lengths: &'static [f64],
    /// Lengths of the columns in lengths of the law, with prior mean and standard deviation of each.
    columns: &'static [[f64; 3]],
    /// First step of the search.
    step: f64,
}

impl TransmissionHysteresisColumns {
    pub(super) const JOINT: Self = Self {
        unit: 1.0,
        lengths: &[0.02, 0.05, 0.12, 0.3],
        columns: &[[1.0, 0.2, 0.5], [4.0, 0.2, 0.5], [0.25, 0.0, 0.3]],
        step: 0.35,
    };
    pub(super) const ARM: Self = Self {
        unit: 0.1,
        lengths: &[0.03, 0.08, 0.2, 0.45],
        columns: &[[1.0, 0.3, 1.0], [4.0, 0.3, 1.0]],
        step: 0.4,
    };
}

impl EffectLaw for TransmissionHysteresisColumns {
    fn id(&self) -> &'static str {
        "transmission-hysteresis"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.at_springs(|j| {
            let shape = |x: &f64| LawShape::new("transmission", "length", &[("x", x * j.twist)]);
            self.lengths.iter().map(shape).collect()
        })
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (x, unit) = (shape.value("x"), self.unit * along.joints[shape.joint()].torque);
        // (COL-10)
        let of = |k: f64| {
            along.in_spring(shape.joint(), |m| dahl(&m.twist, k * x).iter().map(|z| unit * z).collect())
        };
        let terms = self.columns.iter().map(|[k, mean, sd]| (of(*k), *mean, *sd)).collect();
        let mut terms = LawTerms::new(terms, &[0]);
        terms.applied.spring = Some(shape.joint());
        Some(terms)
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        let (x, unit) = (shape.value("x"), self.unit * along.joints[shape.joint()].torque);
        let levels = self.columns.iter().zip(amplitudes).map(|([k, ..], a)| [unit * a, k * x]);
        Some(of_hysteresis(along, shape.joint(), &levels.collect::<Vec<_>>()))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("x", self.step)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let torque = self.unit * fit.place().torque * fit.amplitudes.iter().sum::<f64>();
        vec![
            LawValue::new("hysteresisTorque", torque),
            LawValue::new("hysteresisDisplacement", fit.number("x")),
        ]
    }
}
