//! What a sweep is known by: a hash of all files that its results depend on.

use std::io::Result;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use trueup_cosim::system::CosimSystem;

/// SHA-256 over the sweep's file, the system's, its FMUs and its inputs.
///
/// # Errors
/// A file cannot be read.
pub fn fingerprint(sweep: &Path, system: &CosimSystem) -> Result<String> {
    let mut files: Vec<&Path> = vec![sweep, &system.file];
    files.extend(system.components.iter().map(|c| c.fmu.as_path()));
    files.extend(system.inputs.iter().map(|i| i.file.as_path()));
    let mut seen: Vec<&Path> = Vec::new();
    let mut hash = Sha256::new();
    for file in files {
        // What is inside an archive is hashed with the archive.
        if !seen.contains(&file) && file.exists() {
            seen.push(file);
            add(file, &mut hash)?;
        }
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

fn add(path: &Path, hash: &mut Sha256) -> Result<()> {
    if !path.is_dir() {
        let bytes = std::fs::read(path)?;
        hash.update((bytes.len() as u64).to_le_bytes());
        hash.update(bytes);
        return Ok(());
    }
    let entries = std::fs::read_dir(path)?.map(|entry| entry.map(|e| e.path()));
    let mut entries: Vec<PathBuf> = entries.collect::<Result<_>>()?;
    entries.sort();
    for entry in entries {
        hash.update(entry.file_name().unwrap_or_default().as_encoded_bytes());
        add(&entry, hash)?;
    }
    Ok(())
}
