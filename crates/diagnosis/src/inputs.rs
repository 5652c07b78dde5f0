//! What was read, as hashes.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use trueup_signals::{Case, recording_file};

use crate::outcome::DiagnosisInputs;

/// A file that was there and cannot be read any more.
#[derive(Debug, thiserror::Error)]
#[error("{}: {source}", .file.display())]
pub struct UnreadRecording {
    /// The file.
    pub file: PathBuf,
    /// Why.
    pub source: std::io::Error,
}

/// Hashes of `case.toml`, of all recordings that it names and of the files next to these.
///
/// # Errors
/// [`UnreadRecording`]
pub fn read(case: &Case) -> Result<DiagnosisInputs, UnreadRecording> {
    let file = case.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let mut files = BTreeMap::from([(file, hash(&case.file)?)]);
    for name in case.recordings() {
        files.insert(name.to_owned(), hash(&recording_file(&case.folder.join(name)))?);
        let path = PathBuf::from(name);
        // As the reader of recordings looks for them.
        let short = path.with_extension("toml");
        let reserved = ["case.toml", "key.toml"].iter().any(|name| short.ends_with(name));
        let long = PathBuf::from(format!("{name}.toml"));
        for sidecar in [Some(long), (!reserved).then_some(short)].into_iter().flatten() {
            let file = case.folder.join(&sidecar);
            if file.is_file() {
                files.insert(sidecar.to_string_lossy().into_owned(), hash(&file)?);
            }
        }
    }
    let mut list = String::new();
    for (name, hash) in &files {
        let _ = writeln!(list, "{hash}  {name}");
    }
    Ok(DiagnosisInputs { sha256: hex(&Sha256::digest(list.as_bytes())), files })
}

fn hash(file: &Path) -> Result<String, UnreadRecording> {
    let bytes = std::fs::read(file).map_err(|source| UnreadRecording { file: file.into(), source })?;
    Ok(hex(&Sha256::digest(&bytes)))
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_changed_reading_changes_the_hash_and_a_sidecar_counts() {
        let Ok(dir) = tempfile::tempdir() else { return };
        let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).is_ok();
        assert!(write("case.toml", "x") && write("a.csv", "time,b\n0,1\n") && write("key.toml", "y"));
        let case = Case {
            folder: dir.path().into(),
            file: dir.path().join("case.toml"),
            train: vec!["a.csv".into()],
            ..Case::default()
        };
        let of =
            || read(&case).map(|i| (i.sha256, i.files.into_keys().collect::<Vec<_>>())).unwrap_or_default();
        let first = of();
        assert_eq!(first.1, ["a.csv", "case.toml"]);
        // sha256 of `x`.
        let known = "2d711642b726b04401627ca9fbac32f5c8530fb1903cc4db02258717921a4881";
        assert_eq!(read(&case).map(|i| i.files["case.toml"].clone()).ok(), Some(known.into()));
        assert!(write("a.toml", "") && of().1 == ["a.csv", "a.toml", "case.toml"]);
        assert!(write("a.csv", "time,b\n0,2\n") && of().0 != first.0);
    }
}
