//! Files of a crate import in one direction: those that import each other in a circle are listed, and the list only shrinks.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::rust::{Source, is_test_file};
use super::{Complaints, File, files, none};

/// Circles that are left, each by its first file.
const LEFT: &[&str] = &["crates/cosim/src/couple.rs", "crates/diagnosis/src/diagnose.rs"];

/// A module's path within its crate.
type Module = Vec<String>;

/// Files by crate and module.
fn modules(all: &[File]) -> BTreeMap<&str, BTreeMap<Module, (&str, Arc<Source>)>> {
    let mut crates: BTreeMap<&str, BTreeMap<Module, (&str, Arc<Source>)>> = BTreeMap::new();
    for file in all.iter().filter(|f| !is_test_file(&f.path)) {
        let Some((name, rest)) = file.path.split_once("/src/") else { continue };
        let mut module: Module = rest.trim_end_matches(".rs").split('/').map(str::to_owned).collect();
        if matches!(module.last().map(String::as_str), Some("mod" | "lib" | "main")) {
            module.pop();
        }
        crates.entry(name).or_default().insert(module, (&file.path, Source::of(file)));
    }
    crates
}

/// Paths of the `use` declarations of a file that hand nothing on, and those that do.
fn uses(code: &str) -> [Vec<Vec<String>>; 2] {
    let mut found = [Vec::new(), Vec::new()];
    for (i, _) in code.match_indices("use ") {
        let line = code[..i].rsplit('\n').next().unwrap_or_default().trim();
        let public = line.starts_with("pub");
        if !(line.is_empty() || public && !line.contains('{')) {
            continue;
        }
        let Some(end) = code[i..].find(';') else { continue };
        expand(&code[i + 4..i + end], &[], &mut found[usize::from(public)]);
    }
    found
}

/// `a::{b, c::d}` as `a::b` and `a::c::d`.
fn expand(text: &str, before: &[String], into: &mut Vec<Vec<String>>) {
    let (mut depth, mut from) = (0, 0);
    let ends = text.char_indices().chain([(text.len(), ',')]).filter(|(_, c)| {
        depth += i32::from(*c == '{') - i32::from(*c == '}');
        *c == ',' && depth == 0
    });
    for (end, _) in ends {
        let item = text[from..end].trim();
        from = (end + 1).min(text.len());
        let (path, inner) = match item.split_once('{') {
            Some((path, inner)) => (path.trim_end_matches("::"), inner.trim_end().strip_suffix('}')),
            None => (item.split(" as ").next().unwrap_or_default(), None),
        };
        let own = path.split("::").map(str::trim).filter(|s| !s.is_empty()).map(str::to_owned);
        let path: Vec<String> = before.iter().cloned().chain(own).collect();
        match inner {
            Some(inner) => expand(inner, &path, into),
            None if path.is_empty() => {}
            None => into.push(path),
        }
    }
}

/// The module that a path names within its crate, re-exports followed.
fn resolved(
    of: &BTreeMap<Module, (&str, Arc<Source>)>,
    at: &[String],
    path: &[String],
    depth: usize,
) -> Option<Module> {
    let (mut base, mut rest) = match path.first()?.as_str() {
        "crate" => (Vec::new(), &path[1..]),
        "self" => (at.to_vec(), &path[1..]),
        "super" => (at.to_vec(), path),
        first => {
            let child: Module = at.iter().cloned().chain([first.to_owned()]).collect();
            of.contains_key(&child).then_some((at.to_vec(), path))?
        }
    };
    while rest.first().is_some_and(|p| p == "super") {
        base.pop();
        rest = &rest[1..];
    }
    while let Some(next) = rest.first() {
        let child: Module = base.iter().cloned().chain([next.clone()]).collect();
        if !of.contains_key(&child) {
            break;
        }
        (base, rest) = (child, &rest[1..]);
    }
    if let (Some(name), true) = (rest.first(), depth < 6) {
        let handed = uses(&of.get(&base)?.1.code)[1].iter().find(|p| p.last() == Some(name)).cloned();
        if let Some(found) = handed.and_then(|path| resolved(of, &base, &path, depth + 1)) {
            return Some(found);
        }
    }
    of.contains_key(&base).then_some(base)
}

/// Files that import each other in a circle, each circle in order.
fn circles(all: &[File]) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for of in modules(all).values() {
        let mut imports: BTreeMap<&Module, BTreeSet<Module>> = BTreeMap::new();
        for (module, (_, source)) in of {
            let [own, public] = uses(&source.code);
            let own = own.iter().filter_map(|path| resolved(of, module, path, 0));
            // A file is a front for its own modules; what it hands on of others it imports.
            let public = public.iter().filter_map(|path| resolved(of, module, path, 0));
            let targets = own.chain(public.filter(|target| !target.starts_with(module)));
            imports.insert(module, targets.collect());
        }
        let reach = |from: &Module| {
            let mut seen: BTreeSet<&Module> = BTreeSet::new();
            let mut next: Vec<&Module> = vec![from];
            while let Some(m) = next.pop() {
                next.extend(imports[m].iter().filter(|t| *t != m).filter(|t| seen.insert(t)));
            }
            seen.into_iter().cloned().collect::<BTreeSet<Module>>()
        };
        let reached: BTreeMap<&Module, BTreeSet<Module>> = of.keys().map(|m| (m, reach(m))).collect();
        let mut done: BTreeSet<&Module> = BTreeSet::new();
        for m in of.keys().filter(|m| reached[m].contains(*m)) {
            let circle: Vec<&Module> =
                of.keys().filter(|o| reached[m].contains(*o) && reached[o].contains(m)).collect();
            if circle.len() > 1 && done.insert(circle[0]) {
                found.push(circle.iter().map(|c| of[*c].0.to_owned()).collect());
            }
        }
    }
    found
}

fn complaints(all: &[File], left: &[&str]) -> Complaints {
    let found = circles(all);
    let new = found.iter().filter(|c| !left.contains(&c[0].as_str())).map(|c| {
        format!("{} import each other in a circle; move what both need into a file below them", c.join(", "))
    });
    let gone = left.iter().filter(|first| !found.iter().any(|c| c[0] == **first));
    new.chain(gone.map(|first| format!("{first}: its circle is gone; take it off the list"))).collect()
}

#[test]
fn files_import_in_one_direction() {
    none(complaints(&files(&[".rs"]), LEFT));
}

#[test]
fn a_circle_is_found() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    let all = [
        file("c/src/lib.rs", "mod a;\nmod b;\npub use b::Two;\n"),
        file("c/src/a.rs", "use crate::Two;\npub struct One;\n"),
        file("c/src/b.rs", "use super::a::{self, One};\npub struct Two;\n"),
        file("c/src/c.rs", "// use crate::d::X;\nuse crate::a::One;\n"),
    ];
    super::found(&complaints(&all, &[]), &["c/src/a.rs, c/src/b.rs", "circle"]);
    assert!(complaints(&all, &["c/src/a.rs"]).is_empty());
    super::found(&complaints(&all[..2], &["c/src/a.rs"]), &["take it off"]);
    let handed_on = [
        file("c/src/a.rs", "pub use super::b::Two;\npub struct One;\n"),
        file("c/src/b.rs", "use super::a::One;\npub struct Two;\n"),
    ];
    super::found(&complaints(&handed_on, &[]), &["c/src/a.rs, c/src/b.rs", "circle"]);
    let front = [
        file("c/src/a/mod.rs", "mod b;\npub use b::Two;\npub struct One;\n"),
        file("c/src/a/b.rs", "use super::One;\npub struct Two;\n"),
    ];
    assert!(complaints(&front, &[]).is_empty());
}
