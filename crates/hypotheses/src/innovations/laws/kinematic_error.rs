//! The gear's ratio has orders of the motor's angle.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::place::MotionInStep;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the motor's coordinate: the twist is q_m + e(q_m) - q, and its torque times 1 + e' acts on the motor.
pub(super) struct KinematicErrorColumns {
    /// Prior standard deviations of the order and of twice the order.
    deviations: [f64; 2],
    /// Whether the first two orders of the rotor are looked for; else peaks of the scores are.
    rotor: bool,
}

impl KinematicErrorColumns {
    pub(super) const JOINT: Self = Self { deviations: [0.5, 0.2], rotor: false };
    pub(super) const ARM: Self = Self { deviations: [1.0, 0.4], rotor: true };
}

/// Torque on the link and the other end's share of the spring's torque, by node, for e = sin and for e = cos of an order.
type ErrorTorques = [(Vec<f64>, Vec<f64>); 2];

/// Means over steps along straight pieces: the rate of e is its rise over the step.
fn on_straight_pieces(along: &PlantAlong<'_>, recording: usize, joint: usize, order: f64) -> ErrorTorques {
    let (r, j) = (&along.runs[recording], &along.joints[joint]);
    let [sin, cos] = along.order_means(recording, joint, order);
    let m = along.joint_motion(recording, joint);
    let (at_sin, at_cos): (Vec<f64>, Vec<f64>) = m.motor.iter().map(|q| (order * q).sin_cos()).unzip();
    let own = r.own_forces.get(j.link);
    let torque = along.means(recording, &m.torque);
    let of = |mean: &[f64], slope: (f64, &[f64]), at: &[f64]| {
        let link = r.by_node(|t| {
            let rise = if t + 1 < r.nodes() { at[t + 1] - at[t] } else { 0.0 };
            j.stiffness * j.gear_error * mean[t] + j.gear_error * j.damping * rise / r.steps[t]
        });
        let own = |t: usize| own.map_or(0.0, |o| o[t]);
        let feels = r.by_node(|t| j.gear_error * order * (slope.0 * slope.1[t]) * (torque[t] + own(t)));
        (link, feels)
    };
    [of(&sin, (1.0, &cos), &at_sin), of(&cos, (-1.0, &sin), &at_cos)]
}

/// Means over the parts of steps.
fn over_parts(along: &PlantAlong<'_>, recording: usize, joint: usize, order: f64) -> ErrorTorques {
    let (r, j) = (&along.runs[recording], &along.joints[joint]);
    let m = along.joint_within(recording, joint);
    let of = |e: fn(f64) -> f64, slope: fn(f64) -> f64| {
        let slope = |i: usize| order * slope(order * m.motor[i]);
        let link = m.each(|i| {
            j.gear_error * (j.stiffness * e(order * m.motor[i]) + j.damping * m.motor_speed[i] * slope(i))
        });
        let feels = m.each(|i| j.gear_error * slope(i) * m.torque[i]);
        (r.means(&link), r.means(&feels))
    };
    [of(f64::sin, f64::cos), of(f64::cos, |x| -x.sin())]
}

/// Columns of sin and cos of an order.
fn columns(along: &PlantAlong<'_>, joint: usize, order: f64) -> [FilterColumn; 2] {
    let j = &along.joints[joint];
    let (mut of_sin, mut of_cos) = (Vec::new(), Vec::new());
    for k in 0..along.runs.len() {
        let torques = match along.motion {
            MotionInStep::Straight => on_straight_pieces(along, k, joint, order),
            MotionInStep::Curved => over_parts(along, k, joint, order),
        };
        let [sin, cos] = torques.map(|(link, feels)| {
            // (COL-12)
            let motor = link.iter().zip(feels).map(|(l, f)| -l - f).collect();
            let mut part = ColumnPart::force(j.motor, motor);
            part.forces.extend(ColumnPart::force(j.link, link).forces);
            part
        });
        of_sin.push(sin);
        of_cos.push(cos);
    }
    [of_sin, of_cos]
}

impl EffectLaw for KinematicErrorColumns {
    fn id(&self) -> &'static str {
        "kinematic-error"
    }
    fn shapes(&self, along: &PlantAlong<'_>, orders: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for (k, (joint, peaks)) in along.joints.iter().zip(orders).enumerate() {
            if joint.stiffness <= 0.0 {
                continue;
            }
            let rotor = [joint.rotor_turns, 2.0 * joint.rotor_turns];
            let orders = with_usual(if self.rotor { &rotor } else { &peaks.gear }, &[1.0, 2.0]);
            let shape = |h: f64| LawShape::new("transmission", "order", &[("h", h)]).at(&[k]);
            all.extend(orders.into_iter().map(shape));
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let h = shape.value("h");
        let terms = [1.0, 2.0]
            .into_iter()
            .zip(self.deviations)
            .flat_map(|(k, sd)| columns(along, shape.joint(), k * h).map(|column| (column, 0.0, sd)));
        Some(LawTerms::new(terms.collect(), &[]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::ORDER]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let j = fit.place();
        // The columns add to the twist what the effect takes from it.
        let size = |k: usize| -fit.amplitude(k) * j.gear_error;
        vec![
            LawValue::new("kinematicErrorSine", size(0)),
            LawValue::new("kinematicErrorCosine", size(1)),
            LawValue::new("kinematicErrorSine2", size(2)),
            LawValue::new("kinematicErrorCosine2", size(3)),
            LawValue::new("kinematicErrorOrder", fit.number("h") / j.rotor_turns),
        ]
    }
}
