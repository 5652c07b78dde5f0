//! Inverse dynamics: the torques of motors that move as prescribed, on a base that floats or is fixed (ARM-17).
//!
//! The way of S0, section 4: torques of the reference model (rigid joints) from the measured motion. Base and links behind springs move
//! as they have to.

use super::layout::input;
use super::solve::Symmetric;
use super::{MAX_LINKS, PlanarManipulator};
use crate::drive::Spring;
use crate::layout::{InputStart, Items, LayoutEntry, Shows};
use trueup_numerics::Scalar;
use trueup_numerics::driver::{DriveError, DriverOptions, SimulationRecord, simulate};
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Name of the choice of [`JOINT_DRIVE`].
pub const JOINT_DRIVE_CHOICE: &str = "drive";
/// Item of [`JOINT_DRIVE`], counted from 1.
pub const BY_ACCELERATION: u32 = 2;
/// What drives the joints, in the order of its choice.
pub static JOINT_DRIVE: Items = Items {
    name: "JointDrive",
    text: "What drives the joints",
    items: &[
        ("torque", "input jointTorque"),
        (
            "acceleration",
            "input motorAcceleration, whatever torque that takes, which is the output jointTorque",
        ),
    ],
};

/// Most inputs of a manipulator without effects.
const MOST_INPUTS: usize = input::count(MAX_LINKS);

/// A manipulator whose motors (of rigid joints: the joints) have prescribed accelerations. States and parameters are the
/// manipulator's; inputs, too, with `motorAcceleration` for `jointTorque`; behind its outputs `jointTorque`.
#[derive(Clone, Debug)]
pub struct InverseDynamics {
    arm: PlanarManipulator,
}

impl InverseDynamics {
    /// Of this manipulator.
    ///
    /// # Errors
    /// It has effects: a motor that sticks or lags does not move as prescribed.
    pub fn new(arm: PlanarManipulator) -> Result<Self, String> {
        if let Some(e) = arm.effects().iter().next() {
            return Err(format!(
                "`{}` with drive = acceleration: inverse dynamics is of the model without effects; leave the effect out, or use drive = torque",
                e.spec().id
            ));
        }
        Ok(Self { arm })
    }
    /// The manipulator.
    pub fn arm(&self) -> &PlanarManipulator {
        &self.arm
    }
    /// What is an input for `jointTorque`.
    pub fn given(&self) -> LayoutEntry<InputStart> {
        LayoutEntry {
            name: "motorAcceleration",
            dimensions: vec![self.arm.links()],
            unit: "rad/s2",
            kind: &[],
            text: "Prescribed, of the motors, joint side; of rigid joints: the joints (ARM-14)",
        }
    }
    /// The output behind those of the manipulator.
    pub fn found(&self) -> LayoutEntry<Shows> {
        LayoutEntry {
            name: "jointTorque",
            dimensions: vec![self.arm.links()],
            unit: "N.m",
            kind: Shows::All,
            text: "Torques that the prescribed accelerations take, tau, joint side (ARM-17)",
        }
    }

    /// Inputs without torques, and the accelerations of the motors' rows.
    fn parted<T: Scalar>(&self, u: &[T]) -> ([T; MOST_INPUTS], [(usize, T); MAX_LINKS]) {
        let n = self.arm.links();
        let mut rest = [T::zero(); MOST_INPUTS];
        rest[..u.len()].copy_from_slice(u);
        let mut led = [(0, T::zero()); MAX_LINKS];
        for (j, led) in led.iter_mut().enumerate().take(n) {
            let at = input::joint_torque(n) + j;
            *led = (self.arm.motor(j), u[at]);
            rest[at] = T::zero();
        }
        (rest, led)
    }

    /// States, outputs and torques at these times, from the initial states among `p`; `accelerations` of the motors at a time, rad/s2.
    ///
    /// # Errors
    /// See [`DriveError`].
    pub fn along(
        &self,
        p: &[f64],
        accelerations: &dyn Fn(f64, &mut [f64]),
        times: &[f64],
    ) -> Result<SimulationRecord, DriveError> {
        let n = self.arm.links();
        let given = |t: f64, u: &mut [f64]| accelerations(t, &mut u[input::joint_torque(n)..][..n]);
        let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
        simulate(self, p, &vec![1e-2; self.sizes().states], options, &given, times)
    }
}

impl Hybrid for InverseDynamics {
    fn sizes(&self) -> ModelSizes {
        let own = self.arm.sizes();
        ModelSizes { outputs: own.outputs + self.arm.links(), ..own }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        self.arm.start(p, x);
    }
    fn start_modes(&self, _: At<f64>, _: &mut [i32]) {}
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let (rest, led) = self.parted(at.u);
        self.arm.rates_prescribed(At { u: &rest[..at.u.len()], ..at }, &led[..self.arm.links()], dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (rest, led) = self.parted(at.u);
        let at = At { u: &rest[..at.u.len()], ..at };
        let (own, torque) = y.split_at_mut(self.arm.sizes().outputs);
        self.arm.outputs(at, own);
        self.arm.torques_led(at, &led[..self.arm.links()], torque);
    }
    fn indicators<T: Scalar>(&self, _: At<T>, _: &mut [T]) {}
    fn update(&self, _: f64, _: &mut [f64], _: &[f64], _: &[f64], _: &mut [i32]) -> EventUpdate {
        EventUpdate::default()
    }
}

impl PlanarManipulator {
    /// Torques of the motors, joint side, that accelerations of their rows take; without friction.
    fn torques_led<T: Scalar>(&self, at: At<T>, led: &[(usize, T)], torque: &mut [T]) {
        let motion = self.motion(&at);
        let acceleration = self.balance_prescribed(&at, &motion, led, &[]).acceleration;
        let mass: Symmetric<T> = self.mass(at.p, &motion);
        let other = self.forces(&at, &motion, &mass, &mut [Spring::default(); MAX_LINKS]);
        for (j, torque) in torque.iter_mut().enumerate() {
            let row = self.motor(j);
            *torque = mass.row_times(row, &acceleration[..self.dofs()]) - other[row]; // (ARM-17)
        }
    }
}
