//! What both versions spell alike.

use super::error::ReadError;
use super::node::DescriptionNode;
use crate::description::{InterfaceCapabilities, StructureUnknown};

/// Attributes of an interface that both versions spell alike.
pub(super) fn interface(n: &DescriptionNode) -> Result<InterfaceCapabilities, ReadError> {
    Ok(InterfaceCapabilities {
        model_identifier: n.text("modelIdentifier"),
        needs_execution_tool: n.flag("needsExecutionTool")?,
        can_be_instantiated_only_once_per_process: n.flag("canBeInstantiatedOnlyOncePerProcess")?,
        can_handle_variable_communication_step_size: n.flag("canHandleVariableCommunicationStepSize")?,
        max_output_derivative_order: n.value("maxOutputDerivativeOrder")?.unwrap_or(0),
        line: n.line(),
        ..InterfaceCapabilities::default()
    })
}

pub(super) fn unknown(n: &DescriptionNode, reference: &str) -> Result<StructureUnknown, ReadError> {
    let kinds = n.attribute("dependenciesKind").map(|k| k.split_whitespace().map(str::to_owned).collect());
    Ok(StructureUnknown {
        reference: n.required_value(reference)?,
        dependencies: n.list("dependencies")?,
        kinds,
        line: n.line(),
    })
}
