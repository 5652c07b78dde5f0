//! Writes `ports.toml`: a draft, each guess with its reason.

use std::fmt::Write;

use crate::roles::{BODY_ROLES, FmuPorts, JOINT_ROLES, PortPlace};

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

/// A key, in quotes where it needs them.
fn bare(name: &str) -> String {
    let plain = !name.is_empty() && name.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-');
    if plain { name.to_owned() } else { quoted(name) }
}

fn comment(reason: &str) -> String {
    if reason.is_empty() { String::new() } else { format!("  # GUESS: {}", reason.replace('\n', " ")) }
}

/// The file's text.
pub fn write(ports: &FmuPorts) -> String {
    let mut out = String::from(
        "# What the variables of this FMU mean; format: docs/ports.md. Lines with GUESS are guessed: check them.\n",
    );
    let _ = writeln!(out, "fmu = {}", quoted(&ports.fmu));
    for open in &ports.open {
        let _ = writeln!(out, "# Open: {}", open.replace('\n', " "));
    }
    for place in ports.places() {
        let (title, roles, figures) = match &place {
            PortPlace::Joint(name) => {
                (format!("joint.{}", bare(name)), JOINT_ROLES, &["gearRatio", "torqueConstant"][..])
            }
            other => (other.table(), BODY_ROLES, &["mass"][..]),
        };
        let _ = writeln!(out, "\n[{title}]");
        for role in roles {
            let all: Vec<_> = ports.list(&place, *role).collect();
            let Some(first) = all.first() else { continue };
            let names: Vec<String> = all.iter().map(|v| quoted(&v.variable)).collect();
            let value = match BODY_ROLES.contains(role) {
                true => format!("[{}]", names.join(", ")),
                false => names.join(", "),
            };
            let _ = writeln!(out, "{} = {value}{}", role.key(), comment(&first.reason));
        }
        for figure in figures.iter().filter_map(|key| ports.figure(&place, key)) {
            let _ = writeln!(out, "{} = {:?}{}", figure.key, figure.value, comment(&figure.reason));
        }
    }
    if !ports.sensors.is_empty() {
        out += "\n[sensors]  # GUESS: by unit\n";
    }
    for s in &ports.sensors {
        let _ = writeln!(out, "{} = {{ kind = {} }}", bare(&s.variable), quoted(&s.kind));
    }
    out
}
