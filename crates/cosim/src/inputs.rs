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
