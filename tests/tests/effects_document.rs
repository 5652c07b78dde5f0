//! docs/effects.md describes every effect as the library does: its table is written from the specifications and
//! from the equation at the head of each effect's file. `TRUEUP_BLESS=1` writes it again.

#![allow(clippy::expect_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;
use trueup_models::effect::{ALL, EffectChoice, EffectKind, EffectPlace, PlantKind, Scope};

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

fn model(plant: PlantKind) -> &'static str {
    match plant {
        PlantKind::Joint => "TwoMassJoint",
        PlantKind::Arm => "PlanarManipulator",
        PlantKind::Space => "SpatialFreeFlyer",
    }
}

fn section(kind: EffectKind, equation: &str, file: &str) -> String {
    let spec = kind.spec();
    let base = |p: &PlantKind| if spec.acts_in(*p, false) { "" } else { " on a fixed base" };
    let plants: Vec<_> = spec.plants.iter().map(|p| format!("{}{}", model(*p), base(p))).collect();
    let often = |scope: Scope| match scope {
        Scope::Joint => "once per joint",
        Scope::Once => "once",
        Scope::Channel => "once per element of the channel",
    };
    let places = |p: &EffectPlace| {
        let models: Vec<_> = p.plants.iter().map(|p| model(*p)).collect();
        format!("`:{}` ({})", p.name, models.join(", "))
    };
    let mut s = String::new();
    let _ = writeln!(s, "### `{}`\n\n{}.\n", spec.id, capital(spec.summary));
    let _ = writeln!(s, "> {}\n", equation.replace('|', "\\|").replace('*', "\\*"));
    let _ = writeln!(s, "| | |\n|---|---|");
    if spec.places.is_empty() {
        let _ = writeln!(s, "| acts on | {}, {} |", spec.component, often(spec.scope));
    } else if spec.scope == Scope::Channel {
        let _ = writeln!(s, "| acts on | `sensor:<channel>`, {} |", often(spec.scope));
    } else {
        let _ = writeln!(s, "| acts on | the place named |");
    }
    let _ = writeln!(s, "| plants | {} |", plants.join(", "));
    if !spec.places.is_empty() {
        let list: Vec<_> = spec.places.iter().map(places).collect();
        let _ = writeln!(s, "| places | {} |", list.join(", "));
    }
    // Of the channels the first one represents all.
    let shown = if spec.scope == Scope::Channel { 1 } else { spec.places.len().max(1) };
    for place in 0..shown {
        let here = spec.places.get(place).map_or(spec.plants, |p| p.plants);
        let c = EffectChoice { kind, place, plant: here[0] };
        let space = if here[..] == [PlantKind::Space] { " in space" } else { "" };
        let at = match c.place() {
            Some(p) if shown > 1 => format!(" {}{space}", p.name),
            _ => String::new(),
        };
        let own: Vec<_> = c.parameters().iter().map(|p| (c.variable(p.name), c.unit(p.unit))).collect();
        let _ = writeln!(s, "| parameters{at} | {} |", names(own.iter().map(|(n, u)| (n.as_str(), *u))));
    }
    if !spec.space_parameters.is_empty() {
        let own = spec.space_parameters.iter().map(|p| (p.name, p.unit));
        let _ = writeln!(s, "| parameters in space | {} |", names(own));
    }
    if !spec.not_in_space.is_empty() {
        let _ = writeln!(s, "| not in space | {} |", spec.not_in_space);
    }
    if !spec.borrows.is_empty() {
        let list = spec.borrows.iter().map(|b| format!("`{}`", b.joint_name)).collect::<Vec<_>>().join(", ");
        let _ = writeln!(s, "| the plant's own | {list} |");
    }
    if !spec.inputs.is_empty() {
        let _ = writeln!(s, "| inputs | {} |", names(spec.inputs.iter().map(|u| (u.name, u.unit))));
    }
    let c = EffectChoice { kind, place: 0, plant: spec.plants[0] };
    let states: Vec<_> = spec.states.iter().map(|x| (c.variable(x.name), c.unit(x.unit))).collect();
    let _ = writeln!(s, "| states | {} |", names(states.iter().map(|(n, u)| (n.as_str(), *u))));
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
        expected += &section(*kind, &equation(&source, &file), &file);
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
            "docs/effects.md differs from the library in line {} of its table; TRUEUP_BLESS=1 writes it again",
            i + 1
        );
    }
    assert_eq!(
        table.lines().count(),
        expected.lines().count(),
        "docs/effects.md: TRUEUP_BLESS=1 writes it again"
    );
}

#[test]
fn an_effect_without_an_equation_is_found() {
    assert!(std::panic::catch_unwind(|| equation("//! `x`: y.\n//!\n//! z\n", "x.rs")).is_err());
    assert_eq!(equation("//! `x`.\n//!\n//! (EF-0) a\n//! b.\n//!\n//! c\n", "x.rs"), "(EF-0) a b.");
}
