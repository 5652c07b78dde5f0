//! Mistakes of one file with their lines.

use std::ops::Range;
use std::path::Path;

use trueup_cosim::InputMistake;
use trueup_cosim::system::SourceSpan;

pub(crate) struct SweepMistakes<'a> {
    file: &'a Path,
    text: &'a str,
    pub(crate) list: Vec<InputMistake>,
}

impl<'a> SweepMistakes<'a> {
    pub(crate) fn of(file: &'a Path, text: &'a str) -> Self {
        Self { file, text, list: Vec::new() }
    }

    pub(crate) fn place(&self, span: Range<usize>) -> SourceSpan {
        SourceSpan::of(self.file, self.text, span.start)
    }

    pub(crate) fn wrong(&mut self, span: Range<usize>, message: impl Into<String>) {
        let place = self.place(span);
        self.list.push(InputMistake { place, message: message.into() });
    }
}
