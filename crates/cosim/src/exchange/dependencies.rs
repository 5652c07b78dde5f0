//! What a variable depends on.

use std::collections::HashSet;

use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, Initial, StructureUnknown,
};

use super::Phase;

/// The inputs on which a variable depends, as positions in the description; `None`: on all.
pub(crate) fn dependencies(d: &Description, variable: usize, phase: Phase) -> Option<HashSet<usize>> {
    let v = &d.variables[variable];
    let nothing = matches!(v.variability, DescriptionVariability::Constant | DescriptionVariability::Fixed)
        || matches!(
            v.causality,
            DescriptionCausality::Parameter
                | DescriptionCausality::StructuralParameter
                | DescriptionCausality::Independent
        );
    if nothing && (phase == Phase::Stepping || v.variability == DescriptionVariability::Constant) {
        return Some(HashSet::new());
    }
    let of =
        |list: &[StructureUnknown]| list.iter().find(|u| d.resolve(u.reference) == Some(variable)).cloned();
    let s = &d.structure;
    let declared = match phase {
        Phase::Initialization => match of(&s.initial_unknowns) {
            None if v.effective_initial() == Some(Initial::Exact) => return Some(HashSet::new()),
            None => of(&s.outputs),
            found => found,
        },
        Phase::Stepping => of(&s.outputs).or_else(|| of(&s.derivatives)),
    };
    let dependencies = declared?.dependencies?;
    Some(dependencies.iter().filter_map(|r| d.resolve(*r)).collect())
}
