//! What a file gives a parameter.

use std::fmt;

/// A parameter's value.
#[derive(Clone, Debug, PartialEq)]
pub enum ParameterValue {
    /// A number, in the variable's unit.
    Number(f64),
    /// A structural choice such as `jointFlexible`.
    Boolean(bool),
    /// An enumeration's item.
    Text(String),
}

impl ParameterValue {
    /// The number; a Boolean is 0 or 1.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Number(x) => Some(*x),
            Self::Boolean(b) => Some(f64::from(u8::from(*b))),
            Self::Text(_) => None,
        }
    }

    /// The Boolean; the numbers 0 and 1 too.
    pub fn boolean(&self) -> Option<bool> {
        match self {
            Self::Boolean(b) => Some(*b),
            Self::Number(x) if *x == 0.0 || *x == 1.0 => Some(*x == 1.0),
            _ => None,
        }
    }
}

impl fmt::Display for ParameterValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Boolean(b) => write!(f, "{b}"),
            Self::Text(text) => f.write_str(text),
        }
    }
}
