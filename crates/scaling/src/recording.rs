//! Recordings and results as CSV: the time and every column by its unit.

use std::io::{Read, Write};
use std::path::Path;

use crate::error::ScalingError;
use crate::law::{AffineScale, Lawless, ScalingLaw};

/// Writes the table again, `time` and the columns scaled; empty cells and `nan` stay as they are.
/// `scale_of` gives the scale of a column.
///
/// # Errors
/// [`ScalingError::File`] with line or column and the remedy.
pub fn scale(
    file: &Path,
    from: impl Read,
    to: impl Write,
    law: &ScalingLaw,
    mut scale_of: impl FnMut(&str) -> Result<AffineScale, String>,
) -> Result<(), ScalingError> {
    let fail = |e: csv::Error| {
        let line = e.position().map_or_else(String::new, |p| format!("line {}: ", p.line()));
        ScalingError::at(file, format!("{line}{e}"))
    };
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(from);
    let names = reader.headers().map_err(fail)?.clone();
    if names.get(0) != Some("time") {
        return Err(ScalingError::at(file, "line 1: the first column is `time`, in s; name it so"));
    }
    let mut scales = vec![law.time()];
    let mut wrong = Vec::new();
    for name in names.iter().skip(1) {
        match scale_of(name) {
            Ok(scale) => scales.push(scale),
            Err(why) => wrong.push(format!("line 1: column `{name}`: {why}")),
        }
    }
    if !wrong.is_empty() {
        let all = wrong.iter().map(|why| format!("{}: {why}", file.display())).collect::<Vec<_>>().join("\n");
        let bare = all.strip_prefix(&format!("{}: ", file.display())).unwrap_or(&all).to_owned();
        return Err(ScalingError::at(file, bare));
    }
    let mut writer = csv::Writer::from_writer(to);
    writer.write_record(&names).map_err(fail)?;
    let mut record = csv::StringRecord::new();
    while reader.read_record(&mut record).map_err(fail)? {
        let mut cells = Vec::with_capacity(record.len());
        for ((cell, scale), name) in record.iter().zip(&scales).zip(&names) {
            cells.push(match cell.parse::<f64>() {
                _ if cell.is_empty() || scale.is_one() => cell.to_owned(),
                Ok(x) if x.is_nan() => cell.to_owned(),
                Ok(x) => format!("{:?}", scale.apply(x)),
                Err(_) => {
                    let line = record.position().map_or(0, csv::Position::line);
                    let mend = "write one number, or nothing";
                    return Err(ScalingError::at(
                        file,
                        format!("line {line}: column `{name}`: {cell:?} is no number; {mend}"),
                    ));
                }
            });
        }
        writer.write_record(cells).map_err(fail)?;
    }
    writer.flush().map_err(|e| ScalingError::at(file, e))
}

/// A refusal with the column's unit.
pub fn refused(unit: &str, why: &Lawless) -> String {
    if unit.is_empty() { why.to_string() } else { format!("in {unit}: {why}") }
}
