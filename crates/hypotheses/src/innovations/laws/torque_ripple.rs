//! The motor's torque has orders of its angle.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::two_mass::coordinate::MOTOR;

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the motor.
pub(super) struct TorqueRippleColumns;

impl EffectLaw for TorqueRippleColumns {
    fn id(&self) -> &'static str {
        "torque-ripple"
    }
    fn shapes(&self, _: &JointAlong<'_>, orders: &OrderPeaks) -> Vec<LawShape> {
        let usual: Vec<f64> = (1..=8).map(f64::from).collect();
        let all = with_usual(&orders.ripple, &usual).into_iter();
        all.map(|h| LawShape::new("actuator", "order", &[("h", h)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let part = |mean: &[f64]| ColumnPart::force(MOTOR, mean.iter().map(|x| along.unit * x).collect());
        let h = shape.value("h");
        let mut terms = Vec::new();
        for (k, sd) in [(1.0, 0.5), (2.0, 0.2)] {
            let means = (0..along.runs.len()).map(|r| along.order_means(r, k * h));
            let (sin, cos): (FilterColumn, FilterColumn) =
                means.map(|[sin, cos]| (part(&sin), part(&cos))).unzip();
            terms.extend([(sin, 0.0, sd), (cos, 0.0, sd)]);
        }
        Some(LawTerms::new(terms, false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
}
