//! The directions in which a simulation is differentiated along the way, from duals.

use trueup_fmi_import::integration::SensitivityLane;
use trueup_plant::Lanes;

use super::{FmuSubject, VariablePlace};
use crate::predict::InputMap;

/// A direction of unknowns.
pub(super) struct LaneDirection {
    /// What moves along the way.
    pub(super) lane: SensitivityLane,
    /// Moves of all parameters, for the initial states.
    pub(super) moves: Vec<f64>,
    /// Moves of the inputs' gains and biases.
    pub(super) map: InputMap<f64>,
}

impl FmuSubject {
    /// The directions of these duals.
    pub(super) fn directions(
        &self,
        p: &[Lanes],
        map: &InputMap<Lanes>,
        acting: &[usize],
    ) -> Vec<LaneDirection> {
        let moves = |v: &[Lanes], k: usize| -> Vec<f64> { v.iter().map(|v| v.eps[k]).collect() };
        let one = |&k: &usize| {
            let (mut lane, moves_of_all) = (SensitivityLane::default(), moves(p, k));
            // Without an entry of its own an input would count with gain 1.
            let zero = |v: Vec<f64>| if v.is_empty() { vec![0.0; self.inputs.len()] } else { v };
            let map = InputMap { gain: zero(moves(&map.gain, k)), bias: zero(moves(&map.bias, k)) };
            if map.gain.iter().chain(&map.bias).any(|e| *e != 0.0) {
                lane.u = vec![0.0; self.inputs.len()];
                lane.du = lane.u.clone();
            }
            // What sets the beginning acts through it alone.
            let acts = |place: &&VariablePlace| {
                place.elements.clone().any(|i| moves_of_all[i] != 0.0 && !self.initial.contains(&i))
            };
            for place in self.parameter_places.iter().filter(acts) {
                lane.parameters.push(place.reference);
                lane.by.extend(&moves_of_all[place.elements.clone()]);
                lane.at.extend(p[place.elements.clone()].iter().map(|v| v.re));
            }
            LaneDirection { lane, moves: moves_of_all, map }
        };
        acting.iter().map(one).collect()
    }
}
