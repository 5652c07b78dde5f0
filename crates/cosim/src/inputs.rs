//! Inputs over time: columns of a file or from memory, and what they are worth to a variable.

use std::path::{Path, PathBuf};

use trueup_fmi_description::description::{Description, DescriptionVariable, VariableType};
use trueup_signals::{Finding, InputColumn, InputTable, Interpolation, SignalUnit};

use crate::buffer::ValueBuffer;
use crate::check::units;
use crate::error::CosimError;
use crate::value;

/// Columns over time; missing samples are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct InputFileTable {
    /// Where they come from.
    pub file: PathBuf,
    /// The columns, in their order.
    pub columns: Vec<InputSignal>,
    /// Last time in s.
    pub end: f64,
    /// What was chosen while reading, to be reported to the user.
    pub notes: Vec<String>,
}

/// A column with samples of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputSignal {
    /// As the file or its sidecar calls it.
    pub name: String,
    /// In s, growing; the same one twice is a jump: the value before, then the one after.
    pub times: Vec<f64>,
    /// As many values; `NaN` where the cell is text.
    pub values: Vec<f64>,
    /// The cells as they are written; none at all where the values say all.
    texts: Vec<String>,
    /// Their lines; none where there are none.
    lines: Vec<u64>,
    unit: Option<(String, SignalUnit)>,
    /// Held between samples, whatever the variable is.
    held: bool,
}

/// Unix times begin with the one of September 2001: a run that begins later uses calendar time.
const CALENDAR: f64 = 1e9;

impl InputFileTable {
    /// Reads a recording of any format (docs/cases.md), with its sidecar; `system` is the file of the system, which is no sidecar, and
    /// `start` (s) where the run begins: a clock of the calendar is counted from its first row unless the run is.
    ///
    /// # Errors
    /// [`CosimError::Inputs`] with line and column.
    pub fn read(file: &Path, system: &Path, start: Option<f64>) -> Result<Self, CosimError> {
        let fail = |reason: String| CosimError::Inputs { file: file.into(), line: None, reason };
        let (mut table, findings) =
            InputTable::read(file, system).map_err(|e| Self::unreadable(file, e.findings()))?;
        let mut notes: Vec<String> = findings.iter().map(ToString::to_string).collect();
        if let Some(epoch) = table.epoch.filter(|_| start.is_some_and(|s| s >= CALENDAR)) {
            table.time.iter_mut().for_each(|t| *t += epoch);
            notes.push(format!("{}: the run is in Unix time, and so are the inputs", file.display()));
        }
        let end = table.time.last().copied().unwrap_or(f64::NEG_INFINITY);
        let columns = std::mem::take(&mut table.columns);
        let mut kept = Vec::with_capacity(columns.len());
        for column in columns {
            kept.push(InputSignal::of(column, &table).map_err(fail)?);
        }
        Ok(Self { file: file.into(), columns: kept, end, notes })
    }

    /// The errors among findings: the first one gives the line; of the others that of the same file is in the text.
    fn unreadable(file: &Path, findings: &[Finding]) -> CosimError {
        let mut errors = findings.iter().filter(|f| f.is_error());
        let first = errors.next();
        // Another file's name, as the sidecar's, is in the text.
        let own = first.filter(|f| f.file == file);
        let message = own.map(Finding::message).or_else(|| first.map(ToString::to_string));
        let rest = errors.map(ToString::to_string);
        let reason = message.into_iter().chain(rest).collect::<Vec<_>>().join("\n  ");
        CosimError::Inputs { file: file.into(), line: own.and_then(|f| f.line), reason }
    }

    /// Columns from memory: `file` is what messages call them, times in s that do not fall, `nan` is missing.
    ///
    /// # Errors
    /// [`CosimError::Inputs`] with column and row, from 0.
    pub fn of(file: &Path, columns: Vec<(String, Vec<f64>, Vec<f64>)>) -> Result<Self, CosimError> {
        let fail = |reason: String| Err(CosimError::Inputs { file: file.into(), line: None, reason });
        let mut kept = Vec::with_capacity(columns.len());
        let mut end = f64::NEG_INFINITY;
        for (name, times, values) in columns {
            if times.len() != values.len() {
                let (t, x) = (times.len(), values.len());
                return fail(format!("`{name}` has {x} values at {t} times; give one value for each time"));
            }
            if let Some(row) = times.iter().position(|t| !t.is_finite()) {
                return fail(format!("`{name}`, row {row}: time is {}; leave that row out", times[row]));
            }
            if let Some(row) = times.windows(2).position(|w| w[1] < w[0]) {
                let (before, t) = (times[row], times[row + 1]);
                let row = row + 1;
                return fail(format!(
                    "`{name}`, row {row}: time falls from {before:?} to {t:?}; sort the rows"
                ));
            }
            if let Some(row) = times.windows(3).position(|w| w[0] == w[2]) {
                let (row, t) = (row + 2, times[row]);
                return fail(format!(
                    "`{name}`, row {row}: time {t:?} is there more than twice; a jump has two rows, the value before and the one after"
                ));
            }
            if let Some(row) = values.iter().position(|x| x.is_infinite()) {
                return fail(format!(
                    "`{name}`, row {row}: a value is infinite; use nan for what is missing"
                ));
            }
            let there = times.into_iter().zip(values).filter(|(_, x)| !x.is_nan());
            let (times, values): (Vec<f64>, Vec<f64>) = there.unzip();
            let Some(last) = times.last() else {
                return fail(format!("`{name}` has no value; fill it or leave it out"));
            };
            end = end.max(*last);
            kept.push(InputSignal { name, times, values, ..InputSignal::default() });
        }
        Ok(Self { file: file.into(), columns: kept, end, notes: Vec::new() })
    }

    /// Value of a column at `time`: on the line between samples, or held from the one before; the first and
    /// the last value go on beyond the ends. At a jump it is the value after it.
    pub fn at(&self, column: usize, time: f64, linear: bool) -> f64 {
        let InputSignal { times, .. } = &self.columns[column];
        self.between(column, times.partition_point(|t| *t <= time), time, linear)
    }

    /// The same just before `time`: at a jump the value before it.
    pub(crate) fn before(&self, column: usize, time: f64, linear: bool) -> f64 {
        let InputSignal { times, .. } = &self.columns[column];
        self.between(column, times.partition_point(|t| *t < time), time, linear)
    }

    fn between(&self, column: usize, next: usize, time: f64, linear: bool) -> f64 {
        let InputSignal { times: t, values: x, .. } = &self.columns[column];
        match (next.checked_sub(1), next < t.len()) {
            (None, _) => x[0],
            (Some(i), true) if linear => x[i] + (x[next] - x[i]) * ((time - t[i]) / (t[next] - t[i])),
            (Some(i), _) => x[i],
        }
    }

    /// The cell that a column holds at `time` as it is written, with items by their numbers; none where its value is sufficient.
    pub fn text(&self, column: usize, time: f64) -> Option<&str> {
        let signal = &self.columns[column];
        let row = signal.times.partition_point(|t| *t <= time).saturating_sub(1);
        signal.texts.get(row).map(String::as_str)
    }

    /// Puts what a column holds at `time` into an element that is no `Float64`, exactly.
    pub(crate) fn put(&self, column: usize, time: f64, linear: bool, buffer: &mut ValueBuffer, at: usize) {
        // Samples that do not fit were refused when the system was checked.
        match self.text(column, time) {
            Some(text) => drop(buffer.parse(at, text)),
            None => drop(buffer.set_number(at, self.at(column, time, linear))),
        }
    }

    /// The next time after `time` at which a column jumps or, on lines, bends; infinite if there is none.
    pub(crate) fn next_bend(&self, column: usize, time: f64, linear: bool) -> f64 {
        let signal = &self.columns[column];
        let (t, x) = (&signal.times, &signal.values);
        let next = t.partition_point(|t| *t <= time);
        let slope = |i: usize| match (i.checked_sub(1), i < t.len()) {
            (Some(before), true) if t[i] > t[before] => (x[i] - x[before]) / (t[i] - t[before]),
            _ => 0.0,
        };
        let bends = |i: &usize| match linear {
            true => t.get(i + 1) == Some(&t[*i]) || slope(*i) != slope(i + 1),
            false => *i == 0 || signal.changes(*i),
        };
        (next..t.len()).find(bends).map_or(f64::INFINITY, |i| t[i])
    }
}

impl InputSignal {
    fn of(column: InputColumn, table: &InputTable) -> Result<Self, String> {
        let InputColumn { name, values, texts, unit, interpolation } = column;
        let mut own =
            Self { name, unit, held: interpolation == Some(Interpolation::Hold), ..Self::default() };
        for (row, (&time, &value)) in table.time.iter().zip(&values).enumerate() {
            let text = texts.get(row).map_or("", String::as_str);
            let missing = value.is_nan()
                && (text.is_empty()
                    || text.trim_start_matches(['+', '-']).eq_ignore_ascii_case("nan")
                    || text == "NA"
                    || text == "null");
            if missing {
                continue;
            }
            if value.is_infinite() {
                let place =
                    table.line(row).map_or_else(|| format!("row {row}"), |line| format!("line {line}"));
                return Err(format!(
                    "{place}, {}: a value is infinite; leave the cell empty if there is none",
                    own.name
                ));
            }
            own.times.push(time);
            own.values.push(value);
            own.lines.extend(table.line(row));
            if !texts.is_empty() {
                own.texts.push(text.to_owned());
            }
        }
        if own.times.is_empty() {
            return Err(format!("the column {} has no value; fill it or remove it", own.name));
        }
        Ok(own)
    }

    /// Sample `i` is another one than that before it.
    pub(crate) fn changes(&self, i: usize) -> bool {
        let Some(before) = i.checked_sub(1) else { return false };
        self.values[i] != self.values[before] && !(self.values[i].is_nan() && self.values[before].is_nan())
            || self.texts.get(i) != self.texts.get(before)
    }

    /// Times at which it jumps, whether or not it is on lines between samples.
    pub(crate) fn jumps(&self, linear: bool) -> impl Iterator<Item = f64> {
        let jumps = move |i: &usize| self.changes(*i) && (!linear || self.times[*i] == self.times[i - 1]);
        (1..self.times.len()).filter(jumps).map(|i| self.times[i])
    }

    /// Time and value of sample `i`.
    fn sample(&self, i: usize) -> String {
        let text =
            self.texts.get(i).map_or_else(|| format!("{:?}", self.values[i]), |text| format!("{text:?}"));
        match self.lines.get(i) {
            Some(line) => format!("line {line}, {}: {text}", self.name),
            None => format!("{}: {text}", self.name),
        }
    }

    /// The value of a variable: converted to its unit (reported in `notes`), items by their numbers, whole numbers to the digit; and whether
    /// it goes on lines between samples, where the variable may.
    pub(crate) fn drives(
        &self,
        d: &Description,
        v: &DescriptionVariable,
        continuous: bool,
        notes: &mut Vec<String>,
    ) -> Result<(Self, bool), String> {
        let mut own = self.clone();
        let (factor, offset) = self.conversion(d, v, notes)?;
        let Some(mut one) = ValueBuffer::new(v.kind, d.version, 1) else {
            return Err(format!("{} takes no values of a file", v.kind.name(d.version)));
        };
        if v.kind.is_float() {
            for (i, x) in own.values.iter_mut().enumerate() {
                if x.is_nan() {
                    return Err(format!("{} is no number", self.sample(i)));
                }
                if (factor, offset) != (1.0, 0.0) {
                    *x = factor * *x + offset;
                }
                if !one.set_number(0, *x) {
                    return Err(format!("{} is no {}", self.sample(i), v.kind.name(d.version)));
                }
            }
            own.texts.clear();
            return Ok((own, continuous && !self.held));
        }
        if (factor, offset) != (1.0, 0.0) {
            return Err(format!("a unit cannot be converted to that of a {}", v.kind.name(d.version)));
        }
        own.texts.clear();
        for (i, x) in self.values.iter().enumerate() {
            let written = self.texts.get(i).filter(|text| value::assign(d, v, &mut one, 0, text).is_ok());
            let items = v.kind == VariableType::Enumeration && !x.is_nan();
            let fits = written.is_some()
                || v.kind != VariableType::String
                    && one.set_number(0, *x)
                    && (!items || value::assign(d, v, &mut one.clone(), 0, &format!("{x:.0}")).is_ok());
            if !fits {
                let why = value::assign(d, v, &mut one, 0, self.texts.get(i).map_or("", String::as_str));
                let wanted =
                    why.err().and_then(|w| w.split_once("; ").map(|(_, wanted)| format!("; {wanted}")));
                return Err(format!(
                    "{} is no {}{}",
                    self.sample(i),
                    v.kind.name(d.version),
                    wanted.unwrap_or_default()
                ));
            }
            one.texts(&mut own.texts);
        }
        Ok((own, false))
    }

    /// Factor and offset from its unit to the variable's.
    fn conversion(
        &self,
        d: &Description,
        v: &DescriptionVariable,
        notes: &mut Vec<String>,
    ) -> Result<(f64, f64), String> {
        let Some((text, _)) = &self.unit else { return Ok((1.0, 0.0)) };
        let (Some(given), Some(own)) = (units::of_everybody(text), units::of(d, v)) else {
            return Ok((1.0, 0.0));
        };
        match units::conversion(&given, &own, d.attributes(v).relative_quantity) {
            units::Conversion::Same => Ok((1.0, 0.0)),
            units::Conversion::By(factor, offset) | units::Conversion::Angle(factor, offset) => {
                notes.push(format!(
                    "column `{}`: {text} converted to {} (times {factor:?})",
                    self.name, own.name
                ));
                Ok((factor, offset))
            }
            units::Conversion::Unknown => Err(format!(
                "it is in {text}, and the variable's unit {} is not defined; take the unit out",
                own.name
            )),
            units::Conversion::Different => {
                let dimension = units::dimension(&own);
                Err(format!(
                    "it is in {text} ({}), the variable in {} ({dimension})",
                    units::dimension(&given),
                    own.name
                ))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<InputFileTable, String> {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("in.csv");
        std::fs::write(&file, text).unwrap();
        InputFileTable::read(&file, Path::new(""), None).map_err(|e| e.to_string())
    }

    #[test]
    fn bends_and_jumps_are_found() {
        let inputs = read("time,u\n1,0\n2,1\n3,2\n4,2\n5,3\n").unwrap();
        let bends = |linear| [0.0, 1.0, 2.5, 3.0, 4.0, 5.0].map(|t| inputs.next_bend(0, t, linear));
        assert_eq!(bends(true), [1.0, 3.0, 3.0, 4.0, 5.0, f64::INFINITY]);
        assert_eq!(bends(false), [1.0, 2.0, 3.0, 5.0, 5.0, f64::INFINITY]);
    }

    #[test]
    fn a_time_twice_is_a_jump() {
        let inputs = read("time,u\n0,0\n0.5,0\n0.5,2\n1,3\n").unwrap();
        let at = |t| (inputs.before(0, t, true), inputs.at(0, t, true));
        assert_eq!([at(0.25), at(0.5), at(0.75)], [(0.0, 0.0), (0.0, 2.0), (2.5, 2.5)]);
        assert_eq!(inputs.columns[0].jumps(true).collect::<Vec<_>>(), [0.5]);
        assert_eq!([0.0, 0.5].map(|t| inputs.next_bend(0, t, true)), [0.5, 1.0]);
    }

    #[test]
    fn missing_samples_are_bridged_and_ends_go_on() {
        let inputs = read("time,\"u[1,2]\",b\n0,1,True\n1,,nan\n2,5,0\n").unwrap();
        assert_eq!(inputs.columns[0].name, "u[1,2]");
        let u = |t| inputs.at(0, t, true);
        assert_eq!([u(-1.0), u(0.5), u(1.0), u(2.0), u(9.0)], [1.0, 2.0, 3.0, 5.0, 5.0]);
        assert_eq!([inputs.at(1, 1.9, false), inputs.at(1, 2.0, false)], [1.0, 0.0]);
    }

    #[test]
    fn columns_from_memory_are_as_those_of_a_file() {
        let from_file = read("time,u\n0,1\n1,\n2,5\n").unwrap();
        let column = || ("u".to_owned(), vec![0.0, 1.0, 2.0], vec![1.0, f64::NAN, 5.0]);
        let of_memory = InputFileTable::of(&from_file.file, vec![column()]).unwrap();
        for t in [-1.0, 0.5, 1.0, 3.0] {
            assert_eq!(of_memory.at(0, t, true), from_file.at(0, t, true));
        }
        let of = |times: &[f64], values: &[f64]| {
            let column = ("u".to_owned(), times.to_vec(), values.to_vec());
            InputFileTable::of("inputs".as_ref(), vec![column]).unwrap_err().to_string()
        };
        assert!(of(&[0.0, 1.0], &[1.0]).contains("`u` has 1 values at 2 times"));
        assert!(of(&[1.0, 0.0], &[1.0, 1.0]).contains("row 1: time falls from 1.0 to 0.0"));
        assert!(of(&[0.0, 0.0, 0.0], &[1.0, 1.0, 2.0]).contains("row 2: time 0.0 is there more than twice"));
        assert!(of(&[0.0, f64::NAN], &[1.0, 1.0]).contains("row 1: time is NaN"));
        assert!(of(&[0.0], &[f64::INFINITY]).contains("row 0: a value is infinite"));
        assert!(of(&[0.0], &[f64::NAN]).contains("has no value"));
    }

    #[test]
    fn mistakes_are_named_with_line_and_column() {
        for (text, said) in [
            ("t,u\n0,1\n", "`time`"),
            ("time,u\n0,1\n0,2\n0,3\n", "csv:3: at 0 s: the clock repeats"),
            ("time,u\n1,1\n0,2\n", "csv:3: at 0 s: the clock jumps back"),
            ("time,u\n0,1e999\n", "line 2, u: a value is infinite"),
            ("time,u\n0,1\nsoon,2\n", "csv:3: time: \"soon\" is no number"),
            ("time,u\n0,\n", "column u has no value"),
            ("time,u\n", "no row"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
    }
}
