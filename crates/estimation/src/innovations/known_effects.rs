//! Effects that a case declares, as forces along the trajectory of a joint: what the model with them accelerates more than the one
//! without, times the inertia of each coordinate.
//!
//! ```text
//! f_c = J_c (x_c''(with) - x_c''(without))      at the means of each step, friction of the sign that it has there
//! ```

use std::rc::Rc;
use std::sync::Arc;

use trueup_models::effect::{EffectSet, ParameterRole, PlacedEffect};
use trueup_models::joint::{input, parameter as joint};
use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
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

/// Effects that a case declares.
#[derive(Clone, Debug)]
pub struct KnownEffects {
    /// The model with and without them, of a joint with a spring, and the same of a rigid one.
    models: Rc<[[Arc<dyn Plant>; 2]; 2]>,
    /// Parameters of the model with them.
    nominal: Rc<[f64]>,
    /// What is refitted.
    pub numbers: Rc<[KnownNumber]>,
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
    /// Values of the model's parameters that are others than in the case, by index.
    pub own: &'a [(usize, f64)],
    /// The numbers in hand.
    pub numbers: &'a [f64],
    /// Mean states of the joint over the step.
    pub state: &'a [f64],
    /// Mean current and torque on the load.
    pub input: &'a [f64],
    /// Mean sign of the motor's dry friction.
    pub sign: f64,
    /// The joint has no spring.
    pub rigid: bool,
}

impl KnownEffects {
    /// Of a case whose model is the joint; `None`: it declares none.
    ///
    /// # Errors
    /// The first that is no force along a trajectory.
    pub fn of(case: &Case) -> Result<Option<Self>, UnfitEffect> {
        let ids: Vec<String> = case.known_effects().into_iter().map(str::to_owned).collect();
        let Some(first) = ids.first().cloned() else { return Ok(None) };
        let build = |flexible: bool, effects: &[String]| -> Result<Arc<dyn Plant>, StructureError> {
            plants::build(&PlantStructure {
                model: case.model.clone(),
                flexible: vec![flexible],
                fixed_base: false,
                effects: effects.to_vec(),
                led: Vec::new(),
                payload: None,
            })
        };
        let pair = |flexible| Ok([build(flexible, &ids)?, build(flexible, &[])?]);
        let models = (|| Ok::<_, StructureError>([pair(true)?, pair(false)?]))();
        let models = models.map_err(|_| UnfitEffect(first, "the model of a joint cannot have it"))?;
        let value = |name: &str| case.number(name);
        let dry = ["coulombFriction", "staticFriction"].iter().any(|n| value(n).is_some_and(|v| v > 0.0));
        let with = &*models[0][0];
        let effects = plants::effects(with);
        for e in effects.iter() {
            if let Some(why) = no_force(e, dry) {
                return Err(UnfitEffect(e.choice.id(), why));
            }
        }
        let table = &with.table().parameters;
        let nominal: Vec<f64> =
            table.iter().map(|q| value(&q.name).unwrap_or_else(|| q.neutral.unwrap_or(q.start))).collect();
        let numbers = (joint::COUNT..table.len())
            .filter_map(|k| number(effects, k, &table[k].name, nominal[k], case.doubt(&table[k].name)));
        let numbers = numbers.collect();
        Ok(Some(Self { models: Rc::new(models), nominal: nominal.into(), numbers, dry }))
    }

    /// Whether an effect is among them.
    pub fn has(&self, id: &str) -> bool {
        plants::effects(&*self.models[0][0]).iter().any(|e| e.spec().id == id)
    }

    /// Forces on motor and load, N.m on the motor's side; a rigid joint has all of them on its load.
    pub fn forces(&self, at: &KnownPoint<'_>) -> [f64; 2] {
        let p = self.parameters(at);
        let [with, bare] = &self.models[usize::from(at.rigid)];
        let rates = |plant: &dyn Plant, p: &[f64], x: &[f64], u: &[f64], modes: &[i32]| {
            let mut dx = vec![0.0; x.len()];
            plant.rates(At { t: at.time, x, u, p, modes }, &[], &mut dx);
            dx
        };
        let mut sum = [0.0; 2];
        self.each_direction(at, &p, |share, x, u, modes| {
            let a = rates(&**with, &p, x, u, modes);
            let b = rates(&**bare, &p[..joint::COUNT], x, u, &modes[..1]);
            for (s, f) in sum.iter_mut().zip(on_coordinates(&p, at.rigid, |k| a[k] - b[k])) {
                *s += share * f;
            }
        });
        sum
    }

    /// Derivatives of [`forces`](Self::forces) with respect to each number.
    pub fn slopes(&self, at: &KnownPoint<'_>) -> Vec<[f64; 2]> {
        let p = self.parameters(at);
        let with = &self.models[usize::from(at.rigid)][0];
        let mut all = vec![[0.0; 2]; self.numbers.len()];
        for (numbers, slopes) in self.numbers.chunks(LANES).zip(all.chunks_mut(LANES)) {
            let mut lanes: Vec<Lanes> = p.iter().map(|v| Lanes::constant(*v)).collect();
            for (k, n) in numbers.iter().enumerate() {
                lanes[n.parameter].eps[k] = n.slope();
            }
            self.each_direction(at, &p, |share, x, u, modes| {
                let constant = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
                let (x, u) = (constant(x), constant(u));
                let mut dx = vec![Lanes::constant(0.0); x.len()];
                let t = Lanes::constant(at.time);
                with.rates_lanes(At { t, x: &x, u: &u, p: &lanes, modes }, &[], &mut dx);
                for (k, s) in slopes.iter_mut().enumerate() {
                    let of = on_coordinates(&p, at.rigid, |state| dx[state].eps[k]);
                    s.iter_mut().zip(of).for_each(|(s, f)| *s += share * f);
                }
            });
        }
        all
    }

    /// Parameters of the model in hand.
    fn parameters(&self, at: &KnownPoint<'_>) -> Vec<f64> {
        let mut p = self.nominal.to_vec();
        at.own.iter().for_each(|(k, value)| p[*k] = *value);
        for (n, x) in self.numbers.iter().zip(at.numbers) {
            p[n.parameter] = n.value(*x);
        }
        p
    }

    /// In each direction that the motor slides in during a step, with the share of the step; at rest both count alike.
    fn each_direction(&self, at: &KnownPoint<'_>, p: &[f64], mut f: impl FnMut(f64, &[f64], &[f64], &[i32])) {
        let plant = &*self.models[usize::from(at.rigid)][0];
        let sizes = plant.sizes();
        let (s, n) = (at.state, p[joint::GEAR_RATIO]);
        let mut x = vec![s[0], s[1], s[0] - s[2], s[3] / n];
        x.truncate(sizes.states);
        let mut u = vec![0.0; sizes.inputs];
        u[input::MOTOR_CURRENT] = at.input[0];
        u[input::EXTERNAL_TORQUE] = at.input[1];
        let mut modes = vec![0; sizes.modes];
        if modes.len() > 1 {
            let before = modes.clone();
            plant.start_modes(At { t: at.time, x: &x, u: &u, p, modes: &before }, &mut modes);
        }
        if !self.dry {
            modes[0] = trueup_models::friction::SMOOTH;
            return f(1.0, &x, &u, &modes);
        }
        for direction in [1, -1] {
            let share = 0.5 * (1.0 + f64::from(direction) * at.sign);
            if share > 0.0 {
                modes[0] = direction;
                f(share, &x, &u, &modes);
            }
        }
    }
}

/// Forces on the coordinates from accelerations of the model's states.
fn on_coordinates(p: &[f64], rigid: bool, rate: impl Fn(usize) -> f64) -> [f64; 2] {
    let (motor, load, n) = (p[joint::MOTOR_INERTIA], p[joint::LOAD_INERTIA], p[joint::GEAR_RATIO]);
    if rigid { [0.0, (motor + load / (n * n)) * rate(1)] } else { [motor * rate(1), load / n * rate(3)] }
}

/// Why an effect is no force along a trajectory that a filter with the bare model's tangent can follow.
fn no_force(e: &PlacedEffect, dry: bool) -> Option<&'static str> {
    let component = e.choice.component();
    match component {
        _ if e.spec().servo => Some("its drive is a reference, no current"),
        _ if !e.spec().states.is_empty() => Some("it has states of its own"),
        _ if component.starts_with("sensor") => Some("it changes readings"),
        "transmission" => Some("it changes the spring"),
        "motor-friction" if !dry => Some("the model has no dry friction without it"),
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
