//! Which crate may depend on which.

use super::{Complaints, none, root};
use cargo_metadata::{DependencyKind, MetadataCommand};

/// What a crate may import.
struct Rule {
    name: &'static str,
    /// Crates of ours.
    ours: &'static [&'static str],
    /// Crates of others that it may never import; `*`: any.
    never: &'static [&'static str],
}

const INPUT_OUTPUT: &[&str] =
    &["serde", "serde_json", "zip", "quick-xml", "roxmltree", "libloading", "clap", "rand"];
const ARCHIVES: &[&str] = &["zip", "quick-xml", "roxmltree", "libloading", "clap"];

const RULES: &[Rule] = &[
    Rule { name: "trueup-numerics", ours: &[], never: INPUT_OUTPUT },
    // What is required of a plant, whichever it is.
    Rule { name: "trueup-plant", ours: &["trueup-numerics"], never: INPUT_OUTPUT },
    Rule { name: "trueup-models", ours: &["trueup-numerics", "trueup-plant"], never: INPUT_OUTPUT },
    Rule { name: "trueup-fmi", ours: &[], never: &["*"] },
    Rule { name: "trueup-fmi-export", ours: &["trueup-fmi", "trueup-numerics"], never: ARCHIVES },
    Rule { name: "trueup-fmi-description", ours: &["trueup-fmi"], never: &["libloading", "clap"] },
    // Anybody's FMU is a plant, too.
    Rule {
        name: "trueup-fmi-import",
        ours: &["trueup-fmi", "trueup-fmi-description", "trueup-numerics", "trueup-plant"],
        never: &["clap"],
    },
    Rule {
        name: "trueup-cosim",
        ours: &["trueup-numerics", "trueup-signals", "trueup-fmi-description", "trueup-fmi-import"],
        never: &["clap", "libloading"],
    },
    // Many runs of the master's; files that are whole are fmi-description's.
    Rule { name: "trueup-sweep", ours: &["trueup-cosim", "trueup-fmi-description"], never: ARCHIVES },
    // Linear algebra of a model at a pose.
    Rule {
        name: "trueup-flexibility",
        ours: &["trueup-numerics", "trueup-models", "trueup-plant"],
        never: INPUT_OUTPUT,
    },
    // Units are those of FMUs and of files; it depends on no model.
    Rule {
        name: "trueup-scaling",
        ours: &["trueup-cosim", "trueup-signals", "trueup-fmi-description"],
        never: ARCHIVES,
    },
    // Experiments on anybody's FMU; mistakes in its file are reported as those in a system's.
    Rule {
        name: "trueup-ports",
        ours: &[
            "trueup-numerics",
            "trueup-plant",
            "trueup-signals",
            "trueup-cosim",
            "trueup-fmi-description",
            "trueup-fmi-import",
        ],
        never: ARCHIVES,
    },
    Rule { name: "trueup-signals", ours: &[], never: &["clap", "libloading"] },
    // Robots from files, for the program and for cases.
    Rule {
        name: "trueup-robot",
        ours: &["trueup-models", "trueup-signals"],
        never: &["zip", "quick-xml", "libloading", "clap"],
    },
    // Statistics: recordings that others have read come in, numbers go out; it judges nothing.
    Rule {
        name: "trueup-estimation",
        ours: &["trueup-numerics", "trueup-models", "trueup-plant", "trueup-robot", "trueup-signals"],
        never: ARCHIVES,
    },
    Rule { name: "trueup-hypotheses", ours: &["trueup-signals", "trueup-estimation"], never: ARCHIVES },
    // What is fitted may be a model of ours or an FMU of others; by innovations it is the model alone of a diagnosis.
    Rule {
        name: "trueup-identification",
        ours: &[
            "trueup-numerics",
            "trueup-models",
            "trueup-plant",
            "trueup-signals",
            "trueup-estimation",
            "trueup-fmi-description",
            "trueup-fmi-import",
        ],
        never: ARCHIVES,
    },
    Rule {
        name: "trueup-diagnosis",
        ours: &[
            "trueup-numerics",
            "trueup-models",
            "trueup-plant",
            "trueup-signals",
            "trueup-hypotheses",
            "trueup-identification",
        ],
        never: ARCHIVES,
    },
    // Recorded motion in, poses of bodies out, by the models' kinematics; it draws nothing and integrates nothing.
    Rule { name: "trueup-scene", ours: &["trueup-models"], never: INPUT_OUTPUT },
    // Finished results in, files and a page out: it never simulates or fits; of a diagnosis it reads the result, and the case that
    // the result is of.
    Rule {
        name: "trueup-report",
        ours: &[
            "trueup-models",
            "trueup-signals",
            "trueup-identification",
            "trueup-diagnosis",
            "trueup-scene",
        ],
        never: ARCHIVES,
    },
    // Depends on nothing of ours, so that its truth is independent.
    Rule { name: "trueup-trials", ours: &[], never: ARCHIVES },
    Rule { name: "fmu-plant", ours: BINDING, never: ARCHIVES },
    Rule { name: "fmu-controller", ours: BINDING, never: ARCHIVES },
    Rule {
        name: "fmu-library",
        ours: &["trueup-fmi", "trueup-fmi-export", "trueup-numerics", "fmu-plant", "fmu-controller"],
        never: ARCHIVES,
    },
    Rule {
        name: "trueup-cli",
        ours: &[
            "trueup-numerics",
            "trueup-models",
            "trueup-fmi",
            "trueup-fmi-export",
            "trueup-fmi-description",
            "trueup-fmi-import",
            "trueup-cosim",
            "trueup-signals",
            "trueup-ports",
            "trueup-robot",
            "trueup-scaling",
            "trueup-sweep",
            "trueup-flexibility",
            "trueup-identification",
            "trueup-diagnosis",
            "trueup-report",
            "trueup-scene",
            "trueup-trials",
            "fmu-plant",
            "fmu-controller",
            "fmu-library",
        ],
        never: &[],
    },
    // Binds libraries to Python, and decides nothing.
    Rule {
        name: "trueup-python",
        ours: &[
            "trueup-fmi-description",
            "trueup-fmi-import",
            "trueup-cosim",
            "trueup-signals",
            "trueup-sweep",
            "trueup-identification",
            "trueup-diagnosis",
            "trueup-report",
        ],
        never: ARCHIVES,
    },
    // Makes FMUs for tests; sees nothing of ours, so that it is foreign to all.
    Rule { name: "trueup-testkit", ours: &[], never: &["libloading", "clap"] },
    // Evidence: only dev-dependencies.
    Rule { name: "trueup-acceptance", ours: &[], never: &["*"] },
    Rule { name: "trueup-witness", ours: &[], never: &["*"] },
];
const BINDING: &[&str] = &["trueup-fmi", "trueup-fmi-export", "trueup-models", "trueup-numerics"];

/// Crates that never see each other, tests included: our importer treats our FMU as a foreign one, and the truth of a
/// blind trial comes from nothing that a diagnosis depends on.
const STRANGERS: &[(&str, &str)] = &[
    ("trueup-fmi-export", "trueup-fmi-import"),
    ("trueup-fmi-import", "trueup-fmi-export"),
    ("trueup-trials", "trueup-numerics"),
    ("trueup-trials", "trueup-models"),
    ("trueup-trials", "trueup-estimation"),
    ("trueup-trials", "trueup-hypotheses"),
    ("trueup-trials", "trueup-identification"),
    ("trueup-trials", "trueup-diagnosis"),
    ("trueup-models", "trueup-trials"),
    ("trueup-estimation", "trueup-trials"),
    ("trueup-hypotheses", "trueup-trials"),
    ("trueup-identification", "trueup-trials"),
    ("trueup-diagnosis", "trueup-trials"),
];

/// A dependency of a crate of ours.
struct Edge {
    from: String,
    to: String,
    /// `to` is a crate of the workspace.
    own: bool,
    dev: bool,
}

fn edge_complaint(edge: &Edge) -> Option<String> {
    let Edge { from, to, own, dev } = edge;
    let manifest = format!("Cargo.toml of {from}");
    let Some(rule) = RULES.iter().find(|r| r.name == from) else {
        return Some(format!(
            "{manifest}: this crate has no rule; give it one in tests/tests/layers/graph.rs"
        ));
    };
    if STRANGERS.iter().any(|(a, b)| a == from && b == to) {
        return Some(format!("{manifest}: {from} and {to} never see each other, not even in tests"));
    }
    if *own && to == "trueup-cli" {
        return Some(format!(
            "{manifest}: nothing imports tools/*; move what is shared into a crate below crates/"
        ));
    }
    if *dev {
        return None;
    }
    let wrong = if *own {
        !rule.ours.contains(&to.as_str())
    } else {
        rule.never.iter().any(|n| *n == "*" || n == to)
    };
    wrong.then(|| {
        format!("{manifest}: {from} must not import {to}; move the code to a crate that may, or argue for the edge in ARCHITECTURE.md and tests/tests/layers/graph.rs")
    })
}

fn edges() -> Vec<Edge> {
    let metadata = MetadataCommand::new()
        .manifest_path(root().join("Cargo.toml"))
        .no_deps()
        .exec()
        .expect("cargo metadata reads the workspace");
    let own = |name: &str| metadata.packages.iter().any(|p| p.name.as_str() == name);
    let mut edges = Vec::new();
    for package in &metadata.packages {
        for d in &package.dependencies {
            edges.push(Edge {
                from: package.name.to_string(),
                to: d.name.clone(),
                own: own(&d.name),
                // A build script is no part of the crate.
                dev: d.kind != DependencyKind::Normal,
            });
        }
    }
    edges
}

#[test]
fn crates_depend_only_on_what_the_rules_allow() {
    none(edges().iter().filter_map(edge_complaint).collect());
}

/// A template is refused when a source of it changed: the fingerprint must know them all.
#[test]
fn the_fingerprint_of_the_library_names_every_crate_in_it() {
    let edges = edges();
    let mut inside = vec!["fmu-library".to_owned()];
    let mut next = 0;
    while let Some(from) = inside.get(next).cloned() {
        next += 1;
        for e in edges.iter().filter(|e| e.own && !e.dev && e.from == from) {
            if !inside.contains(&e.to) {
                inside.push(e.to.clone());
            }
        }
    }
    let script = std::fs::read_to_string(root().join("crates/fmu-library/build.rs")).expect("a build script");
    let (_, list) = script.split_once("CRATES: &[&str] = &[").expect("a list of crates");
    let list = list.split_once("];").expect("an end of the list").0;
    let mut named: Vec<&str> = list.split('"').skip(1).step_by(2).collect();
    let mut needed: Vec<String> = inside
        .iter()
        .map(|name| match name.strip_prefix("trueup-") {
            Some(folder) => format!("crates/{folder}"),
            None if name == "fmu-library" => "crates/fmu-library".to_owned(),
            None => name.clone(),
        })
        .collect();
    named.sort_unstable();
    needed.sort();
    assert_eq!(named, needed);
}

#[test]
fn forbidden_edges_are_found() {
    let edge = |from: &str, to: &str, own, dev| {
        edge_complaint(&Edge { from: from.into(), to: to.into(), own, dev })
            .into_iter()
            .collect::<Complaints>()
    };
    let says = super::found;
    says(
        &edge("trueup-numerics", "trueup-models", true, false),
        &["trueup-numerics", "trueup-models", "move"],
    );
    says(&edge("trueup-numerics", "serde", false, false), &["serde"]);
    says(&edge("trueup-models", "trueup-fmi", true, false), &["trueup-fmi"]);
    says(&edge("trueup-fmi", "thiserror", false, false), &["thiserror"]);
    says(&edge("trueup-fmi-export", "zip", false, false), &["zip"]);
    says(&edge("trueup-fmi-description", "libloading", false, false), &["libloading"]);
    says(&edge("trueup-fmi-import", "trueup-models", true, false), &["trueup-models"]);
    says(&edge("trueup-cosim", "trueup-models", true, false), &["trueup-cosim", "trueup-models"]);
    says(&edge("fmu-plant", "trueup-fmi-import", true, false), &["trueup-fmi-import"]);
    says(&edge("trueup-new", "trueup-fmi", true, false), &["no rule"]);
    says(&edge("trueup-trials", "trueup-models", true, true), &["never see each other"]);
    // Tests are free, but not to break these two.
    says(&edge("trueup-fmi-import", "trueup-fmi-export", true, true), &["never see each other"]);
    says(&edge("fmu-plant", "trueup-cli", true, true), &["tools/*"]);
    assert!(edge("trueup-numerics", "num-dual", false, true).is_empty());
    assert!(edge("trueup-fmi-import", "trueup-fmi", true, false).is_empty());
}
