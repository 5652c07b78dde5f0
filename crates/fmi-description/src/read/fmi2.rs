//! What FMI 2.0 writes in its own way.

use super::common::{self, unknown};
use super::error::ReadError;
use super::node::DescriptionNode;
use crate::FmiVersion;
use crate::description::{
    DescriptionVariability, DescriptionVariable, InterfaceCapabilities, ModelStructure, StructureUnknown,
    TypeDefinition, VariableType,
};

const V: FmiVersion = FmiVersion::V2;

pub(super) fn interface(n: &DescriptionNode) -> Result<InterfaceCapabilities, ReadError> {
    let files = n.children_of("SourceFiles").filter(|f| f.name() == "File").map(|f| f.text("name"));
    Ok(InterfaceCapabilities {
        can_not_use_memory_management_functions: n.flag("canNotUseMemoryManagementFunctions")?,
        can_get_and_set_fmu_state: n.flag("canGetAndSetFMUstate")?,
        can_serialize_fmu_state: n.flag("canSerializeFMUstate")?,
        provides_directional_derivatives: n.flag("providesDirectionalDerivative")?,
        needs_completed_integrator_step: n.name() == "ModelExchange"
            && !n.flag("completedIntegratorStepNotNeeded")?,
        can_interpolate_inputs: n.flag("canInterpolateInputs")?,
        can_run_asynchronously: n.flag("canRunAsynchronuously")?,
        source_files: files.collect(),
        ..common::interface(n)?
    })
}

fn typed<'d, 'l>(n: &DescriptionNode<'d, 'l>) -> Option<(VariableType, DescriptionNode<'d, 'l>)> {
    n.children().find_map(|c| VariableType::of(c.name(), V).map(|t| (t, c)))
}

pub(super) fn types(root: &DescriptionNode) -> Result<Vec<TypeDefinition>, ReadError> {
    let definition = |n: DescriptionNode| {
        let (kind, inner) = typed(&n).ok_or_else(|| n.error("a SimpleType without a type".to_owned()))?;
        Ok(TypeDefinition {
            name: n.required("name")?,
            kind,
            description: n.text("description"),
            attributes: inner.attributes(kind)?,
            items: inner.items()?,
            line: n.line(),
        })
    };
    root.children_of("TypeDefinitions").filter(|n| n.name() == "SimpleType").map(definition).collect()
}

pub(super) fn variables(root: &DescriptionNode) -> Result<Vec<DescriptionVariable>, ReadError> {
    root.children_of("ModelVariables")
        .filter(|n| n.name() == "ScalarVariable")
        .map(|n| variable(&n))
        .collect()
}

fn variable(n: &DescriptionNode) -> Result<DescriptionVariable, ReadError> {
    let name = n.required("name")?;
    let (kind, inner) =
        typed(n).ok_or_else(|| n.error(format!("variable `{name}` has no type (Real, Integer, ...)")))?;
    Ok(DescriptionVariable {
        name,
        value_reference: n.required_value("valueReference")?,
        kind,
        description: n.text("description"),
        causality: n.causality(V)?,
        variability: n.variability()?.unwrap_or(DescriptionVariability::Continuous),
        initial: n.initial()?,
        declared_type: inner.attribute("declaredType").map(str::to_owned),
        attributes: inner.attributes(kind)?,
        start: inner.start(kind)?,
        derivative: inner.value("derivative")?,
        reinit: inner.flag("reinit")?,
        can_handle_multiple_set_per_time_instant: n.flag_or("canHandleMultipleSetPerTimeInstant", true)?,
        intermediate_update: false,
        previous: None,
        clocks: Vec::new(),
        dimensions: Vec::new(),
        aliases: Vec::new(),
        line: n.line(),
    })
}

pub(super) fn structure(root: &DescriptionNode) -> Result<ModelStructure, ReadError> {
    let Some(n) = root.child("ModelStructure") else { return Ok(ModelStructure::default()) };
    let unknowns = |list: &str| -> Result<Vec<StructureUnknown>, ReadError> {
        n.children_of(list).filter(|u| u.name() == "Unknown").map(|u| unknown(&u, "index")).collect()
    };
    Ok(ModelStructure {
        outputs: unknowns("Outputs")?,
        derivatives: unknowns("Derivatives")?,
        initial_unknowns: unknowns("InitialUnknowns")?,
        ..ModelStructure::default()
    })
}
