//! Values that a plan sets, as SSP writes them.

use trueup_fmi_description::description::{Description, DescriptionVariable, VariableType};

use crate::buffer::ValueBuffer;
use crate::plan::PlannedComponent;

/// The values that the plan sets.
pub(super) fn set(planned: &PlannedComponent, d: &Description, v: &DescriptionVariable) -> Vec<String> {
    let mut texts = Vec::new();
    let same = |b: &&crate::buffer::VariableBlock| {
        b.references == [v.value_reference]
            && ValueBuffer::new(v.kind, d.version, 0)
                .is_some_and(|like| std::mem::discriminant(&like) == std::mem::discriminant(&b.values))
    };
    if let Some(block) = planned.start.iter().chain(&planned.structural).find(same) {
        block.values.texts(&mut texts);
    }
    texts
}

/// Items of enumerations go by their names.
pub(super) fn item(d: &Description, v: &DescriptionVariable, text: String) -> String {
    let items = v
        .declared_type
        .as_deref()
        .filter(|_| v.kind == VariableType::Enumeration)
        .and_then(|t| d.declared_type(t));
    let name = items.and_then(|t| t.items.iter().find(|i| i.value.to_string() == text));
    name.map_or(text, |i| i.name.clone())
}
