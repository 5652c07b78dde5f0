//! docs/ports.md has every key of the reader of ports, and no other; every key is read, mistakes have line and remedy; every effect
//! has a rule.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::collections::BTreeSet;
use std::path::Path;

use trueup_models::effect;
use trueup_ports::{insert, keys, read, write};

use crate::key_tables::{compare, document};

/// `TRUEUP_BLESS=1` writes the tables again.
#[test]
fn every_key_is_in_the_document_and_no_other() {
    compare("ports.md", keys::ALL);
}

fn mistakes(text: &str) -> Vec<String> {
    let found = read::parse(text, Path::new("ports.toml"));
    found.err().unwrap_or_default().iter().map(ToString::to_string).collect()
}

/// A key that nothing reads may have any value: a date is none for any of them.
#[test]
fn every_key_is_read() {
    for keys in keys::ALL {
        for name in keys.names().chain(["unknown"]) {
            let line = format!("{name} = 2024-01-01\n");
            let text = match keys.of {
                "ports" => format!("{line}{}", if name == "fmu" { "" } else { "fmu = \"a.fmu\"\n" }),
                "a joint" => format!("fmu = \"a.fmu\"\n[joint.1]\n{line}"),
                "a sensor" => format!("fmu = \"a.fmu\"\n[sensors.x]\n{line}"),
                body => format!("fmu = \"a.fmu\"\n[{body}]\n{line}"),
            };
            let said = mistakes(&text);
            assert!(said.iter().any(|m| m.contains(&format!("`{name}`"))), "{text}{said:?}");
            let unknown = said.iter().any(|m| m.contains(&format!("has no `{name}`")));
            assert_eq!(unknown, name == "unknown", "{text}{said:?}");
        }
    }
}

/// The examples are read without a mistake, use every key, and are the same after they are written and read.
#[test]
fn examples_are_read_and_written_back() {
    let page = document("ports.md");
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
    assert_eq!(blocks.len(), 2);
    for block in &blocks {
        let mut ports = read::parse(block, Path::new("ports.toml")).unwrap();
        let mut again = read::parse(&write::write(&ports), Path::new("ports.toml")).unwrap();
        for p in [&mut ports, &mut again] {
            p.variables.iter_mut().for_each(|v| v.line = 0);
            p.sensors.iter_mut().for_each(|s| s.line = 0);
        }
        assert_eq!(ports, again);
    }
    for key in keys::ALL.iter().flat_map(keys_of) {
        assert!(blocks.iter().any(|b| b.contains(key)), "`{key}` is in no example");
    }
}

fn keys_of(keys: &trueup_signals::keys::Keys) -> impl Iterator<Item = &'static str> {
    keys.names().collect::<Vec<_>>().into_iter()
}

#[test]
fn mistakes_have_their_line_and_a_remedy() {
    for (text, line, words) in [
        ("fmu = \"a.fmu\"\n\n[joint.1]\ntorqe = \"u\"\n", 4, "did you mean `torque`?"),
        ("fmu = \"a.fmu\"\n[joint.1]\ntorque = 3\n", 3, "write a name in quotes"),
        ("fmu = \"a.fmu\"\n[joint.1]\ntorque = [\"u\"]\n", 3, "write one name"),
        ("fmu = \"a.fmu\"\n[base]\nforce = \"u\"\n", 3, "write force = [\"...\"]"),
        ("fmu = \"a.fmu\"\n[joint.1]\ngearRatio = 0\n", 3, "a number other than 0"),
        ("fmu = \"a.fmu\"\n[joint.1]\ntorqueConstant = -1\n", 3, "a number above 0"),
        ("fmu = \"a.fmu\"\n[joint.1]\ntorque = \"u\"\ncurrent = \"i\"\n", 4, "keep the one that drives"),
        ("fmu = \"a.fmu\"\n[sensors]\nq = { kind = \"encodr\" }\n", 3, "write one of encoder"),
        ("fmu = \"a.fmu\"\n[sensors]\nq = {}\n", 3, "has no `kind`"),
        ("fmu = \"a.fmu\"\njoint = 1\n", 2, "write [joint]"),
        ("fmu = \"a.fmu\n", 1, "correct the TOML"),
        ("[joint.1]\ntorque = \"u\"\n", 1, "write fmu ="),
    ] {
        let said = mistakes(text);
        let found = said.iter().any(|m| m.starts_with(&format!("ports.toml:{line}: ")) && m.contains(words));
        assert!(found, "{text}{said:?}");
    }
}

/// An effect that acts on readings acts on all of them: its places are channels.
#[test]
fn every_effect_of_the_library_has_a_rule_at_each_of_its_places() {
    let ours: BTreeSet<String> = insert::rules().map(str::to_owned).collect();
    let placed = |spec: &effect::Spec| -> Vec<String> {
        match spec.places {
            [] => vec![spec.id.to_owned()],
            _ if spec.id.starts_with("sensor-") => vec![spec.id.to_owned()],
            places => places.iter().map(|p| format!("{}:{}", spec.id, p.name)).collect(),
        }
    };
    let library: BTreeSet<String> = effect::ALL.iter().flat_map(|e| placed(e.spec())).collect();
    assert_eq!(ours, library);
}
