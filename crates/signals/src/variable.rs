//! What the caller declares of a model.

/// What a variable is to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum VariableRole {
    /// Drives the simulation.
    Input,
    /// Is compared with the simulation.
    Output,
    /// Is set before a run.
    Parameter,
}

/// What a parameter is given as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Takes {
    /// A number.
    #[default]
    Number,
    /// `true` or `false`.
    Boolean,
    /// An item's name, in quotes.
    Item,
    /// A number, a truth value or a name: which of them the caller does not know.
    Anything,
}

/// A scalar variable, or one element of an array (`jointTorque[1]`).
#[derive(Clone, Debug, PartialEq)]
pub struct SignalVariable {
    /// Its name in the FMU.
    pub name: String,
    /// Its unit as the FMU names it (`N.m/rad`); empty: none.
    pub unit: String,
    /// Input, output or parameter.
    pub role: VariableRole,
    /// Size that is usual, in `unit`.
    pub nominal: Option<f64>,
    /// Least value that makes sense, in `unit`.
    pub min: Option<f64>,
    /// Largest value that makes sense, in `unit`.
    pub max: Option<f64>,
    /// How a case gives its value, if it is a parameter.
    pub takes: Takes,
    /// It has to be above 0: an inertia, a ratio.
    pub positive: bool,
    /// An input that moves the plant by itself, a motor's: without a recording of it nothing can be concluded.
    pub drives: bool,
}

impl SignalVariable {
    /// A number without nominal, min and max.
    pub fn new(name: &str, unit: &str, role: VariableRole) -> Self {
        let (nominal, min, max) = (None, None, None);
        let (takes, positive, drives) = (Takes::Number, false, false);
        Self { name: name.into(), unit: unit.into(), role, nominal, min, max, takes, positive, drives }
    }
}

/// The role of the variable of this name.
pub(crate) fn role(known: &[SignalVariable], name: &str) -> Option<VariableRole> {
    known.iter().find(|v| v.name == name).map(|v| v.role)
}
