//! [`TwoMassJoint`] behind a gearbox of two stages, whose figures are the parameters (S3 section 3.2, GB-1).

use super::{JointLayout, TwoMassJoint, parameter};
use crate::gearbox::{Equivalent, Stage, series};
use crate::layout::AllowedValues::{Any, NotNegative, OneUp, Positive};
use crate::layout::{Items, LayoutEntry, Parameter, Shows, layout};
use crate::presets;
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

/// Name of the choice of [`GEARBOX`].
pub const GEARBOX_CHOICE: &str = "gearbox";
/// Item of [`GEARBOX`], counted from 1.
pub const TWO_STAGES: u32 = 2;
/// What describes the transmission, in the order of its choice.
pub static GEARBOX: Items = Items {
    name: "Gearbox",
    text: "What describes the transmission",
    items: &[
        ("equivalent", "one stage: stiffness, damping, gearRatio"),
        ("two-stages", "planetary gear and harmonic drive, each with inertia, stiffness, damping and ratio"),
    ],
};

layout! {
    /// Places of the parameters.
    TwoStageParameters of Parameter, s: ():
    motor_inertia "motorInertia" [], "kg.m2", Parameter::tunable(Positive), "Motor alone, J_m (GB-1)";
    load_inertia "loadInertia" [], "kg.m2", Parameter::tunable(Positive), "Load alone, load side, J_l (GB-1); with a flexible link its hub";
    torque_constant "torqueConstant" [], "N.m/A", Parameter::tunable(Any), "Motor torque per current, K_t (TMJ-1)";
    planetary_inertia "planetaryInertia" [], "kg.m2", Parameter::tunable(NotNegative), "Planetary gear at its input, J_pl (GB-1)";
    planetary_stiffness "planetaryStiffness" [], "N.m/rad", Parameter::tunable(Positive), "Planetary gear at its input, K_pl (GB-1)";
    planetary_damping "planetaryDamping" [], "N.m.s/rad", Parameter::tunable(NotNegative), "Planetary gear at its input, D_pl (GB-1)";
    planetary_ratio "planetaryRatio" [], "1", Parameter::fixed(OneUp), "Turns of the motor per turn of the planetary gear's output, n_pl (GB-1)";
    harmonic_drive_inertia "harmonicDriveInertia" [], "kg.m2", Parameter::tunable(NotNegative), "Harmonic drive at its input, J_hd (GB-1)";
    harmonic_drive_stiffness "harmonicDriveStiffness" [], "N.m/rad", Parameter::tunable(Positive), "Harmonic drive at its input, K_hd (GB-1)";
    harmonic_drive_damping "harmonicDriveDamping" [], "N.m.s/rad", Parameter::tunable(NotNegative), "Harmonic drive at its input, D_hd (GB-1)";
    harmonic_drive_ratio "harmonicDriveRatio" [], "1", Parameter::fixed(OneUp), "Turns of the harmonic drive's input per turn of the load, n_hd (GB-1)";
    coulomb_friction "coulombFriction" [], "N.m", Parameter::tunable(NotNegative), "At the motor, tau_c (TMJ-4)";
    static_friction "staticFriction" [], "N.m", Parameter::tunable(NotNegative), "Break-away level at the motor, tau_s (TMJ-4); taken as tau_c where it is below";
    viscous_friction "viscousFriction" [], "N.m.s/rad", Parameter::tunable(NotNegative), "At the motor, D_m (TMJ-4)";
    initial_motor_angle "initialMotorAngle" [], "rad", Parameter::initial(), "q_m at the start";
    initial_motor_velocity "initialMotorVelocity" [], "rad/s", Parameter::initial(), "d(q_m)/dt at the start";
    initial_load_angle "initialLoadAngle" [], "rad", Parameter::initial(), "q_l at the start";
    initial_load_velocity "initialLoadVelocity" [], "rad/s", Parameter::initial(), "d(q_l)/dt at the start";
}

/// Most parameters of the joint with one stage and its effects.
const MOST: usize = 256;
/// Outputs behind those of the joint and its effects.
const SHOWN: usize = 3;

/// A joint with two stages. States, inputs and outputs are those of the joint; behind its outputs K_eq, D_eq and n_eq.
#[derive(Clone, Debug)]
pub struct TwoStageJoint {
    joint: TwoMassJoint,
    places: TwoStageParameters,
}

impl TwoStageJoint {
    /// Two stages in front of the load of this joint.
    ///
    /// # Errors
    /// A joint without a spring, or with more effects than there is room for; with the remedy.
    pub fn new(joint: TwoMassJoint) -> Result<Self, String> {
        if !joint.flexible() {
            return Err("a rigid joint has no springs of its stages; pack it with jointFlexible = true, or with gearbox = equivalent".into());
        }
        let count = joint.sizes().parameters;
        if count > MOST {
            return Err(format!(
                "{count} parameters of effects and joint are more than {MOST}; use fewer effects"
            ));
        }
        Ok(Self { joint, places: TwoStageParameters::new(&()) })
    }
    /// The joint.
    pub fn joint(&self) -> &TwoMassJoint {
        &self.joint
    }
    /// Its own parameters in order; those of effects come behind them.
    pub fn parameters(&self) -> Vec<LayoutEntry<Parameter>> {
        TwoStageParameters::list(&())
    }
    /// Where its own parameters are.
    pub fn places(&self) -> &TwoStageParameters {
        &self.places
    }
    /// The outputs behind those of the joint and its effects.
    pub fn shown() -> [LayoutEntry<Shows>; SHOWN] {
        let entry =
            |name, unit, text| LayoutEntry { name, dimensions: Vec::new(), unit, kind: Shows::On(&[]), text };
        [
            entry("equivalentStiffness", "N.m/rad", "Of both stages, motor side, K_eq (GB-1)"),
            entry("equivalentDamping", "N.m.s/rad", "Of both stages, motor side, D_eq (GB-1)"),
            entry("gearRatio", "1", "Motor turns per load turn, n_eq (GB-1)"),
        ]
    }
    /// What decides which variables the joint has; `gear_ratio` of both stages.
    pub fn layout(&self, gear_ratio: Option<f64>) -> JointLayout {
        self.joint.layout(gear_ratio)
    }
    /// Start values of its own parameters: joint 1 of DELIAN, half of its compliance in each stage (assumed), stages without inertia.
    pub fn defaults(&self) -> Vec<f64> {
        const HARMONIC_DRIVE: f64 = 160.0;
        let one = presets::delian(1).unwrap_or_default();
        let s = &self.places;
        let ratio = one[parameter::GEAR_RATIO] / HARMONIC_DRIVE;
        let (k, d) = (2.0 * one[parameter::STIFFNESS], 2.0 * one[parameter::DAMPING]);
        let mut p = vec![0.0; s.count];
        for (at, value) in [
            (s.motor_inertia, one[parameter::MOTOR_INERTIA]),
            (s.load_inertia, one[parameter::LOAD_INERTIA]),
            (s.torque_constant, one[parameter::TORQUE_CONSTANT]),
            (s.planetary_stiffness, k),
            (s.planetary_damping, d),
            (s.planetary_ratio, ratio),
            (s.harmonic_drive_stiffness, k * ratio * ratio),
            (s.harmonic_drive_damping, d * ratio * ratio),
            (s.harmonic_drive_ratio, HARMONIC_DRIVE),
            (s.coulomb_friction, one[parameter::COULOMB_FRICTION]),
            (s.static_friction, one[parameter::STATIC_FRICTION]),
            (s.viscous_friction, one[parameter::VISCOUS_FRICTION]),
        ] {
            p[at] = value;
        }
        p
    }

    /// Both stages as one (GB-1).
    pub fn equivalent<T: Scalar>(&self, p: &[T]) -> Equivalent<T> {
        let s = &self.places;
        let planetary = Stage {
            inertia: p[s.planetary_inertia],
            stiffness: p[s.planetary_stiffness],
            damping: p[s.planetary_damping],
            ratio: p[s.planetary_ratio],
        };
        let harmonic_drive = Stage {
            inertia: p[s.harmonic_drive_inertia],
            stiffness: p[s.harmonic_drive_stiffness],
            damping: p[s.harmonic_drive_damping],
            ratio: p[s.harmonic_drive_ratio],
        };
        series(&planetary, &harmonic_drive, p[s.motor_inertia], p[s.load_inertia])
    }

    /// Parameters of the joint with one stage.
    fn as_one<T: Scalar>(&self, p: &[T]) -> [T; MOST] {
        let (s, e) = (&self.places, self.equivalent(p));
        let mut own = [T::zero(); MOST];
        for (at, value) in [
            (parameter::MOTOR_INERTIA, e.motor_inertia),
            (parameter::LOAD_INERTIA, e.load_inertia),
            (parameter::GEAR_RATIO, e.ratio),
            (parameter::TORQUE_CONSTANT, p[s.torque_constant]),
            (parameter::STIFFNESS, e.stiffness),
            (parameter::DAMPING, e.damping),
            (parameter::COULOMB_FRICTION, p[s.coulomb_friction]),
            (parameter::STATIC_FRICTION, p[s.static_friction]),
            (parameter::VISCOUS_FRICTION, p[s.viscous_friction]),
            (parameter::INITIAL_MOTOR_ANGLE, p[s.initial_motor_angle]),
            (parameter::INITIAL_MOTOR_VELOCITY, p[s.initial_motor_velocity]),
            (parameter::INITIAL_LOAD_ANGLE, p[s.initial_load_angle]),
            (parameter::INITIAL_LOAD_VELOCITY, p[s.initial_load_velocity]),
        ] {
            own[at] = value;
        }
        let of_effects = &p[s.count..];
        own[parameter::COUNT..][..of_effects.len()].copy_from_slice(of_effects);
        own
    }
    fn own<'a, T>(&self, all: &'a [T; MOST]) -> &'a [T] {
        &all[..self.joint.sizes().parameters]
    }
}

impl Hybrid for TwoStageJoint {
    fn sizes(&self) -> ModelSizes {
        let own = self.joint.sizes();
        ModelSizes {
            parameters: own.parameters + self.places.count - parameter::COUNT,
            outputs: own.outputs + SHOWN,
            ..own
        }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        self.joint.start(self.own(&self.as_one(p)), x);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.joint.start_modes(At { p: self.own(&self.as_one(at.p)), ..at }, modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        self.joint.rates(At { p: self.own(&self.as_one(at.p)), ..at }, dx);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        let (own, shown) = y.split_at_mut(self.joint.sizes().outputs);
        self.joint.outputs(At { p: self.own(&self.as_one(at.p)), ..at }, own);
        let e = self.equivalent(at.p);
        shown.copy_from_slice(&[e.stiffness, e.damping, e.ratio]);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        self.joint.indicators(At { p: self.own(&self.as_one(at.p)), ..at }, z);
    }
    fn direction(&self, indicator: usize) -> trueup_numerics::event::Direction {
        self.joint.direction(indicator)
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.joint.update(t, x, u, self.own(&self.as_one(p)), modes)
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.joint.next_event(self.own(&self.as_one(p)), modes)
    }
}
