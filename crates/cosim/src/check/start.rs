//! Start values: found, converted, compared with what the variable may be.

use std::collections::BTreeMap;
use std::sync::Arc;

use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, Initial, StartValues,
    VariableType,
};

use super::report::Report;
use super::{names, units};
use crate::buffer::{ValueBuffer, VariableBlock};
use crate::system::{StartValue, SystemComponent};
use crate::value;

/// What is set before initialization.
#[derive(Default)]
pub(super) struct Starts {
    pub(super) structural: Vec<VariableBlock>,
    pub(super) resized: Option<Arc<Description>>,
    pub(super) start: Vec<VariableBlock>,
}

/// Values of one variable in the making.
struct Making {
    values: ValueBuffer,
    /// Elements without a value yet.
    missing: Vec<bool>,
}

/// Structural parameters first, since they size the arrays.
pub(super) fn starts(component: &SystemComponent, d: &Description, report: &mut Report) -> Starts {
    let (mut skipped, mut starts) = (Vec::new(), Starts::default());
    let structural = |s: &&StartValue| {
        d.find(stem(&s.variable)).is_some_and(|v| v.causality == DescriptionCausality::StructuralParameter)
    };
    let (first, rest): (Vec<_>, Vec<_>) = component.start.iter().partition(structural);
    starts.structural = blocks(component, d, &first, report, &mut skipped);
    starts.resized = resized(d, &starts.structural).map(Arc::new);
    let d = starts.resized.as_deref().unwrap_or(d);
    starts.start = blocks(component, d, &rest, report, &mut skipped);
    if !skipped.is_empty() {
        report.note(format!(
            "values that match no variable of `{}` are left out: {}",
            component.name,
            skipped.join(", ")
        ));
    }
    starts
}

/// The name of the array.
fn stem(name: &str) -> &str {
    name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).map_or(name, |(stem, _)| stem)
}

/// The description with these structural parameters, if they change one.
fn resized(d: &Description, structural: &[VariableBlock]) -> Option<Description> {
    let mut resized = None;
    for block in structural {
        let wanted = block.references[0];
        let Some(at) = d.variables.iter().position(|v| v.value_reference == wanted) else { continue };
        let mut values = Vec::new();
        block.values.texts(&mut values);
        let start: Option<Vec<u64>> = values.iter().map(|t| t.parse().ok()).collect();
        let start = start.map(StartValues::Unsigned);
        if start.is_some() && start != d.variables[at].start {
            resized.get_or_insert_with(|| d.clone()).variables[at].start = start;
        }
    }
    resized
}

fn blocks(
    component: &SystemComponent,
    d: &Description,
    starts: &[&StartValue],
    report: &mut Report,
    skipped: &mut Vec<String>,
) -> Vec<VariableBlock> {
    let mut making: BTreeMap<usize, Making> = BTreeMap::new();
    for start in starts {
        match set(d, start, &mut making) {
            Ok(()) => {}
            Err(None) => skipped.push(start.variable.clone()),
            Err(Some(why)) => {
                report.wrong(&start.place, format!("start of {}: {why}", called(component, start)))
            }
        }
    }
    let mut blocks = Vec::new();
    for (variable, made) in making {
        let v = &d.variables[variable];
        if let Some(at) = made.missing.iter().position(|m| *m) {
            let name = names::element(d, variable, at);
            let place = starts.iter().rev().find(|s| stem(&s.variable) == v.name).map(|s| &s.place);
            report.wrong(
                place.unwrap_or(&component.place),
                format!("`{}` has no start values of its own; give all elements, also `{name}`", v.name),
            );
        }
        blocks.push(VariableBlock { references: vec![v.value_reference], values: made.values });
    }
    blocks
}

fn called(component: &SystemComponent, start: &StartValue) -> String {
    if component.name.is_empty() {
        format!("`{}`", start.variable)
    } else {
        format!("`{}.{}`", component.name, start.variable)
    }
}

/// `Err(None)`: there is no such variable, and there need not be one.
fn set(
    d: &Description,
    start: &StartValue,
    making: &mut BTreeMap<usize, Making>,
) -> Result<(), Option<String>> {
    let found = match names::find(d, &start.variable) {
        Err(_) if start.optional => return Err(None),
        found => found?,
    };
    let mut texts: Vec<&str> = start.values.iter().map(String::as_str).collect();
    let n = found.elements.len();
    let first = &d.variables
        [found.elements.first().ok_or_else(|| format!("`{}` has no elements", start.variable))?.0];
    if let ([single], true, true) = (&texts[..], n != 1, first.kind != VariableType::String) {
        texts = single.split(',').collect();
    }
    if texts.len() != n {
        let size = names::size(&found.shape);
        return Err(Some(format!("it has {size} elements, {} are given", texts.len())));
    }
    for ((variable, element), text) in found.elements.into_iter().zip(texts) {
        let v = &d.variables[variable];
        settable(d, v)?;
        let text = converted(d, v, start, text)?;
        let made = match making.entry(variable) {
            std::collections::btree_map::Entry::Occupied(made) => made.into_mut(),
            std::collections::btree_map::Entry::Vacant(slot) => {
                let n = d.elements(v).unwrap_or(1);
                let values = ValueBuffer::new(v.kind, d.version, n);
                let values = values.ok_or_else(|| format!("{} cannot be set", v.kind.name(d.version)))?;
                slot.insert(match value::start(d, v) {
                    Some(values) => Making { values, missing: vec![false; n] },
                    None => Making { values, missing: vec![true; n] },
                })
            }
        };
        value::assign(d, v, &mut made.values, element, &text)?;
        made.missing[element] = false;
        within(d, v, &made.values, element)?;
    }
    Ok(())
}

fn settable(d: &Description, v: &DescriptionVariable) -> Result<(), String> {
    let given = v.initial.is_some() && v.effective_initial() != Some(Initial::Calculated);
    let free = matches!(
        v.causality,
        DescriptionCausality::Parameter
            | DescriptionCausality::StructuralParameter
            | DescriptionCausality::Input
    );
    let known = v.kind != VariableType::Clock && v.kind != VariableType::Binary;
    // FMI 2.0: `initial` of an output or local variable counts, of a constant nothing.
    if v.variability != DescriptionVariability::Constant && (free || given) && known {
        return Ok(());
    }
    let what = match (v.causality, d.version) {
        _ if !known => format!("a {}", v.kind.name(d.version)),
        _ if v.variability == DescriptionVariability::Constant => "a constant".into(),
        (DescriptionCausality::CalculatedParameter, _) => "calculated from other parameters".into(),
        (DescriptionCausality::Output, _) => "an output, which the FMU computes".into(),
        (DescriptionCausality::Independent, _) => "the time".into(),
        (_, FmiVersion::V2 | FmiVersion::V3) => "computed by the FMU".into(),
    };
    Err(format!("it is {what} and cannot be set; set a parameter or an input"))
}

/// The text in the unit of the variable.
fn converted(
    d: &Description,
    v: &DescriptionVariable,
    start: &StartValue,
    text: &str,
) -> Result<String, String> {
    if start.unit.is_none() && start.linear.is_none() {
        return Ok(text.to_owned());
    }
    let own = units::of(d, v);
    let (mut factor, mut offset) = (1.0, 0.0);
    if let Some(given) = &start.unit {
        let known = match given.base {
            Some(_) => Some(given.clone()),
            None => units::named(d, own.as_ref(), &given.name),
        };
        let same = own.as_ref().is_some_and(|own| own.name == given.name);
        match (&own, known) {
            (Some(own), Some(given)) => {
                match units::conversion(&given, own, d.attributes(v).relative_quantity) {
                    units::Conversion::Same => {}
                    units::Conversion::By(f, o) | units::Conversion::Angle(f, o) => (factor, offset) = (f, o),
                    units::Conversion::Unknown => {
                        return Err(format!(
                            "it is given in {}, its own unit is {}, and neither unit is defined; define them, or give the value in {}",
                            given.name, own.name, own.name
                        ));
                    }
                    units::Conversion::Different => {
                        return Err(format!(
                            "its unit is {} ({}), the value is in {} ({})",
                            own.name,
                            units::dimension(own),
                            given.name,
                            units::dimension(&given)
                        ));
                    }
                }
            }
            (None, _) => {} // no unit: a plain number
            (Some(_), None) if same => {}
            (Some(own), None) => {
                let shown = own.display.iter().map(|u| u.name.as_str());
                let shown: Vec<&str> = std::iter::once(own.name.as_str()).chain(shown).collect();
                return Err(format!(
                    "the unit {} is not defined; define it (SSP: <Units>), or give the value in {}",
                    given.name,
                    shown.join(" or ")
                ));
            }
        }
    }
    let (f, o) = start.linear.unwrap_or((1.0, 0.0));
    (factor, offset) = (f * factor, f * offset + o);
    if (factor, offset) == (1.0, 0.0) {
        return Ok(text.to_owned());
    }
    let x: f64 = text.trim().parse().map_err(|_| format!("{text:?} is no number"))?;
    let y = factor * x + offset;
    // What was whole stays so: an integer takes no "3.0".
    Ok(if v.kind.is_float() { format!("{y:?}") } else { format!("{y}") })
}

fn within(d: &Description, v: &DescriptionVariable, values: &ValueBuffer, at: usize) -> Result<(), String> {
    let Some(x) = values.number(at) else { return Ok(()) };
    let attributes = d.attributes(v);
    let unit = attributes.unit.as_deref().unwrap_or_default();
    let outside = |what: &str, bound: f64| {
        Err(format!("{x:?} {unit} is {what} {bound:?} {unit}").replace("  ", " ").trim_end().to_owned())
    };
    match (attributes.min, attributes.max) {
        (Some(min), _) if x < min => outside("below its minimum", min),
        (_, Some(max)) if x > max => outside("above its maximum", max),
        _ => Ok(()),
    }
}
