//! Variables and elements by the names that a user writes.

use trueup_fmi_description::description::{Description, DescriptionVariable};

use crate::mistake::suggestion;

/// What a name denotes: elements (variable, position in it), row by row, and their shape.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResolvedName {
    /// Variable and position in it, row by row.
    pub elements: Vec<(usize, usize)>,
    /// Empty for a scalar.
    pub shape: Vec<usize>,
}

/// Finds `gain`, an array `mass`, an element `mass[2]`. The array may be one of FMI 3.0, or one that FMI 2.0 flattens
/// into variables `mass[1]`, `mass[2]`.
///
/// # Errors
/// There is none, with the name that may have been meant.
pub fn find(d: &Description, name: &str) -> Result<ResolvedName, String> {
    if let Some(at) = d.position(name) {
        let shape = shape(d, &d.variables[at])?;
        let n = shape.iter().product();
        return Ok(ResolvedName { elements: (0..n).map(|i| (at, i)).collect(), shape });
    }
    if let Some(found) = flattened(d, name) {
        return Ok(found);
    }
    let unknown = || {
        let near = suggestion(name, d.variables.iter().map(|v| v.name.as_str()));
        format!("the FMU has no variable `{name}`{near}")
    };
    let (array, indices) = name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).ok_or_else(unknown)?;
    let (whole, first) = match d.position(array) {
        Some(at) => (shape(d, &d.variables[at])?, Some(at)),
        None => (flattened(d, array).ok_or_else(unknown)?.shape, None),
    };
    let outside =
        || format!("`{name}` is outside of `{array}`, whose size is {} (indices from 1)", size(&whole));
    let indices: Vec<usize> =
        indices.split(',').map(|i| i.trim().parse().map_err(|_| outside())).collect::<Result<_, _>>()?;
    if indices.len() != whole.len() || indices.iter().zip(&whole).any(|(i, n)| *i < 1 || i > n) {
        return Err(outside());
    }
    let (variable, element) = match first {
        Some(at) => (at, indices.iter().zip(&whole).fold(0, |at, (i, n)| at * n + i - 1)),
        None => (d.position(&indexed(array, &indices)).ok_or_else(unknown)?, 0),
    };
    Ok(ResolvedName { elements: vec![(variable, element)], shape: Vec::new() })
}

/// Lengths of the dimensions of a variable.
fn shape(d: &Description, v: &DescriptionVariable) -> Result<Vec<usize>, String> {
    let unknown = || format!("the size of `{}` is not known", v.name);
    // A size that no memory holds is no size.
    d.elements(v).filter(|n| *n < 1 << 22).and_then(|_| d.lengths(v)).ok_or_else(unknown)
}

/// An array of FMI 2.0.
fn flattened(d: &Description, name: &str) -> Option<ResolvedName> {
    let rank = (1..=3).find(|rank| d.position(&indexed(name, &vec![1; *rank])).is_some())?;
    let length = |k: usize| {
        let mut at = vec![1; rank];
        (1..)
            .take_while(|i| {
                at[k] = *i;
                d.position(&indexed(name, &at)).is_some()
            })
            .count()
    };
    let shape: Vec<usize> = (0..rank).map(length).collect();
    let n = shape.iter().product();
    let elements = (0..n).map(|i| Some((d.position(&indexed(name, &position(&shape, i)))?, 0)));
    Some(ResolvedName { elements: elements.collect::<Option<_>>()?, shape })
}

/// Indices from 1 of an element, counted row by row from 0.
fn position(shape: &[usize], mut element: usize) -> Vec<usize> {
    let mut at = vec![0; shape.len()];
    for (slot, n) in at.iter_mut().zip(shape).rev() {
        (*slot, element) = (element % n + 1, element / n);
    }
    at
}

fn indexed(name: &str, at: &[usize]) -> String {
    format!("{name}[{}]", at.iter().map(ToString::to_string).collect::<Vec<_>>().join(","))
}

/// Name of an element: `gain`, `mass[2]`, `inertia[1,2]`.
pub fn element(d: &Description, variable: usize, element: usize) -> String {
    let Some(v) = d.variables.get(variable) else { return String::new() };
    match shape(d, v) {
        Ok(shape) if !shape.is_empty() && !shape.contains(&0) => indexed(&v.name, &position(&shape, element)),
        _ => v.name.clone(),
    }
}

/// As [`element`], of a variable that was requested by its name, an alias of it, or an element of either: by the name
/// that was requested.
pub(crate) fn asked(d: &Description, name: &str, variable: usize, at: usize) -> String {
    let own = element(d, variable, at);
    let Some(v) = d.variables.get(variable) else { return own };
    let array = name.rsplit_once('[').map_or(name, |(array, _)| array);
    let is_alias = |n: &&str| **n != v.name && d.position(n) == Some(variable);
    match [name, array].iter().find(|n| is_alias(n)) {
        Some(alias) => format!("{alias}{}", own.strip_prefix(&v.name).unwrap_or_default()),
        None => own,
    }
}

/// `3`, `2 x 3`, `1` for a scalar.
pub(crate) fn size(shape: &[usize]) -> String {
    match shape {
        [] => "1".into(),
        _ => shape.iter().map(ToString::to_string).collect::<Vec<_>>().join(" x "),
    }
}

/// What a recorded element is called without its indices: all of it for an element that was requested by name.
pub(crate) fn stem<'a>(asked: &str, element: &'a str) -> &'a str {
    if asked.ends_with(']') { element } else { element.get(..asked.len()).unwrap_or(element) }
}
