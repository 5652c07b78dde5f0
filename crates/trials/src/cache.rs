//! Cases that were made before, by the generator that made them, plant, split, seed and number.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::TrialError;
use crate::files;

/// Version and fingerprint of the generator.
pub const GENERATOR: &str = env!("TRUEUP_GENERATOR");

/// A folder that keeps cases.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CaseCache<'a>(pub(crate) &'a Path);

impl CaseCache<'_> {
    fn kept(self, name: &str) -> PathBuf {
        self.0.join(GENERATOR).join(name)
    }
    /// Puts case and key below `directory`; `false`: it is not kept.
    pub(crate) fn take(self, directory: &Path, name: &str) -> Result<bool, TrialError> {
        let kept = self.kept(name);
        if !kept.join("cases").join(name).is_dir() {
            return Ok(false);
        }
        copy(&kept, directory, name).map(|()| true)
    }
    /// Keeps a case that is below `directory`.
    pub(crate) fn keep(self, directory: &Path, name: &str) -> Result<(), TrialError> {
        copy(directory, &self.kept(name), name)
    }
}

/// Key first and the case's folder last, under its final name only when it is whole: what is there is all there.
fn copy(from: &Path, to: &Path, name: &str) -> Result<(), TrialError> {
    let key = Path::new("keys").join(format!("{name}.toml"));
    let text = fs::read_to_string(from.join(&key)).map_err(|e| TrialError::at(&from.join(&key), e))?;
    let (cases, keys) = (to.join("cases"), to.join("keys"));
    files::folder(&cases)?;
    files::folder(&keys)?;
    files::whole(&to.join(&key), &text)?;
    let source = from.join("cases").join(name);
    let part = files::fresh(&cases, name)?;
    for entry in fs::read_dir(&source).map_err(|e| TrialError::at(&source, e))? {
        let path = entry.map_err(|e| TrialError::at(&source, e))?.path();
        let target = part.join(path.file_name().unwrap_or_default());
        // A link where the disk allows it: recordings are only read.
        if fs::hard_link(&path, &target).is_err() {
            fs::copy(&path, &target).map_err(|e| TrialError::at(&target, e))?;
        }
    }
    files::settle(&part, &cases.join(name))
}
