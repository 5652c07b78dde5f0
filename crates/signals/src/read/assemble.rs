//! A table and what is known of it become a recording.

use std::collections::BTreeMap;
use std::path::Path;

use super::clock;
use super::sidecar::{Column, Sidecar};
use super::{TOLD, Table};
use crate::finding::{Finding, Kind};
use crate::names::{base_name, nearest, suggestion};
use crate::recording::{Channel, Recording, Settings};
use crate::unit::Unit;
use crate::variable::{Role, Variable};

pub(super) fn assemble(
    file: &Path,
    mut table: Table,
    sidecar: &Sidecar,
    known: &[Variable],
    declared: &BTreeMap<String, Settings>,
    findings: &mut Vec<Finding>,
) -> Recording {
    let name = file.file_name().map_or_else(String::new, |n| n.to_string_lossy().into_owned());
    let mut recording =
        Recording { name, file: file.into(), parameters: sidecar.parameters.clone(), ..Recording::default() };
    rename_elements(&mut table, known);
    for skipped in &table.skipped {
        let mend = "nothing, if it is no signal; else save it as a numeric column as long as the time";
        findings.push(Finding::note(Kind::Skipped, file, skipped.clone(), mend));
    }
    for (name, column) in &sidecar.columns {
        let has = |n: &String| n == name || base_name(n) == name;
        if !table.names.iter().any(has) {
            let mend = suggestion(name, table.names.iter().map(String::as_str), "remove it");
            let what = format!("{} has no column `{name}`", file.display());
            findings.push(Finding::error(Kind::UnknownColumn, &sidecar.file, what, mend).line(column.line));
        }
    }
    let Some(time) = clock::take(file, &mut table, sidecar, !known.is_empty(), findings) else {
        return recording;
    };
    (recording.start, recording.end) =
        (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(0.0));
    for i in 0..table.names.len() {
        let reading = std::mem::take(&mut table.columns[i]);
        let column = Source { file, table: &table, index: i, sidecar };
        if let Some(channel) = column.channel(&time, reading, known, findings) {
            if recording.channel(&channel.name).is_some() {
                let what = format!("two columns are `{}`", channel.name);
                let mend = "leave one out: [columns] of the sidecar, name = false";
                findings.push(Finding::error(Kind::DuplicateName, file, what, mend).channel(&channel.name));
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

/// What the case says of channels, then what the sidecar says; an array's name holds for its elements.
fn declare(
    recording: &mut Recording,
    sidecar: &Sidecar,
    declared: &BTreeMap<String, Settings>,
    findings: &mut Vec<Finding>,
) {
    for channel in &mut recording.channels {
        let names = [base_name(&channel.name).to_owned(), channel.name.clone()];
        for settings in names.iter().filter_map(|n| declared.get(n)) {
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
            findings.push(Finding::error(Kind::UnknownChannel, &sidecar.file, what, mend).line(*line));
        }
    }
}

/// FMPy writes a matrix as one column: its elements are counted through, those of the model have two indices.
fn rename_elements(table: &mut Table, known: &[Variable]) {
    let mut renamed = Vec::new();
    for (i, name) in table.names.iter().enumerate() {
        let base = base_name(name);
        if base == name || known.iter().any(|v| v.name == *name) {
            continue;
        }
        let elements: Vec<_> = known.iter().filter(|v| base_name(&v.name) == base).collect();
        let columns: Vec<_> =
            (0..table.names.len()).filter(|k| base_name(&table.names[*k]) == base).collect();
        if let (true, Some(k)) = (elements.len() == columns.len(), columns.iter().position(|k| *k == i)) {
            renamed.push((i, elements[k].name.clone()));
        }
    }
    for (i, name) in renamed {
        table.names[i] = name;
    }
}

/// One column on its way to a channel.
struct Source<'a> {
    file: &'a Path,
    table: &'a Table,
    index: usize,
    sidecar: &'a Sidecar,
}

impl Source<'_> {
    fn channel(
        &self,
        time: &[f64],
        mut reading: Vec<f64>,
        known: &[Variable],
        findings: &mut Vec<Finding>,
    ) -> Option<Channel> {
        let own = &self.table.names[self.index];
        let name = self.sidecar.variable(own)?;
        let found = known.iter().find(|v| v.name == name && v.role != Role::Parameter);
        if found.is_none() && !known.is_empty() {
            findings.push(self.unknown(&name, known));
            return None;
        }
        let unit = self.convert(&mut reading, found, findings)?;
        let (mut times, mut values) = (Vec::with_capacity(time.len()), Vec::with_capacity(time.len()));
        let mut infinite = 0;
        for (row, (&t, &x)) in time.iter().zip(&reading).enumerate() {
            if x.is_finite() {
                times.push(t);
                values.push(x);
            } else if x.is_infinite() {
                infinite += 1;
                if infinite <= TOLD {
                    let mend = "leave the cell empty if nothing was measured";
                    let finding = Finding::error(Kind::InfiniteValue, self.file, "an infinite value", mend);
                    findings.push(finding.line(self.table.line(row)).channel(&name).time(t));
                }
            }
        }
        if values.is_empty() && infinite == 0 {
            let what = "there is no value in the whole column";
            findings.push(
                Finding::error(Kind::NoValue, self.file, what, "fill the column or remove it").channel(&name),
            );
            return None;
        }
        Some(Channel::new(&name, &unit, times, values))
    }

    fn unknown(&self, name: &str, known: &[Variable]) -> Finding {
        let free = |v: &&Variable| v.role != Role::Parameter && !self.table.names.contains(&v.name);
        let mend = match nearest(name, known.iter().filter(free).map(|v| v.name.as_str())) {
            Some(near) => format!("did you mean `{near}`? Rename it, or map it in the sidecar's [columns]"),
            None => {
                format!("map it in the sidecar: [columns] \"{name}\" = \"...\", or false to leave it out")
            }
        };
        let what = "the model has no such input or output; the column is left out";
        Finding::warning(Kind::UnknownColumn, self.file, what, mend).line(1).channel(name)
    }

    /// Readings become values in the variable's unit; its name.
    fn convert(
        &self,
        reading: &mut [f64],
        known: Option<&Variable>,
        findings: &mut Vec<Finding>,
    ) -> Option<String> {
        let own = known.map(|v| v.unit.clone());
        let Some(column) = self.sidecar.column(&self.table.names[self.index]) else {
            return Some(own.unwrap_or_default());
        };
        let Column { scale, unit, line, .. } = column;
        let mut to_si = Unit::ONE;
        if let Some((text, unit)) = unit {
            let wanted = own.as_deref().and_then(Unit::parse);
            match wanted {
                Some(wanted) if unit.fits(&wanted) => {
                    // The model's unit may itself be a multiple of SI.
                    to_si = Unit { factor: unit.factor / wanted.factor, ..*unit };
                }
                Some(_) if scale.is_none() => {
                    let own = own.unwrap_or_default();
                    let what = format!("`{text}` cannot be the unit of a variable in `{own}`");
                    let mend = format!("correct it, or give the `scale` from {text} to {own}");
                    findings.push(Finding::error(Kind::Unit, &self.sidecar.file, what, mend).line(*line));
                    return None;
                }
                // The scale leads from that unit to the variable's.
                Some(_) => {}
                None => to_si = *unit,
            }
        }
        for x in reading {
            *x = to_si.to_si(column.value(*x));
        }
        Some(own.unwrap_or_else(|| unit.as_ref().map_or_else(String::new, |(_, u)| u.si())))
    }
}
