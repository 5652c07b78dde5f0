//! The variables of a plant, element by element.

use std::borrow::Cow;

/// What a variable is in its plant, where that decides what is done with it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QuantityRole {
    /// None of these.
    #[default]
    Plain,
    /// A parameter that only declares how a run begins.
    Initial,
    /// A parameter that decides how forces move the plant and is never known exactly: masses, inertias, centres of mass, springs.
    Dynamics,
    /// An output that is the angle of a joint, of its motor or of its load, as an encoder shows it; not an attitude.
    JointAngle,
}

/// A scalar variable, an array's element under its indexed name (`stiffness`, `jointStiffness[1]`).
#[derive(Clone, Debug, PartialEq)]
pub struct PlantQuantity {
    /// FMU variable.
    pub name: String,
    /// Unit; empty: none.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// `min` itself is not allowed.
    pub above_min: bool,
    /// Largest value.
    pub max: f64,
    /// Start value of a parameter or an input; 0 of others.
    pub start: f64,
    /// Neutral value of a parameter: its effect is absent.
    pub neutral: Option<f64>,
    /// A parameter that has to be above 0 for the equations to have a solution: inertias of what moves by itself, gear ratios.
    pub positive: bool,
    /// Its prior standard deviation is in its own unit: it has no size that a share could be of, as angles to turn by.
    pub absolute_deviation: bool,
    /// Names of the items of a choice, counted from 1; empty: a number.
    pub items: &'static [(&'static str, &'static str)],
    /// Meaning.
    pub description: Cow<'static, str>,
    /// The variable of the same list that it is the rate of.
    pub rate_of: Option<usize>,
    /// Its role in the plant.
    pub role: QuantityRole,
}

impl PlantQuantity {
    /// A parameter that only declares how a run begins.
    pub fn is_initial(&self) -> bool {
        self.role == QuantityRole::Initial
    }
    /// An output that is the angle of a joint, of its motor or of its load.
    pub fn is_joint_angle(&self) -> bool {
        self.role == QuantityRole::JointAngle
    }
    /// Velocity `at` of a list: the rate of a position, which is the rate of nothing itself.
    pub fn is_velocity(list: &[Self], at: usize) -> bool {
        let of = list.get(at).and_then(|q| list.get(q.rate_of?));
        of.is_some_and(|of| of.rate_of.is_none())
    }
    /// A variable that may take any value.
    pub fn new(name: impl Into<String>, unit: &'static str) -> Self {
        Self {
            name: name.into(),
            unit,
            min: f64::NEG_INFINITY,
            above_min: false,
            max: f64::INFINITY,
            start: 0.0,
            neutral: None,
            positive: false,
            absolute_deviation: false,
            items: &[],
            description: Cow::Borrowed(""),
            rate_of: None,
            role: QuantityRole::Plain,
        }
    }
    /// The same with this smallest value.
    #[must_use]
    pub fn at_least(self, min: f64) -> Self {
        Self { min, ..self }
    }
}

/// Something that is chosen when a plant is built, and is among the parameters of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct StructureChoice {
    /// Its name.
    pub name: String,
    /// Meaning.
    pub is: ChosenAs,
}

/// What is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChosenAs {
    /// A truth value.
    Flag,
    /// A number that is determined by others.
    Count(usize),
    /// An item by its name.
    Item,
}

/// All variables of a plant, each list in the order of the values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VariableTable {
    /// Parameters.
    pub parameters: Vec<PlantQuantity>,
    /// Inputs.
    pub inputs: Vec<PlantQuantity>,
    /// Outputs.
    pub outputs: Vec<PlantQuantity>,
    /// Continuous states.
    pub states: Vec<PlantQuantity>,
    /// What was chosen when it was built.
    pub choices: Vec<StructureChoice>,
    /// Inputs that drive the motors, one each.
    pub driving: Vec<usize>,
    /// Parameters that are estimated unless chosen otherwise, in this order.
    pub usual: Vec<usize>,
}

impl VariableTable {
    /// Index of a parameter.
    pub fn parameter(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|q| q.name == name)
    }
    /// Index of an input.
    pub fn input(&self, name: &str) -> Option<usize> {
        self.inputs.iter().position(|q| q.name == name)
    }
    /// Declares that variable `rate` of a list is the rate of `of`.
    pub fn rate(list: &mut [PlantQuantity], rate: usize, of: usize) {
        if let Some(q) = list.get_mut(rate) {
            q.rate_of = Some(of);
        }
    }
    /// Declares that these outputs are angles of joints.
    pub fn joint_angles(&mut self, outputs: impl IntoIterator<Item = usize>) {
        for k in outputs {
            if let Some(q) = self.outputs.get_mut(k) {
                q.role = QuantityRole::JointAngle;
            }
        }
    }
    /// Index of an output.
    pub fn output(&self, name: &str) -> Option<usize> {
        self.outputs.iter().position(|q| q.name == name)
    }
}

/// Names of the elements of an array, row by row, indices counted from 1; of a scalar (no dimensions) its own.
pub fn elements(name: &str, dimensions: &[usize]) -> Vec<String> {
    if dimensions.is_empty() {
        return vec![name.to_owned()];
    }
    let one = |mut at: usize| {
        let mut indices: Vec<String> = dimensions
            .iter()
            .rev()
            .map(|n| {
                let i = at % n;
                at /= n;
                (i + 1).to_string()
            })
            .collect();
        indices.reverse();
        format!("{name}[{}]", indices.join(","))
    };
    (0..dimensions.iter().product()).map(one).collect()
}
