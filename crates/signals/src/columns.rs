//! What the columns of a file are: `[columns]` of a sidecar and of a case.

use std::collections::BTreeMap;
use std::path::PathBuf;

use glob::Pattern;

use crate::unit::SignalUnit;

/// Columns by the file's names.
pub(crate) type Columns = BTreeMap<String, ColumnMapping>;

/// What a column of a file is. Its value is `scale * reading + offset` in `unit`.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMapping {
    /// `None`: it is to be left out.
    pub(crate) variable: Option<String>,
    pub(crate) scale: Option<f64>,
    pub(crate) offset: f64,
    pub(crate) unit: Option<(String, SignalUnit)>,
    /// Where it is given.
    pub(crate) file: PathBuf,
    pub(crate) line: u64,
}

impl ColumnMapping {
    /// What a reading gives, in `unit`.
    pub(crate) fn value(&self, reading: f64) -> f64 {
        let value = self.scale.map_or(reading, |s| s * reading);
        if self.offset == 0.0 { value } else { value + self.offset }
    }
}

/// Mappings of a case: of all its recordings, or of those whose names match.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnRule {
    /// `None`: of all.
    pub(crate) pattern: Option<Pattern>,
    pub(crate) columns: Columns,
}

impl ColumnRule {
    pub(crate) fn matches(&self, recording: &str) -> bool {
        self.pattern.as_ref().is_none_or(|p| p.matches(recording))
    }

    /// What the rules define for this recording; a pattern takes precedence over what holds for all.
    pub(crate) fn of(rules: &[Self], recording: &str) -> Columns {
        let mut columns = Columns::new();
        for by_pattern in [true, false] {
            let own = rules.iter().filter(|r| r.pattern.is_some() == by_pattern && r.matches(recording));
            own.for_each(|rule| inherit(&mut columns, &rule.columns));
        }
        columns
    }
}

/// Takes over what `own` does not define, neither for the column nor for the variable.
pub(crate) fn inherit(own: &mut Columns, outer: &Columns) {
    let mapped: Vec<String> = own.values().filter_map(|c| c.variable.clone()).collect();
    for (name, mapping) in outer {
        let taken = mapping.variable.as_ref().is_some_and(|v| mapped.contains(v));
        if !taken && !own.contains_key(name) {
            own.insert(name.clone(), mapping.clone());
        }
    }
}
