//! A reading drifts with time.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `time` (saturates with the time constant `time` in s) or form `later` (begins after the share `k` of the longest
/// recording), with a straight line.
pub(super) struct SensorDriftColumns;

impl EffectLaw for SensorDriftColumns {
    fn id(&self) -> &'static str {
        "sensor-drift"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let at = |place| {
            let time = [1.0, 2.0, 3.5, 6.0].map(|x| LawShape::new(place, "time", &[("time", x)]));
            let later = [0.2, 0.35, 0.5, 0.65, 0.8].map(|x| LawShape::new(place, "later", &[("k", x)]));
            time.into_iter().chain(later)
        };
        sensor::angles(along).into_iter().flat_map(at).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (channel, _) = sensor::channel(along, shape)?;
        let (unit, duration) = (along.angle_unit, along.sizes.duration);
        let of =
            |f: &dyn Fn(f64) -> f64| along.of_reading(channel, |k, t, _| unit * f(along.runs[k].time(t)));
        let more = match shape.get("time") {
            Some(time) => of(&|t| 1.0 - (-t / time).exp()),
            None => of(&|t| (t / duration - shape.value("k")).max(0.0)),
        };
        let line = of(&|t| t / duration);
        Some(LawTerms::new(vec![(more, 0.0, 5.0), (line, 0.0, 5.0)], false))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        vec![if shape.form == "time" {
            Refinement::relative("time", 0.3)
        } else {
            Refinement::relative("k", 0.2)
        }]
    }
}
