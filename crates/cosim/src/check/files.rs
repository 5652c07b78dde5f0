//! What systems are made of: FMUs and inputs, each file read once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use trueup_fmi_import::UnpackedFmu;

use crate::inputs::InputFileTable;
use crate::mistake::suggestion;
use crate::store::Store;

/// Files that were read, for [checks](super::check_with) of several systems.
#[derive(Default)]
pub struct Files {
    fmus: HashMap<PathBuf, Result<Arc<UnpackedFmu>, String>>,
    inputs: HashMap<PathBuf, Result<InputFileTable, String>>,
    store: Store,
}

impl Files {
    /// An FMU that is open is already used for this file.
    pub fn hold(&mut self, file: &Path, fmu: &Arc<UnpackedFmu>) {
        self.fmus.insert(file.to_owned(), Ok(Arc::clone(fmu)));
    }

    /// Inputs from memory replace the file that they name; a column that drives nothing is a mistake, as in a file.
    pub fn hold_inputs(&mut self, inputs: InputFileTable) {
        self.inputs.insert(inputs.file.clone(), Ok(inputs));
    }

    pub(super) fn fmu(&mut self, file: &Path) -> Result<Arc<UnpackedFmu>, String> {
        if let Some(known) = self.fmus.get(file) {
            return known.clone();
        }
        let missing = || format!("there is no file {}{}", file.display(), beside(file));
        let opened = match self.store.on_disk(file) {
            Ok(disk) => UnpackedFmu::open_as(&disk, file).map_err(|e| {
                // In an archive: under the name that the user gave.
                e.to_string().replace(&*disk.to_string_lossy(), &file.to_string_lossy())
            }),
            Err(_) if folder(file).is_dir() => Err(missing()),
            Err(why) => Err(format!("{}: {why}, or pack it with `trueup fmu pack`", file.display())),
        };
        self.fmus.insert(file.to_owned(), opened.clone());
        opened
    }

    /// Of a run of this system from this start in s.
    pub(super) fn inputs(
        &mut self,
        file: &Path,
        system: &Path,
        start: Option<f64>,
    ) -> Result<InputFileTable, String> {
        if let Some(known) = self.inputs.get(file) {
            return known.clone();
        }
        let read = match self.store.on_disk(file) {
            Err(why) => Err(format!("{}: {why}", file.display())),
            Ok(disk) => InputFileTable::read(&disk, system, start)
                .map(|inputs| InputFileTable { file: file.to_owned(), ..inputs })
                .map_err(|e| e.to_string().replace(&*disk.to_string_lossy(), &file.to_string_lossy())),
        };
        self.inputs.insert(file.to_owned(), read.clone());
        read
    }
}

/// Where a file is.
fn folder(file: &Path) -> &Path {
    file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The nearest file name in the same folder.
fn beside(file: &Path) -> String {
    let names: Vec<String> = std::fs::read_dir(folder(file))
        .into_iter()
        .flatten()
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .filter(|n| n.ends_with(".fmu"))
        .collect();
    let near =
        suggestion(&file.file_name().unwrap_or_default().to_string_lossy(), names.iter().map(String::as_str));
    if near.is_empty() { "; look at the path".into() } else { near }
}
