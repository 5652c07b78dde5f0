//! What may stand in a source file.

use super::rust::{Source, is_test_file};
use super::{Complaints, File, files, none};

/// Folders and files of the libraries in which `unsafe` may stand.
const UNSAFE: &[&str] = &[
    "crates/fmi/src/abi/",
    "crates/fmi-export/src/abi/",
    "crates/fmi-export/src/export.rs",
    "crates/fmi-import/src/core.rs",
    "crates/fmi-import/src/fmi2",
    "crates/fmi-import/src/fmi3",
    "crates/fmi-import/src/library",
    "crates/fmi-import/src/log",
    "crates/fmi-import/src/program.rs",
];
const LONGEST: usize = 800;

fn printing(file: &File) -> Complaints {
    if file.path.starts_with("tools/") || is_test_file(&file.path) {
        return Vec::new();
    }
    let source = Source::of(file);
    let macros = ["println!", "eprintln!", "print!", "eprint!", "dbg!"];
    let lines = macros.iter().flat_map(|m| source.lines_with(m).into_iter().map(move |line| (line, m)));
    lines
        .map(|(line, m)| {
            format!("{}:{line}: {m} in a library; return the message, tools/cli prints it", file.path)
        })
        .collect()
}

fn unsafety(file: &File) -> Complaints {
    if is_test_file(&file.path) || UNSAFE.iter().any(|allowed| file.path.starts_with(allowed)) {
        return Vec::new();
    }
    let mut source = Source::of(file);
    // The type of a C function does nothing yet; calling it does. (The literal "C" is blank here.)
    source.code = source.code.replace("unsafe extern     fn(", "extern fn(");
    let lines = source.lines_with("unsafe");
    let mend = "move it to the C boundary (crates/fmi-export/src/abi, crates/fmi-import/src/library.rs)";
    lines
        .into_iter()
        .map(|line| format!("{}:{line}: unsafe away from the C boundary; {mend}", file.path))
        .collect()
}

fn length(file: &File) -> Complaints {
    let lines = file.text.lines().count();
    let long = lines > LONGEST && file.path.contains("src/");
    long.then(|| format!("{}: {lines} lines; split it, {LONGEST} are the most", file.path))
        .into_iter()
        .collect()
}

/// A path of one machine in what is built or read by users.
fn machine_paths(file: &File) -> Complaints {
    if is_test_file(&file.path) {
        return Vec::new();
    }
    let text = if file.path.ends_with(".rs") { Source::of(file).literals } else { file.text.clone() };
    let mut complaints = Vec::new();
    for (i, line) in text.lines().enumerate() {
        // Spelt so that this check does not find itself.
        for folder in ["home", "root", "work", "tmp"].map(|name| format!("/{name}/")) {
            // Below another folder, or below `..`, it is no absolute path.
            let absolute =
                |at: usize| !line[..at].ends_with(|c: char| c.is_alphanumeric() || "._-}".contains(c));
            if line.match_indices(&folder).any(|(at, _)| absolute(at)) {
                complaints.push(format!(
                    "{}:{}: {folder} is a path of one machine; make it relative",
                    file.path,
                    i + 1
                ));
            }
        }
    }
    complaints
}

fn check(endings: &[&str], rule: impl Fn(&File) -> Complaints) {
    none(files(endings).iter().flat_map(rule).collect());
}

#[test]
fn only_the_program_prints() {
    check(&[".rs"], printing);
}

#[test]
fn unsafe_stays_at_the_c_boundary() {
    check(&[".rs"], unsafety);
}

#[test]
fn no_source_file_is_too_long() {
    check(&[".rs"], length);
}

#[test]
fn no_path_of_a_machine() {
    check(&[".rs", ".toml", ".md", ".html", ".xml", ".txt", ".py", ".sh", "/run", "test"], machine_paths);
}

#[test]
fn broken_rules_are_found() {
    let file = |path: &str, text: &str| File { path: path.into(), text: text.into() };
    let says = super::found;
    let library = "crates/models/src/joint.rs";

    says(
        &printing(&file(library, "fn f() {\n    println!(\"x\");\n}\n")),
        &["joint.rs:2", "println!", "tools/cli"],
    );
    assert!(printing(&file("tools/cli/src/main.rs", "println!(\"x\");")).is_empty());
    assert!(printing(&file(library, "/// println!(\"x\")\n")).is_empty());

    says(&unsafety(&file(library, "let x = unsafe { *p };\n")), &["joint.rs:1", "boundary"]);
    says(&unsafety(&file("crates/fmi-export/src/core.rs", "#[unsafe(no_mangle)]")), &["core.rs:1"]);
    says(&unsafety(&file(library, "unsafe extern \"C\" fn f() {}")), &["joint.rs:1"]);
    assert!(unsafety(&file(library, "type F = unsafe extern \"C\" fn(i32);")).is_empty());
    assert!(unsafety(&file("crates/fmi-export/src/abi/fmi3.rs", "unsafe {}")).is_empty());
    assert!(unsafety(&file(library, "#![deny(unsafe_op_in_unsafe_fn)] // unsafe\n")).is_empty());

    says(&length(&file(library, &"\n".repeat(801))), &["801 lines", "split"]);
    assert!(length(&file(library, &"\n".repeat(800))).is_empty());

    says(&machine_paths(&file(library, "let p = \"/home/me/x\";\n")), &["joint.rs:1", "/home/", "relative"]);
    says(&machine_paths(&file("README.md", "run\n`/home/trueup`\n")), &["README.md:2", "/home/"]);
    assert!(machine_paths(&file("README.md", "target/home/x ../home/y")).is_empty());
    assert!(machine_paths(&file("crates/a/tests/b.rs", "\"/home/x\"")).is_empty());
}
