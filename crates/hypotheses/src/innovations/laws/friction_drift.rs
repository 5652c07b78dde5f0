//! Friction of the nominal plant that changes with time.

use trueup_estimation::innovations::two_mass::parameter;

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Time constant `time` in s; 0: along a line.
pub(super) struct FrictionDriftColumns;

impl EffectLaw for FrictionDriftColumns {
    fn id(&self) -> &'static str {
        "friction-drift"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.frame.dry_level() <= 0.0 {
            return Vec::new();
        }
        let shape = |time: f64| LawShape::new("motor-friction", "time", &[("time", time)]);
        [0.0, 2.0, 3.5, 6.0, 10.0, 20.0].map(shape).to_vec()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let dry = along.parameter(parameter::COULOMB_FRICTION);
        let viscous = along.parameter(parameter::VISCOUS_FRICTION);
        let (time, duration) = (shape.value("time"), along.sizes.duration);
        let course = |t: f64| if time > 0.0 { (-t / time).exp() } else { t / duration - 0.5 };
        let column = along.on_motor(|w, i| -(dry * w.sign[i] + viscous * w.speed[i]) * course(w.time[i]));
        Some(LawTerms::new(vec![(column, 0.0, 0.5)], false))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("time", 0.3)]
    }
}
