//! The motor's torque has orders of its angle.

use trueup_estimation::innovations::column::ColumnPart;
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
        let column = |order: f64, quarter: u8| {
            let one = |k: usize| {
                let means = along.order_means(k, order, quarter);
                ColumnPart::force(MOTOR, means.iter().map(|x| along.unit * x).collect())
            };
            (0..along.runs.len()).map(one).collect()
        };
        let h = shape.value("h");
        let terms = [(1.0, 0.5), (2.0, 0.2)]
            .into_iter()
            .flat_map(|(k, sd)| [0, 1].map(|quarter| (column(k * h, quarter), 0.0, sd)));
        Some(LawTerms::new(terms.collect(), false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
}
