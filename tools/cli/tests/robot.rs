//! `trueup robot`: numbers of the papers' robots, files, mistakes.

use std::process::{Command, Output};

use serde_json::Value;

fn trueup(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_trueup")).args(arguments).output().unwrap()
}

fn json(arguments: &[&str]) -> Value {
    let out = trueup(arguments);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

fn numbers(v: &Value) -> Vec<f64> {
    match v {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        other => vec![other.as_f64().unwrap()],
    }
}

const CHASER: [&str; 4] = ["robot", "chaser", "--pose", "0.3,-0.9,1.4,0.2,-0.6,0.5"];

/// Golden facts C22, C27, C28: they do not depend on where the base is and how it is turned.
#[test]
fn singular_values_and_singularities_of_the_chaser() {
    let found = json(&[&CHASER[..], &["--json", "--sweep", "3=-2.9..3"]].concat());
    let smallest = |name: &str| numbers(&found["singularValues"][name]).last().copied().unwrap();
    assert!((smallest("J_M") - 0.3579366493322762).abs() < 1e-12);
    assert!((smallest("J_g") - 0.3413581881294047).abs() < 1e-12);
    for (name, wanted) in
        [("J_M", [-1.3864937216946767, 0.0]), ("J_g", [-1.198522721615448, -0.012516792310981574])]
    {
        let at = numbers(&found["singular"][name]);
        assert_eq!(at.len(), 2, "{name}: {at:?}");
        for (at, wanted) in at.iter().zip(wanted) {
            assert!((at - wanted).abs() < 1e-6, "{name}: {at}, not {wanted}");
        }
    }
}

/// Golden facts B01 and B31.
#[test]
fn matrices_and_measures_of_table_1() {
    let q = [20.0_f64, 40.0, -60.0].map(|d| d.to_radians().to_string()).join(",");
    let found = json(&["robot", "table-1", "--pose", &q, "--torque-joints", "1,2", "--json"]);
    let b_f = numbers(&found["matrices"]["B_f"]);
    assert!(
        (b_f[0] + 2.547194265204349).abs() < 1e-12 && (b_f[8] - 1.1276311449430902).abs() < 1e-12,
        "{b_f:?}"
    );
    for (name, wanted) in
        [("force", 4077.109915768643), ("torque", 23034.389689462627), ("combined", 44597.18918885539)]
    {
        let measure = found["measures"][name].as_f64().unwrap();
        assert!((measure / wanted - 1.0).abs() < 1e-12, "{name}: {measure}");
    }
}

/// Golden facts B04, B07, B08 and B34 on a grid of 3 degrees: the maxima are close by, and none is above them.
#[test]
fn surfaces_of_table_1_have_their_maxima() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.csv");
    let order = ["robot", "table-1", "--surface", "2,3", "--torque-joints", "1,2", "-o"];
    let plot = folder.path().join("s.html");
    let out = trueup(&[&order[..], &[file.to_str().unwrap(), "--plot", plot.to_str().unwrap()]].concat());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let text = std::fs::read_to_string(&file).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows: Vec<Vec<f64>> = lines.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    assert_eq!(rows.len(), 121 * 121);
    for (name, most) in [
        ("forceMeasure", 6944.999284832725),
        ("torqueMeasure", 41854.46595193896),
        ("combinedMeasure", 59776.56701573762),
        ("coriolisForce", 19.202343606966313),
        ("centrifugalForce", 13.418084811179275),
        ("coriolisTorque", 33.41223017100176),
        ("centrifugalTorque", 9.163003958085527),
    ] {
        let at = names.iter().position(|n| *n == name).unwrap();
        let largest = rows.iter().map(|r| r[at]).fold(0.0, f64::max);
        assert!(largest <= most * (1.0 + 1e-9) && largest > 0.995 * most, "{name}: {largest}, not {most}");
    }
    // Each as a surface and as a map, with the claims of S1: two of six do not hold as printed.
    let page = std::fs::read_to_string(&plot).unwrap();
    assert_eq!(page.matches("<figure>").count(), 14);
    assert!(page.contains("41825") && !page.contains("NaN"));
    assert_eq!((page.matches(">holds<").count(), page.matches(">does not hold here<").count()), (3, 3));
    let parquet = folder.path().join("s.parquet");
    let order = [&order[..6], &["--points", "20", "-o", parquet.to_str().unwrap()]].concat();
    assert!(trueup(&order).status.success());
    let bytes = std::fs::read(&parquet).unwrap();
    assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"));
    let out = trueup(&["robot", "table-1", "--surface", "2,3", "-o", "s.txt"]);
    assert!(String::from_utf8_lossy(&out.stderr).contains("end its name in .csv or .parquet"));
}

const ARM: &str = r#"name = "bench"
[base]
mass = 100.0
inertia = [[5.0, 0.0, 0.0], [0.0, 6.0, 0.0], [0.0, 0.0, 7.0]]
[[body]]
name = "shoulder"
mass = 2.0
center-of-mass = [0.1, 0.0, 0.0]
inertia = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]]
position = [0.3, 0.0, 0.0]
[[body]]
name = "slide"
joint = "prismatic"
axis = [1.0, 0.0, 0.0]
mass = 1.0
center-of-mass = [0.0, 0.0, 0.0]
inertia = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.02]]
position = [0.2, 0.0, 0.0]
[[tip]]
name = "hand"
offset = [0.4, 0.0, 0.0]
"#;

#[test]
fn a_file_is_a_robot() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    std::fs::write(&file, ARM).unwrap();
    let found = json(&["robot", file.to_str().unwrap(), "--pose", "0,0.5", "--json"]);
    assert_eq!(numbers(&found["tipPosition"]), [0.3 + 0.2 + 0.5 + 0.4, 0.0, 0.0]);
    // J_M: the shoulder swings the hand by 1.1 m, the slide moves it along x.
    let j = numbers(&found["matrices"]["J_M"]);
    assert!((j[2] - 1.1).abs() < 1e-15 && (j[1] - 1.0).abs() < 1e-15 && j[0] == 0.0, "{j:?}");
    assert_eq!(found["robot"], "bench");
}

#[test]
fn mistakes_name_line_body_and_mend() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.toml");
    for (change, code, said) in [
        (("mass = 2.0", "mass = \"2\""), 1, "arm.toml:7: invalid type: string"),
        (("position = [0.3", "positions = [0.3"), 1, "unknown field `positions`"),
        (("joint = \"prismatic\"", "joint = \"ball\""), 1, "unknown variant `ball`"),
        (("0.02]]\nposition = [0.3", "-0.9]]\nposition = [0.3"), 1, "`shoulder`: its principal moments"),
        (("name = \"slide\"", "name = \"slide\"\nparent = \"shoulde\""), 1, "did you mean `shoulder`?"),
        (("axis = [1.0,", "axis = [0.0,"), 1, "`slide`: axis = [0, 0, 0]"),
    ] {
        assert!(ARM.contains(change.0), "{}", change.0);
        std::fs::write(&file, ARM.replacen(change.0, change.1, 1)).unwrap();
        let out = trueup(&["robot", file.to_str().unwrap()]);
        let text = String::from_utf8_lossy(&out.stderr);
        assert!(
            out.status.code() == Some(code) && text.contains(said) && text.contains("arm.toml"),
            "{text}"
        );
    }
    for (arguments, code, said) in [
        (&["robot", "chasr"][..], 1, "did you mean `chaser`?"),
        (&["robot", "chaser", "--pose", "1,2"], 2, "--pose has 2 numbers, the robot 6 joints"),
        (&["robot", "chaser", "--tip", "toll"], 2, "did you mean `tool`?"),
        (&["robot", "chaser", "--sweep", "9=0..1"], 2, "there is no such joint; it is one of 1 to 6"),
        (&["robot", "chaser", "--sweep", "3=1..0"], 2, "as in 3=-3..3"),
        (&["robot", "chaser", "--surface", "2,2"], 2, "give two different joints of 1 to 6"),
    ] {
        let out = trueup(arguments);
        let text = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(code) && text.contains(said), "{arguments:?}: {text}");
    }
}

/// Structure and values of a file are those of its FMU.
#[test]
fn robots_are_packed() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("arm.toml"), folder.path().join("out"));
    let more = "motor = { flexible = true, inertia = 0.3, stiffness = 50.0 }\n";
    let text = ARM.replacen("axis = [1.0,", &format!("{more}axis = [1.0,"), 1)
        + "\n[[thruster]]\nposition = [1, 0, 0]\ndirection = [0, 1, 0]\n[[appendage]]\nshapes = [2, 1, 1]\n\
           position = [0, 0.5, 0]\nlength = 3.0\nmass-per-length = 1.0\nbending-stiffness = [200.0, 800.0]\n\
           torsion-stiffness = 60.0\npolar-inertia-per-length = 0.02\n";
    std::fs::write(&file, &text).unwrap();
    let (name, to) = (file.to_str().unwrap(), out.to_str().unwrap());
    let run = |arguments: &[&str]| {
        let done = trueup(arguments);
        (done.status.code(), String::from_utf8_lossy(&[done.stdout, done.stderr].concat()).into_owned())
    };
    let (code, said) = run(&["fmu", "pack", "--robot", name, "--fmi", "3", "-o", to]);
    assert_eq!(code, Some(0), "{said}");
    let fmu = out.join("SpatialFreeFlyer.fmi3.fmu");
    let (code, said) = run(&["fmu", "info", fmu.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{said}");
    for variable in
        ["thrusterForce", "modalCoordinate", "state.motorAngle", "appendageTipPosition", "jointTorque"]
    {
        assert!(said.contains(variable), "{variable}: {said}");
    }
    let csv = folder.path().join("run.csv");
    let csv = csv.to_str().unwrap();
    let (code, said) =
        run(&["simulate", fmu.to_str().unwrap(), "--set", "thrusterForce=1", "--stop", "1", "-o", csv]);
    assert_eq!(code, Some(0), "{said}");
    // An error comes with the FMU's own message.
    let set = "initialBaseQuaternion=0,0,0,0";
    let (code, said) = run(&["simulate", fmu.to_str().unwrap(), "--set", set, "-o", csv]);
    assert!(code == Some(1) && said.contains("which is no attitude; give w, x, y, z"), "{said}");
    let gone = folder.path().join("gone/run.csv");
    let (code, said) = run(&["simulate", fmu.to_str().unwrap(), "-o", gone.to_str().unwrap()]);
    assert!(code == Some(1) && said.contains("there is no folder") && said.contains("make it"), "{said}");
    for (arguments, wanted, words) in [
        (&["fmu", "pack", "PlanarManipulator", "--robot", name, "-o", to][..], 2, "is for SpatialFreeFlyer"),
        (&["fmu", "pack", "--robot", "chaser", "--preset", "chaser", "-o", to], 2, "cannot be used with"),
        (&["fmu", "pack", "SpatialFreeFlyer", "--effect", "backlash", "-o", to], 2, "make one flexible"),
        (
            &["fmu", "pack", "SpatialFreeFlyer", "--preset", "chaser", "--flexible", "true", "-o", to],
            2,
            "chaser has 6 joints",
        ),
        (
            &["fmu", "pack", "SpatialFreeFlyer", "--set", "baseInertia[1,1]=-9e9", "-o", to],
            2,
            "baseInertia: its principal",
        ),
        (&["fmu", "pack", "SpatialFreeFlyer", "--preset", "chasr", "-o", to], 2, "did you mean `chaser`"),
    ] {
        let (code, said) = run(arguments);
        assert!(code == Some(wanted) && said.contains(words), "{arguments:?}: {code:?} {said}");
    }
    std::fs::write(&file, text.replacen("length = 3.0", "length = 0.0", 1)).unwrap();
    let (code, said) = run(&["fmu", "pack", "--robot", name, "-o", to]);
    assert!(code == Some(1) && said.contains("`appendage 1`: length, mass per length"), "{said}");
}

/// Outputs of `analysis = true` are what `trueup robot` shows at the pose, over both ways of running an FMU.
#[test]
fn what_a_pose_is_worth_in_the_fmu() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("arm.toml"), folder.path().join("out"));
    let panel = "\n[[appendage]]\nshapes = [1, 0, 0]\nposition = [0, 0.5, 0]\norientation = [0.6, 0.8, 0, 0]\nlength = 3.0\n\
                 mass-per-length = 2.0\nbending-stiffness = [200.0, 800.0]\ntorsion-stiffness = 60.0\npolar-inertia-per-length = 0.02\n";
    // Out of the plane: in a plane all torques are parallel.
    let arm = ARM.replacen("axis = [1.0, 0.0, 0.0]", "axis = [1.0, 0.0, 1.0]", 1);
    let text = format!("analysis = true\n{arm}mount = [0.1, 0.2, 0.0]\n{panel}");
    std::fs::write(&file, text).unwrap();
    let (name, to) = (file.to_str().unwrap(), out.to_str().unwrap());
    let done = trueup(&["fmu", "pack", "--robot", name, "-o", to]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let found = json(&["robot", name, "--pose", "0.4,0.5", "--json"]);
    let csv = folder.path().join("run.csv");
    for version in ["2", "3"] {
        let fmu = out.join(format!("SpatialFreeFlyer.fmi{version}.fmu"));
        let pose = ["--set", "initialJointAngle[1]=0.4", "--set", "initialJointAngle[2]=0.5"];
        let run = ["simulate", fmu.to_str().unwrap(), "--stop", "0.01", "-o", csv.to_str().unwrap()];
        let done = trueup(&[&run[..], &pose].concat());
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
        let rows = std::fs::read_to_string(&csv).unwrap();
        let mut lines = rows.lines();
        let (names, first) = (lines.next().unwrap(), lines.next().unwrap());
        // Names with a comma are quoted: the ones looked for are after all of them.
        let from_end = |name: &str| names.rsplit(',').position(|n| n.trim_matches('"') == name).unwrap();
        let at = |name: &str| -> f64 { first.rsplit(',').nth(from_end(name)).unwrap().parse().unwrap() };
        let measure = |name: &str| found["measures"][name].as_f64().unwrap();
        let smallest = numbers(&found["singularValues"]["J_g"]).last().copied().unwrap();
        for (name, wanted) in [
            ("forceMeasure[1]", measure("force")),
            ("torqueMeasure[1]", measure("torque")),
            ("combinedMeasure[1]", measure("combined")),
            ("generalizedJacobianSmallest[1]", smallest),
            ("manipulability[1]", found["manipulability"]["J_g"].as_f64().unwrap()),
        ] {
            let value = at(name);
            assert!(value > 0.0 && (value / wanted - 1.0).abs() < 1e-12, "{name}: {value}, not {wanted}");
        }
    }
}

const TABLE: &str = r#"
[[appendage]]
name = "array"
position = [0.0, 0.5, 0.0]
mass = 8.0
center-of-mass = [0.0, 0.0, 2.0]
inertia = [[11.0, 0.0, 0.0], [0.0, 11.0, 0.0], [0.0, 0.0, 0.2]]
damping-ratio = 0.01
[[appendage.mode]]
frequency = 0.5
participation = [2.2, 0.0, 0.0, 0.0, 6.4, 0.0]
[[appendage.mode]]
frequency = 1.0
damping-ratio = 0.0
participation = [0.0, 2.2, 0.0, -6.4, 0.0, 0.0]
"#;

/// A table of modes in a file and in its FMU; what cannot be is refused with name, value and remedy.
#[test]
fn tables_of_modes_are_packed_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = (folder.path().join("arm.toml"), folder.path().join("out"));
    let text = format!("{ARM}{TABLE}");
    std::fs::write(&file, &text).unwrap();
    let (name, to) = (file.to_str().unwrap(), out.to_str().unwrap());
    let run = |arguments: &[&str]| {
        let done = trueup(arguments);
        (done.status.code(), String::from_utf8_lossy(&[done.stdout, done.stderr].concat()).into_owned())
    };
    let (code, said) = run(&["fmu", "pack", "--robot", name, "-o", to]);
    assert_eq!(code, Some(0), "{said}");
    let csv = folder.path().join("run.csv");
    let csv = csv.to_str().unwrap();
    for version in ["2", "3"] {
        let fmu = out.join(format!("SpatialFreeFlyer.fmi{version}.fmu"));
        let (code, said) = run(&["fmu", "info", fmu.to_str().unwrap()]);
        assert!(code == Some(0) && said.contains("modeParticipation"), "{said}");
        // An eighth of a period of the second mode, by 0.1 at first, free of damping: it comes back faster on a free base.
        let swing = [
            "simulate",
            fmu.to_str().unwrap(),
            "--set",
            "initialModalCoordinate[2]=0.1",
            "--stop",
            "0.01",
            "-o",
            csv,
        ];
        let (code, said) = run(&swing);
        assert_eq!(code, Some(0), "{said}");
        let too_much = ["simulate", fmu.to_str().unwrap(), "--set", "modeParticipation[1,1]=2.9", "-o", csv];
        let (code, said) = run(&too_much);
        assert!(code == Some(1) && said.contains("modeParticipation of table 1, from mode 1: its modes move 8.4100 kg along x, and it has 8.0000"), "{said}");
    }
    for ((old, new), words) in [
        (
            ("participation = [0.0, 2.2", "participation = [0.0, 3.0"),
            "`array`: its modes move 9.0000 kg along y, and it has 8.0000; give mass-normalised",
        ),
        (
            ("6.4, 0.0]", "8.0, 0.0]"),
            "`array`: its modes move 64.0000 kg.m2 through its root about y, and it has 43.0000",
        ),
        (("frequency = 1.0", "frequency = 0.0"), "`array`: mode 2: give a frequency above 0"),
        (("mass = 8.0", ""), "`array`: `mass` is missing; a table of modes has mass"),
        (
            ("mass = 8.0", "mass = 8.0\nshapes = [1, 1, 1]"),
            "`array`: a table of modes has mass, center-of-mass, inertia",
        ),
        (("[[11.0,", "[[-99.0,"), "`array`: its principal moments"),
        (("participation = [2.2, 0.0, 0.0, 0.0, 6.4, 0.0]", "participation = [2.2]"), "invalid length 1"),
    ] {
        assert!(text.contains(old), "{old}");
        std::fs::write(&file, text.replacen(old, new, 1)).unwrap();
        let (code, said) = run(&["robot", name]);
        assert!(code == Some(1) && said.contains(words) && said.contains("arm.toml"), "{said}");
    }
}

/// Tables of papers and identified robots break the triangle inequality: that is named, all bodies at once, and the motion is computed. What no
/// motion can be computed with is refused, all bodies at once. Inertias are drawn.
#[test]
fn inertias_that_no_body_has_are_named_all_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("drawn.urdf");
    for seed in 1..6_u64 {
        let mut state = seed;
        let mut draw = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 40) as f64 / f64::from(1 << 24)
        };
        let (mut links, mut joints, mut doubted, mut refused) =
            (String::new(), String::new(), Vec::new(), Vec::new());
        let bad = draw() < 0.5;
        for k in 0..5 {
            let (a, b) = (0.1 + draw(), 0.1 + draw());
            let c = match k % 3 {
                0 => (a + b) * (0.5 * draw() + (a - b).abs() / (a + b) * 0.5 + 0.4),
                1 => (a + b) * (1.1 + draw()),
                _ if bad => -draw(),
                _ => 0.9 * (a + b),
            };
            let mut sorted = [a, b, c];
            sorted.sort_by(f64::total_cmp);
            if sorted[0] <= 0.0 {
                refused.push(k);
            } else if sorted[2] > sorted[0] + sorted[1] {
                doubted.push(k);
            }
            links += &format!(
                "<link name=\"body{k}\"><inertial><mass value=\"2\"/><inertia ixx=\"{a}\" ixy=\"0\" ixz=\"0\" iyy=\"{b}\" iyz=\"0\" izz=\"{c}\"/></inertial></link>\n"
            );
            if k > 0 {
                joints += &format!(
                    "<joint name=\"j{k}\" type=\"revolute\"><parent link=\"body{}\"/><child link=\"body{k}\"/><origin xyz=\"1 0 0\"/><axis xyz=\"0 0 1\"/></joint>\n",
                    k - 1
                );
            }
        }
        std::fs::write(&file, format!("<robot name=\"drawn\">\n{links}{joints}</robot>")).unwrap();
        let out = trueup(&["robot", file.to_str().unwrap()]);
        let said = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(i32::from(!refused.is_empty())), "seed {seed}: {said}");
        let named = if refused.is_empty() { &doubted } else { &refused };
        for k in 0..5 {
            let name = if k == 0 { "`base`".to_owned() } else { format!("`body{k}`") };
            assert_eq!(
                said.contains(&format!("{name}: its principal")),
                named.contains(&k),
                "seed {seed}, {name}: {said}"
            );
        }
    }
}

/// What a maker gives of an arm's joints is in the FMU or named, and so is a base that floats.
#[test]
fn what_urdf_says_of_joints_is_in_the_fmu_or_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("arm.urdf");
    let joint = |name: &str, parent: &str, child: &str, damping: f64, friction: f64| {
        format!(
            "<joint name=\"{name}\" type=\"revolute\"><parent link=\"{parent}\"/><child link=\"{child}\"/><origin xyz=\"0 0 0.4\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1.5\" upper=\"1.5\" effort=\"60\" velocity=\"2\"/><dynamics damping=\"{damping}\" friction=\"{friction}\"/></joint>"
        )
    };
    let link = |name: &str| {
        format!(
            "<link name=\"{name}\"><inertial><mass value=\"2\"/><inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.02\"/></inertial></link>"
        )
    };
    let text = format!(
        "<robot name=\"arm\">{}{}{}{}{}</robot>",
        link("foot"),
        link("upper"),
        link("fore"),
        joint("shoulder", "foot", "upper", 1.25, 0.75),
        joint("elbow", "upper", "fore", 0.5, 0.25)
    );
    std::fs::write(&file, text).unwrap();
    let pack = |model: &str, more: &[&str]| {
        let (name, out) = (file.to_str().unwrap(), folder.path().to_str().unwrap());
        let all = [&["fmu", "pack", model, "--fmi", "3", "--robot", name, "-o", out], more].concat();
        let done = trueup(&all);
        let said = String::from_utf8_lossy(&done.stderr).into_owned();
        assert_eq!(done.status.code(), Some(0), "{said}");
        said
    };
    let info = |model: &str| {
        let fmu = folder.path().join(format!("{model}.fmi3.fmu"));
        let out = trueup(&["fmu", "info", fmu.to_str().unwrap(), "--json"]);
        String::from_utf8_lossy(&out.stdout).into_owned()
    };
    let said = pack("SpatialFreeFlyer", &[]);
    for words in [
        "the base (`foot`, 2 kg) floats; --held",
        "<limit> of 2 joints (shoulder, elbow) is not read",
        "<dynamics> (damping, friction) of the joints of 2 links (upper, fore)",
    ] {
        assert!(said.contains(words), "{words}: {said}");
    }
    assert!(!info("SpatialFreeFlyer").contains("\"gravity\""));
    let said = pack("SpatialFreeFlyer", &["--held"]);
    assert!(!said.contains("floats"), "{said}");
    assert!(info("SpatialFreeFlyer").contains("\"gravity\""), "a held base has weight");
    let said = pack("FlexibleArm", &[]);
    assert!(!said.contains("floats") && !said.contains("<dynamics>"), "{said}");
    assert!(said.contains("dry friction of the joints of upper, fore is not in this model"), "{said}");
    let found: Value = serde_json::from_str(&info("FlexibleArm")).unwrap();
    let start = |name: &str| {
        let variables = found["variables"].as_array().unwrap();
        variables.iter().find(|v| v["name"] == name).map(|v| v["start"].to_string()).unwrap_or_default()
    };
    for (name, values) in [("viscousFriction", ["1.25", "0.5"])] {
        let text = start(name);
        assert!(values.iter().all(|v| text.contains(v)), "{name}: {text}");
    }
}
