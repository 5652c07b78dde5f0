//! Files that have their name only when they are whole.
//!
//! Until then they are `.NAME.<random>.part` next to it: no one can guess that name or prepare it, and two programs that write
//! the same file do not meet. A program that was killed leaves its part; the next one that writes this file takes it away.

use std::fs::{File, TryLockError, read_dir, remove_file};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

/// A new part of a file that will be `path`.
///
/// # Errors
/// There is no such folder, or it cannot be written.
pub fn part(path: &Path) -> Result<NamedTempFile> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    if !folder.is_dir() {
        let why = format!("there is no folder {}; make it, or name another one", folder.display());
        return Err(Error::new(ErrorKind::NotFound, why));
    }
    if path.is_dir() {
        return Err(Error::new(ErrorKind::IsADirectory, "it is a folder; name a file"));
    }
    let prefix = format!(".{name}.");
    sweep(folder, &prefix);
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX);
    #[cfg(unix)] // as any file that a program writes, less what the user's mask takes away
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    loop {
        let part = builder.tempfile_in(folder).map_err(|e| refused(folder, &e))?;
        // The lock shows that another process writes. Where there are no locks nothing is swept.
        if !matches!(part.as_file().try_lock(), Err(TryLockError::WouldBlock)) && part.path().exists() {
            return Ok(part);
        }
    }
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// It cannot be written.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    let mut part = part(path)?;
    part.write_all(bytes)?;
    part.persist(path)?;
    Ok(())
}

/// The system's message without the random name.
fn refused(folder: &Path, e: &Error) -> Error {
    let why =
        e.raw_os_error().map_or_else(|| e.to_string(), |code| Error::from_raw_os_error(code).to_string());
    Error::new(
        e.kind(),
        format!("nothing can be written to the folder {}: {why}; name another one", folder.display()),
    )
}

const SUFFIX: &str = ".part";

/// Takes away parts that no process writes any more; what cannot be taken away stays.
fn sweep(folder: &Path, prefix: &str) {
    for entry in read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let random = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(SUFFIX));
        let ours = random.is_some_and(|r| r.len() == 6 && r.chars().all(|c| c.is_ascii_alphanumeric()));
        if !ours || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = entry.path();
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            read_dir(folder).unwrap().map(|f| f.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_a_killed_program_left_is_swept_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| std::fs::write(folder.path().join(name), "x").unwrap();
        file(".r.csv.Ab12cd.part");
        let others = [".other.csv.Ab12cd.part", ".r.csv.notes.part", ".r.csv.part", "r.csv.part"];
        others.iter().for_each(|name| file(name));
        let target = folder.path().join("r.csv");
        let running = part(&target).unwrap();
        write(&target, b"whole").unwrap();
        assert!(running.path().exists(), "another program is writing it");
        drop(running);
        let mut expected: Vec<_> = others.iter().map(|n| (*n).to_owned()).collect();
        expected.push("r.csv".into());
        expected.sort();
        assert_eq!(names(folder.path()), expected);
        assert_eq!(std::fs::read(&target).unwrap(), b"whole");
    }

    #[cfg(unix)]
    #[test]
    fn a_planted_link_is_neither_written_nor_swept() {
        let folder = tempfile::tempdir().unwrap();
        let victim = folder.path().join("victim");
        std::fs::write(&victim, "mine").unwrap();
        let planted = folder.path().join(".r.csv.Ab12cd.part");
        std::os::unix::fs::symlink(&victim, &planted).unwrap();
        for old in [".r.csv.part".to_owned(), format!("r.csv.{}.part", std::process::id())] {
            std::os::unix::fs::symlink(&victim, folder.path().join(old)).unwrap();
        }
        write(&folder.path().join("r.csv"), b"result").unwrap();
        assert_eq!(std::fs::read(&victim).unwrap(), b"mine");
        assert!(planted.is_symlink());
    }
}
