//! The lines above the numbers: comments, the names, a line of units.

use std::io::{self, BufRead, Read};

use csv::ByteRecord;

use crate::unit::SignalUnit;

/// The first lines of a file.
pub(super) struct CsvHead {
    /// Lines above the names that begin with `#`.
    pub(super) comments: Vec<u64>,
    /// Lines above the names.
    above: usize,
    /// The line of names.
    pub(super) names: Vec<u8>,
    /// The line under it that is no comment, and comments between.
    pub(super) below: Vec<u8>,
    between: Vec<u8>,
}

impl CsvHead {
    /// Lines that begin with `#` are above the names; if numbers or units follow them, the last of them has the names (numpy's
    /// `savetxt`).
    pub(super) fn read(source: &mut impl BufRead) -> io::Result<Self> {
        let mut next = |line: &mut Vec<u8>| source.by_ref().take(1 << 16).read_until(b'\n', line);
        let mut above: Vec<Vec<u8>> = Vec::new();
        let mut first = Vec::new();
        next(&mut first)?;
        while comment(&first) {
            above.push(std::mem::take(&mut first));
            next(&mut first)?;
        }
        let of_numbers = !above.is_empty() && (numbers(&first) || is_units(&first));
        let (names, mut below) = match above.pop_if(|_| of_numbers || first.is_empty()) {
            Some(names) => (bare(&names), first),
            None => (first, Vec::new()),
        };
        let mut between = Vec::new();
        if below.is_empty() {
            next(&mut below)?;
            while comment(&below) {
                between.append(&mut below);
                next(&mut below)?;
            }
        }
        let comments = (1..=above.len() as u64).collect();
        Ok(Self { comments, above: above.len(), names, below, between })
    }

    /// The line of the names, from 1.
    pub(super) fn line(&self) -> u64 {
        self.above as u64 + 1
    }

    /// All of it, with empty lines where comments were above the names: lines are counted as in the file.
    pub(super) fn text(&self) -> Vec<u8> {
        let above = vec![b'\n'; self.above];
        [above.as_slice(), &self.names, &self.between, &self.below].concat()
    }
}

fn comment(line: &[u8]) -> bool {
    line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii_start().starts_with(b"#")
}

/// The names of a line that begins with `#`.
fn bare(line: &[u8]) -> Vec<u8> {
    let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii_start();
    line.strip_prefix(b"#").unwrap_or(line).trim_ascii_start().to_vec()
}

fn cells(line: &[u8]) -> Vec<String> {
    let text = String::from_utf8_lossy(line);
    let separators: &[char] = if text.contains([';', '\t', '|']) { &[';', '\t', '|'] } else { &[','] };
    text.split(separators).map(|cell| cell.trim().trim_matches('"').to_owned()).collect()
}

/// The first cell begins as numbers and dates do.
fn numbers(line: &[u8]) -> bool {
    cells(line)
        .first()
        .is_some_and(|cell| cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)))
}

fn is_units(line: &[u8]) -> bool {
    let cells = cells(line);
    units(&ByteRecord::from(cells.iter().map(String::as_bytes).collect::<Vec<_>>()), cells.len()).is_some()
}

/// The cells of a line of units, without brackets: none of them is a number, each is a unit or empty, at least one is a unit.
pub(super) fn units(record: &ByteRecord, cells: usize) -> Option<Vec<String>> {
    let mut units = Vec::with_capacity(cells);
    for cell in record.iter().take(cells) {
        let text = std::str::from_utf8(cell).ok()?.trim();
        let bare = [('[', ']'), ('(', ')')]
            .into_iter()
            .find_map(|(open, close)| text.strip_prefix(open)?.strip_suffix(close))
            .unwrap_or(text)
            .trim();
        let none = matches!(bare, "" | "-");
        if text.parse::<f64>().is_ok() || !none && SignalUnit::parse(bare).is_none() {
            return None;
        }
        units.push(if none { String::new() } else { bare.to_owned() });
    }
    units.iter().any(|u| !u.is_empty()).then_some(units)
}
