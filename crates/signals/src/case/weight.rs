//! `weight` of `[fit]`: readings that count for less in a fit.

use std::fmt;

use toml::de::DeTable;

use super::Case;
use crate::finding::FindingKind;
use crate::keys;
use crate::names::suggestion;
use crate::read::toml::{TomlNode, TomlReader};

/// Readings of a stretch of time that count for less than others in a fit, of the recordings for fitting alone.
#[derive(Clone, Debug, PartialEq)]
pub struct FitWeight {
    /// Recordings in which it holds; empty: all.
    pub recordings: Vec<String>,
    /// First and last time, s; infinite where it is open.
    pub span: [f64; 2],
    /// Factor on the square of each residual, 0 to 1.
    pub weight: f64,
    /// Its line in the `case.toml`.
    pub line: u64,
}

impl FitWeight {
    /// Whether it holds for a reading at `t` seconds of a recording.
    pub fn holds(&self, recording: &str, t: f64) -> bool {
        let here = self.recordings.is_empty() || self.recordings.iter().any(|r| r == recording);
        here && (self.span[0]..=self.span[1]).contains(&t)
    }
}

impl fmt::Display for FitWeight {
    /// `readings of a.csv from 5 s on count for 0.1 each`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("readings")?;
        if !self.recordings.is_empty() {
            write!(f, " of {}", self.recordings.join(", "))?;
        }
        match self.span.map(f64::is_finite) {
            [true, true] => write!(f, " from {} s to {} s", self.span[0], self.span[1])?,
            [true, false] => write!(f, " from {} s on", self.span[0])?,
            [false, true] => write!(f, " until {} s", self.span[1])?,
            [false, false] => {}
        }
        write!(f, " count for {} each", self.weight)
    }
}

impl Case {
    /// `weight` of `[fit]`: a list of tables.
    pub(super) fn weighed(&mut self, reader: &mut TomlReader, node: &TomlNode) {
        let list = node.get_ref().as_array().filter(|l| l.iter().all(|n| n.get_ref().is_table()));
        let Some(list) = list else {
            let what = format!("`weight` is a {}, no list of tables", node.get_ref().type_str());
            let mend = "write weight = [{ start = 5.0, weight = 0.1 }]";
            return reader.wrong(FindingKind::BadValue, node.span(), what, mend);
        };
        for node in list.iter() {
            let Some(table) = node.get_ref().as_table() else { continue };
            let found = self.weight(reader, node, table);
            self.weights.extend(found);
        }
    }

    fn weight(&self, reader: &mut TomlReader, node: &TomlNode, table: &DeTable) -> Option<FitWeight> {
        let line = reader.line(&node.span());
        let wrong = |reader: &mut TomlReader, what: String, mend: &str| {
            reader.wrong(FindingKind::BadValue, node.span(), what, mend);
            None
        };
        reader.known(table, keys::FIT_WEIGHT.of, keys::FIT_WEIGHT);
        let recordings = table.get("recordings").map_or_else(Vec::new, |n| reader.texts(n, "recordings"));
        for (name, span) in recordings.iter().filter(|(name, _)| !self.train.contains(name)) {
            let mend = suggestion(name, self.train.iter().map(String::as_str), "name recordings of `train`");
            let what = format!("`{name}` is not in `train`: only what is fitted has a weight");
            reader.wrong(FindingKind::BadValue, span.clone(), what, mend);
        }
        let mut time = |key: &str, open: f64| match table.get(key) {
            Some(node) => reader.number(node, key),
            None => Some(open),
        };
        let span = [time("start", f64::NEG_INFINITY)?, time("end", f64::INFINITY)?];
        let Some(weight) = table.get("weight") else {
            let mend = "write weight = 0.1: each reading counts for a tenth";
            return wrong(reader, "a stretch of `weight` has no `weight`".into(), mend);
        };
        let weight = reader.number(weight, "weight")?;
        if !(0.0..=1.0).contains(&weight) {
            let mend = "write a number from 0 (left out) to 1 (as any other); to stress one stretch weigh the others less";
            return wrong(reader, format!("`weight` is {weight}"), mend);
        }
        if span[0] >= span[1] {
            let mend = "write seconds, start below end";
            return wrong(
                reader,
                format!("`weight` from {} s to {} s holds for nothing", span[0], span[1]),
                mend,
            );
        }
        if recordings.is_empty() && span.iter().all(|t| t.is_infinite()) {
            let mend = "give `start`, `end` (s) or `recordings`";
            return wrong(
                reader,
                "`weight` holds for every reading, so that none counts for less than another".into(),
                mend,
            );
        }
        Some(FitWeight {
            recordings: recordings.into_iter().map(|(name, _)| name).collect(),
            span,
            weight,
            line,
        })
    }
}
