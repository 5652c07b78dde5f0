//! Variables and what they may be.

#[cfg(doc)]
use super::Description;
use super::StructureReference;
use crate::FmiVersion;

/// Data type; FMI 2.0 `Real` is `Float64`, `Integer` is `Int32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum VariableType {
    Float32,
    Float64,
    Int8,
    UInt8,
    Int16,
    UInt16,
    Int32,
    UInt32,
    Int64,
    UInt64,
    Boolean,
    String,
    Binary,
    Enumeration,
    Clock,
}

impl VariableType {
    /// All, with the names of FMI 3.0.
    pub const ALL: [(Self, &'static str); 15] = [
        (Self::Float32, "Float32"),
        (Self::Float64, "Float64"),
        (Self::Int8, "Int8"),
        (Self::UInt8, "UInt8"),
        (Self::Int16, "Int16"),
        (Self::UInt16, "UInt16"),
        (Self::Int32, "Int32"),
        (Self::UInt32, "UInt32"),
        (Self::Int64, "Int64"),
        (Self::UInt64, "UInt64"),
        (Self::Boolean, "Boolean"),
        (Self::String, "String"),
        (Self::Binary, "Binary"),
        (Self::Enumeration, "Enumeration"),
        (Self::Clock, "Clock"),
    ];
    /// Name in this version of the standard.
    pub fn name(self, version: FmiVersion) -> &'static str {
        match (version, self) {
            (FmiVersion::V2, Self::Float64) => "Real",
            (FmiVersion::V2, Self::Int32) => "Integer",
            _ => Self::ALL.iter().find(|(t, _)| *t == self).map_or("", |(_, name)| name),
        }
    }
    /// The type of that element name in this version.
    pub fn of(name: &str, version: FmiVersion) -> Option<Self> {
        let known = match version {
            FmiVersion::V2 => {
                &[Self::Float64, Self::Int32, Self::Boolean, Self::String, Self::Enumeration][..]
            }
            FmiVersion::V3 => return Self::ALL.iter().find(|(_, n)| *n == name).map(|(t, _)| *t),
        };
        known.iter().copied().find(|t| t.name(version) == name)
    }
    /// `Float32` or `Float64`.
    pub fn is_float(self) -> bool {
        matches!(self, Self::Float32 | Self::Float64)
    }
}

/// Attributes that a variable and its declared type have in common; of Int64 and UInt64 the bounds are rounded
/// to doubles.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Attributes {
    pub quantity: Option<String>,
    pub unit: Option<String>,
    pub display_unit: Option<String>,
    pub relative_quantity: bool,
    pub unbounded: bool,
    pub min: Option<f64>,
    pub max: Option<f64>,
    pub nominal: Option<f64>,
    /// FMI 3.0, binary.
    pub mime_type: Option<String>,
    /// FMI 3.0, binary.
    pub max_size: Option<u64>,
    /// FMI 3.0, clock.
    pub clock: Option<ClockAttributes>,
}

/// Attributes of a clock.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct ClockAttributes {
    pub can_be_deactivated: bool,
    pub priority: Option<u32>,
    pub interval_variability: String,
    pub interval_decimal: Option<f64>,
    pub shift_decimal: f64,
    pub supports_fraction: bool,
    pub resolution: Option<u64>,
    pub interval_counter: Option<u64>,
    pub shift_counter: u64,
}

/// Causality.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum DescriptionCausality {
    Parameter,
    CalculatedParameter,
    StructuralParameter,
    Input,
    Output,
    Local,
    Independent,
}

/// Variability.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum DescriptionVariability {
    Constant,
    Fixed,
    Tunable,
    Discrete,
    Continuous,
}

/// How a variable gets its first value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Initial {
    Exact,
    Approx,
    Calculated,
}

/// Start values.
#[derive(Clone, Debug, PartialEq)]
pub enum StartValues {
    /// Float32, Float64.
    Real(Vec<f64>),
    /// Signed integers and enumerations.
    Signed(Vec<i64>),
    /// Unsigned integers.
    Unsigned(Vec<u64>),
    /// Booleans.
    Boolean(Vec<bool>),
    /// Strings.
    Text(Vec<String>),
    /// Binaries.
    Binary(Vec<Vec<u8>>),
}

impl StartValues {
    /// Number of values.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(v) => v.len(),
            Self::Signed(v) => v.len(),
            Self::Unsigned(v) => v.len(),
            Self::Boolean(v) => v.len(),
            Self::Text(v) => v.len(),
            Self::Binary(v) => v.len(),
        }
    }
    /// No value.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Numbers as doubles; `None` for texts and binaries.
    pub fn as_f64(&self) -> Option<Vec<f64>> {
        match self {
            Self::Real(v) => Some(v.clone()),
            Self::Signed(v) => Some(v.iter().map(|x| *x as f64).collect()),
            Self::Unsigned(v) => Some(v.iter().map(|x| *x as f64).collect()),
            Self::Boolean(v) => Some(v.iter().map(|x| f64::from(*x)).collect()),
            Self::Text(_) | Self::Binary(_) => None,
        }
    }
}

/// One dimension of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ArrayDimension {
    /// Of this length.
    Fixed(u64),
    /// Of the length that this structural parameter (value reference) has.
    Variable(u32),
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct DescriptionVariable {
    /// Name.
    pub name: String,
    /// Value reference.
    pub value_reference: u32,
    /// Data type.
    pub kind: VariableType,
    /// `description`.
    pub description: String,
    /// Causality, by default `local`.
    pub causality: DescriptionCausality,
    /// Variability, or its default in this version of the standard.
    pub variability: DescriptionVariability,
    /// As written.
    pub initial: Option<Initial>,
    /// Name of the declared type.
    pub declared_type: Option<String>,
    /// Its own attributes, without those of the declared type; see [`Description::attributes`].
    pub attributes: Attributes,
    /// Start values.
    pub start: Option<StartValues>,
    /// The state that this is the derivative of.
    pub derivative: Option<StructureReference>,
    /// May jump at events.
    pub reinit: bool,
    /// May be set more than once per super-dense instant.
    pub can_handle_multiple_set_per_time_instant: bool,
    /// Accessible in Intermediate Update Mode (3.0).
    pub intermediate_update: bool,
    /// Value reference of the variable that holds the previous value (3.0).
    pub previous: Option<u32>,
    /// Value references of its clocks (3.0).
    pub clocks: Vec<u32>,
    /// Dimensions, empty for a scalar (3.0).
    pub dimensions: Vec<ArrayDimension>,
    /// Further names of the same variable (3.0).
    pub aliases: Vec<Alias>,
    /// Line.
    pub line: u32,
}

/// A further name of a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub struct Alias {
    pub name: String,
    pub description: String,
    pub display_unit: Option<String>,
}

impl DescriptionVariable {
    /// `initial` as written, else the default of the standards for its causality and variability; `None` for
    /// the independent variable.
    pub fn effective_initial(&self) -> Option<Initial> {
        self.initial.or(match (self.causality, self.variability) {
            (DescriptionCausality::Independent, _) => None,
            (
                DescriptionCausality::Parameter
                | DescriptionCausality::StructuralParameter
                | DescriptionCausality::Input,
                _,
            )
            | (_, DescriptionVariability::Constant) => Some(Initial::Exact),
            _ => Some(Initial::Calculated),
        })
    }
}
