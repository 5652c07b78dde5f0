//! What a check has found.

use std::path::Path;

use crate::mistake::InputMistake;
use crate::place::SourceSpan;
use crate::system::SystemComponent;

/// What is to be reported.
#[derive(Default)]
pub(super) struct Report {
    pub(super) mistakes: Vec<InputMistake>,
    pub(super) notes: Vec<String>,
}

impl Report {
    pub(super) fn wrong(&mut self, place: &SourceSpan, message: impl Into<String>) {
        self.mistakes.push(InputMistake { place: place.clone(), message: message.into() });
    }
    /// About a component's FMU.
    pub(super) fn wrong_fmu(&mut self, component: &SystemComponent, message: impl Into<String>) {
        self.wrong_of(&component.fmu, &component.place, message);
    }
    /// About a file: the message names it, the place does not name it again where that file is all there is.
    pub(super) fn wrong_of(&mut self, file: &Path, place: &SourceSpan, message: impl Into<String>) {
        let alone = place.line == 0 && place.file == file;
        self.wrong(&if alone { SourceSpan::default() } else { place.clone() }, message);
    }
    pub(super) fn note(&mut self, message: impl Into<String>) {
        self.notes.push(message.into());
    }
}
