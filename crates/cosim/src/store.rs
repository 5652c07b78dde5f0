//! Files, also those inside archives: `system.ssp/resources/plant.fmu`. What must be a file on disk is unpacked into a
//! temporary folder of its own under its own name; no entry is ever written where its archive directs.

use std::collections::HashMap;
use std::path::{Component, Path, PathBuf};

use tempfile::TempDir;
use trueup_fmi_description::archive::{Archive, MAX_DESCRIPTION, MAX_TOTAL};

/// Archives inside archives.
const MAX_DEPTH: usize = 16;

/// Archives that have been opened, and what was unpacked from them.
#[derive(Default)]
pub(crate) struct Store {
    archives: HashMap<PathBuf, Archive>,
    unpacked: HashMap<PathBuf, (PathBuf, TempDir)>,
}

impl Store {
    /// The bytes of a text file.
    pub(crate) fn read(&mut self, path: &Path) -> Result<Vec<u8>, String> {
        match self.place(path, 0)? {
            StorePlace::Disk(file) => match std::fs::metadata(&file) {
                Ok(m) if m.len() > MAX_DESCRIPTION => {
                    Err(format!("it is larger than {MAX_DESCRIPTION} bytes"))
                }
                Ok(_) => std::fs::read(&file).map_err(|e| e.to_string()),
                Err(e) => Err(e.to_string()),
            },
            StorePlace::Entry(archive, entry) => self.entry(&archive, &entry, MAX_DESCRIPTION),
        }
    }

    /// Its place on disk; unpacked if need be, and there as long as the store.
    pub(crate) fn on_disk(&mut self, path: &Path) -> Result<PathBuf, String> {
        self.disk(path, 0)
    }

    fn disk(&mut self, path: &Path, depth: usize) -> Result<PathBuf, String> {
        if let Some((file, _)) = self.unpacked.get(path) {
            return Ok(file.clone());
        }
        match self.place(path, depth)? {
            StorePlace::Disk(file) => Ok(file),
            StorePlace::Entry(archive, entry) => {
                let bytes = self.entry(&archive, &entry, MAX_TOTAL)?;
                let folder = tempfile::Builder::new().prefix("trueup-ssp-").tempdir();
                let folder = folder.map_err(|e| format!("no temporary folder: {e}"))?;
                let file = folder.path().join(path.file_name().unwrap_or("file".as_ref()));
                std::fs::write(&file, bytes).map_err(|e| e.to_string())?;
                self.unpacked.insert(path.to_owned(), (file.clone(), folder));
                Ok(file)
            }
        }
    }

    fn place(&mut self, path: &Path, depth: usize) -> Result<StorePlace, String> {
        if path.exists() {
            return Ok(StorePlace::Disk(path.to_owned()));
        }
        for outer in path.ancestors().skip(1) {
            let package = outer.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp"));
            let archive = if outer.is_file() {
                outer.to_owned()
            } else if package && !outer.exists() && depth < MAX_DEPTH {
                self.disk(outer, depth + 1)?
            } else {
                continue;
            };
            let inside = path.strip_prefix(outer).unwrap_or(path);
            let parts: Vec<_> = inside.components().map(|c| c.as_os_str().to_string_lossy()).collect();
            return Ok(StorePlace::Entry(archive, parts.join("/")));
        }
        Err("there is no such file; look at the path".into())
    }

    fn entry(&mut self, archive: &Path, entry: &str, limit: u64) -> Result<Vec<u8>, String> {
        if !self.archives.contains_key(archive) {
            let opened = Archive::open(archive).map_err(|e| e.to_string())?;
            self.archives.insert(archive.to_owned(), opened);
        }
        let Some(archive) = self.archives.get_mut(archive) else { return Err("it cannot be opened".into()) };
        // Some tools write `./` or backslashes.
        let plain = |name: &str| name.replace('\\', "/").trim_start_matches("./").to_owned();
        let stored = archive.entries().iter().find(|e| plain(&e.name) == entry).map(|e| e.name.clone());
        let stored = stored.ok_or_else(|| "the archive has no such file".to_owned())?;
        archive.read(&stored, limit).map_err(|e| e.to_string())
    }
}

enum StorePlace {
    Disk(PathBuf),
    Entry(PathBuf, String),
}

/// The path without `.` and `..`; `None` if it leaves `root`.
pub(crate) fn inside(root: &Path, path: &Path) -> Option<PathBuf> {
    let relative = path.strip_prefix(root).ok()?;
    let mut plain = PathBuf::new();
    for part in relative.components() {
        match part {
            Component::Normal(name) => plain.push(name),
            Component::ParentDir => plain.pop().then_some(())?,
            Component::CurDir => {}
            Component::RootDir | Component::Prefix(_) => return None,
        }
    }
    Some(root.join(plain))
}
