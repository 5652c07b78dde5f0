//! `--method innovations`: a whole case from files, next to output error, and what it refuses.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::fmt::Write as _;
use std::path::Path;

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use trueup_identification::identify::{
    ExperimentDesign, FoundParameter, Identified, IdentifyError, IdentifyMethod, IdentifySettings, identify,
};
use trueup_identification::model::SimulatedPlant;
use trueup_models::plants::PlantStructure;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_signals::Case;

const JOINT: [(&str, f64); 9] = [
    ("motorInertia", 1.7e-5),
    ("loadInertia", 0.8),
    ("gearRatio", 160.0),
    ("torqueConstant", 0.04),
    ("stiffness", 0.084),
    ("damping", 7.7e-5),
    ("coulombFriction", 5.2e-3),
    ("staticFriction", 5.2e-3),
    ("viscousFriction", 5.6e-5),
];
const FIT: &str =
    "[fit]\nparameters = [\"stiffness\", \"damping\", \"coulombFriction\", \"viscousFriction\"]\n";

fn by(
    folder: &Path,
    method: IdentifyMethod,
    design: Option<&ExperimentDesign>,
) -> Result<Identified, IdentifyError> {
    let (loaded, _) = Case::load(folder, |c| Ok(SimulatedPlant::of_case(c, &[]).unwrap().variables()))
        .unwrap_or_else(|e| panic!("{e}"));
    identify(&loaded, &IdentifySettings { method, profile: false, design, progress: &|_| () })
}

/// Two recordings for fitting and one held out, the fitted parameters assumed 10 % too large; `more` of the case.
fn made(folder: &Path, more: &str) {
    let mut text =
        "model = \"TwoMassJoint\"\ntrain = [\"a.csv\", \"b.csv\"]\nholdout = [\"c.csv\"]\n[parameters]\n"
            .to_owned();
    for (name, value) in JOINT {
        let fitted = FIT.contains(name);
        let _ = writeln!(text, "{name} = {}", if fitted { 1.1 * value } else { value });
    }
    text += "[uncertain]\nmotorInertia = 0.05\n[channels.motorCurrent]\nnoise = 2e-3\ninterpolation = \"hold\"\n[channels.motorAngle]\nnoise = 1e-3\n[channels.loadAngle]\nnoise = 1e-5\n";
    std::fs::write(folder.join("case.toml"), text + more).unwrap();
    let structure =
        PlantStructure { model: "TwoMassJoint".into(), flexible: vec![true], ..PlantStructure::default() };
    let model = SimulatedPlant::new(structure).unwrap();
    let mut q = model.defaults();
    JOINT.iter().for_each(|(name, v)| q[model.parameter(name).unwrap()] = *v);
    let times: Vec<f64> = (0..1000).map(|k| f64::from(k) * 4e-3).collect();
    for (number, name) in ["a", "b", "c"].iter().enumerate() {
        let rng = &mut StdRng::seed_from_u64(number as u64);
        let current = |k: usize| {
            let t = k as f64 * 4e-3;
            0.35 * (2.3 * t + number as f64).sin() + 0.2 * (9.3 * t).sin()
        };
        let input = |t: f64, v: &mut [f64]| v[0] = current((t / 4e-3 + 1e-6) as usize);
        let options = DriverOptions { tolerance: 1e-9, ..DriverOptions::default() };
        let nominal = [1.0, 100.0, 0.1, 1.0];
        let truth = simulate(model.joint().unwrap(), &q, &nominal, options, &input, &times).unwrap();
        let mut text = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
        let mut noise = |sd: f64| Normal::new(0.0, sd).unwrap().sample(rng);
        for (k, t) in times.iter().enumerate() {
            let [motor, load] = ["motorAngle", "loadAngle"].map(|n| truth.y[k][model.output(n).unwrap()]);
            let (motor, load) = (motor + noise(1e-3), load + noise(1e-5));
            let _ = writeln!(text, "{t:.4},{},{motor},{load}", current(k) + noise(2e-3));
        }
        std::fs::write(folder.join(format!("{name}.csv")), text).unwrap();
    }
}

fn of<'a>(r: &'a Identified, name: &str) -> &'a FoundParameter {
    r.parameters.iter().chain(&r.uncertain).find(|f| f.estimate.name == name).unwrap()
}

#[test]
fn innovations_agree_with_output_error() {
    let folder = tempfile::tempdir().unwrap();
    made(folder.path(), FIT);
    let [found, free] = [IdentifyMethod::Innovations, IdentifyMethod::OutputError]
        .map(|method| by(folder.path(), method, None).unwrap());
    for name in ["stiffness", "damping", "coulombFriction", "viscousFriction", "motorInertia"] {
        let truth = JOINT.iter().find(|j| j.0 == name).unwrap().1;
        let [e, other] = [&found, &free].map(|r| &of(r, name).estimate);
        let [error, least] = [e, other].map(|e| e.standard_error.unwrap());
        assert!((e.value - truth).abs() < 4.0 * error, "{name}: {} +- {error}, truth {truth}", e.value);
        assert!((e.value - other.value).abs() < 5.0 * least, "{name}: {} and {}", e.value, other.value);
        // Both weigh by the noise of the current, which is most of what is not known.
        assert!((0.8..2.0).contains(&(error / least)), "{name}: {error} over {least}");
        let [low, high] = e.ci95.map(Option::unwrap);
        assert!(low < e.value && e.value < high && (0.9..1.1).contains(&((high - low) / (3.92 * error))));
    }
    assert_eq!(of(&found, "motorInertia").doubt, Some(0.05));
    assert!(found.held_out && found.fit.iter().all(|f| f.nrmse.unwrap() < 0.02), "{:?}", found.fit);
    for c in &found.channels {
        assert!((0.8..1.25).contains(&c.above_floor) && c.whiteness > 1e-4, "{c:?}");
    }
    let n = found.parameters.len() + found.uncertain.len();
    assert_eq!((found.correlation.nrows(), found.rank), (n, (n, n)));
    for i in 0..n {
        assert!((found.correlation[(i, i)] - 1.0).abs() < 1e-9);
    }
    assert!(found.notes.is_empty(), "{:?}", found.notes);
}

#[test]
fn what_they_cannot_determine_has_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    made(folder.path(), "[fit]\nparameters = [\"staticFriction\"]\n");
    let file = folder.path().join("case.toml");
    let text = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, text.replace("[uncertain]\nmotorInertia = 0.05\n", "")).unwrap();
    let found = by(folder.path(), IdentifyMethod::Innovations, None).unwrap_or_else(|e| panic!("{e}"));
    let level = of(&found, "staticFriction");
    println!("{level:?}, condition {}", found.condition);
    assert!(level.estimate.standard_error.is_none() && found.condition.is_infinite() && found.rank == (0, 1));
}

#[test]
fn what_innovations_do_not_take_is_named_with_the_remedy() {
    let refused = |more: &str, design: Option<&ExperimentDesign>, words: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        made(folder.path(), more);
        let text = by(folder.path(), IdentifyMethod::Innovations, design).err().unwrap().to_string();
        assert!(words.iter().all(|w| text.contains(w)), "{text}");
    };
    let design = ExperimentDesign { name: "initialSpringOffset".into(), values: vec![0.0, 0.1] };
    refused(FIT, Some(&design), &["method innovations", "--design", "output-error"]);
    let with = "[fit]\neffects = [\"backlash\"]\n";
    refused(with, None, &["method innovations", "effects", "output-error"]);
    let weight = format!("{FIT}weight = [{{ start = 1.0, end = 2.0, weight = 0.5 }}]\n");
    refused(&weight, None, &["method innovations", "weight", "output-error"]);
    let known = format!(
        "{FIT}[effects]\nflexible-link = {{ tipInertia = 0.05, linkStiffness = 150.0, linkDamping = 0.1 }}\n"
    );
    refused(&known, None, &["method innovations", "flexible-link", "--method output-error"]);
}
