//! The model structure: complete, without duplicates, with dependencies that exist.

use std::collections::{BTreeSet, HashSet};

use super::finding::Findings;
use crate::FmiVersion;
use crate::description::{
    Description, DescriptionCausality, DescriptionVariability, Initial, StructureUnknown,
};

pub(super) fn check(d: &Description, f: &mut Findings) {
    let s = &d.structure;
    let states = states(d);
    let lists = [
        ("Outputs", &s.outputs),
        ("Derivatives", &s.derivatives),
        ("ClockedStates", &s.clocked_states),
        ("InitialUnknowns", &s.initial_unknowns),
        ("EventIndicators", &s.event_indicators),
    ];
    for (name, list) in lists {
        let mut seen = HashSet::new();
        for u in list {
            let Some(at) = d.resolve(u.reference) else {
                f.error(u.line, format!("ModelStructure, {name}: {} leads to no variable", u.reference));
                continue;
            };
            if !seen.insert(at) {
                f.error(
                    u.line,
                    format!("ModelStructure, {name}: `{}` is listed twice: remove one", d.variables[at].name),
                );
            }
            dependencies(d, f, u, name, &d.variables[at].name, &states);
        }
    }
    outputs(d, f);
    derivatives(d, f);
    initial_unknowns(d, f);
    for u in &s.event_indicators {
        if let Some(v) = d.resolve(u.reference).map(|at| &d.variables[at])
            && !(v.kind.is_float() && v.variability == DescriptionVariability::Continuous)
        {
            f.error(u.line, format!("event indicator `{}` must be a continuous Float64 or Float32", v.name));
        }
    }
}

fn dependencies(
    d: &Description,
    f: &mut Findings,
    u: &StructureUnknown,
    list: &str,
    name: &str,
    states: &BTreeSet<usize>,
) {
    let place = format!("ModelStructure, {list}, `{name}`");
    match (&u.dependencies, &u.kinds) {
        (None, Some(_)) => {
            f.error(u.line, format!("{place}: dependenciesKind without dependencies: write both"))
        }
        (Some(on), Some(kinds)) if on.len() != kinds.len() => f.error(
            u.line,
            format!("{place}: {} dependencies but {} kinds: one kind per dependency", on.len(), kinds.len()),
        ),
        _ => {}
    }
    let words: &[&str] = match (d.version, list) {
        (FmiVersion::V2, "InitialUnknowns") => &["dependent", "constant"],
        _ => &["dependent", "constant", "fixed", "tunable", "discrete"],
    };
    for kind in u.kinds.iter().flatten() {
        if !words.contains(&kind.as_str()) {
            f.error(
                u.line,
                format!("{place}: dependenciesKind \"{kind}\" is not one of {}", words.join(", ")),
            );
        }
    }
    let on = u.dependencies.as_deref().unwrap_or_default();
    if d.version == FmiVersion::V2 && on.windows(2).any(|w| w[0] >= w[1]) {
        f.warning(u.line, format!("{place}: the dependencies must be in ascending order, each once"));
    }
    for reference in on {
        let Some(at) = d.resolve(*reference) else {
            f.error(u.line, format!("{place}: the dependency {reference} leads to no variable"));
            continue;
        };
        let v = &d.variables[at];
        let unknown = matches!(v.causality, DescriptionCausality::Output)
            && v.initial != Some(Initial::Exact)
            && !states.contains(&at);
        if unknown {
            f.warning(
                u.line,
                format!("{place} depends on the output `{}`: name the inputs and states behind it", v.name),
            );
        }
    }
}

/// Continuous states, their rates, clocked states and discrete states.
fn states(d: &Description) -> BTreeSet<usize> {
    let rates = listed(d, &d.structure.derivatives);
    let continuous = rates.iter().filter_map(|at| d.resolve(d.variables[*at].derivative?));
    let discrete = d.variables.iter().enumerate().filter(|(_, v)| v.previous.is_some()).map(|(at, _)| at);
    let clocked = listed(d, &d.structure.clocked_states);
    continuous.chain(discrete).chain(clocked).chain(rates.iter().copied()).collect()
}

fn listed(d: &Description, list: &[StructureUnknown]) -> BTreeSet<usize> {
    list.iter().filter_map(|u| d.resolve(u.reference)).collect()
}

fn outputs(d: &Description, f: &mut Findings) {
    let listed = listed(d, &d.structure.outputs);
    for (at, v) in d.variables.iter().enumerate() {
        match (v.causality == DescriptionCausality::Output, listed.contains(&at)) {
            (true, false) => {
                f.error(v.line, format!("output `{}` is missing in ModelStructure, Outputs: add it", v.name))
            }
            (false, true) => f.error(
                v.line,
                format!(
                    "`{}` is listed in ModelStructure, Outputs, but its causality is not \"output\"",
                    v.name
                ),
            ),
            _ => {}
        }
    }
}

fn derivatives(d: &Description, f: &mut Findings) {
    let listed = listed(d, &d.structure.derivatives);
    for at in &listed {
        let v = &d.variables[*at];
        if v.derivative.is_none() {
            f.error(
                v.line,
                format!("`{}` is listed as a derivative in ModelStructure but has no `derivative`: name the state", v.name),
            );
        }
    }
    let missing =
        d.variables.iter().enumerate().find(|(at, v)| v.derivative.is_some() && !listed.contains(at));
    if let (Some(_), true, Some((_, v))) = (&d.model_exchange, listed.is_empty(), missing) {
        f.error(
            v.line,
            format!("`{}` is the derivative of a state, but ModelStructure lists no derivatives: Model Exchange would \
                     have no states", v.name),
        );
    }
}

fn initial_unknowns(d: &Description, f: &mut Findings) {
    let rates = listed(d, &d.structure.derivatives);
    let states = rates.iter().filter_map(|at| d.resolve(d.variables[*at].derivative?));
    let continuous: BTreeSet<usize> = rates.iter().copied().chain(states).collect();
    let indicators = listed(d, &d.structure.event_indicators);
    let found = listed(d, &d.structure.initial_unknowns);
    for (at, v) in d.variables.iter().enumerate() {
        let calculated = matches!(v.effective_initial(), Some(Initial::Calculated | Initial::Approx));
        let expected = v.causality == DescriptionCausality::CalculatedParameter
            || calculated && (v.causality == DescriptionCausality::Output || continuous.contains(&at));
        let clocked = !v.clocks.is_empty();
        match (expected, found.contains(&at)) {
            (true, false) if !clocked => f.error(
                v.line,
                format!("`{}` is calculated in initialization but missing in ModelStructure, InitialUnknowns: add it", v.name),
            ),
            (false, true) if indicators.contains(&at) => f.error(
                v.line,
                format!("event indicator `{}` must not be listed in ModelStructure, InitialUnknowns: remove it", v.name),
            ),
            (false, true) if !clocked => f.error(
                v.line,
                format!("`{}` does not belong into ModelStructure, InitialUnknowns (outputs, calculated parameters, states \
                         and their derivatives that are calculated): remove it", v.name),
            ),
            _ => {}
        }
    }
    let order: Vec<_> = d.structure.initial_unknowns.iter().map(|u| u.reference).collect();
    if d.version == FmiVersion::V2 && order.windows(2).any(|w| w[0] > w[1]) {
        let line = d.structure.initial_unknowns.first().map(|u| u.line);
        f.error(line, "ModelStructure, InitialUnknowns must be in the order of the variables: sort by index");
    }
}
