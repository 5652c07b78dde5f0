//! What sensors make of what they measure.

use trueup_identification::sensors::{LinearSensor, SensorSet};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;

use super::links::Links;
use super::prescribed::GriddedRecording;
use crate::engine::octaves;
use crate::engine::subject::EngineModel;

impl GriddedRecording {
    /// What effects of sensors, gains and offsets add to each channel, with its first and second derivative; `None`: nothing.
    pub(super) fn sensed<T: Scalar>(
        &self,
        model: &EngineModel,
        links: &Links,
        p: &[T],
        sensors: &SensorSet<T>,
    ) -> Vec<Option<[Vec<T>; 3]>> {
        let sizes = model.sizes();
        let begins: Vec<usize> =
            model.effects().iter().filter(|e| e.is_sensor()).map(|e| e.channel).collect();
        let spans: Vec<usize> = model.effects().iter().filter(|e| e.is_sensor()).map(|e| e.sites).collect();
        let concerned = |o: usize| begins.iter().zip(&spans).any(|(b, s)| o >= *b && o < b + s);
        // What is neutral may have a derivative all the same, or a fit that begins there ends there. An offset of what shows a
        // coordinate is left to free runs as long as it is 0.
        let moved = |o: usize| {
            let LinearSensor { gain, offset } = sensors.outputs[o];
            offset.value() != 0.0 || !(gain - 1.0).vanishes()
        };
        // Of what shows none the model's own figure is read as the sensor reads it.
        let shows = |c: usize| links.shows[c].is_some();
        let outputs = self.channels.iter().map(|c| c.output).enumerate();
        let any: Vec<bool> = outputs.map(|(c, o)| concerned(o) || shows(c) && moved(o)).collect();
        if !any.contains(&true) {
            return vec![None; self.channels.len()];
        }
        let x = vec![T::zero(); sizes.states];
        let u = vec![T::zero(); sizes.inputs];
        let modes = vec![0; sizes.modes];
        let mut shown = vec![T::zero(); sizes.outputs];
        // If the readings' own noise determined the error, the error could be fitted to take that noise away.
        let calm: Vec<Vec<f64>> =
            self.channels.iter().map(|c| octaves::gaussian(&c.enters[0], 2.0 * self.kernel, 0)).collect();
        let mut added: Vec<Vec<T>> = vec![Vec::with_capacity(self.t.len()); self.channels.len()];
        for k in 0..self.t.len() {
            self.channels.iter().zip(&calm).for_each(|(c, y)| shown[c.output] = T::constant(y[k]));
            let at = At { t: T::constant(self.t[k] - self.t[0]), x: &x, u: &u, p, modes: &modes };
            model.effects().sense(&at, &mut shown);
            for (c, s) in self.channels.iter().enumerate() {
                // Of a reading r = g y + o that is r - y.
                let LinearSensor { gain, offset } =
                    if shows(c) { sensors.outputs[s.output] } else { LinearSensor::none() };
                let own = T::constant(calm[c][k]) - (T::constant(calm[c][k]) - offset) / gain;
                added[c].push(shown[s.output] - calm[c][k] + own);
            }
        }
        let h = self.step;
        let derived = |v: Vec<T>| {
            let n = v.len();
            let near = |k: usize| (k.max(1) - 1, (k + 1).min(n - 1));
            let first = (0..n).map(|k| (v[near(k).1] - v[near(k).0]) / ((near(k).1 - near(k).0) as f64 * h));
            let first: Vec<T> = first.collect();
            let second = (0..n).map(|k| {
                let k = k.clamp(1, n - 2);
                (v[k + 1] - v[k] * 2.0 + v[k - 1]) / (h * h)
            });
            let second = second.collect();
            [v, first, second]
        };
        added.into_iter().zip(any).map(|(v, any)| any.then(|| derived(v))).collect()
    }
}
