//! FMI 3.0: arrays stay arrays; the structure names value references.

use trueup_fmi::table::{BoundaryType, Causality, ModelTable, Variability};

use super::error::WriteError;
use super::xml::DescriptionXml;
use super::{common, structure};
use crate::FmiVersion;

pub(super) fn write(table: &ModelTable, token: &str) -> Result<String, WriteError> {
    let mut x = DescriptionXml::new()?;
    x.open("fmiModelDescription", &common::root(table, FmiVersion::V3, token))?;

    let identifier = [("modelIdentifier", table.name.clone())];
    let common = common::yes([
        "canGetAndSetFMUState",
        "canSerializeFMUState",
        "providesDirectionalDerivatives",
        "providesAdjointDerivatives",
    ]);
    // An integrator that steps over an event gets it reported where the step ends.
    let completed_step = [("needsCompletedIntegratorStep", (table.indicators > 0).to_string())];
    x.element("ModelExchange", &[&identifier[..], &common, &completed_step].concat())?;
    let order = [("maxOutputDerivativeOrder", "1".to_owned())];
    let co_simulation = common::yes([
        "canHandleVariableCommunicationStepSize",
        "providesIntermediateUpdate",
        "mightReturnEarlyFromDoStep",
        "canReturnEarlyAfterIntermediateUpdate",
        "hasEventMode",
    ]);
    x.element("CoSimulation", &[&identifier[..], &common, &order, &co_simulation].concat())?;

    common::unit_definitions(&mut x, table)?;
    if !table.enumerations.is_empty() {
        x.group("TypeDefinitions")?;
        for (i, e) in table.enumerations.iter().enumerate() {
            x.open("EnumerationType", &[("name", e.name), ("description", e.description)])?;
            common::items(&mut x, table, i)?;
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

fn variables(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    let states = structure::states(table);
    x.group("ModelVariables")?;
    for (at, v) in table.variables.iter().enumerate() {
        let mut attributes = vec![
            ("name", v.name.clone()),
            ("valueReference", v.value_reference.to_string()),
            ("description", common::description(v)),
            ("causality", common::causality(v).to_owned()),
            ("variability", common::variability(v).to_owned()),
        ];
        attributes.extend(common::initial(v).map(|i| ("initial", i.to_owned())));
        let crosses = matches!(v.causality, Causality::Input | Causality::Output);
        if crosses && v.variability == Variability::Continuous {
            attributes.push(("intermediateUpdate", "true".to_owned()));
        }
        if let BoundaryType::Enumeration(i) = v.kind {
            attributes.push(("declaredType", table.enumerations[i].name.to_owned()));
        }
        attributes.extend(common::measure(v));
        attributes.extend(common::bounds(v));
        attributes.extend(
            v.nominal.filter(|_| v.kind == BoundaryType::Real).map(|n| ("nominal", format!("{n:?}"))),
        );
        if let Some((state, _)) = states.iter().find(|(_, rate)| *rate == at) {
            attributes.push(("derivative", table.variables[*state].value_reference.to_string()));
        }
        if !v.start.is_empty() {
            let start: Vec<String> = v.start.iter().map(|s| common::value(v.kind, *s)).collect();
            attributes.push(("start", start.join(" ")));
        }
        if states.iter().any(|(state, _)| *state == at) {
            attributes.push(("reinit", "true".to_owned()));
        }
        if v.dimensions.is_empty() {
            x.element(type_name(v.kind), &attributes)?;
        } else {
            x.open(type_name(v.kind), &attributes)?;
            for n in &v.dimensions {
                x.element("Dimension", &[("start", n.to_string())])?;
            }
            x.close()?;
        }
    }
    for k in 0..table.indicators {
        x.element(
            "Float64",
            &[
                ("name", ModelTable::indicator_name(k)),
                ("valueReference", table.indicator_reference(k).to_string()),
                ("description", "event indicator: an event takes place where it changes its sign".to_owned()),
                ("causality", "local".to_owned()),
                ("variability", "continuous".to_owned()),
                ("initial", "calculated".to_owned()),
            ],
        )?;
    }
    x.close()
}

fn type_name(kind: BoundaryType) -> &'static str {
    match kind {
        BoundaryType::Real => "Float64",
        BoundaryType::Boolean => "Boolean",
        BoundaryType::Integer => "Int32",
        BoundaryType::Enumeration(_) => "Enumeration",
    }
}

fn model_structure(x: &mut DescriptionXml, table: &ModelTable) -> Result<(), WriteError> {
    let states = structure::states(table);
    let is_output = |at: &usize| table.variables[*at].causality == Causality::Output;
    let outputs: Vec<usize> = (0..table.variables.len()).filter(is_output).collect();
    let rates: Vec<usize> = states.iter().map(|(_, rate)| *rate).collect();
    x.group("ModelStructure")?;
    for (name, unknowns) in [("Output", &outputs), ("ContinuousStateDerivative", &rates)] {
        for at in unknowns {
            let v = &table.variables[*at];
            let mut attributes = vec![("valueReference", v.value_reference.to_string())];
            if let Some(on) = of_array(table, *at)? {
                let references = on.iter().map(|at| table.variables[*at].value_reference.to_string());
                attributes.push(("dependencies", references.collect::<Vec<_>>().join(" ")));
                let kinds = structure::kinds(table, v, on.iter().copied());
                attributes.extend(kinds.map(|kinds| ("dependenciesKind", kinds)));
            }
            x.element(name, &attributes)?;
        }
    }
    for at in common::initial_unknowns(table, &states) {
        x.element("InitialUnknown", &[("valueReference", table.variables[at].value_reference.to_string())])?;
    }
    for k in 0..table.indicators {
        x.element("EventIndicator", &[("valueReference", table.indicator_reference(k).to_string())])?;
    }
    x.close()
}

/// What an array depends on: what any of its elements depends on.
fn of_array(table: &ModelTable, at: usize) -> Result<Option<Vec<usize>>, WriteError> {
    let v = &table.variables[at];
    let mut out = Vec::new();
    for e in 0..v.len() {
        match structure::dependencies(table, v, e)? {
            Some(on) => out.extend(on.into_iter().map(|(at, _)| at)),
            None => return Ok(None),
        }
    }
    out.sort_unstable();
    out.dedup();
    Ok(Some(out))
}
