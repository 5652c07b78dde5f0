//! The content of a modelDescription.xml, the same for FMI 2.0 and 3.0.

mod variable;

use std::collections::HashMap;

use crate::FmiVersion;
pub use variable::*;

/// A model description as read. Lines count from 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Version of the standard.
    pub version: FmiVersion,
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
    pub model_exchange: Option<InterfaceCapabilities>,
    /// Co-Simulation.
    pub co_simulation: Option<InterfaceCapabilities>,
    /// Scheduled Execution (3.0).
    pub scheduled_execution: Option<InterfaceCapabilities>,
    /// Units.
    pub units: Vec<DescriptionUnit>,
    /// Type definitions.
    pub types: Vec<TypeDefinition>,
    /// Log categories: name, description.
    pub log_categories: Vec<(String, String)>,
    /// Default experiment.
    pub experiment: DefaultExperiment,
    /// Variables in their order.
    pub variables: Vec<DescriptionVariable>,
    /// Model structure.
    pub structure: ModelStructure,
    pub(crate) by_name: HashMap<String, usize>,
    pub(crate) by_reference: HashMap<u32, usize>,
}

/// How the structure of a model names a variable: by its index from 1 in FMI 2.0, by its value reference in
/// FMI 3.0. [`Description::resolve`] gives the variable.
pub type StructureReference = u32;

impl Description {
    /// The variable of that name, FMI 3.0 alias names included.
    pub fn find(&self, name: &str) -> Option<&DescriptionVariable> {
        self.by_name.get(name).and_then(|at| self.variables.get(*at))
    }
    /// Position in [`Self::variables`] of the variable of that name, alias names included.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }
    /// Position in [`Self::variables`] of what the structure names.
    pub fn resolve(&self, reference: StructureReference) -> Option<usize> {
        match self.version {
            FmiVersion::V2 => (reference as usize).checked_sub(1).filter(|at| *at < self.variables.len()),
            FmiVersion::V3 => self.by_reference.get(&reference).copied(),
        }
    }
    /// The interfaces that the FMU offers, with their element names.
    pub fn interfaces(&self) -> impl Iterator<Item = (&'static str, &InterfaceCapabilities)> {
        [
            ("ModelExchange", &self.model_exchange),
            ("CoSimulation", &self.co_simulation),
            ("ScheduledExecution", &self.scheduled_execution),
        ]
        .into_iter()
        .filter_map(|(name, i)| i.as_ref().map(|i| (name, i)))
    }
    /// Unit of that name.
    pub fn unit(&self, name: &str) -> Option<&DescriptionUnit> {
        self.units.iter().find(|u| u.name == name)
    }
    /// Type definition of that name.
    pub fn declared_type(&self, name: &str) -> Option<&TypeDefinition> {
        self.types.iter().find(|t| t.name == name)
    }
    /// Number of elements: of an array the product of its dimensions, as sized by the start values of structural
    /// parameters; `None` where a dimension cannot be resolved.
    pub fn elements(&self, variable: &DescriptionVariable) -> Option<usize> {
        variable
            .dimensions
            .iter()
            .try_fold(1usize, |product, dimension| product.checked_mul(self.length(dimension)?))
    }
    /// Length of each dimension, outermost first; of a scalar none at all. `None` where one cannot be resolved.
    pub fn lengths(&self, variable: &DescriptionVariable) -> Option<Vec<usize>> {
        variable.dimensions.iter().map(|dimension| self.length(dimension)).collect()
    }
    /// Length of a dimension, as the start value of a structural parameter sizes it; `None` where it cannot be resolved.
    fn length(&self, dimension: &ArrayDimension) -> Option<usize> {
        match dimension {
            ArrayDimension::Fixed(n) => usize::try_from(*n).ok(),
            ArrayDimension::Variable(reference) => {
                let parameter = self.variables.get(*self.by_reference.get(reference)?)?;
                match parameter.start.as_ref()? {
                    StartValues::Unsigned(v) => usize::try_from(*v.first()?).ok(),
                    StartValues::Signed(v) => usize::try_from(*v.first()?).ok(),
                    _ => None,
                }
            }
        }
    }
    /// Number of continuous states; `None` where a dimension cannot be resolved.
    pub fn states(&self) -> Option<usize> {
        let elements = |u: &StructureUnknown| self.elements(self.variables.get(self.resolve(u.reference)?)?);
        self.structure.derivatives.iter().map(elements).sum()
    }
    /// Number of event indicators.
    pub fn event_indicators(&self) -> usize {
        match self.version {
            FmiVersion::V2 => self.number_of_event_indicators.unwrap_or(0) as usize,
            FmiVersion::V3 => self
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
pub struct InterfaceCapabilities {
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
pub struct DescriptionUnit {
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

/// A type definition.
#[derive(Clone, Debug, PartialEq)]
pub struct TypeDefinition {
    /// Name.
    pub name: String,
    /// Data type.
    pub kind: VariableType,
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
pub struct DefaultExperiment {
    pub start_time: Option<f64>,
    pub stop_time: Option<f64>,
    pub tolerance: Option<f64>,
    pub step_size: Option<f64>,
}

impl Description {
    /// The attributes of a variable, filled up from its declared type.
    pub fn attributes(&self, v: &DescriptionVariable) -> Attributes {
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
pub struct ModelStructure {
    /// Outputs.
    pub outputs: Vec<StructureUnknown>,
    /// Derivatives, in the order of the states.
    pub derivatives: Vec<StructureUnknown>,
    /// Clocked states (3.0).
    pub clocked_states: Vec<StructureUnknown>,
    /// Initial unknowns.
    pub initial_unknowns: Vec<StructureUnknown>,
    /// Event indicators (3.0).
    pub event_indicators: Vec<StructureUnknown>,
}

/// An unknown and what it depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructureUnknown {
    /// Which variable.
    pub reference: StructureReference,
    /// `None`: on everything; empty: on nothing.
    pub dependencies: Option<Vec<StructureReference>>,
    /// One per dependency, where given.
    pub kinds: Option<Vec<String>>,
    /// Line.
    pub line: u32,
}
