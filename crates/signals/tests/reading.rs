//! Recordings and cases from files: what the format allows reads as it is meant.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::common::{data, joint};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_signals::check::{self, Relation};
use trueup_signals::{
    Case, Channel, DeclaredFigures, Finding, FindingKind, Interpolation, ParameterValue, PriorGuess,
    Recording, Severity, SignalVariable, VariableRole,
};

fn csv(text: &str, known: &[SignalVariable]) -> (Recording, Vec<Finding>) {
    Recording::parse_csv("run.csv", text.as_bytes(), known).unwrap()
}

fn folder(files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn values<'a>(run: &'a Recording, name: &str) -> &'a [f64] {
    &run.channel(name).unwrap_or_else(|| panic!("{name}")).values
}

#[test]
fn each_channel_has_samples_of_its_own() {
    let (run, findings) = csv("time,motorCurrent,motorAngle\n0,1,\n0.1,,2\n0.3,NA,3\n0.4,4,null\n", &joint());
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!((run.start, run.end), (0.0, 0.4));
    let current = run.channel("motorCurrent").unwrap();
    assert_eq!((&current.time[..], &current.values[..]), (&[0.0, 0.4][..], &[1.0, 4.0][..]));
    assert_eq!(run.channel("motorAngle").unwrap().time, [0.1, 0.3]);
    assert_eq!(current.unit, "A");
}

#[test]
fn nan_is_an_empty_cell_and_noted() {
    let (run, found) = csv("time,motorCurrent,motorAngle\n0,1,1\n1,nan,-NaN\n2,3,NAN\n3,4,2\n", &joint());
    assert_eq!(run.channel("motorCurrent").unwrap().time, [0.0, 2.0, 3.0]);
    assert_eq!(run.channel("motorAngle").unwrap().time, [0.0, 3.0]);
    assert!(
        found.iter().all(|f| (f.severity, f.kind) == (Severity::Note, FindingKind::NotANumber)),
        "{found:?}"
    );
    let said: Vec<String> = found.iter().map(ToString::to_string).collect();
    let mend = "record it again if something was measured there";
    assert_eq!(
        said,
        [
            format!("run.csv:3: motorCurrent: \"nan\" is taken as an empty cell; {mend}"),
            format!(
                "run.csv:3: motorAngle: \"nan\" is taken as an empty cell, here and in one more row; {mend}"
            ),
        ]
    );
}

#[test]
fn what_fmpy_writes_is_read() {
    // FMPy: quoted names, an array as one column of blank-separated values, True and False.
    let text = "\"time\",\"torque\",\"sticking\",\"center\"\n0.0,1.5 2.5 3.5,True,1 2 3 4\n\
                0.5,-1 -2 -3,False,5 6 7 8\n";
    let (run, _) = csv(text, &[]);
    assert_eq!(values(&run, "torque[2]"), [2.5, -2.0]);
    assert_eq!(values(&run, "sticking"), [1.0, 0.0]);
    // With the model known, a matrix gets its two indices back, row by row.
    let known: Vec<_> = ["[1,1]", "[1,2]", "[2,1]", "[2,2]"]
        .iter()
        .map(|i| SignalVariable::new(&format!("center{i}"), "m", VariableRole::Output))
        .collect();
    let (run, _) = csv(text, &known);
    assert_eq!(values(&run, "center[2,1]"), [3.0, 7.0]);
}

#[test]
fn byte_order_mark_carriage_returns_blank_lines_and_blanks_do_no_harm() {
    let (run, _) = csv("\u{feff}time, motorAngle\r\n\r\n0 , 1\r\n1,\t2\r\n", &joint());
    assert_eq!(values(&run, "motorAngle"), [1.0, 2.0]);
}

#[test]
fn a_sidecar_maps_names_scales_and_units() {
    let folder = folder(&[
        ("run.csv", "t,vir,q,n,kp,externalTorque\n0,1,90,60,7,1\n500,2,180,120,7,1\n"),
        (
            "run.toml",
            r#"
            [columns]
            t = { variable = "time", unit = "ms" }
            vir = { variable = "motorCurrent", scale = 35.15065, offset = 1.0, unit = "V" }
            q = { variable = "motorAngle", unit = "deg" }
            n = { variable = "motorVelocity", unit = "rpm" }
            kp = false
            [channels.motorAngle]
            resolution = 1e-3
            noise = 2e-3
            delay = 0.01
            offset = "estimate"
            [channels.motorCurrent]
            interpolation = "hold"
            [parameters]
            initialMotorAngle = 1.5
            "#,
        ),
    ]);
    let file = folder.path().join("run.csv");
    let (run, findings) = Recording::read(&file, &joint(), &DeclaredFigures::default()).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(run.end, 0.5);
    assert_eq!(values(&run, "motorCurrent"), [36.15065, 71.3013]);
    let near = |a: &[f64], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14 * b.abs());
    assert!(near(values(&run, "motorAngle"), [std::f64::consts::FRAC_PI_2, std::f64::consts::PI]));
    assert!(near(values(&run, "motorVelocity"), [std::f64::consts::TAU, 2.0 * std::f64::consts::TAU]));
    assert!(run.channel("kp").is_none());
    let sensor = &run.channel("motorAngle").unwrap().sensor;
    assert_eq!((sensor.resolution, sensor.noise, sensor.delay), (Some(1e-3), Some(2e-3), 0.01));
    assert_eq!((sensor.offset, sensor.gain), (Some(PriorGuess { value: 0.0, doubt: None }), None));
    let deviation = (4e-6_f64 + 1e-6 / 12.0).sqrt();
    assert!((sensor.deviation().unwrap() / deviation - 1.0).abs() < 1e-14);
    assert_eq!(run.channel("motorCurrent").unwrap().interpolation, Interpolation::Hold);
    assert_eq!(run.parameters["initialMotorAngle"], ParameterValue::Number(1.5));
}

#[test]
fn a_case_is_read_whole_and_its_key_never() {
    let case = r#"
        model = "TwoMassJoint"
        train = ["a.csv", "b.csv"]
        holdout = ["c.csv"]
        repeats = [["a.csv", "b.csv"]]
        rest = ["r.csv"]
        [parameters]
        stiffness = 3.07e-5
        gearRatio = 160
        [uncertain]
        stiffness = 0.1
        [fit]
        parameters = ["stiffness", "damping"]
        [channels.motorAngle]
        resolution = 0.01
        noise = 0.02
        "#;
    let run = "time,motorCurrent,motorAngle\n0,0,0\n1,1,1\n";
    let folder = folder(&[
        ("case.toml", case),
        ("key.toml", "this is no TOML"),
        ("a.csv", run),
        ("b.csv", run),
        ("c.csv", run),
        ("r.csv", run),
        ("b.toml", "[channels.motorAngle]\nnoise = 0.5\n"),
    ]);
    let (loaded, _) = Case::load(folder.path(), |_| Ok(joint())).unwrap();
    let case = &loaded.case;
    assert_eq!((case.model.as_str(), case.number("gearRatio")), ("TwoMassJoint", Some(160.0)));
    assert_eq!((case.doubt("stiffness"), case.doubt("gearRatio")), (Some(0.1), None));
    assert_eq!([case.fits("damping"), case.fits("gearRatio")], [Some(true), Some(false)]);
    assert_eq!(case.recordings(), ["a.csv", "b.csv", "c.csv", "r.csv"]);
    assert_eq!(loaded.train().iter().map(|r| r.name.as_str()).collect::<Vec<_>>(), ["a.csv", "b.csv"]);
    // A sidecar goes before the case, key by key.
    let noise = |name| {
        let sensor = &loaded.recordings[name].channel("motorAngle").unwrap().sensor;
        (sensor.resolution, sensor.noise)
    };
    assert_eq!(noise("a.csv"), (Some(0.01), Some(0.02)));
    assert_eq!(noise("b.csv"), (Some(0.01), Some(0.5)));
}

#[test]
fn arrays_are_kept_by_element() {
    let text = r#"
        model = "PlanarManipulator"
        train = ["a.csv"]
        [parameters]
        linkMass = [1, 2.5, 3]
        "linkLength[2]" = 0.4
        linkCenterOfMass = [[0.1, 0.0], [0.2, 0.0]]
        jointFlexible = [true, false, false]
        motorCoupling = "geared"
        [uncertain]
        linkMass = 0.2
        "linkCenterOfMass[2,1]" = 0.3
        "#;
    let (case, _) = Case::parse(Path::new("case.toml"), text, &[]).unwrap();
    assert_eq!([case.number("linkMass[2]"), case.number("linkLength[2]")], [Some(2.5), Some(0.4)]);
    assert_eq!(case.number("linkCenterOfMass[2,1]"), Some(0.2));
    let flexible: Vec<_> = case.elements("jointFlexible").iter().filter_map(|v| v.boolean()).collect();
    assert_eq!(flexible, [true, false, false]);
    assert_eq!(case.parameters["motorCoupling"], ParameterValue::Text("geared".into()));
    assert_eq!([case.doubt("linkMass[3]"), case.doubt("linkCenterOfMass[2,1]")], [Some(0.2), Some(0.3)]);
}

#[test]
fn example_cases_are_read() {
    let Some(data) = data() else { return };
    for name in ["backlash", "gravity-torque", "none", "stribeck-friction"] {
        let (loaded, findings) = Case::load(&data.join("example-cases").join(name), |_| Ok(joint())).unwrap();
        assert!(findings.is_empty(), "{findings:?}");
        assert_eq!([loaded.train().len(), loaded.holdout().len()], [3, 1]);
        let run = loaded.train()[0];
        assert_eq!((run.start, run.end, run.channels.len()), (0.0, 9.998, 3));
        let angle = run.channel("motorAngle").unwrap();
        assert_eq!((angle.len(), angle.sensor.resolution), (5000, Some(0.00153398)));
        assert_eq!(run.channel("motorCurrent").unwrap().interpolation, Interpolation::Hold);
        assert!(run.channels.iter().all(|c: &Channel| !c.unit.is_empty()));
        // Healthy recordings: nothing but that an input was not recorded.
        let geared = Relation::Proportional {
            left: "motorAngle".into(),
            right: "loadAngle".into(),
            factor: 160.0,
            parameter: "gearRatio".into(),
        };
        let found = check::case(&loaded, &joint(), &[geared]);
        assert!(found.iter().all(|f| f.severity == Severity::Note), "{name}: {found:#?}");
    }
}

/// What h5py writes: datasets of groups by their paths, arrays by element; what has another length is another clock.
#[test]
fn datasets_of_hdf5_are_columns_by_their_paths() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files");
    let read = |file: &std::path::Path| Recording::read(file, &[], &DeclaredFigures::default());
    let (run, findings) = read(&folder.join("paths.h5")).unwrap();
    let squares: Vec<f64> = (0..60).map(|k| f64::from(k) * 0.01).map(|t| t * t).collect();
    assert_eq!(run.channel("robot/joint/motor").unwrap().values, squares);
    let names: Vec<&str> = run.channels.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names.len(), 4, "{names:?}");
    assert!(names.contains(&"robot/joint/both[2]") && names.contains(&"robot/count"), "{names:?}");
    assert!(findings.iter().any(|f| f.what.contains("robot/note")), "{findings:?}");
    // The column is named in `[columns]` as any other.
    let all = tempfile::tempdir().unwrap();
    let at = |name: &str| all.path().join(name);
    std::fs::copy(folder.join("paths.h5"), at("run.hdf5")).unwrap();
    std::fs::write(at("run.hdf5.toml"), "[columns]\n\"robot/joint/motor\" = \"motorAngle\"\n").unwrap();
    assert_eq!(read(&at("run.hdf5")).unwrap().0.channel("motorAngle").unwrap().values, squares);
    let what = |file: &std::path::Path| read(file).unwrap_err().to_string();
    let two = what(&folder.join("two-clocks.h5"));
    assert!(two.contains("`time` has 60 rows, `imu/rate` has 7") && two.contains("one clock"), "{two}");
    // Cut at any place it is refused with one error or read whole, never half of it.
    let whole = std::fs::read(folder.join("paths.h5")).unwrap();
    let seed = 66;
    eprintln!("seed {seed}");
    let mut rng = StdRng::seed_from_u64(seed);
    for _ in 0..40 {
        std::fs::write(at("cut.h5"), &whole[..rng.random_range(0..whole.len() - 1)]).unwrap();
        match read(&at("cut.h5")) {
            // Only bytes that hold nothing are missing.
            Ok((left, _)) => assert_eq!(left.channels, run.channels),
            Err(error) => assert_eq!(error.findings().len(), 1, "{error}"),
        }
    }
}

/// What SciPy writes at level 5, and what MATLAB writes at level 7.3 (made with h5py: user block, chunks, deflate, shuffle),
/// read to the same bits; text, structures and MATLAB's own groups are left out.
#[test]
fn mat_files_of_all_levels_read_alike() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/files");
    let read = |name: &str| Recording::read(&folder.join(name), &[], &DeclaredFigures::default()).unwrap();
    let (v5, _) = read("v5.mat");
    assert_eq!(v5.channels.len(), 4);
    let squares: Vec<f64> = (0..60).map(|k| f64::from(k) * 0.01).map(|t| t * t).collect();
    assert_eq!(v5.channel("motorAngle").unwrap().values, squares);
    let by_name = |run: &Recording| -> BTreeMap<String, Vec<f64>> {
        run.channels.iter().map(|c| (c.name.clone(), c.values.clone())).collect()
    };
    assert_eq!(by_name(&read("v7.mat").0), by_name(&v5));
    let (v73, findings) = read("v73.mat");
    assert_eq!((by_name(&v73), v73.channels[0].time.len()), (by_name(&v5), 60));
    let left: Vec<_> = findings.iter().map(|f| f.what.split('`').nth(1).unwrap()).collect();
    assert_eq!(left, ["settings", "note"]);
}
