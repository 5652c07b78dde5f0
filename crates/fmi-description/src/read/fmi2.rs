//! What FMI 2.0 writes in its own way.

use super::common::{self, unknown};
use super::error::ReadError;
use super::node::Node;
use crate::Version;
use crate::description::{Interface, Structure, Type, TypeDefinition, Unknown, Variability, Variable};

const V: Version = Version::V2;

pub(super) fn interface(n: &Node) -> Result<Interface, ReadError> {
    let files = n.children_of("SourceFiles").filter(|f| f.name() == "File").map(|f| f.text("name"));
    Ok(Interface {
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

fn typed<'d, 'l>(n: &Node<'d, 'l>) -> Option<(Type, Node<'d, 'l>)> {
    n.children().find_map(|c| Type::of(c.name(), V).map(|t| (t, c)))
}

pub(super) fn types(root: &Node) -> Result<Vec<TypeDefinition>, ReadError> {
    let definition = |n: Node| {
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

pub(super) fn variables(root: &Node) -> Result<Vec<Variable>, ReadError> {
    root.children_of("ModelVariables")
        .filter(|n| n.name() == "ScalarVariable")
        .map(|n| variable(&n))
        .collect()
}

fn variable(n: &Node) -> Result<Variable, ReadError> {
    let name = n.required("name")?;
    let (kind, inner) =
        typed(n).ok_or_else(|| n.error(format!("variable `{name}` has no type (Real, Integer, ...)")))?;
    Ok(Variable {
        name,
        value_reference: n.required_value("valueReference")?,
        kind,
        description: n.text("description"),
        causality: n.causality(V)?,
        variability: n.variability()?.unwrap_or(Variability::Continuous),
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

pub(super) fn structure(root: &Node) -> Result<Structure, ReadError> {
    let Some(n) = root.child("ModelStructure") else { return Ok(Structure::default()) };
    let unknowns = |list: &str| -> Result<Vec<Unknown>, ReadError> {
        n.children_of(list).filter(|u| u.name() == "Unknown").map(|u| unknown(&u, "index")).collect()
    };
    Ok(Structure {
        outputs: unknowns("Outputs")?,
        derivatives: unknowns("Derivatives")?,
        initial_unknowns: unknowns("InitialUnknowns")?,
        ..Structure::default()
    })
}
