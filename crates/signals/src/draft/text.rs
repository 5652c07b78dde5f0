//! The text of a drafted `case.toml`.

use super::assign::Assigned;
use super::look::LookedLog;
use super::model::DraftModel;
use super::split::Split;
use super::words::Quantity;
use crate::names::{base_name, short};
use crate::variable::VariableRole;

/// What goes into a draft.
pub(super) struct DraftText<'a> {
    pub(super) logs: &'a [LookedLog],
    /// As the case names them.
    pub(super) names: &'a [String],
    /// Rows a second, if the user gives it.
    pub(super) rate: Option<f64>,
    pub(super) model: &'a DraftModel,
    /// By log.
    pub(super) columns: &'a [Vec<Assigned>],
    pub(super) split: Split,
}

/// The text, and its content in short.
pub(super) struct WrittenDraft {
    pub(super) text: String,
    pub(super) summary: Vec<String>,
}

/// A line with a remark behind it.
fn line(out: &mut String, left: &str, remark: &str) {
    match remark {
        "" => *out += &format!("{left}\n"),
        _ => *out += &format!("{left}   # {remark}\n"),
    }
}

fn guess(guesses: &[String]) -> String {
    if guesses.is_empty() { String::new() } else { format!("GUESS: {}", guesses.join("; ")) }
}

fn list(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|n| format!("{n:?}")).collect();
    format!("[{}]", names.join(", "))
}

impl DraftText<'_> {
    pub(super) fn write(&self) -> WrittenDraft {
        let mut out = String::from(
            "# Drafted by `trueup init` from logs. GUESS marks what they do not show: confirm or correct it, then `trueup check`.\n\
             # All keys: docs/cases.md.\n\n",
        );
        let mut summary = Vec::new();
        let remark = if self.model.guessed { "GUESS: by the number of joints in the logs" } else { "" };
        line(&mut out, &format!("model = {:?}", self.model.name), remark);
        self.recordings(&mut out);
        self.rows(&mut out);
        self.mapping(&mut out, &mut summary);
        self.channels(&mut out);
        self.parameters(&mut out);
        WrittenDraft { text: out, summary }
    }

    fn recordings(&self, out: &mut String) {
        let split = &self.split;
        line(out, &format!("train = {}", list(&split.train)), "");
        if !split.holdout.is_empty() {
            let remark = match split.by_name {
                true => "GUESS: by their names",
                false => "GUESS: the last ones; best is another motion than in `train`",
            };
            line(out, &format!("holdout = {}", list(&split.holdout)), remark);
        } else {
            *out += "# holdout = [\"...\"]   # one more recording, of another motion: the reported figures are of it\n";
        }
        if !split.rest.is_empty() {
            line(out, &format!("rest = {}", list(&split.rest)), "nothing moves in them: they give the noise");
        }
        if !split.repeats.is_empty() {
            let groups: Vec<_> = split.repeats.iter().map(|g| list(g)).collect();
            line(
                out,
                &format!("repeats = [{}]", groups.join(", ")),
                "GUESS: their inputs are the same: what differs is noise",
            );
        }
        for (name, [start, length]) in &split.times {
            *out += &format!("# {name}: from {} s, {} s long\n", short(*start), short(*length));
        }
    }

    fn rows(&self, out: &mut String) {
        // One that holds for all: a recording with another rate has it in its sidecar.
        let mut rates = self.logs.iter().map(|l| l.clock.as_ref().and_then(|c| c.rate));
        let first = rates.next().flatten().filter(|first| rates.all(|rate| rate == Some(*first)));
        if let Some(rate) = self.rate {
            *out += &format!("\n[recordings]\nrate = {rate}\n");
        } else if let Some(rate) = first {
            *out += "\n[recordings]\n";
            line(
                out,
                &format!("rate = {}", short(rate)),
                "GUESS: rows share times, so they are taken as evenly spaced",
            );
        }
    }

    fn mapping(&self, out: &mut String, summary: &mut Vec<String>) {
        // What a log has otherwise than one before it is written of that log alone.
        let mut common: Vec<MappingLine> = Vec::new();
        let mut apart: Vec<(String, Vec<MappingLine>)> = Vec::new();
        for ((log, assigned), name) in self.logs.iter().zip(self.columns).zip(self.names) {
            let mut own = Vec::new();
            for new in lines(log, assigned, summary) {
                match common.iter().find(|l| l.column == new.column) {
                    Some(before) if before.value == new.value => {}
                    Some(_) => own.push(new),
                    None => common.push(new),
                }
            }
            if !own.is_empty() {
                apart.push((name.clone(), own));
            }
        }
        let tables = std::iter::once(("[columns]".to_owned(), common))
            .chain(apart.into_iter().map(|(name, lines)| (format!("[columns.{name:?}]"), lines)));
        for (head, lines) in tables.filter(|(_, lines)| !lines.is_empty()) {
            *out += &format!("\n{head}\n");
            lines.iter().for_each(|l| line(out, &format!("{:?} = {}", l.column, l.value), &l.remark));
        }
        let drives = self.model.known.iter().filter(|v| v.role == VariableRole::Input && v.drives);
        let has = |name: &str| self.columns.iter().flatten().any(|a| a.variable == name);
        let missing: Vec<_> = drives.filter(|v| !has(&v.name)).collect();
        let mut columns = self.logs.iter().flat_map(|l| &l.columns);
        let angle = |q: Option<Quantity>| matches!(q, Some(Quantity::Angle | Quantity::Position));
        let reference = columns.find(|c| c.meaning.command && angle(c.meaning.quantity));
        if let Some(command) = reference
            && !missing.is_empty()
        {
            *out += &format!(
                "# {:?} is a reference: where servos of known gains follow it, declare them under [effects] as position-servo\n\
                 # (docs/cases.md); the model then has an input for it\n",
                command.name
            );
        }
        for v in missing {
            *out += &format!(
                "# TODO: no column was recognised as `{}` ({}), which drives the model\n",
                v.name, v.unit
            );
            summary
                .push(format!("no column was recognised as {} ({}), which drives the model", v.name, v.unit));
        }
    }

    fn channels(&self, out: &mut String) {
        for (name, sensor) in &self.split.sensors {
            let mut lines = String::new();
            if let Some(step) = sensor.resolution {
                line(&mut lines, &format!("resolution = {}", short(step)), "the step of its readings");
            }
            if let Some(noise) = sensor.noise {
                line(
                    &mut lines,
                    &format!("noise = {}", short(noise)),
                    "GUESS: by its highest frequencies; a recording at rest shows it better",
                );
            }
            if sensor.held {
                line(&mut lines, "interpolation = \"hold\"", "GUESS: its values stay for several rows");
            }
            if !lines.is_empty() {
                let quoted = if base_name(name) == name { name.clone() } else { format!("{name:?}") };
                *out += &format!("\n[channels.{quoted}]\n{lines}");
            }
        }
    }

    fn parameters(&self, out: &mut String) {
        let DraftModel { parameters, preset, structure, .. } = self.model;
        *out += "\n[parameters]\n";
        structure.iter().for_each(|l| *out += &format!("{l}\n"));
        *out += &format!(
            "# What stays a comment is the value of the preset ({preset}), not of your system. Remove the # and write yours.\n"
        );
        for p in parameters {
            let unit = if p.unit.is_empty() { String::new() } else { format!("   # {}", p.unit) };
            *out += &format!("# {} = {}{unit}\n", p.name, p.value);
        }
        *out += "\n[uncertain]\n# Relative standard deviations of values under [parameters]; without one a value is taken as known.\n";
        if let Some(p) = parameters.first() {
            *out += &format!("# {} = 0.1   # 10 %\n", p.name);
        }
    }
}

/// A line of `[columns]`.
struct MappingLine {
    column: String,
    value: String,
    remark: String,
}

/// Those of a log: its clock, what was recognised, and what was not.
fn lines(log: &LookedLog, assigned: &[Assigned], summary: &mut Vec<String>) -> Vec<MappingLine> {
    let mut lines = Vec::new();
    let mut add = |column: &str, value: String, remark: String| {
        lines.push(MappingLine { column: column.to_owned(), value, remark });
    };
    let mut tell = |told: String| {
        if !summary.contains(&told) {
            summary.push(told);
        }
    };
    if let Some(clock) = log.clock.as_ref().filter(|c| c.name != "time" || c.unit.is_some()) {
        add(&clock.name, entry("time", clock.unit.as_deref(), None), guess(clock.guess.as_slice()));
    }
    log.clocks.iter().for_each(|other| add(other, "false".into(), "another clock".into()));
    for a in assigned {
        let remark = guess(&a.guesses);
        let unit = a.unit.as_ref().map_or_else(String::new, |u| format!(" ({u})"));
        tell(format!("{}{unit} -> {}   {remark}", a.column, a.variable).trim_end().to_owned());
        if a.column != a.variable || a.unit.is_some() || a.scale.is_some() {
            add(&a.column, entry(&a.variable, a.unit.as_deref(), a.scale), remark);
        }
    }
    for c in log.columns.iter().filter(|c| !assigned.iter().any(|a| a.column == c.name)) {
        let why = match c.words {
            true => "no numbers",
            false => "not recognised: write the variable's name in quotes, if it is one",
        };
        tell(format!("{} -> left out ({why})", c.name));
        add(&c.name, "false".into(), why.into());
    }
    lines
}

/// The value of a column in `[columns]`.
fn entry(variable: &str, unit: Option<&str>, scale: Option<f64>) -> String {
    match (unit, scale) {
        (None, None) => format!("{variable:?}"),
        (Some(unit), _) => format!("{{ variable = {variable:?}, unit = {unit:?} }}"),
        (None, Some(scale)) => format!("{{ variable = {variable:?}, scale = {scale:?} }}"),
    }
}
