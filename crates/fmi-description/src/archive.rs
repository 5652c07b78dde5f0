//! Opens an FMU: a .fmu file or an unpacked folder. No entry leaves its folder, no archive fills the disk.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};

use zip::ZipArchive;

/// Largest sum of the unpacked sizes.
pub const MAX_TOTAL: u64 = 4 << 30;
/// Largest modelDescription.xml.
pub const MAX_DESCRIPTION: u64 = 256 << 20;
/// Largest number of entries.
pub const MAX_ENTRIES: usize = 100_000;

/// An archive that cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum ArchiveError {
    /// Reading or writing failed.
    #[error("{path}: {source}")]
    Io {
        /// File.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Nothing is there.
    #[error("{path}: there is no such file; look at the path, or pack it with `trueup fmu pack`")]
    Nothing {
        /// File.
        path: String,
    },
    /// The system does not give it.
    #[error("{path}: it cannot be read: {source}; look at the path, or pack it again with `trueup fmu pack`")]
    Unreadable {
        /// File.
        path: String,
        /// Why.
        source: std::io::Error,
    },
    /// Not a zip archive, or a broken one.
    #[error("{path} is no FMU or not all of one (zip archive: {reason}); fetch or pack it again")]
    Zip {
        /// File.
        path: String,
        /// Why.
        reason: String,
    },
    /// An entry that would be written outside its folder, or a link.
    #[error("{path}: the entry {entry:?} is refused: {reason}")]
    Entry {
        /// File.
        path: String,
        /// Entry.
        entry: String,
        /// Why.
        reason: &'static str,
    },
    /// Beyond a limit.
    #[error("{path}: {what} is over the limit of {limit}")]
    Limit {
        /// File.
        path: String,
        /// What.
        what: String,
        /// Limit.
        limit: u64,
    },
    /// No such entry.
    #[error("{path} has no {entry}; name an FMU, or the folder that one was unpacked into")]
    Missing {
        /// File.
        path: String,
        /// Entry.
        entry: String,
    },
}

/// An entry: as in the archive's directory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArchiveEntry {
    /// Path inside the archive as stored.
    pub name: String,
    /// Unpacked size in bytes.
    pub size: u64,
    /// Compression method is deflate or store, as FMI demands.
    pub portable: bool,
}

/// An opened FMU.
#[derive(Debug)]
pub struct Archive {
    path: PathBuf,
    zip: Option<ZipArchive<BufReader<File>>>,
    entries: Vec<ArchiveEntry>,
}

impl Archive {
    /// Opens a .fmu file, or a folder that one was unpacked into.
    ///
    /// # Errors
    /// [`ArchiveError`]; entries that escape their folder, links and sizes over the limits are refused here.
    pub fn open(path: &Path) -> Result<Self, ArchiveError> {
        let io = |source| ArchiveError::Io { path: path.display().to_string(), source };
        if path.is_dir() {
            let mut entries = Vec::new();
            walk(path, "", &mut entries).map_err(io)?;
            return Ok(Self { path: path.to_owned(), zip: None, entries });
        }
        let file = File::open(path).map_err(|source| {
            let path = path.display().to_string();
            match source.kind() {
                ErrorKind::NotFound | ErrorKind::NotADirectory => ArchiveError::Nothing { path },
                _ => ArchiveError::Unreadable { path, source },
            }
        })?;
        let broken = |e: zip::result::ZipError| ArchiveError::Zip {
            path: path.display().to_string(),
            reason: e.to_string(),
        };
        let mut zip = ZipArchive::new(BufReader::new(file)).map_err(broken)?;
        let limit =
            |what: String, limit| ArchiveError::Limit { path: path.display().to_string(), what, limit };
        if zip.len() > MAX_ENTRIES {
            return Err(limit(format!("the number of entries ({})", zip.len()), MAX_ENTRIES as u64));
        }
        let mut entries = Vec::with_capacity(zip.len());
        for i in 0..zip.len() {
            let entry = zip.by_index_raw(i).map_err(broken)?;
            let name = String::from_utf8_lossy(entry.name_raw()).into_owned();
            let refuse = |reason| ArchiveError::Entry {
                path: path.display().to_string(),
                entry: name.clone(),
                reason,
            };
            if entry.is_symlink() {
                return Err(refuse("links are not allowed in an FMU"));
            }
            if entry.encrypted() {
                return Err(refuse("it is encrypted"));
            }
            relative(&name).ok_or_else(|| refuse("it would be written outside the FMU's folder"))?;
            let portable = matches!(
                entry.compression(),
                zip::CompressionMethod::Deflated | zip::CompressionMethod::Stored
            );
            entries.push(ArchiveEntry { size: entry.size(), portable, name });
        }
        let total = entries.iter().fold(0u64, |sum, e| sum.saturating_add(e.size));
        if total > MAX_TOTAL {
            return Err(limit(format!("the unpacked size ({total} bytes)"), MAX_TOTAL));
        }
        Ok(Self { path: path.to_owned(), zip: Some(zip), entries })
    }

    /// Where it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }
    /// The entries; folders end with `/`.
    pub fn entries(&self) -> &[ArchiveEntry] {
        &self.entries
    }
    /// Is there a file of that name?
    pub fn has(&self, name: &str) -> bool {
        self.entries.iter().any(|e| e.name == name)
    }
    /// The description's bytes.
    ///
    /// # Errors
    /// [`ArchiveError`]
    pub fn description(&mut self) -> Result<Vec<u8>, ArchiveError> {
        self.read("modelDescription.xml", MAX_DESCRIPTION)
    }
    /// The bytes of an entry, at most `limit`.
    ///
    /// # Errors
    /// [`ArchiveError`]
    pub fn read(&mut self, name: &str, limit: u64) -> Result<Vec<u8>, ArchiveError> {
        let path = self.path.display().to_string();
        let Some(at) = self.entries.iter().position(|e| e.name == name) else {
            return Err(ArchiveError::Missing { path, entry: name.to_owned() });
        };
        let io = |source| ArchiveError::Io { path: format!("{path}: {name}"), source };
        let mut bytes = Vec::new();
        // The size in the directory can be wrong, so the reading itself is limited.
        match &mut self.zip {
            Some(zip) => {
                let broken = |e: zip::result::ZipError| ArchiveError::Zip {
                    path: path.clone(),
                    reason: e.to_string(),
                };
                zip.by_index(at).map_err(broken)?.take(limit + 1).read_to_end(&mut bytes).map_err(io)?;
            }
            None => {
                File::open(self.path.join(name))
                    .map_err(io)?
                    .take(limit + 1)
                    .read_to_end(&mut bytes)
                    .map_err(io)?;
            }
        }
        if bytes.len() as u64 > limit {
            return Err(ArchiveError::Limit { path, what: format!("{name} (bytes)"), limit });
        }
        Ok(bytes)
    }
    /// Unpacks everything into this folder, which is made.
    ///
    /// # Errors
    /// [`ArchiveError`]
    pub fn extract(&mut self, folder: &Path) -> Result<(), ArchiveError> {
        let mut left = MAX_TOTAL;
        for i in 0..self.entries.len() {
            let name = self.entries[i].name.clone();
            let Some(inside) = relative(&name) else { continue };
            let target = folder.join(inside);
            let io = |source| ArchiveError::Io { path: target.display().to_string(), source };
            if name.ends_with('/') {
                std::fs::create_dir_all(&target).map_err(io)?;
                continue;
            }
            if let Some(parent) = target.parent() {
                std::fs::create_dir_all(parent).map_err(io)?;
            }
            let bytes = self.read(&name, left)?;
            left -= bytes.len() as u64;
            std::fs::write(&target, bytes).map_err(io)?;
        }
        Ok(())
    }
}

/// The path inside the folder; `None` where it leaves it. Tools on Windows write backslashes against the
/// standard: they separate, too.
fn relative(name: &str) -> Option<PathBuf> {
    let name = name.replace('\\', "/");
    let absolute = name.starts_with('/') || name.contains('\0') || name.split('/').next()?.contains(':');
    let mut path = PathBuf::new();
    for part in name.split('/').filter(|p| !p.is_empty() && *p != ".") {
        if part == ".." {
            return None;
        }
        path.push(part);
    }
    (!absolute).then_some(path)
}

fn walk(folder: &Path, prefix: &str, out: &mut Vec<ArchiveEntry>) -> std::io::Result<()> {
    let mut found: Vec<_> = std::fs::read_dir(folder)?.collect::<Result<_, _>>()?;
    found.sort_by_key(std::fs::DirEntry::file_name);
    for entry in found {
        let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
        let kind = entry.file_type()?;
        if kind.is_dir() {
            walk(&entry.path(), &format!("{name}/"), out)?;
        } else if kind.is_file() {
            out.push(ArchiveEntry { name, size: entry.metadata()?.len(), portable: true });
        }
    }
    Ok(())
}
