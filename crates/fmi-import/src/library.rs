//! An FMU on disk, and the functions of its library.

#![allow(unsafe_code)] // the C boundary

use std::env::consts::{ARCH, DLL_SUFFIX, OS};
use std::ffi::c_void;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use libloading::Library;
use tempfile::TempDir;
use trueup_fmi_description::archive::Archive;
use trueup_fmi_description::description::Description;
use trueup_fmi_description::{Version, read};

use crate::core::Table;
use crate::error::Error;

/// Which interface of an FMU is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interface {
    /// The FMU gives derivatives, the importer integrates.
    ModelExchange,
    /// The FMU integrates.
    CoSimulation,
}

/// An unpacked FMU. Its directory lives as long as the last instance.
#[derive(Debug)]
pub struct Fmu {
    file: PathBuf,
    directory: PathBuf,
    description: Description,
    _unpacked: Option<TempDir>,
}

impl Fmu {
    /// Opens an FMU: a file, unpacked into a temporary directory, or an unpacked directory.
    ///
    /// # Errors
    /// [`Error::Archive`] if it cannot be unpacked, [`Error::File`] if its description cannot be read.
    pub fn open(file: impl AsRef<Path>) -> Result<Arc<Self>, Error> {
        Self::open_as(file.as_ref(), file.as_ref())
    }

    /// Opens `file` and calls it `name` in messages: where it came from, if it was copied from there.
    ///
    /// # Errors
    /// As [`Fmu::open`].
    pub fn open_as(file: &Path, name: &Path) -> Result<Arc<Self>, Error> {
        let fail = |reason: String| Error::File { file: name.into(), reason };
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
        Ok(Arc::new(Self { file: name.into(), directory, description, _unpacked: unpacked }))
    }

    /// Where it came from.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Its description.
    pub fn description(&self) -> &Description {
        &self.description
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

    /// Loads the library of an interface for this platform.
    pub(crate) fn library(&self, version: Version, interface: Interface) -> Result<Library, Error> {
        let fail = |reason: String| Error::File { file: self.file.clone(), reason };
        let (offered, what) = match interface {
            Interface::ModelExchange => (&self.description.model_exchange, "Model Exchange"),
            Interface::CoSimulation => (&self.description.co_simulation, "Co-Simulation"),
        };
        let Some(offered) = offered else {
            return Err(Error::Interface { file: self.file.clone(), interface: what.into() });
        };
        let identifier = &offered.model_identifier;
        let own = self.description.version;
        if own != version {
            let interface = format!("FMI {}; it is an FMU of FMI {}", version.as_str(), own.as_str());
            return Err(Error::Interface { file: self.file.clone(), interface });
        }
        if identifier.contains(['/', '\\']) {
            return Err(fail(format!("modelIdentifier \"{identifier}\" is no file name")));
        }
        let binaries = self.directory.join("binaries");
        let platforms = platforms(version);
        let candidates = platforms.iter().map(|p| binaries.join(p).join(format!("{identifier}{DLL_SUFFIX}")));
        let Some(path) = candidates.into_iter().find(|path| path.is_file()) else {
            let mut have: Vec<_> = fs::read_dir(&binaries)
                .into_iter()
                .flatten()
                .flatten()
                .map(|entry| entry.file_name().to_string_lossy().into_owned())
                .collect();
            have.sort();
            return Err(fail(format!(
                "no binary {identifier}{DLL_SUFFIX} for this platform ({}); there are binaries for: {}. \
                 Use an FMU that was built for this platform",
                platforms.join(" or "),
                if have.is_empty() { "none".into() } else { have.join(", ") }
            )));
        };
        preload_libm();
        open(&path)
            .or_else(|e| python::retry(&path, e))
            .map_err(|e| fail(format!("its library cannot be loaded: {e}")))
    }
}

/// Names of this platform's folder under `binaries`.
fn platforms(version: Version) -> Vec<String> {
    let os = if OS == "macos" { "darwin" } else { OS };
    let tuple = format!("{ARCH}-{os}");
    let (short, bits) = (if os == "windows" { "win" } else { os }, usize::BITS);
    match (version, ARCH) {
        (Version::V2, "x86" | "x86_64") => vec![format!("{short}{bits}"), tuple],
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
    // SAFETY: loading runs the FMU's own initialisers; whoever opens an FMU trusts its code.
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

/// A struct with one optional pointer per function of a version.
macro_rules! function_table {
    ($free:ident: $(fn $name:ident($($arg:ident: $type:ty),* $(,)?) $(-> $result:ty)?;)*) => {
        /// Pointers to the functions that the library exports; they are valid while `library` is loaded.
        #[allow(non_snake_case, dead_code)] // the list is complete, also where nothing needs it yet
        pub(crate) struct Functions {
            $(pub(crate) $name: Option<pointer::$name>,)*
            /// Taken (never unloaded) when the FMU ended in a fatal error.
            pub(crate) library: Option<Library>,
        }

        impl Functions {
            pub(crate) fn of(library: Library) -> Self {
                Self {
                    // SAFETY: the symbol is a function of the standard, with the standard's signature.
                    $($name: unsafe { library.get::<pointer::$name>(stringify!($name)) }.ok().map(|f| *f),)*
                    library: Some(library),
                }
            }
        }

        impl Table for Functions {
            unsafe fn free(&self, component: *mut c_void) {
                if let Some(free) = self.$free {
                    // SAFETY: the caller's word.
                    unsafe { free(component) }
                }
            }

            fn leak(&mut self) {
                std::mem::forget(self.library.take());
            }
        }
    };
}

/// The table of FMI 2.0.
pub(crate) mod table2 {
    use super::*;
    use trueup_fmi::abi::fmi2::*;
    macro_rules! table {
        ($($list:tt)*) => { function_table! { fmi2FreeInstance: $($list)* } };
    }
    trueup_fmi::fmi2_functions!(table);
}

/// The table of FMI 3.0.
pub(crate) mod table3 {
    use super::*;
    use trueup_fmi::abi::fmi3::*;
    macro_rules! table {
        ($($list:tt)*) => { function_table! { fmi3FreeInstance: $($list)* } };
    }
    trueup_fmi::fmi3_functions!(table);
}
