//! CSV: one header line of names; FMPy's results too.

mod dialect;
mod head;

use std::io::{BufRead, Cursor, Read};
use std::path::Path;

use csv::{ByteRecord, ReaderBuilder, Trim};

use super::table::{LONG, ReadTable, TableColumn, WantedColumns, mend};
use crate::finding::{Finding, FindingKind, MAX_REPORTED};
use dialect::{CsvCell, Dialect};
use head::CsvHead;

/// Reads all of it, row by row; `None` if there is an error.
pub(super) fn read(
    file: &Path,
    mut source: impl BufRead,
    wanted: WantedColumns,
    findings: &mut Vec<Finding>,
) -> Option<ReadTable> {
    let head = match CsvHead::read(&mut source) {
        Ok(head) => head,
        Err(e) => {
            findings.push(Finding::error(
                FindingKind::Unreadable,
                file,
                e.to_string(),
                "make it a readable file",
            ));
            return None;
        }
    };
    // The first bytes show the encoding, the first two lines a separator.
    let dialect = match Dialect::of(file, &head.names, &head.below) {
        Ok(dialect) => dialect,
        Err(mut wrong) => {
            wrong.line = wrong.line.map(|_| head.line());
            findings.push(*wrong);
            return None;
        }
    };
    let reader = ReaderBuilder::new()
        .flexible(true)
        .trim(Trim::All)
        .delimiter(dialect.separator as u8)
        .from_reader(Cursor::new(head.text()).chain(source));
    let mut rows = CsvRows {
        file,
        dialect,
        wanted,
        names: Vec::new(),
        names_line: head.line(),
        columns: Vec::new(),
        lines: Vec::new(),
        marks: [None; 2],
        comments: head.comments,
        units: None,
        wrong: Vec::new(),
    };
    rows.read(reader);
    rows.one_mark();
    let failed = !rows.wrong.is_empty();
    told(&mut rows.wrong, findings);
    findings.extend(rows.nan());
    findings.extend(rows.separated());
    findings.extend(rows.beside_numbers());
    (!failed).then(|| rows.table())
}

struct CsvRows<'a> {
    file: &'a Path,
    dialect: Dialect,
    wanted: WantedColumns,
    names: Vec<String>,
    /// Where the names are.
    names_line: u64,
    columns: Vec<Filling>,
    lines: Vec<u64>,
    /// The first lines with a number that has a decimal point, and one that has a decimal comma.
    marks: [Option<u64>; 2],
    /// Lines that begin with `#`, but for one with the names.
    comments: Vec<u64>,
    /// The line of units under the names, and its cells.
    units: Option<(u64, Vec<String>)>,
    wrong: Vec<Finding>,
}

/// A column on its way: values, row by row, `width` in each.
#[derive(Default)]
struct Filling {
    width: usize,
    values: Vec<f64>,
    /// The cells as they are written, where they are kept.
    texts: Vec<String>,
    /// Cells that are neither numbers nor empty.
    words: usize,
    numbers: usize,
    /// Lines with a cell `nan`.
    nan: Vec<u64>,
}

impl CsvRows<'_> {
    fn read<R: Read>(&mut self, mut reader: csv::Reader<R>) {
        let header = match reader.byte_headers() {
            Ok(header) => header.clone(),
            Err(e) => {
                return self.push(FindingKind::Unreadable, e.to_string(), "export it again", self.names_line);
            }
        };
        // A separator at the end of each line makes no column.
        let cells = header.len() - usize::from(header.len() > 1 && header[header.len() - 1].is_empty());
        for (i, cell) in header.iter().take(cells).enumerate() {
            let Ok(name) = std::str::from_utf8(cell) else {
                return self.push(
                    FindingKind::Encoding,
                    "the header is not UTF-8",
                    "save the file as UTF-8",
                    self.names_line,
                );
            };
            let name = name.trim().trim_matches('"');
            if name.is_empty() {
                let what = format!("column {} has no name", i + 1);
                let mend = "name it, or remove it (an index column)";
                self.push(FindingKind::NoHeader, what, mend, self.names_line);
            } else if self.names.iter().any(|n| n == name) {
                let what = format!("two columns are named `{name}`");
                self.push(FindingKind::DuplicateName, what, "rename or remove one", self.names_line);
            }
            self.names.push(name.into());
            self.columns.push(Filling::default());
        }
        let mut record = ByteRecord::new();
        // Many mistakes of one file have one cause: what follows is only counted.
        while self.wrong.len() < 1000 {
            match reader.read_byte_record(&mut record) {
                Ok(true) => self.row(&record),
                Ok(false) => break,
                Err(e) => {
                    let line = e.position().map_or(0, csv::Position::line);
                    return self.push(FindingKind::Unreadable, e.to_string(), "export it again", line);
                }
            }
        }
        if self.lines.is_empty() && self.wrong.is_empty() {
            self.push(
                FindingKind::EmptyFile,
                "there is no row after the header",
                "export the recording again",
                self.names_line,
            );
        }
    }

    fn push(&mut self, kind: FindingKind, what: impl Into<String>, mend: &str, line: u64) {
        self.wrong.push(Finding::error(kind, self.file, what, mend).line(line));
    }

    /// Lines that are no rows: comments, units.
    fn beside_numbers(&self) -> Vec<Finding> {
        let mut notes = Vec::new();
        if let Some(first) = self.comments.first() {
            let more = match self.comments.len() {
                1 => "a line that begins".to_owned(),
                n => format!("{n} lines that begin"),
            };
            let what = format!("{more} with # counted as comment");
            notes.push(
                Finding::note(FindingKind::Comment, self.file, what, "nothing, if that is meant")
                    .line(*first),
            );
        }
        if let Some((line, _)) = &self.units {
            let what = "this line holds the units of the columns";
            notes.push(
                Finding::note(FindingKind::Unit, self.file, what, "nothing, if that is meant").line(*line),
            );
        }
        notes
    }

    /// Which mark is meant cannot be known where both are there: `1,250` may be a thousand or one.
    fn one_mark(&mut self) {
        if let [Some(point), Some(comma)] = self.marks {
            let what = format!("numbers have a decimal comma here and a decimal point in line {point}");
            self.push(
                FindingKind::NotANumber,
                what,
                "write all with a point, and nothing between thousands",
                comma,
            );
        }
    }

    fn separated(&self) -> Option<Finding> {
        let name = self.dialect.unusual()?;
        let comma = if self.marks[1].is_some() { ", numbers have decimal commas" } else { "" };
        let what = format!("the columns are separated by {name}{comma}");
        Some(
            Finding::note(FindingKind::Separator, self.file, what, "nothing, if that is meant")
                .line(self.names_line),
        )
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
            Some(Finding::note(FindingKind::NotANumber, self.file, what, mend).line(*first).channel(name))
        })
    }

    fn row(&mut self, record: &ByteRecord) {
        let line = record.position().map_or(0, csv::Position::line);
        if record.get(0).is_some_and(|cell| cell.starts_with(b"#")) {
            return self.comments.push(line);
        }
        let mut cells = record.len();
        if cells == self.names.len() + 1 && record[cells - 1].is_empty() {
            cells -= 1; // a separator at the end
        }
        if self.lines.is_empty() && self.units.is_none() && cells == self.names.len() {
            self.units = head::units(record, cells).map(|units| (line, units));
            if self.units.is_some() {
                return;
            }
        }
        if cells != self.names.len() {
            let what = format!("{cells} cells under {} names", self.names.len());
            let mend = if cells > self.names.len() {
                "write numbers with a point, not a comma (0.5, not 0,5), or separate the columns by semicolons; one cell per name"
            } else {
                "complete the row, an empty cell for what is missing"
            };
            return self.push(FindingKind::RaggedRow, what, mend, line);
        }
        self.lines.push(line);
        for i in 0..cells {
            if let Err((kind, what, mend)) = self.cell(i, &record[i], line) {
                let name = self.names[i].clone();
                self.wrong.push(Finding::error(kind, self.file, what, mend).line(line).channel(name));
            }
        }
    }

    fn cell(&mut self, i: usize, cell: &[u8], line: u64) -> Result<(), (FindingKind, String, &'static str)> {
        let shown = || {
            let text = String::from_utf8_lossy(cell);
            let short: String = text.chars().take(40).collect();
            format!("{short:?}")
        };
        let text = std::str::from_utf8(cell).map_err(|_| {
            (FindingKind::Encoding, format!("{} is not UTF-8", shown()), "save the file as UTF-8")
        })?;
        let (dialect, first) = (self.dialect, self.lines.len() == 1);
        let mut mark = |part: &str, line: u64| {
            for (slot, c) in self.marks.iter_mut().zip(['.', ',']) {
                if slot.is_none() && part.contains(c) {
                    *slot = Some(line);
                }
            }
        };
        let column = &mut self.columns[i];
        let before = column.values.len();
        let mut word = false;
        for part in text.split_whitespace().chain(text.is_empty().then_some("")) {
            match dialect.cell(part) {
                CsvCell::Missing => column.values.push(f64::NAN),
                CsvCell::Number(x) => {
                    if x.is_nan() && column.nan.last() != Some(&line) {
                        column.nan.push(line);
                    }
                    mark(part, line);
                    column.values.push(x);
                }
                CsvCell::Word => word = true,
            }
        }
        let of_numbers = column.numbers > 0;
        if word {
            // Of a cell with blanks in it, all is text.
            column.values.truncate(before);
            column.values.extend(std::iter::repeat_n(f64::NAN, column.width.max(1)));
        } else if !text.is_empty() {
            column.numbers += 1;
        }
        let large = column.values.get(before).is_some_and(|x| x.abs() >= LONG);
        // Numbers need no text with them, but for those that are too long for a double.
        let keep =
            self.wanted == WantedColumns::Texts || !of_numbers && (word || large) || !column.texts.is_empty();
        if keep {
            let earlier = self.lines.len() - 1;
            if column.texts.len() < earlier {
                column.texts.resize(earlier, String::new());
            }
            column.texts.push(text.to_owned());
        }
        if word {
            column.words += 1;
            if of_numbers && self.wanted == WantedColumns::Numbers {
                return Err((FindingKind::NotANumber, format!("{} is no number", shown()), mend(text)));
            }
        }
        let width = column.values.len() - before;
        if first {
            column.width = width;
        } else if width != column.width {
            let what = format!("{width} values in the cell, {} in the rows before", column.width);
            return Err((FindingKind::ArrayCell, what, "write as many values in each row"));
        }
        Ok(())
    }

    /// Array columns become one column per element.
    fn table(self) -> ReadTable {
        let mut table = ReadTable { lines: self.lines, ..ReadTable::default() };
        let units = self.units.map(|(_, units)| units).unwrap_or_default();
        for (i, (name, filled)) in self.names.into_iter().zip(self.columns).enumerate() {
            let Filling { width, values, texts, words, .. } = filled;
            let first = table.columns.len();
            if width <= 1 {
                table.columns.push(TableColumn { name, values, texts, words, ..TableColumn::default() });
            } else {
                table.columns.extend(TableColumn::elements(&name, width, &values, &texts));
            }
            if let Some(unit) = units.get(i).filter(|u| !u.is_empty()) {
                table.columns[first..].iter_mut().for_each(|c| c.unit = Some(unit.clone()));
            }
        }
        table
    }
}

/// The first mistakes one by one, then how many more of the kind.
fn told(wrong: &mut Vec<Finding>, findings: &mut Vec<Finding>) {
    let mut counts: Vec<(FindingKind, usize)> = Vec::new();
    for finding in wrong.drain(..) {
        let at = counts.iter().position(|(kind, _)| *kind == finding.kind).unwrap_or_else(|| {
            counts.push((finding.kind, 0));
            counts.len() - 1
        });
        counts[at].1 += 1;
        match counts[at].1 {
            n if n <= MAX_REPORTED => findings.push(finding),
            n if n == MAX_REPORTED + 1 => {
                findings.push(Finding { what: "and more of this kind".into(), channel: None, ..finding });
            }
            _ => {}
        }
    }
}
