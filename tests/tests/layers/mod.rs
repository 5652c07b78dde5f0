//! The rules of ARCHITECTURE.md, enforced: who may depend on whom, where code may print or be unsafe, how long
//! a file may be, and that effects and equations lead from the documents to the code and to a test.
//!
//! Every rule is a function from facts to complaints, so that the tests next to it can show it a bad example.

#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod circles;
mod documents;
mod graph;
mod names;
mod plants;
mod roles;
mod rust;
mod sources;
mod symbols;

use std::fs;
use std::path::{Path, PathBuf};

/// What breaks a rule: where, what, and the remedy.
type Complaints = Vec<String>;

/// A file with its path relative to the root, `/` between its parts.
struct File {
    path: String,
    text: String,
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").canonicalize().expect("the workspace's folder")
}

/// The project's files whose name ends with one of `endings`, without what is built or fetched.
fn files(endings: &[&str]) -> Vec<File> {
    fn walk(folder: &Path, visit: &mut impl FnMut(&Path)) {
        let mut entries: Vec<_> =
            fs::read_dir(folder).expect("a readable folder").map(|e| e.expect("an entry").path()).collect();
        entries.sort();
        for path in entries {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            match path.is_dir() {
                true if ["target", "out", ".venv", ".git", "__pycache__"].contains(&&*name) => {}
                true => walk(&path, visit),
                false => visit(&path),
            }
        }
    }
    let (root, mut found) = (root(), Vec::new());
    walk(&root, &mut |path| {
        let relative = path.strip_prefix(&root).expect("a path below the root");
        let path_text =
            relative.components().map(|c| c.as_os_str().to_string_lossy()).collect::<Vec<_>>().join("/");
        if endings.iter().any(|e| path_text.ends_with(e)) {
            let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{path_text}: {e}"));
            found.push(File { path: path_text, text });
        }
    });
    assert!(!found.is_empty(), "no files that end with {endings:?} below {}", root.display());
    found
}

/// Fails with every complaint.
fn none(complaints: Complaints) {
    assert!(complaints.is_empty(), "{} rule(s) broken:\n  {}\n", complaints.len(), complaints.join("\n  "));
}

/// A bad example is found, and its message has what the reader needs.
#[cfg(test)]
fn found(complaints: &Complaints, words: &[&str]) {
    assert_eq!(complaints.len(), 1, "{complaints:?}");
    for word in words {
        assert!(complaints[0].contains(word), "{word:?} is missing in {:?}", complaints[0]);
    }
}
