//! `FreeBody`: a rigid body that floats in the plane, with docking points that forces act at.
//!
//! Positive directions: inertial frame; angles, rates and torques from x to y. What it gets wrong: nothing but forces at the
//! docking points acts on it.

use super::MAX_PORTS;
use super::frame::{ContactVector, ContactWrench, PointFrame, cross, dot, frame, scale, sub, two};
use super::layout::{BodyInputs, BodyOutputs, BodyParameters, BodyStates};
use super::presets::SIM2;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Mass and inertia about the centre of mass.
#[derive(Clone, Copy, Debug)]
pub(super) struct Inertia<T> {
    pub mass: T,
    pub inertia: T,
}

impl<T: Scalar> Inertia<T> {
    /// Accelerations by a wrench about the centre of mass: m dv/dt = F, I d(omega)/dt = sum of torque + r x F.
    pub(super) fn accelerated(&self, by: &ContactWrench<T>) -> (ContactVector<T>, T) {
        (by.force.map(|f| f / self.mass), by.torque / self.inertia) // (CON-9)
    }
    /// Momentum, angular momentum about the inertial origin, twice the kinetic energy, of a centre of mass that moves so.
    pub(super) fn momenta(&self, at: &PointFrame<T>) -> (ContactVector<T>, T, T) {
        let momentum = scale(self.mass, at.velocity);
        let angular = cross(at.position, momentum) + self.inertia * at.rate;
        (momentum, angular, self.mass * dot(at.velocity, at.velocity) + self.inertia * at.rate * at.rate)
    }
}

/// Adds a wrench about a point of a body to one about its centre of mass.
pub(super) fn carry<T: Scalar>(
    sum: &mut ContactWrench<T>,
    wrench: &ContactWrench<T>,
    point: ContactVector<T>,
    center: ContactVector<T>,
) {
    sum.add(wrench.force, sub(point, center)); // (CON-9)
    sum.torque += wrench.torque;
}

/// Where position, attitude, velocity and rate of a body begin among its parameters, states or outputs.
pub(super) type BodyMotionIndices = [usize; 4];

/// Writes how a body moves.
pub(super) fn put<T: Scalar>(
    values: &mut [T],
    [position, attitude, velocity, rate]: BodyMotionIndices,
    of: &PointFrame<T>,
) {
    values[position..position + 2].copy_from_slice(&of.position);
    values[velocity..velocity + 2].copy_from_slice(&of.velocity);
    (values[attitude], values[rate]) = (of.attitude, of.rate);
}

/// Writes the rates of the states of a body that a wrench about its centre of mass acts on.
pub(super) fn put_rates<T: Scalar>(
    dx: &mut [T],
    [position, attitude, velocity, rate]: BodyMotionIndices,
    of: &PointFrame<T>,
    inertia: &Inertia<T>,
    by: &ContactWrench<T>,
) {
    let (acceleration, turning) = inertia.accelerated(by);
    dx[position..position + 2].copy_from_slice(&of.velocity);
    dx[velocity..velocity + 2].copy_from_slice(&acceleration);
    (dx[attitude], dx[rate]) = (of.rate, turning);
}

/// Adds momentum, angular momentum and kinetic energy of a body to those at these places.
pub(super) fn add_momenta<T: Scalar>(
    y: &mut [T],
    [linear, angular, kinetic]: [usize; 3],
    inertia: &Inertia<T>,
    of: &PointFrame<T>,
) {
    let (momentum, about, twice) = inertia.momenta(of);
    for i in 0..2 {
        y[linear + i] += momentum[i];
    }
    y[angular] += about;
    y[kinetic] += twice * 0.5;
}

/// Writes position, velocity, momenta and kinetic energy of a body.
pub(super) fn put_body<T: Scalar>(
    y: &mut [T],
    motion: BodyMotionIndices,
    [linear, angular, kinetic]: [usize; 3],
    inertia: &Inertia<T>,
    of: &PointFrame<T>,
) {
    put(y, motion, of);
    y[linear..linear + 2].fill(T::zero());
    (y[angular], y[kinetic]) = (T::zero(), T::zero());
    add_momenta(y, [linear, angular, kinetic], inertia, of);
}

/// The structure of a floating body: its docking points.
#[derive(Clone, Debug)]
pub struct FreeBody {
    ports: usize,
    parameters: BodyParameters,
    inputs: BodyInputs,
    outputs: BodyOutputs,
    states: BodyStates,
}

impl FreeBody {
    /// With that many docking points.
    ///
    /// # Errors
    /// None of them, or more than [`MAX_PORTS`].
    pub fn new(ports: usize) -> Result<Self, String> {
        if ports == 0 || ports > MAX_PORTS {
            return Err(format!(
                "a body of {ports} docking points: it has 1 to {MAX_PORTS}; give numberOfPorts"
            ));
        }
        Ok(Self {
            ports,
            parameters: BodyParameters::new(&ports),
            inputs: BodyInputs::new(&ports),
            outputs: BodyOutputs::new(&ports),
            states: BodyStates::new(&ports),
        })
    }
    /// Docking points.
    pub fn ports(&self) -> usize {
        self.ports
    }
    /// The target of SIM2 with its port where the hand of `CaptureScene` expects it; further ports at its centre of mass.
    pub fn defaults(&self) -> Vec<f64> {
        let at = &self.parameters;
        let mut p = vec![0.0; at.count];
        (p[at.mass], p[at.inertia]) = (SIM2.target_mass, SIM2.target_inertia);
        for i in 0..2 {
            p[at.port + i] = -SIM2.target_center[i];
            p[at.position + i] = SIM2.end_effector[i] + SIM2.port_offset[i] + SIM2.target_center[i];
        }
        p
    }
    fn moved(&self) -> BodyMotionIndices {
        let at = &self.states;
        [at.position, at.attitude, at.velocity, at.rate]
    }
    fn inertia<T: Scalar>(&self, p: &[T]) -> Inertia<T> {
        Inertia { mass: p[self.parameters.mass], inertia: p[self.parameters.inertia] }
    }
}

impl Hybrid for FreeBody {
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
        let body = frame(at.x, self.moved());
        let mut sum = ContactWrench::default();
        for k in 0..self.ports {
            let force = two(at.u, self.inputs.force + 2 * k);
            let wrench = ContactWrench { force, torque: at.u[self.inputs.torque + k] };
            let point = body.at(two(at.p, self.parameters.port + 2 * k)).position;
            carry(&mut sum, &wrench, point, body.position);
        }
        put_rates(dx, self.moved(), &body, &self.inertia(at.p), &sum);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (body, to) = (frame(at.x, self.moved()), &self.outputs);
        let motion = [to.position, to.attitude, to.velocity, to.rate];
        let momenta = [to.linear_momentum, to.angular_momentum, to.kinetic_energy];
        put_body(y, motion, momenta, &self.inertia(at.p), &body);
        for k in 0..self.ports {
            let port = body.at(two(at.p, self.parameters.port + 2 * k));
            for i in 0..2 {
                y[to.port_point + 2 * k + i] = port.position[i];
                y[to.port_velocity + 2 * k + i] = port.velocity[i];
            }
            (y[to.port_attitude + k], y[to.port_rate + k]) = (body.attitude, body.rate);
        }
    }
    fn indicators<T: Scalar>(&self, _at: At<T>, _z: &mut [T]) {}
    fn update(&self, _t: f64, _x: &mut [f64], _u: &[f64], _p: &[f64], _modes: &mut [i32]) -> EventUpdate {
        EventUpdate::default()
    }
}
