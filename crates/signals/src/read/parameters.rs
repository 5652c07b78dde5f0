//! Values and standard deviations of parameters: names, shapes, types and ranges against the model's variables.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

use super::toml::{TomlNode, TomlReader};
use crate::finding::FindingKind;
use crate::names::{base_name, suggestion};
use crate::value::ParameterValue;
use crate::variable::{SignalVariable, Takes, VariableRole};

/// An element's name, its value and its place.
type GivenElement = (String, ParameterValue, Range<usize>);

/// A table of parameters, arrays element by element; what does not fit the model's variables is reported and left out.
pub(crate) fn parameters(
    reader: &mut TomlReader,
    table: &DeTable,
    known: &[SignalVariable],
) -> BTreeMap<String, ParameterValue> {
    let mut all = BTreeMap::new();
    for (key, node) in table.iter() {
        let name = key.get_ref().as_ref();
        let Some(family) = family(reader, name, node, known) else { continue };
        let values = reader.values(name, node);
        if !known.is_empty() && !fits(reader, name, node, &family, &values) {
            continue;
        }
        for (element, value, span) in values {
            let variable = family.iter().find(|v| v.name == element);
            if let Some((what, mend)) = variable.and_then(|v| wrong(v, &value)) {
                reader.wrong(FindingKind::BadValue, span, what, mend);
            } else if all.insert(element.clone(), value).is_some() {
                let what = format!("`{element}` has two values");
                reader.wrong(
                    FindingKind::DuplicateName,
                    span,
                    what,
                    "give the array or its elements, not both",
                );
            }
        }
    }
    all
}

/// A table of relative standard deviations; one number may be given for all elements of an array.
pub(crate) fn doubts(
    reader: &mut TomlReader,
    table: &DeTable,
    known: &[SignalVariable],
) -> BTreeMap<String, f64> {
    let mut all = BTreeMap::new();
    for (key, node) in table.iter() {
        let name = key.get_ref().as_ref();
        let Some(family) = family(reader, name, node, known) else { continue };
        let values = reader.values(name, node);
        let for_all = node.get_ref().as_array().is_none();
        if !known.is_empty() && !for_all && !fits(reader, name, node, &family, &values) {
            continue;
        }
        for (element, value, span) in values {
            match value {
                ParameterValue::Number(doubt) if doubt >= 0.0 => {
                    all.insert(element, doubt);
                }
                _ => {
                    let what = format!("the uncertainty of `{element}` is {value}");
                    let mend = "write a share such as 0.1 for 10 %, or 0 for a value that is known";
                    reader.wrong(FindingKind::BadValue, span, what, mend);
                }
            }
        }
    }
    all
}

/// The variables of this name, be it a scalar's, an array's or an element's; `None`, and a word, if there is none.
fn family<'v>(
    reader: &mut TomlReader,
    name: &str,
    node: &TomlNode,
    known: &'v [SignalVariable],
) -> Option<Vec<&'v SignalVariable>> {
    let is = |v: &&SignalVariable| v.name == name || base_name(&v.name) == name;
    // A state of an FMU is both: what is recorded, and the parameter that is its start value.
    let (family, others): (Vec<_>, Vec<_>) =
        known.iter().filter(is).partition(|v| v.role == VariableRole::Parameter);
    match others.first() {
        _ if known.is_empty() || !family.is_empty() => Some(family),
        Some(_) => {
            let what = format!("`{name}` is an input or output, no parameter");
            reader.wrong(FindingKind::UnknownParameter, node.span(), what, "remove it");
            None
        }
        None => {
            let names = known.iter().filter(|v| v.role == VariableRole::Parameter);
            let mend = suggestion(name, names.map(|v| v.name.as_str()), "see `trueup fmu info`");
            let what = format!("the model has no parameter `{name}`");
            reader.wrong(FindingKind::UnknownParameter, node.span(), what, mend);
            None
        }
    }
}

/// Whether a value has the shape of its variable: a scalar is no list, a list has all elements.
fn fits(
    reader: &mut TomlReader,
    name: &str,
    node: &TomlNode,
    family: &[&SignalVariable],
    values: &[GivenElement],
) -> bool {
    let scalar = family.iter().any(|v| v.name == name);
    let list = matches!(node.get_ref(), DeValue::Array(_));
    let same = family.len() == values.len() && family.iter().all(|v| values.iter().any(|g| g.0 == v.name));
    let shown = |value: Option<&GivenElement>, takes: Takes| match (value, takes) {
        (Some((_, value @ ParameterValue::Number(_), _)), _) => value.to_string(),
        (_, Takes::Boolean) => "true".to_owned(),
        (_, Takes::Item) => "\"...\"".to_owned(),
        _ => "1.0".to_owned(),
    };
    let first = shown(values.first(), family.first().map_or(Takes::Number, |v| v.takes));
    let (what, mend) = match (scalar, list) {
        (true, false) => return true,
        (true, true) => {
            (format!("`{name}` is a list, the model has one value of it"), format!("write {name} = {first}"))
        }
        (false, true) if same => return true,
        // The mistakes of its elements are reported already.
        (false, true) if values.is_empty() && !node.get_ref().as_array().is_some_and(|a| a.is_empty()) => {
            return false;
        }
        (false, _) => {
            let what = if list { "a list of another shape" } else { "one value" };
            let mut names = family.iter().map(|v| v.name.as_str());
            let (least, most) = (names.clone().next().unwrap_or(name), names.next_back().unwrap_or(name));
            (
                format!("`{name}` is {what}, the model has {} elements: {least} to {most}", family.len()),
                format!(
                    "write {name} = {}, or single elements as \"{least}\" = {first}",
                    shape(family, &first)
                ),
            )
        }
    };
    reader.wrong(FindingKind::BadValue, node.span(), what, mend);
    false
}

/// How an array is written that has these elements: `[1.0, ..]`, `[[1.0, ..], ..]`.
fn shape(family: &[&SignalVariable], value: &str) -> String {
    let last = family.last().map_or("", |v| v.name.as_str());
    let index = last[base_name(last).len()..].trim_matches(['[', ']']);
    let lengths: Vec<usize> = index.split(',').filter_map(|i| i.parse().ok()).collect();
    let row = |n: usize| vec![value; n.min(8)].join(", ");
    match lengths[..] {
        [n] => format!("[{}]", row(n)),
        [n, m] => format!("[{}]", vec![format!("[{}]", row(m)); n.min(8)].join(", ")),
        _ => format!("[{value}, ..]"),
    }
}

/// A value that its variable cannot have, and the remedy.
fn wrong(v: &SignalVariable, value: &ParameterValue) -> Option<(String, String)> {
    let name = &v.name;
    let is = match value {
        ParameterValue::Number(_) => "a number",
        ParameterValue::Boolean(_) => "a truth value",
        ParameterValue::Text(_) => "a text",
    };
    let (wanted, mend) = match (v.takes, value) {
        (Takes::Number, ParameterValue::Number(x)) => return outside(v, *x),
        (Takes::Boolean, ParameterValue::Boolean(_))
        | (Takes::Item, ParameterValue::Text(_))
        | (Takes::Anything, _) => {
            return None;
        }
        (Takes::Number, _) => ("a number", format!("write {name} = 1.0 with its value, without quotes")),
        (Takes::Boolean, _) => ("true or false", format!("write {name} = true or {name} = false")),
        (Takes::Item, _) => {
            ("the name of a choice", format!("write {name} = \"...\", see `trueup fmu info`"))
        }
    };
    Some((format!("`{name}` is {is}, {value}, where {wanted} is required"), mend))
}

fn outside(v: &SignalVariable, x: f64) -> Option<(String, String)> {
    let SignalVariable { name, unit, .. } = v;
    let unit = if unit.is_empty() || unit == "1" { String::new() } else { format!(" {unit}") };
    let told =
        |what: String| Some((format!("`{name}` is {x}{unit}, {what}"), "give its value in that unit".into()));
    if v.positive && x <= 0.0 {
        let mend = format!(
            "give the {name} of the real system{}, or remove the line to take the preset's",
            unit_of(&unit)
        );
        return Some((format!("`{name}` is {x}: it has to be above 0"), mend));
    }
    match (v.min.filter(|m| x < *m), v.max.filter(|m| x > *m)) {
        (Some(min), _) => told(format!("it cannot be below {min}")),
        (_, Some(max)) => told(format!("it cannot be above {max}")),
        _ => None,
    }
}

fn unit_of(unit: &str) -> String {
    if unit.is_empty() { String::new() } else { format!(" in{unit}") }
}
