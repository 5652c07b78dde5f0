//! Links by tables of modes in files of robots: the example of the documents, and mistakes.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn trueup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const BASE: &str = "[base]\nmass = 10.0\ninertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]\n";
const LOAD: &str = r#"
[[body]]
name = "load"
mass = 2.0
center-of-mass = [0.05, 0.0, 0.02]
inertia = [[2e-3, 0.0, 0.0], [0.0, 2e-3, 0.0], [0.0, 0.0, 2e-3]]
position = [0.6, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
motor = { flexible = true, inertia = 1.0, gear-ratio = 100, stiffness = 900.0, damping = 0.5 }
[[tip]]
offset = [0.1, 0.0, 0.0]
"#;
const MODE: &str = "[[body.link.mode]]\nfrequency = 40.0\nparticipation = [0.5, 0.0, 0.0, 0.0, 0.2, 0.0]\n\
                    end-shift = [2.0, 0.0, 0.0]\nend-turn = [0.0, 3.0, 0.0]\n";

/// Arms of docs/robots.md: the body of the beam, and the same with its link by the reduced set.
fn documented() -> [String; 2] {
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/robots.md");
    let page = std::fs::read_to_string(page).unwrap();
    let blocks: Vec<&str> = page.split("```toml\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
    let beam = *blocks.iter().find(|b| b.contains("youngs-modulus")).unwrap();
    let table = *blocks.iter().find(|b| b.contains("[body.link.reduced]")).unwrap();
    let body = &beam[..beam.find("[body.link]").unwrap()];
    [format!("{BASE}{beam}{LOAD}"), format!("{BASE}{body}{table}{LOAD}")]
}

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        Value::Object(map) => map.values().flat_map(numbers).collect(),
        other => other.as_f64().into_iter().collect(),
    }
}

/// Checks LNK-5: a set of the beam's own two shapes is the beam: rest, modes, shares under its weight.
#[test]
fn the_documents_reduced_set_is_the_beam_beside_it() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    let found = documented().map(|arm| {
        // A table does not give the shortening of its link by bending, so the beam must do without that, too.
        std::fs::write(&file, format!("axial-stiffening = false\n{arm}")).unwrap();
        let out = trueup(&["arm", "map", file.to_str().unwrap(), "--pose", "0.4,0.3", "--json"]);
        assert!(out.status.success() && out.stderr.is_empty(), "{}", text(&out.stderr));
        numbers(&serde_json::from_slice(&out.stdout).unwrap())
    });
    let [beam, table] = found;
    assert!(beam.len() == table.len() && beam.len() > 20, "{}", beam.len());
    let off = beam.iter().zip(&table).map(|(a, b)| (a - b).abs() / a.abs().max(1e-3)).fold(0.0, f64::max);
    println!("off by {off:.1e}");
    // The document prints twelve digits.
    assert!(off < 1e-6, "{off:e}");
    let out = trueup(&[
        "fmu",
        "pack",
        "FlexibleArm",
        "--robot",
        file.to_str().unwrap(),
        "-o",
        folder.path().to_str().unwrap(),
    ]);
    assert!(out.status.success(), "{}", text(&out.stderr));
    let info = trueup(&["fmu", "info", folder.path().join("FlexibleArm.fmi3.fmu").to_str().unwrap()]);
    let said = text(&info.stdout);
    for variable in [
        "modesOfLinkTable[2] = 5, 0",
        "linkMass[1] = 0.48 kg",
        "linkModeFrequency[5]",
        "linkModeEndTurn[5][3]",
    ] {
        assert!(said.contains(variable), "{variable}: {said}");
    }
    // Its mass is the arm's where nothing bends.
    assert!(trueup(&["robot", file.to_str().unwrap()]).status.success());
}

/// What a file and `--structure` choose of links counts, the latter last; what tables keep from being simulated is named.
#[test]
fn what_is_chosen_of_links_counts_for_a_robots_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    let (to, robot) = (folder.path().to_str().unwrap(), file.to_str().unwrap());
    let pack = |model: &str, arm: &str, choice: &str| {
        std::fs::write(&file, arm).unwrap();
        let chosen = ["--structure", choice];
        let more = if choice.is_empty() { &[][..] } else { &chosen };
        trueup(&[&["fmu", "pack", model, "--fmi", "3", "--robot", robot, "-o", to], more].concat())
    };
    let [beam, table] = documented();
    let with = |value: &str, arm: &str| format!("axial-stiffening = {value}\n{arm}");
    for (arm, choice, wanted) in [
        (&beam, "", &["axialStiffening = on ", "linkModes[2][3] = 2, 2, 1, 0, 0, 0"][..]),
        (&with("true", &beam), "axialStiffening=off", &["axialStiffening = off "]),
        (
            &with("false", &beam),
            "linkShapes=3",
            &["axialStiffening = off ", "linkModes[2][3] = 3, 3, 1, 0, 0, 0"],
        ),
        (&table, "links=rigid", &["axialStiffening = off "]),
    ] {
        let out = pack("FlexibleArm", arm, choice);
        assert!(out.status.success() && out.stderr.is_empty(), "{}", text(&out.stderr));
        let info = trueup(&["fmu", "info", folder.path().join("FlexibleArm.fmi3.fmu").to_str().unwrap()]);
        let info = text(&info.stdout);
        assert!(wanted.iter().all(|w| info.contains(w)), "{choice}: {info}");
        assert_eq!(info.contains("linkM"), choice != "links=rigid", "{info}");
    }
    // With a table stiffening is off, and named unless the file chose that.
    for (arm, named) in [(&beam, false), (&table, true), (&with("false", &table), false)] {
        std::fs::write(&file, arm).unwrap();
        let out = trueup(&["arm", "map", robot, "--pose", "0.4,0.3"]);
        let said = text(&out.stderr);
        let note =
            said.lines().filter(|l| l.starts_with("note: ") && l.contains("`upper arm` is a table of modes"));
        assert!(out.status.success() && note.count() == usize::from(named), "{said}");
    }
    let remedy = "leave axial-stiffening (axialStiffening) off, or give that link as a beam";
    for (model, choice, wanted) in [
        ("FlexibleArm", "axialStiffening=on", remedy),
        ("FlexibleArm", "linkShapes=3", "has no link that is a beam; leave it out"),
        ("SpatialFreeFlyer", "links=rigid", "there is no `links` to choose here"),
    ] {
        let out = pack(model, &table, choice);
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(2), "{said}");
        assert_eq!(
            said.lines().filter(|l| l.starts_with("error: ") && l.contains(wanted)).count(),
            1,
            "{said}"
        );
    }
}

/// Each mistake by one error with file, line, name and remedy.
#[test]
fn mistakes_in_a_table_name_file_line_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    let [beam, reduced] = documented();
    let (begin, end) =
        (reduced.find("[body.link.reduced]").unwrap(), reduced.find("\n[[body]]\nname = \"load\"").unwrap());
    let modes = format!("{}{MODE}{}", &reduced[..begin], &reduced[end..]);
    let undamped = reduced.replace("damping-ratio = 0.005\n", "");
    let set = "[body.link.reduced]\n";
    let with = |line: &str| format!("{set}{line}\n");
    let coupling = with(
        "damping-matrix = [[5, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0]]",
    );
    for (arm, from, to, line, wanted) in [
        (
            &reduced,
            "[-0.0150857142857, 0.00164",
            "[-0.0140857142857, 0.00164",
            "mass-matrix = [",
            "mass-matrix[1,2] = -0.0150857142857 but mass-matrix[2,1] = -0.0140857142857",
        ),
        (
            &reduced,
            "[0.178285714286, -0.0",
            "[1e-4, -0.0",
            "mass-matrix = [",
            "mass-matrix is not positive definite",
        ),
        (
            &reduced,
            "[110086.888889, -",
            "[-1.0, -",
            "stiffness-matrix",
            "stiffness-matrix[1,1] = -1; the link must be clamped",
        ),
        (
            &reduced,
            "[-33026.0666667, 13210.4",
            "[-33026.0666667, 9000.4",
            "stiffness-matrix",
            "not positive definite",
        ),
        (
            &reduced,
            "[0.24, 0.0,",
            "[0.8, 0.0,",
            "[body.link]",
            "kg along x, and it has 0.4800; give mass-normalised",
        ),
        (
            &reduced,
            "    [0.0, 0.0, 0.0, 0.0, 0.0, 6.6e-5],\n",
            "",
            "participation = [",
            "participation has 4 rows, mass-matrix 5",
        ),
        (&reduced, "end-shift = [[1.0, 0.0, 0.0], ", "end-shift = [", "end-shift", "end-shift has 4 rows"),
        (
            &reduced,
            "end-shift = [[1.0, 0.0, 0.0], ",
            "end-shift = [[1.0, 0.0], ",
            "end-shift",
            "expected an array of length 3",
        ),
        (
            &reduced,
            "[0.0, 0.0, 0.0, 0.0, 4.4e-5]",
            "[0.0, 0.0, 0.0, 4.4e-5]",
            "mass-matrix = [",
            "rows of 5, 5, 5, 5, 4 numbers; give 5 rows of 5",
        ),
        (
            &reduced,
            "damping-ratio = 0.005",
            "damping-ratio = 5",
            "damping-ratio",
            "give a share of critical damping, 0 to 1",
        ),
        (&reduced, "damping-ratio = 0.005", "length = 0.6", "[body.link]", "leave one of both out"),
        (&reduced, set, &with("rayleigh = [0.1, 1e-4]"), set, "damping is given more than once"),
        (
            &undamped,
            set,
            &with("rayleigh = [0.1, -1e-4]"),
            "rayleigh",
            "rayleigh = [0.1, -0.0001]: give two numbers of 0 or above",
        ),
        (&undamped, set, &coupling, "damping-matrix", "damping-matrix couples modes 1 and 3"),
        (
            &modes,
            "frequency = 40.0",
            "frequency = -40.0",
            "frequency",
            "frequency = -40: give one above 0, Hz",
        ),
        (
            &modes,
            "frequency = 40.0",
            "frequency = 40.0\ndamping-ratio = -0.1",
            "damping-ratio = -",
            "damping-ratio = -0.1: give",
        ),
        (
            &modes,
            "[0.5, 0.0",
            "[0.9, 0.0",
            "[body.link]",
            "its modes move 0.8100 kg along x, and it has 0.4800",
        ),
        (&modes, "end-turn = [0.0, 3.0, 0.0]\n", "", "[[body.link.mode]]", "missing field `end-turn`"),
        (&modes, "end = [0.0, 0.0, 0.6]\n", "", "[body.link]", "`end` is missing; a table of modes has"),
        (&modes, MODE, "", "[body.link]", "`[[body.link.mode]]` is missing"),
        (
            &modes,
            "inertia = [[0.0144,",
            "inertia = [[-0.2,",
            "[body.link]",
            "its principal moments of inertia",
        ),
        (
            &modes,
            "[base]",
            "axial-stiffening = true\n[base]",
            "axial-stiffening",
            "the link of `upper arm` is a table of modes",
        ),
        (&beam, "length = 0.6\n", "", "[body.link]", "`length` is missing; a beam has"),
    ] {
        let changed = arm.replacen(from, to, 1);
        assert_ne!(changed, *arm, "{from}");
        std::fs::write(&file, &changed).unwrap();
        let out = trueup(&["arm", "map", file.to_str().unwrap(), "--pose", "0,0"]);
        let said = text(&out.stderr);
        let at = changed[..changed.find(line).unwrap()].matches('\n').count() + 1;
        assert_eq!(out.status.code(), Some(1), "{to}: {said}");
        assert!(said.contains(wanted) && said.contains(&format!("arm.toml:{at}: ")), "{at} {wanted}: {said}");
        assert_eq!(said.lines().filter(|l| l.starts_with("error:")).count(), 1, "{said}");
    }
}

/// Rayleigh's damping and the same as a matrix are one.
#[test]
fn rayleighs_damping_is_that_of_its_matrix() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    let [_, reduced] = documented();
    let undamped = reduced.replace("damping-ratio = 0.005\n", "");
    let begin = undamped.find("stiffness-matrix = ").unwrap();
    let matrix = &undamped[begin + "stiffness-matrix = ".len()..undamped.find("participation = ").unwrap()];
    let set = "[body.link.reduced]\n";
    // A thousandth of a second times the stiffness.
    let rows: Vec<Vec<f64>> = serde_json::from_str(&matrix.replace(",\n]", "\n]")).unwrap();
    let scaled: Vec<Vec<f64>> = rows.iter().map(|r| r.iter().map(|v| 1e-3 * v).collect()).collect();
    let ratios =
        ["rayleigh = [0.0, 1e-3]\n".to_owned(), format!("damping-matrix = {scaled:?}\n")].map(|line| {
            std::fs::write(&file, undamped.replacen(set, &format!("{set}{line}"), 1)).unwrap();
            let to = folder.path().to_str().unwrap();
            let out = trueup(&[
                "fmu",
                "pack",
                "FlexibleArm",
                "--fmi",
                "3",
                "--robot",
                file.to_str().unwrap(),
                "-o",
                to,
            ]);
            assert!(out.status.success(), "{}", text(&out.stderr));
            let said = text(&trueup(&["fmu", "info", &format!("{to}/FlexibleArm.fmi3.fmu")]).stdout);
            let list = |name: &str| -> Vec<f64> {
                let line = said.lines().find(|l| l.trim_start().starts_with(name)).unwrap();
                let values = line.split(" = ").nth(1).unwrap();
                values.split([',', ' ']).filter_map(|w| w.parse().ok()).take(5).collect()
            };
            (list("linkModeFrequency"), list("linkModeDampingRatio"))
        });
    let [(omega, one), (_, other)] = ratios;
    for ((omega, one), other) in omega.iter().zip(&one).zip(&other) {
        let wanted = 0.5e-3 * omega;
        assert!(
            (one / wanted - 1.0).abs() < 1e-12 && (other / wanted - 1.0).abs() < 1e-9,
            "{one} {other} {wanted}"
        );
    }
    assert_eq!((one.len(), other.len()), (5, 5));
}
