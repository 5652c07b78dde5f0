//! C sources of the tests, each compiled once in a process.

use std::collections::HashMap;
use std::path::Path;
use std::process::Command;
use std::sync::{LazyLock, Mutex, PoisonError};

/// The library made of a file in this folder with these options, in this one; `None`, with a message, without a C compiler.
pub(crate) fn compiled(source: &str, options: &[&str], library: &Path) -> Option<()> {
    static MADE: LazyLock<Mutex<HashMap<String, Option<Vec<u8>>>>> = LazyLock::new(Mutex::default);
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    let bytes = made.entry(format!("{source} {options:?}")).or_insert_with(|| {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(source);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("made.so");
        let mut cc = Command::new("cc");
        cc.args(["-shared", "-fPIC", "-O1", "-o"]).arg(&file).arg(source).args(options).arg("-lm");
        cc.status().is_ok_and(|status| status.success()).then(|| std::fs::read(&file).unwrap())
    });
    if bytes.is_none() {
        eprintln!("SKIPPED: no C compiler (cc)");
    }
    std::fs::write(library, bytes.as_ref()?).unwrap();
    Some(())
}
