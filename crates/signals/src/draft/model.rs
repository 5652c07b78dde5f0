//! The model of a draft.

use crate::variable::SignalVariable;

/// A parameter of the model as a case gives it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DraftParameter {
    /// Its name, of an array the array's.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The preset's value in TOML.
    pub value: String,
}

/// The model of a draft.
#[derive(Clone, Debug, Default)]
pub struct DraftModel {
    /// Its name.
    pub name: String,
    /// It was not named by the user.
    pub guessed: bool,
    /// Its variables.
    pub known: Vec<SignalVariable>,
    /// Its parameters with the values of the preset.
    pub parameters: Vec<DraftParameter>,
    /// The preset.
    pub preset: String,
    /// Lines of `[parameters]` for its structure, in TOML.
    pub structure: Vec<String>,
}
