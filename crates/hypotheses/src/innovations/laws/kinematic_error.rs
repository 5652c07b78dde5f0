//! The gear's ratio has orders of the motor's angle.

use trueup_estimation::innovations::column::{Column, ColumnPart};
use trueup_estimation::innovations::numeric::over_steps;
use trueup_estimation::innovations::two_mass::coordinate::{LOAD, MOTOR};

use crate::innovations::along::{JointAlong, harmonic};
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the motor: the twist is q_m + e(q_m) - psi, and its torque times 1 + e' acts on the motor.
pub(super) struct KinematicErrorColumns;

fn column(along: &JointAlong<'_>, order: f64, quarter: u8) -> Column {
    let one = |k: usize| {
        let r = &along.runs[k];
        let (mean, slope) = (along.order_means(k, order, quarter), along.order_means(k, order, quarter + 1));
        let torque = over_steps(&r.torque);
        let own = &along.frame.runs[k].own.forces[LOAD];
        let at = |t: usize| harmonic(order * r.motor[t], quarter);
        let unit = along.angle_unit;
        let load = r.by_node(|t| {
            let rise = if t + 1 < r.nodes { at(t + 1) - at(t) } else { 0.0 };
            along.stiffness * unit * mean[t] + unit * along.damping * rise / r.dt
        });
        let motor = r.by_node(|t| -load[t] - unit * order * slope[t] * (torque[t] + own[t]));
        let mut part = ColumnPart::force(MOTOR, motor);
        part.forces.extend(ColumnPart::force(LOAD, load).forces);
        part
    };
    (0..along.runs.len()).map(one).collect()
}

impl EffectLaw for KinematicErrorColumns {
    fn id(&self) -> &'static str {
        "kinematic-error"
    }
    fn shapes(&self, along: &JointAlong<'_>, orders: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        let all = with_usual(&orders.gear, &[1.0, 2.0]).into_iter();
        all.map(|h| LawShape::new("transmission", "order", &[("h", h)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let h = shape.value("h");
        let terms = [(1.0, 0.5), (2.0, 0.2)]
            .into_iter()
            .flat_map(|(k, sd)| [0, 1].map(|quarter| (column(along, k * h, quarter), 0.0, sd)));
        Some(LawTerms::new(terms.collect(), false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
}
