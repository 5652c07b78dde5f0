//! Results as CSV.

use std::io::{BufWriter, Error as IoError, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::error::Error;

/// A CSV file that bears its name only once it is complete.
pub struct Table {
    file: PathBuf,
    writer: csv::Writer<BufWriter<NamedTempFile>>,
}

impl Table {
    /// Opens a temporary file beside `file`.
    ///
    /// # Errors
    /// [`Error::Results`]
    pub fn create(file: &Path) -> Result<Self, Error> {
        let folder = file.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let part = tempfile::Builder::new().prefix(".trueup-").suffix(".csv.part").tempfile_in(folder);
        let part = part.map_err(|source| Error::Results { file: file.into(), source })?;
        Ok(Self { file: file.into(), writer: csv::Writer::from_writer(BufWriter::new(part)) })
    }

    fn fail(&self, source: impl Into<IoError>) -> Error {
        Error::Results { file: self.file.clone(), source: source.into() }
    }

    /// Appends a row.
    ///
    /// # Errors
    /// [`Error::Results`]
    pub fn row(&mut self, cells: &[String]) -> Result<(), Error> {
        self.writer.write_record(cells).map_err(|e| self.fail(e))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// [`Error::Results`]
    pub fn finish(self) -> Result<(), Error> {
        let file = self.file.clone();
        self.persist(&file)
    }

    /// Keeps what was computed as `<name>.incomplete.csv`; returns that name.
    ///
    /// # Errors
    /// [`Error::Results`]
    pub fn keep_incomplete(self) -> Result<PathBuf, Error> {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        let file = self.file.with_file_name(format!("{stem}.incomplete.csv"));
        self.persist(&file)?;
        Ok(file)
    }

    fn persist(self, name: &Path) -> Result<(), Error> {
        let fail = |source: IoError| Error::Results { file: name.into(), source };
        let buffer = self.writer.into_inner().map_err(|e| fail(IoError::other(e.to_string())))?;
        let mut part = buffer.into_inner().map_err(|e| fail(e.into_error()))?;
        part.flush().map_err(fail)?;
        #[cfg(unix)] // a temporary file is for its owner only, a result is for all
        {
            use std::os::unix::fs::PermissionsExt;
            part.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
        }
        part.persist(name).map_err(|e| fail(e.error))?;
        Ok(())
    }
}
