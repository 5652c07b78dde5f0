//! The form that every model takes: a hybrid system in the sense of FMI Model Exchange.
//!
//! Between events the *modes* are frozen and [`Hybrid::rates`] is smooth; an event is due where one of
//! [`Hybrid::indicators`] changes its domain (`z > 0` to `z <= 0` or back) or at [`Hybrid::next_event`];
//! at an event [`Hybrid::update`] is called, over and over, until it reports that nothing changed.
//! A model holds its structure only: values come in as slices, so the same model serves `f64` and duals.

use crate::Scalar;
use crate::event::Direction;

/// How many values of each kind a model has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ModelSizes {
    /// Continuous states. A sampled quantity is a state whose rate is 0 and that jumps at events.
    pub states: usize,
    /// Inputs.
    pub inputs: usize,
    /// Parameters.
    pub parameters: usize,
    /// Outputs (Booleans as 0 and 1).
    pub outputs: usize,
    /// Modes: integers that change at events only.
    pub modes: usize,
    /// Event indicators.
    pub indicators: usize,
}

/// All that an equation may read at one instant; SI units.
#[derive(Clone, Copy, Debug)]
pub struct At<'a, T> {
    /// Time in s.
    pub t: T,
    /// Continuous states.
    pub x: &'a [T],
    /// Inputs.
    pub u: &'a [T],
    /// Parameters.
    pub p: &'a [T],
    /// Modes, frozen between events.
    pub modes: &'a [i32],
}

/// What one pass of event iteration did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EventUpdate {
    /// A mode changed: another pass is due.
    pub modes: bool,
    /// A continuous state was given a new value: the integrator has to restart from it.
    pub states: bool,
}

impl EventUpdate {
    /// Nothing changed: the iteration has ended.
    pub fn settled(self) -> bool {
        !(self.modes || self.states)
    }
}

/// A hybrid model. `&self` is its structure (numbers of links, which joints are flexible, which effects).
pub trait Hybrid {
    /// How many values of each kind.
    fn sizes(&self) -> ModelSizes;
    /// Initial continuous states from the parameters (length `states`).
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]);
    /// Modes that fit the initial states; called once, before the first event iteration, `at.modes` all 0.
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]);
    /// Time derivatives of the states (length `states`), smooth while the modes are frozen.
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]);
    /// Outputs (length `outputs`).
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]);
    /// Event indicators (length `indicators`); an event is due where one leaves or enters `z > 0`.
    /// [`Hybrid::update`] has to decide by the same expressions, `z = 0` as part of the lower domain: from above it counts as
    /// crossed, from below not yet.
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]);
    /// Which domain changes of an indicator matter; one that does not is no event.
    fn direction(&self, _indicator: usize) -> Direction {
        Direction::Both
    }
    /// One pass of event iteration at time `t`; may change states and modes.
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate;
    /// The time of the next event that is known beforehand (later than the last update), in s.
    fn next_event(&self, _p: &[f64], _modes: &[i32]) -> Option<f64> {
        None
    }
    /// The stiff part of df/dx, where the model can solve with it at little cost.
    fn stiff_part(&self) -> Option<&dyn StiffPart> {
        None
    }
}

/// A part A of df/dx that holds all that is stiff in it, for methods that keep their order whatever A is (W-methods:
/// Steihaug, Wolfbrandt 1979) and their stability as long as the rest is not stiff.
pub trait StiffPart {
    /// Numbers that [`Self::factor`] needs room for.
    fn room(&self) -> usize;
    /// Factors of 1 - g A at this instant into `room`, g in s, and the rates there into `dx`, of which much is the same.
    ///
    /// # Errors
    /// The row of a pivot that is none.
    fn factor(&self, at: At<f64>, g: f64, room: &mut [f64], dx: &mut [f64]) -> Result<(), usize>;
    /// Solves (1 - g A) y' = y in place, `room` as [`Self::factor`] left it.
    fn solve(&self, room: &[f64], y: &mut [f64]);
}

/// Implements [`Hybrid`] by handing every call on: `delegate_hybrid!(Either { Either::A(m) => m, Either::B(m) => m })`.
#[macro_export]
macro_rules! delegate_hybrid {
    ($type:ty { $($variant:pat => $model:expr),+ $(,)? }) => {
        impl $crate::hybrid::Hybrid for $type {
            fn sizes(&self) -> $crate::hybrid::ModelSizes {
                match self { $($variant => $model.sizes()),+ }
            }
            fn start<T: $crate::Scalar>(&self, p: &[T], x: &mut [T]) {
                match self { $($variant => $model.start(p, x)),+ }
            }
            fn start_modes(&self, at: $crate::hybrid::At<f64>, modes: &mut [i32]) {
                match self { $($variant => $model.start_modes(at, modes)),+ }
            }
            fn rates<T: $crate::Scalar>(&self, at: $crate::hybrid::At<T>, dx: &mut [T]) {
                match self { $($variant => $model.rates(at, dx)),+ }
            }
            fn outputs<T: $crate::Scalar>(&self, at: $crate::hybrid::At<T>, y: &mut [T]) {
                match self { $($variant => $model.outputs(at, y)),+ }
            }
            fn indicators<T: $crate::Scalar>(&self, at: $crate::hybrid::At<T>, z: &mut [T]) {
                match self { $($variant => $model.indicators(at, z)),+ }
            }
            fn direction(&self, indicator: usize) -> $crate::event::Direction {
                match self { $($variant => $model.direction(indicator)),+ }
            }
            fn update(
                &self,
                t: f64,
                x: &mut [f64],
                u: &[f64],
                p: &[f64],
                modes: &mut [i32],
            ) -> $crate::hybrid::EventUpdate {
                match self { $($variant => $model.update(t, x, u, p, modes)),+ }
            }
            fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
                match self { $($variant => $model.next_event(p, modes)),+ }
            }
            fn stiff_part(&self) -> Option<&dyn $crate::hybrid::StiffPart> {
                match self { $($variant => $model.stiff_part()),+ }
            }
        }
    };
}
