//! Effects that a case declares, as forces along the trajectory of a joint: what the model with them accelerates more than the one
//! without, times the inertia of each coordinate.
//!
//! ```text
//! f_c = J_c (x_c''(with) - x_c''(without))      at the means of each step, friction of the sign that it has there
//! z'  = g(x, u, z)                              states of the effects, along the same means
//! ```

use std::sync::Arc;

use trueup_models::effect::{EffectSet, ParameterRole, PlacedEffect, SignalSpec};
use trueup_models::joint::{input, parameter as joint};
use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, ModelSizes};
use trueup_plant::{LANES, Lanes, Plant};
use trueup_signals::Case;

/// Least relative standard deviation of what is assumed known, as of a plant's parameters.
pub(super) const KNOWN: f64 = 0.01;
/// Unit of an offset or an angle, in its standard deviations: steps of its number stay small.
pub(super) const UNIT: f64 = 10.0;

/// A number of a known effect that is refitted, 1 where the case is right.
#[derive(Clone, Debug, PartialEq)]
pub struct KnownNumber {
    /// FMU variable.
    pub name: String,
    /// Its value in the case.
    pub assumed: f64,
    /// By how much the value is larger where the number is 2; 0: the number is a factor of it.
    pub unit: f64,
    /// Prior standard deviation of the number.
    pub deviation: f64,
    /// Index among the model's parameters.
    parameter: usize,
}

impl KnownNumber {
    /// The value that a number gives.
    pub fn value(&self, number: f64) -> f64 {
        if self.unit == 0.0 { self.assumed * number } else { self.assumed + (number - 1.0) * self.unit }
    }
    fn slope(&self) -> f64 {
        if self.unit == 0.0 { self.assumed } else { self.unit }
    }
}

/// An input of the model that an effect has in addition to those of the joint.
#[derive(Clone, Debug, PartialEq, Eq)]
struct OwnInput {
    name: &'static str,
    /// Index among the model's inputs.
    at: usize,
    /// It is what drives: a servo's reference.
    drives: bool,
}

/// Effects that a case declares.
#[derive(Clone, Debug)]
pub struct KnownEffects {
    /// The model with and without them, of a joint with a spring, and the same of a rigid one.
    models: Arc<[[Arc<dyn Plant>; 2]; 2]>,
    /// Parameters of the model with them.
    nominal: Arc<[f64]>,
    /// What is refitted.
    pub numbers: Arc<[KnownNumber]>,
    /// Inputs that they have, in the order in which they follow those of the joint.
    inputs: Arc<[OwnInput]>,
    /// Those that act in the actuator, where one of them is a servo, with the index of each of their numbers among all.
    drive: Option<Arc<(Self, Vec<usize>)>>,
    /// Dry friction has a sign.
    dry: bool,
}

/// A known effect that is no force along a trajectory: its id, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnfitEffect(pub String, pub &'static str);

/// The point at which known effects are evaluated.
#[derive(Clone, Copy, Debug)]
pub struct KnownPoint<'a> {
    /// Time since the first sample, s.
    pub time: f64,
    /// Parameters of the model in hand, those of [`KnownEffects::parameters`].
    pub parameters: &'a [f64],
    /// Mean states of the joint over the step.
    pub state: &'a [f64],
    /// States of the effects; empty: all 0.
    pub inner: &'a [f64],
    /// Mean current, torque on the load, and inputs that effects have.
    pub input: &'a [f64],
    /// Mean sign of the motor's dry friction.
    pub sign: f64,
    /// The joint has no spring.
    pub rigid: bool,
}

/// A direction in which known effects are differentiated.
#[derive(Clone, Debug, Default)]
pub struct KnownDirection {
    /// A number, with its change.
    pub number: Option<(usize, f64)>,
    /// An input, in the order of [`KnownPoint::input`], with its change.
    pub input: Option<(usize, f64)>,
    /// A state of the joint, with its change.
    pub state: Option<(usize, f64)>,
    /// Changes of the states of the effects; empty: none.
    pub inner: Vec<f64>,
}

/// What known effects do at a point, or its derivative.
#[derive(Clone, Debug, Default)]
pub struct KnownMotion {
    /// Forces on motor and load, N.m on the motor's side; a rigid joint has all of them on its load.
    pub forces: [f64; 2],
    /// Rates of the states of the effects.
    pub inner: Vec<f64>,
}

impl KnownMotion {
    fn add(&mut self, share: f64, forces: [f64; 2], inner: impl Iterator<Item = f64>) {
        self.forces.iter_mut().zip(forces).for_each(|(s, f)| *s += share * f);
        self.inner.iter_mut().zip(inner).for_each(|(s, x)| *s += share * x);
    }
}

/// Values of the model's variables in one direction of sliding.
struct SlidingPoint<'a> {
    share: f64,
    x: &'a [f64],
    u: &'a [f64],
    modes: &'a [i32],
}

impl KnownEffects {
    /// Of a case whose model is the joint; `None`: it declares none. `dry`: it has dry friction in some recording.
    ///
    /// # Errors
    /// The first that is no force along a trajectory.
    pub fn of(case: &Case, dry: bool) -> Result<Option<Self>, UnfitEffect> {
        let ids: Vec<String> = case.known_effects().into_iter().map(str::to_owned).collect();
        if ids.is_empty() {
            return Ok(None);
        }
        let mut all = Self::made(case, &ids, dry)?;
        let effects = plants::effects(&*all.models[0][0]);
        if effects.servo().is_some() {
            let in_actuator =
                |e: &&PlacedEffect| e.choice.component() == "actuator" && e.choice.place().is_none();
            let drive: Vec<String> = effects.iter().filter(in_actuator).map(|e| e.choice.id()).collect();
            let drive = Self::made(case, &drive, dry)?;
            let place = |n: &KnownNumber| all.numbers.iter().position(|o| o.name == n.name);
            let places = drive.numbers.iter().filter_map(place).collect();
            all.drive = Some(Arc::new((drive, places)));
        }
        Ok(Some(all))
    }

    fn made(case: &Case, ids: &[String], dry: bool) -> Result<Self, UnfitEffect> {
        let first = ids.first().cloned().unwrap_or_default();
        let build = |flexible: bool, effects: &[String]| -> Result<Arc<dyn Plant>, StructureError> {
            plants::build(&PlantStructure {
                model: case.model.clone(),
                flexible: vec![flexible],
                effects: effects.to_vec(),
                ..PlantStructure::default()
            })
        };
        let pair = |flexible| Ok([build(flexible, ids)?, build(flexible, &[])?]);
        let models = (|| Ok::<_, StructureError>([pair(true)?, pair(false)?]))();
        let models = models.map_err(|_| UnfitEffect(first, "the model of a joint cannot have it"))?;
        let value = |name: &str| case.number(name);
        let with = &*models[0][0];
        let effects = plants::effects(with);
        for e in effects.iter() {
            if let Some(why) = no_force(e) {
                return Err(UnfitEffect(e.choice.id(), why));
            }
        }
        let table = &with.table().parameters;
        let nominal: Vec<f64> =
            table.iter().map(|q| value(&q.name).unwrap_or_else(|| q.neutral.unwrap_or(q.start))).collect();
        let numbers = (joint::COUNT..table.len())
            .filter_map(|k| number(effects, k, &table[k].name, nominal[k], case.doubt(&table[k].name)));
        let numbers = numbers.collect();
        let inputs = effects.iter().flat_map(|e| {
            let of = |(k, s): (usize, &SignalSpec)| OwnInput {
                name: s.name,
                at: e.begin.inputs + k,
                drives: e.spec().servo,
            };
            e.spec().inputs.iter().enumerate().map(of)
        });
        let inputs = inputs.collect();
        Ok(Self { models: Arc::new(models), nominal: nominal.into(), numbers, inputs, drive: None, dry })
    }

    /// Whether an effect is among them.
    pub fn has(&self, id: &str) -> bool {
        plants::effects(&*self.models[0][0]).iter().any(|e| e.spec().id == id)
    }
    /// Whether their force depends on the states as much as that of a spring does: a servo's loop, what is in the transmission.
    pub fn hold(&self) -> bool {
        let effects = plants::effects(&*self.models[0][0]);
        effects.servo().is_some() || effects.iter().any(|e| e.choice.component() == "transmission")
    }
    /// Inputs that they have in addition to those of the joint, each with whether it is what drives.
    pub fn inputs(&self) -> impl Iterator<Item = (&'static str, bool)> {
        self.inputs.iter().map(|i| (i.name, i.drives))
    }
    /// Those in the actuator with the numbers in hand, where one of them is a servo: what drives is their force.
    pub fn drive(&self, numbers: &[f64]) -> Option<(&Self, Vec<f64>)> {
        let (drive, places) = self.drive.as_deref()?;
        Some((drive, places.iter().map(|k| numbers[*k]).collect()))
    }
    /// Index of a parameter among the model's.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.models[0][0].table().parameter(name).filter(|k| *k >= joint::COUNT)
    }
    /// Index of a number's parameter among the model's.
    pub fn parameter_of(&self, number: usize) -> usize {
        self.numbers[number].parameter
    }

    fn base(&self, rigid: bool) -> ModelSizes {
        self.models[usize::from(rigid)][1].sizes()
    }
    /// States of the effects when a recording begins, without a drive.
    pub fn start(&self, at: &KnownPoint<'_>) -> Vec<f64> {
        let with = &self.models[usize::from(at.rigid)][0];
        let mut x = vec![0.0; with.sizes().states];
        with.start(at.parameters, &mut x);
        x.split_off(self.base(at.rigid).states)
    }
    /// States of a servo, which forget nothing: force of each per unit at these numbers, with its index among those of the effects.
    pub fn kept_states(&self, at: &KnownPoint<'_>) -> Vec<(usize, f64)> {
        let plant = &*self.models[usize::from(at.rigid)][0];
        let Some(servo) = plants::effects(plant).servo() else { return Vec::new() };
        let (first, all) = (self.base(at.rigid).states, plant.sizes().states);
        let states = servo.begin.states..servo.begin.states + servo.spec().states.len();
        let unit = |k: usize| {
            let inner = (first..all).map(|j| f64::from(u8::from(j == k))).collect();
            let (_, slopes) = self.motion(at, &[KnownDirection { inner, ..KnownDirection::default() }]);
            slopes.first().map(|s| (k - first, s.forces[0] + s.forces[1]))
        };
        states.filter_map(unit).filter(|(_, force)| *force != 0.0).collect()
    }

    /// Whether their forces depend on states of their own: those of a servo without an integral do not.
    pub fn have_memory(&self, at: &KnownPoint<'_>) -> bool {
        let effects = plants::effects(&*self.models[usize::from(at.rigid)][0]);
        let others = effects.iter().any(|e| !e.spec().servo && !e.spec().states.is_empty());
        others || !self.kept_states(at).is_empty()
    }

    /// Forces and rates at a point, and their derivatives.
    pub fn motion(
        &self,
        at: &KnownPoint<'_>,
        directions: &[KnownDirection],
    ) -> (KnownMotion, Vec<KnownMotion>) {
        let p = at.parameters;
        let [with, bare] = &self.models[usize::from(at.rigid)];
        let base = bare.sizes();
        let inner = with.sizes().states - base.states;
        let nothing = || KnownMotion { inner: vec![0.0; inner], ..KnownMotion::default() };
        let (mut sum, mut slopes) = (nothing(), vec![nothing(); directions.len()]);
        self.each_direction(at, |s: &SlidingPoint<'_>| {
            let (mut a, mut b) = (vec![0.0; s.x.len()], vec![0.0; base.states]);
            with.rates(At { t: at.time, x: s.x, u: s.u, p, modes: s.modes }, &[], &mut a);
            let (x, u) = (&s.x[..base.states], &s.u[..base.inputs]);
            bare.rates(At { t: at.time, x, u, p: &p[..joint::COUNT], modes: &s.modes[..1] }, &[], &mut b);
            let forces = on_coordinates(p, at.rigid, |k| a[k] - b[k]);
            sum.add(s.share, forces, a[base.states..].iter().copied());
            for (directions, slopes) in directions.chunks(LANES).zip(slopes.chunks_mut(LANES)) {
                self.add_slopes(at, s, directions, slopes);
            }
        });
        (sum, slopes)
    }

    /// Adds derivatives in up to [`LANES`] directions.
    fn add_slopes(
        &self,
        at: &KnownPoint<'_>,
        s: &SlidingPoint<'_>,
        directions: &[KnownDirection],
        slopes: &mut [KnownMotion],
    ) {
        let [with, bare] = &self.models[usize::from(at.rigid)];
        let (base, p) = (bare.sizes(), at.parameters);
        let constant = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
        let (mut x, mut u, mut lanes) = (constant(s.x), constant(s.u), constant(p));
        let mut of_bare = false;
        for (k, d) in directions.iter().enumerate() {
            if let Some((number, by)) = d.number {
                let n = &self.numbers[number];
                lanes[n.parameter].eps[k] = n.slope() * by;
            }
            if let Some((input, by)) = d.input
                && let Some(i) = self.input(input)
            {
                u[i].eps[k] = by;
                of_bare |= i < base.inputs;
            }
            if let Some((state, by)) = d.state {
                let own = model_state(state, p[joint::GEAR_RATIO]);
                own.iter().filter(|(i, _)| *i < base.states).for_each(|(i, slope)| x[*i].eps[k] = slope * by);
                of_bare = true;
            }
            x[base.states..].iter_mut().zip(&d.inner).for_each(|(x, by)| x.eps[k] = *by);
        }
        let t = Lanes::constant(at.time);
        let mut a = vec![Lanes::constant(0.0); x.len()];
        with.rates_lanes(At { t, x: &x, u: &u, p: &lanes, modes: s.modes }, &[], &mut a);
        let mut b = vec![Lanes::constant(0.0); base.states];
        if of_bare {
            let (x, u, p) = (&x[..base.states], &u[..base.inputs], &lanes[..joint::COUNT]);
            bare.rates_lanes(At { t, x, u, p, modes: &s.modes[..1] }, &[], &mut b);
        }
        for (k, sum) in slopes.iter_mut().enumerate() {
            let forces = on_coordinates(p, at.rigid, |i| a[i].eps[k] - b[i].eps[k]);
            sum.add(s.share, forces, a[base.states..].iter().map(|x| x.eps[k]));
        }
    }

    /// The model without any.
    pub(super) fn none(case: &Case, dry: bool) -> Option<Self> {
        Self::made(case, &[], dry).ok()
    }
    /// Index of an output of the model.
    pub(super) fn output(&self, name: &str) -> Option<usize> {
        self.models[0][0].table().outputs.iter().position(|q| q.name == name)
    }
    /// Outputs of the model with them.
    pub(super) fn outputs(&self, at: &KnownPoint<'_>) -> Vec<f64> {
        let with = &self.models[usize::from(at.rigid)][0];
        let mut sum = vec![0.0; with.sizes().outputs];
        self.each_direction(at, |s: &SlidingPoint<'_>| {
            let (mut y, share) = (vec![0.0; sum.len()], s.share);
            with.outputs(At { t: at.time, x: s.x, u: s.u, p: at.parameters, modes: s.modes }, &mut y);
            sum.iter_mut().zip(y).for_each(|(s, y)| *s += share * y);
        });
        sum
    }

    /// Index of an input of the plant among the model's.
    fn input(&self, input: usize) -> Option<usize> {
        let own = || self.inputs.get(input - MODEL_INPUTS.len()).map(|i| i.at);
        MODEL_INPUTS.get(input).copied().or_else(own)
    }

    /// Parameters of the model with these numbers; `own`: values that are others, by index.
    pub fn parameters(&self, numbers: &[f64], own: &[(usize, f64)]) -> Vec<f64> {
        let mut p = self.nominal.to_vec();
        for (n, x) in self.numbers.iter().zip(numbers) {
            p[n.parameter] = n.value(*x);
        }
        own.iter().for_each(|(k, value)| p[*k] = *value);
        p
    }

    /// In each direction that the motor slides in during a step, with the share of the step; at rest both count alike.
    fn each_direction(&self, at: &KnownPoint<'_>, mut f: impl FnMut(&SlidingPoint<'_>)) {
        let plant = &*self.models[usize::from(at.rigid)][0];
        let (sizes, p) = (plant.sizes(), at.parameters);
        let (s, n) = (at.state, p[joint::GEAR_RATIO]);
        let mut x = vec![s[0], s[1], s[0] - s[2], s[3] / n];
        x.truncate(self.base(at.rigid).states);
        x.extend(at.inner);
        x.resize(sizes.states, 0.0);
        let mut u = vec![0.0; sizes.inputs];
        for (k, value) in at.input.iter().enumerate() {
            if let Some(i) = self.input(k) {
                u[i] = *value;
            }
        }
        let mut modes = vec![0; sizes.modes];
        if modes.len() > 1 {
            let before = modes.clone();
            plant.start_modes(At { t: at.time, x: &x, u: &u, p, modes: &before }, &mut modes);
        }
        if !self.dry {
            modes[0] = trueup_models::friction::SMOOTH;
            return f(&SlidingPoint { share: 1.0, x: &x, u: &u, modes: &modes });
        }
        for direction in [1, -1] {
            let share = 0.5 * (1.0 + f64::from(direction) * at.sign);
            if share > 0.0 {
                modes[0] = direction;
                f(&SlidingPoint { share, x: &x, u: &u, modes: &modes });
            }
        }
    }
}

/// Inputs of the joint among the model's, in the order of the plant's.
const MODEL_INPUTS: [usize; 2] = [input::MOTOR_CURRENT, input::EXTERNAL_TORQUE];

/// Slopes of the model's states by a state of the joint.
fn model_state(state: usize, gear_ratio: f64) -> Vec<(usize, f64)> {
    match state {
        0 => vec![(0, 1.0), (2, 1.0)],
        1 => vec![(1, 1.0)],
        2 => vec![(2, -1.0)],
        3 => vec![(3, 1.0 / gear_ratio)],
        _ => Vec::new(),
    }
}

/// Forces on the coordinates from accelerations of the model's states.
fn on_coordinates(p: &[f64], rigid: bool, rate: impl Fn(usize) -> f64) -> [f64; 2] {
    let (motor, load, n) = (p[joint::MOTOR_INERTIA], p[joint::LOAD_INERTIA], p[joint::GEAR_RATIO]);
    if rigid { [0.0, (motor + load / (n * n)) * rate(1)] } else { [motor * rate(1), load / n * rate(3)] }
}

/// Why an effect is no force along a trajectory that a filter with the bare model's tangent can follow.
fn no_force(e: &PlacedEffect) -> Option<&'static str> {
    match e.choice.component() {
        c if c.starts_with("sensor") => Some("it changes readings"),
        "transmission" if !e.spec().states.is_empty() => {
            Some("its state holds the joint as a spring does, which the filter does not know")
        }
        _ if e.spec().resonator => Some("it swings by itself, which the filter does not know"),
        _ => None,
    }
}

/// Whether a parameter of an effect is refitted: a size that is not neutral, or a shape that has a standard deviation.
pub(super) fn is_refitted(effects: &EffectSet, parameter: usize, assumed: f64, doubt: Option<f64>) -> bool {
    let of = effects.iter().filter(|e| e.begin.parameters <= parameter).last();
    let spec = of.and_then(|e| e.choice.parameters().get((parameter - e.begin.parameters) / e.sites));
    spec.is_some_and(|spec| match spec.role {
        ParameterRole::Amplitude => assumed != spec.neutral && assumed != 0.0,
        ParameterRole::Shape => doubt.is_some() && (effects.absolute_doubt(parameter) || assumed != 0.0),
        ParameterRole::Reference | ParameterRole::Initial => false,
    })
}

/// The number that a parameter of an effect is; `None`: it stays.
fn number(
    effects: &EffectSet,
    parameter: usize,
    name: &str,
    assumed: f64,
    doubt: Option<f64>,
) -> Option<KnownNumber> {
    let (turned, fits) = (effects.absolute_doubt(parameter), is_refitted(effects, parameter, assumed, doubt));
    let deviation = doubt.unwrap_or(0.0).max(KNOWN);
    let (unit, deviation) = if turned { (UNIT * deviation, 1.0 / UNIT) } else { (0.0, deviation) };
    fits.then(|| KnownNumber { name: name.to_owned(), assumed, unit, deviation, parameter })
}
