//! The motor's torque has orders of its angle.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the motor's coordinate.
pub(super) struct TorqueRippleColumns {
    /// Unit of the amplitudes, in usual torques.
    unit: f64,
    /// Prior standard deviations of the order and of twice the order.
    deviations: [f64; 2],
    /// Orders that are always looked for.
    usual: &'static [f64],
    /// Whether the first two orders of the rotor are among them.
    rotor: bool,
}

impl TorqueRippleColumns {
    pub(super) const JOINT: Self = Self {
        unit: 1.0,
        deviations: [0.5, 0.2],
        usual: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0],
        rotor: false,
    };
    pub(super) const ARM: Self =
        Self { unit: 0.3, deviations: [0.7, 0.3], usual: &[3.0, 6.0, 12.0, 24.0], rotor: true };
}

impl EffectLaw for TorqueRippleColumns {
    fn id(&self) -> &'static str {
        "torque-ripple"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, orders: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for (k, (joint, peaks)) in along.joints.iter().zip(orders).enumerate() {
            let mut usual = self.usual.to_vec();
            if self.rotor {
                usual.extend([joint.rotor_turns, 2.0 * joint.rotor_turns]);
            }
            let shape = |h: f64| LawShape::new("actuator", "order", &[("h", h)]).at(&[k]);
            all.extend(with_usual(&peaks.ripple, &usual).into_iter().map(shape));
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (h, k) = (shape.value("h"), shape.joint());
        let joint = &along.joints[k];
        let part = |mean: &[f64]| {
            ColumnPart::force(joint.motor, mean.iter().map(|x| self.unit * joint.torque * x).collect())
        };
        let mut terms = Vec::new();
        for (m, sd) in [1.0, 2.0].into_iter().zip(self.deviations) {
            // (COL-4)
            let means = (0..along.runs.len()).map(|r| along.order_means(r, k, m * h));
            let (sin, cos): (FilterColumn, FilterColumn) =
                means.map(|[sin, cos]| (part(&sin), part(&cos))).unzip();
            terms.extend([(sin, 0.0, sd), (cos, 0.0, sd)]);
        }
        Some(LawTerms::new(terms, &[]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let j = fit.place();
        let size = |k: usize| fit.amplitude(k) * self.unit * j.torque;
        vec![
            LawValue::new("rippleSine", size(0)),
            LawValue::new("rippleCosine", size(1)),
            LawValue::new("rippleSine2", size(2)),
            LawValue::new("rippleCosine2", size(3)),
            LawValue::new("rippleOrder", fit.number("h") / j.rotor_turns),
        ]
    }
}
