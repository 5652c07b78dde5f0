//! Whole cases, from files to parameters.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr)]

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use trueup_identification::identify::{
    FitFigure, FoundParameter, Identified, IdentifyMethod, IdentifySettings, identify,
};
use trueup_identification::model::SimulatedPlant;
use trueup_models::plants::PlantStructure;
use trueup_numerics::driver::{DriverOptions, simulate};
use trueup_signals::Case;

fn identified(folder: &Path, method: IdentifyMethod) -> Identified {
    let (loaded, _) = Case::load(folder, |c| Ok(SimulatedPlant::of_case(c, &[]).unwrap().variables()))
        .unwrap_or_else(|e| panic!("{e}"));
    let settings = IdentifySettings { method, profile: false, design: None, progress: &|_| () };
    identify(&loaded, &settings).unwrap()
}

fn of<'a>(r: &'a Identified, name: &str) -> &'a FoundParameter {
    r.parameters.iter().chain(&r.uncertain).find(|f| f.estimate.name == name).unwrap()
}

/// The truth is within four standard errors, and the standard error within this share of it.
fn right(r: &Identified, name: &str, truth: f64, sure: f64) {
    let e = &of(r, name).estimate;
    let se = e.standard_error.unwrap_or_else(|| panic!("{name}: {:?}", e.reason));
    assert!((e.value - truth).abs() < 4.0 * se, "{name}: {} +- {se}, truth {truth}", e.value);
    assert!(se < sure * truth.abs(), "{name}: standard error {se}");
}

const JOINT: [(&str, f64); 9] = [
    ("motorInertia", 1.7e-5),
    ("loadInertia", 0.8),
    ("gearRatio", 160.0),
    ("torqueConstant", 0.04),
    ("stiffness", 0.084),
    ("damping", 7.7e-5),
    ("coulombFriction", 5.2e-3),
    ("staticFriction", 6.5e-3),
    ("viscousFriction", 5.6e-5),
];

/// A recording of the joint with all that a poor one has: load angle at a fifth of the rate and late by 4 ms, an offset,
/// missing samples, a few outliers, noise on the current.
fn joint_csv(model: &SimulatedPlant, q: &[f64], seed: u64) -> String {
    let mut rng = StdRng::seed_from_u64(seed);
    let times: Vec<f64> = (0..2000).map(|k| f64::from(k) * 2e-3).collect();
    let phase = seed as f64;
    let u = |t: f64| 0.3 * (5.0 * t + phase).sin() + 0.2 * (31.0 * t).sin();
    let held: Vec<f64> = times.iter().map(|t| u(*t)).collect();
    let input = |t: f64, v: &mut [f64]| {
        let k = ((t / 2e-3) as usize).min(held.len() - 2);
        v[0] = held[k] + (held[k + 1] - held[k]) * (t / 2e-3 - k as f64);
    };
    // The angle as it was 4 ms before.
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let shown =
        simulate(model.joint().unwrap(), q, &[1.0, 100.0, 0.1, 1.0], options, &input, &times).unwrap();
    let (motor, load) = (model.output("motorAngle").unwrap(), model.output("loadAngle").unwrap());
    let mut noise = |sd: f64| Normal::new(0.0, sd).unwrap().sample(&mut rng);
    let mut text = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        let mut m = ((shown.y[k][motor] + noise(4e-4)) / 1.5e-3).round() * 1.5e-3;
        if k % 401 == 200 {
            m += 3.0;
        }
        let l = shown.y[k.saturating_sub(2)][load] + 2.5e-4 + noise(1e-5);
        let current = held[k] + noise(1e-3);
        // What it shows first is from before the recording.
        let load = if k % 5 == 0 && k >= 5 { format!("{l:.8}") } else { String::new() };
        let motor = if k % 97 == 50 { "nan".into() } else { format!("{m:.6}") };
        let _ = writeln!(text, "{t:.4},{current:.7},{motor},{load}");
    }
    text
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_joint_from_poor_recordings() {
    let folder = tempfile::tempdir().unwrap();
    let mut case =
        "model = \"TwoMassJoint\"\ntrain = [\"a.csv\", \"b.csv\"]\nholdout = [\"c.csv\"]\n[parameters]\n"
            .to_owned();
    for (name, value) in JOINT {
        let wrong = match name {
            "stiffness" => 1.3,
            "coulombFriction" | "viscousFriction" => 0.8,
            "loadInertia" => 1.03,
            _ => 1.0,
        };
        let _ = writeln!(case, "{name} = {}", value * wrong);
    }
    case += "[uncertain]\nloadInertia = 0.05\nstiffness = 0.5\n[channels.motorAngle]\nresolution = 0.0015\nnoise = 0.0004\n[channels.loadAngle]\nnoise = 1e-5\ndelay = 0.004\noffset = \"estimate\"\n[channels.motorCurrent]\nnoise = 1e-3\n";
    std::fs::write(folder.path().join("case.toml"), &case).unwrap();
    let (loaded, _) = Case::read(folder.path(), &[]).unwrap();
    let model = SimulatedPlant::of_case(&loaded, &[]).unwrap();
    let mut q = model.defaults();
    JOINT.iter().for_each(|(name, v)| q[model.parameter(name).unwrap()] = *v);
    for (k, name) in ["a.csv", "b.csv", "c.csv"].iter().enumerate() {
        std::fs::write(folder.path().join(name), joint_csv(&model, &q, k as u64)).unwrap();
    }
    let r = identified(folder.path(), IdentifyMethod::OutputError);
    for (name, sure) in [
        ("stiffness", 0.02),
        ("damping", 0.1),
        ("coulombFriction", 0.01),
        ("viscousFriction", 0.01),
        ("staticFriction", 0.05),
    ] {
        let truth = JOINT.iter().find(|p| p.0 == name).unwrap().1;
        right(&r, name, truth, sure);
    }
    right(&r, "loadInertia", 0.8, 0.05);
    assert!(r.uncertain[0].doubt == Some(0.05) && r.held_out);
    for (run, own) in &r.nuisance {
        let offset = own.iter().find(|f| f.estimate.name == "loadAngle.offset").unwrap();
        let se = offset.estimate.standard_error.unwrap();
        assert!((offset.estimate.value - 2.5e-4).abs() < 4.0 * se, "{run}: {offset:?}");
    }
    // The input's noise alone makes the free run drift; the nominal model is far worse.
    for (after, before) in r.fit.iter().zip(&r.before) {
        assert!(after.nrmse.unwrap() < 0.2 * before.nrmse.unwrap(), "{after:?} {before:?}");
    }
    // The other methods run, and say what they leave out.
    for method in
        [IdentifyMethod::LsLiteral, IdentifyMethod::Ls, IdentifyMethod::Filtered, IdentifyMethod::Iv]
    {
        let r = identified(folder.path(), method);
        assert!(of(&r, "staticFriction").estimate.reason.is_some() && !r.fit.is_empty(), "{method}");
    }
}

/// A joint without friction that swings freely for 4 s, read ten times a second.
fn swinging(folder: &Path, hz: f64, more: &str) {
    let (motor, load, n): (f64, f64, f64) = (1.7e-5, 0.8, 160.0);
    let stiffness = (2.0 * std::f64::consts::PI * hz).powi(2) / (1.0 / motor + n * n / load);
    let case = format!(
        "model = \"TwoMassJoint\"\ntrain = [\"a.csv\"]\n[parameters]\nmotorInertia = {motor}\nloadInertia = {load}\ngearRatio = {n}\ntorqueConstant = 0.04\nstiffness = {}\ndamping = 1e-10\ncoulombFriction = 0\nstaticFriction = 0\nviscousFriction = 0\n[channels.motorAngle]\nnoise = 1e-3\n[channels.loadAngle]\nnoise = 1e-5\n{more}",
        1.02 * stiffness
    );
    std::fs::write(folder.join("case.toml"), &case).unwrap();
    let (loaded, _) = Case::read(folder, &[]).unwrap();
    let model = SimulatedPlant::of_case(&loaded, &[]).unwrap();
    let mut q = model.set(&model.defaults(), &loaded.parameters).unwrap();
    let mut set = |name: &str, v: f64| q[model.parameter(name).unwrap()] = v;
    set("stiffness", stiffness);
    set("initialMotorAngle", 1.0);
    set("initialMotorVelocity", 10.0);
    let times: Vec<f64> = (0..=40).map(|k| f64::from(k) * 0.1).collect();
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let shown =
        simulate(model.joint().unwrap(), &q, &[1.0, 100.0, 0.1, 1.0], options, &|_, _| (), &times).unwrap();
    let mut rng = StdRng::seed_from_u64(11);
    let mut text = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        let mut shows = |name: &str, sd: f64| {
            shown.y[k][model.output(name).unwrap()] + Normal::new(0.0, sd).unwrap().sample(&mut rng)
        };
        let (motor, load) = (shows("motorAngle", 1e-3), shows("loadAngle", 1e-5));
        let _ = writeln!(text, "{t:.4},0,{motor:.9},{load:.9}");
    }
    std::fs::write(folder.join("a.csv"), text).unwrap();
}

/// Read ten times a second, 3.66 Hz and 6.34 Hz are the same: springs of which one is three times the other.
#[test]
fn another_minimum_within_chance_is_told() {
    let folder = tempfile::tempdir().unwrap();
    swinging(folder.path(), 3.66, "[fit]\nparameters = [\"stiffness\"]\n");
    let r = identified(folder.path(), IdentifyMethod::OutputError);
    let note =
        r.notes.iter().find(|n| n.contains("other values fit as well")).unwrap_or_else(|| panic!("{r:#?}"));
    let (there, here) = note.split_once("stiffness = ").unwrap().1.split_once(" instead of ").unwrap();
    let here = here.split_once(". The").unwrap().0;
    let [there, here]: [f64; 2] = [there, here].map(|v| v.parse().unwrap());
    assert!((here / of(&r, "stiffness").estimate.value - 1.0).abs() < 1e-3, "{note}");
    let ratio = there.max(here) / there.min(here);
    assert!((ratio - (6.34_f64 / 3.66).powi(2)).abs() < 0.02, "{note}");
}

/// So little damping that noise is all there is to fit it to.
#[test]
fn what_nothing_determines_keeps_the_value_of_the_case() {
    let folder = tempfile::tempdir().unwrap();
    swinging(folder.path(), 2.0, "[fit]\nparameters = [\"stiffness\", \"damping\"]\n");
    let r = identified(folder.path(), IdentifyMethod::OutputError);
    let e = &of(&r, "damping").estimate;
    assert!(e.standard_error.is_none() && (e.value / 1e-10 - 1.0).abs() < 1e-9, "{e:?}");
    assert!(e.reason.as_ref().unwrap().ends_with("the case's value is kept"), "{e:?}");
    assert!((r.values[trueup_models::joint::parameter::DAMPING] / 1e-10 - 1.0).abs() < 1e-9);
    right(&r, "stiffness", of(&r, "stiffness").nominal / 1.02, 1e-2);
}

/// An arm that moves by smooth torques; `torque`: whether they are recorded.
fn arm_case(folder: &Path, torque: bool) -> Vec<f64> {
    let mut case = "model = \"PlanarManipulator\"\ntrain = [\"a.csv\"]\n[parameters]\nmotorInertia = [4.0, 0.0, 0.0]\njointStiffness = [8.0, 0.0, 0.0]\njointDamping = [0.8, 0.0, 0.0]\n".to_owned();
    for (name, noise) in
        [("basePosition", 1e-4), ("baseAttitude", 1e-4), ("jointAngle", 1e-4), ("motorAngle", 1e-4)]
    {
        let _ = writeln!(case, "[channels.{name}]\nnoise = {noise}");
    }
    std::fs::write(folder.join("case.toml"), &case).unwrap();
    let (loaded, _) = Case::read(folder, &[]).unwrap();
    let model = SimulatedPlant::of_case(&loaded, &[]).unwrap();
    let mut q = model.defaults();
    let set = |q: &mut Vec<f64>, name: &str, v: f64| q[model.parameter(name).unwrap()] = v;
    set(&mut q, "initialJointAngle[1]", 0.05);
    set(&mut q, "initialJointAngle[2]", -0.3);
    set(&mut q, "initialJointAngle[3]", -0.4);
    let times: Vec<f64> = (0..400).map(|k| f64::from(k) * 0.05).collect();
    let torques = |t: f64| [0.05 * (0.7 * t).sin(), -0.02 * (1.1 * t).sin(), 0.01 * (1.7 * t).sin()];
    let at: Vec<[f64; 3]> = times.iter().map(|t| torques(*t)).collect();
    let input = |t: f64, v: &mut [f64]| {
        let k = ((t / 0.05) as usize).min(at.len() - 2);
        (0..3).for_each(|j| v[j] = at[k][j] + (at[k + 1][j] - at[k][j]) * (t / 0.05 - k as f64));
    };
    let states = model.sizes().states;
    let shown =
        simulate(model.arm().unwrap(), &q, &vec![0.1; states], DriverOptions::default(), &input, &times)
            .unwrap();
    let mut rng = StdRng::seed_from_u64(5);
    let noise = Normal::new(0.0, 1e-4).unwrap();
    let mut names = vec!["basePosition[1]", "basePosition[2]", "baseAttitude"];
    names.extend(["jointAngle[1]", "jointAngle[2]", "jointAngle[3]", "motorAngle[1]"]);
    let mut text = format!("time,{}", names.join(","));
    text += if torque { ",jointTorque[1],jointTorque[2],jointTorque[3]\n" } else { "\n" };
    for (k, t) in times.iter().enumerate() {
        let _ = write!(text, "{t:.3}");
        for name in &names {
            let _ = write!(text, ",{:.7}", shown.y[k][model.output(name).unwrap()] + noise.sample(&mut rng));
        }
        if torque {
            at[k].iter().for_each(|v| _ = write!(text, ",{v:.9}"));
        }
        text.push('\n');
    }
    std::fs::write(folder.join("a.csv"), text).unwrap();
    q
}

/// Identified from its torques, or with its motion prescribed.
fn arm(torque: bool) -> Identified {
    let folder = tempfile::tempdir().unwrap();
    arm_case(folder.path(), torque);
    let r = identified(folder.path(), IdentifyMethod::OutputError);
    let led =
        r.notes.iter().filter(|n| n.contains("is not recorded: the measured motion of the motor")).count();
    assert_eq!(led, if torque { 0 } else { 3 });
    r
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn an_arm_by_its_torques() {
    let r = arm(true);
    right(&r, "jointStiffness[1]", 5.47, 0.02);
    right(&r, "jointDamping[1]", 0.5, 0.05);
    right(&r, "motorInertia[1]", 5.6, 0.02);
    assert!(r.channels.iter().all(|c| (0.8..1.25).contains(&c.above_floor)), "{:?}", r.channels);
    assert_eq!(r.fit.len(), 7);
}

#[test]
fn an_arm_by_its_motion() {
    let r = arm(false);
    right(&r, "jointStiffness[1]", 5.47, 0.2);
    right(&r, "jointDamping[1]", 0.5, 0.2);
    assert_eq!(r.fit.len(), 4);
}

#[test]
fn a_real_drive() {
    let Some(data) = std::env::var_os("TRUEUP_DATA").map(|d| PathBuf::from(d).join("real/emps")) else {
        eprintln!("SKIPPED: TRUEUP_DATA does not name the folder with recorded data");
        return;
    };
    let folder = tempfile::tempdir().unwrap();
    // Volts become newtons by the sidecar's scale, and rad replaces metres: gearRatio 1, torqueConstant 1.
    let sidecar = "[columns]\nt = \"time\"\nqm = \"motorAngle\"\nqg = false\nvir = { variable = \"motorCurrent\", scale = 35.15065 }\n";
    for (name, more) in [("DATA_EMPS.mat", ""), ("DATA_EMPS_PULSES.mat", "pulses_N = false\n")] {
        std::fs::copy(data.join(name), folder.path().join(name)).unwrap();
        std::fs::write(folder.path().join(format!("{name}.toml")), format!("{sidecar}{more}")).unwrap();
    }
    let case = "model = \"TwoMassJoint\"\ntrain = [\"DATA_EMPS.mat\"]\nholdout = [\"DATA_EMPS_PULSES.mat\"]\n[parameters]\njointFlexible = false\ngearRatio = 1\ntorqueConstant = 1\nmotorInertia = 80\nloadInertia = 1e-6\ncoulombFriction = 15\nstaticFriction = 15\nviscousFriction = 150\n[fit]\nparameters = [\"motorInertia\", \"viscousFriction\", \"coulombFriction\"]\n[channels.motorAngle]\nnoise = 1e-6\n[channels.motorCurrent]\nnoise = 1.7\noffset = \"estimate\"\n";
    std::fs::write(folder.path().join("case.toml"), case).unwrap();
    let r = identified(folder.path(), IdentifyMethod::OutputError);
    let offset = r.nuisance[0].1.iter().find(|f| f.estimate.name == "motorCurrent.offset").unwrap();
    // IDIM-LS of the data's authors, who fit torques, not motions.
    let published = [
        (of(&r, "motorInertia"), 95.1089, 0.02),
        (of(&r, "viscousFriction"), 203.5034, 0.03),
        (of(&r, "coulombFriction"), 20.3935, 0.05),
        (offset, -3.1648, 0.1),
    ];
    for (f, value, share) in published {
        let e = &f.estimate;
        eprintln!(
            "{:<22} {:.4} +- {:.4}, {:?}, published {value}",
            e.name,
            e.value,
            e.standard_error.unwrap(),
            e.ci95
        );
        assert!((e.value / value - 1.0).abs() < share, "{}: {} against {value}", e.name, e.value);
    }
    eprintln!("held out: {:?}", r.fit);
    assert!(r.fit[0].nrmse.unwrap() < 0.1);
}

/// The simplex on the same cost ends where the gradient does.
#[test]
fn the_simplex_agrees_with_output_error() {
    let folder = tempfile::tempdir().unwrap();
    let mut case = "model = \"TwoMassJoint\"\ntrain = [\"a.csv\"]\n[parameters]\n".to_owned();
    for (name, value) in JOINT {
        let wrong = if name == "stiffness" { 1.2 } else { 1.0 };
        let _ = writeln!(case, "{name} = {}", value * wrong);
    }
    case += "[fit]\nparameters = [\"stiffness\", \"coulombFriction\"]\n[channels.motorAngle]\nnoise = 2e-3\n[channels.loadAngle]\nnoise = 2e-5\n";
    std::fs::write(folder.path().join("case.toml"), &case).unwrap();
    let (loaded, _) = Case::read(folder.path(), &[]).unwrap();
    let model = SimulatedPlant::of_case(&loaded, &[]).unwrap();
    let mut q = model.defaults();
    JOINT.iter().for_each(|(name, v)| q[model.parameter(name).unwrap()] = *v);
    let mut rng = StdRng::seed_from_u64(3);
    let times: Vec<f64> = (0..600).map(|k| f64::from(k) * 2e-3).collect();
    let input = |t: f64, v: &mut [f64]| v[0] = 0.3 * (9.0 * t + 0.5).sin() + 0.2 * (41.0 * t).sin();
    let options = DriverOptions { tolerance: 1e-10, ..DriverOptions::default() };
    let shown =
        simulate(model.joint().unwrap(), &q, &[1.0, 100.0, 0.1, 1.0], options, &input, &times).unwrap();
    let mut text = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
    for (k, t) in times.iter().enumerate() {
        let mut u = [0.0; 2];
        input(*t, &mut u);
        let mut shows = |name: &str, sd: f64| {
            shown.y[k][model.output(name).unwrap()] + Normal::new(0.0, sd).unwrap().sample(&mut rng)
        };
        let (motor, load) = (shows("motorAngle", 2e-3), shows("loadAngle", 2e-5));
        let _ = writeln!(text, "{t:.4},{:.9},{motor:.9},{load:.9}", u[0]);
    }
    std::fs::write(folder.path().join("a.csv"), text).unwrap();
    let [gradient, simplex] = [IdentifyMethod::OutputError, IdentifyMethod::NelderMead]
        .map(|method| identified(folder.path(), method));
    for name in ["stiffness", "coulombFriction"] {
        let (a, b) = (&of(&gradient, name).estimate, &of(&simplex, name).estimate);
        let off = (b.value - a.value) / a.standard_error.unwrap();
        println!("{name}: off by {off:.4} standard errors");
        assert!(off.abs() < 0.1, "{name}: {} and {}", a.value, b.value);
    }
    assert_eq!(simplex.stop, "the simplex stopped");
    assert!(!simplex.notes.iter().any(|n| n.contains("not shrunk")), "{:?}", simplex.notes);
}

/// A joint under gravity, both as something that is known to be there and as something that is looked for.
#[test]
#[ignore = "long: ./test --full runs it"]
fn effects_are_fitted_where_they_are_known_and_where_they_are_asked_for() {
    const GRAVITY: [(&str, f64); 2] = [("gravityTorque", 2.4), ("gravityAngle", -0.3)];
    let structure = PlantStructure {
        model: "TwoMassJoint".into(),
        flexible: vec![true],
        effects: vec!["gravity-torque".into()],
        ..PlantStructure::default()
    };
    let model = SimulatedPlant::new(structure).unwrap();
    let mut q = model.defaults();
    JOINT.iter().chain(&GRAVITY).for_each(|(name, v)| q[model.parameter(name).unwrap()] = *v);
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a.csv", &joint_csv(&model, &q, 3));
    write("b.csv", &joint_csv(&model, &q, 4));
    let plain: String = JOINT.iter().map(|(name, v)| format!("{name} = {v}\n")).collect();
    let case = |more: &str| {
        let sensors = "[channels.motorAngle]\nresolution = 1.5e-3\nnoise = 4e-4\n[channels.motorCurrent]\nnoise = 1e-3\n\
                       [channels.loadAngle]\nnoise = 1e-5\ndelay = 4e-3\noffset = \"estimate\"\n";
        write(
            "case.toml",
            &format!(
                "model = \"TwoMassJoint\"\ntrain = [\"a.csv\"]\nholdout = [\"b.csv\"]\n[parameters]\n{plain}{more}{sensors}"
            ),
        );
    };
    case("[effects]\ngravity-torque = { gravityTorque = 2.0, gravityAngle = 0.0, doubt = 0.5 }\n");
    let known = identified(folder.path(), IdentifyMethod::OutputError);
    case("[fit]\neffects = [\"gravity-torque\"]\n");
    let asked = {
        let with = ["gravity-torque"];
        let of = |c: &Case| Ok(SimulatedPlant::of_case(c, &with).unwrap().variables());
        let (loaded, _) = Case::load(folder.path(), of).unwrap();
        let settings = IdentifySettings {
            method: IdentifyMethod::OutputError,
            profile: false,
            design: None,
            progress: &|_| (),
        };
        identify(&loaded, &settings).unwrap()
    };
    for r in [&known, &asked] {
        right(r, "gravityTorque", 2.4, 0.05);
        right(r, "gravityAngle", -0.3, 0.05);
        right(r, "stiffness", 0.084, 0.05);
        assert!(r.fit.iter().all(|f| f.nrmse.unwrap() < 0.01), "{:?}", r.fit);
    }
    // What is known is fitted with its prior, what is requested is among the parameters, with what it gains.
    assert!(known.without.is_empty() && known.uncertain.iter().any(|f| f.doubt == Some(0.5)));
    assert!(asked.parameters.iter().any(|f| f.estimate.name == "gravityTorque"));
    let worst = |list: &[FitFigure]| list.iter().map(|f| f.nrmse.unwrap()).fold(0.0, f64::max);
    assert!(worst(&asked.without) > 10.0 * worst(&asked.fit), "{:?} {:?}", asked.without, asked.fit);
}

#[test]
fn a_known_effect_that_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (more, said) in [
        ("[effects]\ngravity-torque = { gravityAngle = 0.0 }\n", "its size is not given"),
        ("[effects]\njoint-flexibility = { stiffness = 1.0 }\n", "jointFlexible"),
        ("[effects]\ngravity-torque = { gravityTorque = 1.0, joint = 2 }\n", "it occurs once"),
        (
            "[effects]\ngravity-torque = { gravityTorqu = 1.0 }\n",
            "gravityTorqu is no parameter of this effect, which has gravityTorque",
        ),
        ("[effects]\nbase-drag = { linearDrag = 1.0 }\n", "PlanarManipulator"),
    ] {
        let more = more.replace("stiffness = 1.0", "backlashWidth = 1.0");
        let text = format!("model = \"TwoMassJoint\"\ntrain = [\"a.csv\"]\nholdout = [\"b.csv\"]\n{more}");
        std::fs::write(folder.path().join("case.toml"), text).unwrap();
        let (read, _) = Case::read(folder.path(), &[]).unwrap();
        let told = SimulatedPlant::of_case(&read, &[]).unwrap_err().to_string();
        assert!(told.contains(said), "{more}: {told}");
    }
}

#[test]
fn gravity_wants_a_base_that_is_fixed() {
    let of = |base: &str| {
        let text = format!(
            "model = \"PlanarManipulator\"\ntrain = [\"a.csv\"]\n[parameters]\n{base}gravity = [0.0, -9.81]\n"
        );
        let (case, _) = Case::parse(Path::new("case.toml"), &text, &[]).unwrap();
        SimulatedPlant::of_case(&case, &[]).map(|m| m.structure().fixed_base)
    };
    assert_eq!(of("base = \"fixed\"\n"), Ok(true));
    let told = of("").unwrap_err().to_string();
    assert!(told.contains("gravity[2]") && told.contains("base = \"fixed\""), "{told}");
}

/// The same of an effect, known or requested; on a fixed base it has a size and a standard deviation at the joint that is named, and is what
/// an FMU with it has elsewhere.
#[test]
fn a_gravity_torque_of_an_arm_wants_a_base_that_is_fixed() {
    let of = |base: &str, known: &str, with: &[&str]| {
        let text = format!("model = \"PlanarManipulator\"\ntrain = [\"a.csv\"]\n[parameters]\n{base}{known}");
        let (case, _) = Case::parse(Path::new("case.toml"), &text, &[]).unwrap();
        SimulatedPlant::of_case(&case, with)
            .map(|m| (m.set(&m.defaults(), &case.parameters).unwrap(), m, case))
    };
    let known = "[effects]\ngravity-torque = { gravityTorque = 110.0, doubt = 0.1, joint = 2 }\n";
    for (known, with) in [(known, &[][..]), ("", &["gravity-torque"][..])] {
        let told = of("", known, with).unwrap_err().to_string();
        assert!(told.contains("requires a fixed base") && told.contains("base = \"fixed\""), "{told}");
    }
    let (values, model, case) = of("base = \"fixed\"\n", known, &[]).unwrap();
    let value = |name: &str| values[model.parameter(name).unwrap()];
    let torques = [1, 2, 3].map(|j| value(&format!("gravityTorque[{j}]")));
    assert_eq!((torques, value("gravityAngle[2]")), ([0.0, 110.0, 0.0], -std::f64::consts::FRAC_PI_2));
    assert_eq!((case.doubt("gravityTorque[2]"), case.doubt("gravityAngle[2]")), (Some(0.1), None));
    let told = of("base = \"fixed\"\n", &known.replace("joint = 2", "joint = 4"), &[]).unwrap_err();
    assert!(told.to_string().contains("there is no joint 4; the model has 3"), "{told}");
}
