//! What the caller knows of a model.

/// What a variable is to the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Role {
    /// Drives the simulation.
    Input,
    /// Is compared with the simulation.
    Output,
    /// Is set before a run.
    Parameter,
}

/// A scalar variable, or one element of an array (`jointTorque[1]`).
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name in the FMU.
    pub name: String,
    /// Its unit as the FMU names it (`N.m/rad`); empty: none.
    pub unit: String,
    /// Input, output or parameter.
    pub role: Role,
    /// Size that is usual, in `unit`.
    pub nominal: Option<f64>,
    /// Least value that makes sense, in `unit`.
    pub min: Option<f64>,
    /// Largest value that makes sense, in `unit`.
    pub max: Option<f64>,
}

impl Variable {
    /// Without nominal, min and max.
    pub fn new(name: &str, unit: &str, role: Role) -> Self {
        Self { name: name.into(), unit: unit.into(), role, nominal: None, min: None, max: None }
    }
}
