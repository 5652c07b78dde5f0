//! A manipulator, some of whose motors move as they were measured, whatever torque that takes (ARM-14).
//!
//! The way of S0, section 4: joints 2 and 3 follow their encoders, joint 1 is driven by its torque, or follows its
//! motor's encoder too; the satellite moves as momentum demands.

use super::PlanarManipulator;
use super::layout::input;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// States, parameters and outputs are the manipulator's. Inputs: the manipulator's (the torque of a prescribed motor is not
/// read), then the acceleration of each prescribed motor in rad/s2. Its initial angle and rate are in the
/// initial states.
#[derive(Clone, Debug)]
pub struct Replay {
    pub(super) arm: PlanarManipulator,
    pub(super) led: Vec<usize>,
}

impl Replay {
    /// Leads the motors of these joints (from 0; of a rigid joint, the joint itself). `None` where the manipulator
    /// has no such joint, or friction: a prescribed motor does not stick.
    pub fn new(arm: PlanarManipulator, led: &[usize]) -> Option<Self> {
        let fits = !arm.has_friction() && led.iter().all(|j| *j < arm.links());
        fits.then(|| Self { arm, led: led.to_vec() })
    }

    /// The manipulator.
    pub fn arm(&self) -> &PlanarManipulator {
        &self.arm
    }

    /// Index of the acceleration of the `i`-th prescribed motor among the inputs.
    pub fn acceleration(&self, i: usize) -> usize {
        input::count(self.arm.links()) + i
    }

    /// Rates of the states with forces on the coordinates; empty: none. They do not act on a prescribed motor.
    pub(super) fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]) {
        let mut led = [(0, T::zero()); super::MAX_LINKS];
        for (i, j) in self.led.iter().enumerate() {
            led[i] = (self.arm.motor(*j), at.u[self.acceleration(i)]);
        }
        self.arm.rates_under(at, &led[..self.led.len()], force, dx);
    }
}

impl Hybrid for Replay {
    fn sizes(&self) -> ModelSizes {
        let sizes = self.arm.sizes();
        ModelSizes { inputs: sizes.inputs + self.led.len(), ..sizes }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        self.arm.start(p, x);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.arm.start_modes(at, modes);
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.rates_under(at, &[], dx);
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.arm.outputs(at, y);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        self.arm.indicators(at, z);
    }
    fn direction(&self, indicator: usize) -> trueup_numerics::event::Direction {
        self.arm.direction(indicator)
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.arm.update(t, x, u, p, modes)
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.arm.next_event(p, modes)
    }
}
