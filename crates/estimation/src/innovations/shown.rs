//! What channels show: a state, or the force of an elastic element, which is stiffness times deflection plus damping times rate and the
//! laws in force there.

use super::column::WeightedSeries;
use super::frame::InnovationsFrame;
use super::plant::{ElasticElement, ShownQuantity};

impl InnovationsFrame {
    /// What a channel shows as a sum of the plant's states.
    pub(super) fn shown_sum(&self, theta: &[f64], shows: ShownQuantity) -> Vec<f64> {
        match shows {
            ShownQuantity::State(k) => {
                (0..self.plant.states()).map(|i| f64::from(u8::from(i == k))).collect()
            }
            ShownQuantity::Element(e) => {
                let e = &self.plant.elements()[e];
                let (k, d) = (theta[e.stiffness], theta[e.damping]);
                let own = e.deflection.iter().zip(&e.rate).map(|(x, v)| k * x + d * v);
                let tangent = self.tangent_of(e);
                own.enumerate().map(|(i, f)| f + tangent.get(i).copied().unwrap_or(0.0)).collect()
            }
        }
    }
    /// The tangent of laws in an elastic element, as a sum of states; empty: there are none.
    fn tangent_of(&self, e: &ElasticElement) -> Vec<f64> {
        let on = e.weights.iter().position(|w| *w > 0.0).unwrap_or(0);
        let states = self.plant.states();
        let gains = self.feedback.0.get(states * on..states * (on + 1)).unwrap_or_default();
        gains.iter().map(|g| g / e.weights[on]).collect()
    }
    /// Readings of a recording; those of elastic elements with what their rows have of the tangent of laws: the laws themselves are
    /// columns.
    pub(super) fn shown_readings(&self, recording: usize) -> Vec<f64> {
        let mut readings = self.runs[recording].readings.to_vec();
        let r = &self.runs[recording];
        let size = self.plant.states() + self.coordinates();
        for (c, channel) in self.intake.channels.iter().enumerate() {
            let ShownQuantity::Element(e) = channel.shows else { continue };
            let tangent = self.tangent_of(&self.plant.elements()[e]);
            if tangent.iter().all(|g| *g == 0.0) {
                continue;
            }
            let shown = readings.iter_mut().skip(c).step_by(self.channels());
            for (y, x) in shown.zip(r.states.chunks(size)) {
                *y += tangent.iter().zip(x).map(|(g, x)| g * x).sum::<f64>();
            }
        }
        readings
    }

    /// Relative changes of stiffness and damping of elements that channels show, as parts of a column: what the channels show more.
    pub(super) fn shown_changes(&self, recording: usize, parameter: usize) -> Vec<WeightedSeries> {
        let r = &self.runs[recording];
        let size = self.plant.states() + self.coordinates();
        let mut all = Vec::new();
        for (c, channel) in self.intake.channels.iter().enumerate() {
            let ShownQuantity::Element(e) = channel.shows else { continue };
            let e = &self.plant.elements()[e];
            let moved = if parameter == e.stiffness {
                &e.deflection
            } else if parameter == e.damping {
                &e.rate
            } else {
                continue;
            };
            let own = self.intake.rig.is_own(parameter, recording);
            let factor = if own { 0.0 } else { self.intake.rig.of_reading(self.rig_numbers(), c) };
            let unit = factor * self.theta[parameter];
            let of = |x: &[f64]| unit * moved.iter().zip(x).map(|(m, x)| m * x).sum::<f64>();
            let values = r.states.chunks(size).map(of).collect();
            all.push(WeightedSeries { on: c, weight: 1.0, values });
        }
        all
    }
}
