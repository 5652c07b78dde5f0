//! What is recorded.

use std::collections::HashMap;

use trueup_fmi_description::description::{DescriptionCausality, VariableType};

use super::names;
use super::parts::CheckedParts;
use super::report::Report;
use crate::plan::{ElementIndex, RecordedElement};
use crate::system::ComponentNames;
use crate::system::{CosimSystem, SourceSpan, VariablePort};

/// All outputs where nothing is requested.
pub(super) fn recorded(
    system: &CosimSystem,
    parts: &CheckedParts,
    report: &mut Report,
) -> Vec<RecordedElement> {
    let (mut list, mut columns): (Vec<RecordedElement>, HashMap<String, SourceSpan>) = Default::default();
    let known = ComponentNames::of(&system.components);
    let mut add =
        |column: String, from: ElementIndex, every: u32, place: &SourceSpan, report: &mut Report| {
            if let Some(before) = columns.insert(column.clone(), place.clone()) {
                return report.wrong(
                    place,
                    format!(
                        "the column `{column}` is there already, see {before}; name one of them with `as`"
                    ),
                );
            }
            list.push(RecordedElement { from, name: column, every: every.max(1) });
        };
    let all = |i: usize,
               every: u32,
               place: &SourceSpan,
               report: &mut Report,
               add: &mut dyn FnMut(String, ElementIndex, u32, &SourceSpan, &mut Report)| {
        let Some(part) = &parts.list[i] else { return };
        let d = part.d();
        let outputs = d.variables.iter().enumerate().filter(|(_, v)| {
            v.causality == DescriptionCausality::Output
                && !matches!(v.kind, VariableType::Binary | VariableType::Clock)
        });
        for (variable, v) in outputs {
            let Ok(found) = names::find(d, &v.name) else {
                report.wrong(place, format!("the size of `{}` is not known; name what to record", v.name));
                continue;
            };
            for (_, element) in found.elements {
                let name = names::element(d, variable, element);
                let column =
                    VariablePort { component: system.components[i].name.clone(), variable: name }.to_string();
                add(column, ElementIndex { component: i, variable, element }, every, place, report);
            }
        }
    };
    if system.record.is_empty() {
        for (i, component) in system.components.iter().enumerate() {
            all(i, 1, &component.place, report, &mut add);
        }
        return list;
    }
    for record in &system.record {
        let own = system.connectors.iter().find(|(own, ports)| *own == record.name && !ports.is_empty());
        let column = record.column.as_ref().or(own.map(|(name, _)| name));
        let Some(port) = own.map(|(_, ports)| ports[0].clone()).or_else(|| known.port(&record.name)) else {
            report.wrong(
                &record.place,
                format!("`{}` names no variable; write component.variable", record.name),
            );
            continue;
        };
        let Some((i, part)) = parts.find(&port, &record.place, report) else { continue };
        if port.variable == "*" {
            all(i, record.every, &record.place, report, &mut add);
            continue;
        }
        let d = part.d();
        let found = match names::find(d, &port.variable) {
            Ok(found) => found,
            Err(why) => {
                report.wrong(&record.place, format!("`{port}`: {why}"));
                continue;
            }
        };
        for (variable, element) in found.elements {
            let v = &d.variables[variable];
            if matches!(v.kind, VariableType::Binary | VariableType::Clock) {
                report.wrong(
                    &record.place,
                    format!("`{port}` is a {} and cannot be recorded", v.kind.name(d.version)),
                );
                break;
            }
            let name = names::asked(d, &port.variable, variable, element);
            // A new name denotes the whole; elements keep their indices.
            let column = match column {
                Some(new) => format!(
                    "{new}{}",
                    name.strip_prefix(names::stem(&port.variable, &name)).unwrap_or_default()
                ),
                None => VariablePort { component: port.component.clone(), variable: name }.to_string(),
            };
            add(
                column,
                ElementIndex { component: i, variable, element },
                record.every,
                &record.place,
                report,
            );
        }
    }
    list
}
