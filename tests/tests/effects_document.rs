//! docs/effects.md says of every effect what the library says: its table is written from the specifications and
//! from the equation at the head of each effect's file. `TRUEUP_BLESS=1` writes it anew.

#![allow(clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;
use trueup_models::effect::{ALL, Plant, Scope, Spec};

const BEGIN: &str = "<!-- written from the library: TRUEUP_BLESS=1 cargo test -p trueup-acceptance -->\n";
const END: &str = "<!-- end -->\n";

/// The paragraph of the file's documentation that begins with the equation's id.
fn equation(source: &str, file: &str) -> String {
    let lines = source.lines().map_while(|l| l.strip_prefix("//!")).map(str::trim);
    let paragraph: Vec<_> =
        lines.skip_while(|l| !l.starts_with("(EF-")).take_while(|l| !l.is_empty()).collect();
    assert!(!paragraph.is_empty(), "{file}: its documentation has no paragraph that begins with `(EF-n)`");
    paragraph.join(" ")
}

fn names<'a>(items: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let list: Vec<_> = items.map(|(name, unit)| format!("`{name}` {unit}")).collect();
    if list.is_empty() { "none".into() } else { list.join(", ") }
}

fn section(spec: &Spec, equation: &str, file: &str) -> String {
    let plants: Vec<_> = spec
        .plants
        .iter()
        .map(|p| match p {
            Plant::Joint => "TwoMassJoint",
            Plant::Arm => "PlanarManipulator",
        })
        .collect();
    let often = if spec.scope == Scope::Joint { "once per joint" } else { "once" };
    let mut s = String::new();
    let _ = writeln!(s, "### `{}`\n\n{}.\n", spec.id, capital(spec.summary));
    let _ = writeln!(s, "> {}\n", equation.replace('|', "\\|").replace('*', "\\*"));
    let _ = writeln!(s, "| | |\n|---|---|");
    let _ = writeln!(s, "| acts on | {}, {often} |", spec.component);
    let _ = writeln!(s, "| plants | {} |", plants.join(", "));
    let _ = writeln!(s, "| parameters | {} |", names(spec.parameters.iter().map(|p| (p.name, p.unit))));
    let _ = writeln!(s, "| states | {} |", names(spec.states.iter().map(|x| (x.name, x.unit))));
    let _ = writeln!(s, "| outputs | {} |", names(spec.outputs.iter().map(|y| (y.name, y.unit))));
    let _ = writeln!(s, "| code | [effect/{file}](../crates/models/src/effect/{file}) |\n");
    s
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().collect::<String>() + letters.as_str()).unwrap_or_default()
}

#[test]
fn the_document_says_what_the_library_says() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut expected = String::from("\n");
    for kind in ALL {
        let spec = kind.spec();
        let file = format!("{}.rs", spec.id.replace('-', "_"));
        let source = std::fs::read_to_string(root.join("crates/models/src/effect").join(&file))
            .unwrap_or_else(|e| panic!("the effect {} belongs into effect/{file}: {e}", spec.id));
        expected += &section(spec, &equation(&source, &file), &file);
    }

    let path = root.join("docs/effects.md");
    let document = std::fs::read_to_string(&path).expect("docs/effects.md");
    let (head, rest) =
        document.split_once(BEGIN).expect("docs/effects.md has the line where its table begins");
    let (table, tail) = rest.split_once(END).expect("docs/effects.md has the line where its table ends");
    if std::env::var_os("TRUEUP_BLESS").is_some() {
        std::fs::write(&path, format!("{head}{BEGIN}{expected}{END}{tail}"))
            .expect("docs/effects.md can be written");
        return;
    }
    for (i, (is, must)) in table.lines().zip(expected.lines()).enumerate() {
        assert_eq!(
            is,
            must,
            "docs/effects.md differs from the library in line {} of its table; TRUEUP_BLESS=1 writes it anew",
            i + 1
        );
    }
    assert_eq!(
        table.lines().count(),
        expected.lines().count(),
        "docs/effects.md: TRUEUP_BLESS=1 writes it anew"
    );
}

#[test]
fn an_effect_without_an_equation_is_found() {
    assert!(std::panic::catch_unwind(|| equation("//! `x`: y.\n//!\n//! z\n", "x.rs")).is_err());
    assert_eq!(equation("//! `x`.\n//!\n//! (EF-0) a\n//! b.\n//!\n//! c\n", "x.rs"), "(EF-0) a b.");
}
