//! `trueup arm map`: the paper's tables, maps, files of robots with links that bend, mistakes.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;
use trueup_models::controller::adaptation::{KNOTS, parameter as a, scheduled};
use trueup_models::controller::{ManipulatorController, parameter};
use trueup_numerics::hybrid::Hybrid;

fn trueup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn done(arguments: &[&str]) -> String {
    let out = trueup(arguments);
    assert!(out.status.success(), "{}", text(&out.stderr));
    text(&out.stdout)
}

fn json(arguments: &[&str]) -> Value {
    serde_json::from_str(&done(arguments)).unwrap()
}

const RAISED: &str = "0,1.408749,-1.408749,0,0,0";

/// S3, Table 4, deg, and Table 5, %.
const PRINTED: [(&str, f64, f64); 5] = [
    ("joint 2", 0.17, 2.2),
    ("joint 3", 0.08, 1.7),
    ("joint 5", 0.02, 0.7),
    ("link 1", 0.49, 7.9),
    ("link 2", 1.09, 4.6),
];

#[test]
fn the_pose_of_table_4_has_its_deflections_and_the_papers_beside() {
    let said = done(&["arm", "map", "--pose", RAISED]);
    for (name, deflection, rise) in PRINTED {
        let line = said.lines().find(|l| l.starts_with(name)).unwrap_or_else(|| panic!("{name}: {said}"));
        // Behind the name, which may have spaces.
        let cells: Vec<&str> = line[26..].split_whitespace().filter(|c| *c != "%").collect();
        let found: f64 = cells[0].parse().unwrap();
        assert!((found - deflection).abs() < 0.005, "{line}");
        assert_eq!((cells[1], cells[4]), (&*format!("{deflection:.2}"), &*format!("{rise:.1}")), "{line}");
    }
    assert!(said.contains("joint 2, shoulder pitch") && said.contains("link 1, shoulder pitch"), "{said}");
    assert!(said.contains("Table 5 add up to 35.1 %: no linear conservative model"), "{said}");
    assert!(said.contains("allows 20 % (Rayleigh)"), "{said}");
    assert_eq!(said.lines().find(|l| l.starts_with("modes: ")).unwrap().split(',').count(), 3);
    // Elsewhere, with a load, in another field there is nothing to compare with.
    for other in [&["--pose", "0,1,-1,0,0,0"][..], &["--pose", RAISED, "--payload", "1"]] {
        let said = done(&[&["arm", "map"], other].concat());
        assert!(!said.contains("Table") && said.contains("joint 5, wrist pitch"), "{said}");
    }
}

#[test]
fn the_same_as_json() {
    let found = json(&["arm", "map", "delian", "--pose", RAISED, "--json"]);
    let elements = found["elements"].as_array().unwrap();
    let sum = |key: &str| elements.iter().map(|e| e[key].as_f64().unwrap()).sum::<f64>();
    assert!((sum("share") - 1.0).abs() < 1e-12 && (sum("energy") - 1.0).abs() < 1e-12);
    assert_eq!((elements.len(), found["modes"].as_array().unwrap().len()), (8, 3));
    let squares = |of: &Value| of["squares"].as_f64().unwrap();
    assert!((squares(&found["printed"]) - 0.351).abs() < 5e-4 && squares(&found) < 0.201);
    assert_eq!(found["schema"], "trueup.arm-map/1");
}

/// Columns by their names.
fn table(file: &Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
    (names, lines.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect())
}

#[test]
fn a_map_is_a_table_and_a_page() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("out");
    let order = ["arm", "map", "--from", "0,-1.408749", "--to", "1.408749,0", "--steps", "2,1", "-o"];
    let said = done(&[&order[..], &[to.to_str().unwrap()]].concat());
    assert!(said.contains("6 poses") && said.contains("first mode: from "), "{said}");
    let (names, rows) = table(&to.join("arm-map.csv"));
    assert_eq!(names[..4], ["joint2_rad", "joint3_rad", "firstMode_Hz", "tipDeflection_m"]);
    assert_eq!(names[4], "droop");
    assert_eq!(names[5..9], ["joint1Deflection_rad", "joint1Share", "joint1Rise", "joint1Energy"]);
    assert_eq!((names.len(), rows.len()), (5 + 4 * 8, 6));
    // The pose of Table 4 is one of them, and as it is when requested alone.
    let at = rows.iter().find(|r| r[0] == 1.408749 && r[1] == -1.408749).unwrap();
    let alone = json(&["arm", "map", "--pose", RAISED, "--json"]);
    assert_eq!(at[2], alone["modes"][0].as_f64().unwrap());
    let link_2 = names.iter().position(|n| n == "link2Deflection_rad").unwrap();
    assert!((at[link_2].to_degrees() - 1.09).abs() < 0.005, "{}", at[link_2]);
    assert_eq!(at[link_2 + 1], alone["elements"][7]["share"].as_f64().unwrap());
    // Stretched it bends most when it is level; raised, its weight presses along it and makes it softer.
    let stretched = |q| rows.iter().find(|r| r[0] == q && r[1] == 0.0).unwrap();
    let (level, raised) = (stretched(0.0), stretched(1.408749));
    assert!(rows.iter().all(|r| r[3] <= level[3]) && raised[2] < level[2]);
    let page = std::fs::read_to_string(to.join("arm-map.html")).unwrap();
    for heading in ["First mode", "Tip deflection", "Shares of the deflection", "Sensitivity"] {
        assert!(page.contains(&format!(">{heading}</h2>")), "{heading}");
    }
    // Both of the whole, five shares, the rises of all but joint 5; each with the ring of the paper's posture.
    assert_eq!(
        (page.matches("<figure>").count(), page.matches("r=\"6\" fill=\"none\"").count()),
        (2 + 5 + 4, 2 + 5 + 4)
    );
    assert!(!page.contains("NaN") && page.contains("Nowhere above"));
    // The others' angles, and as JSON.
    let found = json(&[&order[..], &[to.to_str().unwrap(), "--pose", "0.5,0,0,0,0.3,0", "--json"]].concat());
    assert_eq!((found["joints"][0].as_u64(), found["poses"].as_array().unwrap().len()), (Some(2), 6));
    assert_eq!(found["poses"][0]["pose"][4], 0.3);
}

/// The schedule is one that the controller takes, and nowhere on the map above its share of what lets the arm run away.
#[test]
fn a_schedule_stays_below_its_share() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().to_str().unwrap();
    let order = ["arm", "map", "--payload", "5", "--steps", "4,6", "--schedule", "2,0.3,500", "-o", to];
    assert!(done(&order).contains("arm-schedule.toml"));
    let text = std::fs::read_to_string(folder.path().join("arm-schedule.toml")).unwrap();
    let start: toml::Table = text.parse().unwrap();
    let n = 6;
    let numbers = |name: &str| -> Vec<f64> {
        let flat = |v: &toml::Value| match v {
            toml::Value::Array(row) => row.clone(),
            other => vec![other.clone()],
        };
        let all: Vec<toml::Value> = start[name].as_array().unwrap().iter().flat_map(flat).collect();
        all.iter().map(|v| v.as_float().unwrap_or_else(|| v.as_integer().unwrap() as f64)).collect()
    };
    let mut p = vec![0.0; ManipulatorController { joints: n }.sizes().parameters];
    let first = a::first(n);
    for (at, values) in [
        (parameter::WAVE_FREQUENCY * n, numbers("waveFrequency")),
        (parameter::COUNT * n, vec![1e-3, 6.0]),
        (first + a::ADAPTATION * n, vec![1.0; n]),
        (first + a::RATE * n, numbers("adaptationRate")),
        (first + a::MIN * n, numbers("waveFrequencyMin")),
        (first + a::MAX * n, numbers("waveFrequencyMax")),
        (a::schedule_angle(n), numbers("scheduleAngle")),
        (a::schedule_frequency(n), numbers("scheduleFrequency")),
        (a::schedule_joint(n), numbers("scheduleJoint")),
    ] {
        p[at..][..values.len()].copy_from_slice(&values);
    }
    assert_eq!(start["strategy"].as_str(), Some("VWBC_ADAPTIVE"));
    ManipulatorController { joints: n }.check(&p).unwrap();
    // Of the last joint: as of all.
    let knots = |at: usize| core::array::from_fn::<f64, KNOTS, _>(|k| p[at + 5 * KNOTS + k]);
    let (angles, frequencies) = (knots(a::schedule_angle(n)), knots(a::schedule_frequency(n)));
    let (names, rows) = table(&folder.path().join("arm-map.csv"));
    let over = format!("joint{}_rad", p[a::schedule_joint(n)]);
    let [angle, droop] = [&over, "droop"].map(|name| names.iter().position(|n| n == name).unwrap());
    let mut closest = 0.0_f64;
    for row in &rows {
        let bound = if row[droop] > 0.0 { 0.3 * 2.0 / row[droop] } else { f64::INFINITY };
        let omega = scheduled(&angles, &frequencies, row[angle]);
        assert!(omega <= bound.min(500.0) * (1.0 + 1e-12), "{row:?}: {omega} {bound}");
        closest = closest.max(omega / bound);
    }
    assert!(closest > 0.999, "not more careful than requested: {closest}");
    assert!(frequencies.iter().any(|w| *w > 1.2 * frequencies[4]), "{frequencies:?}");
}

/// A cantilever with a mass at its end: its wrist is as good as stiff.
const CANTILEVER: &str = r#"name = "cantilever"
[base]
mass = 10.0
inertia = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
[[body]]
name = "shoulder"
mass = 1e-3
center-of-mass = [0.0, 0.0, 0.0]
inertia = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]
position = [0.0, 0.0, 0.0]
axis = [0.0, -1.0, 0.0]
[body.link]
orientation = [0.0, 0.7071067811865476, 0.0, 0.7071067811865476]
length = 0.5
mass-per-length = 1e-6
youngs-modulus = 70e9
area-moment = [2e-8, 2e-8]
torsion-constant = 4e-8
polar-inertia-per-length = 1e-4
[[body]]
name = "wrist"
mass = 2.0
center-of-mass = [0.0, 0.0, 0.0]
inertia = [[1e-6, 0.0, 0.0], [0.0, 1e-6, 0.0], [0.0, 0.0, 1e-6]]
position = [0.5, 0.0, 0.0]
axis = [0.0, -1.0, 0.0]
[[tip]]
name = "hand"
"#;

#[test]
fn a_file_with_a_link_is_an_arm() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    std::fs::write(&file, CANTILEVER).unwrap();
    let order = ["arm", "map", file.to_str().unwrap(), "--pose", "0,0"];
    let found = json(&[&order[..], &["--json"]].concat());
    // d = F L^3 / (3 E J), omega^2 = g / d, the end turned by 3 d / (2 L).
    let d: f64 = 2.0 * 9.81 * 0.125 / (3.0 * 70e9 * 2e-8);
    let first = (9.81 / d).sqrt() / std::f64::consts::TAU;
    let of = |v: &Value| v.as_f64().unwrap();
    assert!((of(&found["tipDeflection"][2]) / -d - 1.0).abs() < 1e-3, "{found}");
    assert!((of(&found["modes"][0]) / first - 1.0).abs() < 1e-3, "{found}");
    let elements = found["elements"].as_array().unwrap();
    assert_eq!((elements.len(), &elements[0]["element"]), (1, &Value::from("link 1")));
    assert!((of(&elements[0]["deflection"]) / (1.5 * d / 0.5) - 1.0).abs() < 1e-3);
    assert_eq!((of(&elements[0]["share"]), of(&elements[0]["energy"])), (1.0, 1.0));
    // Its only spring 20 % stiffer: sqrt(1.2), but for what the weight does.
    assert!((of(&elements[0]["rise"]) - (1.2_f64.sqrt() - 1.0)).abs() < 1e-3);
    // Twice the mass at the tip, a third of the field.
    let found = json(&[&order[..], &["--json", "--payload", "2", "--gravity", "0,0,-3.27"]].concat());
    assert!((of(&found["tipDeflection"][2]) / (-d * 2.0 / 3.0) - 1.0).abs() < 1e-3, "{found}");
    // Its FMU has the link, and `robot` its mass.
    assert!(done(&["robot", file.to_str().unwrap()]).contains("cantilever: 2 joints"));
}

#[test]
fn mistakes_in_a_link_name_file_line_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    for (from, to, wanted) in [
        (
            "youngs-modulus",
            "young-modulus",
            &["arm.toml:16: unknown field `young-modulus`", "docs/robots.md"][..],
        ),
        ("70e9", "0", &["arm.toml: `shoulder`: ", "Young's modulus", "must be above 0"]),
        ("2e-8, 2e-8", "2e-8, -1.0", &["`shoulder`", "area moments", "must be above 0"]),
        ("length = 0.5", "length = 0.5\nshapes = [2, 1, 1]", &["same number of shapes"]),
        ("length = 0.5", "length = 0.5\nshapes = [7, 7, 1]", &["at most 5"]),
        ("[body.link]", "[body.links]", &["unknown field `links`"]),
    ] {
        let changed = CANTILEVER.replace(from, to);
        assert_ne!(changed, CANTILEVER);
        std::fs::write(&file, changed).unwrap();
        let out = trueup(&["arm", "map", file.to_str().unwrap(), "--pose", "0,0"]);
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(1), "{said}");
        assert!(wanted.iter().all(|w| said.contains(w)), "{wanted:?}: {said}");
    }
}

#[test]
fn a_wrong_word_is_told_with_its_option_and_the_mend() {
    let folder = tempfile::tempdir().unwrap();
    let rigid = folder.path().join("rigid.toml");
    let begin = CANTILEVER.find("[body.link]").unwrap();
    let end = CANTILEVER.rfind("[[body]]").unwrap();
    std::fs::write(&rigid, [&CANTILEVER[..begin], &CANTILEVER[end..]].concat()).unwrap();
    let rigid = rigid.to_str().unwrap();
    let there = folder.path().join("there");
    std::fs::write(&there, "a file").unwrap();
    for (order, code, wanted) in [
        (&["--pose", "0,1"][..], 2, &["--pose has 2 numbers, the arm 6 joints", "rad"][..]),
        (&["--pose", "0,1,nan,0,0,0"], 2, &["--pose", "finite"]),
        (&["--joints", "2,2"], 2, &["--joints 2,2", "two different joints of 1 to 6"]),
        (&["--joints", "2,7"], 2, &["--joints 2,7", "1 to 6"]),
        (&["--from", "0"], 2, &["--from has 1 numbers", "both joints"]),
        (&["--from", "0,2", "--to", "1,1"], 2, &["joint 3 would go from 2 to 1", "--from be below --to"]),
        (&["--steps", "0"], 2, &["--steps"]),
        (&["--steps", "1,2,3"], 2, &["--steps has 3 numbers"]),
        (&["--schedule", "2,0.15,200,1"], 2, &["--schedule has 4 numbers", "K_p"]),
        (&["--schedule", "2,1.5"], 2, &["--schedule", "a share above 0 and up to 1"]),
        (&["--payload", "-1"], 2, &["--payload", "0 or more"]),
        (&["--gravity", "9.81"], 2, &["--gravity", "three finite numbers"]),
        (&["--gravity", "0,0,0"], 2, &["change what the weight does", "--joints"]),
        (&["delain"], 1, &["delain", "did you mean `delian`?"]),
        (&["chaser"], 1, &["chaser", "no thrusters on its base"]),
        (&[rigid, "--pose", "0,0"], 1, &["rigid.toml", "no joint and no link of this arm bends"]),
        (&["-o", there.to_str().unwrap()], 1, &["there", "it is a file"]),
    ] {
        let out = trueup(&[&["arm", "map"], order].concat());
        let said = text(&out.stderr);
        assert_eq!(out.status.code(), Some(code), "{order:?}: {said}");
        assert!(wanted.iter().all(|w| said.contains(w)), "{order:?}: {said}");
        assert_eq!(said.lines().filter(|l| l.starts_with("error:")).count(), 1, "{said}");
    }
}

/// Upright, a spring that is too weak for the mass on it lets it fall; hanging, it stays.
#[test]
fn poses_without_rest_are_told_and_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("weak.toml");
    let weak = "axis = [0.0, -1.0, 0.0]\nmotor = { flexible = true, inertia = 1.0, gear-ratio = 100, stiffness = 9.0 }\n[body.link]";
    std::fs::write(&file, CANTILEVER.replace("axis = [0.0, -1.0, 0.0]\n[body.link]", weak)).unwrap();
    let order = ["arm", "map", file.to_str().unwrap(), "--joints", "1,2", "--steps", "1", "-o"];
    let range = ["--from", "-1.5707963267948966,0", "--to", "1.5707963267948966,0.1"];
    let out = trueup(&[&order[..], &[folder.path().to_str().unwrap()], &range].concat());
    let said = text(&out.stderr);
    assert!(out.status.success(), "{said}");
    assert!(
        said.contains("note: no rest at 2 of 4 poses, which are left out; the first: joint 1 at 1.571"),
        "{said}"
    );
    let (_, rows) = table(&folder.path().join("arm-map.csv"));
    assert!(rows.len() == 2 && rows.iter().all(|r| r[0] < 0.0));
    let page = std::fs::read_to_string(folder.path().join("arm-map.html")).unwrap();
    assert!(page.contains("At 2 of 4 poses there is no rest"));
    // None at all is a failure.
    let upright = ["arm", "map", file.to_str().unwrap(), "--pose", "1.5707963267948966,0"];
    let out = trueup(&upright);
    assert_eq!(out.status.code(), Some(1));
    assert!(text(&out.stderr).contains("no stable equilibrium at this pose"), "{}", text(&out.stderr));
}
