//! A plant's table declares what a variable is (`role`, `rate_of`, coordinates); nothing decides it by the beginning or end of a name.

use super::rust::{Source, is_test_file};
use super::{Complaints, File, files, none};

/// Crates that query a plant for its variables.
const CRATES: [&str; 5] = ["identification", "diagnosis", "hypotheses", "report", "python"];

/// Calls that take a name apart.
const CALLS: [&str; 6] =
    ["starts_with(", "ends_with(", "contains(", "strip_prefix(", "strip_suffix(", "replace("];

/// Beginnings and endings of the names of variables.
const PARTS: [&str; 21] = [
    "initial",
    "motor",
    "load",
    "joint",
    "base",
    "tip",
    "link",
    "payload",
    "Angle",
    "Velocity",
    "Rate",
    "Attitude",
    "Position",
    "Torque",
    "Force",
    "Inertia",
    "Stiffness",
    "Damping",
    "Start",
    "Duration",
    "Edge",
];

/// Files that take names apart all the same. This list only shrinks.
const NAMED: &[(&str, &str)] = &[
    (
        "crates/diagnosis/src/engine/hypothesis/pose.rs",
        "parameters of a push, whatever its place and its number",
    ),
    (
        "crates/diagnosis/src/shipped.rs",
        "parameters as a claim is written, which the packed model has in one",
    ),
    ("crates/identification/src/fmu.rs", "an FMU's description has no roles: its names declare them"),
    (
        "crates/identification/src/recorded.rs",
        "no table declares which outputs are on the motor's side of a gear",
    ),
];

fn names(file: &File) -> Complaints {
    let own = CRATES.iter().any(|c| file.path.starts_with(&format!("crates/{c}/src/")));
    let listed = NAMED.iter().any(|(path, _)| *path == file.path);
    if is_test_file(&file.path) || !own || listed { Vec::new() } else { taken_apart(file) }
}

fn taken_apart(file: &File) -> Complaints {
    let source = Source::of(file);
    let lines = source.code.lines().zip(source.literals.lines()).enumerate();
    let on = |code: &str, literals: &str| {
        let calls = CALLS.iter().flat_map(|call| code.match_indices(call).map(|(i, c)| i + c.len() + 1));
        let arguments: Vec<&str> = calls.filter_map(|i| literals.get(i..)).collect();
        PARTS.iter().find(|part| arguments.iter().any(|a| a.starts_with(**part))).copied()
    };
    lines
        .filter_map(|(i, (code, literals))| Some((i + 1, on(code, literals)?)))
        .map(|(line, part)| {
            format!(
                "{}:{line}: decides by `{part}` in a name; query the table (crates/plant/src/variable.rs: role, rate_of) or the coordinates",
                file.path
            )
        })
        .collect()
}

#[test]
fn tables_declare_what_a_variable_is() {
    let all = files(&[".rs"]);
    let still = |path: &str| all.iter().any(|f| f.path == path && !taken_apart(f).is_empty());
    let gone = NAMED.iter().filter(|(path, _)| !still(path));
    let stale =
        gone.map(|(path, _)| format!("{path}: takes no name apart any more; take it out of the list"));
    none(all.iter().flat_map(names).chain(stale).collect());
}

#[test]
fn bad_examples_of_names_are_found() {
    let file = |text: &str| File { path: "crates/identification/src/lib.rs".into(), text: text.into() };
    super::found(&names(&file("fn f() -> bool { name.starts_with(\"initial\") }")), &["`initial`", "role"]);
    super::found(&names(&file("fn f() { name.replace(\"Angle\", \"Velocity\"); }")), &["`Angle`", "rate_of"]);
    assert!(names(&file("fn f() -> bool { name.starts_with(\"#\") } // ends_with(\"Angle\")")).is_empty());
}
