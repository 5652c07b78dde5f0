//! Friction that yields before it slides.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::place::JointPlace;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Length `x` in rad over which it slips instead of what the nominal plant does, and what of it slips four times later.
pub(super) enum PreslidingFrictionColumns {
    /// Of the frame's own dry pair.
    Joint,
    /// Of friction that slips over [`RIGID`].
    Arm,
}

/// Lengths that are looked for, in deflections of the spring under the usual torque.
const LENGTHS: [f64; 14] = [0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.8, 1.2, 2.0, 3.5, 6.0, 10.0, 20.0, 40.0];
/// Lengths that are looked for at an arm, rad, and the length of what does not yield.
const ARM_LENGTHS: [f64; 3] = [1e-3, 4e-3, 1.5e-2];
const RIGID: f64 = 1e-4;
/// Unit of the amplitude at an arm, in usual torques.
const UNIT: f64 = 0.1;
/// Largest share of dry friction that bristles carry: all of it has no level left.
const SHARE: f64 = 0.99;

/// What the encoder does not resolve is sticking.
fn least(j: &JointPlace) -> f64 {
    3.0 * j.resolution
}

impl EffectLaw for PreslidingFrictionColumns {
    fn id(&self) -> &'static str {
        "presliding-friction"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        if let Self::Arm = self {
            return along.at_dry_joints("length", &ARM_LENGTHS);
        }
        let at = |shape: LawShape| {
            let j = &along.joints[shape.joint()];
            let own = if j.stiffness > 0.0 { j.torque / j.stiffness } else { j.gear_error };
            let least = if j.motor_read { least(j) } else { 0.0 };
            let lengths = LENGTHS.iter().map(|x| x * own).filter(|x| *x >= least);
            let shape = |x: f64| LawShape::new("motor-friction", "length", &[("x", x)]).at(&shape.joints);
            lengths.map(shape).collect::<Vec<_>>()
        };
        along.at_dry_joints("length", &[]).into_iter().flat_map(at).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (joint, x) = (shape.joint(), shape.value("x"));
        let torque = along.joints[joint].torque;
        // (COL-7)
        let instead = |unit: f64, of: Option<f64>, than: Option<f64>| {
            along.on_motor(joint, |m| {
                let (a, b) = (m.sliding(of), m.sliding(than));
                m.each(|i| -unit * (a[i] - b[i]))
            })
        };
        Some(match self {
            Self::Joint => {
                let late = instead(torque, Some(4.0 * x), Some(x));
                LawTerms::new(vec![(instead(torque, Some(x), None), 1.0, 0.2), (late, 0.0, 0.3)], &[0])
            }
            Self::Arm => LawTerms::new(vec![(instead(UNIT * torque, Some(x), Some(RIGID)), 1.0, 1.0)], &[0]),
        })
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("x", 0.35)]
    }
    fn bounded(&self, along: &PlantAlong<'_>, shape: &LawShape, _: &str, value: f64) -> f64 {
        value.max(least(&along.joints[shape.joint()]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let j = fit.place();
        let unit = match self {
            Self::Joint => j.torque,
            Self::Arm => UNIT * j.torque,
        };
        let share = fit.amplitude(0) * unit / j.dry.max(f64::MIN_POSITIVE);
        vec![
            LawValue::new("preslidingShare", share.clamp(0.0, SHARE)),
            LawValue::new("preslidingDisplacement", fit.number("x")),
        ]
    }
}
