//! Plants are objects: who may name one, and who may take a model's generic equations.

use super::rust::{Source, is_test_file};
use super::{Complaints, File, files, none};
use fmu_plant::MODELS;

/// Where a plant is made, bound, described or packed; a path or the beginning of one.
const HOMES: &[&str] = &[
    "crates/models/",
    "fmu-plant/",
    "fmu-controller/",
    // Packs, lists, demonstrates: the program speaks of models to its users.
    "tools/cli/",
    // Another one's joint and arm, for blind trials.
    "crates/trials/",
    // Which model takes which part of a robot file.
    "crates/robot/",
    // Reads the name of a model out of a library.
    "crates/fmi-description/src/template.rs",
];

/// What names a plant in a string all the same. This list only shrinks.
const NAMED: &[(&str, &str)] = &[
    (
        "crates/estimation/src/innovations/joint_frame.rs",
        "the innovations engine has the joint's equations of its own so far",
    ),
    ("crates/report/src/diagnosis/words.rs", "declares how a plant is drawn"),
    ("crates/signals/src/case/parse.rs", "declares what a case looks like"),
    ("crates/signals/src/case/payload.rs", "declares which model carries one"),
    ("crates/signals/src/keys.rs", "declares what a case looks like"),
];

/// Who takes a [`Hybrid`]'s generic equations, which compiles them once more. Numerics drive them, the FMU library is them.
const GENERIC: &[&str] = &[
    "crates/numerics/",
    "crates/models/",
    "crates/fmi-export/",
    "crates/fmu-library/",
    "fmu-plant/",
    "fmu-controller/",
];

/// What does so all the same. This list only shrinks.
const INSTANCES: &[(&str, &str)] =
    &[("crates/identification/src/tangent.rs", "is one: sensitivities next to states, of any plant")];

fn listed(list: &[(&str, &str)], path: &str) -> bool {
    list.iter().any(|(p, _)| *p == path)
}

fn names(file: &File) -> Complaints {
    if is_test_file(&file.path)
        || HOMES.iter().any(|home| file.path.starts_with(home))
        || listed(NAMED, &file.path)
    {
        return Vec::new();
    }
    let source = Source::of(file);
    let literals = &source.literals;
    let lines = literals.lines().enumerate();
    lines
        .filter_map(|(i, line)| Some((i, MODELS.iter().find(|name| line.contains(*name))?)))
        .map(|(i, name)| {
            format!(
                "{}:{}: names the plant {name}; use `dyn Plant`, or put it into the list of models (crates/models/src/plants.rs)",
                file.path,
                i + 1
            )
        })
        .collect()
}

fn instances(file: &File) -> Complaints {
    if is_test_file(&file.path)
        || GENERIC.iter().any(|home| file.path.starts_with(home))
        || listed(INSTANCES, &file.path)
    {
        return Vec::new();
    }
    let lines = Source::of(file).lines_with("Hybrid");
    lines
        .into_iter()
        .map(|line| {
            format!(
                "{}:{line}: takes a model's generic equations, which compiles them again; take `&dyn Plant`, `Compiled` has it",
                file.path
            )
        })
        .collect()
}

/// Exceptions that are none any more.
fn stale(list: &[(&str, &str)], rule: impl Fn(&File) -> Complaints) -> Complaints {
    let all = files(&[".rs"]);
    let still = |path: &str| {
        // Under another path, where no exception holds.
        let of = all.iter().find(|f| f.path == path);
        of.is_some_and(|f| {
            !rule(&File { path: "crates/other/src/lib.rs".into(), text: f.text.clone() }).is_empty()
        })
    };
    let gone = list.iter().filter(|(path, _)| !still(path));
    gone.map(|(path, _)| format!("{path}: needs no exception any more; take it out of the list")).collect()
}

#[test]
fn no_plant_is_named_outside_models_and_their_bindings() {
    none(files(&[".rs"]).iter().flat_map(names).chain(stale(NAMED, names)).collect());
}

#[test]
fn no_model_is_compiled_again_outside_models() {
    none(files(&[".rs"]).iter().flat_map(instances).chain(stale(INSTANCES, instances)).collect());
}

#[test]
fn bad_examples_of_plants_are_found() {
    let file = |text: &str| File { path: "crates/estimation/src/lib.rs".into(), text: text.into() };
    super::found(
        &names(&file("fn f() -> bool { model == \"TwoMassJoint\" }")),
        &["TwoMassJoint", "dyn Plant"],
    );
    super::found(&instances(&file("fn f<M: Hybrid>(m: &M) {}")), &["Compiled"]);
    assert!(names(&file("// of a TwoMassJoint\nfn f() {}")).is_empty());
    assert!(instances(&file("/// See [`Hybrid`].\nfn f() {}")).is_empty());
}
