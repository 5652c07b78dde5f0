//! FMI 2.0: scalars only; the structure counts variables from 1.

use trueup_fmi::table::{BoundaryType, Causality, ModelTable, TableVariable};

use super::error::WriteError;
use super::xml::DescriptionXml;
use super::{common, structure};
use crate::FmiVersion;

pub(super) fn write(table: &ModelTable, token: &str) -> Result<String, WriteError> {
    let mut x = DescriptionXml::new()?;
    let mut root = common::root(table, FmiVersion::V2, token);
    root.push(("numberOfEventIndicators", table.indicators.to_string()));
    x.open("fmiModelDescription", &root)?;

    let identifier = [("modelIdentifier", table.name.clone())];
    let common =
        common::yes(["canGetAndSetFMUstate", "canSerializeFMUstate", "providesDirectionalDerivative"]);
    // An integrator that steps over an event gets it reported where the step ends.
    let model_exchange = [("completedIntegratorStepNotNeeded", (table.indicators == 0).to_string())];
    x.element("ModelExchange", &[&identifier[..], &model_exchange, &common].concat())?;
    let co_simulation = common::yes(["canHandleVariableCommunicationStepSize", "canInterpolateInputs"]);
    let order = [("maxOutputDerivativeOrder", "1".to_owned())];
    x.element("CoSimulation", &[&identifier[..], &co_simulation, &order, &common].concat())?;

    common::unit_definitions(&mut x, table)?;
    if !table.enumerations.is_empty() {
        x.group("TypeDefinitions")?;
        for (i, e) in table.enumerations.iter().enumerate() {
            x.open("SimpleType", &[("name", e.name), ("description", e.description)])?;
            x.group("Enumeration")?;
            common::items(&mut x, table, i)?;
            x.close()?;
            x.close()?;
        }
        x.close()?;
    }
    common::log_categories(&mut x)?;
    common::default_experiment(&mut x, table)?;
    variables(&mut x, table)?;
    model_structure(&mut x, table)?;
    x.finish()
}

/// 1-based index of each variable's first element.
fn first_indices(table: &ModelTable) -> Vec<usize> {
    let mut next = 1;
    let advance = |v: &TableVariable| {
        let first = next;
        next += v.len();
        first
    };
    table.variables.iter().map(advance).collect()
}

fn variables(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    let first = first_indices(table);
    let states = structure::states(table);
    x.group("ModelVariables")?;
    for (at, v) in table.variables.iter().enumerate() {
        let state = states.iter().find(|(_, rate)| *rate == at).map(|(state, _)| first[*state]);
        let is_state = states.iter().any(|(state, _)| *state == at);
        for e in 0..v.len() {
            let mut attributes = vec![
                ("name", v.element_name(e)),
                ("valueReference", (v.value_reference + e as u32).to_string()),
                ("description", common::description(v)),
                ("causality", common::causality(v).to_owned()),
                ("variability", common::variability(v).to_owned()),
            ];
            attributes.extend(common::initial(v).map(|i| ("initial", i.to_owned())));
            x.open("ScalarVariable", &attributes)?;
            let mut attributes = Vec::new();
            if let BoundaryType::Enumeration(i) = v.kind {
                attributes.push(("declaredType", table.enumerations[i].name.to_owned()));
            }
            attributes.extend(common::measure(v));
            attributes.extend(common::bounds(v));
            attributes.extend(
                v.nominal.filter(|_| v.kind == BoundaryType::Real).map(|n| ("nominal", format!("{n:?}"))),
            );
            attributes.extend(state.map(|first| ("derivative", (first + e).to_string())));
            attributes.extend(v.start.get(e).map(|s| ("start", common::value(v.kind, *s))));
            if is_state {
                attributes.push(("reinit", "true".to_owned()));
            }
            x.element(type_name(v.kind), &attributes)?;
            x.close()?;
        }
    }
    x.close()
}

fn type_name(kind: BoundaryType) -> &'static str {
    match kind {
        BoundaryType::Real => "Real",
        BoundaryType::Boolean => "Boolean",
        BoundaryType::Integer => "Integer",
        BoundaryType::Enumeration(_) => "Enumeration",
    }
}

fn model_structure(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    let first = first_indices(table);
    let states = structure::states(table);
    let outputs: Vec<usize> = (0..first.len()).filter(|at| is_output(&table.variables[*at])).collect();
    let rates: Vec<usize> = states.iter().map(|(_, rate)| *rate).collect();
    x.group("ModelStructure")?;
    for (name, unknowns) in [("Outputs", &outputs), ("Derivatives", &rates)] {
        if unknowns.is_empty() {
            continue;
        }
        x.group(name)?;
        for at in unknowns {
            let v = &table.variables[*at];
            for e in 0..v.len() {
                let mut attributes = vec![("index", (first[*at] + e).to_string())];
                if let Some(on) = structure::dependencies(table, v, e)? {
                    let indices: Vec<String> =
                        on.iter().map(|(at, e)| (first[*at] + e).to_string()).collect();
                    attributes.push(("dependencies", indices.join(" ")));
                    let kinds = structure::kinds(table, v, on.iter().map(|(at, _)| *at));
                    attributes.extend(kinds.map(|kinds| ("dependenciesKind", kinds)));
                }
                x.element("Unknown", &attributes)?;
            }
        }
        x.close()?;
    }
    let unknowns = common::initial_unknowns(table, &states);
    if !unknowns.is_empty() {
        x.group("InitialUnknowns")?;
        for at in unknowns {
            for e in 0..table.variables[at].len() {
                x.element("Unknown", &[("index", (first[at] + e).to_string())])?;
            }
        }
        x.close()?;
    }
    x.close()
}

fn is_output(v: &TableVariable) -> bool {
    v.causality == Causality::Output
}
