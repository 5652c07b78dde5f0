//! The variables of an FMU as a plant's table.

use std::borrow::Cow;
use std::ops::Range;

use trueup_fmi_description::description::{
    ArrayDimension, Description, DescriptionCausality, DescriptionVariability, DescriptionVariable,
    StartValues, VariableType,
};
use trueup_plant::{PlantQuantity, VariableTable, elements};

/// Elements of all variables together: each is kept by name.
const MOST: usize = 1 << 20;

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

/// Lengths of the dimensions of a variable, as the description starts them; `None`: it does not say one.
pub fn array_lengths(d: &Description, v: &DescriptionVariable) -> Option<Vec<usize>> {
    let length = |dimension: &ArrayDimension| match dimension {
        ArrayDimension::Fixed(n) => usize::try_from(*n).ok(),
        ArrayDimension::Variable(reference) => {
            let parameter = d.variables.iter().find(|v| v.value_reference == *reference)?;
            parameter.start.as_ref()?.as_f64()?.first().map(|n| *n as usize)
        }
    };
    v.dimensions.iter().map(length).collect()
}

fn quantities(d: &Description, v: &DescriptionVariable, lengths: &[usize]) -> Vec<PlantQuantity> {
    let a = d.attributes(v);
    // As long as the program: a few words per FMU that is opened.
    let unit: &'static str = a.unit.map_or("", |u| Box::leak(u.into_boxed_str()));
    let start = v.start.as_ref().and_then(StartValues::as_f64).unwrap_or_default();
    let names = elements(&v.name, lengths).into_iter().enumerate();
    let one = |(k, name)| PlantQuantity {
        min: a.min.unwrap_or(f64::NEG_INFINITY),
        max: a.max.unwrap_or(f64::INFINITY),
        start: start.get(k).or(start.first()).copied().unwrap_or(0.0),
        description: Cow::Owned(v.description.clone()),
        ..PlantQuantity::new(name, unit)
    };
    names.map(one).collect()
}

/// `Float64` variables by their part; a message where there are too many.
pub(super) fn read(d: &Description) -> Result<(VariableTable, ElementReferences), String> {
    let (mut table, mut places) = (VariableTable::default(), ElementReferences::default());
    let mut left = MOST;
    for v in &d.variables {
        if v.kind != VariableType::Float64 || v.variability == DescriptionVariability::Constant {
            continue;
        }
        let (Some(lengths), Some(count)) = (array_lengths(d, v), d.elements(v)) else { continue };
        left = left.checked_sub(count).ok_or_else(|| {
            format!("`{}` has {count} elements; at most {MOST} of all variables can be taken: export the FMU with shorter arrays", v.name)
        })?;
        let list = match v.causality {
            DescriptionCausality::Parameter => &mut table.parameters,
            DescriptionCausality::Input => &mut table.inputs,
            DescriptionCausality::Output | DescriptionCausality::Local => &mut table.outputs,
            _ => continue,
        };
        let begin = list.len();
        list.extend(quantities(d, v, &lengths));
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
            let lengths = array_lengths(d, state).unwrap_or_default();
            table.states.extend(quantities(d, state, &lengths));
        }
    }
    let shown = &d.structure.event_indicators;
    let all: Vec<u32> = (shown.iter())
        .filter_map(|u| d.variables.get(d.resolve(u.reference)?))
        .filter(|v| v.dimensions.is_empty())
        .map(|v| v.value_reference)
        .collect();
    places.indicators = (all.len() == d.event_indicators()).then_some(all);
    Ok((table, places))
}
