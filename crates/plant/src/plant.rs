//! A plant as an object.

use std::any::Any;
use std::fmt::Debug;

use crate::lanes::Lanes;
use crate::{Coordinate, InsertionPoint, VariableTable, insertion_points};
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, ModelSizes};

/// A plant that cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlantError(
    /// What is wrong, and the remedy.
    pub String,
);

impl std::fmt::Display for PlantError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}
impl std::error::Error for PlantError {}

/// A plant: variables, coordinates, and the equations of a hybrid system (as
/// [`Hybrid`](trueup_numerics::hybrid::Hybrid) has them) at `f64` and at [`Lanes`]. The value of a lane equals the `f64` result bit
/// by bit.
///
/// `force` holds one generalised force per coordinate, in its unit; empty: none act. They act in addition to the plant's own forces, and
/// dry friction that holds a coordinate balances them.
pub trait Plant: Debug + Send + Sync {
    /// Name of the model.
    fn model(&self) -> &str;
    /// Its variables.
    fn table(&self) -> &VariableTable;
    /// Its coordinates.
    fn coordinates(&self) -> &[Coordinate];
    /// Where something that it lacks can act: generalised forces, errors of readings, gains and offsets of inputs.
    fn insertion_points(&self) -> Vec<InsertionPoint> {
        insertion_points(self.table(), self.coordinates())
    }
    /// How many values of each kind.
    fn sizes(&self) -> ModelSizes;
    /// Rates and outputs are affine in states and inputs while the modes are frozen, and do not depend on time: steps are then
    /// exact, by the matrix exponential. Wrongly claimed, predictions are wrong.
    fn affine(&self) -> bool {
        false
    }
    /// States that follow others at a rate of their own, however fast (strained bristles): dx/dt = g - lambda x. Steps take
    /// lambda exactly, so that they need not be as short.
    fn followers(&self) -> &[usize] {
        &[]
    }
    /// The same plant with these effects instead of its own.
    ///
    /// # Errors
    /// An effect that it cannot have, with the remedy.
    fn with(&self, effects: &[&str]) -> Result<Box<dyn Plant>, PlantError>;
    /// The model behind it, for the list of models that made it.
    fn as_any(&self) -> &dyn Any;

    /// Initial continuous states from the parameters.
    fn start(&self, p: &[f64], x: &mut [f64]);
    /// [`Plant::start`] with derivatives.
    fn start_lanes(&self, p: &[Lanes], x: &mut [Lanes]);
    /// Sets the initial-state parameters such that the run starts at rest, in equilibrium with the inputs `u`. What the
    /// equilibrium does not determine stays.
    fn rest(&self, p: &mut [f64], u: &[f64]);
    /// [`Plant::rest`] with derivatives.
    fn rest_lanes(&self, p: &mut [Lanes], u: &[Lanes]);
    /// Modes that fit the initial states; called once, before the first event iteration.
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]);
    /// Time derivatives of the states under these forces.
    fn rates(&self, at: At<f64>, force: &[f64], dx: &mut [f64]);
    /// [`Plant::rates`] with derivatives.
    fn rates_lanes(&self, at: At<Lanes>, force: &[Lanes], dx: &mut [Lanes]);
    /// Outputs, no forces acting.
    fn outputs(&self, at: At<f64>, y: &mut [f64]);
    /// [`Plant::outputs`] with derivatives.
    fn outputs_lanes(&self, at: At<Lanes>, y: &mut [Lanes]);
    /// Event indicators, no forces acting.
    fn indicators(&self, at: At<f64>, z: &mut [f64]);
    /// [`Plant::indicators`] with derivatives.
    fn indicators_lanes(&self, at: At<Lanes>, z: &mut [Lanes]);
    /// Which domain changes of an indicator matter.
    fn direction(&self, indicator: usize) -> Direction;
    /// One pass of event iteration at time `t`; may change states and modes.
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate;
    /// The time of the next event that is known beforehand, in s.
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64>;
}
