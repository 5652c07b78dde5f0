//! An FMU on disk, and the functions of its library.

#![allow(unsafe_code)] // the C boundary

use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use libloading::Library;
use tempfile::TempDir;
use trueup_fmi::configuration::{BLOCK_SIZE, Configuration, MARKER};
use trueup_fmi_description::archive::Archive;
use trueup_fmi_description::description::Description;
use trueup_fmi_description::{FmiVersion, read};

use crate::error::ImportError;
use crate::isolation::Isolation;

/// Which interface of an FMU is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UsedInterface {
    /// The FMU gives derivatives, the importer integrates.
    ModelExchange,
    /// The FMU integrates.
    CoSimulation,
}

/// An unpacked FMU. Its directory lives as long as the last instance.
#[derive(Debug)]
pub struct UnpackedFmu {
    file: PathBuf,
    directory: PathBuf,
    description: Description,
    isolation: OnceLock<Isolation>,
    /// Before the directory, which goes last.
    kept: OnceLock<Library>,
    _unpacked: Option<TempDir>,
}

impl UnpackedFmu {
    /// Opens an FMU: a file, unpacked into a temporary directory, or an unpacked directory.
    ///
    /// # Errors
    /// [`ImportError::Archive`] if it cannot be unpacked, [`ImportError::File`] if its description cannot be read.
    pub fn open(file: impl AsRef<Path>) -> Result<Arc<Self>, ImportError> {
        Self::open_as(file.as_ref(), file.as_ref())
    }

    /// Opens `file` and calls it `name` in messages: where it came from, if it was copied from there.
    ///
    /// # Errors
    /// As [`UnpackedFmu::open`].
    pub fn open_as(file: &Path, name: &Path) -> Result<Arc<Self>, ImportError> {
        let fail = |reason: String| ImportError::File { file: name.into(), reason };
        let mut archive = Archive::open(file)?;
        let xml = archive.description()?;
        let description = read::read(&xml).map_err(|e| fail(e.to_string()))?;
        let unpacked = if file.is_dir() {
            None
        } else {
            let unpacked = tempfile::Builder::new().prefix("trueup-fmu-").tempdir();
            let unpacked = unpacked.map_err(|e| fail(format!("no temporary directory: {e}")))?;
            archive.extract(unpacked.path())?;
            Some(unpacked)
        };
        let directory = unpacked.as_ref().map_or(file, TempDir::path);
        let directory = directory.canonicalize().map_err(|e| fail(e.to_string()))?;
        let isolation = OnceLock::new();
        let kept = OnceLock::new();
        Ok(Arc::new(Self { file: name.into(), directory, description, isolation, kept, _unpacked: unpacked }))
    }

    /// Where it came from.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Where it is unpacked.
    pub fn directory(&self) -> &Path {
        &self.directory
    }

    /// Its description.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Instances that are made from now on have [processes of their own](crate::isolation). The first call holds.
    pub fn isolate(&self, isolation: &Isolation) {
        let _ = self.isolation.set(isolation.clone());
    }

    /// Whether its instances have processes of their own.
    pub fn is_isolated(&self) -> bool {
        self.isolation().is_some()
    }

    /// Keeps the library of an interface loaded from now on, so that an instance costs a fraction of the loading. What the library
    /// has in variables of its own then outlives its instances, as in most tools. For one that cannot be loaded an error is returned when it is
    /// instantiated; one in a process of its own is not kept.
    pub fn keep_loaded(&self, interface: UsedInterface) {
        if self.is_isolated() || self.kept.get().is_some() {
            return;
        }
        let library =
            self.library(self.description.version, interface).ok().and_then(|path| load(&path).ok());
        if let Some(library) = library {
            let _ = self.kept.set(library); // another thread was faster
        }
    }

    pub(crate) fn isolation(&self) -> Option<&Isolation> {
        self.isolation.get()
    }

    /// Whether its library for this platform is one that this project packs: it has our configuration block, with the token that
    /// the description names. That distinguishes it from those of other vendors, and is no protection against deceit.
    pub fn is_ours(&self, interface: UsedInterface) -> bool {
        let Ok(path) = self.library(self.description.version, interface) else { return false };
        let Ok(library) = fs::read(path) else { return false };
        let blocks = library.windows(MARKER.len()).enumerate().filter(|(_, bytes)| *bytes == MARKER);
        let configurations = blocks.filter_map(|(at, _)| library.get(at..at + BLOCK_SIZE));
        configurations
            .filter_map(|block| Configuration::from_block(block).ok())
            .any(|it| it.token == self.description.token)
    }

    /// FMI 2.0: `file:` URI of the resources, given always (some FMUs crash on NULL).
    pub(crate) fn resource_uri(&self) -> String {
        let mut uri = String::from("file://");
        for byte in self.directory.join("resources").to_string_lossy().bytes() {
            match byte {
                b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' | b'/' => {
                    uri.push(byte.into())
                }
                _ => uri.push_str(&format!("%{byte:02X}")),
            }
        }
        uri
    }

    /// FMI 3.0: path of the resources with a trailing separator, or `None` if the FMU has no such folder.
    pub(crate) fn resource_path(&self) -> Option<String> {
        let path = self.directory.join("resources");
        path.is_dir().then(|| format!("{}{}", path.display(), std::path::MAIN_SEPARATOR))
    }

    /// The library of an interface for this platform.
    pub(crate) fn library(
        &self,
        version: FmiVersion,
        interface: UsedInterface,
    ) -> Result<PathBuf, ImportError> {
        let fail = |reason: String| ImportError::File { file: self.file.clone(), reason };
        let (offered, what) = match interface {
            UsedInterface::ModelExchange => (&self.description.model_exchange, "Model Exchange"),
            UsedInterface::CoSimulation => (&self.description.co_simulation, "Co-Simulation"),
        };
        let Some(offered) = offered else {
            return Err(ImportError::Interface { file: self.file.clone(), interface: what.into() });
        };
        let identifier = &offered.model_identifier;
        let own = self.description.version;
        if own != version {
            let interface = format!("FMI {}; it is an FMU of FMI {}", version.as_str(), own.as_str());
            return Err(ImportError::Interface { file: self.file.clone(), interface });
        }
        if identifier.contains(['/', '\\']) {
            return Err(fail(format!("modelIdentifier \"{identifier}\" is no file name")));
        }
        let binaries = self.directory.join("binaries");
        let platforms = platforms(version);
        let candidates = platforms.iter().map(|p| binaries.join(p).join(format!("{identifier}{DLL_SUFFIX}")));
        candidates.into_iter().find(|path| path.is_file()).ok_or_else(|| {
            let mut have: Vec<_> = fs::read_dir(&binaries)
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.file_name().to_string_lossy().into_owned())
                .collect();
            have.sort();
            fail(format!(
                "no binary {identifier}{DLL_SUFFIX} for this platform ({}); there are binaries for: {}. \
                 Use an FMU that was built for this platform",
                platforms.join(" or "),
                if have.is_empty() { "none".into() } else { have.join(", ") }
            ))
        })
    }
}

/// Loads a library, or returns why it cannot be loaded.
pub(crate) fn load(path: &Path) -> Result<Library, String> {
    #[cfg(target_os = "linux")]
    if let Some(why) = trueup_fmi_description::elf::unfit(path) {
        return Err(why);
    }
    preload_libm();
    open(path).or_else(|e| python::retry(path, e))
}

/// Names of this platform's folder under `binaries`.
fn platforms(version: FmiVersion) -> Vec<String> {
    let os = if OS == "macos" { "darwin" } else { OS };
    let tuple = format!("{ARCH}-{os}");
    let (short, bits) = (if os == "windows" { "win" } else { os }, usize::BITS);
    match (version, ARCH) {
        (FmiVersion::V2, "x86" | "x86_64") => vec![format!("{short}{bits}"), tuple],
        // One file may serve both kinds of Mac.
        (FmiVersion::V2, _) if OS == "macos" => vec![tuple, format!("{short}{bits}")],
        _ => vec![tuple],
    }
}

/// FMUs that use libm without saying so find it in most hosts, but not in a Rust program.
fn preload_libm() {
    static LIBM: OnceLock<Option<Library>> = OnceLock::new();
    LIBM.get_or_init(|| {
        #[cfg(target_os = "linux")]
        {
            use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
            // SAFETY: the C library's own.
            unsafe { Library::open(Some("libm.so.6"), RTLD_NOW | RTLD_GLOBAL) }.ok().map(Into::into)
        }
        #[cfg(not(target_os = "linux"))]
        None
    });
}

/// The library, or why it cannot be loaded.
fn open(path: &Path) -> Result<Library, String> {
    // SAFETY: loading runs the FMU's own initialisers; the user who opens an FMU trusts its code.
    #[cfg(unix)]
    let library = unsafe {
        use libloading::os::unix::{Library, RTLD_LOCAL, RTLD_NOW};
        Library::open(Some(path), RTLD_NOW | RTLD_LOCAL).map(Into::into)
    };
    #[cfg(not(unix))]
    // SAFETY: as above.
    let library = unsafe { Library::new(path) };
    library.map_err(|e| std::error::Error::source(&e).map_or_else(|| e.to_string(), ToString::to_string))
}

mod python;
