//! Models as objects: every kernel compiled here, once per scalar.

use crate::effect::{self, EffectSet, ParameterRole, Scope};
use crate::layout::{AllowedValues, InputStart, LayoutEntry, LayoutState, Parameter, Shows};
use std::any::Any;
use std::borrow::Cow;
use std::fmt::Debug;
use std::ops::Deref;
use std::sync::OnceLock;
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_plant::{
    Coordinate, Lanes, Plant, PlantError, PlantQuantity, QuantityRole, VariableTable, elements,
};

/// What a model declares of itself beyond its equations, so that it is a [`Plant`].
pub trait PlantModel: Hybrid + Debug + Send + Sync + 'static {
    /// Name of the model.
    const NAME: &'static str;
    /// Its variables.
    fn table(&self) -> VariableTable;
    /// Its coordinates.
    fn coordinates(&self) -> Vec<Coordinate>;
    /// Rates of the states with one generalised force per coordinate; empty: none. A coordinate that dry friction holds balances
    /// them.
    fn rates_under<T: Scalar>(&self, at: At<T>, force: &[T], dx: &mut [T]);
    /// The same with these effects instead of its own.
    ///
    /// # Errors
    /// An effect that it cannot have.
    fn with(&self, effects: &[&str]) -> Result<Self, PlantError>
    where
        Self: Sized;
    /// Its effects; none: it has none.
    fn effect_set(&self) -> Option<&EffectSet> {
        None
    }
    /// See [`Plant::affine`].
    fn affine(&self) -> bool {
        false
    }
    /// See [`Plant::followers`].
    fn followers(&self) -> Vec<usize> {
        Vec::new()
    }
    /// See [`Plant::rest`].
    fn rest<T: Scalar>(&self, _p: &mut [T], _u: &[T]) {}
}

/// A model as a [`Plant`]. What it declares of itself is put together at the first request.
#[derive(Clone, Debug)]
pub struct Compiled<M> {
    model: M,
    /// Start values of the first parameters; the others have the model's own.
    start: Vec<f64>,
    table: OnceLock<VariableTable>,
    coordinates: OnceLock<Vec<Coordinate>>,
    followers: OnceLock<Vec<usize>>,
}

impl<M: PlantModel> Compiled<M> {
    /// Of this model.
    pub fn new(model: M) -> Self {
        Self::starting(model, Vec::new())
    }
    /// The same whose first parameters start with these values.
    pub fn starting(model: M, start: Vec<f64>) -> Self {
        let (table, coordinates, followers) = (OnceLock::new(), OnceLock::new(), OnceLock::new());
        Self { model, start, table, coordinates, followers }
    }
    /// The model.
    pub fn inner(&self) -> &M {
        &self.model
    }
}

impl<M> Deref for Compiled<M> {
    type Target = M;
    fn deref(&self) -> &M {
        &self.model
    }
}

impl<M: PlantModel> Plant for Compiled<M> {
    fn model(&self) -> &str {
        M::NAME
    }
    fn table(&self) -> &VariableTable {
        self.table.get_or_init(|| {
            let mut table = self.model.table();
            table.parameters.iter_mut().zip(&self.start).for_each(|(q, start)| q.start = *start);
            table
        })
    }
    fn coordinates(&self) -> &[Coordinate] {
        self.coordinates.get_or_init(|| self.model.coordinates())
    }
    fn sizes(&self) -> ModelSizes {
        self.model.sizes()
    }
    fn affine(&self) -> bool {
        self.model.affine()
    }
    fn followers(&self) -> &[usize] {
        self.followers.get_or_init(|| self.model.followers())
    }
    fn with(&self, effects: &[&str]) -> Result<Box<dyn Plant>, PlantError> {
        Ok(Box::new(Self::starting(self.model.with(effects)?, self.start.clone())))
    }
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn start(&self, p: &[f64], x: &mut [f64]) {
        self.model.start(p, x);
    }
    fn start_lanes(&self, p: &[Lanes], x: &mut [Lanes]) {
        self.model.start(p, x);
    }
    fn rest(&self, p: &mut [f64], u: &[f64]) {
        self.model.rest(p, u);
    }
    fn rest_lanes(&self, p: &mut [Lanes], u: &[Lanes]) {
        self.model.rest(p, u);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.model.start_modes(at, modes);
    }
    fn rates(&self, at: At<f64>, force: &[f64], dx: &mut [f64]) {
        self.model.rates_under(at, force, dx);
    }
    fn rates_lanes(&self, at: At<Lanes>, force: &[Lanes], dx: &mut [Lanes]) {
        self.model.rates_under(at, force, dx);
    }
    fn outputs(&self, at: At<f64>, y: &mut [f64]) {
        self.model.outputs(at, y);
    }
    fn outputs_lanes(&self, at: At<Lanes>, y: &mut [Lanes]) {
        self.model.outputs(at, y);
    }
    fn indicators(&self, at: At<f64>, z: &mut [f64]) {
        self.model.indicators(at, z);
    }
    fn indicators_lanes(&self, at: At<Lanes>, z: &mut [Lanes]) {
        self.model.indicators(at, z);
    }
    fn direction(&self, indicator: usize) -> Direction {
        self.model.direction(indicator)
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.model.update(t, x, u, p, modes)
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        self.model.next_event(p, modes)
    }
}

fn quantities<K>(
    entries: &[LayoutEntry<K>],
    mut more: impl FnMut(&K, PlantQuantity) -> PlantQuantity,
) -> Vec<PlantQuantity> {
    let mut all = Vec::new();
    for e in entries {
        for name in elements(e.name, &e.dimensions) {
            let own =
                PlantQuantity { description: Cow::Borrowed(e.text), ..PlantQuantity::new(name, e.unit) };
            all.push(more(&e.kind, own));
        }
    }
    all
}

/// Parameters of a list, with those start values.
pub fn parameters(entries: &[LayoutEntry<Parameter>], start: &[f64]) -> Vec<PlantQuantity> {
    let mut start = start.iter();
    quantities(entries, |kind, q| {
        let (min, above_min, max) = match kind.allowed {
            AllowedValues::Any => (f64::NEG_INFINITY, false, f64::INFINITY),
            AllowedValues::Positive => (0.0, true, f64::INFINITY),
            AllowedValues::NotNegative => (0.0, false, f64::INFINITY),
            AllowedValues::OneUp => (1.0, false, f64::INFINITY),
            AllowedValues::Item(items) => (1.0, false, items.items.len() as f64),
        };
        let items = if let AllowedValues::Item(items) = kind.allowed { items.items } else { &[] };
        let role = if kind.initial { QuantityRole::Initial } else { QuantityRole::Plain };
        let start = start.next().copied().unwrap_or(0.0);
        PlantQuantity { min, above_min, max, items, start, role, ..q }
    })
}
/// Inputs of a list.
pub fn inputs(entries: &[LayoutEntry<InputStart>]) -> Vec<PlantQuantity> {
    quantities(entries, |_, q| q)
}
/// Outputs of a list.
pub fn outputs(entries: &[LayoutEntry<Shows>]) -> Vec<PlantQuantity> {
    quantities(entries, |_, q| q)
}
/// States of a list.
pub fn states(entries: &[LayoutEntry<LayoutState>]) -> Vec<PlantQuantity> {
    quantities(entries, |_, q| q)
}

/// Declares that parameters which must be above 0 are what the equations divide by.
pub fn positive(table: &mut VariableTable) {
    table.parameters.iter_mut().for_each(|q| q.positive = q.above_min);
}

/// Declares whose rates the rates of these coordinates are, where a state is their position.
pub fn rates_of(coordinates: &[Coordinate], table: &mut VariableTable) {
    for c in coordinates {
        let Some(position) = c.position else { continue };
        VariableTable::rate(&mut table.parameters, c.initial_rate, c.initial_position);
        VariableTable::rate(&mut table.outputs, c.rate_output, c.position_output);
        VariableTable::rate(&mut table.states, c.rate, position);
    }
}

/// Refuses effects of a model that has none.
///
/// # Errors
/// There is one.
pub fn no_effects(model: &str, effects: &[&str]) -> Result<(), PlantError> {
    match effects.first() {
        None => Ok(()),
        Some(id) => Err(PlantError(format!("no effect acts in {model} yet, `{id}` neither; leave it out"))),
    }
}

/// Adds the variables of effects, which follow a plant's own: variable by variable, site by site.
pub fn add_effects(set: &EffectSet, plant: effect::PlantKind, table: &mut VariableTable) {
    for e in set.iter() {
        let (spec, choice, dimensions) = (e.spec(), e.choice, e.dimensions(plant));
        let put = |list: &mut Vec<PlantQuantity>, name: &str, unit, description, more: PlantQuantity| {
            list.extend(elements(name, &dimensions).into_iter().map(|name| PlantQuantity {
                name,
                unit,
                description: Cow::Borrowed(description),
                ..more.clone()
            }));
        };
        let none = PlantQuantity::new("", "");
        for p in choice.parameters() {
            let start = if plant == effect::PlantKind::Joint { p.joint_start } else { p.arm_start };
            let more = PlantQuantity {
                min: p.min,
                above_min: p.above_min,
                max: p.max,
                start,
                neutral: (p.role == ParameterRole::Amplitude).then_some(p.neutral),
                absolute_deviation: p.role == ParameterRole::Shape && p.unit == "rad" && !p.log,
                role: if p.role == ParameterRole::Initial {
                    QuantityRole::Initial
                } else {
                    QuantityRole::Plain
                },
                ..none.clone()
            };
            put(&mut table.parameters, &choice.variable(p.name), choice.unit(p.unit), p.description, more);
        }
        for u in spec.inputs {
            put(&mut table.inputs, u.name_in(plant), u.unit, u.description, none.clone());
        }
        for s in spec.states {
            let name = choice.variable(s.name_in(plant));
            put(&mut table.states, &name, choice.unit(s.unit), s.description, none.clone());
        }
        let begin = table.outputs.len();
        for y in spec.outputs {
            put(&mut table.outputs, y.name_in(plant), y.unit, y.description, none.clone());
        }
        if spec.shows_motion {
            let n = e.sites;
            (begin..begin + n).for_each(|k| VariableTable::rate(&mut table.outputs, k + n, k));
            table.joint_angles(begin..begin + n);
        }
    }
}

/// Indices of the states of effects that follow others ([`Plant::followers`]).
pub fn followers(effects: &EffectSet) -> Vec<usize> {
    let following = effects.iter().filter(|e| e.spec().bristles);
    following.flat_map(|e| (0..e.spec().states.len() * e.sites).map(|k| e.begin.states + k)).collect()
}

impl effect::PlacedEffect {
    /// Lengths of the dimensions of its variables; none: scalars.
    pub fn dimensions(&self, plant: effect::PlantKind) -> Vec<usize> {
        let vector = match self.choice.scope() {
            Scope::Joint => plant != effect::PlantKind::Joint,
            Scope::Channel => self.sites > 1,
            Scope::Once => false,
        };
        if vector { vec![self.sites] } else { Vec::new() }
    }
}
