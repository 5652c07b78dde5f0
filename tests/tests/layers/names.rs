//! A type's name is defined once in the sources of the workspace, so that it can be searched for and means one thing (decision 60).

use std::collections::BTreeMap;

use super::rust::code_of;
use super::{Complaints, File, files, none};

/// Files whose types replace those of another file. This list only shrinks.
const INSTEAD: &[(&str, &str)] = &[(
    "crates/fmi-import/src/isolation/elsewhere.rs",
    "of isolation/link and isolation/open, on systems other than Linux",
)];

/// Words that are no term of a plant, a measurement, an estimation or a program: no type is called so.
const IMAGES: &[&str] = &[
    "Again", "Ahead", "Along", "Asked", "Believed", "Beside", "Ground", "Held", "Kept", "Led", "Made", "Ran",
    "Said", "Shown", "Sought", "Told", "Took", "Wanted", "Wish",
];

/// Names of the types that a file defines, functions' and test modules' own ones too, each as often as it is defined.
fn types(code: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for line in code.lines() {
        let mut words = line
            .split_whitespace()
            .skip_while(|w| w.starts_with("pub") || w.ends_with(')') || *w == "unsafe");
        let Some(keyword) = words.next() else { continue };
        // A `type` within braces is an associated one.
        let defines = match keyword {
            "struct" | "enum" | "union" | "trait" => true,
            "type" => !line.starts_with(char::is_whitespace),
            _ => false,
        };
        let name = words.next().unwrap_or_default();
        let end = name.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(name.len());
        if defines && name.starts_with(|c: char| c.is_ascii_uppercase()) {
            found.push(&name[..end]);
        }
    }
    found
}

fn complaints(all: &[File]) -> Complaints {
    let code: Vec<(&str, String)> = all
        .iter()
        .filter(|f| f.path.contains("src/") && !INSTEAD.iter().any(|i| i.0 == f.path))
        .map(|f| (f.path.as_str(), code_of(f)))
        .collect();
    let mut places: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
    for (path, code) in &code {
        types(code).into_iter().for_each(|name| places.entry(name).or_default().push(path));
    }
    let twice = places.iter().filter(|(_, at)| at.len() > 1).map(|(name, at)| {
        format!("{name} is defined in {}; give each a longer name that distinguishes it", at.join(", "))
    });
    let images = places
        .iter()
        .filter(|(name, _)| IMAGES.contains(name))
        .map(|(name, at)| format!("{}: {name} is no term of the field; say what the type is", at.join(", ")));
    twice.chain(images).collect()
}

#[test]
fn a_type_name_stands_once() {
    let all = files(&[".rs"]);
    let gone = INSTEAD.iter().filter(|(path, _)| !all.iter().any(|f| f.path == *path));
    let gone = gone.map(|(path, _)| format!("{path} is gone; take it out of the list"));
    none(complaints(&all).into_iter().chain(gone).collect());
}

#[test]
fn names_that_stand_twice_are_found() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    let one =
        file("crates/a/src/one.rs", "pub struct Link;\nimpl Iterator for Link {\n    type Item = u8;\n}\n");
    let two = file(
        "crates/b/src/two.rs",
        "pub enum Gear { Link }\n// struct Link;\nimpl X for Gear {\n    type Item = u8;\n}\n#[cfg(test)]\nmod tests {\n    struct Link<T>(T);\n}\n",
    );
    super::found(&complaints(&[one, two]), &["Link", "one.rs, crates/b/src/two.rs", "longer name"]);
    let inside =
        file("crates/a/src/one.rs", "struct Gear;\nmod tests {\n    pub(in crate::one) struct Gear;\n}\n");
    super::found(&complaints(&[inside]), &["Gear", "one.rs, crates/a/src/one.rs"]);
    let image = file("crates/a/src/one.rs", "pub(crate) trait Along {}\n");
    super::found(&complaints(&[image]), &["one.rs", "Along", "term"]);
    let alone = [
        file("crates/a/src/one.rs", "type Torque = f64;\n"),
        file("crates/a/tests/two.rs", "struct Torque;\n"),
        file("crates/a/src/three.rs", "struct Torques;\n"),
    ];
    assert!(complaints(&alone).is_empty());
}
