//! A table and what is known of it become a recording.

use std::path::Path;

use super::clock::{self, ClockUse};
use super::sidecar::Sidecar;
use super::table::{ReadTable, TableColumn, mend, unit_of};
use crate::columns::ColumnMapping;
use crate::finding::{Finding, FindingKind, MAX_REPORTED, Severity};
use crate::names::{base_name, element_name, nearest, suggestion};
use crate::recording::{Channel, DeclaredFigures, Recording};
use crate::unit::SignalUnit;
use crate::variable::{SignalVariable, VariableRole};

/// A jump is a line over this part of the step before it: times grow strictly, and no sum of them makes two of them one.
const JUMP: f64 = 1e-6;

pub(super) fn assemble(
    file: &Path,
    mut table: ReadTable,
    sidecar: &Sidecar,
    known: &[SignalVariable],
    declared: &DeclaredFigures,
    findings: &mut Vec<Finding>,
) -> Recording {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut recording =
        Recording { name, file: file.into(), parameters: sidecar.parameters.clone(), ..Recording::default() };
    let is_known = |name: &str| known.iter().any(|v| v.name == name);
    prepare(file, &mut table, sidecar, is_known, findings);
    rename_elements(&mut table, known);
    let wanted = if known.is_empty() { ClockUse::Look } else { ClockUse::Recording };
    let rate = sidecar.rate.or(declared.rate);
    let Some(clock) = clock::take(file, &mut table, sidecar, rate, wanted, findings) else {
        return recording;
    };
    let time = clock.time;
    (recording.start, recording.end) =
        (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
    for i in 0..table.columns.len() {
        let reading = std::mem::take(&mut table.columns[i].values);
        let column = ColumnSource { file, table: &table, index: i, sidecar };
        if let Some(channel) = column.channel(&time, reading, known, findings) {
            if recording.channel(&channel.name).is_some() {
                let what = format!("two columns are `{}`", channel.name);
                let mend = "leave one out: [columns] of the sidecar, name = false";
                findings.push(
                    Finding::error(FindingKind::DuplicateName, file, what, mend).channel(&channel.name),
                );
            } else {
                recording.channels.push(channel);
            }
        }
    }
    if !known.is_empty() {
        findings.extend(clock::bursts(&recording, time.len()));
    }
    declare(&mut recording, sidecar, declared, findings);
    recording
}

/// Units in names become units; what cannot be a column, and what a sidecar declares of missing columns, is reported.
pub(super) fn prepare(
    file: &Path,
    table: &mut ReadTable,
    sidecar: &Sidecar,
    is_known: impl Fn(&str) -> bool,
    findings: &mut Vec<Finding>,
) {
    findings.extend(from_zero(file, table, sidecar));
    let names: Vec<String> = table.names().map(str::to_owned).collect();
    for column in &mut table.columns {
        let mapped = sidecar.columns.contains_key(&column.name);
        if let Some((name, unit)) = with_unit(&column.name).filter(|_| !mapped && !is_known(&column.name))
            && !names.iter().any(|n| n == name)
        {
            (column.unit, column.name) = (Some(unit.to_owned()), name.to_owned());
        }
    }
    for skipped in &table.skipped {
        let mend = "nothing, if it is no signal; else save it as a numeric column as long as the time";
        findings.push(Finding::note(FindingKind::Skipped, file, skipped.clone(), mend));
    }
    for (name, column) in &sidecar.columns {
        let has = |n: &str| n == name || base_name(n) == name;
        if !table.names().any(has) {
            let mend = suggestion(name, table.names(), "remove it");
            let what = format!("{} has no column `{name}`", file.display());
            // Of a case another recording may have it: who reads the case decides.
            let finding = Finding::error(FindingKind::UnknownColumn, &column.file, what, mend);
            let severity = if column.file == sidecar.file { Severity::Error } else { Severity::Note };
            findings.push(Finding { severity, ..finding }.line(column.line));
        }
    }
}

/// `[columns]` that names an element 0 counts the elements of that array from 0.
fn from_zero(file: &Path, table: &mut ReadTable, sidecar: &Sidecar) -> Option<Finding> {
    let first = |name: &&String| name.ends_with("[0]") && !table.names().any(|n| n == name.as_str());
    let bases: Vec<&str> = sidecar.columns.keys().filter(first).map(|name| base_name(name)).collect();
    let mut counted = Vec::new();
    for column in &mut table.columns {
        let base = base_name(&column.name).to_owned();
        let index: Option<usize> = column.name[base.len()..].trim_matches(['[', ']']).parse().ok();
        if let Some(k) = index.filter(|k| *k > 0 && bases.contains(&base.as_str())) {
            column.name = element_name(&base, &[k - 1]);
            if !counted.contains(&base) {
                counted.push(base);
            }
        }
    }
    let name = counted.first()?;
    let what = format!("elements of `{name}` are counted from 0, because [columns] has a `{name}[0]`");
    let mend = "nothing, if that is meant; else begin with [1]";
    Some(Finding::note(FindingKind::UnknownColumn, file, what, mend).channel(name))
}

/// `angle` and `deg` of `angle [deg]` or `angle (deg)`; an index is no unit.
fn with_unit(name: &str) -> Option<(&str, &str)> {
    let (name, unit) = [('[', ']'), ('(', ')')].into_iter().find_map(|(open, close)| {
        let (name, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
        Some((name.trim(), unit.trim()))
    })?;
    let index = unit.bytes().all(|b| b.is_ascii_digit() || b == b',' || b == b' ');
    (!index && !name.is_empty() && SignalUnit::parse(unit).is_some()).then_some((name, unit))
}

/// What the case declares of channels, then what the sidecar declares; an array's name holds for its elements.
fn declare(
    recording: &mut Recording,
    sidecar: &Sidecar,
    declared: &DeclaredFigures,
    findings: &mut Vec<Finding>,
) {
    for channel in &mut recording.channels {
        let names = [base_name(&channel.name).to_owned(), channel.name.clone()];
        for settings in names.iter().filter_map(|n| declared.channels.get(n)) {
            channel.declare(settings);
        }
        for (settings, _) in names.iter().filter_map(|n| sidecar.channels.get(n)) {
            channel.declare(settings);
        }
    }
    for (name, (_, line)) in &sidecar.channels {
        let is = |c: &Channel| c.name == *name || base_name(&c.name) == name;
        if !recording.channels.iter().any(is) {
            let names = recording.channels.iter().map(|c| c.name.as_str());
            let mend = suggestion(name, names, "name a channel of this recording");
            let what = format!("{} has no channel `{name}`", recording.name);
            findings.push(Finding::error(FindingKind::UnknownChannel, &sidecar.file, what, mend).line(*line));
        }
    }
}

/// FMPy writes a matrix as one column: its elements are counted through, those of the model have two indices.
fn rename_elements(table: &mut ReadTable, known: &[SignalVariable]) {
    let mut renamed = Vec::new();
    for (i, name) in table.names().enumerate() {
        let base = base_name(name);
        if base == name || known.iter().any(|v| v.name == name) {
            continue;
        }
        let elements: Vec<_> = known.iter().filter(|v| base_name(&v.name) == base).collect();
        let columns: Vec<_> =
            (0..table.columns.len()).filter(|k| base_name(&table.columns[*k].name) == base).collect();
        if let (true, Some(k)) = (elements.len() == columns.len(), columns.iter().position(|k| *k == i)) {
            renamed.push((i, elements[k].name.clone()));
        }
    }
    for (i, name) in renamed {
        table.columns[i].name = name;
    }
}

/// One column on its way to a channel.
struct ColumnSource<'a> {
    file: &'a Path,
    table: &'a ReadTable,
    index: usize,
    sidecar: &'a Sidecar,
}

impl ColumnSource<'_> {
    fn channel(
        &self,
        time: &[f64],
        mut reading: Vec<f64>,
        known: &[SignalVariable],
        findings: &mut Vec<Finding>,
    ) -> Option<Channel> {
        let own = self.column();
        let name = self.sidecar.variable(&own.name)?;
        let found = known.iter().find(|v| v.name == name && v.role != VariableRole::Parameter);
        if found.is_none() && !known.is_empty() {
            findings.push(self.unknown(&name, known));
            return None;
        }
        if own.words > 0 || own.ticks.as_ref().is_some_and(|t| t.of_epoch) {
            findings.extend(self.no_numbers(&name, found.is_some()));
            return None;
        }
        let unit = self.convert(&mut reading, found, findings)?;
        let (mut times, mut values) = (Vec::with_capacity(time.len()), Vec::with_capacity(time.len()));
        let mut infinite = 0;
        for (row, (&t, &x)) in time.iter().zip(&reading).enumerate() {
            if x.is_finite() {
                sample(&mut times, &mut values, t, x);
            } else if x.is_infinite() {
                infinite += 1;
                if infinite <= MAX_REPORTED {
                    let mend = "leave the cell empty if nothing was measured";
                    let finding =
                        Finding::error(FindingKind::InfiniteValue, self.file, "an infinite value", mend);
                    findings.push(finding.line(self.table.line(row)).channel(&name).time(t));
                }
            }
        }
        if values.is_empty() && infinite == 0 {
            let what = "there is no value in the whole column";
            findings.push(
                Finding::error(FindingKind::NoValue, self.file, what, "fill the column or remove it")
                    .channel(&name),
            );
            return None;
        }
        Some(Channel::new(&name, &unit, times, values))
    }

    fn column(&self) -> &TableColumn {
        &self.table.columns[self.index]
    }

    /// A column of text or of dates: of a variable that is compared a mistake, else left out.
    fn no_numbers(&self, name: &str, known: bool) -> Vec<Finding> {
        let own = self.column();
        let holds = if own.ticks.is_some() { "dates" } else { "text" };
        if !known {
            let mend = "nothing, if it is no signal; else write numbers";
            let what = format!("the column holds {holds} and is left out");
            return vec![Finding::note(FindingKind::Skipped, self.file, what, mend).line(1).channel(name)];
        }
        let word = |(row, text): (usize, &String)| {
            (!text.is_empty() && text.parse::<f64>().is_err()).then(|| {
                let what = format!("{text:?} is no number");
                let finding = Finding::error(FindingKind::NotANumber, self.file, what, mend(text));
                finding.line(self.table.line(row)).channel(name)
            })
        };
        let mut wrong: Vec<_> =
            own.texts.iter().enumerate().filter_map(word).take(MAX_REPORTED + 1).collect();
        if let Some(rest) = wrong.get_mut(MAX_REPORTED) {
            (rest.what, rest.channel) = ("and more of this kind".into(), None);
        }
        if wrong.is_empty() {
            let what = format!("the column holds {holds}, no numbers");
            wrong.push(
                Finding::error(FindingKind::NotANumber, self.file, what, "write numbers").channel(name),
            );
        }
        wrong
    }

    fn unknown(&self, name: &str, known: &[SignalVariable]) -> Finding {
        let free = |v: &&SignalVariable| {
            v.role != VariableRole::Parameter && !self.table.names().any(|n| n == v.name)
        };
        let mend = match nearest(name, known.iter().filter(free).map(|v| v.name.as_str())) {
            Some(near) => format!("did you mean `{near}`? Rename it, or map it under [columns] of case.toml"),
            None => {
                format!("map it under [columns] of case.toml: \"{name}\" = \"...\", or false to leave it out")
            }
        };
        let what = "the model has no such input or output; the column is left out";
        Finding::warning(FindingKind::UnknownColumn, self.file, what, mend).line(1).channel(name)
    }

    /// Readings become values in the variable's unit; its name.
    fn convert(
        &self,
        reading: &mut [f64],
        known: Option<&SignalVariable>,
        findings: &mut Vec<Finding>,
    ) -> Option<String> {
        let own = known.map(|v| v.unit.clone());
        let said = self.sidecar.column(&self.column().name);
        // The sidecar's word goes before that of the file itself.
        let (place, line) = said.map_or((self.file, 1), |c| (c.file.as_path(), c.line));
        let scale = said.and_then(|c: &ColumnMapping| c.scale);
        let unit = said.and_then(|c| c.unit.clone()).or_else(|| unit_of(self.column()));
        let duration = || self.column().ticks.is_some().then(|| ("s".to_owned(), SignalUnit::SECOND));
        let unit = unit.or_else(duration);
        let mut to_si = SignalUnit::ONE;
        if let Some((text, unit)) = &unit {
            let wanted = own.as_deref().and_then(SignalUnit::parse);
            match wanted {
                Some(wanted) if unit.fits(&wanted) => {
                    // The model's unit may itself be a multiple of SI.
                    to_si = SignalUnit { factor: unit.factor / wanted.factor, ..*unit };
                }
                Some(_) if scale.is_none() => {
                    let own = own.unwrap_or_default();
                    let what = format!("`{text}` cannot be the unit of a variable in `{own}`");
                    let mend = format!("correct it, or give the `scale` from {text} to {own}");
                    findings.push(Finding::error(FindingKind::Unit, place, what, mend).line(line));
                    return None;
                }
                // The scale leads from that unit to the variable's.
                Some(_) => {}
                None => to_si = *unit,
            }
        }
        for x in reading {
            *x = to_si.to_si(said.map_or(*x, |c| c.value(*x)));
        }
        Some(own.unwrap_or_else(|| unit.as_ref().map_or_else(String::new, |(_, u)| u.si())))
    }
}

/// One more sample; of two at one time the first is what was there just before.
fn sample(times: &mut Vec<f64>, values: &mut Vec<f64>, t: f64, x: f64) {
    if times.last() == Some(&t) {
        let n = times.len();
        if values[n - 1] == x || n == 1 {
            values[n - 1] = x;
            return;
        }
        times[n - 1] = t - JUMP * (t - times[n - 2]);
    }
    times.push(t);
    values.push(x);
}
