//! Example cases and a real drive, from the folder that TRUEUP_DATA names; skipped aloud without it.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use trueup_diagnosis::diagnose::{DiagnoseOptions, diagnose};
use trueup_diagnosis::locate::{JointColumns, joint_intervals, joint_unknown_inputs};
use trueup_diagnosis::outcome::Verdict;
use trueup_models::joint::parameter as j;
use trueup_signals::process::ChannelGrid;
use trueup_signals::{Case, DeclaredFigures, Recording};

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("TRUEUP_DATA").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("SKIPPED: TRUEUP_DATA does not name the folder with example cases and real data");
    }
    folder
}

/// Median.
fn middle(mut x: Vec<f64>) -> f64 {
    x.sort_by(f64::total_cmp);
    x[x.len() / 2]
}

fn parameters(case: &Case) -> Vec<f64> {
    let names = [
        "motorInertia",
        "loadInertia",
        "gearRatio",
        "torqueConstant",
        "stiffness",
        "damping",
        "coulombFriction",
        "staticFriction",
        "viscousFriction",
    ];
    let mut p: Vec<f64> = names.iter().map(|n| case.number(n).unwrap()).collect();
    p.resize(j::COUNT, 0.0);
    p
}

#[test]
fn the_example_cases_are_missing_something_where_their_keys_state() {
    let Some(folder) = data() else { return };
    for (name, place) in [
        ("backlash", "transmission"),
        ("gravity-torque", "load"),
        ("stribeck-friction", "motor"),
        ("none", ""),
    ] {
        let (loaded, _) = Case::load(&folder.join("example-cases").join(name), |_| Ok(Vec::new())).unwrap();
        let p = parameters(&loaded.case);
        let mut gains: BTreeMap<String, f64> = BTreeMap::new();
        for run in loaded.train() {
            let step = run.channel("motorAngle").unwrap().median_step().unwrap();
            let grid = ChannelGrid::of(run, &["motorCurrent", "motorAngle", "loadAngle"], step).unwrap();
            let floor = |c: &str| run.channel(c).unwrap().sensor.deviation().unwrap();
            let columns = JointColumns {
                step,
                current: &grid.columns[0],
                hold: true,
                external: &[],
                motor: &grid.columns[1],
                load: &grid.columns[2],
                current_floor: floor("motorCurrent"),
                motor_floor: floor("motorAngle"),
                load_floor: floor("loadAngle"),
            };
            for e in joint_unknown_inputs(&p, true, &columns) {
                println!(
                    "{name} {}: {} gain {:.0}, explained {:.2}, white {:.3}",
                    run.name, e.place, e.gain, e.explained, e.whiteness
                );
                *gains.entry(e.place).or_default() += e.gain;
            }
        }
        let best = gains.iter().max_by(|a, b| a.1.total_cmp(b.1)).unwrap();
        println!("{name}: {gains:.0?}");
        match place {
            "" => assert!(*best.1 < 20.0, "{gains:?}"),
            place => assert_eq!(best.0, place, "{name}"),
        }
    }
}

/// What `key.toml` of an example case contains as a list or a text.
fn reported(key: &str, name: &str) -> Vec<String> {
    let line = key.lines().find_map(|l| l.strip_prefix(name)?.trim_start().strip_prefix('=')).unwrap();
    line.split('"').skip(1).step_by(2).map(str::to_owned).collect()
}

#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn the_example_cases_are_diagnosed_as_their_keys_state() {
    let Some(folder) = data() else { return };
    for name in ["backlash", "gravity-torque", "stribeck-friction", "none"] {
        let case = folder.join("example-cases").join(name);
        let key = std::fs::read_to_string(case.join("key.toml")).unwrap();
        let (loaded, _) = Case::load(&case, |_| Ok(Vec::new())).unwrap();
        let d = diagnose(&loaded, &DiagnoseOptions::default(), &mut |_, _| {}).unwrap().diagnosis;
        let gap = d.gap.overall.as_ref().unwrap();
        let probability = d.effects.first().map(|e| e.probability);
        println!(
            "{name}: {:?}, probability {probability:.3?}, gap before {:.4}, tuned {:.4}, after {:.4}, floor {:.4}",
            d.verdict, gap.before, gap.tuned, gap.after, gap.floor
        );
        assert_eq!(serde_json::to_value(d.verdict).unwrap(), reported(&key, "verdict")[0], "{name}");
        let named: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
        assert_eq!(named, reported(&key, "effects"), "{name}");
        let components: Vec<&str> = d.effects.iter().map(|e| e.component.as_str()).collect();
        assert_eq!(components, reported(&key, "components"), "{name}");
    }
}

/// Columns of a recording of EMPS, the first being the time in s.
fn emps<const N: usize>(folder: &Path, file: &str, names: [&str; N]) -> (Vec<f64>, [Vec<f64>; N]) {
    // With names of its own next to it.
    let own = tempfile::tempdir().unwrap();
    let copy = own.path().join("emps.mat");
    std::fs::copy(folder.join("real/emps").join(file), &copy).unwrap();
    std::fs::write(own.path().join("emps.mat.toml"), "[columns]\n\"t\" = \"time\"\n").unwrap();
    let (run, _) = Recording::read(&copy, &[], &DeclaredFigures::default()).unwrap();
    let all = |name: &str| run.channel(name).unwrap().values.clone();
    (run.channel("qm").unwrap().time.clone(), names.map(all))
}

/// EMPS with pulses: time (s), pulses (V), position (m), input (V).
fn pulses_run(folder: &Path) -> [Vec<f64>; 4] {
    let (time, [pulses, position, input]) = emps(folder, "DATA_EMPS_PULSES.mat", ["pulses_N", "qm", "vir"]);
    [time, pulses, position, input]
}

/// EMPS as a case: a rigid joint that its force (N) drives, the first half for fitting, the rest held out.
fn emps_case(case: &Path, time: &[f64], force: &[f64], position: &[f64]) {
    use std::fmt::Write as _;
    std::fs::create_dir(case).unwrap();
    let half = time.len() / 2;
    for (name, range) in [("first.csv", 0..half), ("second.csv", half..time.len())] {
        let mut csv = "time,motorCurrent,motorAngle\n".to_owned();
        for k in range {
            writeln!(csv, "{:?},{:?},{:?}", time[k], force[k], position[k]).unwrap();
        }
        std::fs::write(case.join(name), csv).unwrap();
    }
    let toml = "model = \"TwoMassJoint\"\ntrain = [\"first.csv\"]\nholdout = [\"second.csv\"]\n[parameters]\njointFlexible = false\n\
                gearRatio = 1\ntorqueConstant = 1\nmotorInertia = 95.1089\nloadInertia = 1e-6\ncoulombFriction = 20.3935\n\
                staticFriction = 20.3935\nviscousFriction = 203.5034\n[channels.motorAngle]\nnoise = 1e-6\n\
                [channels.motorCurrent]\nnoise = 1.7\ninterpolation = \"hold\"\n";
    std::fs::write(case.join("case.toml"), toml).unwrap();
}

/// EMPS (A. Janot et al., 2019): a drive with rectangular pulses added to its input, which are withheld here.
#[test]
fn withheld_pulses_of_a_real_drive_are_found_at_its_motor_to_the_millisecond() {
    let Some(folder) = data() else { return };
    let [time, pulses, motor, volts] = pulses_run(&folder);
    let current: Vec<f64> = volts.iter().zip(&pulses).map(|(v, p)| v - p).collect();
    let mut p = vec![0.0; j::COUNT];
    // As published, without the offset.
    (p[j::MOTOR_INERTIA], p[j::GEAR_RATIO], p[j::TORQUE_CONSTANT]) = (95.1089, 1.0, 35.150_65);
    (p[j::VISCOUS_FRICTION], p[j::COULOMB_FRICTION], p[j::STATIC_FRICTION]) = (203.5034, 20.3935, 20.3935);
    let columns = JointColumns {
        step: 1e-3,
        current: &current,
        hold: true,
        external: &[],
        motor: &motor,
        load: &[],
        current_floor: 0.0,
        motor_floor: 1e-6,
        load_floor: 0.0,
    };
    let found = joint_unknown_inputs(&p, false, &columns);
    for e in &found {
        println!("{}: gain {:.0}, explained {:.3}", e.place, e.gain, e.explained);
    }
    assert_ne!(found[0].place, "sensor:motorAngle");
    let motor = found.iter().find(|e| e.place == "motor").unwrap();
    let mut reported: Vec<f64> = joint_intervals(&p, false, &columns, motor, "pulses", time[0], 0.05)
        .iter()
        .flat_map(|i| [i.start, i.end])
        .collect();
    reported.sort_by(f64::total_cmp);
    let edges: Vec<f64> =
        (1..pulses.len()).filter(|k| pulses[*k] != pulses[k - 1]).map(|k| time[k]).collect();
    let near = |e: &f64| reported.iter().map(|t| (t - e).abs()).fold(f64::INFINITY, f64::min);
    let errors: Vec<f64> = edges.iter().map(near).collect();
    let hits = errors.iter().filter(|e| **e <= 5e-3).count();
    println!(
        "{} edges, {} reported, {hits} within 5 ms, median {:.4} s",
        edges.len(),
        reported.len(),
        middle(errors.clone())
    );
    println!("{:.3?}", errors);
    assert!(hits as f64 >= 0.95 * edges.len() as f64 && reported.len() <= edges.len() + 2);
}

/// The same drive by the whole diagnosis: of the second run the first half is for fitting, the rest is held out.
#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn a_diagnosis_of_a_real_drive_with_withheld_pulses() {
    let Some(folder) = data() else { return };
    let own = tempfile::tempdir().unwrap();
    let [time, pulses, motor, volts] = pulses_run(&folder);
    let half = time.len() / 2;
    let case = own.path().join("case");
    // Newtons without the pulses; the drive's constant offset is published and taken out.
    let force: Vec<f64> = volts.iter().zip(&pulses).map(|(v, p)| (v - p) * 35.150_65 + 3.1648).collect();
    emps_case(&case, &time, &force, &motor);
    let (loaded, _) = Case::load(&case, |_| Ok(Vec::new())).unwrap();
    let found = diagnose(&loaded, &DiagnoseOptions::default(), &mut |_, _| {}).unwrap();
    let d = &found.diagnosis;
    println!("{:?}: {:?}", d.verdict, d.effects.iter().map(|e| (&e.id, &e.component)).collect::<Vec<_>>());
    println!("places by the balances: {:?}", found.picture.as_ref().map(|p| &p.places));
    println!("gap {:?}", d.gap.overall);
    let reported: Vec<f64> = d.location.intervals.iter().flat_map(|i| [i.start, i.end]).collect();
    let edges: Vec<f64> = (1..half).filter(|k| pulses[*k] != pulses[k - 1]).map(|k| time[k]).collect();
    let near = |e: &f64| reported.iter().map(|t| (t - e).abs()).fold(f64::INFINITY, f64::min);
    let hits = edges.iter().filter(|e| near(e) <= 5e-3).count();
    println!("{} edges, {} reported, {hits} within 5 ms", edges.len(), reported.len());
    // A push at the actuator, or something there that has no name.
    let named = d.effects.first().is_some_and(|e| e.id == "external-force" && e.component == "actuator");
    let there = d.location.components.first().is_some_and(|c| c.id == "actuator");
    assert!(named || d.verdict == Verdict::Unknown && there, "{:?} {:?}", d.verdict, d.location.components);
    assert!(hits as f64 >= 0.95 * edges.len() as f64);
}

/// The same drive without pulses: its published model, less the offset, brakes alike in both directions, and it does not.
#[test]
#[ignore = "whole diagnosis: ./test --full"]
fn the_offset_and_asymmetry_of_a_real_drive_are_named() {
    let Some(folder) = data() else { return };
    let own = tempfile::tempdir().unwrap();
    let (time, [motor, volts]) = emps(&folder, "DATA_EMPS.mat", ["qm", "vir"]);
    let force: Vec<f64> = volts.iter().map(|v| v * 35.150_65).collect();
    let case = own.path().join("case");
    emps_case(&case, &time, &force, &motor);
    let (loaded, _) = Case::load(&case, |_| Ok(Vec::new())).unwrap();
    let d = diagnose(&loaded, &DiagnoseOptions::default(), &mut |_, _| {}).unwrap().diagnosis;
    println!("{:?}: {:?}", d.verdict, d.effects);
    println!("gap {:?}", d.gap.overall);
    let named: Vec<&str> = d.effects.iter().map(|e| e.id.as_str()).collect();
    assert_eq!((d.verdict, &named[..]), (Verdict::Effects, &["asymmetric-friction"][..]));
    let gap = d.gap.overall.unwrap();
    assert!(gap.after < 0.2 * gap.tuned, "{gap:?}");
}
