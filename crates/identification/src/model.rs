//! The plants with their variables by name: what recordings, cases and results speak of.

use std::sync::Arc;

use trueup_estimation::case_structure::case_structure;
use trueup_models::arm::{PAYLOAD, PlanarManipulator};
use trueup_models::effect::{self, EffectError, EffectSet};
use trueup_models::joint::TwoMassJoint;
use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_numerics::hybrid::ModelSizes;
use trueup_plant::{ChosenAs, Plant};
use trueup_signals::{Case, ParameterValue, SignalVariable, Takes, VariableRole, base_name, element_name};

pub use trueup_plant::PlantQuantity;

mod known;

/// A model that cannot be had.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// No such plant.
    #[error(
        "identification supports {known}, not `{0}`; name one of them in `model`", known = listed(&plants::NAMES)
    )]
    Unknown(String),
    /// Its structure.
    #[error("{0}")]
    Structure(String),
    /// A parameter.
    #[error("{name}: {what}")]
    Parameter {
        /// Which.
        name: String,
        /// What is wrong, and the remedy.
        what: String,
    },
}

/// `a, b and c`.
fn listed(names: &[&str]) -> String {
    match names {
        [all @ .., last] if !all.is_empty() => format!("{} and {last}", all.join(", ")),
        names => names.concat(),
    }
}

impl From<EffectError> for ModelError {
    fn from(e: EffectError) -> Self {
        Self::Structure(e.to_string())
    }
}

impl From<StructureError> for ModelError {
    fn from(e: StructureError) -> Self {
        match e {
            StructureError::Model(name) => Self::Unknown(name),
            StructureError::Structure(text) => Self::Structure(text),
            StructureError::Parameter { name, what } => Self::Parameter { name, what },
            StructureError::Payload { link, links } => Self::Parameter {
                name: "payload.link".into(),
                what: format!("there is no link {link}; the model has {links}"),
            },
        }
    }
}

/// A plant that can be simulated, with its variables by name, each list in the order of the model's values.
#[derive(Clone, Debug)]
pub struct SimulatedPlant {
    plant: Arc<dyn Plant>,
    structure: PlantStructure,
}

/// Variables by name, each list in the order of the values.
pub trait NamedVariables {
    /// Parameters.
    fn parameters(&self) -> &[PlantQuantity];
    /// Inputs.
    fn inputs(&self) -> &[PlantQuantity];
    /// Outputs.
    fn outputs(&self) -> &[PlantQuantity];
    /// Whether an output is compared with its readings; a flag is shown, not fitted.
    fn compares(&self, output: usize) -> bool {
        !self.outputs()[output].unit.is_empty()
    }
    /// The standard deviation of that parameter is in its own unit: it has no size that a share could be of, as angles to turn by and payloads.
    fn absolute_doubt(&self, _parameter: usize) -> bool {
        false
    }
    /// Variable `at` of one of its lists is a velocity.
    fn is_velocity(&self, list: &[PlantQuantity], at: usize) -> bool {
        PlantQuantity::is_velocity(list, at)
    }
    /// Index of a parameter.
    fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters().iter().position(|q| q.name == name)
    }
    /// Index of an input.
    fn input(&self, name: &str) -> Option<usize> {
        self.inputs().iter().position(|q| q.name == name)
    }
    /// Index of an output.
    fn output(&self, name: &str) -> Option<usize> {
        self.outputs().iter().position(|q| q.name == name)
    }
    /// Parameters that belong to one array, or the one of that name.
    fn named(&self, name: &str) -> Vec<&PlantQuantity> {
        self.parameters().iter().filter(|q| q.name == name || base_name(&q.name) == name).collect()
    }
}

impl NamedVariables for SimulatedPlant {
    fn absolute_doubt(&self, parameter: usize) -> bool {
        self.parameters()[parameter].absolute_deviation
    }
    fn parameters(&self) -> &[PlantQuantity] {
        &self.plant.table().parameters
    }
    fn inputs(&self) -> &[PlantQuantity] {
        &self.plant.table().inputs
    }
    fn outputs(&self) -> &[PlantQuantity] {
        &self.plant.table().outputs
    }
}

/// Where one coordinate of the plant begins: indices of parameters, and of the outputs that show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CoordinateIndices {
    /// Parameter: value at the start.
    pub angle: usize,
    /// Parameter: rate at the start.
    pub velocity: usize,
    /// Output that shows its value.
    pub angle_output: usize,
    /// Output that shows its rate.
    pub velocity_output: usize,
    /// Another coordinate that it stays close to (behind a spring), by index, and whether that one is `gearRatio` times
    /// as large.
    pub follows: Option<(usize, bool)>,
}

impl SimulatedPlant {
    /// A plant of that structure.
    ///
    /// # Errors
    /// An unknown model or effect, a number of joints that it cannot have, joints that cannot be prescribed.
    pub fn new(structure: PlantStructure) -> Result<Self, ModelError> {
        Ok(Self { plant: plants::build(&structure)?, structure })
    }

    /// Any plant, with no structure of joints to choose.
    pub fn of_plant(plant: Arc<dyn Plant>) -> Self {
        let model = plant.model().to_owned();
        let structure = PlantStructure { model, ..PlantStructure::default() };
        Self { plant, structure }
    }

    /// The plant that a case names, with the effects that it declares, and these.
    ///
    /// # Errors
    /// As [`SimulatedPlant::new`]; a `jointFlexible` that is no truth value; a known effect whose size is not given.
    pub fn of_case(case: &Case, effects: &[&str]) -> Result<Self, ModelError> {
        let model = Self::new(case_structure(case, effects)?)?;
        known::check(&model, case)?;
        Ok(model)
    }

    /// The same plant with other effects.
    ///
    /// # Errors
    /// As [`SimulatedPlant::new`].
    pub fn with_effects(&self, effects: &[&str]) -> Result<Self, ModelError> {
        let effects = effects.iter().map(|e| (*e).to_owned()).collect();
        Self::new(PlantStructure { effects, ..self.structure.clone() })
    }
    /// The same arm, the motors of these joints (from 0) prescribed along their measured motion.
    ///
    /// # Errors
    /// As [`SimulatedPlant::new`].
    pub fn with_led(&self, led: &[usize]) -> Result<Self, ModelError> {
        Self::new(PlantStructure { led: led.to_vec(), ..self.structure.clone() })
    }

    /// How it is built.
    pub fn structure(&self) -> &PlantStructure {
        &self.structure
    }
    /// The plant itself.
    pub fn plant(&self) -> &dyn Plant {
        &*self.plant
    }
    /// How many values of each kind.
    pub fn sizes(&self) -> ModelSizes {
        self.plant.sizes()
    }
    /// Its joint, if it is one.
    pub fn joint(&self) -> Option<&TwoMassJoint> {
        plants::joint(&*self.plant)
    }
    /// Its arm, if it is one.
    pub fn arm(&self) -> Option<&PlanarManipulator> {
        plants::arm(&*self.plant)
    }
    /// Parameters in the order of their values.
    pub fn parameters(&self) -> &[PlantQuantity] {
        &self.plant.table().parameters
    }
    /// Inputs in their order.
    pub fn inputs(&self) -> &[PlantQuantity] {
        &self.plant.table().inputs
    }
    /// Outputs in their order.
    pub fn outputs(&self) -> &[PlantQuantity] {
        &self.plant.table().outputs
    }
    /// Index of a parameter.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.plant.table().parameter(name)
    }
    /// Index of an input.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.plant.table().input(name)
    }
    /// Index of an output.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.plant.table().output(name)
    }

    /// The variables as the reader of recordings and cases requires them.
    pub fn variables(&self) -> Vec<SignalVariable> {
        let table = self.plant.table();
        let list = |all: &[PlantQuantity], role| {
            let made = all.iter().enumerate().map(|(i, q)| SignalVariable {
                min: q.min.is_finite().then_some(q.min),
                max: q.max.is_finite().then_some(q.max),
                takes: if q.items.is_empty() { Takes::Number } else { Takes::Item },
                positive: role == VariableRole::Parameter && q.positive,
                drives: role == VariableRole::Input && table.driving.contains(&i),
                ..SignalVariable::new(&q.name, q.unit, role)
            });
            made.collect::<Vec<_>>()
        };
        let mut all = list(&table.parameters, VariableRole::Parameter);
        all.extend(list(&table.inputs, VariableRole::Input));
        all.extend(list(&table.outputs, VariableRole::Output));
        // Structural choices are among the parameters of a case.
        all.extend(table.choices.iter().map(|choice| {
            let plain = SignalVariable::new(&choice.name, "", VariableRole::Parameter);
            match choice.is {
                ChosenAs::Flag => SignalVariable { takes: Takes::Boolean, ..plain },
                ChosenAs::Count(n) => SignalVariable { min: Some(n as f64), max: Some(n as f64), ..plain },
                ChosenAs::Item => SignalVariable { takes: Takes::Item, ..plain },
            }
        }));
        all
    }

    /// Start values of all parameters: those of the preset; sizes of effects as if they were not there, shapes as they are
    /// packed.
    pub fn defaults(&self) -> Vec<f64> {
        self.parameters().iter().map(|q| q.neutral.unwrap_or(q.start)).collect()
    }
    /// Its effects.
    pub fn effects(&self) -> &EffectSet {
        plants::effects(&*self.plant)
    }
    /// Which tables of effects hold for it.
    pub fn effect_plant(&self) -> effect::PlantKind {
        plants::effect_plant(&*self.plant)
    }

    /// All parameters by name from another list (a case's, a recording's), the rest from `base`.
    ///
    /// # Errors
    /// A value that is no number, or none that the parameter can have.
    pub fn set<'a>(
        &self,
        base: &[f64],
        given: impl IntoIterator<Item = (&'a String, &'a ParameterValue)>,
    ) -> Result<Vec<f64>, ModelError> {
        let mut p = base.to_vec();
        let mut angles = Vec::new();
        for (name, value) in given {
            let Some(i) = self.parameter(name) else { continue };
            let wrong = |what: String| ModelError::Parameter { name: name.clone(), what };
            let q = &self.parameters()[i];
            p[i] = match value {
                ParameterValue::Text(item) if !q.items.is_empty() => {
                    let at = q.items.iter().position(|known| known.0 == item);
                    let names = || q.items.iter().map(|known| known.0).collect::<Vec<_>>().join(", ");
                    let at = at
                        .ok_or_else(|| wrong(format!("`{item}` is none of {}; name one of them", names())))?;
                    at as f64 + 1.0
                }
                _ => value.number().filter(|v| v.is_finite()).ok_or_else(|| {
                    wrong(format!("{value} is no number; write its value in the FMU's unit, without quotes"))
                })?,
            };
            if p[i] <= 0.0 && q.positive {
                let mend = "give that of the real system, or remove the line to take the preset's";
                return Err(wrong(format!("it is {} and has to be above 0; {mend}", p[i])));
            }
            if p[i] < q.min || p[i] > q.max {
                return Err(wrong(format!(
                    "{} is outside {} .. {}; give a value within",
                    p[i], q.min, q.max
                )));
            }
            angles.push(i);
        }
        // What a link carries is at its end, unless it is declared elsewhere.
        if let (Some(at), Some(link)) = (self.parameter(PAYLOAD[1].name), self.structure.payload)
            && !angles.contains(&at)
            && angles.iter().any(|i| self.parameters()[*i].name == PAYLOAD[0].name)
        {
            let length = self.parameter(&element_name("linkLength", &[link + 1]));
            p[at] = length.map_or(p[at], |i| p[i]);
        }
        // Motors that are not set stay with their joints, springs unstrained.
        for c in self.coordinates() {
            if let (Some((other, geared)), true) = (c.follows, self.joint().is_none()) {
                let o = self.coordinates()[other];
                for (own, of) in [(c.angle, o.angle), (c.velocity, o.velocity)] {
                    if !geared && !angles.contains(&own) {
                        p[own] = p[of];
                    }
                }
            }
        }
        Ok(p)
    }

    /// Parameters of this plant from those of another one by name; what that one lacks from `defaults`.
    pub fn carry(&self, other: &SimulatedPlant, values: &[f64]) -> Vec<f64> {
        let mut p = self.defaults();
        for (q, v) in other.parameters().iter().zip(values) {
            if let Some(i) = self.parameter(&q.name) {
                p[i] = *v;
            }
        }
        p
    }

    /// What `identify` estimates unless the case chooses otherwise.
    pub fn usual(&self) -> Vec<String> {
        self.plant.table().usual.iter().map(|i| self.parameters()[*i].name.clone()).collect()
    }

    /// Its coordinates, each with where it begins and what shows it; those of a base that is fixed do not move.
    pub fn coordinates(&self) -> Vec<CoordinateIndices> {
        let begin = |c: &trueup_plant::Coordinate| CoordinateIndices {
            angle: c.initial_position,
            velocity: c.initial_rate,
            angle_output: c.position_output,
            velocity_output: c.rate_output,
            follows: c.follows.map(|f| (f.coordinate, f.ratio.is_some())),
        };
        self.plant.coordinates().iter().map(begin).collect()
    }

    /// Names that belong to one array, or the one name itself.
    pub fn elements<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a PlantQuantity> {
        self.parameters().iter().filter(move |q| q.name == name || base_name(&q.name) == name)
    }
}
