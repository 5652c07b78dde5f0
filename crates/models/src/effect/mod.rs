//! Effects: what may act in a plant beyond its own equations.
//!
//! An effect is one small file: its equation, its parameters with bounds, its states if it has any, and the
//! place where it enters (a method of [`Effect`]). Adding one means writing that file and naming it here and in
//! `list.rs`. Without effects a plant has none of their variables.
//!
//! Effects of scope [`Scope::Joint`] occur once per joint: on the arm their parameters, states and outputs
//! are vectors, and an element whose amplitude is 0 does nothing.

mod actuator_lag;
mod appendage_mode;
mod asymmetric_friction;
mod backlash;
mod base_drag;
mod base_thrust;
mod cable_stiffness;
mod channel;
mod choice;
mod current_saturation;
mod external_force;
mod flexible_link;
mod friction_drift;
mod gravity_torque;
mod joint_flexibility;
mod kinematic_error;
mod list;
mod load_dependent_friction;
mod load_friction;
mod memory;
mod motor_friction;
mod nonlinear_damping;
mod nonlinear_stiffness;
mod nonlinear_viscous_friction;
mod position_servo;
mod power;
mod presliding_friction;
mod sensor_delay;
mod sensor_drift;
mod sensor_eccentricity;
pub mod set;
mod spec;
mod stribeck_friction;
mod table_tilt;
mod torque_ripple;
mod transmission_hysteresis;

use crate::drive::{BaseMotion, BaseWrench, DriveTrain, FlyerBase, Spring};
use crate::friction::Levels;
use crate::space::spatial::SpatialWrench;
use trueup_numerics::Scalar;

pub use choice::{EffectChoice, EffectError};
pub use external_force::PUSHES;
pub use list::{ALL, EffectKind};
pub use set::{EffectSet, PlacedEffect};
pub use spec::{
    Borrowed, EffectPlace, EffectScale, Measure, Neutral, ParameterRole, ParameterSpec, PlantKind,
    SEARCHED_ORDERS, Scope, SearchRange, SignalSpec, Spec,
};

/// The values of one effect at one site. Vectors are stored variable by variable, so that element `k` of a
/// site is `sites` apart from element `k + 1`.
#[derive(Clone, Copy, Debug)]
pub struct Local<'a, T> {
    p: &'a [T],
    x: &'a [T],
    modes: &'a [i32],
    u: &'a [T],
    site: usize,
    sites: usize,
    place: usize,
}

impl<'a, T: Scalar> Local<'a, T> {
    /// The effect's own stretch of parameters, states and modes, seen from one of its sites.
    pub fn new(p: &'a [T], x: &'a [T], modes: &'a [i32], site: usize, sites: usize) -> Self {
        Self { p, x, modes, u: &[], site, sites, place: 0 }
    }
    /// The same with its own stretch of the plant's inputs.
    pub fn with_inputs(self, u: &'a [T]) -> Self {
        Self { u, ..self }
    }
    /// The same in that place of the specification.
    pub fn in_place(self, place: usize) -> Self {
        Self { place, ..self }
    }
    /// Parameter `k`.
    pub fn p(&self, k: usize) -> T {
        self.p[k * self.sites + self.site]
    }
    /// State `k`.
    pub fn x(&self, k: usize) -> T {
        self.x[k * self.sites + self.site]
    }
    /// Input `k`; 0 as long as the plant has no inputs yet.
    pub fn u(&self, k: usize) -> T {
        self.u.get(k * self.sites + self.site).copied().unwrap_or_else(T::zero)
    }
    /// Mode `k`; 0 as long as the plant has no modes yet.
    pub fn mode(&self, k: usize) -> i32 {
        self.modes.get(k * self.sites + self.site).copied().unwrap_or(0)
    }
    /// Which of the specification's places it acts in.
    pub fn place(&self) -> usize {
        self.place
    }
}

/// An effect: where it does not enter, the methods stay as they are here.
pub trait Effect {
    /// The specification.
    const SPEC: Spec;

    /// The gear: what it does to deflection, rate and `slope` of the drive.
    fn gear<T: Scalar>(_l: &Local<T>, _d: &mut DriveTrain<T>) {}
    /// Motor torque after the amplifier, N.m; `torque` is what came so far.
    fn actuator<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, torque: T) -> T {
        torque
    }
    /// Motor friction in direction `direction` (+1 or -1), N.m.
    fn friction<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _direction: f64, _levels: &mut Levels<T>) {}
    /// Dry friction where the plant may have none.
    fn dry(_l: &Local<f64>) -> bool {
        false
    }
    /// The compliant element.
    fn spring<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _s: &mut Spring<T>) {}
    /// Torque on the link from outside the drive train, N.m (load side, positive along the link's angle).
    fn link_torque<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>) -> T {
        T::zero()
    }
    /// Torque between a link and the body that carries it, N.m (load side, positive drives the link forward).
    fn joint_torque<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>) -> T {
        T::zero()
    }
    /// A uniform acceleration field over all bodies, m/s2, inertial frame.
    fn field<T: Scalar>(_l: &Local<T>) -> [T; 2] {
        [T::zero(); 2]
    }
    /// Wrench on the base at its centre of mass.
    fn base<T: Scalar>(_l: &Local<T>, _b: &BaseMotion<T>) -> BaseWrench<T> {
        BaseWrench::default()
    }
    /// Wrench on the last link at its tip.
    fn tip<T: Scalar>(_l: &Local<T>, _b: &BaseMotion<T>) -> BaseWrench<T> {
        BaseWrench::default()
    }
    /// Wrench on the base of a robot in space, at its centre of mass, inertial axes.
    fn space_base<T: Scalar>(_l: &Local<T>, _b: &FlyerBase<T>) -> SpatialWrench<T> {
        SpatialWrench::zero()
    }
    /// Wrench on the body of a robot's first tip, at that tip, inertial axes.
    fn space_tip<T: Scalar>(_l: &Local<T>, _b: &FlyerBase<T>) -> SpatialWrench<T> {
        SpatialWrench::zero()
    }
    /// What a sensor shows instead of `reading`, at time `t`.
    fn sensor<T: Scalar>(_l: &Local<T>, _t: T, reading: T) -> T {
        reading
    }
    /// Initial values of its states.
    fn start<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _x: &mut [T]) {}
    /// Rates of its states.
    fn rates<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _s: &Spring<T>, _dx: &mut [T]) {}
    /// Initial values of a sensor's states.
    fn sensor_start<T: Scalar>(_l: &Local<T>, _reading: T, _x: &mut [T]) {}
    /// Rates of a sensor's states.
    fn sensor_rates<T: Scalar>(_l: &Local<T>, _reading: T, _dx: &mut [T]) {}
    /// Its outputs.
    fn outputs<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _y: &mut [T]) {}
    /// Its event indicators.
    fn indicators<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>, _z: &mut [T]) {}
    /// The modes that fit this instant (`modes` holds the present ones).
    fn update(_l: &Local<f64>, _d: &DriveTrain<f64>, _modes: &mut [i32]) {}
    /// The time of its next event that is known beforehand, s; infinite: none.
    fn next_event(_l: &Local<f64>) -> f64 {
        f64::INFINITY
    }
    /// Kinetic energy and potential energy of its own, J.
    fn energy<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>) -> [T; 2] {
        [T::zero(); 2]
    }
    /// Angular momentum of its own, kg.m2/s.
    fn angular_momentum<T: Scalar>(_l: &Local<T>, _d: &DriveTrain<T>) -> T {
        T::zero()
    }
}
