//! Reads `ports.toml`; the format is described in docs/ports.md.

use std::io::ErrorKind;
use std::ops::Range;
use std::path::Path;

use toml::Spanned;
use toml::de::{DeTable, DeValue};
use trueup_cosim::system::SourceSpan;
use trueup_cosim::{InputMistake, suggestion};
use trueup_signals::keys::Keys;

use crate::keys;
use crate::roles::{
    BODY_ROLES, FmuPorts, JOINT_ROLES, PortFigure, PortPlace, PortRole, PortSensor, PortVariable,
};

type PortsTomlValue<'i> = Spanned<DeValue<'i>>;

struct PortsReader<'a> {
    file: &'a Path,
    text: &'a str,
    ports: FmuPorts,
    mistakes: Vec<InputMistake>,
}

/// Reads a file.
///
/// # Errors
/// Every mistake with its line.
pub fn read(file: &Path) -> Result<FmuPorts, Vec<InputMistake>> {
    let fail =
        |message: String| vec![InputMistake { place: SourceSpan { file: file.into(), line: 0 }, message }];
    let unread = |e: std::io::Error| {
        let why = match e.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => "there is no such file".to_owned(),
            _ => format!("it cannot be read: {e}"),
        };
        fail(format!("{why}; name a ports.toml, `trueup ports FMU` drafts one"))
    };
    let bytes = std::fs::read(file).map_err(unread)?;
    let text = String::from_utf8(bytes).map_err(|_| fail("not UTF-8; save it as UTF-8".into()))?;
    parse(&text, file)
}

/// Reads a text of this file.
///
/// # Errors
/// Every mistake with its line.
pub fn parse(text: &str, file: &Path) -> Result<FmuPorts, Vec<InputMistake>> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = PortsReader { file, text, ports: FmuPorts::default(), mistakes: Vec::new() };
    let (root, errors) = DeTable::parse_recoverable(text);
    for error in errors.into_iter().take(5) {
        let what = error.message().replace('\n', "; ");
        reader.wrong(error.span().unwrap_or(0..0), format!("{what}; correct the TOML"));
    }
    // What comes after a syntax error is guesswork.
    if reader.mistakes.is_empty() {
        reader.root(root.get_ref());
    }
    if reader.mistakes.is_empty() { Ok(reader.ports) } else { Err(reader.mistakes) }
}

impl PortsReader<'_> {
    fn line(&self, span: &Range<usize>) -> u32 {
        SourceSpan::of(self.file, self.text, span.start).line
    }

    fn wrong(&mut self, span: Range<usize>, message: impl Into<String>) {
        let place = SourceSpan::of(self.file, self.text, span.start);
        self.mistakes.push(InputMistake { place, message: message.into() });
    }

    fn known(&mut self, table: &DeTable, what: &str, keys: Keys) {
        for (key, _) in table.iter() {
            let name = key.get_ref().as_ref();
            if !keys.names().any(|known| known == name) {
                let mend = suggestion(name, keys.names());
                let mend = if mend.is_empty() { "; remove it".to_owned() } else { mend };
                self.wrong(key.span(), format!("{what} has no `{name}`{mend}"));
            }
        }
    }

    fn table<'t, 'i>(&mut self, value: &'t PortsTomlValue<'i>, what: &str) -> Option<&'t DeTable<'i>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            let kind = value.get_ref().type_str();
            self.wrong(
                value.span(),
                format!("`{what}` is a table, no {kind}; write [{what}] and its keys below"),
            );
        }
        table
    }

    fn text(&mut self, value: &PortsTomlValue, key: &str) -> Option<String> {
        let text = value.get_ref().as_str().map(str::to_owned);
        if text.is_none() {
            let kind = value.get_ref().type_str();
            self.wrong(value.span(), format!("`{key}` is a {kind}; write a name in quotes"));
        }
        text
    }

    fn number(&mut self, value: &PortsTomlValue, key: &str) -> Option<f64> {
        let text = match value.get_ref() {
            DeValue::Integer(i) if i.radix() == 10 => Some(i.as_str()),
            DeValue::Float(f) => Some(f.as_str()),
            _ => None,
        };
        let number = text.and_then(|t| t.replace('_', "").parse::<f64>().ok());
        let good = number.filter(|x| x.is_finite() && *x != 0.0 && (key == "gearRatio" || *x > 0.0));
        if good.is_none() {
            let range = if key == "gearRatio" { "a number other than 0" } else { "a number above 0" };
            self.wrong(value.span(), format!("`{key}` is no such figure; write {range}"));
        }
        good
    }

    /// Entries in the order of the file.
    fn entries<'t, 'i>(
        table: &'t DeTable<'i>,
    ) -> Vec<(&'t Spanned<std::borrow::Cow<'i, str>>, &'t PortsTomlValue<'i>)> {
        let mut entries: Vec<_> = table.iter().collect();
        entries.sort_by_key(|(key, _)| key.span().start);
        entries
    }

    fn root(&mut self, root: &DeTable) {
        self.known(root, keys::PORTS.of, keys::PORTS);
        match root.get("fmu") {
            Some(value) => self.ports.fmu = self.text(value, "fmu").unwrap_or_default(),
            None => self.wrong(0..0, "there is no `fmu`; write fmu = \"<file>.fmu\" above the first [table]"),
        }
        if let Some(joints) = root.get("joint").and_then(|v| self.table(v, "joint")) {
            for (name, value) in Self::entries(joints) {
                self.place(PortPlace::Joint(name.get_ref().to_string()), value, keys::JOINT, JOINT_ROLES);
            }
        }
        for (place, keys) in [(PortPlace::Base, keys::BASE), (PortPlace::Tip, keys::TIP)] {
            if let Some(value) = root.get(place.table().as_str()) {
                self.place(place, value, keys, BODY_ROLES);
            }
        }
        if let Some(sensors) = root.get("sensors").and_then(|v| self.table(v, "sensors")) {
            for (name, value) in Self::entries(sensors) {
                self.sensor(name, value);
            }
        }
    }

    fn place(&mut self, place: PortPlace, value: &PortsTomlValue, keys: Keys, roles: &[PortRole]) {
        let title = place.table();
        let Some(table) = self.table(value, &title) else { return };
        self.known(table, &format!("[{title}]"), keys);
        for role in roles {
            let key = role.key();
            let Some(value) = table.get(key) else { continue };
            let lists = BODY_ROLES.contains(role);
            let found = match value.get_ref().as_array() {
                Some(list) if lists => {
                    list.iter().filter_map(|v| Some((self.text(v, key)?, v.span()))).collect()
                }
                None if !lists => {
                    self.text(value, key).map(|text| (text, value.span())).into_iter().collect()
                }
                _ => {
                    let mend =
                        if lists { format!("write {key} = [\"...\"]") } else { "write one name".into() };
                    self.wrong(value.span(), format!("`{key}` of [{title}] is of another form; {mend}"));
                    Vec::new()
                }
            };
            for (variable, span) in found {
                let line = self.line(&span);
                let variable =
                    PortVariable { place: place.clone(), role: *role, variable, reason: String::new(), line };
                self.ports.variables.push(variable);
            }
        }
        for key in ["gearRatio", "torqueConstant", "mass"] {
            let Some(value) = table.get(key).filter(|_| keys.names().any(|k| k == key)) else { continue };
            if let Some(value) = self.number(value, key) {
                self.ports.figures.push(PortFigure {
                    place: place.clone(),
                    key,
                    value,
                    reason: String::new(),
                });
            }
        }
        let (torque, current) = (table.get("torque"), table.get("current"));
        if let (PortPlace::Joint(_), Some(_), Some(current)) = (&place, torque, current) {
            self.wrong(
                current.span(),
                format!("[{title}] has a torque and a current; keep the one that drives the motor"),
            );
        }
    }

    fn sensor(&mut self, name: &Spanned<std::borrow::Cow<str>>, value: &PortsTomlValue) {
        let title = format!("sensors.\"{}\"", name.get_ref());
        let Some(table) = self.table(value, &title) else { return };
        self.known(table, &format!("[{title}]"), keys::SENSOR);
        let Some(kind) = table.get("kind") else {
            let mend = format!(
                "write kind = \"{}\" or another of {}",
                keys::SENSOR_KINDS[0],
                keys::SENSOR_KINDS.join(", ")
            );
            return self.wrong(name.span(), format!("[{title}] has no `kind`; {mend}"));
        };
        let span = kind.span();
        let Some(kind) = self.text(kind, "kind") else { return };
        if !keys::SENSOR_KINDS.contains(&kind.as_str()) {
            let mend = format!("write one of {}", keys::SENSOR_KINDS.join(", "));
            return self.wrong(span, format!("`{kind}` is no kind of sensor; {mend}"));
        }
        let line = self.line(&name.span());
        self.ports.sensors.push(PortSensor { variable: name.get_ref().to_string(), kind, line });
    }
}
