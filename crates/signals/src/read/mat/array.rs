//! A real numeric array of a MAT file, of either level.

/// One variable.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Array {
    /// Its name.
    pub(super) name: String,
    /// Rows, columns, ...
    pub(super) size: Vec<usize>,
    /// Column after column.
    pub(super) values: Vec<f64>,
}

/// What is in a file: arrays, and a word on what is none.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Contents {
    pub(super) arrays: Vec<Array>,
    pub(super) skipped: Vec<String>,
}

impl Contents {
    /// Leaves something out.
    pub(super) fn skip(&mut self, what: &str) {
        self.skipped.push(format!(
            "{what} is no real numeric array (a struct, cell, text or sparse matrix?) and is left out"
        ));
    }
}
