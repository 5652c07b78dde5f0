//! `case.toml` becomes a [`Case`].

use std::path::Path;

use toml::de::{DeTable, DeValue};

use super::Case;
use crate::error::{SignalsError, verdict};
use crate::finding::{Finding, FindingKind};
use crate::keys;
use crate::names::{base_name, names_recording, suggestion};
use crate::read::columns::rules;
use crate::read::toml::{TomlReader, text};
use crate::read::{doubts, parameters};
use crate::variable::{SignalVariable, VariableRole};

impl Case {
    /// Reads `case.toml` of a folder, or the file itself. `known` are the model's variables; with none, names are
    /// taken as they are. A `key.toml` is never looked at.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with every mistake and its line.
    pub fn read(path: &Path, known: &[SignalVariable]) -> Result<(Self, Vec<Finding>), SignalsError> {
        let file = if path.is_dir() { path.join("case.toml") } else { path.to_owned() };
        let mut findings = Vec::new();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        if names_recording(&name) && file.is_file() {
            let mend = format!(
                "put it into a folder with a case.toml that contains model = \"TwoMassJoint\" and train = [\"{name}\"], and give that folder"
            );
            let what = "this is a recording, no case";
            return Err(SignalsError::Wrong(vec![Finding::error(
                FindingKind::Unreadable,
                &file,
                what,
                mend,
            )]));
        }
        match text(&file, &mut findings) {
            Some(text) => Self::parse(&file, &text, known),
            None => {
                for finding in &mut findings {
                    finding.mend =
                        "a case is a folder of recordings with a case.toml; see docs/cases.md".into();
                }
                Err(SignalsError::Wrong(findings))
            }
        }
    }

    /// Reads a text of this file.
    ///
    /// # Errors
    /// [`SignalsError::Wrong`] with every mistake and its line.
    pub fn parse(
        file: &Path,
        text: &str,
        known: &[SignalVariable],
    ) -> Result<(Self, Vec<Finding>), SignalsError> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let folder = file.parent().unwrap_or(Path::new("")).to_owned();
        let mut case = Self { folder, file: file.into(), ..Self::default() };
        let mut findings = Vec::new();
        let mut reader = TomlReader::new(file, text, &mut findings);
        if let Some(root) = reader.parse(text) {
            case.fill(&mut reader, root.get_ref(), known);
        }
        verdict(case, findings)
    }

    fn fill(&mut self, reader: &mut TomlReader, root: &DeTable, known: &[SignalVariable]) {
        reader.known(root, keys::CASE.of, keys::CASE);
        match root.get("model") {
            Some(node) => self.model = reader.text(node, "model").unwrap_or_default(),
            None => reader.wrong(
                FindingKind::UnknownModel,
                0..0,
                "there is no `model`",
                "write model = \"TwoMassJoint\"",
            ),
        }
        self.ports = root.get("ports").and_then(|node| reader.text(node, "ports"));
        self.robot = root.get("robot").and_then(|node| reader.text(node, "robot"));
        self.files(reader, root);
        if let Some(table) = root.get("parameters").and_then(|n| reader.table(n, "parameters")) {
            self.parameters = parameters(reader, table, known);
        }
        if let Some(table) = root.get("effects").and_then(|n| reader.table(n, "effects")) {
            self.known(reader, table, known);
        }
        if let Some(table) = root.get("uncertain").and_then(|n| reader.table(n, "uncertain")) {
            self.doubts(reader, table, known);
        }
        if let Some(node) = root.get("payload") {
            self.carries(reader, node);
        }
        if let Some(table) = root.get("fit").and_then(|n| reader.table(n, "fit")) {
            self.fitted(reader, table, known);
        }
        if let Some(table) = root.get("recordings").and_then(|n| reader.table(n, keys::RECORDINGS.of)) {
            reader.known(table, keys::RECORDINGS.of, keys::RECORDINGS);
            self.rate = table.get("rate").and_then(|n| reader.rate(n));
        }
        if let Some(table) = root.get("columns").and_then(|n| reader.table(n, "columns")) {
            self.columns = rules(reader, table, &self.recordings(), known);
        }
        if let Some(table) = root.get("channels").and_then(|n| reader.table(n, "channels")) {
            for (key, node) in table.iter() {
                let name = key.get_ref().as_ref();
                let names =
                    || known.iter().filter(|v| v.role != VariableRole::Parameter).map(|v| v.name.as_str());
                if !known.is_empty() && !names().any(|n| n == name || base_name(n) == name) {
                    let mend = suggestion(name, names(), "see `trueup fmu info`");
                    let what = format!("the model has no input or output `{name}`");
                    reader.wrong(FindingKind::UnknownChannel, key.span(), what, mend);
                }
                let settings = reader.settings(node, name);
                self.channels.insert(name.into(), settings);
            }
        }
    }

    fn files(&mut self, reader: &mut TomlReader, root: &DeTable) {
        let list = |reader: &mut TomlReader, key: &str| {
            let Some(node) = root.get(key) else { return Vec::new() };
            let mut names: Vec<String> = Vec::new();
            for (name, span) in reader.texts(node, key) {
                if names.contains(&name) {
                    let what = format!("`{name}` is listed twice in `{key}`");
                    reader.warn(FindingKind::SameRecording, span, what, "name it once");
                } else {
                    names.push(name);
                }
            }
            names
        };
        self.train = list(reader, "train");
        self.holdout = list(reader, "holdout");
        self.rest = list(reader, "rest");
        if self.train.is_empty() {
            let span = root.get("train").map_or(0..0, |n| n.span());
            let mend = "write train = [\"run-1.csv\"]";
            reader.wrong(FindingKind::NoTraining, span, "there is no recording to train on", mend);
        }
        for name in self.holdout.iter().filter(|n| self.train.contains(n)) {
            let span = root.get("holdout").map_or(0..0, |n| n.span());
            let what = format!("`{name}` is in `holdout` and in `train`");
            let mend = "take it out of one: figures on what was fitted are no test";
            reader.wrong(FindingKind::HoldoutInTrain, span, what, mend);
        }
        match root.get("repeats").map(|n| (n, n.get_ref())) {
            None => {}
            Some((_, DeValue::Array(groups))) => {
                let flat: Vec<String> =
                    groups.iter().filter_map(|n| Some(format!("{:?}", n.get_ref().as_str()?))).collect();
                if let (false, Some(first)) = (flat.is_empty(), groups.first()) {
                    let span = first.span();
                    let what = "`repeats` is a list of names, no list of lists";
                    let list =
                        if flat.len() > 1 { flat.join(", ") } else { format!("{}, \"b.csv\"", flat[0]) };
                    let mend = format!("write repeats = [[{list}]], each inner list the runs of one command");
                    return reader.wrong(FindingKind::BadValue, span, what, mend);
                }
                for node in groups.iter() {
                    let group: Vec<_> =
                        reader.texts(node, "repeats").into_iter().map(|(name, _)| name).collect();
                    if group.len() < 2 && node.get_ref().as_array().is_some() {
                        let what = match group.first() {
                            Some(one) => format!("`repeats` has a group of one, `{one}`"),
                            None => "`repeats` has an empty group".to_owned(),
                        };
                        let mend = "name at least two runs of the same command";
                        reader.wrong(FindingKind::BadValue, node.span(), what, mend);
                    }
                    self.repeats.push(group);
                }
            }
            Some((node, other)) => {
                let mend = "write repeats = [[\"a.csv\", \"b.csv\"]]";
                let what = format!("`repeats` is a {}, no list of lists", other.type_str());
                reader.wrong(FindingKind::BadValue, node.span(), what, mend);
            }
        }
    }

    fn doubts(&mut self, reader: &mut TomlReader, table: &DeTable, known: &[SignalVariable]) {
        for (key, _) in table.iter() {
            let name = key.get_ref().as_ref();
            let is = |p: &String| p == name || base_name(p) == name;
            // A robot's file has the values that the case does not.
            let of_robot = self.robot.is_some() && (known.is_empty() || known.iter().any(|v| is(&v.name)));
            if !of_robot && !self.parameters.keys().any(is) {
                let mend = suggestion(name, self.parameters.keys().map(String::as_str), "give its value");
                let what = format!("`{name}` is uncertain, but [parameters] has no value of it");
                reader.wrong(FindingKind::UnknownParameter, key.span(), what, mend);
            }
        }
        self.uncertain.extend(doubts(reader, table, known));
    }

    fn fitted(&mut self, reader: &mut TomlReader, table: &DeTable, known: &[SignalVariable]) {
        reader.known(table, keys::FIT.of, keys::FIT);
        if let Some(node) = table.get("effects") {
            let ids = reader.texts(node, "effects");
            self.with = ids.into_iter().map(|(id, _)| id).collect();
        }
        if let Some(node) = table.get("weight") {
            self.weighed(reader, node);
        }
        let Some(node) = table.get("parameters") else { return };
        let names = reader.texts(node, "parameters");
        if node.get_ref().as_array().is_some_and(|list| list.is_empty()) {
            let mend =
                "name some, as in parameters = [\"stiffness\"], or remove the line to fit the usual ones";
            let what = "`[fit] parameters` is empty: there is nothing to estimate";
            reader.wrong(FindingKind::BadValue, node.span(), what, mend);
        }
        for (name, span) in &names {
            let parameters =
                || known.iter().filter(|v| v.role == VariableRole::Parameter).map(|v| v.name.as_str());
            if !known.is_empty() && !parameters().any(|p| p == name || base_name(p) == name) {
                let mend = suggestion(name, parameters(), "see `trueup fmu info`");
                let what = format!("the model has no parameter `{name}`");
                reader.wrong(FindingKind::UnknownParameter, span.clone(), what, mend);
            }
        }
        self.fit = Some(names.into_iter().map(|(name, _)| name).collect());
    }
}
