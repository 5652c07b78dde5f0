//! CSV: one header line of names; FMPy's results too.

use std::io::{BufRead, Read};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder, Trim};

use super::{TOLD, Table};
use crate::finding::{Finding, Kind};
use crate::names::element_name;

/// Reads all of it, row by row; `None` if there is an error.
pub(super) fn read(file: &Path, mut source: impl BufRead, findings: &mut Vec<Finding>) -> Option<Table> {
    let mut head = Vec::new();
    // The first bytes tell an encoding, the first line a separator.
    let mut first = source.by_ref().take(1 << 16);
    if let Err(e) = first.read_until(b'\n', &mut head) {
        findings.push(Finding::error(Kind::Unreadable, file, e.to_string(), "make it a readable file"));
        return None;
    }
    if let Some(wrong) = first_line(file, &head) {
        findings.push(wrong);
        return None;
    }
    let reader = ReaderBuilder::new().flexible(true).trim(Trim::All).from_reader(head.chain(source));
    let mut rows =
        Rows { file, names: Vec::new(), columns: Vec::new(), lines: Vec::new(), wrong: Vec::new() };
    rows.read(reader);
    let failed = !rows.wrong.is_empty();
    told(&mut rows.wrong, findings);
    findings.extend(rows.nan());
    let Rows { names, columns, lines, .. } = rows;
    (!failed).then(|| expand(names, columns, lines))
}

trait Chain: Sized {
    fn chain<R: Read>(self, rest: R) -> std::io::Chain<std::io::Cursor<Vec<u8>>, R>;
}

impl Chain for Vec<u8> {
    fn chain<R: Read>(self, rest: R) -> std::io::Chain<std::io::Cursor<Vec<u8>>, R> {
        Read::chain(std::io::Cursor::new(self), rest)
    }
}

/// What can be said from the first line alone.
fn first_line(file: &Path, head: &[u8]) -> Option<Finding> {
    let wrong = |kind, what: &str, mend: &str| Some(Finding::error(kind, file, what, mend).line(1));
    if head.is_empty() {
        let mend = "export the recording again";
        return Some(Finding::error(Kind::EmptyFile, file, "the file is empty", mend));
    }
    if head.starts_with(&[0xff, 0xfe]) || head.starts_with(&[0xfe, 0xff]) {
        return wrong(Kind::Encoding, "the file is UTF-16", "save it as UTF-8");
    }
    if head.contains(&0) {
        return wrong(Kind::Encoding, "there are zero bytes: this is no text", "save it as CSV in UTF-8");
    }
    let Ok(text) = std::str::from_utf8(head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(head)) else {
        return wrong(Kind::Encoding, "the header is not UTF-8", "save the file as UTF-8");
    };
    let count = |c| text.matches(c).count();
    if !text.contains(',') {
        for (separator, name) in [(';', "semicolons"), ('\t', "tabs"), ('|', "vertical bars")] {
            if count(separator) > 0 {
                let what = format!("the columns are separated by {name}");
                let mend = "separate them by commas, with a point in the numbers (0.5, not 0,5)";
                return wrong(Kind::Separator, &what, mend);
            }
        }
    }
    let cells: Vec<_> = text.trim().split(',').map(str::trim).collect();
    if cells.iter().all(|c| c.parse::<f64>().is_ok()) {
        let mend = "name the columns in the first line, the first one `time`";
        return wrong(Kind::NoHeader, "the first line holds numbers, no names", mend);
    }
    None
}

struct Rows<'a> {
    file: &'a Path,
    names: Vec<String>,
    columns: Vec<Column>,
    lines: Vec<u64>,
    wrong: Vec<Finding>,
}

/// Values, row by row, `width` in each.
#[derive(Default)]
struct Column {
    width: usize,
    values: Vec<f64>,
    /// Lines with a cell that says `nan`.
    nan: Vec<u64>,
}

impl Rows<'_> {
    fn read<R: Read>(&mut self, mut reader: csv::Reader<R>) {
        let header = match reader.byte_headers() {
            Ok(header) => header.clone(),
            Err(e) => return self.push(Kind::Unreadable, e.to_string(), "export it again", 1),
        };
        for (i, cell) in header.iter().enumerate() {
            let Ok(name) = std::str::from_utf8(cell) else {
                return self.push(Kind::Encoding, "the header is not UTF-8", "save the file as UTF-8", 1);
            };
            let name = name.trim().trim_matches('"');
            if name.is_empty() {
                let what = format!("column {} has no name", i + 1);
                self.push(
                    Kind::NoHeader,
                    what,
                    "name it, or remove it (an index column, a comma at the end)",
                    1,
                );
            } else if self.names.iter().any(|n| n == name) {
                let what = format!("two columns are named `{name}`");
                self.push(Kind::DuplicateName, what, "rename or remove one", 1);
            }
            self.names.push(name.into());
            self.columns.push(Column::default());
        }
        let mut record = ByteRecord::new();
        // Many mistakes of one file have one cause: what follows is only counted.
        while self.wrong.len() < 1000 {
            match reader.read_byte_record(&mut record) {
                Ok(true) => self.row(&record),
                Ok(false) => break,
                Err(e) => {
                    let line = e.position().map_or(0, csv::Position::line);
                    return self.push(Kind::Unreadable, e.to_string(), "export it again", line);
                }
            }
        }
        if self.lines.is_empty() && self.wrong.is_empty() {
            self.push(Kind::EmptyFile, "there is no row after the header", "export the recording again", 1);
        }
    }

    fn push(&mut self, kind: Kind, what: impl Into<String>, mend: &str, line: u64) {
        self.wrong.push(Finding::error(kind, self.file, what, mend).line(line));
    }

    /// Loggers write `nan` where nothing was measured, and where a computation failed.
    fn nan(&self) -> impl Iterator<Item = Finding> {
        self.names.iter().zip(&self.columns).filter_map(|(name, column)| {
            let (first, more) = column.nan.split_first()?;
            let more = match more.len() {
                0 => String::new(),
                1 => ", here and in one more row".into(),
                n => format!(", here and in {n} more rows"),
            };
            let what = format!("\"nan\" is taken as an empty cell{more}");
            let mend = "record it again if something was measured there";
            Some(Finding::note(Kind::NotANumber, self.file, what, mend).line(*first).channel(name))
        })
    }

    fn row(&mut self, record: &ByteRecord) {
        let line = record.position().map_or(0, csv::Position::line);
        let cells = record.len();
        if cells != self.names.len() {
            let what = format!("{cells} cells under {} names", self.names.len());
            let mend = if cells > self.names.len() {
                "write numbers with a point, not a comma (0.5, not 0,5), and one cell per name"
            } else {
                "complete the row, an empty cell for what is missing"
            };
            return self.push(Kind::RaggedRow, what, mend, line);
        }
        self.lines.push(line);
        for i in 0..cells {
            if record[i].split(u8::is_ascii_whitespace).any(is_nan) {
                self.columns[i].nan.push(line);
            }
            if let Err((kind, what, mend)) = self.columns[i].push(&record[i]) {
                let name = self.names[i].clone();
                self.wrong.push(Finding::error(kind, self.file, what, mend).line(line).channel(name));
            }
        }
    }
}

impl Column {
    fn push(&mut self, cell: &[u8]) -> Result<(), (Kind, String, &'static str)> {
        let shown = || {
            let text = String::from_utf8_lossy(cell);
            let short: String = text.chars().take(40).collect();
            format!("{short:?}")
        };
        let bad = || {
            let comma = cell.contains(&b',');
            let mend = if comma {
                "write it with a point (0.5, not 0,5)"
            } else {
                "write a number, or leave the cell empty where nothing was measured"
            };
            (Kind::NotANumber, format!("{} is no number", shown()), mend)
        };
        let text = std::str::from_utf8(cell)
            .map_err(|_| (Kind::Encoding, format!("{} is not UTF-8", shown()), "save the file as UTF-8"))?;
        let before = self.values.len();
        if !text.contains(char::is_whitespace) {
            self.values.push(number(text).ok_or_else(bad)?);
        } else {
            // An array of FMI 3 as FMPy writes it.
            for part in text.split_whitespace() {
                self.values.push(number(part).ok_or_else(bad)?);
            }
        }
        let width = self.values.len() - before;
        if before == 0 {
            self.width = width;
        } else if width != self.width {
            let what = format!("{width} values in the cell, {} in the rows before", self.width);
            return Err((Kind::ArrayCell, what, "write as many values in each row"));
        }
        Ok(())
    }
}

/// A cell: a number, a truth value, nothing.
fn number(cell: &str) -> Option<f64> {
    match cell {
        "" | "NA" | "null" => Some(f64::NAN),
        "true" | "True" | "TRUE" => Some(1.0),
        "false" | "False" | "FALSE" => Some(0.0),
        cell => cell.parse().ok(),
    }
}

fn is_nan(cell: &[u8]) -> bool {
    let unsigned = cell.strip_prefix(b"-").or_else(|| cell.strip_prefix(b"+")).unwrap_or(cell);
    unsigned.eq_ignore_ascii_case(b"nan")
}

/// Array columns become one column per element.
fn expand(names: Vec<String>, columns: Vec<Column>, lines: Vec<u64>) -> Table {
    let mut table = Table { lines, ..Table::default() };
    for (name, column) in names.into_iter().zip(columns) {
        if column.width <= 1 {
            table.names.push(name);
            table.columns.push(column.values);
        } else {
            for k in 0..column.width {
                table.names.push(element_name(&name, &[k + 1]));
                table.columns.push(column.values.iter().skip(k).step_by(column.width).copied().collect());
            }
        }
    }
    table
}

/// The first mistakes one by one, then how many more of the kind.
fn told(wrong: &mut Vec<Finding>, findings: &mut Vec<Finding>) {
    let mut counts: Vec<(Kind, usize)> = Vec::new();
    for finding in wrong.drain(..) {
        let at = counts.iter().position(|(kind, _)| *kind == finding.kind).unwrap_or_else(|| {
            counts.push((finding.kind, 0));
            counts.len() - 1
        });
        counts[at].1 += 1;
        match counts[at].1 {
            n if n <= TOLD => findings.push(finding),
            n if n == TOLD + 1 => {
                findings.push(Finding { what: "and more of this kind".into(), channel: None, ..finding });
            }
            _ => {}
        }
    }
}
