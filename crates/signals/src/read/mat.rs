//! MAT files of MATLAB: level 5 (`save -v6`, `-v7`) and level 7.3 (HDF5); HDF5 files of other programs.

mod array;
mod hdf5;
mod level5;

use std::path::Path;

use super::guard::guarded;
use super::table::{ReadTable, TableColumn};
use crate::finding::{Finding, FindingKind};
use crate::names::element_name;
use array::{Array, Contents};

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

pub(super) fn read(file: &Path, bytes: Vec<u8>, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    match contents(bytes) {
        Ok(contents) => table(file, contents, findings),
        Err((kind, what, mend)) => {
            findings.push(Finding::error(kind, file, what, mend));
            None
        }
    }
}

/// An HDF5 file of another program. Its datasets have one length, as the rows of a table.
pub(super) fn read_hdf5(file: &Path, bytes: Vec<u8>, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    let wrong = |kind, what: String, mend: &str| Finding::error(kind, file, what, mend);
    let again = "write it again with h5py, numbers as datasets, compressed by gzip or not at all";
    if bytes.is_empty() {
        findings.push(wrong(
            FindingKind::EmptyFile,
            "the file is empty".into(),
            "export the recording again",
        ));
        return None;
    }
    let read = guarded(|| hdf5::read_paths(bytes).map_err(|e| e.to_string())).and_then(|done| done);
    let contents = match read {
        Ok(contents) => contents,
        Err(e) => {
            findings.push(wrong(FindingKind::Unreadable, format!("no HDF5 that can be read: {e}"), again));
            return None;
        }
    };
    // A table has one clock: with several none is chosen for the user.
    let lengths = |a: &Array| (a.size.first().copied().unwrap_or(0), a.name.clone());
    let mut rows: Vec<(usize, String)> = contents.arrays.iter().map(lengths).filter(|r| r.0 > 1).collect();
    rows.sort_by_key(|r| std::cmp::Reverse(r.0));
    if let (Some(most), Some(least)) = (rows.first(), rows.last())
        && most.0 != least.0
    {
        let what = format!("`{}` has {} rows, `{}` has {}", most.1, most.0, least.1, least.0);
        let mend = "put the signals of one clock into a file of their own";
        findings.push(wrong(FindingKind::Unreadable, what, mend));
        return None;
    }
    table(file, contents, findings)
}

/// All variables, or the error and its remedy.
fn contents(bytes: Vec<u8>) -> Result<Contents, (FindingKind, String, &'static str)> {
    let again = "save it again in MATLAB with save(..., '-v7'), or in Python with scipy.io.savemat";
    // MATLAB puts 512 bytes of its own before it.
    let hdf5 = [0, 512].iter().any(|at| bytes.get(*at..).is_some_and(|rest| rest.starts_with(SIGNATURE)));
    if bytes.is_empty() {
        return Err((FindingKind::EmptyFile, "the file is empty".into(), "export the recording again"));
    }
    if hdf5 {
        let read = guarded(|| hdf5::read(bytes).map_err(|e| e.to_string())).and_then(|done| done);
        return read.map_err(|e| {
            (FindingKind::Unreadable, format!("no HDF5 (MAT 7.3) that can be read: {e}"), again)
        });
    }
    let head = bytes.get(..level5::HEADER);
    if !head.is_some_and(|head| matches!(&head[126..], b"IM" | b"MI")) || bytes.starts_with(b"MATLAB 7.3") {
        return Err((FindingKind::Unreadable, "no MAT file of level 5 or 7.3".into(), again));
    }
    guarded(|| level5::read(&bytes))
        .map_err(|e| (FindingKind::Unreadable, format!("no MAT file that can be read: {e}"), again))
}

fn table(file: &Path, contents: Contents, findings: &mut Vec<Finding>) -> Option<ReadTable> {
    let Contents { arrays, skipped } = contents;
    let mut table = ReadTable { skipped, ..ReadTable::default() };
    let rows = arrays.iter().filter_map(|a| a.size.iter().max().copied()).max().unwrap_or(0);
    for Array { name, size, values } in arrays {
        match size[..] {
            [n, 1] | [1, n] if n == rows => {
                table.columns.push(TableColumn::numbers(name, values));
            }
            [n, columns] if n == rows && n > 0 => {
                // Columns one after the other.
                for (k, values) in values.chunks(n).enumerate().take(columns) {
                    let element = element_name(&name, &[k + 1]);
                    table.columns.push(TableColumn::numbers(element, values.to_vec()));
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
    if table.columns.is_empty() {
        let mend = "save the signals as columns of one length, the time as `time`";
        findings.push(Finding::error(
            FindingKind::EmptyFile,
            file,
            "there is no numeric array in the file",
            mend,
        ));
        return None;
    }
    Some(table)
}
