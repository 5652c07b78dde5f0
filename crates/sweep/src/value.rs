//! A value of a factor.

/// A value of a factor.
#[derive(Clone, Debug, PartialEq)]
pub enum FactorValue {
    /// A number, finite.
    Number(f64),
    /// A whole number, as it was written.
    Integer(i64),
    /// A Boolean.
    Boolean(bool),
    /// An item of an enumeration, or a text.
    Text(String),
}

impl FactorValue {
    pub(crate) fn of(value: &toml::Value) -> Option<Self> {
        Some(match value {
            toml::Value::Float(x) if x.is_finite() => Self::Number(*x),
            toml::Value::Integer(n) => Self::Integer(*n),
            toml::Value::Boolean(b) => Self::Boolean(*b),
            toml::Value::String(text) => Self::Text(text.clone()),
            _ => return None,
        })
    }

    /// As a start value.
    pub fn text(&self) -> String {
        match self {
            // The shortest digits that read back as the same bits; a whole number as one, which integers take too.
            Self::Number(x) => format!("{x}"),
            Self::Integer(n) => n.to_string(),
            Self::Boolean(b) => b.to_string(),
            Self::Text(text) => text.clone(),
        }
    }
}
