//! What a modelDescription.xml says, the same for FMI 2.0 and 3.0.

use std::collections::HashMap;

use crate::Version;

/// A model description as read. Lines count from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Version of the standard.
    pub version: Version,
    /// `fmiVersion` as written.
    pub fmi_version: String,
    /// `modelName`.
    pub model_name: String,
    /// `guid` (2.0), `instantiationToken` (3.0).
    pub token: String,
    /// `description`.
    pub description: String,
    /// `author`.
    pub author: String,
    /// `version` of the model.
    pub model_version: String,
    /// `copyright`.
    pub copyright: String,
    /// `license`.
    pub license: String,
    /// `generationTool`.
    pub generation_tool: String,
    /// `generationDateAndTime`.
    pub generation_date_and_time: String,
    /// `variableNamingConvention` is `structured`.
    pub structured_names: bool,
    /// `numberOfEventIndicators`, FMI 2.0 only.
    pub number_of_event_indicators: Option<u32>,
    /// Model Exchange.
    pub model_exchange: Option<Interface>,
    /// Co-Simulation.
    pub co_simulation: Option<Interface>,
    /// Scheduled Execution (3.0).
    pub scheduled_execution: Option<Interface>,
    /// Units.
    pub units: Vec<Unit>,
    /// Type definitions.
    pub types: Vec<TypeDefinition>,
    /// Log categories: name, description.
    pub log_categories: Vec<(String, String)>,
    /// Default experiment.
    pub experiment: Experiment,
    /// Variables in their order.
    pub variables: Vec<Variable>,
    /// Model structure.
    pub structure: Structure,
    pub(crate) by_name: HashMap<String, usize>,
    pub(crate) by_reference: HashMap<u32, usize>,
}

/// How the structure of a model names a variable: by its index from 1 in FMI 2.0, by its value reference in
/// FMI 3.0. [`Description::resolve`] gives the variable.
pub type Reference = u32;

impl Description {
    /// The variable of that name, FMI 3.0 alias names included.
    pub fn find(&self, name: &str) -> Option<&Variable> {
        self.by_name.get(name).and_then(|at| self.variables.get(*at))
    }
    /// Position in [`Self::variables`] of what the structure names.
    pub fn resolve(&self, reference: Reference) -> Option<usize> {
        match self.version {
            Version::V2 => (reference as usize).checked_sub(1).filter(|at| *at < self.variables.len()),
            Version::V3 => self.by_reference.get(&reference).copied(),
        }
    }
    /// The interfaces that the FMU offers, with their element names.
    pub fn interfaces(&self) -> impl Iterator<Item = (&'static str, &Interface)> {
        [
            ("ModelExchange", &self.model_exchange),
            ("CoSimulation", &self.co_simulation),
            ("ScheduledExecution", &self.scheduled_execution),
        ]
        .into_iter()
        .filter_map(|(name, i)| i.as_ref().map(|i| (name, i)))
    }
    /// Unit of that name.
    pub fn unit(&self, name: &str) -> Option<&Unit> {
        self.units.iter().find(|u| u.name == name)
    }
    /// Type definition of that name.
    pub fn declared_type(&self, name: &str) -> Option<&TypeDefinition> {
        self.types.iter().find(|t| t.name == name)
    }
    /// Number of elements: of an array the product of its dimensions, as sized by the start values of structural
    /// parameters; `None` where a dimension cannot be resolved.
    pub fn elements(&self, variable: &Variable) -> Option<usize> {
        variable.dimensions.iter().try_fold(1usize, |product, dimension| {
            let length = match dimension {
                Dimension::Fixed(n) => usize::try_from(*n).ok()?,
                Dimension::Variable(reference) => {
                    let parameter = self.variables.get(*self.by_reference.get(reference)?)?;
                    match parameter.start.as_ref()? {
                        Values::Unsigned(v) => usize::try_from(*v.first()?).ok()?,
                        Values::Signed(v) => usize::try_from(*v.first()?).ok()?,
                        _ => return None,
                    }
                }
            };
            product.checked_mul(length)
        })
    }
    /// Number of event indicators.
    pub fn event_indicators(&self) -> usize {
        match self.version {
            Version::V2 => self.number_of_event_indicators.unwrap_or(0) as usize,
            Version::V3 => self
                .structure
                .event_indicators
                .iter()
                .filter_map(|u| self.elements(self.variables.get(self.resolve(u.reference)?)?))
                .sum(),
        }
    }
}

/// One interface type with what it can do; what a version of the standard does not know is false or 0.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)] // the attributes of the standard
pub struct Interface {
    pub model_identifier: String,
    pub needs_execution_tool: bool,
    pub can_be_instantiated_only_once_per_process: bool,
    pub can_not_use_memory_management_functions: bool,
    pub can_get_and_set_fmu_state: bool,
    pub can_serialize_fmu_state: bool,
    pub provides_directional_derivatives: bool,
    pub provides_adjoint_derivatives: bool,
    pub provides_per_element_dependencies: bool,
    /// FMI 2.0 writes the opposite, `completedIntegratorStepNotNeeded`.
    pub needs_completed_integrator_step: bool,
    pub provides_evaluate_discrete_states: bool,
    pub can_handle_variable_communication_step_size: bool,
    pub can_interpolate_inputs: bool,
    pub can_run_asynchronously: bool,
    pub fixed_internal_step_size: Option<f64>,
    pub max_output_derivative_order: u32,
    pub recommended_intermediate_input_smoothness: i32,
    pub provides_intermediate_update: bool,
    pub might_return_early_from_do_step: bool,
    pub can_return_early_after_intermediate_update: bool,
    pub has_event_mode: bool,
    /// FMI 2.0: files of the sources.
    pub source_files: Vec<String>,
    /// Line of the element.
    pub line: u32,
}

/// A unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Name.
    pub name: String,
    /// In SI base units, where given.
    pub base: Option<BaseUnit>,
    /// Units to display values in.
    pub display: Vec<DisplayUnit>,
    /// Line.
    pub line: u32,
}

/// value in SI base units = `factor` * value + `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BaseUnit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i32; 8],
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
}

/// displayed value = `factor` * value + `offset` (`inverse`: `factor` / value).
#[derive(Clone, Debug, PartialEq)]
pub struct DisplayUnit {
    /// Name.
    pub name: String,
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
    /// FMI 3.0.
    pub inverse: bool,
}

/// Data type; FMI 2.0 `Real` is `Float64`, `Integer` is `Int32`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Type {
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

impl Type {
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
    pub fn name(self, version: Version) -> &'static str {
        match (version, self) {
            (Version::V2, Self::Float64) => "Real",
            (Version::V2, Self::Int32) => "Integer",
            _ => Self::ALL.iter().find(|(t, _)| *t == self).map_or("", |(_, name)| name),
        }
    }
    /// The type of that element name in this version.
    pub fn of(name: &str, version: Version) -> Option<Self> {
        let known = match version {
            Version::V2 => &[Self::Float64, Self::Int32, Self::Boolean, Self::String, Self::Enumeration][..],
            Version::V3 => return Self::ALL.iter().find(|(_, n)| *n == name).map(|(t, _)| *t),
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
    pub clock: Option<Clock>,
}

/// Attributes of a clock.
#[derive(Clone, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Clock {
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

/// A type definition.
#[derive(Clone, Debug, PartialEq)]
pub struct TypeDefinition {
    /// Name.
    pub name: String,
    /// Data type.
    pub kind: Type,
    /// `description`.
    pub description: String,
    /// Defaults for the variables of the type.
    pub attributes: Attributes,
    /// Items of an enumeration.
    pub items: Vec<Item>,
    /// Line.
    pub line: u32,
}

/// An item of an enumeration.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    /// Name.
    pub name: String,
    /// Number.
    pub value: i64,
    /// `description`.
    pub description: String,
}

/// Default experiment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct Experiment {
    pub start_time: Option<f64>,
    pub stop_time: Option<f64>,
    pub tolerance: Option<f64>,
    pub step_size: Option<f64>,
}

/// Causality.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[allow(missing_docs)]
pub enum Causality {
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
pub enum Variability {
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
pub enum Values {
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

impl Values {
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
pub enum Dimension {
    /// Of this length.
    Fixed(u64),
    /// Of the length that this structural parameter (value reference) has.
    Variable(u32),
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Value reference.
    pub value_reference: u32,
    /// Data type.
    pub kind: Type,
    /// `description`.
    pub description: String,
    /// Causality, by default `local`.
    pub causality: Causality,
    /// Variability, or its default in this version of the standard.
    pub variability: Variability,
    /// As written.
    pub initial: Option<Initial>,
    /// Name of the declared type.
    pub declared_type: Option<String>,
    /// Its own attributes, without those of the declared type; see [`Description::attributes`].
    pub attributes: Attributes,
    /// Start values.
    pub start: Option<Values>,
    /// The state that this is the derivative of.
    pub derivative: Option<Reference>,
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
    pub dimensions: Vec<Dimension>,
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

impl Variable {
    /// `initial` as written, else the default of the standards for its causality and variability; `None` for
    /// the independent variable.
    pub fn effective_initial(&self) -> Option<Initial> {
        self.initial.or(match (self.causality, self.variability) {
            (Causality::Independent, _) => None,
            (Causality::Parameter | Causality::StructuralParameter | Causality::Input, _)
            | (_, Variability::Constant) => Some(Initial::Exact),
            _ => Some(Initial::Calculated),
        })
    }
}

impl Description {
    /// The attributes of a variable, filled up from its declared type.
    pub fn attributes(&self, v: &Variable) -> Attributes {
        let own = &v.attributes;
        let Some(t) = v.declared_type.as_deref().and_then(|n| self.declared_type(n)).map(|t| &t.attributes)
        else {
            return own.clone();
        };
        Attributes {
            quantity: own.quantity.clone().or_else(|| t.quantity.clone()),
            unit: own.unit.clone().or_else(|| t.unit.clone()),
            display_unit: own.display_unit.clone().or_else(|| t.display_unit.clone()),
            relative_quantity: own.relative_quantity || t.relative_quantity,
            unbounded: own.unbounded || t.unbounded,
            min: own.min.or(t.min),
            max: own.max.or(t.max),
            nominal: own.nominal.or(t.nominal),
            mime_type: own.mime_type.clone().or_else(|| t.mime_type.clone()),
            max_size: own.max_size.or(t.max_size),
            clock: own.clock.clone().or_else(|| t.clock.clone()),
        }
    }
}

/// Model structure.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Structure {
    /// Outputs.
    pub outputs: Vec<Unknown>,
    /// Derivatives, in the order of the states.
    pub derivatives: Vec<Unknown>,
    /// Clocked states (3.0).
    pub clocked_states: Vec<Unknown>,
    /// Initial unknowns.
    pub initial_unknowns: Vec<Unknown>,
    /// Event indicators (3.0).
    pub event_indicators: Vec<Unknown>,
}

/// An unknown and what it depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unknown {
    /// Which variable.
    pub reference: Reference,
    /// `None`: on everything; empty: on nothing.
    pub dependencies: Option<Vec<Reference>>,
    /// One per dependency, where given.
    pub kinds: Option<Vec<String>>,
    /// Line.
    pub line: u32,
}
