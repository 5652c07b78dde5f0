//! Directions in which a run is differentiated, and the sensitivities in them.

use crate::{AnyInstance, ImportError, StateColumns};

/// A direction in which parameters and inputs move.
#[derive(Clone, Debug, Default)]
pub struct SensitivityLane {
    /// Value references of the parameters that move.
    pub parameters: Vec<u32>,
    /// By how much, element by element.
    pub by: Vec<f64>,
    /// Where they are.
    pub at: Vec<f64>,
    /// By how much the inputs move from [`Sensitivities::since`] on; empty: they do not.
    pub u: Vec<f64>,
    /// Slopes of that in 1/s.
    pub du: Vec<f64>,
}

impl SensitivityLane {
    /// Parameters move, not the initial states and inputs alone.
    pub(super) fn tunes(&self) -> bool {
        !self.parameters.is_empty()
    }
    /// Values of the parameters `by` further on.
    pub(super) fn tuned(&self, by: f64) -> Vec<f64> {
        self.at.iter().zip(&self.by).map(|(p, m)| p + by * m).collect()
    }
}

/// The directions of a run.
#[derive(Clone, Debug, Default)]
pub struct Sensitivities {
    /// One direction each.
    pub lanes: Vec<SensitivityLane>,
    /// Value references of the inputs.
    pub inputs: Vec<u32>,
    /// Time in s from which the inputs move as the lanes have it.
    pub since: f64,
}

/// The sensitivities of a group under way.
pub(super) struct CarriedSensitivity {
    pub(super) of: Sensitivities,
    pub(super) columns: StateColumns,
    /// Value references of the event indicators (FMI 3.0); empty: they are no variables.
    pub(super) shown: Vec<u32>,
    pub(super) departed: Option<Departed>,
}

/// The states before an event, and how it moves with the lanes.
pub(super) struct Departed {
    pub(super) x: Vec<f64>,
    /// None: it does not move.
    pub(super) late: Option<Late>,
}

/// An event that moves with the lanes.
pub(super) struct Late {
    /// Rates of the states before it.
    pub(super) before: Vec<f64>,
    /// By how much later it comes, one per lane.
    pub(super) by: Vec<f64>,
    /// The FMU is in event mode already.
    pub(super) entered: bool,
}

impl CarriedSensitivity {
    /// Knowns and seed of a directional derivative at `time`, the states moving by `s`.
    pub(super) fn knowns(&self, lane: usize, s: &[f64], time: f64) -> (Vec<u32>, Vec<f64>) {
        let lane = &self.of.lanes[lane];
        let (mut by, mut seed) = (self.columns.states.clone(), s.to_vec());
        if lane.u.iter().chain(&lane.du).any(|v| *v != 0.0) {
            by.extend(&self.of.inputs);
            let since = time - self.of.since;
            seed.extend(lane.u.iter().zip(&lane.du).map(|(u, du)| u + du * since));
        }
        by.extend(&lane.parameters);
        seed.extend(&lane.by);
        (by, seed)
    }

    /// Rates of the sensitivities, which are behind the states in `x`, into their places in `dx`.
    pub(super) fn rates(
        &self,
        instance: &mut AnyInstance,
        time: f64,
        x: &[f64],
        dx: &mut [f64],
    ) -> Result<(), ImportError> {
        let n = self.columns.states.len();
        for lane in (0..self.of.lanes.len()).filter(|_| n > 0) {
            let at = n * (lane + 1)..n * (lane + 2);
            let (by, seed) = self.knowns(lane, &x[at.clone()], time);
            instance.directional(&self.columns.derivatives, &by, &seed, &mut dx[at])?;
        }
        Ok(())
    }
}
