//! The control law of one joint by itself: that of an arm of one joint, without a torque that is added.

use super::{ManipulatorController, input};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// The control law for one joint; the first output is the motor's current in A, limited.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JointController;

const ONE: ManipulatorController = ManipulatorController { joints: 1 };

impl JointController {
    /// As [`ManipulatorController::check`].
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        ONE.check(p)
    }
}

impl Hybrid for JointController {
    fn sizes(&self) -> ModelSizes {
        ModelSizes { inputs: input::COUNT, ..ONE.sizes() }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        ONE.start(p, x);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        ONE.start_modes(at, modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        ONE.rates(at, dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        ONE.outputs(at, y);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        ONE.indicators(at, z);
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        ONE.update(t, x, u, p, modes)
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        ONE.next_event(p, modes)
    }
}
