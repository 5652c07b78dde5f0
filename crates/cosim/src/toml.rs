//! Systems as TOML; the format is described in docs/systems.md.

use std::ops::Range;
use std::path::{Path, PathBuf};

use ::toml::Spanned;
use ::toml::de::{DeTable, DeValue};
use trueup_fmi_description::description::DescriptionUnit;
use trueup_signals::keys::Keys;

use crate::error::CosimError;
use crate::keys;
use crate::mistake::{InputMistake, suggestion};
use crate::system::{
    ComponentNames, Connection, CosimSystem, InputFile, RecordedVariable, RunSettings, SourceSpan,
    StartValue, SystemComponent, VariablePort,
};

type TomlValue<'i> = Spanned<DeValue<'i>>;

/// Reads a file. Paths in it are relative to its folder.
///
/// # Errors
/// [`CosimError::System`] with every mistake and its line.
pub(crate) fn read(file: &Path) -> Result<CosimSystem, CosimError> {
    let fail = |message: String| {
        CosimError::System(vec![InputMistake { place: SourceSpan { file: file.into(), line: 0 }, message }])
    };
    let bytes = std::fs::read(file)
        .map_err(|e| fail(format!("{e}; name a system's file, see docs/systems.md, or an FMU")))?;
    let text = String::from_utf8(bytes).map_err(|_| fail("not UTF-8; save it as UTF-8".into()))?;
    parse(&text, file)
}

/// Reads a text of this file.
pub(crate) fn parse(text: &str, file: &Path) -> Result<CosimSystem, CosimError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let breaks = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at + 1);
    let lines = std::iter::once(0).chain(breaks).collect();
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut reader = SystemTomlReader { file, folder, lines, mistakes: Vec::new() };
    let (root, errors) = DeTable::parse_recoverable(text);
    for error in errors {
        reader.wrong(error.span().unwrap_or(0..0), error.message().replace('\n', "; "));
    }
    if !reader.mistakes.is_empty() {
        // What comes after a syntax error is guesswork.
        return Err(CosimError::System(reader.mistakes));
    }
    let system = reader.system(root.get_ref());
    if reader.mistakes.is_empty() { Ok(system) } else { Err(CosimError::System(reader.mistakes)) }
}

struct SystemTomlReader<'a> {
    file: &'a Path,
    folder: &'a Path,
    /// Where each line starts.
    lines: Vec<usize>,
    mistakes: Vec<InputMistake>,
}

/// Keys that belong above the first table; below it they are interpreted as keys of that table.
const TOP: [&str; 3] = ["connections", "record", "inputs"];

impl SystemTomlReader<'_> {
    fn place(&self, span: Range<usize>) -> SourceSpan {
        let line = self.lines.partition_point(|start| *start <= span.start) as u32;
        SourceSpan { file: self.file.into(), line }
    }

    fn wrong(&mut self, span: Range<usize>, message: impl Into<String>) {
        let place = self.place(span);
        self.mistakes.push(InputMistake { place, message: message.into() });
    }

    fn path(&self, text: &str) -> PathBuf {
        self.folder.join(text)
    }

    fn known(&mut self, table: &DeTable, what: &str, keys: Keys) {
        let known = |key: &str| keys.names().any(|name| name == key);
        for (key, _) in table.iter().filter(|(key, _)| !known(key.get_ref())) {
            let name = key.get_ref().as_ref();
            let mend = if TOP.contains(&name) {
                format!(
                    "; move it above the first [table]{}",
                    if name == "inputs" { ", or write [inputs]" } else { "" }
                )
            } else {
                suggestion(name, keys.names())
            };
            self.wrong(key.span(), format!("{what} has no `{name}`{mend}"));
        }
    }

    fn table<'t, 'i>(&mut self, value: &'t TomlValue<'i>, what: &str) -> Option<&'t DeTable<'i>> {
        let table = value.get_ref().as_table();
        if table.is_none() {
            self.wrong(
                value.span(),
                format!("{what} is a table, not {}", article(value.get_ref().type_str())),
            );
        }
        table
    }

    fn text(&mut self, table: &DeTable, key: &str) -> Option<String> {
        let value = table.get(key)?;
        let text = value.get_ref().as_str().map(str::to_owned);
        if text.is_none() {
            self.wrong(
                value.span(),
                format!("`{key}` is a text in quotes, not {}", article(value.get_ref().type_str())),
            );
        }
        text
    }

    fn number(&mut self, table: &DeTable, key: &str) -> Option<f64> {
        let value = table.get(key)?;
        let number = match value.get_ref() {
            DeValue::Integer(_) | DeValue::Float(_) => scalar(value.get_ref()).and_then(|t| t.parse().ok()),
            _ => None,
        };
        let number = number.filter(|x: &f64| x.is_finite());
        if number.is_none() {
            self.wrong(value.span(), format!("`{key}` is a finite number"));
        }
        number
    }

    fn flag(&mut self, table: &DeTable, key: &str) -> Option<bool> {
        let value = table.get(key)?;
        let flag = value.get_ref().as_bool();
        if flag.is_none() {
            self.wrong(value.span(), format!("`{key}` is true or false"));
        }
        flag
    }

    /// One of the words of a type.
    fn word<T: std::str::FromStr<Err = String>>(&mut self, table: &DeTable, key: &str) -> Option<T> {
        let text = self.text(table, key)?;
        let span = table.get(key)?.span();
        text.parse().map_err(|why| self.wrong(span, format!("`{key}`: {why}"))).ok()
    }

    fn system(&mut self, root: &DeTable) -> CosimSystem {
        self.known(root, keys::SYSTEM.of, keys::SYSTEM);
        let run = root.get("run").and_then(|v| self.run(v)).unwrap_or_default();
        let mut components = Vec::new();
        if let Some(table) = root.get("components").and_then(|v| self.table(v, "`components`")) {
            // The table is sorted by name; components keep the order of the file.
            let mut entries: Vec<_> = table.iter().collect();
            entries.sort_by_key(|(key, _)| key.span().start);
            for (key, value) in entries {
                components.extend(self.component(key, value));
            }
        }
        if components.is_empty() && self.mistakes.is_empty() {
            self.wrong(0..0, "there are no components; write [components.<name>] with fmu = \"<file>.fmu\"");
        }
        let names = ComponentNames::of(&components);
        let mut connections = Vec::new();
        for value in root.get("connections").map(|v| self.list(v, "connections")).unwrap_or_default() {
            connections.extend(self.connection(value, &names));
        }
        let mut record = Vec::new();
        for value in root.get("record").map(|v| self.list(v, "record")).unwrap_or_default() {
            record.extend(self.record(value));
        }
        let inputs = root.get("inputs").and_then(|v| self.inputs(v, &names));
        CosimSystem {
            file: self.file.into(),
            components,
            connections,
            run,
            record,
            inputs,
            ..CosimSystem::default()
        }
    }

    fn list<'t, 'i>(&mut self, value: &'t TomlValue<'i>, key: &str) -> Vec<&'t TomlValue<'i>> {
        match value.get_ref().as_array() {
            Some(array) => array.iter().collect(),
            None => {
                self.wrong(value.span(), format!("`{key}` is a list: {key} = [\"...\", \"...\"]"));
                Vec::new()
            }
        }
    }

    fn run(&mut self, value: &TomlValue) -> Option<RunSettings> {
        let t = self.table(value, "`run`")?;
        self.known(t, keys::RUN.of, keys::RUN);
        Some(RunSettings {
            start: self.number(t, "start"),
            stop: self.number(t, "stop"),
            step: self.number(t, "step"),
            tolerance: self.number(t, "tolerance"),
            algorithm: self.word(t, "algorithm"),
            event_rows: self.flag(t, "event-rows"),
            place: self.place(value.span()),
        })
    }

    fn component(
        &mut self,
        key: &Spanned<std::borrow::Cow<str>>,
        value: &TomlValue,
    ) -> Option<SystemComponent> {
        let name = key.get_ref().as_ref().to_owned();
        let what = format!("[components.{name}]");
        let t = self.table(value, &what)?;
        self.known(t, &what, keys::COMPONENT);
        if name.is_empty() {
            self.wrong(key.span(), "a component needs a name");
        }
        let fmu = self.text(t, "fmu");
        if fmu.is_none() && !t.contains_key("fmu") {
            self.wrong(key.span(), format!("{what} names no FMU; write fmu = \"<file>.fmu\""));
        }
        let mut start = Vec::new();
        if let Some(table) = t.get("start").and_then(|v| self.table(v, "`start`")) {
            let mut entries: Vec<_> = table.iter().collect();
            entries.sort_by_key(|(key, _)| key.span().start);
            for (key, value) in entries {
                self.start(key.get_ref(), value, self.place(key.span()), &mut start, 0);
            }
        }
        Some(SystemComponent {
            name,
            fmu: self.path(&fmu.unwrap_or_default()),
            interface: self.word(t, "interface"),
            start,
            step: self.number(t, "step"),
            place: self.place(key.span()),
        })
    }

    fn start(
        &mut self,
        name: &str,
        value: &TomlValue,
        place: SourceSpan,
        out: &mut Vec<StartValue>,
        depth: usize,
    ) {
        let mut start = StartValue { variable: name.to_owned(), place, ..StartValue::default() };
        let mut plain = value;
        if let Some(t) = value.get_ref().as_table() {
            // A structured name without quotes (`start.spring.stiffness = 2`) is a table in TOML.
            let Some(inner) = t
                .get("value")
                .filter(|_| t.iter().all(|(k, _)| matches!(k.get_ref().as_ref(), "value" | "unit")))
            else {
                if depth > 16 {
                    return self.wrong(value.span(), format!("`{name}` is nested too deeply"));
                }
                for (key, value) in t.iter() {
                    let place = self.place(key.span());
                    self.start(&format!("{name}.{}", key.get_ref()), value, place, out, depth + 1);
                }
                return;
            };
            plain = inner;
            let unit = self.text(t, "unit");
            start.unit = unit.map(|name| DescriptionUnit { name, base: None, display: Vec::new(), line: 0 });
        }
        if let Err(span) = texts(plain, &mut start.values) {
            self.wrong(
                span,
                format!("`{name}`: a start value is a number, true, false, a text, or a list of these"),
            );
        }
        out.push(start);
    }

    fn connection(&mut self, value: &TomlValue, names: &ComponentNames) -> Option<Connection> {
        let place = self.place(value.span());
        let mut connection = Connection { place, ..Connection::default() };
        let (from, to) = match value.get_ref() {
            DeValue::String(text) => match text.split_once("->") {
                Some((from, to)) if !to.contains("->") => (from.to_owned(), to.to_owned()),
                _ => {
                    self.wrong(
                        value.span(),
                        format!("{text:?} is no connection; write \"from.output -> to.input\""),
                    );
                    return None;
                }
            },
            _ => {
                let t = self.table(value, "a connection that is no text")?;
                self.known(t, keys::CONNECTION.of, keys::CONNECTION);
                connection.factor = self.number(t, "factor").unwrap_or(1.0);
                connection.offset = self.number(t, "offset").unwrap_or(0.0);
                connection.convert_units = self.flag(t, "convert-units").unwrap_or(true);
                connection.map = self.map(t);
                for key in ["from", "to"].iter().filter(|key| !t.contains_key(**key)) {
                    self.wrong(value.span(), format!("a connection needs `{key} = \"component.variable\"`"));
                }
                (self.text(t, "from")?, self.text(t, "to")?)
            }
        };
        connection.from = self.port(&from, value.span(), names)?;
        connection.to = self.port(&to, value.span(), names)?;
        Some(connection)
    }

    fn map(&mut self, t: &DeTable) -> Vec<(String, String)> {
        let Some(table) = t.get("map").and_then(|v| self.table(v, "`map`")) else { return Vec::new() };
        let mut map = Vec::new();
        for (key, value) in table.iter() {
            match scalar(value.get_ref()) {
                Some(text) => map.push((key.get_ref().to_string(), text)),
                None => self.wrong(value.span(), "a map replaces integers, Booleans or names of items"),
            }
        }
        map
    }

    fn port(&mut self, text: &str, span: Range<usize>, names: &ComponentNames) -> Option<VariablePort> {
        let port = names.port(text.trim());
        if port.is_none() {
            self.wrong(span, format!("`{}` names no variable; write component.variable", text.trim()));
        }
        port
    }

    fn record(&mut self, value: &TomlValue) -> Option<RecordedVariable> {
        let place = self.place(value.span());
        if let Some(name) = value.get_ref().as_str() {
            return Some(RecordedVariable {
                name: name.trim().to_owned(),
                place,
                ..RecordedVariable::default()
            });
        }
        let t = self.table(value, "a record that is no text")?;
        self.known(t, keys::RECORD.of, keys::RECORD);
        if !t.contains_key("variable") {
            self.wrong(value.span(), "a record needs `variable = \"component.variable\"`");
        }
        let every = match self.number(t, "every") {
            Some(n) if n.fract() == 0.0 && (1.0..=f64::from(u32::MAX)).contains(&n) => n as u32,
            Some(_) => {
                self.wrong(value.span(), "`every` is a whole number of communication steps, at least 1");
                1
            }
            None => 0,
        };
        Some(RecordedVariable {
            name: self.text(t, "variable")?.trim().to_owned(),
            column: self.text(t, "as"),
            every,
            place,
        })
    }

    fn inputs(&mut self, value: &TomlValue, names: &ComponentNames) -> Option<InputFile> {
        let place = self.place(value.span());
        if let Some(file) = value.get_ref().as_str() {
            return Some(InputFile { file: self.path(file), columns: Vec::new(), place });
        }
        let t = self.table(value, "`inputs` that is no file name")?;
        self.known(t, keys::INPUTS.of, keys::INPUTS);
        if !t.contains_key("file") {
            self.wrong(value.span(), "[inputs] needs `file = \"<file>.csv\"`");
        }
        let mut columns = Vec::new();
        for (key, value) in
            t.get("columns").and_then(|v| self.table(v, "`columns`")).into_iter().flat_map(|t| t.iter())
        {
            let targets = match value.get_ref().as_array() {
                Some(several) => several.iter().collect(),
                None => vec![value],
            };
            for target in targets {
                match target.get_ref().as_str() {
                    Some(text) => columns.extend(
                        self.port(text, target.span(), names).map(|port| (key.get_ref().to_string(), port)),
                    ),
                    None => {
                        self.wrong(target.span(), "a column drives \"component.input\", or a list of these")
                    }
                }
            }
        }
        let file = self.text(t, "file")?;
        Some(InputFile { file: self.path(&file), columns, place })
    }
}

/// Text of a single value.
fn scalar(value: &DeValue) -> Option<String> {
    match value {
        DeValue::String(text) => Some(text.to_string()),
        DeValue::Boolean(flag) => Some(flag.to_string()),
        DeValue::Float(x) => Some(x.as_str().to_owned()),
        DeValue::Integer(x) if x.radix() == 10 => Some(x.as_str().trim_start_matches('+').to_owned()),
        DeValue::Integer(x) => i128::from_str_radix(x.as_str(), x.radix()).ok().map(|x| x.to_string()),
        _ => None,
    }
}

/// Texts of a value or of a list (of lists: row by row).
fn texts(value: &TomlValue, out: &mut Vec<String>) -> Result<(), Range<usize>> {
    match value.get_ref() {
        DeValue::Array(list) => list.iter().try_for_each(|v| texts(v, out)),
        single => scalar(single).map(|text| out.push(text)).ok_or(value.span()),
    }
}

fn article(kind: &str) -> String {
    format!("{} {kind}", if kind.starts_with(['a', 'i', 'o']) { "an" } else { "a" })
}
