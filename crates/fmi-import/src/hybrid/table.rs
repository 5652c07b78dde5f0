//! The variables of an FMU as a plant's table.

use std::borrow::Cow;
use std::ops::Range;

use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, StartValues, VariableType,
};
use trueup_plant::{PlantQuantity, VariableTable, elements};

use crate::instance::indicator_references;

/// Most elements of all `Float64` variables of an FMU together: each is kept by name.
pub const MAX_ELEMENTS: usize = 1 << 20;

/// A parameter and its elements in the list.
#[derive(Clone, Debug)]
pub(super) struct ElementReference {
    pub(super) reference: u32,
    pub(super) begin: usize,
    len: usize,
    pub(super) tunable: bool,
}

impl ElementReference {
    pub(super) fn elements(&self) -> Range<usize> {
        self.begin..self.begin + self.len
    }
}

/// Value references, in the order of the table.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementReferences {
    pub(super) parameters: Vec<ElementReference>,
    pub(super) inputs: Vec<u32>,
    pub(super) outputs: Vec<u32>,
    /// Event indicators that are variables (FMI 3.0); none: they are not.
    pub(super) indicators: Option<Vec<u32>>,
}

/// The elements of a `Float64` variable, arrays row by row, with unit, bounds, start value and description; `None`: the
/// description does not give its size.
pub fn element_quantities(d: &Description, v: &DescriptionVariable) -> Option<Vec<PlantQuantity>> {
    let (lengths, _) = (d.lengths(v)?, d.elements(v)?);
    let a = d.attributes(v);
    // As long as the program: a few words per FMU that is opened.
    let unit: &'static str = a.unit.map_or("", |u| Box::leak(u.into_boxed_str()));
    let start = v.start.as_ref().and_then(StartValues::as_f64).unwrap_or_default();
    let names = elements(&v.name, &lengths).into_iter().enumerate();
    let one = |(k, name)| PlantQuantity {
        min: a.min.unwrap_or(f64::NEG_INFINITY),
        max: a.max.unwrap_or(f64::INFINITY),
        start: start.get(k).or(start.first()).copied().unwrap_or(0.0),
        description: Cow::Owned(v.description.clone()),
        ..PlantQuantity::new(name, unit)
    };
    Some(names.map(one).collect())
}

/// `Float64` variables by their part; a message where there are too many.
pub(super) fn read(d: &Description) -> Result<(VariableTable, ElementReferences), String> {
    let (mut table, mut places) = (VariableTable::default(), ElementReferences::default());
    let mut left = MAX_ELEMENTS;
    for v in &d.variables {
        if v.kind != VariableType::Float64 || v.variability == DescriptionVariability::Constant {
            continue;
        }
        let Some(count) = d.elements(v) else { continue };
        left = left.checked_sub(count).ok_or_else(|| {
            format!("`{}` has {count} elements; at most {MAX_ELEMENTS} of all variables can be taken: export the FMU with shorter arrays", v.name)
        })?;
        let list = match v.causality {
            DescriptionCausality::Parameter => &mut table.parameters,
            DescriptionCausality::Input => &mut table.inputs,
            DescriptionCausality::Output | DescriptionCausality::Local => &mut table.outputs,
            _ => continue,
        };
        let begin = list.len();
        list.extend(element_quantities(d, v).unwrap_or_default());
        match v.causality {
            DescriptionCausality::Parameter => places.parameters.push(ElementReference {
                reference: v.value_reference,
                begin,
                len: count,
                tunable: v.variability == DescriptionVariability::Tunable,
            }),
            DescriptionCausality::Input => places.inputs.push(v.value_reference),
            _ => places.outputs.push(v.value_reference),
        }
    }
    for unknown in &d.structure.derivatives {
        let rate = d.resolve(unknown.reference).and_then(|at| d.variables.get(at));
        let state = rate.and_then(|v| v.derivative).and_then(|r| d.resolve(r));
        if let Some(state) = state.and_then(|at| d.variables.get(at)) {
            table.states.extend(element_quantities(d, state).unwrap_or_default());
        }
    }
    places.indicators = indicator_references(d, d.event_indicators());
    Ok((table, places))
}
