//! Inputs from CSV.

use std::path::{Path, PathBuf};

use crate::error::Error;

/// Columns over time; missing samples are left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Inputs {
    /// Where they come from.
    pub file: PathBuf,
    /// Name, times in s (increasing), values.
    pub columns: Vec<(String, Vec<f64>, Vec<f64>)>,
    /// Last time in s.
    pub end: f64,
}

impl Inputs {
    /// Reads a file: a header, first column `time` in s, strictly increasing; empty cells and `nan` are missing.
    ///
    /// # Errors
    /// [`Error::Inputs`] with line and column.
    pub fn read(file: &Path) -> Result<Self, Error> {
        let fail = |reason: String| Error::Inputs { file: file.into(), reason };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(file);
        let reader = reader.as_mut().map_err(|e| fail(e.to_string()))?;
        let header = reader.headers().map_err(|e| fail(e.to_string()))?.clone();
        if header.get(0) != Some("time") {
            return Err(fail(format!(
                "the first column is {:?}; name it `time`",
                header.get(0).unwrap_or("")
            )));
        }
        let mut columns: Vec<_> =
            header.iter().skip(1).map(|name| (name.to_owned(), Vec::new(), Vec::new())).collect();
        let mut end = f64::NEG_INFINITY;
        for record in reader.records() {
            let record = record.map_err(|e| fail(e.to_string()))?;
            let line = record.position().map_or(0, csv::Position::line);
            let bad = |name: &str, cell: &str| fail(format!("line {line}, {name}: {cell:?} is no number"));
            let time = number(&record[0]).filter(|t| t.is_finite()).ok_or_else(|| bad("time", &record[0]))?;
            if time <= end {
                return Err(fail(format!(
                    "line {line}: time {time:?} does not increase after {end:?}; sort the rows"
                )));
            }
            end = time;
            for ((name, times, values), cell) in columns.iter_mut().zip(record.iter().skip(1)) {
                let value = number(cell).filter(|v| !v.is_infinite()).ok_or_else(|| bad(name, cell))?;
                if !value.is_nan() {
                    times.push(time);
                    values.push(value);
                }
            }
        }
        if end == f64::NEG_INFINITY {
            return Err(fail("there is no row after the header".into()));
        }
        match columns.iter().find(|(_, times, _)| times.is_empty()) {
            Some((name, ..)) => Err(fail(format!("the column {name} has no value; fill it or remove it"))),
            None => Ok(Self { file: file.into(), columns, end }),
        }
    }

    /// Columns from memory: `file` is what messages call them, times in s and strictly increasing, `nan` is missing.
    ///
    /// # Errors
    /// [`Error::Inputs`] with column and row, from 0.
    pub fn of(file: &Path, columns: Vec<(String, Vec<f64>, Vec<f64>)>) -> Result<Self, Error> {
        let fail = |reason: String| Err(Error::Inputs { file: file.into(), reason });
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
            if let Some(row) = times.windows(2).position(|w| w[1] <= w[0]) {
                let (before, t) = (times[row], times[row + 1]);
                let row = row + 1;
                return fail(format!(
                    "`{name}`, row {row}: time {t:?} does not increase after {before:?}; sort the rows"
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
            kept.push((name, times, values));
        }
        Ok(Self { file: file.into(), columns: kept, end })
    }

    /// Value of a column at `time`: on the line between samples, or held from the one before; the first and
    /// the last value go on beyond the ends.
    pub fn at(&self, column: usize, time: f64, linear: bool) -> f64 {
        let (_, t, x) = &self.columns[column];
        let next = t.partition_point(|t| *t <= time);
        match (next.checked_sub(1), next < t.len()) {
            (None, _) => x[0],
            (Some(i), true) if linear => x[i] + (x[next] - x[i]) * ((time - t[i]) / (t[next] - t[i])),
            (Some(i), _) => x[i],
        }
    }

    /// The next time after `time` at which a column jumps (held) or bends (on lines); infinite if there is none.
    pub(crate) fn next_bend(&self, column: usize, time: f64, linear: bool) -> f64 {
        let (_, t, x) = &self.columns[column];
        let next = t.partition_point(|t| *t <= time);
        let slope = |i: usize| match (i.checked_sub(1), i < t.len()) {
            (Some(before), true) if linear => (x[i] - x[before]) / (t[i] - t[before]),
            _ => 0.0,
        };
        let bends = |i: &usize| if linear { slope(*i) != slope(i + 1) } else { *i == 0 || x[*i] != x[i - 1] };
        (next..t.len()).find(bends).map_or(f64::INFINITY, |i| t[i])
    }
}

fn number(cell: &str) -> Option<f64> {
    match cell {
        "" => Some(f64::NAN),
        "true" | "True" => Some(1.0),
        "false" | "False" => Some(0.0),
        cell => cell.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Inputs, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Inputs::read(file.path()).map_err(|e| e.to_string())
    }

    #[test]
    fn bends_and_jumps_are_found() {
        let inputs = read("time,u\n1,0\n2,1\n3,2\n4,2\n5,3\n").unwrap();
        let bends = |linear| [0.0, 1.0, 2.5, 3.0, 4.0, 5.0].map(|t| inputs.next_bend(0, t, linear));
        assert_eq!(bends(true), [1.0, 3.0, 3.0, 4.0, 5.0, f64::INFINITY]);
        assert_eq!(bends(false), [1.0, 2.0, 3.0, 5.0, 5.0, f64::INFINITY]);
    }

    #[test]
    fn missing_samples_are_bridged_and_ends_go_on() {
        let inputs = read("time,\"u[1,2]\",b\n0,1,True\n1,,nan\n2,5,0\n").unwrap();
        assert_eq!(inputs.columns[0].0, "u[1,2]");
        let u = |t| inputs.at(0, t, true);
        assert_eq!([u(-1.0), u(0.5), u(1.0), u(2.0), u(9.0)], [1.0, 2.0, 3.0, 5.0, 5.0]);
        assert_eq!([inputs.at(1, 1.9, false), inputs.at(1, 2.0, false)], [1.0, 0.0]);
    }

    #[test]
    fn columns_from_memory_are_as_those_of_a_file() {
        let from_file = read("time,u\n0,1\n1,\n2,5\n").unwrap();
        let column = ("u".to_owned(), vec![0.0, 1.0, 2.0], vec![1.0, f64::NAN, 5.0]);
        assert_eq!(Inputs::of(&from_file.file, vec![column]).unwrap(), from_file);
        let of = |times: &[f64], values: &[f64]| {
            let column = ("u".to_owned(), times.to_vec(), values.to_vec());
            Inputs::of("inputs".as_ref(), vec![column]).unwrap_err().to_string()
        };
        assert!(of(&[0.0, 1.0], &[1.0]).contains("`u` has 1 values at 2 times"));
        assert!(of(&[0.0, 0.0], &[1.0, 1.0]).contains("row 1: time 0.0 does not increase"));
        assert!(of(&[0.0, f64::NAN], &[1.0, 1.0]).contains("row 1: time is NaN"));
        assert!(of(&[0.0], &[f64::INFINITY]).contains("row 0: a value is infinite"));
        assert!(of(&[0.0], &[f64::NAN]).contains("has no value"));
    }

    #[test]
    fn mistakes_are_named_with_line_and_column() {
        for (text, said) in [
            ("t,u\n0,1\n", "`time`"),
            ("time,u\n0,1\n0,2\n", "line 3: time 0.0 does not increase"),
            ("time,u\n0,x\n", "line 2, u: \"x\""),
            ("time,u\n0,\n", "column u has no value"),
            ("time,u\n", "no row"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(said), "{error}");
        }
    }
}
