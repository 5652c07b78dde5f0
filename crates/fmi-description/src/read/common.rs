//! What both versions spell alike.

use super::error::ReadError;
use super::node::Node;
use crate::description::{Interface, Unknown};

/// Attributes of an interface that both versions spell alike.
pub(super) fn interface(n: &Node) -> Result<Interface, ReadError> {
    Ok(Interface {
        model_identifier: n.text("modelIdentifier"),
        needs_execution_tool: n.flag("needsExecutionTool")?,
        can_be_instantiated_only_once_per_process: n.flag("canBeInstantiatedOnlyOncePerProcess")?,
        can_handle_variable_communication_step_size: n.flag("canHandleVariableCommunicationStepSize")?,
        max_output_derivative_order: n.value("maxOutputDerivativeOrder")?.unwrap_or(0),
        line: n.line(),
        ..Interface::default()
    })
}

pub(super) fn unknown(n: &Node, reference: &str) -> Result<Unknown, ReadError> {
    let kinds = n.attribute("dependenciesKind").map(|k| k.split_whitespace().map(str::to_owned).collect());
    Ok(Unknown {
        reference: n.required_value(reference)?,
        dependencies: n.list("dependencies")?,
        kinds,
        line: n.line(),
    })
}
