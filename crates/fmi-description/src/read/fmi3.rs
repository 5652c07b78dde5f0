//! What FMI 3.0 writes in its own way.

use super::common::{self, unknown};
use super::error::ReadError;
use super::node::DescriptionNode;
use crate::FmiVersion;
use crate::description::{
    Alias, ArrayDimension, DescriptionCausality, DescriptionVariability, DescriptionVariable,
    InterfaceCapabilities, ModelStructure, StartValues, StructureUnknown, TypeDefinition, VariableType,
};

const V: FmiVersion = FmiVersion::V3;

pub(super) fn interface(n: &DescriptionNode) -> Result<InterfaceCapabilities, ReadError> {
    Ok(InterfaceCapabilities {
        can_get_and_set_fmu_state: n.flag("canGetAndSetFMUState")?,
        can_serialize_fmu_state: n.flag("canSerializeFMUState")?,
        provides_directional_derivatives: n.flag("providesDirectionalDerivatives")?,
        provides_adjoint_derivatives: n.flag("providesAdjointDerivatives")?,
        provides_per_element_dependencies: n.flag("providesPerElementDependencies")?,
        needs_completed_integrator_step: n.flag("needsCompletedIntegratorStep")?,
        provides_evaluate_discrete_states: n.flag("providesEvaluateDiscreteStates")?,
        fixed_internal_step_size: n.value("fixedInternalStepSize")?,
        recommended_intermediate_input_smoothness: n
            .value("recommendedIntermediateInputSmoothness")?
            .unwrap_or(0),
        provides_intermediate_update: n.flag("providesIntermediateUpdate")?,
        might_return_early_from_do_step: n.flag("mightReturnEarlyFromDoStep")?,
        can_return_early_after_intermediate_update: n.flag("canReturnEarlyAfterIntermediateUpdate")?,
        has_event_mode: n.flag("hasEventMode")?,
        ..common::interface(n)?
    })
}

pub(super) fn types(root: &DescriptionNode) -> Result<Vec<TypeDefinition>, ReadError> {
    let kind = |n: &DescriptionNode| n.name().strip_suffix("Type").and_then(|name| VariableType::of(name, V));
    let definition = |(n, kind): (DescriptionNode, VariableType)| {
        Ok(TypeDefinition {
            name: n.required("name")?,
            kind,
            description: n.text("description"),
            attributes: n.attributes(kind)?,
            items: n.items()?,
            line: n.line(),
        })
    };
    root.children_of("TypeDefinitions").filter_map(|n| kind(&n).map(|k| (n, k))).map(definition).collect()
}

pub(super) fn variables(root: &DescriptionNode) -> Result<Vec<DescriptionVariable>, ReadError> {
    let typed = |n: DescriptionNode| VariableType::of(n.name(), V).map(|kind| variable(&n, kind));
    root.children_of("ModelVariables").filter_map(typed).collect()
}

fn variable(n: &DescriptionNode, kind: VariableType) -> Result<DescriptionVariable, ReadError> {
    let causality = n.causality(V)?;
    let parameter = matches!(
        causality,
        DescriptionCausality::Parameter
            | DescriptionCausality::CalculatedParameter
            | DescriptionCausality::StructuralParameter
    );
    let default = match kind {
        _ if parameter => DescriptionVariability::Fixed,
        VariableType::Float32 | VariableType::Float64 => DescriptionVariability::Continuous,
        _ => DescriptionVariability::Discrete,
    };
    let aliases = n.children().filter(|a| a.name() == "Alias").map(|a| {
        Ok(Alias {
            name: a.required("name")?,
            description: a.text("description"),
            display_unit: a.attribute("displayUnit").map(str::to_owned),
        })
    });
    Ok(DescriptionVariable {
        name: n.required("name")?,
        value_reference: n.required_value("valueReference")?,
        kind,
        description: n.text("description"),
        causality,
        variability: n.variability()?.unwrap_or(default),
        initial: n.initial()?,
        declared_type: n.attribute("declaredType").map(str::to_owned),
        attributes: n.attributes(kind)?,
        start: start(n, kind)?,
        derivative: n.value("derivative")?,
        reinit: n.flag("reinit")?,
        can_handle_multiple_set_per_time_instant: n.flag_or("canHandleMultipleSetPerTimeInstant", true)?,
        intermediate_update: n.flag("intermediateUpdate")?,
        previous: n.value("previous")?,
        clocks: n.list("clocks")?.unwrap_or_default(),
        dimensions: n
            .children()
            .filter(|d| d.name() == "Dimension")
            .map(|d| dimension(&d))
            .collect::<Result<_, _>>()?,
        aliases: aliases.collect::<Result<_, _>>()?,
        line: n.line(),
    })
}

/// Strings and binaries have their start values in elements.
fn start(n: &DescriptionNode, kind: VariableType) -> Result<Option<StartValues>, ReadError> {
    let elements: Vec<DescriptionNode> = n.children().filter(|s| s.name() == "Start").collect();
    let texts = elements.iter().map(|s| s.text("value"));
    Ok(match kind {
        _ if elements.is_empty() => n.start(kind)?,
        VariableType::String => Some(StartValues::Text(texts.collect())),
        VariableType::Binary => {
            let bytes = |s: &DescriptionNode| {
                hexadecimal(&s.text("value")).ok_or_else(|| s.misread("value", &s.text("value")))
            };
            Some(StartValues::Binary(elements.iter().map(bytes).collect::<Result<_, _>>()?))
        }
        _ => n.start(kind)?,
    })
}

fn hexadecimal(text: &str) -> Option<Vec<u8>> {
    let digits: Vec<u8> =
        text.trim().chars().map(|c| c.to_digit(16).map(|d| d as u8)).collect::<Option<_>>()?;
    (digits.len().is_multiple_of(2)).then(|| digits.chunks(2).map(|c| c[0] << 4 | c[1]).collect())
}

fn dimension(n: &DescriptionNode) -> Result<ArrayDimension, ReadError> {
    match (n.value("start")?, n.value("valueReference")?) {
        (Some(length), None) => Ok(ArrayDimension::Fixed(length)),
        (None, Some(reference)) => Ok(ArrayDimension::Variable(reference)),
        _ => Err(n.error("a Dimension needs either `start` or `valueReference`".to_owned())),
    }
}

pub(super) fn structure(root: &DescriptionNode) -> Result<ModelStructure, ReadError> {
    let unknowns = |name: &str| -> Result<Vec<StructureUnknown>, ReadError> {
        let all = root.children_of("ModelStructure").filter(|u| u.name() == name);
        all.map(|u| unknown(&u, "valueReference")).collect()
    };
    Ok(ModelStructure {
        outputs: unknowns("Output")?,
        derivatives: unknowns("ContinuousStateDerivative")?,
        clocked_states: unknowns("ClockedState")?,
        initial_unknowns: unknowns("InitialUnknown")?,
        event_indicators: unknowns("EventIndicator")?,
    })
}
