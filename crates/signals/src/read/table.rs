//! The content of a file, before it has a meaning.

use crate::names::element_name;
use crate::unit::SignalUnit;

/// Numbers from here on are kept as they are written: of a Unix time in s a double has no more than the microsecond, of a larger
/// integer not even the last digit.
pub(super) const LONG: f64 = 1e9;

/// The requested form of the cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum WantedColumns {
    /// Numbers; a word among them is a mistake.
    Numbers,
    /// As they are written, too: the caller decides which of them are numbers, texts or items.
    Texts,
}

/// Columns of one length.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct ReadTable {
    pub(crate) columns: Vec<TableColumn>,
    /// Line of each row; empty where a format has none.
    pub(crate) lines: Vec<u64>,
    /// What cannot be a column, and why.
    pub(crate) skipped: Vec<String>,
}

/// One of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TableColumn {
    pub(crate) name: String,
    /// `NaN` where nothing was measured, and where a cell is text.
    pub(crate) values: Vec<f64>,
    /// The cells as they are written, of every row; empty where the values say all.
    pub(crate) texts: Vec<String>,
    /// How many cells are text.
    pub(crate) words: usize,
    /// The unit that the file gives it.
    pub(crate) unit: Option<String>,
    /// Another name that the file has for it: the joint of an element.
    pub(crate) label: Option<String>,
    /// Of a column that is a time by its type.
    pub(crate) ticks: Option<ClockTicks>,
}

/// Times as whole counts.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ClockTicks {
    /// `None` where there is none.
    pub(crate) counts: Vec<Option<i64>>,
    pub(crate) per_second: f64,
    /// Counted from the beginning of 1970, else from the beginning of the recording.
    pub(crate) of_epoch: bool,
}

/// The column that numbers the episodes of a LeRobot file.
const EPISODE: &str = "episode_index";

impl ReadTable {
    /// The numbers of its episodes; empty: it has none.
    pub(crate) fn episodes(&self) -> Vec<u32> {
        let column = self.columns.iter().find(|c| c.name == EPISODE);
        let mut all: Vec<u32> = column.into_iter().flat_map(|c| &c.values).map(|x| *x as u32).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The rows of an episode.
    ///
    /// # Errors
    /// There is no such one; the remedy.
    pub(crate) fn episode(mut self, number: u32) -> Result<Self, (String, String)> {
        let column = self.columns.iter().find(|c| c.name == EPISODE);
        let rows: Vec<bool> =
            column.map(|c| c.values.iter().map(|x| *x == f64::from(number)).collect()).unwrap_or_default();
        if !rows.contains(&true) {
            let all = self.episodes();
            let mend = match (all.first(), all.last()) {
                (Some(a), Some(b)) => format!("name one of {a} to {b} behind the #"),
                _ => format!("the file has no column `{EPISODE}`: leave the # out"),
            };
            return Err((format!("there is no episode {number}"), mend));
        }
        fn kept<T>(all: &mut Vec<T>, rows: &[bool]) {
            let mut row = rows.iter();
            all.retain(|_| row.next().copied().unwrap_or(false));
        }
        for column in &mut self.columns {
            kept(&mut column.values, &rows);
            kept(&mut column.texts, &rows);
            column.ticks.iter_mut().for_each(|t| kept(&mut t.counts, &rows));
        }
        kept(&mut self.lines, &rows);
        Ok(self)
    }

    /// Where row `i` is: a line, or nothing.
    pub(crate) fn line(&self, row: usize) -> Option<u64> {
        self.lines.get(row).copied()
    }

    /// The names of its columns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &str> + Clone {
        self.columns.iter().map(|c| c.name.as_str())
    }
}

impl TableColumn {
    /// A column of numbers.
    pub(crate) fn numbers(name: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), values, ..Self::default() }
    }

    /// A column of arrays of this width as one column an element; texts are those of whole cells, with blanks between.
    pub(super) fn elements(name: &str, width: usize, values: &[f64], texts: &[String]) -> Vec<Self> {
        let of = |k: usize| {
            let part = |text: &String| text.split_whitespace().nth(k).unwrap_or_default().to_owned();
            let own = values.iter().skip(k).step_by(width).copied().collect();
            Self {
                texts: texts.iter().map(part).collect(),
                ..Self::numbers(element_name(name, &[k + 1]), own)
            }
        };
        (0..width).map(of).collect()
    }
}

/// The unit that the file itself gives a column, if it is known here.
pub(super) fn unit_of(column: &TableColumn) -> Option<(String, SignalUnit)> {
    let text = column.unit.as_deref()?;
    Some((text.to_owned(), SignalUnit::parse(text)?))
}

/// What to do with a cell that should be a number.
pub(super) fn mend(text: &str) -> &'static str {
    match text.contains(',') {
        true => "write it with a point (0.5, not 0,5)",
        false => "write a number, or leave the cell empty where nothing was measured",
    }
}
