//! Where results go: the name that was requested, and the files next to it until they have it.

use std::io::Result;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_fmi_description::whole;

/// A name for results.
#[derive(Clone, Debug)]
pub(super) struct ResultPlace {
    /// As it was given.
    name: PathBuf,
    /// Wherever an FMU leads the process meanwhile.
    target: PathBuf,
    /// As it would be given.
    previous: Option<PathBuf>,
}

impl ResultPlace {
    pub(super) fn of(file: &Path) -> Result<Self> {
        Ok(Self { name: file.to_owned(), target: std::path::absolute(file)?, previous: None })
    }

    pub(super) fn name(&self) -> &Path {
        &self.name
    }

    pub(super) fn target(&self) -> &Path {
        &self.target
    }

    /// `<name>.<what>.csv`: as it is reported, and where it is.
    pub(super) fn beside(&self, what: &str) -> (PathBuf, PathBuf) {
        let extension = self.name.extension().unwrap_or_default().to_string_lossy();
        let extension = format!("{what}.{extension}");
        (self.name.with_extension(&extension), self.target.with_extension(&extension))
    }

    /// The file that results are written to. It never has the number of a standard stream, which an FMU may have closed: what is
    /// printed there would be among the results.
    pub(super) fn part(&self) -> Result<NamedTempFile> {
        let (file, path) = whole::part(&self.target)?.into_parts();
        Ok(NamedTempFile::from_parts(file.try_clone()?, path))
    }

    /// Moves what has the name away.
    pub(super) fn retire(&mut self) -> Result<()> {
        let (said, to) = self.beside("previous");
        if self.target.symlink_metadata().is_ok_and(|it| !it.is_dir()) {
            std::fs::rename(&self.target, to)?;
            self.previous = Some(said);
        }
        Ok(())
    }

    pub(super) fn previous(&self) -> Option<&Path> {
        self.previous.as_deref()
    }

    /// Moves it back.
    pub(super) fn give_back(&mut self) -> Result<()> {
        if self.previous.take().is_some() {
            std::fs::rename(self.beside("previous").1, &self.target)?;
        }
        Ok(())
    }

    /// The new results are there; those that were moved away for them would have been replaced.
    pub(super) fn forget(&mut self) {
        if self.previous.take().is_some() {
            let _ = std::fs::remove_file(self.beside("previous").1);
        }
    }
}
