//! The gear's ratio has orders of the motor's angle.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::numeric::over_steps;
use trueup_estimation::innovations::two_mass::coordinate::{LOAD, MOTOR};

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the motor: the twist is q_m + e(q_m) - psi, and its torque times 1 + e' acts on the motor.
pub(super) struct KinematicErrorColumns;

/// Columns of sin and cos of an order.
fn columns(along: &JointAlong<'_>, order: f64) -> [FilterColumn; 2] {
    let (mut of_sin, mut of_cos) = (Vec::new(), Vec::new());
    for (k, r) in along.runs.iter().enumerate() {
        let [sin, cos] = along.order_means(k, order);
        let (at_sin, at_cos): (Vec<f64>, Vec<f64>) = r.motor.iter().map(|q| (order * q).sin_cos()).unzip();
        let torque = over_steps(&r.torque);
        let own = &along.frame.runs[k].own.forces[LOAD];
        let unit = along.angle_unit;
        let part = |mean: &[f64], slope: (f64, &[f64]), at: &[f64]| {
            let load = r.by_node(|t| {
                let rise = if t + 1 < r.nodes { at[t + 1] - at[t] } else { 0.0 };
                along.stiffness * unit * mean[t] + unit * along.damping * rise / r.dt
            });
            let feels = |t: usize| unit * order * (slope.0 * slope.1[t]) * (torque[t] + own[t]);
            let motor = r.by_node(|t| -load[t] - feels(t));
            let mut part = ColumnPart::force(MOTOR, motor);
            part.forces.extend(ColumnPart::force(LOAD, load).forces);
            part
        };
        of_sin.push(part(&sin, (1.0, &cos), &at_sin));
        of_cos.push(part(&cos, (-1.0, &sin), &at_cos));
    }
    [of_sin, of_cos]
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
            .flat_map(|(k, sd)| columns(along, k * h).map(|column| (column, 0.0, sd)));
        Some(LawTerms::new(terms.collect(), false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
}
