//! What an effect declares of itself, for packers and for the search for effects in data.

/// The plants that effects act in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlantKind {
    /// TwoMassJoint: angles and torques of the drive are referred to the motor.
    Joint,
    /// PlanarManipulator: they are referred to the joint.
    Arm,
    /// SpatialFreeFlyer, alone or as the chaser of CaptureScene: as an arm's, base and tips in three dimensions.
    Space,
}

/// How often an effect occurs in a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scope {
    /// Once per joint: on the arm its parameters, states and outputs are vectors.
    Joint,
    /// Once.
    Once,
    /// Once per element of the output that it acts on.
    Channel,
}

/// What kind of number a parameter is, for an estimator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterRole {
    /// The effect grows with it; where all amplitudes are neutral the effect vanishes.
    Amplitude,
    /// Forms the effect; without meaning where the amplitudes are neutral.
    Shape,
    /// Sets a unit of measure; not to be estimated.
    Reference,
    /// The state of the effect when a run begins: a first state, which each recording has its own of. At its start value the
    /// effect begins again.
    Initial,
}

/// What sizes in a plant and its recordings the size of an effect is measured by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// Typical motor torque, drive's side, N.m.
    Torque,
    /// Typical motor speed, drive's side, rad/s.
    Speed,
    /// Typical deflection of the transmission (torque over stiffness), drive's side, rad.
    Deflection,
    /// Typical rate of the deflection, rad/s.
    DeflectionRate,
    /// Typical torque on the load, N.m.
    LoadTorque,
    /// Range of the load's angle, rad.
    LoadAngle,
    /// Typical speed of the load, rad/s.
    LoadSpeed,
    /// Moment of inertia of the load (of the link), kg.m2.
    LoadInertia,
    /// Typical force on the base, N.
    Force,
    /// Range of the base's position, m.
    Position,
    /// Typical velocity of the base, m/s.
    Velocity,
    /// Typical torque on the base, N.m.
    BaseTorque,
    /// Range of the base's attitude, rad.
    BaseAngle,
    /// Typical rate of the base, rad/s.
    BaseRate,
    /// Moment of inertia of the base, kg.m2.
    BaseInertia,
    /// Total mass, kg.
    Mass,
    /// Range of the reading, in its unit.
    Reading,
    /// Length of a recording, s.
    Duration,
    /// Angular frequency at which a load swings on its joint's spring, rad/s.
    Mode,
}

/// A size at which a parameter of an effect becomes visible: a factor times powers of [`Measure`]s. It serves as the
/// standard deviation of a prior on an amplitude, and as the middle of one on a shape.
#[derive(Clone, Copy, Debug)]
pub struct EffectScale {
    /// Share of the product, or the value itself where there are no powers.
    pub factor: f64,
    /// Measures and their exponents.
    pub powers: &'static [(Measure, i32)],
}

impl EffectScale {
    /// A plain number in the parameter's unit.
    pub const fn plain(value: f64) -> Self {
        Self { factor: value, powers: &[] }
    }
    /// `factor` times the measures to their powers.
    pub const fn of(factor: f64, powers: &'static [(Measure, i32)]) -> Self {
        Self { factor, powers }
    }
    /// In the parameter's unit, given the sizes of a plant at hand.
    pub fn value(&self, size: impl Fn(Measure) -> f64) -> f64 {
        self.powers.iter().fold(self.factor, |product, (m, n)| product * size(*m).powi(*n))
    }
}

/// Where an estimator looks for a parameter.
#[derive(Clone, Copy, Debug)]
pub struct SearchRange {
    /// Values to begin from, as multiples of the parameter's size; empty: those that are usual in its role.
    pub looks: &'static [f64],
    /// Largest value that it tries, if less than `max`.
    pub most: f64,
    /// Standard deviation of the logarithm of a shape around its size.
    pub doubt: f64,
}

impl SearchRange {
    /// As is usual in a parameter's role.
    pub const USUAL: Self = Self { looks: &[], most: f64::INFINITY, doubt: 1.0 };
    /// From these multiples of its size.
    pub const fn from(looks: &'static [f64]) -> Self {
        Self { looks, ..Self::USUAL }
    }
}

/// Orders of a shaft that an estimator tries: one period in fifty turns, four hundred in one (cogging of a direct drive).
pub const SEARCHED_ORDERS: [f64; 2] = [0.02, 400.0];

/// A parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterSpec {
    /// FMU variable (behind the place's prefix, where the effect has places).
    pub name: &'static str,
    /// Unit; where it begins with `*` it follows the unit of the channel (`*/s` of a reading in rad: rad/s).
    pub unit: &'static str,
    /// With symbol.
    pub description: &'static str,
    /// Smallest value.
    pub min: f64,
    /// `min` itself is not allowed.
    pub above_min: bool,
    /// Largest value.
    pub max: f64,
    /// How far below 0 an estimator may take it, if less far than `min`: beyond, the model is not meant.
    pub below: Option<EffectScale>,
    /// Start value when packed into a [`PlantKind::Joint`] (DELIAN joint 1): visible, not neutral.
    pub joint_start: f64,
    /// Start value when packed into a [`PlantKind::Arm`] (CBK PAN test-bed).
    pub arm_start: f64,
    /// What kind of number it is.
    pub role: ParameterRole,
    /// Value of an amplitude at which the effect vanishes exactly.
    pub neutral: f64,
    /// Its size.
    pub scale: EffectScale,
    /// Estimated best by its logarithm.
    pub log: bool,
    /// It counts periods per turn of a shaft: looked for within [`SEARCHED_ORDERS`].
    pub order: bool,
    /// Where it is looked for.
    pub search: SearchRange,
    /// Where it is looked for on a [`PlantKind::Arm`], if elsewhere.
    pub arm_search: Option<SearchRange>,
}

impl ParameterSpec {
    /// What an amplitude is filled up with: no bounds, neutral at 0.
    pub const NONE: Self = Self {
        name: "",
        unit: "1",
        description: "",
        min: f64::NEG_INFINITY,
        above_min: false,
        max: f64::INFINITY,
        below: None,
        joint_start: 0.0,
        arm_start: 0.0,
        role: ParameterRole::Amplitude,
        neutral: 0.0,
        scale: EffectScale::plain(1.0),
        log: false,
        order: false,
        search: SearchRange::USUAL,
        arm_search: None,
    };
    /// What a shape is filled up with: positive, by its logarithm.
    pub const SHAPE: Self =
        Self { min: 0.0, above_min: true, role: ParameterRole::Shape, log: true, ..Self::NONE };

    /// Where it is looked for in that plant.
    pub fn search_in(&self, plant: PlantKind) -> SearchRange {
        self.arm_search.filter(|_| plant == PlantKind::Arm).unwrap_or(self.search)
    }
}

/// A parameter that the plant has by itself (on the arm: with its motor friction) and without which the effect is
/// not there.
#[derive(Clone, Copy, Debug)]
pub struct Borrowed {
    /// Its name on TwoMassJoint.
    pub joint_name: &'static str,
    /// Its name on PlanarManipulator.
    pub arm_name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Where it makes the effect vanish.
    pub neutral: Neutral,
    /// Its size.
    pub scale: EffectScale,
    /// A plant without the effect has it too: a value that the plant gives it needs no estimate.
    pub known: bool,
}

/// Where a borrowed parameter makes an effect vanish.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Neutral {
    /// At this value.
    Value(f64),
    /// At the value of that other parameter.
    Of(&'static str),
    /// At no value: the structure decides (a rigid joint).
    Structure,
}

/// An input, a state or an output of an effect.
#[derive(Clone, Copy, Debug)]
pub struct SignalSpec {
    /// FMU variable (of a state: without the prefix `state.`; behind the place's prefix).
    pub name: &'static str,
    /// Unit, as that of a parameter.
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
    /// Its name in that plant, without the place's prefix.
    pub fn name_in(&self, plant: PlantKind) -> &'static str {
        if plant != PlantKind::Joint && !self.arm_name.is_empty() { self.arm_name } else { self.name }
    }
}

/// One of the places in which an effect can act, where it has several: `id:name`.
#[derive(Clone, Copy, Debug)]
pub struct EffectPlace {
    /// Behind the colon of the id.
    pub name: &'static str,
    /// Begin of the names of parameters and states there.
    pub prefix: &'static str,
    /// Where it acts.
    pub component: &'static str,
    /// The plants that have this place.
    pub plants: &'static [PlantKind],
    /// How often it occurs there.
    pub scope: Scope,
    /// Unit of the channel, for a sensor.
    pub unit: &'static str,
    /// Parameters there; empty: those of the specification.
    pub parameters: &'static [ParameterSpec],
}

/// What an effect declares of itself.
#[derive(Clone, Copy, Debug)]
pub struct Spec {
    /// The id that users see.
    pub id: &'static str,
    /// Where it acts: actuator, motor-friction, transmission, load, base, sensor; where it has places: that of the
    /// first.
    pub component: &'static str,
    /// One line.
    pub summary: &'static str,
    /// Its name in a sentence, without a full stop: follows "the model lacks".
    pub noun: &'static str,
    /// How it is looked for on the rig, a sentence or two to the person at the rig.
    pub check: &'static str,
    /// Once per joint, or once.
    pub scope: Scope,
    /// The plants that it can act in.
    pub plants: &'static [PlantKind],
    /// The places in which it can act, the first of a plant being meant where none is named; none: one way only.
    pub places: &'static [EffectPlace],
    /// Parameters of its own.
    pub parameters: &'static [ParameterSpec],
    /// The same in [`PlantKind::Space`]; empty: those.
    pub space_parameters: &'static [ParameterSpec],
    /// Why it does not act in [`PlantKind::Space`], and what does instead: follows a colon. Empty: it acts there.
    pub not_in_space: &'static str,
    /// Parameters of the plant that belong to it.
    pub borrows: &'static [Borrowed],
    /// Inputs of its own.
    pub inputs: &'static [SignalSpec],
    /// States of its own.
    pub states: &'static [SignalSpec],
    /// Outputs of its own.
    pub outputs: &'static [SignalSpec],
    /// Its outputs are an angle at the joint and the velocity of that, in this order.
    pub shows_motion: bool,
    /// Modes of its own (per site).
    pub modes: usize,
    /// Event indicators of its own (per site).
    pub indicators: usize,
    /// It needs the motor friction of S3 eq. 3, 4, which the joint has and the arm gets with the effect.
    pub friction: bool,
    /// Its friction grows with the torque that the transmission carries.
    pub under_load: bool,
    /// It acts in the compliant element: on a rigid joint it does nothing.
    pub compliant: bool,
    /// It takes energy out or stores it, and never makes any.
    pub passive: bool,
    /// It pulls at all bodies, as gravity does.
    pub field: bool,
    /// An arm has it on a fixed base alone: it holds on to the ground, and one that floats would fall.
    pub fixed_base: bool,
    /// It only makes a signal late: a recorded signal can be moved in time instead.
    pub shifts: bool,
    /// How many times it comes and goes, at most; 0: it acts all along.
    pub pulses: usize,
    /// Its parameters are those of a small inertia on a spring: inertia, stiffness, damping.
    pub resonator: bool,
    /// With it a joint stays affine in states and inputs between its events.
    pub affine: bool,
    /// Its states follow others at a rate of their own, however fast: Dahl's bristles.
    pub bristles: bool,
    /// A part that the user declares: it is not searched in recordings.
    pub installed: bool,
    /// It commands the motor by itself, from a reference that is the first of its inputs.
    pub servo: bool,
    /// It acts on the command of the motor: where no recording has one it shows nowhere.
    pub on_command: bool,
    /// The effect that an arm has along with it when it is looked for in recordings, in full: what no recording shows by
    /// itself alone.
    pub along: Option<&'static str>,
}

impl Spec {
    /// What a specification is filled up with.
    pub const NONE: Self = Self {
        id: "",
        component: "",
        summary: "",
        noun: "",
        check: "",
        scope: Scope::Joint,
        plants: &[],
        places: &[],
        parameters: &[],
        space_parameters: &[],
        not_in_space: "",
        borrows: &[],
        inputs: &[],
        states: &[],
        outputs: &[],
        shows_motion: false,
        modes: 0,
        indicators: 0,
        friction: false,
        under_load: false,
        compliant: false,
        passive: false,
        field: false,
        fixed_base: false,
        shifts: false,
        pulses: 0,
        resonator: false,
        affine: false,
        bristles: false,
        installed: false,
        servo: false,
        on_command: false,
        along: None,
    };
    /// A plant can have it; of an arm it matters whether its base is fixed.
    pub fn acts_in(&self, plant: PlantKind, fixed_base: bool) -> bool {
        self.plants.contains(&plant) && (plant == PlantKind::Joint || fixed_base || !self.fixed_base)
    }
    /// It makes a rigid joint flexible: what it borrows is of another structure.
    pub fn loosens(&self) -> bool {
        self.borrows.iter().any(|b| b.neutral == Neutral::Structure)
    }
    /// The places that a plant has.
    pub fn places_in(&self, plant: PlantKind) -> impl Iterator<Item = &'static EffectPlace> {
        self.places.iter().filter(move |p| p.plants.contains(&plant))
    }
}
