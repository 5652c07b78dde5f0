//! The disc of an encoder is out of centre.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the shaft that is read, over the angle that is read: a disc out of centre has one order there.
pub(super) struct SensorEccentricityColumns;

impl EffectLaw for SensorEccentricityColumns {
    fn id(&self) -> &'static str {
        "sensor-eccentricity"
    }
    fn shapes(&self, along: &JointAlong<'_>, orders: &OrderPeaks) -> Vec<LawShape> {
        let at = |place: &'static str| {
            let orders = if place == "sensor:loadAngle" {
                vec![1.0, 2.0, 40.0]
            } else {
                with_usual(&orders.reading, &[1.0, 2.0])
            };
            orders.into_iter().map(move |h| LawShape::new(place, "order", &[("h", h)]))
        };
        sensor::angles(along).into_iter().flat_map(at).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (channel, state) = sensor::channel(along, shape)?;
        let (unit, h) = (along.angle_unit, shape.value("h"));
        let turn = if state == 0 { 1.0 } else { 1.0 / along.gear_ratio };
        let angle = along.of_reading(channel, |k, t, time| {
            let error = along.frame.runs[k].own.readings[channel].get(t).copied().unwrap_or(0.0);
            h * turn * (along.angle_at(k, state, time) + error)
        });
        let of = |m: f64, wave: fn(f64) -> f64| -> FilterColumn {
            let part = |angle: &ColumnPart| {
                let values = angle.readings.iter().flat_map(|a| a.values.iter());
                ColumnPart::reading(channel, values.map(|x| unit * wave(m * x)).collect())
            };
            angle.iter().map(part).collect()
        };
        let terms = [(1.0, 1.0), (2.0, 0.3)]
            .into_iter()
            .flat_map(|(m, sd)| [f64::sin, f64::cos].map(|wave| (of(m, wave), 0.0, sd)));
        Some(LawTerms::new(terms.collect(), false))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        if shape.place == "sensor:loadAngle" { Vec::new() } else { vec![Refinement::ORDER] }
    }
}
