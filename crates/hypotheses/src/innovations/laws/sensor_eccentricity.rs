//! The disc of an encoder is out of centre.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::laws::sensor;
use crate::innovations::place::ShownBy;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::{OrderPeaks, with_usual};

/// Order `h` per turn of the shaft that is read, over the angle that is read: a disc out of centre has one order there.
pub(super) struct SensorEccentricityColumns {
    /// Prior standard deviations of the order and of twice the order.
    deviations: [f64; 2],
    /// Orders that are looked for at motors, and at links.
    usual: [&'static [f64]; 2],
    /// Whether peaks of the scores are looked for at motors, and refined.
    peaks: bool,
    /// Whether the error is zero at the angle zero.
    zero: bool,
}

impl SensorEccentricityColumns {
    pub(super) const JOINT: Self =
        Self { deviations: [1.0, 0.3], usual: [&[1.0, 2.0], &[1.0, 2.0, 40.0]], peaks: true, zero: false };
    pub(super) const ARM: Self =
        Self { deviations: [1.5, 0.5], usual: [&[1.0, 2.0], &[1.0, 2.0]], peaks: false, zero: true };
}

impl EffectLaw for SensorEccentricityColumns {
    fn id(&self) -> &'static str {
        "sensor-eccentricity"
    }
    fn shapes(&self, along: &PlantAlong<'_>, orders: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for (k, channel) in along.channels.iter().enumerate().filter(|(_, c)| c.compared) {
            let ShownBy::Position(c) = channel.shows else { continue };
            let Some(joint) = along.joints.iter().position(|j| j.motor == c || j.link == c) else { continue };
            let motor = along.joints[joint].motor == c;
            let usual = self.usual[usize::from(!motor)];
            let orders = match orders.get(joint) {
                Some(peaks) if motor && self.peaks => with_usual(&peaks.reading, usual),
                _ => usual.to_vec(),
            };
            let shape = |h: f64| LawShape::new(channel.place, "order", &[("h", h)]).of(&[k]);
            all.extend(orders.into_iter().map(shape));
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let channel = *sensor::channels(along, shape).first()?;
        let place = &along.channels[channel];
        let (unit, h) = (place.error, shape.value("h") / place.turns);
        let angle = along.of_reading(channel, |k, t, time| {
            let error = along.runs[k].own_readings.get(channel).and_then(|e| e.get(t));
            h * (along.shown_at(k, channel, time) + error.copied().unwrap_or(0.0))
        });
        let zero = f64::from(u8::from(self.zero));
        let of = |m: f64, wave: &dyn Fn(f64) -> f64| -> FilterColumn {
            let part = |angle: &ColumnPart| {
                let values = angle.readings.iter().flat_map(|a| a.values.iter());
                ColumnPart::reading(channel, values.map(|x| unit * wave(m * x)).collect())
            };
            angle.iter().map(part).collect()
        };
        // (COL-25)
        let terms = [1.0, 2.0]
            .into_iter()
            .zip(self.deviations)
            .flat_map(|(m, sd)| [(of(m, &f64::sin), 0.0, sd), (of(m, &|x| x.cos() - zero), 0.0, sd)]);
        Some(LawTerms::new(terms.collect(), &[]))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        if self.peaks && shape.place != "sensor:loadAngle" { vec![Refinement::ORDER] } else { Vec::new() }
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let unit = fit.reading_unit();
        vec![
            LawValue::new("eccentricitySine", fit.amplitude(0) * unit),
            LawValue::new("eccentricityCosine", fit.amplitude(1) * unit),
            LawValue::new("eccentricityOrder", fit.number("h")),
        ]
    }
}
