//! TOML with the line of every mistake.

use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::finding::{Finding, FindingKind, MAX_REPORTED};
use crate::keys::{self, Keys};
use crate::names::{element_name, suggestion};
use crate::outlier::LARGEST;
use crate::recording::{ChannelSettings, Interpolation, PriorGuess};
use crate::value::ParameterValue;

/// A value with its place.
pub(crate) type TomlNode<'i> = Spanned<DeValue<'i>>;

/// Reads a file's text and reports mistakes.
pub(crate) struct TomlReader<'a> {
    pub(crate) file: &'a Path,
    /// Where each line starts.
    lines: Vec<usize>,
    pub(crate) findings: &'a mut Vec<Finding>,
}

/// The text of a file, or a finding.
pub(crate) fn text(file: &Path, findings: &mut Vec<Finding>) -> Option<String> {
    let fail = |kind, what: String, mend: &str| Finding::error(kind, file, what, mend);
    let wrong = match std::fs::read(file).map(String::from_utf8) {
        Ok(Ok(text)) => return Some(text),
        Ok(Err(_)) => fail(FindingKind::Encoding, "the file is not UTF-8".into(), "save it as UTF-8"),
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
            fail(FindingKind::MissingFile, "there is no such file or folder".into(), "name one that is there")
        }
        Err(e) => fail(FindingKind::MissingFile, e.to_string(), "make it a readable file"),
    };
    findings.push(wrong);
    None
}

impl<'a> TomlReader<'a> {
    pub(crate) fn new(file: &'a Path, text: &str, findings: &'a mut Vec<Finding>) -> Self {
        let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at + 1);
        Self { file, lines: std::iter::once(0).chain(breaks).collect(), findings }
    }

    /// The root table; `None` after a syntax error.
    pub(crate) fn parse<'t>(&mut self, text: &'t str) -> Option<Spanned<DeTable<'t>>> {
        let (root, errors) = DeTable::parse_recoverable(text);
        let (count, mut last) = (errors.len(), 0..0);
        for error in errors.into_iter().take(MAX_REPORTED) {
            last = error.span().unwrap_or(0..0);
            let what = error.message().replace('\n', "; ");
            self.wrong(FindingKind::Syntax, last.clone(), what, "correct the TOML");
        }
        if count > MAX_REPORTED {
            let what = format!("and {} more mistakes from here on", count - MAX_REPORTED);
            self.wrong(FindingKind::Syntax, last, what, "look whether the file is TOML at all");
        }
        (count == 0).then_some(root)
    }

    pub(crate) fn line(&self, span: &Range<usize>) -> u64 {
        self.lines.partition_point(|start| *start <= span.start) as u64
    }

    pub(crate) fn wrong(
        &mut self,
        kind: FindingKind,
        span: Range<usize>,
        what: impl Into<String>,
        mend: impl Into<String>,
    ) {
        let line = self.line(&span);
        self.findings.push(Finding::error(kind, self.file, what, mend).line(line));
    }

    pub(crate) fn warn(
        &mut self,
        kind: FindingKind,
        span: Range<usize>,
        what: impl Into<String>,
        mend: impl Into<String>,
    ) {
        let line = self.line(&span);
        self.findings.push(Finding::warning(kind, self.file, what, mend).line(line));
    }

    /// Reports keys of `what` that are none of these.
    pub(crate) fn known(&mut self, table: &DeTable, what: &str, keys: Keys) {
        for (key, _) in table.iter() {
            let name = key.get_ref().as_ref();
            if !keys.names().any(|known| known == name) {
                let mend = suggestion(name, keys.names(), "remove it");
                self.wrong(FindingKind::UnknownKey, key.span(), format!("{what} has no `{name}`"), mend);
            }
        }
    }

    pub(crate) fn table<'t, 'i>(&mut self, node: &'t TomlNode<'i>, what: &str) -> Option<&'t DeTable<'i>> {
        let table = node.get_ref().as_table();
        if table.is_none() {
            let kind = node.get_ref().type_str();
            let mend = format!("write [{what}] and its keys below");
            self.wrong(FindingKind::BadValue, node.span(), format!("`{what}` is a table, no {kind}"), mend);
        }
        table
    }

    pub(crate) fn text(&mut self, node: &TomlNode, what: &str) -> Option<String> {
        let text = node.get_ref().as_str().map(str::to_owned);
        if text.is_none() {
            let kind = node.get_ref().type_str();
            self.wrong(
                FindingKind::BadValue,
                node.span(),
                format!("`{what}` is a {kind}"),
                "write a text in quotes",
            );
        }
        text
    }

    /// A list of texts.
    pub(crate) fn texts(&mut self, node: &TomlNode, what: &str) -> Vec<(String, Range<usize>)> {
        let Some(list) = node.get_ref().as_array() else {
            let kind = node.get_ref().type_str();
            let mend = format!("write {what} = [\"...\"]");
            self.wrong(FindingKind::BadValue, node.span(), format!("`{what}` is a {kind}, no list"), mend);
            return Vec::new();
        };
        let mut texts = Vec::new();
        for node in list.iter() {
            texts.extend(self.text(node, what).map(|t| (t, node.span())));
        }
        texts
    }

    /// A finite number, no larger than any quantity is.
    pub(crate) fn number(&mut self, node: &TomlNode, what: &str) -> Option<f64> {
        let number = scalar(node.get_ref());
        if number.is_none() {
            let kind = node.get_ref().type_str();
            let what = format!("`{what}` is a {kind} that is no finite number");
            self.wrong(FindingKind::BadValue, node.span(), what, "write a number such as 3.07e-5");
        }
        let large = number.filter(|x| x.abs() > LARGEST);
        if let Some(x) = large {
            let what = format!("`{what}` is {x:e}: no quantity is as large");
            self.wrong(FindingKind::BadValue, node.span(), what, "write its value in SI");
        }
        number.filter(|_| large.is_none())
    }

    /// A number >= 0.
    fn positive(&mut self, node: &TomlNode, what: &str) -> Option<f64> {
        let number = self.number(node, what)?;
        if number < 0.0 {
            self.wrong(
                FindingKind::BadValue,
                node.span(),
                format!("`{what}` is {number}"),
                "it cannot be below 0",
            );
            return None;
        }
        // Its square is divided by.
        if number != 0.0 && number < 1.0 / LARGEST {
            let what = format!("`{what}` is {number:e}: no sensor is as good");
            self.wrong(FindingKind::BadValue, node.span(), what, "write it in the channel's unit, or 0");
            return None;
        }
        Some(number)
    }

    /// Rows a second.
    pub(crate) fn rate(&mut self, node: &TomlNode) -> Option<f64> {
        let rate = self.number(node, "rate")?;
        if !(1.0 / LARGEST..).contains(&rate) {
            let what = format!("`rate` is {rate}");
            self.wrong(
                FindingKind::BadValue,
                node.span(),
                what,
                "write how many rows there are a second, in Hz",
            );
            return None;
        }
        Some(rate)
    }

    /// What is known of a channel.
    pub(crate) fn settings(&mut self, node: &TomlNode, name: &str) -> ChannelSettings {
        let what = format!("{}.{name}", keys::CHANNELS.of);
        let mut settings = ChannelSettings::default();
        let Some(table) = self.table(node, &what) else { return settings };
        self.known(table, &what, keys::CHANNELS);
        for (key, node) in table.iter() {
            let span = node.span();
            match key.get_ref().as_ref() {
                "resolution" => settings.resolution = self.positive(node, "resolution"),
                "noise" => settings.noise = self.positive(node, "noise"),
                "delay" if is_number(node.get_ref()) => settings.delay = self.number(node, "delay"),
                "delay" => {
                    settings.late = self.guess(node, &what, ("delay", 0.0, "delay"));
                    settings.delay = settings.late.map(|g| g.value);
                }
                "offset" => settings.offset = self.guess(node, &what, ("offset", 0.0, "offset")),
                "gain" => settings.gain = self.guess(node, &what, ("gain", 1.0, "scale")),
                "interpolation" => match node.get_ref().as_str() {
                    Some("linear") => settings.interpolation = Some(Interpolation::Linear),
                    Some("hold") => settings.interpolation = Some(Interpolation::Hold),
                    _ => self.wrong(
                        FindingKind::BadValue,
                        span,
                        format!("`interpolation` of {what} is not known"),
                        "write \"linear\" or \"hold\"",
                    ),
                },
                _ => {}
            }
        }
        settings
    }

    /// A figure of a sensor that is to be estimated; `neutral` is what it has where nothing is known, `known` the key of a column
    /// for one that is known.
    fn guess(
        &mut self,
        node: &TomlNode,
        what: &str,
        (key, neutral, known): (&str, f64, &str),
    ) -> Option<PriorGuess> {
        if node.get_ref().as_str() == Some("estimate") {
            return Some(PriorGuess { value: neutral, doubt: None });
        }
        let Some(table) = node.get_ref().as_table() else {
            let known = match key {
                "delay" => "one that is known is a number of seconds".to_owned(),
                _ => {
                    format!("one that is known is given as `{known}` in [columns] of the recording's sidecar")
                }
            };
            let mend = format!(
                "write {key} = \"estimate\" or {key} = {{ value = {neutral:?}, doubt = 0.1 }}; {known}"
            );
            let what = format!("`{key}` of {what} is neither \"estimate\" nor a value with a `doubt`");
            self.wrong(FindingKind::BadValue, node.span(), what, mend);
            return None;
        };
        self.known(table, &format!("{key} of {what}"), keys::GUESS);
        let value = table.get("value").map_or(Some(neutral), |n| self.number(n, "value"))?;
        let doubt = match table.get("doubt") {
            Some(n) => Some(self.positive(n, "doubt")?),
            None => None,
        };
        if key == "gain" && value == 0.0 {
            let what = format!("`gain` of {what} is 0: such a sensor shows nothing");
            self.wrong(
                FindingKind::BadValue,
                node.span(),
                what,
                "leave its column out by `false` in [columns]",
            );
            return None;
        }
        Some(PriorGuess { value, doubt })
    }

    /// A value of [parameters], arrays as one entry per element, with its line.
    pub(crate) fn values(
        &mut self,
        name: &str,
        node: &TomlNode,
    ) -> Vec<(String, ParameterValue, Range<usize>)> {
        let mut all = Vec::new();
        self.elements(name, node, &mut Vec::new(), &mut all);
        all
    }

    fn elements(
        &mut self,
        name: &str,
        node: &TomlNode,
        indices: &mut Vec<usize>,
        all: &mut Vec<(String, ParameterValue, Range<usize>)>,
    ) {
        let full = || if indices.is_empty() { name.to_owned() } else { element_name(name, indices) };
        let value = match node.get_ref() {
            DeValue::Boolean(b) => Some(ParameterValue::Boolean(*b)),
            DeValue::String(s) => Some(ParameterValue::Text(s.to_string())),
            DeValue::Array(list) => {
                for (i, node) in list.iter().enumerate() {
                    indices.push(i + 1);
                    self.elements(name, node, indices, all);
                    indices.pop();
                }
                return;
            }
            _ => self.number(node, &full()).map(ParameterValue::Number),
        };
        all.extend(value.map(|v| (full(), v, node.span())));
    }
}

fn is_number(value: &DeValue) -> bool {
    matches!(value, DeValue::Integer(_) | DeValue::Float(_))
}

/// A finite number.
fn scalar(value: &DeValue) -> Option<f64> {
    let text = match value {
        DeValue::Integer(i) if i.radix() == 10 => i.as_str(),
        DeValue::Float(f) => f.as_str(),
        _ => return None,
    };
    text.replace('_', "").parse().ok().filter(|x: &f64| x.is_finite())
}
