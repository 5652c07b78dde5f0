//! The crate `fmi-rs` as a reference: it validates, loads and runs every packed FMU, in Model Exchange with the
//! solver below and in Co-Simulation with the FMU's own, and all of them say the same.
//!
//! Runs on the FMUs in the folder that `TRUEUP_FMUS` names; `./test` packs them there.

#![allow(missing_docs, clippy::expect_used, clippy::panic, clippy::unwrap_used)]
// fmi-rs requires it.
#![allow(clippy::arc_with_non_send_sync)]

mod solver;

use fmi_rs::model_description as md;
use fmi_rs::sim::{fmi2, fmi3};
use fmi_rs::zip::extract_zip_archive;
use solver::RungeKutta;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const STOP: f64 = 1.0;
const INTERVAL: f64 = 0.05;
/// Of the Co-Simulation FMU's own solver.
const TOLERANCE: f64 = 1e-10;
/// What the runs may differ by, relative to the largest value of the channel.
const AGREEMENT: f64 = 1e-8;

/// Variables with one value per element.
type Values = &'static [(&'static str, &'static [f64])];

/// Start values that make something happen, by model; of inputs they are held.
const EXPERIMENTS: &[(&str, Values)] = &[
    // Breaks loose (static friction is overcome) and turns the load against a torque.
    ("TwoMassJoint", &[("motorCurrent", &[0.018]), ("externalTorque", &[-0.5])]),
    ("PlanarManipulator", &[("jointTorque", &[0.4, -0.1, 0.02]), ("tipForce", &[0.1, -0.2])]),
    (
        "SpatialFreeFlyer",
        &[("jointTorque", &[2.0, -3.0, 1.5, 0.02, -0.02, 0.004]), ("baseForce", &[5.0, 0.0, -2.0])],
    ),
    // Two motors break loose, the others stick.
    ("FlexibleArm", &[("motorCurrent", &[0.3, -0.3, 0.0, 0.0, 0.0, 0.0])]),
    ("FreeBody", &[("portForce", &[100.0, -40.0]), ("portTorque", &[20.0])]),
    // The target's port falls onto P1, jaws moving; the chaser meets it at once.
    ("GripperContact", &[("portPosition", &[0.095, 0.01]), ("portVelocity", &[-0.004, 0.0])]),
    ("CaptureScene", &[("initialPortOffset", &[0.1001, 0.0]), ("chaserForce", &[2.0, -1.0])]),
    // Reaches its limit during the run, not at once.
    ("JointController", &[("positionReference", &[1e-3]), ("motorVelocity", &[0.5]), ("loadAngle", &[2e-4])]),
    (
        "ManipulatorController",
        &[("positionReference", &[0.01, -0.02, 0.03]), ("jointAngle", &[0.001, 0.0, -0.002])],
    ),
];

/// The packed FMUs of one version, or none where they were not packed.
fn packed(version: u32) -> Vec<PathBuf> {
    let Some(folder) = std::env::var_os("TRUEUP_FMUS") else {
        // Not println!, which the test runner keeps to itself.
        let _ =
            writeln!(std::io::stderr(), "SKIPPED: TRUEUP_FMUS is not set, so there is no FMU; run ./test");
        return Vec::new();
    };
    let entries =
        std::fs::read_dir(&folder).unwrap_or_else(|e| panic!("{}: {e}; run ./test", folder.display()));
    let ending = format!(".fmi{version}.fmu");
    let mut files: Vec<_> = entries.map(|e| e.expect("an entry").path()).collect();
    files.retain(|f| f.to_string_lossy().ends_with(&ending));
    files.sort();
    assert!(!files.is_empty(), "no *{ending} in {}; run ./test", folder.display());
    files
}

fn unzipped(fmu: &Path) -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder");
    extract_zip_archive(fmu, folder.path()).unwrap_or_else(|e| panic!("{}: {e}", fmu.display()));
    folder
}

/// Values of all outputs, flattened, over time; times of events are listed twice.
struct Run {
    time: Vec<f64>,
    rows: Vec<Vec<f64>>,
}

fn experiment(model: &str) -> Values {
    EXPERIMENTS.iter().find(|(m, _)| *m == model).unwrap_or_else(|| panic!("no experiment for {model}")).1
}

fn run_fmi2(fmu: &Path, model_exchange: bool) -> Run {
    let folder = unzipped(fmu);
    let description =
        md::fmi2::ModelDescription::from_path(&folder.path().join("modelDescription.xml")).unwrap();
    let description = Arc::new(description);
    let mut start_values = Vec::new();
    for (name, values) in experiment(&description.modelName) {
        // Elements have a name each, in the order of the array: x[1] of a vector, x[1,1] of a table.
        let element = |v: &&str| *v == *name || v.strip_prefix(name).is_some_and(|v| v.starts_with('['));
        let elements: Vec<_> =
            description.modelVariables.iter().map(|v| v.name.as_str()).filter(element).collect();
        assert_eq!(elements.len(), values.len(), "{}: {name}", fmu.display());
        start_values.extend(
            elements.iter().zip(*values).map(|(name, value)| ((*name).to_owned(), value.to_string())),
        );
    }
    let settings = fmi2::SimulationSettings {
        unzipdir: folder.path().to_owned(),
        model_description: description.clone(),
        start_time: 0.0,
        stop_time: STOP,
        logging_on: true,
        set_stop_time: true,
        output_interval: INTERVAL,
        log_time_scale: false,
        tolerance: TOLERANCE,
        set_tolerance: true,
        start_values,
        log_fmi_calls: false,
        input_file: None,
        early_return_allowed: false,
        event_mode_used: false,
        log_file: None,
        initial_fmu_state_file: None,
        final_fmu_state_file: None,
    };
    let outputs = (0..description.modelVariables.len())
        .filter(|i| description.modelVariables[*i].causality == md::fmi2::Causality::Output)
        .collect();
    let recorder = Arc::new(fmi2::recorder::Recorder::new(fmi2::Trajectories::new(description, outputs)));
    let result = if model_exchange {
        fmi2::me::simulate(&settings, &RungeKutta, None, recorder.clone())
    } else {
        fmi2::cs::simulate(&settings, None, recorder.clone())
    };
    result.unwrap_or_else(|e| panic!("{}, Model Exchange {model_exchange}: {e}", fmu.display()));
    let t = recorder.trajectories.borrow();
    let values = |row: &Vec<fmi2::VariableValue>| row.iter().map(|v| v.to_f64().expect("a number")).collect();
    Run { time: t.time.clone(), rows: t.rows.iter().map(values).collect() }
}

fn run_fmi3(fmu: &Path, model_exchange: bool, event_mode: bool) -> Run {
    let folder = unzipped(fmu);
    let description =
        md::fmi3::ModelDescription::from_path(&folder.path().join("modelDescription.xml")).unwrap();
    let description = Arc::new(description);
    let literal = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let settings = fmi3::SimulationSettings {
        unzipdir: folder.path().to_owned(),
        model_description: description.clone(),
        library_kind: fmi_rs::fmi3::LibraryKind::Native,
        enable_dae: false,
        start_time: 0.0,
        stop_time: STOP,
        visible: false,
        logging_on: true,
        set_stop_time: true,
        output_interval: INTERVAL,
        log_time_scale: false,
        tolerance: TOLERANCE,
        set_tolerance: true,
        start_values: experiment(&description.modelName)
            .iter()
            .map(|(name, values)| ((*name).to_owned(), literal(values)))
            .collect(),
        log_fmi_calls: false,
        intermediate_update: false,
        input_file: None,
        early_return_allowed: event_mode,
        event_mode_used: event_mode,
        log_file: None,
        initial_fmu_state_file: None,
        final_fmu_state_file: None,
    };
    let outputs = (0..description.modelVariables.len())
        .filter(|i| description.modelVariables[*i].causality == md::fmi3::Causality::Output)
        .collect();
    let recorder = Arc::new(fmi3::recorder::Recorder::new(fmi3::Trajectories::new(description, outputs)));
    let result = if model_exchange {
        fmi3::me::simulate(&settings, &RungeKutta, None, recorder.clone())
    } else {
        fmi3::cs::simulate(&settings, None, recorder.clone())
    };
    result.unwrap_or_else(|e| panic!("{}, Model Exchange {model_exchange}: {e}", fmu.display()));
    let t = recorder.trajectories.borrow();
    let values = |row: &Vec<fmi3::VariableValue>| -> Vec<f64> {
        row.iter()
            .flat_map(|v| match v {
                fmi3::VariableValue::Float64(v) => v.clone(),
                fmi3::VariableValue::Boolean(v) => v.iter().map(|b| f64::from(u8::from(*b))).collect(),
                fmi3::VariableValue::Int64(v) => v.iter().map(|i| *i as f64).collect(),
                other => panic!("an output of a type that no model here has: {other:?}"),
            })
            .collect()
    };
    Run { time: t.time.clone(), rows: t.rows.iter().map(values).collect() }
}

/// The last of the rows at time `t`: the value after an event, if there is one.
fn at(run: &Run, t: f64) -> &[f64] {
    let i = run.time.iter().rposition(|time| (time - t).abs() < 1e-9);
    &run.rows[i.unwrap_or_else(|| panic!("no row at {t} s"))]
}

fn agree(what: &str, a: &Run, b: &Run) {
    let columns = a.rows[0].len();
    assert_eq!(columns, b.rows[0].len(), "{what}: numbers of outputs");
    assert!(
        a.rows.iter().flatten().chain(b.rows.iter().flatten()).all(|v| v.is_finite()),
        "{what}: not finite"
    );
    let largest = |k: usize| a.rows.iter().map(|row| row[k].abs()).fold(0.0, f64::max);
    for step in 0..=(STOP / INTERVAL).round() as usize {
        let t = step as f64 * INTERVAL;
        for (k, (x, y)) in at(a, t).iter().zip(at(b, t)).enumerate() {
            let allowed = AGREEMENT * largest(k) + 1e-12;
            assert!(
                (x - y).abs() <= allowed,
                "{what}: output {k} at {t} s: {x} against {y}, allowed {allowed:.1e}"
            );
        }
    }
    let moves = |k: usize| a.rows.iter().any(|row| row[k] != a.rows[0][k]);
    assert!((0..columns).any(moves), "{what}: the experiment moves nothing");
}

#[test]
fn fmi_rs_finds_nothing_wrong() {
    for fmu in packed(2) {
        let folder = unzipped(&fmu);
        let d = md::fmi2::ModelDescription::from_path(&folder.path().join("modelDescription.xml")).unwrap();
        let problems: Vec<_> = d.validate().into_iter().map(|p| p.message).collect();
        assert!(problems.is_empty(), "{}: {problems:#?}", fmu.display());
    }
    for fmu in packed(3) {
        let folder = unzipped(&fmu);
        let d = md::fmi3::ModelDescription::from_path(&folder.path().join("modelDescription.xml")).unwrap();
        let problems: Vec<_> = d.validate().into_iter().map(|p| p.message).collect();
        assert!(problems.is_empty(), "{}: {problems:#?}", fmu.display());
    }
}

#[test]
fn fmi_rs_runs_every_fmu_and_all_agree() {
    for (v2, v3) in packed(2).iter().zip(packed(3)) {
        let name = v3.file_name().unwrap_or_default().to_string_lossy().replace(".fmi3.fmu", "");
        assert!(
            v2.ends_with(format!("{name}.fmi2.fmu")),
            "{} has no twin of the other version",
            v2.display()
        );
        let reference = run_fmi2(v2, false);
        agree(&format!("{name}: FMI 2 CS against ME"), &reference, &run_fmi2(v2, true));
        agree(&format!("{name}: FMI 2 CS against FMI 3 CS"), &reference, &run_fmi3(&v3, false, false));
        agree(
            &format!("{name}: FMI 2 CS against FMI 3 CS, event mode"),
            &reference,
            &run_fmi3(&v3, false, true),
        );
        agree(&format!("{name}: FMI 2 CS against FMI 3 ME"), &reference, &run_fmi3(&v3, true, false));
    }
}
