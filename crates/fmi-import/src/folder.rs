//! An FMU that changes the working directory of the process, so that names of files mean others.

use std::path::PathBuf;

/// The working directory as it shall stay.
#[derive(Clone, Debug)]
pub struct Folder(Option<PathBuf>);

impl Folder {
    /// As it is now.
    pub fn now() -> Self {
        Self(std::env::current_dir().ok())
    }

    /// Where the FMU changed it to; it is back now. `None`: it never left.
    pub fn left(&self) -> Option<PathBuf> {
        let here = self.0.as_ref()?;
        let there = std::env::current_dir().unwrap_or_default();
        if there == *here {
            return None;
        }
        // If it cannot go back, it is reported all the same that it left.
        let _ = std::env::set_current_dir(here);
        Some(there)
    }
}
