//! docs/cases.md has every key that the reader of cases knows, and no other; its examples are cases.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use trueup_signals::{Case, Recording};

type Keys = BTreeMap<String, BTreeSet<String>>;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn document() -> String {
    std::fs::read_to_string(root().join("docs/cases.md")).unwrap()
}

/// Texts in double quotes.
fn quoted(text: &str) -> Vec<String> {
    text.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The keys that `Reader::known` is asked for, by table: every call of it names the table and lists its keys.
fn known(source: &str) -> Keys {
    let mut all = Keys::new();
    for call in source.split(".known(").skip(1) {
        let call = call.split(");").next().unwrap_or_default();
        let list = match call.split_once("&[") {
            Some((_, list)) => list.to_owned(),
            None => {
                let constant = source.split("const KEYS: &[&str] =").nth(1).unwrap_or_default();
                constant.split("];").next().unwrap_or_default().to_owned()
            }
        };
        // `what` is the text of the call, or of the variable that was made for it just before.
        let said = quoted(call.split("&[").next().unwrap_or_default());
        let made = source.split(call).next().unwrap_or_default().rsplit("let what = format!(").next();
        let table = said.into_iter().next().or_else(|| quoted(made?).into_iter().next()).unwrap_or_default();
        let table = table.split('.').next().unwrap_or_default().to_owned();
        all.entry(table).or_default().extend(quoted(&list));
    }
    all
}

fn sources(folder: &Path, text: &mut Vec<String>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, text);
        } else if path.extension().is_some_and(|e| e == "rs") {
            text.push(std::fs::read_to_string(path).unwrap());
        }
    }
}

/// The first column of each table below a `<!-- keys of: NAME -->`.
fn told(document: &str) -> Keys {
    let blocks = document.split("<!-- keys of: ").skip(1);
    let of = |block: &str| {
        let (name, rest) = block.split_once(" -->").unwrap();
        let rows = rest.trim_start().lines().take_while(|l| l.starts_with('|')).skip(2);
        let key = |row: &str| row.split('`').nth(1).unwrap_or_default().to_owned();
        (name.to_owned(), rows.map(key).collect())
    };
    blocks.map(of).collect()
}

#[test]
fn every_key_of_the_reader_is_told_and_no_other() {
    let mut files = Vec::new();
    sources(&root().join("crates/signals/src"), &mut files);
    let mut read = Keys::new();
    files
        .iter()
        .for_each(|text| known(text).into_iter().for_each(|(t, k)| read.entry(t).or_default().extend(k)));
    assert!(
        read.len() >= 5 && read["a case"].contains("train"),
        "the reader's lists are not found: {read:?}"
    );
    let told = told(&document());
    for (table, keys) in &read {
        let said =
            told.get(table).unwrap_or_else(|| panic!("docs/cases.md has no table of `{table}`: {keys:?}"));
        assert_eq!(keys, said, "keys of `{table}`: the reader's, then those of docs/cases.md");
    }
    assert_eq!(read.keys().collect::<Vec<_>>(), told.keys().collect::<Vec<_>>(), "tables that nothing reads");
}

#[test]
fn a_key_that_is_missing_on_either_side_is_found() {
    let source = "reader.known(root, \"a case\", &[\"model\", \"new\"]);";
    assert_eq!(known(source)["a case"], ["model", "new"].map(str::to_owned).into());
    let source = "let what = format!(\"columns.{name}\");\n self.known(table, &what, &[\"unit\"]);";
    assert_eq!(known(source)["columns"], ["unit".to_owned()].into());
    let text = "<!-- keys of: a case -->\n\n| key | m |\n|---|---|\n| `model` | x |\n\nmore";
    assert_eq!(told(text)["a case"], ["model".to_owned()].into());
}

/// The examples use every key, and are read without an error.
#[test]
fn the_examples_are_read_and_use_every_key() {
    let document = document();
    let blocks: Vec<&str> =
        document.split("```toml\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
    let [case, sidecar] = blocks[..] else { panic!("one case and one sidecar, not {}", blocks.len()) };
    let (read, findings) = Case::parse(Path::new("case.toml"), case, &[]).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!((read.train.len(), read.channels.len(), read.repeats.len()), (2, 2, 1));
    let folder = tempfile::tempdir().unwrap();
    let table = "time,Encoder A,Tacho,Current,Temperature\n0,0,60,1,20\n1,1000,60,2,20\n";
    std::fs::write(folder.path().join("run.csv"), table).unwrap();
    std::fs::write(folder.path().join("run.toml"), sidecar).unwrap();
    let (recording, _) = Recording::read(&folder.path().join("run.csv"), &[], &read.channels).unwrap();
    let last = |name: &str| recording.channels.iter().find(|c| c.name == name).unwrap().values[1];
    assert_eq!(recording.channels.len(), 3);
    assert!((last("motorAngle") - 1.7339808).abs() < 1e-9 && (last("motorCurrent") - 2.0).abs() < 1e-12);
    assert!((last("motorVelocity") - std::f64::consts::TAU).abs() < 1e-9, "60 rpm is a turn a second");
    let all = format!("{case}{sidecar}");
    for key in told(&document).values().flatten() {
        assert!(all.contains(key.as_str()), "`{key}` is in no example");
    }
}
