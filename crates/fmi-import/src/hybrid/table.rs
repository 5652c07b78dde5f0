//! The variables of an FMU as a plant's table.

use std::borrow::Cow;
use std::ops::Range;

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, StartValues,
    StructureUnknown, VariableType,
};
use trueup_plant::{PlantQuantity, VariableTable, elements};

/// Most elements of all `Float64` variables of an FMU together: each is kept by name.
pub const MAX_ELEMENTS: usize = 1 << 20;

/// A variable and its elements in the list.
#[derive(Clone, Debug)]
pub(super) struct ElementReference {
    pub(super) reference: u32,
    pub(super) begin: usize,
    len: usize,
    /// The standard has directional derivatives by it or of it in continuous time.
    pub(super) directional: bool,
}

impl ElementReference {
    pub(super) fn elements(&self) -> Range<usize> {
        self.begin..self.begin + self.len
    }
}

/// Some variables, and where their elements are in the list.
#[derive(Clone, Debug, Default)]
pub(super) struct SomeElements {
    pub(super) references: Vec<u32>,
    pub(super) elements: Vec<usize>,
}

impl SomeElements {
    fn directional(list: &[ElementReference]) -> Self {
        let some = || list.iter().filter(|place| place.directional);
        Self {
            references: some().map(|place| place.reference).collect(),
            elements: some().flat_map(ElementReference::elements).collect(),
        }
    }
    pub(super) fn of(&self, values: &[f64]) -> Vec<f64> {
        self.elements.iter().map(|i| values[*i]).collect()
    }
}

/// Value references, in the order of the table.
#[derive(Clone, Debug, Default)]
pub(super) struct ElementReferences {
    pub(super) parameters: Vec<ElementReference>,
    pub(super) inputs: Vec<u32>,
    /// Inputs that may be set in continuous time; others in event mode only.
    pub(super) continuous: SomeElements,
    pub(super) outputs: Vec<u32>,
}

/// What directional derivatives can be requested of (FMI 2.0, section 2.1.9; FMI 3.0, section 2.2.11): unknowns of the model structure.
/// Local variables are not among them, unless the structure has them.
#[derive(Clone, Debug, Default)]
pub(super) struct DirectionalUnknowns {
    pub(super) states: Vec<u32>,
    pub(super) rates: SomeElements,
    pub(super) outputs: SomeElements,
    pub(super) indicators: SomeElements,
    /// Outputs that are states: their derivatives are those of the states.
    pub(super) shown: Vec<(usize, usize)>,
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
pub(super) fn read(
    d: &Description,
) -> Result<(VariableTable, ElementReferences, DirectionalUnknowns), String> {
    let (mut table, mut places) = (VariableTable::default(), ElementReferences::default());
    let (mut inputs, mut outputs) = (Vec::new(), Vec::new());
    let structure = &d.structure;
    let mut unknowns: Vec<usize> = [&structure.outputs, &structure.derivatives, &structure.event_indicators]
        .into_iter()
        .flatten()
        .filter_map(|u| d.resolve(u.reference))
        .collect();
    unknowns.sort_unstable();
    let states = state_variables(d);
    let mut unknown = DirectionalUnknowns::default();
    let mut left = MAX_ELEMENTS;
    for (at, v) in d.variables.iter().enumerate() {
        if v.kind != VariableType::Float64 || v.variability == DescriptionVariability::Constant {
            continue;
        }
        let Some(count) = d.elements(v) else { continue };
        left = left.checked_sub(count).ok_or_else(|| {
            format!("`{}` has {count} elements; at most {MAX_ELEMENTS} of all variables can be taken: export the FMU with shorter arrays", v.name)
        })?;
        let tunable = v.variability == DescriptionVariability::Tunable && d.version == FmiVersion::V3;
        let continuous = v.variability == DescriptionVariability::Continuous;
        let (list, all, directional) = match v.causality {
            DescriptionCausality::Parameter => (&mut table.parameters, &mut places.parameters, tunable),
            DescriptionCausality::Input => (&mut table.inputs, &mut inputs, continuous),
            DescriptionCausality::Output | DescriptionCausality::Local => {
                (&mut table.outputs, &mut outputs, continuous && unknowns.binary_search(&at).is_ok())
            }
            _ => continue,
        };
        let mut place =
            ElementReference { reference: v.value_reference, begin: list.len(), len: count, directional };
        list.extend(element_quantities(d, v).unwrap_or_default());
        if let Some((_, first)) = states.iter().find(|(state, _)| *state == at) {
            unknown.shown.extend(place.elements().zip(*first..));
            place.directional = false;
        }
        all.push(place);
    }
    for (state, _) in &states {
        table.states.extend(element_quantities(d, &d.variables[*state]).unwrap_or_default());
    }
    let references = |all: &[ElementReference]| all.iter().map(|place| place.reference).collect();
    (places.inputs, places.outputs) = (references(&inputs), references(&outputs));
    places.continuous = SomeElements::directional(&inputs);
    let whole = |list: &[StructureUnknown]| {
        let variables: Option<Vec<_>> =
            list.iter().map(|u| d.resolve(u.reference).and_then(|at| d.variables.get(at))).collect();
        let variables = variables?;
        let count: Option<usize> = variables.iter().map(|v| d.elements(v)).sum();
        let references = variables.iter().map(|v| v.value_reference).collect();
        Some(SomeElements { references, elements: (0..count?).collect() })
    };
    if let Some(rates) = whole(&structure.derivatives).filter(|r| r.references.len() == states.len()) {
        unknown.states = states.iter().map(|(at, _)| d.variables[*at].value_reference).collect();
        unknown.rates = rates;
        unknown.outputs = SomeElements::directional(&outputs);
        unknown.indicators = whole(&structure.event_indicators).unwrap_or_default();
    }
    Ok((table, places, unknown))
}

/// States in their order: variable, number of its first element among all.
fn state_variables(d: &Description) -> Vec<(usize, usize)> {
    let mut first = 0;
    let of_rate = |u: &StructureUnknown| d.resolve(d.variables.get(d.resolve(u.reference)?)?.derivative?);
    let states = d.structure.derivatives.iter().filter_map(of_rate);
    let with_first = states.filter_map(|at| {
        let begin = first;
        first += d.elements(d.variables.get(at)?).unwrap_or(0);
        Some((at, begin))
    });
    with_first.collect()
}
