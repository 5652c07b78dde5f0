//! What carries the hand in a capture: a model of its own, whose inputs take what the contact does to the hand.
//!
//! Positive directions: inertial frame; angles, rates and torques from x to y.

use super::bodies::{BodyMotionIndices, Inertia, carry, put, put_body, put_rates};
use super::frame::{ContactWrench, PointFrame, frame, two};
use super::layout::{ChaserInputs, ChaserOutputs, ChaserParameters, ChaserStates};
use super::presets::{Capture, SIM2};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// A chaser with a hand.
pub trait Chaser: Hybrid {
    /// The capture whose values are the defaults of gripper and target.
    fn capture(&self) -> Capture;
    /// Default values of its parameters: it comes nearer at that capture's speed.
    fn approaching(&self) -> Vec<f64>;
    /// Whether the parameters fit each other.
    ///
    /// # Errors
    /// Where they contradict each other: the index of one of them, and the remedy.
    fn fits(&self, p: &[f64]) -> Result<(), (usize, String)>;
    /// The end effector at its reference point.
    fn hand<T: Scalar>(&self, x: &[T], p: &[T]) -> PointFrame<T>;
    /// Adds a wrench on the end effector about its reference point to the inputs.
    fn push<T: Scalar>(&self, x: &[T], p: &[T], wrench: &ContactWrench<T>, u: &mut [T]);
    /// Where its outputs linear momentum, angular momentum about the inertial origin, and kinetic energy begin.
    fn momenta(&self) -> [usize; 3];
}

/// One rigid body with its arm (S2 section 3.2: the manipulator holds its configuration), as in SIM2.
#[derive(Clone, Copy, Debug)]
pub struct RigidChaser {
    parameters: ChaserParameters,
    inputs: ChaserInputs,
    outputs: ChaserOutputs,
    states: ChaserStates,
}

impl Default for RigidChaser {
    fn default() -> Self {
        Self {
            parameters: ChaserParameters::new(&()),
            inputs: ChaserInputs::new(&()),
            outputs: ChaserOutputs::new(&()),
            states: ChaserStates::new(&()),
        }
    }
}

impl RigidChaser {
    fn moved(&self) -> BodyMotionIndices {
        let at = &self.states;
        [at.position, at.attitude, at.velocity, at.rate]
    }
    fn body<T: Scalar>(&self, x: &[T]) -> PointFrame<T> {
        frame(x, self.moved())
    }
    fn inertia<T: Scalar>(&self, p: &[T]) -> Inertia<T> {
        Inertia { mass: p[self.parameters.mass], inertia: p[self.parameters.inertia] }
    }
}

impl Chaser for RigidChaser {
    fn capture(&self) -> Capture {
        SIM2
    }
    fn approaching(&self) -> Vec<f64> {
        let at = &self.parameters;
        let mut p = vec![0.0; at.count];
        (p[at.mass], p[at.inertia]) = (SIM2.chaser_mass, SIM2.chaser_inertia);
        p[at.velocity] = SIM2.speed;
        p[at.end_effector..at.end_effector + 2].copy_from_slice(&SIM2.end_effector);
        p
    }
    fn fits(&self, _p: &[f64]) -> Result<(), (usize, String)> {
        Ok(())
    }
    fn hand<T: Scalar>(&self, x: &[T], p: &[T]) -> PointFrame<T> {
        self.body(x).at(two(p, self.parameters.end_effector))
    }
    fn push<T: Scalar>(&self, x: &[T], p: &[T], wrench: &ContactWrench<T>, u: &mut [T]) {
        let body = self.body(x);
        let mut sum = ContactWrench { force: two(u, self.inputs.force), torque: u[self.inputs.torque] };
        let hand = body.at(two(p, self.parameters.end_effector));
        carry(&mut sum, wrench, hand.position, body.position);
        u[self.inputs.force..self.inputs.force + 2].copy_from_slice(&sum.force);
        u[self.inputs.torque] = sum.torque;
    }
    fn momenta(&self) -> [usize; 3] {
        let at = &self.outputs;
        [at.linear_momentum, at.angular_momentum, at.kinetic_energy]
    }
}

impl Hybrid for RigidChaser {
    fn sizes(&self) -> ModelSizes {
        ModelSizes {
            states: self.states.count,
            inputs: self.inputs.count,
            parameters: self.parameters.count,
            outputs: self.outputs.count,
            modes: 0,
            indicators: 0,
        }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let from = &self.parameters;
        put(x, self.moved(), &frame(p, [from.position, from.attitude, from.velocity, from.rate]));
    }
    fn start_modes(&self, _at: At<f64>, _modes: &mut [i32]) {}
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let wrench = ContactWrench { force: two(at.u, self.inputs.force), torque: at.u[self.inputs.torque] };
        put_rates(dx, self.moved(), &self.body(at.x), &self.inertia(at.p), &wrench);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let to = &self.outputs;
        let motion = [to.position, to.attitude, to.velocity, to.rate];
        put_body(y, motion, self.momenta(), &self.inertia(at.p), &self.body(at.x));
    }
    fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}
    fn update(&self, _t: f64, _x: &mut [f64], _u: &[f64], _p: &[f64], _modes: &mut [i32]) -> EventUpdate {
        EventUpdate::default()
    }
}
