//! SSP, System Structure and Parameterization, version 1.0 and what 2.0 adds: reading and writing.

mod annotation;
mod emit;
mod files;
mod flatten;
mod parameters;
mod planned_values;
mod read;
mod size;
mod write;
mod xml;

use std::path::Path;

use crate::error::CosimError;
use crate::system::{CosimSystem, SourceSpan};

pub use write::write;

/// Reads a `.ssp`, a `.ssd`, or a folder with a SystemStructure.ssd.
///
/// # Errors
/// [`CosimError::System`] with every mistake and its line.
pub(crate) fn read(file: &Path) -> Result<CosimSystem, CosimError> {
    let package = file.is_dir() || file.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp"));
    let description = if package { file.join("SystemStructure.ssd") } else { file.to_owned() };
    let mut reader = files::SspReader::new();
    let root = reader.description(&description, 0, &SourceSpan { file: file.into(), line: 0 });
    let (mut mistakes, mut system) = (std::mem::take(&mut reader.mistakes), CosimSystem::default());
    if let Some(root) = root {
        system = flatten::flatten(root, &mut mistakes);
    }
    system.file = file.into();
    system.notes.append(&mut reader.notes);
    // A system that is used several times reports its mistakes several times.
    mistakes.sort_by(|a, b| (&a.place.file, a.place.line).cmp(&(&b.place.file, b.place.line)));
    mistakes.dedup();
    if mistakes.is_empty() { Ok(system) } else { Err(CosimError::System(mistakes)) }
}
