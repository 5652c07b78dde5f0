//! The sidecar of a recording: `<recording>.toml`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::de::{DeTable, DeValue};

use super::parameters::parameters;
use super::toml::{TomlNode, TomlReader, text};
use crate::finding::{Finding, FindingKind};
use crate::keys;
use crate::names::{base_name, suggestion};
use crate::recording::ChannelSettings;
use crate::unit::SignalUnit;
use crate::value::ParameterValue;
use crate::variable::{SignalVariable, VariableRole};

/// Its contents.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sidecar {
    pub(crate) file: PathBuf,
    /// By the file's names.
    pub(crate) columns: BTreeMap<String, SidecarColumn>,
    /// By names of variables, with their lines.
    pub(crate) channels: BTreeMap<String, (ChannelSettings, u64)>,
    pub(crate) parameters: BTreeMap<String, ParameterValue>,
    /// Rows a second, in Hz, evenly spaced whatever the clock shows.
    pub(crate) rate: Option<f64>,
}

/// What a column of the file is. Its value is `scale * reading + offset` in `unit`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SidecarColumn {
    /// `None`: it is to be left out.
    pub(crate) variable: Option<String>,
    pub(crate) scale: Option<f64>,
    pub(crate) offset: f64,
    pub(crate) unit: Option<(String, SignalUnit)>,
    pub(crate) line: u64,
}

impl SidecarColumn {
    /// What a reading gives, in `unit`.
    pub(super) fn value(&self, reading: f64) -> f64 {
        let value = self.scale.map_or(reading, |s| s * reading);
        if self.offset == 0.0 { value } else { value + self.offset }
    }
}

impl Sidecar {
    /// Its word on a column, by its own name or that of its array.
    pub(super) fn column(&self, name: &str) -> Option<&SidecarColumn> {
        self.columns.get(name).or_else(|| self.columns.get(base_name(name)))
    }

    /// The variable that a column measures: `None` if it is to be left out.
    pub(super) fn variable(&self, name: &str) -> Option<String> {
        match self.column(name) {
            None => Some(name.to_owned()),
            Some(column) => column.variable.as_ref().map(|v| match self.columns.contains_key(name) {
                true => v.clone(),
                false => format!("{v}{}", &name[base_name(name).len()..]),
            }),
        }
    }

    /// The one that belongs to `run.csv`: `run.toml` or `run.csv.toml`, but not `other`, which is something else. `None` if there
    /// is an error in it.
    pub(crate) fn beside(
        file: &Path,
        other: Option<&Path>,
        known: &[SignalVariable],
        findings: &mut Vec<Finding>,
    ) -> Option<Self> {
        let long = PathBuf::from(format!("{}.toml", file.display()));
        let short = file.with_extension("toml");
        // These have a meaning of their own.
        let reserved =
            ["case.toml", "key.toml"].iter().any(|name| short.ends_with(name)) || other == Some(&*short);
        let path = match (long.is_file(), short.is_file() && !reserved) {
            (false, false) => return Some(Self::default()),
            (true, false) => long,
            (false, true) => short,
            (true, true) => {
                let what = format!("{} has another sidecar, {}", file.display(), short.display());
                findings.push(Finding::error(FindingKind::DuplicateName, &long, what, "keep one of them"));
                return None;
            }
        };
        let text = text(&path, findings)?;
        Self::parse(&path, &text, known, findings)
    }

    pub(crate) fn parse(
        file: &Path,
        text: &str,
        known: &[SignalVariable],
        findings: &mut Vec<Finding>,
    ) -> Option<Self> {
        let before = findings.len();
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = TomlReader::new(file, text, findings);
        let mut sidecar = Self { file: file.into(), ..Self::default() };
        if let Some(root) = reader.parse(text) {
            sidecar.read(&mut reader, root.get_ref(), known);
        }
        (!findings[before..].iter().any(Finding::is_error)).then_some(sidecar)
    }

    fn read(&mut self, reader: &mut TomlReader, root: &DeTable, known: &[SignalVariable]) {
        reader.known(root, keys::SIDECAR.of, keys::SIDECAR);
        self.rate = root.get("rate").and_then(|n| reader.rate(n));
        if let Some(table) = root.get("columns").and_then(|n| reader.table(n, "columns")) {
            for (key, node) in table.iter() {
                if let Some(column) = column(reader, key.get_ref(), node, known) {
                    self.columns.insert(key.get_ref().to_string(), column);
                }
            }
        }
        if let Some(table) = root.get("channels").and_then(|n| reader.table(n, "channels")) {
            for (key, node) in table.iter() {
                let settings = reader.settings(node, key.get_ref());
                self.channels.insert(key.get_ref().to_string(), (settings, reader.line(&key.span())));
            }
        }
        if let Some(table) = root.get("parameters").and_then(|n| reader.table(n, "parameters")) {
            self.parameters = parameters(reader, table, known);
        }
    }
}

fn column(
    reader: &mut TomlReader,
    name: &str,
    node: &TomlNode,
    known: &[SignalVariable],
) -> Option<SidecarColumn> {
    let line = reader.line(&node.span());
    let mut column =
        SidecarColumn { variable: Some(name.to_owned()), scale: None, offset: 0.0, unit: None, line };
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
