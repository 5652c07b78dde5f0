//! Parameter sets (.ssv), mappings (.ssm), units, transformations.

use std::collections::{HashMap, HashSet};

use trueup_fmi_description::description::{BaseUnit, DescriptionUnit};

use super::xml::SspNode;
use crate::mistake::InputMistake;
use crate::system::StartValue;

type Result<T> = std::result::Result<T, InputMistake>;

/// Units by name, as a file defines them.
pub(super) fn units(root: SspNode) -> Result<HashMap<String, DescriptionUnit>> {
    let mut units = HashMap::new();
    for node in root.list("Units").filter(|n| n.name() == "Unit") {
        let name = node.required("name")?.to_owned();
        let base = node.child("BaseUnit").map(|b| -> Result<BaseUnit> {
            let mut exponents = [0; 8];
            for (slot, name) in exponents.iter_mut().zip(["kg", "m", "s", "A", "K", "mol", "cd", "rad"]) {
                *slot = b.value(name)?.unwrap_or(0);
            }
            let factor = b.number("factor")?.unwrap_or(1.0);
            if factor == 0.0 {
                return Err(b.wrong(format!("the factor of the unit {name} is 0")));
            }
            Ok(BaseUnit { exponents, factor, offset: b.number("offset")?.unwrap_or(0.0) })
        });
        let unit =
            DescriptionUnit { name: name.clone(), base: base.transpose()?, display: Vec::new(), line: 0 };
        units.insert(name, unit);
    }
    Ok(units)
}

/// The unit that an attribute names; of an undefined one the name alone.
pub(super) fn unit(node: SspNode, units: &HashMap<String, DescriptionUnit>) -> Option<DescriptionUnit> {
    let name = node.attribute("unit").filter(|n| !n.is_empty())?;
    let bare = || DescriptionUnit { name: name.to_owned(), base: None, display: Vec::new(), line: 0 };
    Some(units.get(name).cloned().unwrap_or_else(bare))
}

/// The parameters of a `ParameterSet`.
pub(super) fn set(root: SspNode) -> Result<Vec<StartValue>> {
    if root.name() != "ParameterSet" {
        return Err(root.wrong(format!("the element is `{}`, not `ParameterSet`", root.name())));
    }
    let units = units(root)?;
    let (mut starts, mut names) = (Vec::new(), HashSet::new());
    for parameter in root.list("Parameters").filter(|n| n.name() == "Parameter") {
        let name = parameter.required("name")?;
        if !names.insert(name) {
            return Err(parameter
                .wrong(format!("the parameter `{name}` is in this set already; take one of them out")));
        }
        let kinds = ["Dimension", "Annotations"];
        let Some(typed) = parameter.children().find(|n| !kinds.contains(&n.name())) else {
            return Err(parameter.wrong(format!("the parameter `{name}` has no value")));
        };
        let textual = matches!(typed.name(), "String" | "Enumeration" | "Binary");
        let several: Vec<String> = typed
            .children()
            .filter(|n| n.name() == "Value")
            .map(|n| n.attribute("value").or(n.node.text()).unwrap_or_default().to_owned())
            .collect();
        let values = match typed.attribute("value") {
            Some(text) if textual => vec![text.to_owned()],
            Some(text) => text.split_whitespace().map(str::to_owned).collect(),
            None if !several.is_empty() => several,
            None => return Err(typed.wrong(format!("the parameter `{name}` has no value"))),
        };
        starts.push(StartValue {
            variable: name.to_owned(),
            values,
            unit: unit(typed, &units),
            optional: true,
            place: parameter.place(),
            ..StartValue::default()
        });
    }
    Ok(starts)
}

/// What a connection or a mapping does to a value.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Transformation {
    pub(super) linear: Option<(f64, f64)>,
    pub(super) map: Vec<(String, String)>,
}

impl Transformation {
    /// The value after the map.
    pub(super) fn replaced(&self, text: &str) -> String {
        let plain = |x: &str| match x.trim() {
            "true" => "1".to_owned(),
            "false" => "0".to_owned(),
            other => other.to_owned(),
        };
        let entry = self.map.iter().find(|(from, _)| plain(from) == plain(text));
        entry.map_or(text, |(_, to)| to).to_owned()
    }
}

pub(super) fn transformation(node: SspNode) -> Result<Transformation> {
    let mut t = Transformation::default();
    for child in node.children() {
        match child.name() {
            "LinearTransformation" => {
                let (factor, offset) = (child.number("factor")?, child.number("offset")?);
                t.linear = Some((factor.unwrap_or(1.0), offset.unwrap_or(0.0)));
            }
            "BooleanMappingTransformation"
            | "IntegerMappingTransformation"
            | "EnumerationMappingTransformation" => {
                if !child.children().any(|n| n.name() == "MapEntry") {
                    return Err(child.wrong(format!(
                        "`{}` has no `MapEntry`: it maps nothing; write one for each value, or take it out",
                        child.name()
                    )));
                }
                for entry in child.children().filter(|n| n.name() == "MapEntry") {
                    t.map.push((entry.required("source")?.into(), entry.required("target")?.into()));
                }
            }
            _ => {}
        }
    }
    Ok(t)
}

/// The parameters under their new names: only those that the `ParameterMapping` lists; and what is left over on either side.
pub(super) fn mapped(root: SspNode, starts: &[StartValue]) -> Result<(Vec<StartValue>, Vec<String>)> {
    if root.name() != "ParameterMapping" {
        return Err(root.wrong(format!("the element is `{}`, not `ParameterMapping`", root.name())));
    }
    let by_name: HashMap<&str, &StartValue> = starts.iter().map(|s| (s.variable.as_str(), s)).collect();
    let (mut mapped, mut unknown) = (Vec::new(), Vec::new());
    let (mut used, mut targets) = (HashSet::new(), HashSet::new());
    for entry in root.children().filter(|n| n.name() == "MappingEntry") {
        let (source, target) = (entry.required("source")?, entry.required("target")?);
        let t = transformation(entry)?;
        let suppress = entry.flag("suppressUnitConversion")?;
        let Some(start) = by_name.get(source) else {
            unknown.push(source);
            continue;
        };
        used.insert(source);
        if !targets.insert(target) {
            return Err(entry.wrong(format!(
                "`{target}` is the target of an entry before this one; take one of them out"
            )));
        }
        mapped.push(StartValue {
            variable: target.to_owned(),
            values: start.values.iter().map(|v| t.replaced(v)).collect(),
            unit: start.unit.clone().filter(|_| !suppress),
            linear: t.linear.filter(|l| *l != (1.0, 0.0)),
            optional: true,
            place: start.place.clone(),
        });
    }
    let left: Vec<&str> = starts.iter().map(|s| s.variable.as_str()).filter(|n| !used.contains(n)).collect();
    let mut notes = Vec::new();
    let mut note = |names: &[&str], what: &str| {
        if !names.is_empty() {
            notes.push(format!("{}: {what}: {}", root.place(), names.join(", ")));
        }
    };
    note(
        &left,
        "values that this mapping does not name are left out; add an entry for each that is meant, or take the mapping out",
    );
    note(
        &unknown,
        "this mapping names parameters that the set does not have, they map nothing; look at their names",
    );
    Ok((mapped, notes))
}
