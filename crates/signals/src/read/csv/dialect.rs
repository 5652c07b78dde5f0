//! How a CSV is written: what separates its columns, which mark numbers have.

use std::path::Path;

use crate::finding::{Finding, FindingKind};

/// What separates columns, with its name in messages; where several may, the first of them does: commas occur in names and numbers
/// too.
const SEPARATORS: [(char, &str); 4] =
    [(';', "semicolons"), ('\t', "tabs"), ('|', "vertical bars"), (',', "commas")];

/// How cells are separated and read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Dialect {
    pub(super) separator: char,
}

/// What a cell is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CsvCell {
    /// Nothing was measured.
    Missing,
    /// A number, or a truth value as 0 or 1.
    Number(f64),
    /// Text.
    Word,
}

impl Dialect {
    /// Of the first line and the one below it.
    ///
    /// # Errors
    /// What the first line alone shows.
    pub(super) fn of(file: &Path, head: &[u8], below: &[u8]) -> Result<Self, Box<Finding>> {
        let wrong =
            |kind, what: &str, mend: &str| Err(Box::new(Finding::error(kind, file, what, mend).line(1)));
        if head.is_empty() {
            return Err(Box::new(Finding::error(
                FindingKind::EmptyFile,
                file,
                "the file is empty",
                "export the recording again",
            )));
        }
        if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
            return wrong(FindingKind::Encoding, "the file is UTF-16", "save it as UTF-8");
        }
        if head.contains(&0) {
            return wrong(
                FindingKind::Encoding,
                "there are zero bytes: this is no text",
                "save it as CSV in UTF-8",
            );
        }
        let Ok(text) = std::str::from_utf8(head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head)) else {
            return wrong(FindingKind::Encoding, "the header is not UTF-8", "save the file as UTF-8");
        };
        let below = String::from_utf8_lossy(below);
        let Some(dialect) = Self::separated(text.trim_end(), below.trim_end()) else {
            let cells = text.split_whitespace().count();
            if cells > 1 && cells == below.split_whitespace().count() {
                let mend = "separate them by commas, semicolons or tabs";
                return wrong(FindingKind::Separator, "the columns are separated by blanks", mend);
            }
            // A single column, whatever it is.
            return Ok(Self { separator: ',' });
        };
        let cells: Vec<_> = text.trim().split(dialect.separator).map(str::trim).collect();
        if cells.iter().all(|c| matches!(dialect.cell(c), CsvCell::Number(_))) {
            let mend = "name the columns in the first line, the first one `time`";
            return wrong(FindingKind::NoHeader, "the first line holds numbers, no names", mend);
        }
        Ok(dialect)
    }

    /// The separator that makes as many cells of both lines, else the one that makes most of the first; none: there is none.
    fn separated(head: &str, below: &str) -> Option<Self> {
        let count = |text: &str, c: char| fields(text, c).max(usize::from(c == ',') * commas(text));
        let fits = |c: char| count(head, c) == count(below, c);
        let (separator, cells) = SEPARATORS
            .map(|(c, _)| (c, count(head, c)))
            .into_iter()
            .rev() // of equals the first in the list counts
            .max_by_key(|(c, cells)| (*cells > 1, fits(*c), *cells))?;
        (cells > 1).then_some(Self { separator })
    }

    /// The separator in words; `None`: commas, which are usual.
    pub(super) fn unusual(self) -> Option<&'static str> {
        SEPARATORS.iter().find(|(c, _)| *c != ',' && *c == self.separator).map(|(_, name)| *name)
    }

    /// Where commas separate no columns they may be decimal marks.
    pub(super) fn cell(self, text: &str) -> CsvCell {
        let of = |number: Option<f64>| number.map_or(CsvCell::Word, CsvCell::Number);
        match text {
            "" | "NA" | "null" => CsvCell::Missing,
            "true" | "True" | "TRUE" => CsvCell::Number(1.0),
            "false" | "False" | "FALSE" => CsvCell::Number(0.0),
            text if self.separator != ',' && text.contains(',') && !text.contains('.') => {
                of(text.replacen(',', ".", 1).parse().ok())
            }
            text => of(text.parse().ok()),
        }
    }
}

/// Cells of a line, those in quotes and in brackets (`u[1,2]`) not separated.
fn fields(text: &str, separator: char) -> usize {
    let (mut cells, mut quoted, mut depth) = (1, false, 0_u32);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            _ if quoted => {}
            '[' => depth += 1,
            ']' => depth = depth.saturating_sub(1),
            c if c == separator && depth == 0 => cells += 1,
            _ => {}
        }
    }
    cells
}

/// Cells between commas as every reader of CSV separates them, where nothing else separates any.
fn commas(text: &str) -> usize {
    let others = SEPARATORS.iter().any(|(c, _)| *c != ',' && fields(text, *c) > 1);
    if others { 0 } else { fields(&text.replace(['[', ']'], ""), ',') }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn separator(head: &str, below: &str) -> Option<char> {
        Dialect::separated(head, below).map(|d| d.separator)
    }

    #[test]
    fn the_separator_is_the_one_that_both_lines_agree_on() {
        assert_eq!(separator("time,a;b", "0,1"), Some(','));
        assert_eq!(separator("time;u", "0;0,5"), Some(';'));
        assert_eq!(separator("time;u[1,2];v", "0;0,5;1,5"), Some(';'));
        assert_eq!(separator("time\tu", "0\t1"), Some('\t'));
        assert_eq!(separator("time|u", ""), Some('|'));
        assert_eq!(separator("time;force, N", "0;0,5"), Some(';'));
        assert_eq!(separator("time", "0"), None);
    }

    #[test]
    fn commas_are_decimal_marks_where_they_separate_nothing() {
        let [semicolons, commas] = [';', ','].map(|separator| Dialect { separator });
        assert_eq!(semicolons.cell("-0,5e-3"), CsvCell::Number(-0.5e-3));
        assert_eq!(semicolons.cell("1.234,5"), CsvCell::Word);
        assert_eq!(semicolons.cell("1,234,5"), CsvCell::Word);
        assert_eq!(commas.cell("0,5"), CsvCell::Word);
        assert_eq!([commas.cell(""), commas.cell("True")], [CsvCell::Missing, CsvCell::Number(1.0)]);
    }
}
