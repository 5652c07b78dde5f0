//! How large the terms of a balance are.

use super::links::Links;
use super::prescribed::GriddedRecording;
use crate::engine::coordinate::CoordinateReadings;

impl GriddedRecording {
    /// What inputs and motion make of each channel by themselves: sizes of the terms of the balance.
    pub fn terms(&self, links: &Links, coordinates: &[CoordinateReadings]) -> Vec<[Vec<f64>; 2]> {
        let all = self.channels.iter().enumerate().map(|(c, s)| {
            let Some((i, f, rate)) = links.shows[c] else { return [s.y.clone(), s.y.clone()] };
            if !self.as_lead(links, i, c) {
                // Two angles of one body: no law connects them.
                let exact = !rate && links.leads[i].is_some();
                let own = if exact { vec![0.0; self.t.len()] } else { s.y.clone() };
                return [own.clone(), own];
            }
            let own = if rate { s.dy.clone() } else { s.ddy.clone() };
            let mut driven = vec![0.0; self.t.len()];
            for (input, factor) in &coordinates[i].driven {
                let Some(u) = self.inputs.get(*input) else { continue };
                driven.iter_mut().zip(u).for_each(|(d, u)| *d += u * factor * f);
            }
            [own, driven]
        });
        all.collect()
    }
}
