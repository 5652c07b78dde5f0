//! `[columns]` of a sidecar and of a case, read.

use glob::Pattern;
use toml::de::{DeTable, DeValue};

use super::toml::{TomlNode, TomlReader};
use crate::columns::{ColumnMapping, ColumnRule, Columns};
use crate::finding::FindingKind;
use crate::keys;
use crate::names::{base_name, names_recording, suggestion};
use crate::unit::SignalUnit;
use crate::variable::{SignalVariable, VariableRole};

/// Whether a key under `[columns]` of a case names files: `"log_04*.csv"`.
fn names_files(key: &str, node: &TomlNode) -> bool {
    let named = key.contains(['*', '?']) || names_recording(key);
    let settings =
        |table: &DeTable| table.iter().all(|(k, _)| keys::COLUMNS.names().any(|n| n == k.get_ref()));
    named && node.get_ref().as_table().is_some_and(|table| table.is_empty() || !settings(table))
}

/// `[columns]` of a case with these recordings.
pub(crate) fn rules(
    reader: &mut TomlReader,
    table: &DeTable,
    recordings: &[&str],
    known: &[SignalVariable],
) -> Vec<ColumnRule> {
    let mut all = vec![ColumnRule { pattern: None, columns: Columns::new() }];
    for (key, node) in table.iter() {
        let name = key.get_ref().as_ref();
        let Some(inner) = node.get_ref().as_table().filter(|_| names_files(name, node)) else {
            all[0].columns.extend(mapping(reader, name, node, known).map(|m| (name.to_owned(), m)));
            continue;
        };
        let pattern = match Pattern::new(name) {
            Ok(pattern) => pattern,
            Err(e) => {
                let what = format!("`{name}` is no pattern of file names: {e}");
                reader.wrong(FindingKind::BadValue, key.span(), what, "write one such as \"log_04*.csv\"");
                continue;
            }
        };
        let matching: Vec<_> = recordings.iter().filter(|r| pattern.matches(r)).collect();
        if matching.is_empty() {
            let names: Vec<_> = recordings.iter().take(5).map(|r| format!("`{r}`")).collect();
            let what = format!("no recording of the case matches `{name}`");
            let mend = format!("correct the pattern (there is {}), or remove it", names.join(", "));
            reader.wrong(FindingKind::MissingFile, key.span(), what, mend);
        }
        let mut columns = Columns::new();
        for (key, node) in inner.iter() {
            let column = key.get_ref().as_ref();
            let twice =
                |r: &ColumnRule| matching.iter().any(|m| r.matches(m)) && r.columns.contains_key(column);
            if let Some(other) = all[1..].iter().find(|r| twice(r)) {
                let other = other.pattern.as_ref().map_or("", Pattern::as_str);
                let what =
                    format!("`{name}` and `{other}` both define the column `{column}` of one recording");
                reader.wrong(FindingKind::DuplicateName, key.span(), what, "make the patterns exclusive");
            }
            columns.extend(mapping(reader, column, node, known).map(|m| (column.to_owned(), m)));
        }
        all.push(ColumnRule { pattern: Some(pattern), columns });
    }
    all.retain(|rule| !rule.columns.is_empty());
    all
}

/// One entry of `[columns]`.
pub(crate) fn mapping(
    reader: &mut TomlReader,
    name: &str,
    node: &TomlNode,
    known: &[SignalVariable],
) -> Option<ColumnMapping> {
    let line = reader.line(&node.span());
    let file = reader.file.to_owned();
    let variable = Some(name.to_owned());
    let mut column = ColumnMapping { variable, scale: None, offset: 0.0, unit: None, file, line };
    let mut said = node.span();
    match node.get_ref() {
        DeValue::String(variable) => column.variable = Some(variable.to_string()),
        DeValue::Boolean(false) => column.variable = None,
        DeValue::Table(table) => {
            let what = format!("{}.{name}", keys::COLUMNS.of);
            reader.known(table, &what, keys::COLUMNS);
            if let Some(node) = table.get("variable") {
                column.variable = Some(reader.text(node, "variable")?);
                said = node.span();
            }
            column.scale = table.get("scale").and_then(|n| reader.number(n, "scale"));
            if column.scale == Some(0.0) {
                reader.wrong(
                    FindingKind::BadValue,
                    node.span(),
                    "`scale` is 0",
                    "write the factor to the unit",
                );
            }
            column.offset = table.get("offset").and_then(|n| reader.number(n, "offset")).unwrap_or(0.0);
            if let Some(node) = table.get("unit") {
                let text = reader.text(node, "unit")?;
                let Some(unit) = SignalUnit::parse(&text) else {
                    let mend = "write one such as rad, deg, rpm, mA, N.m, Nmm, ms, or none and a `scale`";
                    reader.wrong(
                        FindingKind::Unit,
                        node.span(),
                        format!("`{text}` is no unit known here"),
                        mend,
                    );
                    return None;
                };
                column.unit = Some((text, unit));
            }
        }
        _ => {
            let kind = node.get_ref().type_str();
            let mend = "write the variable's name in quotes, a table with `variable`, `scale`, `offset`, `unit`, \
                        or false to leave the column out";
            reader.wrong(FindingKind::BadValue, node.span(), format!("`{name}` is a {kind}"), mend);
            return None;
        }
    }
    let variable = column.variable.as_deref().unwrap_or("time");
    let names = || known.iter().filter(|v| v.role != VariableRole::Parameter).map(|v| v.name.as_str());
    // An array column of FMPy is named as a whole.
    if !known.is_empty() && variable != "time" && !names().any(|n| n == variable || base_name(n) == variable)
    {
        let mend = suggestion(variable, names(), "see `trueup fmu info`");
        reader.wrong(
            FindingKind::UnknownColumn,
            said,
            format!("the model has no input or output `{variable}`"),
            mend,
        );
    }
    Some(column)
}
