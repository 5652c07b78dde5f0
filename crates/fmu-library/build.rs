//! A fingerprint of all sources of ours in the library: a template of another one is not packed.

use std::path::{Path, PathBuf};
use std::{env, fs, io};

/// Folders of the crates in the library, this one among them (tests/tests/layers holds the list complete).
const CRATES: &[&str] = &[
    "crates/fmi",
    "crates/fmi-export",
    "crates/fmu-library",
    "crates/models",
    "crates/numerics",
    "crates/plant",
    "fmu-controller",
    "fmu-plant",
];

fn files(folder: &Path, found: &mut Vec<PathBuf>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() { files(&path, found)? } else { found.push(path) }
    }
    Ok(())
}

fn main() -> io::Result<()> {
    let root = Path::new("../..");
    let mut found = Vec::new();
    for name in CRATES {
        let (manifest, sources) = (root.join(name).join("Cargo.toml"), root.join(name).join("src"));
        println!("cargo::rerun-if-changed={}", manifest.display());
        println!("cargo::rerun-if-changed={}", sources.display());
        files(&sources, &mut found)?;
        found.push(manifest);
    }
    // As every system names them, in the same order.
    let name = |path: &PathBuf| path.to_string_lossy().replace('\\', "/");
    found.sort_by_key(name);
    // FNV-1a, 64 bits.
    let mut hash: u64 = 0xcbf2_9ce4_8422_2325;
    for path in found {
        for byte in name(&path).into_bytes().into_iter().chain(fs::read(&path)?) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
    let version = env::var("CARGO_PKG_VERSION").unwrap_or_default();
    println!("cargo::rustc-env=TRUEUP_STAMP={version}-{hash:016x}");
    Ok(())
}
