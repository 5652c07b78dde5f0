//! `weight` of `[fit]`: what it does to estimates and standard errors, and where it is refused.

use std::fmt::Write as _;
use std::path::Path;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use trueup_identification::estimate::ParameterEstimate;
use trueup_identification::identify::{
    Identified, IdentifyError, IdentifyMethod, IdentifySettings, identify,
};
use trueup_identification::intake::{CaseIntake, Purpose};
use trueup_identification::model::SimulatedPlant;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_signals::Case;

const STIFFNESS: f64 = 0.004;

fn fitted(folder: &Path, method: IdentifyMethod) -> Result<Identified, IdentifyError> {
    let (loaded, _) = Case::load(folder, |c| Ok(SimulatedPlant::of_case(c, &[]).unwrap().variables()))
        .unwrap_or_else(|e| panic!("{e}"));
    identify(&loaded, &IdentifySettings { method, profile: false, design: None, progress: &|_| () })
}

fn stiffness(folder: &Path) -> ParameterEstimate {
    let found = fitted(folder, IdentifyMethod::OutputError).unwrap();
    found.parameters.into_iter().find(|f| f.estimate.name == "stiffness").unwrap().estimate
}

/// A joint that swings freely for 4 s, whose readings are after 2 s those of a spring so many times as stiff; until `end` seconds.
fn case(folder: &Path, stiffer: f64, end: f64, fit: &str) {
    let text = format!(
        "model = \"TwoMassJoint\"\ntrain = [\"a.csv\"]\n[parameters]\nmotorInertia = 1.7e-5\nloadInertia = 0.8\ngearRatio = 160\ntorqueConstant = 0.04\nstiffness = {}\ndamping = 1e-6\ncoulombFriction = 0\nstaticFriction = 0\nviscousFriction = 0\n[channels.motorAngle]\nnoise = 1e-3\n[channels.loadAngle]\nnoise = 1e-5\n[fit]\nparameters = [\"stiffness\"]\n{fit}",
        1.02 * STIFFNESS
    );
    std::fs::write(folder.join("case.toml"), text).unwrap();
    let (read, _) = Case::read(folder, &[]).unwrap();
    let model = SimulatedPlant::of_case(&read, &[]).unwrap();
    let run = |stiffness: f64| {
        let mut q = model.set(&model.defaults(), &read.parameters).unwrap();
        let mut set = |name: &str, v: f64| q[model.parameter(name).unwrap()] = v;
        set("stiffness", stiffness);
        set("initialMotorAngle", 1.0);
        set("initialMotorVelocity", 10.0);
        let times: Vec<f64> = (0..=160).map(|k| f64::from(k) * 0.025).collect();
        let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
        simulate(model.joint().unwrap(), &q, &[1.0, 100.0, 0.1, 1.0], options, &|_, _| (), &times).unwrap()
    };
    let (own, other) = (run(STIFFNESS), run(stiffer * STIFFNESS));
    let mut rng = StdRng::seed_from_u64(21);
    let mut table = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for k in (0..=160).filter(|k| own.t[*k] <= end) {
        let shown = if own.t[k] > 2.0 { &other.y[k] } else { &own.y[k] };
        let mut reading = |name: &str, sd: f64| {
            shown[model.output(name).unwrap()] + Normal::new(0.0, sd).unwrap().sample(&mut rng)
        };
        let (motor, load) = (reading("motorAngle", 1e-3), reading("loadAngle", 1e-5));
        let _ = writeln!(table, "{},0,{motor},{load}", own.t[k]);
    }
    std::fs::write(folder.join("a.csv"), table).unwrap();
}

fn off(e: &ParameterEstimate) -> f64 {
    (e.value - STIFFNESS).abs() / STIFFNESS
}

#[test]
fn a_stretch_that_the_model_cannot_have_leaves_the_estimate() {
    let folder = tempfile::tempdir().unwrap();
    let with = |end: f64, fit: &str| {
        case(folder.path(), 1.1, end, fit);
        stiffness(folder.path())
    };
    let (all, short) = (with(4.0, ""), with(2.0, ""));
    let out = with(4.0, "weight = [{ start = 2.01, weight = 0.0 }]\n");
    let tenth = with(
        4.0,
        "weight = [{ start = 2.01, end = 3.0, weight = 0.05 }, { start = 3.001, weight = 0.05 }]\n",
    );
    // As if the recording ended there, also the standard error.
    assert!((out.value / short.value - 1.0).abs() < 1e-6, "{out:?} {short:?}");
    let [a, b] = [&out, &short].map(|e| e.cramer_rao.unwrap());
    assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
    assert!(off(&out) < 4.0 * out.standard_error.unwrap() / STIFFNESS, "{out:?}");
    assert!(off(&all) > 0.01 && off(&tenth) < 0.5 * off(&all), "{all:?} {tenth:?}");
}

#[test]
fn a_reading_of_weight_w_is_w_readings() {
    let folder = tempfile::tempdir().unwrap();
    let with = |fit: &str| {
        case(folder.path(), 1.0, 4.0, fit);
        stiffness(folder.path())
    };
    let (full, quarter) = (with(""), with("[[fit.weight]]\nrecordings = [\"a.csv\"]\nweight = 0.25\n"));
    let [a, b] = [&full, &quarter].map(|e| e.cramer_rao.unwrap());
    assert!((b / a - 2.0).abs() < 2e-2, "{a} {b}");
    assert!(quarter.standard_error.unwrap() >= full.standard_error.unwrap(), "{full:?} {quarter:?}");
    // A product where two hold.
    let twice = with("weight = [{ start = 0.0, weight = 0.5 }, { end = 4.0, weight = 0.5 }]\n");
    assert!((twice.value / quarter.value - 1.0).abs() < 1e-9, "{twice:?} {quarter:?}");
}

#[test]
fn notes_and_refusals() {
    let folder = tempfile::tempdir().unwrap();
    let with = |fit: &str, method| {
        case(folder.path(), 1.0, 4.0, fit);
        fitted(folder.path(), method).map_err(|e| e.to_string())
    };
    let late = "weight = [{ start = 2.5, weight = 0.1 }]\n";
    let found = with(late, IdentifyMethod::NelderMead).unwrap();
    assert!(
        found.notes.iter().any(|n| n.starts_with("readings from 2.5 s on count for 0.1 each")),
        "{:?}",
        found.notes
    );
    let refused = |fit: &str, method, words: &[&str]| {
        let why = with(fit, method).unwrap_err();
        assert!(words.iter().all(|w| why.contains(w)), "{why}");
    };
    refused(late, IdentifyMethod::Ls, &["method ls", "`weight` of [fit]", "output-error"]);
    let never = "weight = [{ start = 40.0, weight = 0.1 }]\n";
    refused(never, IdentifyMethod::OutputError, &["line 19", "no recording for fitting has a reading there"]);
    let nothing = "weight = [{ start = -1.0, weight = 0.0 }]\n";
    refused(nothing, IdentifyMethod::OutputError, &["a.csv", "leaves out every reading"]);
    case(folder.path(), 1.0, 4.0, late);
    let taken = |purpose| CaseIntake::read(folder.path(), purpose, &[]).unwrap().findings;
    let said = taken(Purpose::Diagnose);
    let error = said.iter().find(|f| f.is_error()).unwrap();
    assert!(error.line == Some(19) && error.mend.contains("trueup identify"), "{error:?}");
    assert!(!taken(Purpose::Identify).iter().any(trueup_signals::Finding::is_error));
}
