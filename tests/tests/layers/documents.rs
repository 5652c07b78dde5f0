//! From the documents to the code and to the tests: effects by file, equations by id.

use super::rust::is_test_file;
use super::{Complaints, File, files, none, root};
use std::collections::BTreeSet;

/// Files of crates/models/src/effect that are no effect.
/// Files next to the effects: what they are made of.
const NO_EFFECT: &[&str] = &["mod", "list", "set", "tests", "spec", "choice", "channel", "memory", "power"];

fn unnamed_effects(sources: &[File], document: &File) -> Complaints {
    let effects = sources.iter().filter_map(|f| {
        let name = f.path.strip_prefix("crates/models/src/effect/")?.strip_suffix(".rs")?;
        (!name.contains('/') && !NO_EFFECT.contains(&name)).then_some(name)
    });
    let missing = effects.filter(|name| !document.text.contains(&format!("effect/{name}.rs")));
    missing
        .map(|name| {
            format!("crates/models/src/effect/{name}.rs: not named in {}; give it its row", document.path)
        })
        .collect()
}

/// Equation ids (`TMJ-1`, `EF-12`) of a text, in the order of their letters.
fn ids(text: &str) -> BTreeSet<String> {
    let word = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    let id = |w: &&str| {
        w.split_once('-').is_some_and(|(letters, number)| {
            (2..=4).contains(&letters.len())
                && letters.bytes().all(|b| b.is_ascii_uppercase())
                && !["UTF", "ISO", "FMI"].contains(&letters)
                && !number.is_empty()
                && number.bytes().all(|b| b.is_ascii_digit())
        })
    };
    text.split(|c| !word(c)).filter(id).map(str::to_owned).collect()
}

/// Names of functions that begin with `prefix` as a word of the name: `tmj_1`, `tmj1`.
fn names_a_function(text: &str, id: &str) -> bool {
    let lower = id.to_lowercase();
    [lower.replace('-', ""), lower.replace('-', "_")].iter().any(|name| {
        text.match_indices("fn ").any(|(i, _)| {
            let function =
                text[i + 3..].split(|c: char| !(c.is_alphanumeric() || c == '_')).next().unwrap_or_default();
            format!("_{function}_").contains(&format!("_{name}_"))
        })
    })
}

/// The part of a source file that is test, and the part that is not.
fn parts(file: &File) -> (&str, &str) {
    if is_test_file(&file.path) || file.path.ends_with(".py") {
        return ("", &file.text);
    }
    file.text.split_at(file.text.find("#[cfg(test)]").unwrap_or(file.text.len()))
}

fn loose_equations(chapters: &[File], sources: &[File]) -> Complaints {
    let mut complaints = Vec::new();
    let in_code: BTreeSet<String> =
        sources.iter().filter(|f| f.path.ends_with(".rs")).flat_map(|f| ids(parts(f).0)).collect();
    let tests: Vec<&str> = sources.iter().map(|f| parts(f).1).collect();
    let in_tests: BTreeSet<String> = tests.iter().flat_map(|text| ids(text)).collect();
    for chapter in chapters {
        for id in ids(&chapter.text) {
            if !in_code.contains(&id) {
                complaints.push(format!(
                    "{}: {id} is at no line of code; end that line with `// ({id})`",
                    chapter.path
                ));
            }
            if !in_tests.contains(&id) && !tests.iter().any(|text| names_a_function(text, &id)) {
                let mend = format!(
                    "write `Checks {id}.` into the doc comment of the test that would fail if it were wrong"
                );
                complaints.push(format!("{}: {id} is at no test; {mend}", chapter.path));
            }
        }
    }
    complaints
}

/// Ids in the code, of a series that has a chapter, that are in no chapter.
fn unknown_equations(chapters: &[File], sources: &[File]) -> Complaints {
    let series = |id: &String| id.split('-').next().unwrap_or_default().to_owned();
    let known: BTreeSet<_> = chapters.iter().flat_map(|c| ids(&c.text)).collect();
    let chaptered: BTreeSet<_> = known.iter().map(series).collect();
    let mut complaints = Vec::new();
    for file in sources {
        for id in ids(&file.text).iter().filter(|id| chaptered.contains(&series(id)) && !known.contains(*id))
        {
            complaints
                .push(format!("{}: {id} is in no chapter of docs/equations; write it down there", file.path));
        }
    }
    complaints
}

/// Relative links whose target `exists` denies.
fn dead_links(document: &File, exists: impl Fn(&str) -> bool) -> Complaints {
    let folder: Vec<_> =
        document.path.split('/').rev().skip(1).collect::<Vec<_>>().into_iter().rev().collect();
    let mut complaints = Vec::new();
    for link in document.text.split("](").skip(1).filter_map(|rest| rest.split([')', '#']).next()) {
        if link.is_empty() || link.contains("://") {
            continue;
        }
        let mut path = folder.clone();
        for part in link.split('/') {
            match part {
                ".." => drop(path.pop()),
                "." => {}
                part => path.push(part),
            }
        }
        if !exists(&path.join("/")) {
            complaints
                .push(format!("{}: the link {link} leads nowhere; correct or strike it", document.path));
        }
    }
    complaints
}

#[test]
fn every_link_leads_somewhere() {
    let exists = |path: &str| root().join(path).exists();
    none(files(&[".md"]).iter().flat_map(|document| dead_links(document, exists)).collect());
}

#[test]
fn every_effect_file_is_documented() {
    let documents = files(&["docs/effects.md"]);
    none(unnamed_effects(&files(&[".rs"]), &documents[0]));
}

#[test]
fn every_equation_leads_to_code_and_to_a_test() {
    let mut sources = files(&[".rs", ".py", ".mo"]);
    sources.retain(|f| !f.path.starts_with("tests/tests/layers/"));
    sources.retain(|f| f.path != "tests/tests/effects_document.rs");
    let mut chapters = files(&[".md"]);
    chapters.retain(|f| f.path.starts_with("docs/equations/") || f.path == "docs/effects.md");
    none(loose_equations(&chapters, &sources));
    none(unknown_equations(&chapters, &sources));
}

#[test]
fn loose_ends_are_found() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    let says = super::found;

    let effect = file("crates/models/src/effect/sloshing.rs", "");
    says(
        &unnamed_effects(&[effect], &file("docs/effects.md", "effect/backlash.rs")),
        &["sloshing.rs", "docs/effects.md"],
    );

    assert_eq!(
        ids("(TMJ-1) in UTF-8, EF-12; X-1, ABCDE-1, TMJ-x").into_iter().collect::<Vec<_>>(),
        ["EF-12", "TMJ-1"]
    );

    let chapter = [file("docs/equations/joint.md", "(TMJ-1)")];
    let code = || file("crates/models/src/joint.rs", "let a = b; // (TMJ-1)\n");
    let test = || file("crates/models/tests/joint.rs", "/// Checks TMJ-1.\n");
    let other = || file("crates/models/tests/joint.rs", "/// Checks TMJ-11.\nfn tmj_10_holds() {}");
    says(&loose_equations(&chapter, &[test()]), &["joint.md", "TMJ-1", "no line of code", "// (TMJ-1)"]);
    says(&loose_equations(&chapter, &[code(), other()]), &["joint.md", "TMJ-1", "no test", "Checks TMJ-1"]);
    assert!(loose_equations(&chapter, &[code(), test()]).is_empty());
    let named =
        file("crates/models/src/joint.rs", "// (TMJ-1)\n#[cfg(test)]\nmod tests { fn tmj1_holds() {} }");
    assert!(loose_equations(&chapter, &[named]).is_empty());

    let stray = file("crates/models/src/joint.rs", "// (TMJ-9), and (ARM-1) has no chapter yet");
    says(&unknown_equations(&chapter, &[stray]), &["joint.rs", "TMJ-9", "docs/equations"]);
    let modelica = file("modelica/Trueup/TwoMassJoint.mo", "a = b; // (TMJ-8)");
    says(&unknown_equations(&chapter, &[modelica]), &["TwoMassJoint.mo", "TMJ-8", "docs/equations"]);
    // Modelica alone is no code of ours.
    let only = file("modelica/Trueup/TwoMassJoint.mo", "a = b; // (TMJ-1)");
    says(
        &loose_equations(&chapter, &[only, test()]),
        &["joint.md", "TMJ-1", "no line of code", "// (TMJ-1)"],
    );
}
