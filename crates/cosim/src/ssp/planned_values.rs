//! Values that a plan sets, as SSP writes them.

use trueup_fmi_description::description::{Description, Type, Variable};

use crate::buffer::Buffer;
use crate::plan::Planned;

/// The values that the plan sets.
pub(super) fn set(planned: &Planned, d: &Description, v: &Variable) -> Vec<String> {
    let mut texts = Vec::new();
    let same = |b: &&crate::buffer::Block| {
        b.references == [v.value_reference]
            && Buffer::new(v.kind, d.version, 0)
                .is_some_and(|like| std::mem::discriminant(&like) == std::mem::discriminant(&b.values))
    };
    if let Some(block) = planned.start.iter().chain(&planned.structural).find(same) {
        block.values.texts(&mut texts);
    }
    texts
}

/// Items of enumerations go by their names.
pub(super) fn item(d: &Description, v: &Variable, text: String) -> String {
    let items =
        v.declared_type.as_deref().filter(|_| v.kind == Type::Enumeration).and_then(|t| d.declared_type(t));
    let name = items.and_then(|t| t.items.iter().find(|i| i.value.to_string() == text));
    name.map_or(text, |i| i.name.clone())
}
