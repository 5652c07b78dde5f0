//! The sidecar of a recording: `<recording>.toml`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::de::DeTable;

use super::columns::mapping;
use super::parameters::parameters;
use super::toml::{TomlReader, text};
use crate::columns::{ColumnMapping, Columns};
use crate::finding::{Finding, FindingKind};
use crate::keys;
use crate::names::base_name;
use crate::recording::ChannelSettings;
use crate::value::ParameterValue;
use crate::variable::SignalVariable;

/// Its contents.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Sidecar {
    pub(crate) file: PathBuf,
    /// By the file's names.
    pub(crate) columns: Columns,
    /// By names of variables, with their lines.
    pub(crate) channels: BTreeMap<String, (ChannelSettings, u64)>,
    pub(crate) parameters: BTreeMap<String, ParameterValue>,
    /// Rows a second, in Hz, evenly spaced whatever the clock shows.
    pub(crate) rate: Option<f64>,
}

impl Sidecar {
    /// Its word on a column, by its own name or that of its array.
    pub(super) fn column(&self, name: &str) -> Option<&ColumnMapping> {
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
                if let Some(column) = mapping(reader, key.get_ref(), node, known) {
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
