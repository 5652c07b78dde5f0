//! A direction in which a simulation is differentiated along the way.

use super::{FmuModel, Place};
use crate::predict::InputMap;
use trueup_plant::Lanes;

/// Parameters and inputs that move in one direction.
#[derive(Clone, Debug, Default)]
pub(super) struct Lane {
    /// Value references of the parameters that move, and by how much, element by element.
    parameters: Vec<u32>,
    by: Vec<f64>,
    /// Where they are.
    at: Vec<f64>,
    /// All parameters' moves, for the initial states.
    pub(super) moves: Vec<f64>,
    /// What the inputs do from the last node on, with their slopes.
    pub(super) u: Vec<f64>,
    pub(super) du: Vec<f64>,
}

impl Lane {
    /// Knowns and seed of a directional derivative, `since` s after the last node.
    pub(super) fn knowns(
        &self,
        states: &[u32],
        s: &[f64],
        inputs: &[u32],
        since: f64,
    ) -> (Vec<u32>, Vec<f64>) {
        let (mut by, mut seed) = (states.to_vec(), s.to_vec());
        if self.u.iter().chain(&self.du).any(|v| *v != 0.0) {
            by.extend(inputs);
            seed.extend(self.u.iter().zip(&self.du).map(|(u, du)| u + du * since));
        }
        by.extend(&self.parameters);
        seed.extend(&self.by);
        (by, seed)
    }
    /// Parameters move, not the initial states alone.
    pub(super) fn tunes(&self) -> bool {
        !self.parameters.is_empty()
    }
    /// The parameters, and their values `by` further on.
    pub(super) fn tuned(&self, by: f64) -> (Vec<u32>, Vec<f64>) {
        (self.parameters.clone(), self.at.iter().zip(&self.by).map(|(p, m)| p + by * m).collect())
    }
}

impl FmuModel {
    /// The directions of these duals.
    pub(super) fn lanes(&self, p: &[Lanes], map: &InputMap<Lanes>, acting: &[usize]) -> Vec<Lane> {
        let moves = |v: &[Lanes], k: usize| -> Vec<f64> { v.iter().map(|v| v.eps[k]).collect() };
        let one = |&k: &usize| {
            let mut lane = Lane { moves: moves(p, k), ..Lane::default() };
            let inputs = moves(&map.gain, k).into_iter().chain(moves(&map.bias, k));
            if inputs.into_iter().any(|e| e != 0.0) {
                lane.u = vec![0.0; self.inputs.len()];
                lane.du = lane.u.clone();
            }
            // What sets the beginning acts through it alone.
            let acts = |place: &&Place| {
                (place.begin..place.begin + place.len)
                    .any(|i| lane.moves[i] != 0.0 && !self.initial.contains(&i))
            };
            let acting: Vec<&Place> = self.parameter_places.iter().filter(acts).collect();
            for place in acting {
                lane.parameters.push(place.reference);
                let elements = place.begin..place.begin + place.len;
                lane.by.extend(&lane.moves[elements.clone()]);
                lane.at.extend(p[elements].iter().map(|v| v.re));
            }
            lane
        };
        acting.iter().map(one).collect()
    }
}
