//! Names of variables and value references.

use std::collections::HashMap;

use super::finding::Findings;
use crate::FmiVersion;
use crate::description::{
    Description, DescriptionCausality, DescriptionVariability, DescriptionVariable, VariableType,
};

pub(super) fn check(d: &Description, f: &mut Findings) {
    let mut seen: HashMap<&str, u32> = HashMap::new();
    for v in &d.variables {
        for name in std::iter::once(&v.name).chain(v.aliases.iter().map(|a| &a.name)) {
            if let Some(other) = seen.insert(name, v.line) {
                f.error(
                    v.line,
                    format!("the name `{name}` is taken already by a variable in line {other}: rename one"),
                );
            }
            if name.is_empty() {
                f.error(v.line, "a variable has an empty name");
            } else if d.structured_names && !structured(name) {
                f.error(
                    v.line,
                    format!(
                        "`{name}` is no name of the structured naming convention: put parts with other signs \
                             in single quotes, or declare variableNamingConvention=\"flat\""
                    ),
                );
            } else if name.contains(['\n', '\r', '\t']) {
                f.error(v.line, format!("the name {name:?} has a line break or tab in it: remove it"));
            }
        }
    }
    references(d, f);
}

/// name = identifier | "der(" identifier ["," unsigned] ")"
fn structured(name: &str) -> bool {
    let inner = name.strip_prefix("der(").and_then(|n| n.strip_suffix(')'));
    match inner {
        None => identifier(name),
        Some(inner) => {
            let order = inner.rsplit_once(',').filter(|(_, order)| digits(order));
            identifier(inner) || order.is_some_and(|(state, _)| identifier(state))
        }
    }
}

fn digits(text: &str) -> bool {
    !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit())
}

/// identifier = part [indices] {"." part [indices]}; a part is a C name or anything in single quotes.
fn identifier(text: &str) -> bool {
    let mut rest = text;
    loop {
        let Some(after) = part(rest) else { return false };
        let Some(after) = indices(after) else { return false };
        if after.is_empty() {
            return true;
        }
        let Some(after) = after.strip_prefix('.') else { return false };
        rest = after;
    }
}

fn part(text: &str) -> Option<&str> {
    if let Some(quoted) = text.strip_prefix('\'') {
        let mut escaped = false;
        for (at, c) in quoted.char_indices() {
            match c {
                _ if escaped => escaped = false,
                '\\' => escaped = true,
                '\'' => return (at > 0).then(|| &quoted[at + 1..]),
                _ => {}
            }
        }
        return None;
    }
    let end = text.find(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).unwrap_or(text.len());
    let starts = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    starts.then(|| &text[end..])
}

fn indices(text: &str) -> Option<&str> {
    let Some(open) = text.strip_prefix('[') else { return Some(text) };
    let (inside, after) = open.split_once(']')?;
    inside.split(',').all(|i| digits(i.trim())).then_some(after)
}

fn references(d: &Description, f: &mut Findings) {
    // In FMI 2.0 each base type has value references of its own; enumerations are integers.
    let base = |v: &DescriptionVariable| match (d.version, v.kind) {
        (FmiVersion::V3, _) => VariableType::Float64,
        (FmiVersion::V2, VariableType::Enumeration) => VariableType::Int32,
        (FmiVersion::V2, kind) => kind,
    };
    let mut groups: HashMap<(VariableType, u32), Vec<&DescriptionVariable>> = HashMap::new();
    for v in &d.variables {
        groups.entry((base(v), v.value_reference)).or_default().push(v);
    }
    let mut shared: Vec<_> = groups.into_values().filter(|g| g.len() > 1).collect();
    shared.sort_by_key(|g| g.first().map(|v| v.line));
    for group in shared {
        let [first, others @ ..] = group.as_slice() else { continue };
        for v in others {
            let reference = v.value_reference;
            if d.version == FmiVersion::V3 {
                f.error(
                    v.line,
                    format!("variable `{}` has the value reference {reference} of `{}` (line {}): in FMI 3.0 every variable \
                             has its own; write an Alias element instead", v.name, first.name, first.line),
                );
                continue;
            }
            let pair =
                format!("variables `{}` and `{}` share the value reference {reference}", first.name, v.name);
            let constant = |v: &DescriptionVariable| v.variability == DescriptionVariability::Constant;
            if constant(first) != constant(v) {
                f.error(
                    v.line,
                    format!("{pair}, but only one of them is constant: give them different ones"),
                );
            }
            if d.attributes(first).unit != d.attributes(v).unit {
                f.error(v.line, format!("{pair}, but not the unit: give both the same unit"));
            }
        }
        if d.version == FmiVersion::V2 {
            aliases(f, &group);
        }
    }
}

/// Within one alias set of FMI 2.0.
fn aliases(f: &mut Findings, group: &[&DescriptionVariable]) {
    let settable: Vec<_> = group
        .iter()
        .filter(|v| {
            matches!(
                v.causality,
                DescriptionCausality::Parameter
                    | DescriptionCausality::Input
                    | DescriptionCausality::Independent
            )
        })
        .collect();
    if let [first, second, ..] = settable[..] {
        let reference = second.value_reference;
        f.error(
            second.line,
            format!(
                "`{}` and `{}` can both be set from outside but share the value reference {reference}: \
                     give them different ones",
                first.name, second.name
            ),
        );
        return;
    }
    let started: Vec<_> = group
        .iter()
        .filter(|v| v.start.is_some() && v.variability != DescriptionVariability::Constant)
        .collect();
    if let [first, second, ..] = started[..] {
        f.error(
            second.line,
            format!(
                "`{}` and `{}` share the value reference {} and both have a start value: only one may",
                first.name, second.name, second.value_reference
            ),
        );
    }
    let constants: Vec<_> =
        group.iter().filter(|v| v.variability == DescriptionVariability::Constant).collect();
    if let [first, others @ ..] = constants.as_slice()
        && let Some(other) = others.iter().find(|v| v.start != first.start)
    {
        f.error(
            other.line,
            format!(
                "the constants `{}` and `{}` share the value reference {} but not the start value",
                first.name, other.name, other.value_reference
            ),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::structured;

    #[test]
    fn structured_names() {
        for good in [
            "a",
            "_a1",
            "a.b",
            "a[1]",
            "a[1,2].b",
            "der(a)",
            "der(a[2])",
            "der(a.b,2)",
            "'a b'",
            "a.'+x'",
            r"'it\'s'",
        ] {
            assert!(structured(good), "{good}");
        }
        for bad in ["", "1a", "a b", "a..b", "a[]", "a[x]", "a.", "der(a)[1]", "der(a", "'open", "''", "a-b"]
        {
            assert!(!structured(bad), "{bad}");
        }
    }
}
