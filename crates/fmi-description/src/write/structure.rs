//! Which elements each unknown depends on, from the table's declarations.

use trueup_fmi::table::{Causality, Depends, LinearFactor, ModelTable, Storage, TableVariable};

use super::error::WriteError;

/// Positions in the table: variable, element.
pub(super) type TableElement = (usize, usize);

/// The states: variables that a rate is the derivative of, in the order of the state vector.
/// Each with its rate.
pub(super) fn states(table: &ModelTable) -> Vec<(usize, usize)> {
    let position = |name: &str| table.variables.iter().position(|v| v.name == name);
    let mut out: Vec<(usize, usize)> = table
        .variables
        .iter()
        .enumerate()
        .filter_map(|(rate, v)| Some((position(v.derivative_of.as_deref()?)?, rate)))
        .collect();
    out.sort_by_key(|(_, rate)| match table.variables[*rate].storage {
        Storage::Rate(i) => i,
        _ => usize::MAX,
    });
    out
}

/// `dependenciesKind` for these dependencies, positions in the table; `None`: nothing is known of any, which is the meaning of its absence.
pub(super) fn kinds(
    table: &ModelTable,
    unknown: &TableVariable,
    on: impl Iterator<Item = usize>,
) -> Option<String> {
    let factors: Vec<_> = on.map(|at| unknown.depends.factor(&table.variables[at].name)).collect();
    let words = || factors.iter().map(|f| f.map_or("dependent", LinearFactor::word)).collect::<Vec<_>>();
    factors.iter().any(Option::is_some).then(|| words().join(" "))
}

/// What element `i` of this unknown depends on, ascending; `None`: on everything.
pub(super) fn dependencies(
    table: &ModelTable,
    unknown: &TableVariable,
    i: usize,
) -> Result<Option<Vec<TableElement>>, WriteError> {
    let (names, with_states) = match &unknown.depends {
        Depends::All => return Ok(None),
        Depends::On(names) => (names.iter().collect::<Vec<_>>(), false),
        Depends::StatesAnd(names) => (names.iter().collect(), true),
        Depends::Linear(terms) => (terms.iter().map(|(name, _)| name).collect(), false),
    };
    let all = |at: usize| (0..table.variables[at].len()).map(move |e| (at, e));
    let mut out = Vec::new();
    if with_states {
        out.extend(states(table).into_iter().flat_map(|(state, _)| all(state)));
    }
    for name in names {
        let known = |v: &TableVariable| {
            v.name == *name
                && (matches!(v.causality, Causality::Input | Causality::Independent)
                    || matches!(v.storage, Storage::State(_)))
        };
        let at = table.variables.iter().position(known).ok_or_else(|| WriteError::Name {
            variable: unknown.name.clone(),
            other: name.clone(),
            role: "input or state that it depends on",
        })?;
        if table.variables[at].len() == unknown.len() { out.push((at, i)) } else { out.extend(all(at)) }
    }
    out.sort_unstable();
    out.dedup();
    Ok(Some(out))
}
