//! MAT files of MATLAB: level 5 (`save -v6`, `-v7`).

use std::path::Path;

use matfile::{MatFile, NumericData};

use super::Table;
use crate::finding::{Finding, Kind};
use crate::names::element_name;

const HEADER: usize = 128;

pub(super) fn read(file: &Path, bytes: &[u8], findings: &mut Vec<Finding>) -> Option<Table> {
    let fail = |what: &str, mend: &str| Some(Finding::error(Kind::Unreadable, file, what, mend));
    let hdf5 =
        bytes.get(..8) == Some(b"\x89HDF\r\n\x1a\n") || bytes.get(512..520) == Some(b"\x89HDF\r\n\x1a\n");
    let wrong = if bytes.is_empty() {
        Some(Finding::error(Kind::EmptyFile, file, "the file is empty", "export the recording again"))
    } else if hdf5 || bytes.starts_with(b"MATLAB 7.3") {
        fail(
            "a MAT file of version 7.3 (HDF5), which is not read here",
            "save it again in MATLAB with save(..., '-v7'), or in Python with scipy.io.savemat",
        )
    } else if bytes.len() < HEADER || !(&bytes[126..128] == b"IM" || &bytes[126..128] == b"MI") {
        fail("no MAT file of level 5", "save it in MATLAB with save(..., '-v7')")
    } else {
        None
    };
    if let Some(wrong) = wrong {
        findings.push(wrong);
        return None;
    }
    let mut arrays = Vec::new();
    let mut table = Table::default();
    let mut count = 0;
    for element in elements(bytes) {
        count += 1;
        // One by one: a struct or a cell, which the library passes over in silence, is told, and harms no other.
        let mut alone = bytes[..HEADER].to_vec();
        alone.extend_from_slice(element);
        let found = MatFile::parse(alone.as_slice()).ok().and_then(|mat| mat.arrays().first().cloned());
        match found.as_ref().and_then(|a| Some((a.name().to_owned(), a.size().clone(), numbers(a.data())?))) {
            Some(array) => arrays.push(array),
            None => table.skipped.push(format!(
                "variable {count} is no real numeric array (a struct, cell, text or sparse matrix?) and is left out"
            )),
        }
    }
    let rows = arrays.iter().filter_map(|(_, size, _)| size.iter().max().copied()).max().unwrap_or(0);
    for (name, size, values) in arrays {
        match size[..] {
            [n, 1] | [1, n] if n == rows => {
                table.names.push(name);
                table.columns.push(values);
            }
            [n, columns] if n == rows && n > 0 => {
                // Columns one after the other.
                for (k, values) in values.chunks(n).enumerate().take(columns) {
                    table.names.push(element_name(&name, &[k + 1]));
                    table.columns.push(values.to_vec());
                }
            }
            _ => {
                let size: Vec<_> = size.iter().map(ToString::to_string).collect();
                let size = size.join(" x ");
                table
                    .skipped
                    .push(format!("`{name}` ({size}) is no signal of {rows} samples and is left out"));
            }
        }
    }
    if table.names.is_empty() {
        let mend = "save the signals as columns of one length, the time as `time`";
        findings.push(Finding::error(Kind::EmptyFile, file, "there is no numeric array in the file", mend));
        return None;
    }
    Some(table)
}

/// The top-level data elements, tags included.
fn elements(bytes: &[u8]) -> impl Iterator<Item = &[u8]> {
    let little = &bytes[126..128] == b"IM";
    let word = move |at: usize| -> Option<u32> {
        let four: [u8; 4] = bytes.get(at..at + 4)?.try_into().ok()?;
        Some(if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) })
    };
    let mut at = HEADER;
    std::iter::from_fn(move || {
        let (kind, size) = (word(at)?, word(at + 4)? as usize);
        // Compressed ones (15) are not padded.
        let padded = if kind == 15 { size } else { size.checked_next_multiple_of(8)? };
        let end = at.checked_add(8)?.checked_add(padded)?.min(bytes.len());
        let element = &bytes[at..end];
        at = end;
        Some(element)
    })
}

fn numbers(data: &NumericData) -> Option<Vec<f64>> {
    macro_rules! real {
        ($($variant:ident),*) => {
            match data {
                $(NumericData::$variant { real, imag: None } => Some(real.iter().map(|x| *x as f64).collect()),)*
                _ => None,
            }
        };
    }
    real!(Int8, UInt8, Int16, UInt16, Int32, UInt32, Int64, UInt64, Single, Double)
}
