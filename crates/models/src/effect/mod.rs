//! Effects: what may act in a plant beyond its own equations.
//!
//! An effect is one small file: its equation, its parameters with bounds, its states if it has any, and the
//! place where it enters (a method of [`Effect`]). Adding one means writing that file and naming it here and in
//! `list.rs`. Without effects a plant has none of their variables.
//!
//! Effects of scope [`Scope::Joint`] stand once per joint: on the arm their parameters, states and outputs
//! are vectors, and an element whose amplitude is 0 does nothing.

mod backlash;
mod base_drag;
mod flexible_link;
mod gravity_torque;
mod list;
mod motor_friction;
mod nonlinear_stiffness;
pub mod set;
mod stribeck_friction;
mod table_tilt;
mod transmission_hysteresis;

use crate::drive::{Base, Drive, Spring, Wrench};
use crate::friction::Levels;
use trueup_numerics::Scalar;

pub use list::{ALL, Kind};
pub use set::EffectSet;

/// The two plants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Plant {
    /// TwoMassJoint: angles and torques of the drive are referred to the motor.
    Joint,
    /// PlanarManipulator: they are referred to the joint.
    Arm,
}

/// How often an effect stands in a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Once per joint.
    Joint,
    /// Once.
    Once,
}

/// A parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterSpec {
    /// FMU variable.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// With symbol.
    pub description: &'static str,
    /// Smallest value.
    pub min: f64,
    /// `min` itself is not allowed.
    pub above_min: bool,
    /// Largest value.
    pub max: f64,
    /// Start value when packed into a [`Plant::Joint`] (DELIAN joint 1): visible, not neutral.
    pub joint_start: f64,
    /// Start value when packed into a [`Plant::Arm`] (CBK PAN test-bed).
    pub arm_start: f64,
}

/// A state or an output of an effect.
#[derive(Clone, Copy, Debug)]
pub struct SignalSpec {
    /// FMU variable (of a state: without the prefix `state.`).
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// FMU variable on the arm, where `name` means something else there; else empty.
    pub arm_name: &'static str,
    /// With symbol.
    pub description: &'static str,
    /// Magnitude that a solver should resolve, for a state.
    pub nominal: f64,
    /// Unit of the derivative, for a state.
    pub rate_unit: &'static str,
    /// A Boolean (outputs only).
    pub boolean: bool,
}

impl SignalSpec {
    /// Its name in that plant.
    pub fn name_in(&self, plant: Plant) -> &'static str {
        if plant == Plant::Arm && !self.arm_name.is_empty() { self.arm_name } else { self.name }
    }
}

/// What an effect tells of itself.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// The id that users see.
    pub id: &'static str,
    /// Where it acts: actuator, motor-friction, transmission, load, base, tip, sensor.
    pub component: &'static str,
    /// One line.
    pub summary: &'static str,
    /// Once per joint, or once.
    pub scope: Scope,
    /// The plants that it can act in.
    pub plants: &'static [Plant],
    /// Parameters of its own.
    pub parameters: &'static [ParameterSpec],
    /// States of its own.
    pub states: &'static [SignalSpec],
    /// Outputs of its own.
    pub outputs: &'static [SignalSpec],
    /// Modes of its own (per site).
    pub modes: usize,
    /// Event indicators of its own (per site).
    pub indicators: usize,
    /// It needs the motor friction of S3 eq. 3, 4, which the joint has and the arm gets with the effect.
    pub friction: bool,
}

impl Spec {
    /// What a specification is filled up with.
    pub const NONE: Self = Self {
        id: "",
        component: "",
        summary: "",
        scope: Scope::Joint,
        plants: &[],
        parameters: &[],
        states: &[],
        outputs: &[],
        modes: 0,
        indicators: 0,
        friction: false,
    };
}

impl ParameterSpec {
    /// What a parameter is filled up with: no bounds, start 0.
    pub const NONE: Self = Self {
        name: "",
        unit: "1",
        description: "",
        min: f64::NEG_INFINITY,
        above_min: false,
        max: f64::INFINITY,
        joint_start: 0.0,
        arm_start: 0.0,
    };
}

/// The values of one effect at one site. Vectors are stored variable by variable, so that element `k` of a
/// site is `sites` apart from element `k + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Local<'a, T> {
    p: &'a [T],
    x: &'a [T],
    modes: &'a [i32],
    site: usize,
    sites: usize,
}

impl<'a, T: Scalar> Local<'a, T> {
    /// The effect's own stretch of parameters, states and modes, seen from one of its sites.
    pub fn new(p: &'a [T], x: &'a [T], modes: &'a [i32], site: usize, sites: usize) -> Self {
        Self { p, x, modes, site, sites }
    }
    /// Parameter `k`.
    pub fn p(&self, k: usize) -> T {
        self.p[k * self.sites + self.site]
    }
    /// State `k`.
    pub fn x(&self, k: usize) -> T {
        self.x[k * self.sites + self.site]
    }
    /// Mode `k`.
    pub fn mode(&self, k: usize) -> i32 {
        self.modes[k * self.sites + self.site]
    }
}

/// An effect: where it does not enter, the methods stay as they are here.
pub trait Effect {
    /// What it is.
    const SPEC: Spec;

    /// Motor torque after the amplifier, N.m; `torque` is what came so far.
    fn actuator<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, torque: T) -> T {
        torque
    }
    /// Motor friction in direction `direction` (+1 or -1), N.m.
    fn friction<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _direction: f64, _levels: &mut Levels<T>) {}
    /// The compliant element.
    fn spring<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _s: &mut Spring<T>) {}
    /// Torque on the link from outside the drive train, N.m (load side, positive along the link's angle).
    fn link_torque<T: Scalar>(_l: &Local<T>, _d: &Drive<T>) -> T {
        T::zero()
    }
    /// A uniform acceleration field over all bodies, m/s2, inertial frame.
    fn field<T: Scalar>(_l: &Local<T>) -> [T; 2] {
        [T::zero(); 2]
    }
    /// Wrench on the base at its centre of mass.
    fn base<T: Scalar>(_l: &Local<T>, _b: &Base<T>) -> Wrench<T> {
        Wrench::default()
    }
    /// What a sensor of the joint shows instead of `reading`; channel by output name.
    fn sensor<T: Scalar>(_l: &Local<T>, _channel: &str, _d: &Drive<T>, reading: T) -> T {
        reading
    }
    /// Initial values of its states.
    fn start<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _x: &mut [T]) {}
    /// Rates of its states.
    fn rates<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _s: &Spring<T>, _dx: &mut [T]) {}
    /// Its outputs.
    fn outputs<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _y: &mut [T]) {}
    /// Its event indicators.
    fn indicators<T: Scalar>(_l: &Local<T>, _d: &Drive<T>, _z: &mut [T]) {}
    /// The modes that fit this instant (`modes` holds the present ones).
    fn update(_l: &Local<f64>, _d: &Drive<f64>, _modes: &mut [i32]) {}
    /// Kinetic energy and potential energy of its own, J.
    fn energy<T: Scalar>(_l: &Local<T>, _d: &Drive<T>) -> [T; 2] {
        [T::zero(); 2]
    }
    /// Angular momentum of its own, kg.m2/s.
    fn angular_momentum<T: Scalar>(_l: &Local<T>, _d: &Drive<T>) -> T {
        T::zero()
    }
}
