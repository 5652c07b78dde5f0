//! `FlexibleArm` in the form that every model takes.

use super::MAX_JOINTS;
use super::layout::{Outputs, Parameters};
use super::structure::FlexibleArmStructure;
use crate::friction::{self, Levels, STUCK};
use crate::space::layout::{self as space, States};
use crate::space::stiff::Brake;
use crate::space::{MAX_TIPS, PrescribedAccelerations, SpatialFreeFlyer, StickSlip};
use arrayvec::ArrayVec;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes, StiffPart};

/// Inputs of the bodies at most: torques of the joints, wrenches at the tips.
const MAX_INPUTS: usize = MAX_JOINTS + 6 * MAX_TIPS;

/// An arm with flexible joints and links on the ground (S3): its structure and the positions of its values.
///
/// Continuous states: q_i of the joints, q_mi of the motors \[rad, joint side\], xi of the links \[m; rad\], and their rates. Each
/// motor of a flexible joint has a mode of friction, as [`crate::friction`] describes.
///
/// What it gets wrong: links bend as beams of Euler and Bernoulli; without axial stiffening neither a load along a link nor its
/// spin stiffens it; the joint's spring is linear; friction does not depend on temperature or load and has no pre-sliding.
#[derive(Clone, Debug)]
pub struct FlexibleArm {
    structure: FlexibleArmStructure,
    pub(super) bodies: SpatialFreeFlyer,
    pub(super) state: States,
    pub(super) input: space::Inputs,
    pub(super) body_parameter: space::Parameters,
    pub(super) parameter: Parameters,
    output: Outputs,
    body_output: space::Outputs,
    sizes: ModelSizes,
}

/// Of all joints.
pub(super) type PerJoint<V> = ArrayVec<V, MAX_JOINTS>;

impl FlexibleArm {
    /// A model of that structure.
    ///
    /// # Errors
    /// What of it is not possible, with the remedy.
    pub fn new(structure: FlexibleArmStructure) -> Result<Self, String> {
        let s = &structure.robot;
        let n = s.bodies();
        if n == 0 || n > MAX_JOINTS {
            return Err(format!("an arm of {n} joints cannot be had: give it 1 to {MAX_JOINTS}"));
        }
        if !s.held {
            return Err("FlexibleArm has a fixed base; a free one is SpatialFreeFlyer's".to_owned());
        }
        if s.panels() > 0 || s.thrusters > 0 {
            return Err(
                "FlexibleArm has no appendages and no thrusters on its base; leave them out".to_owned()
            );
        }
        let bodies = SpatialFreeFlyer::new(s.clone())?;
        let own = bodies.sizes();
        let parameter = Parameters::new(&structure).behind(own.parameters);
        let output = Outputs::new(&structure).behind(own.outputs);
        let sizes = ModelSizes {
            parameters: parameter.count,
            outputs: output.count,
            modes: n,
            indicators: 2 * n,
            ..own
        };
        Ok(Self {
            state: States::new(s),
            input: space::Inputs::new(s),
            body_parameter: space::Parameters::new(s),
            body_output: space::Outputs::new(s),
            bodies,
            parameter,
            output,
            sizes,
            structure,
        })
    }

    /// What is fixed.
    pub fn structure(&self) -> &FlexibleArmStructure {
        &self.structure
    }
    /// Its bodies, which have the first of its parameters, all of its states and inputs, the first of its outputs.
    pub fn bodies(&self) -> &SpatialFreeFlyer {
        &self.bodies
    }
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.structure.robot.bodies()
    }
    /// Conditions on parameters that no single bound can say.
    ///
    /// # Errors
    /// The index of the parameter that is at fault, the error and the remedy.
    pub fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        self.bodies.check(p)?;
        for j in (0..self.joints()).filter(|j| self.bodies.motor_row(*j).is_none()) {
            for (name, begin) in [
                ("coulombFriction", self.parameter.coulomb_friction),
                ("staticFriction", self.parameter.static_friction),
            ] {
                let (i, value) = (j + 1, p[begin + j]);
                if value > 0.0 {
                    let message = format!(
                        "{name}[{i}] = {value} is refused: joint {i} is rigid, and dry friction acts on the motor of a flexible joint; give 0, or pack the model with jointFlexible[{i}] = true"
                    );
                    return Err((begin + j, message));
                }
            }
        }
        Ok(())
    }

    /// Start values: those of the bodies, motors of 0.02 N.m/A without friction.
    pub fn defaults(&self) -> Vec<f64> {
        let mut p = self.bodies.defaults();
        p.resize(self.sizes.parameters, 0.0);
        if self.structure.by_current {
            p[self.parameter.torque_constant..][..self.joints()].fill(TORQUE_CONSTANT);
        }
        p
    }

    /// Of the motor, joint side: n K_t I (LNK-6).
    fn drive_torque<T: Scalar>(&self, at: &At<T>, joint: usize) -> T {
        let u = at.u[self.input.joint_torque + joint];
        if !self.structure.by_current {
            return u;
        }
        at.p[self.body_parameter.gear_ratio + joint] * at.p[self.parameter.torque_constant + joint] * u // (LNK-6)
    }

    /// Of friction in direction +1 or -1.
    pub(super) fn levels<T: Scalar>(&self, at: &At<T>, joint: usize, way: f64) -> Levels<T> {
        let p = &self.parameter;
        let speed = at.x[self.rate_row(joint)] * way;
        friction::paper(
            at.p[p.coulomb_friction + joint],
            at.p[p.static_friction + joint],
            at.p[p.viscous_friction + joint],
            speed,
        )
    }

    /// Of a motor that slides, against its motion where positive: 0 of one that sticks, whose friction is what holds it.
    fn sliding<T: Scalar>(&self, at: &At<T>, joint: usize) -> T {
        let mode = at.modes[joint];
        if mode == STUCK {
            return T::zero();
        }
        let way = friction::direction(mode, at.x[self.rate_row(joint)]);
        let levels = self.levels(at, joint, way);
        // Without dry friction the levels' dry part is 0.
        levels.braking() * way
    }

    /// The bodies with what their motors give: their inputs, and the motors that stick.
    pub(super) fn driven<T: Scalar>(&self, at: &At<T>) -> ([T; MAX_INPUTS], PerJoint<(usize, T)>) {
        let mut u = [T::zero(); MAX_INPUTS];
        u[..at.u.len()].copy_from_slice(at.u);
        for j in 0..self.joints() {
            u[self.input.joint_torque + j] = self.drive_torque(at, j) - self.sliding(at, j);
        }
        let stuck = (0..self.joints()).filter(|j| at.modes[*j] == STUCK);
        (u, stuck.map(|j| (j, T::zero())).collect())
    }

    /// Rates of the states, and what friction balances at each motor that sticks, N.m (0 of the others).
    pub(super) fn rates_and_held<T: Scalar>(&self, at: &At<T>, dx: &mut [T]) -> PerJoint<T> {
        let (u, stuck) = self.driven(at);
        let own = At { u: &u[..at.u.len()], ..*at };
        let mut needed: PerJoint<T> = (0..self.joints()).map(|_| T::zero()).collect();
        self.bodies.rates_with_torques(
            own,
            PrescribedAccelerations { base: None, joints: &[], motors: &stuck },
            dx,
            &mut needed,
        );
        self.balance(at, &u, &mut needed);
        needed
    }

    /// The friction torques that balance sticking motors, in addition to the torques of their springs; 0 for the others.
    fn balance<T: Scalar>(&self, at: &At<T>, u: &[T], needed: &mut [T]) {
        for j in 0..self.joints() {
            needed[j] = if at.modes[j] == STUCK {
                u[self.input.joint_torque + j] - self.bodies.transmission_torque(at, j) - needed[j]
            } else {
                T::zero()
            };
        }
    }
}

/// Of a motor without a description, N.m/A.
const TORQUE_CONSTANT: f64 = 0.02;

impl Hybrid for FlexibleArm {
    fn sizes(&self) -> ModelSizes {
        self.sizes
    }

    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        self.bodies.start(p, x);
    }

    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.start_friction(&at, modes);
    }

    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let (u, stuck) = self.driven(&at);
        let own = At { u: &u[..at.u.len()], ..at };
        self.bodies.rates_prescribed(
            own,
            PrescribedAccelerations { base: None, joints: &[], motors: &stuck },
            dx,
        );
    }

    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (u, stuck) = self.driven(&at);
        let own = At { u: &u[..at.u.len()], ..at };
        let mut held: PerJoint<T> = (0..self.joints()).map(|_| T::zero()).collect();
        self.bodies.outputs_prescribed(
            own,
            PrescribedAccelerations { base: None, joints: &[], motors: &stuck },
            y,
            &mut held,
        );
        self.balance(&at, &u, &mut held);
        let to = &self.output;
        for j in 0..self.joints() {
            let sticks = at.modes[j] == STUCK;
            y[to.motor_torque + j] = self.drive_torque(&at, j);
            y[to.transmission_torque + j] = self.bodies.transmission_torque(&at, j);
            y[to.friction_torque + j] = if sticks { held[j] } else { self.sliding(&at, j) };
            y[to.sticking + j] = T::constant(if sticks { 1.0 } else { 0.0 });
        }
        if !self.structure.robot.tips.is_empty() {
            let rigid = self.rigid_tip(&at);
            for (k, rigid) in rigid.into_iter().enumerate() {
                y[to.tip_deflection + k] = y[self.body_output.tip_position + k] - rigid; // (LNK-7)
            }
        }
    }

    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        self.friction_indicators(&at, z);
    }

    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.update_friction(t, x, u, p, modes)
    }

    fn stiff_part(&self) -> Option<&dyn StiffPart> {
        Some(self)
    }
}

impl StiffPart for FlexibleArm {
    fn room(&self) -> usize {
        self.bodies.stiff_room()
    }

    fn factor(&self, at: At<f64>, g: f64, room: &mut [f64], dx: &mut [f64]) -> Result<(), usize> {
        let (u, stuck) = self.driven(&at);
        let own = At { u: &u[..at.u.len()], ..at };
        let brake = |j: usize| match at.modes[j] {
            STUCK => Brake::Stuck,
            _ => Brake::Viscous(at.p[self.parameter.viscous_friction + j]),
        };
        let prescribed = PrescribedAccelerations { base: None, joints: &[], motors: &stuck };
        self.bodies.factor_stiff(&own, prescribed, (g, brake), room, dx)
    }

    fn solve(&self, room: &[f64], y: &mut [f64]) {
        self.bodies.solve_stiff(room, y);
    }
}

/// States at most.
pub(super) const MAX_STATES: usize = 2 * (2 * MAX_JOINTS + crate::space::MAX_MODES_OF_ALL);

impl FlexibleArm {
    /// Where the first tip would be if joint angles equalled their motors' angles and links were straight, inertial axes (LNK-7).
    fn rigid_tip<T: Scalar>(&self, at: &At<T>) -> [T; 3] {
        let own = |j: usize| self.bodies.motor_row(j).unwrap_or(self.state.joint_angle + j);
        let q: PerJoint<T> = (0..self.joints()).map(|j| at.x[own(j)]).collect();
        self.bodies.straight_tip(at.p, &q)
    }
}
