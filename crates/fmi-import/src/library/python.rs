//! FMUs that are written in Python (PythonFMU) and expect the program that loads them to be Python.

use std::path::Path;
use std::sync::OnceLock;

use libloading::Library;

/// Names the file of Python's library.
const VARIABLE: &str = "TRUEUP_LIBPYTHON";
/// Minor versions of Python 3 that are looked for, from the newest.
const MINORS: std::ops::RangeInclusive<u32> = 7..=30;

/// Loads Python's library, once and for good, and tries again; `failed`: why the FMU's could not be loaded.
pub(super) fn retry(path: &Path, failed: String) -> Result<Library, String> {
    let symbol = failed.split("undefined symbol: ").nth(1).unwrap_or_default();
    if !(symbol.starts_with("Py") || symbol.starts_with("_Py")) {
        return Err(failed);
    }
    static PYTHON: OnceLock<Option<Library>> = OnceLock::new();
    if PYTHON.get_or_init(find).is_none() {
        return Err(format!(
            "it is written in Python and needs Python's library, which is not found; install it (Debian: libpython3-dev) or \
             let {VARIABLE} name its file ({failed})"
        ));
    }
    super::open(path)
}

#[cfg(unix)]
fn find() -> Option<Library> {
    use libloading::os::unix::{Library, RTLD_GLOBAL, RTLD_NOW};
    // SAFETY: Python's library does nothing before it is called.
    let load = |name: &std::ffi::OsStr| unsafe { Library::open(Some(name), RTLD_NOW | RTLD_GLOBAL) }.ok();
    if let Some(file) = std::env::var_os(VARIABLE) {
        return load(&file).map(Into::into);
    }
    let name = |minor| {
        let end = if cfg!(target_os = "macos") { ".dylib" } else { ".so.1.0" };
        format!("libpython3.{minor}{end}")
    };
    MINORS.rev().find_map(|minor| load(name(minor).as_ref())).map(Into::into)
}

#[cfg(not(unix))]
fn find() -> Option<Library> {
    None
}
