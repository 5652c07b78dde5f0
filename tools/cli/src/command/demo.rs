//! `trueup demo`: packs the FMUs, runs one of each, draws what they did.

mod loops;
mod metric;

use std::path::{Path, PathBuf};

use crate::args::{Demo, Pack};
use crate::error::Error;
use loops::{Recording, Wire, run};
use trueup_report::{Chart, Page};

pub(crate) fn demo(args: &Demo) -> Result<(), Error> {
    let folder = &args.output;
    crate::output::folder(folder)?;
    eprintln!("[1/5] packing the four models for FMI 2.0 and 3.0");
    let pack = |models: &[&str], effects: &[&str]| {
        super::pack::run(&Pack {
            model: models.iter().map(|m| (*m).to_owned()).collect(),
            output: folder.clone(),
            effect: effects.iter().map(|e| (*e).to_owned()).collect(),
            ..Pack::default()
        })
    };
    pack(&[], &[])?;
    pack(&["TwoMassJoint"], &["flexible-link"])?;

    let mut page = Page::new(
        "Trueup: the FMUs of this build at work",
        "Every curve below was made by a packed FMU, loaded through the FMI functions as any tool would.",
    );
    eprintln!("[2/5] TwoMassJoint: current pulses on a joint with stick-slip friction");
    joint(folder, &mut page)?;
    eprintln!("[3/5] PlanarManipulator: a free-floating arm moves its base");
    arm(folder, &mut page)?;
    eprintln!("[4/5] JointController and TwoMassJoint: P/PI against wave-based control");
    wave_based(folder, &mut page)?;
    eprintln!("[5/5] ManipulatorController and PlanarManipulator: three joints to their references");
    arm_control(folder, &mut page)?;

    let path = folder.join("index.html");
    trueup_fmi_description::pack::write_file(&path, page.finish().as_bytes())
        .map_err(|e| Error::Failed(e.to_string()))?;
    crate::output::say(&format!("{}\n", path.display()))
}

fn fmu(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.fmi2.fmu"))
}

fn picture(page: &mut Page, r: &Recording, title: &str, unit: &str, names: &[(&str, &str)]) {
    let columns: Vec<_> = names.iter().map(|(name, label)| (r.column(name), *label)).collect();
    let chart = columns.iter().fold(Chart::over_time(title, unit), |c, (y, label)| c.line(label, &r.t, y));
    page.chart(&chart);
}

fn joint(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let pulses = |t: f64| match t {
        t if t < 0.1 => 0.0,
        t if t < 0.25 => 0.018,
        t if t < 0.9 => 0.0,
        t if t < 1.0 => -0.017,
        _ => 0.0,
    };
    let watched = ["motorVelocity", "loadAngle", "frictionTorque", "motorTorque", "transmissionTorque"];
    let r = run(&[&fmu(folder, "TwoMassJoint")], &[], 2.0, 1e-3, &watched, |t, set| {
        set(0, "motorCurrent", pulses(t));
    })?;
    page.section(
        "TwoMassJoint: break-away, sliding, sticking",
        "DELIAN's joint 1. Friction holds the motor up to the static level, drops to the Coulomb level when it \
         breaks away, and turns with the motion; the joint coasts to a stop and sticks again.",
    );
    picture(page, &r, "Motor velocity", "rad/s", &[("motorVelocity", "motor")]);
    picture(
        page,
        &r,
        "Torques at the motor",
        "N.m",
        &[("motorTorque", "motor"), ("frictionTorque", "friction"), ("transmissionTorque", "transmission")],
    );
    picture(page, &r, "Load angle", "rad", &[("loadAngle", "load")]);
    Ok(())
}

fn arm(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let torque = |t: f64| match t {
        t if t < 0.5 => 0.0,
        t if t < 2.0 => 0.2,
        t if t < 3.5 => -0.2,
        _ => 0.0,
    };
    let watched = [
        "jointAngle[1]",
        "motorAngle[1]",
        "baseAttitude",
        "angularMomentum",
        "kineticEnergy",
        "potentialEnergy",
    ];
    let r = run(&[&fmu(folder, "PlanarManipulator")], &[], 10.0, 1e-2, &watched, |t, set| {
        set(0, "jointTorque[1]", torque(t));
    })?;
    page.section(
        "PlanarManipulator: nothing holds the base",
        "The CBK PAN test-bed, joint 1 flexible. Its motor is driven out and back; the satellite turns against it, \
         and the angular momentum of the whole stays where it was.",
    );
    picture(
        page,
        &r,
        "Angles",
        "rad",
        &[("jointAngle[1]", "joint 1"), ("motorAngle[1]", "its motor"), ("baseAttitude", "satellite")],
    );
    picture(page, &r, "Energies", "J", &[("kineticEnergy", "kinetic"), ("potentialEnergy", "in the spring")]);
    let drift = r.column("angularMomentum").iter().fold(0.0f64, |m, v| m.max(v.abs()));
    page.text(&format!("Largest angular momentum over the run: {drift:.1e} kg m²/s."));
    Ok(())
}

/// The reference plant: joint 2 with a flexible link, no friction but the viscous one, a unit step.
const PLANT: &[(&str, f64)] = &[
    ("gearRatio", 21750.0),
    ("loadInertia", 0.5),
    ("stiffness", 2.2e-5),
    ("damping", 3.18e-8),
    ("coulombFriction", 0.0),
    ("staticFriction", 0.0),
    ("viscousFriction", 2.5e-8),
    ("tipInertia", 6.0),
    ("linkStiffness", 1555.0),
    ("linkDamping", 0.965_919_251_2),
];
/// Unit step, P/PI bandwidths of 60 and 10 rad/s, the linear case: no limit of the current.
const CONTROLLER: &[(&str, f64)] = &[
    ("gearRatio", 21750.0),
    ("torqueConstant", 0.02),
    ("positionGain", 2.5),
    ("velocityGain", 56.7675 * 60.0),
    ("velocityIntegralTime", 0.1),
    ("waveFrequency", 41.648),
    ("currentLimit", 1e6),
];

fn wave_based(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let (plant, controller) = (fmu(folder, "TwoMassJoint+flexible-link"), fmu(folder, "JointController"));
    let wires = [
        Wire { from: (0, "motorAngle"), to: (1, "motorAngle") },
        Wire { from: (0, "motorVelocity"), to: (1, "motorVelocity") },
        Wire { from: (0, "loadAngle"), to: (1, "loadAngle") },
        Wire { from: (0, "loadVelocity"), to: (1, "loadVelocity") },
        Wire { from: (1, "motorCurrent"), to: (0, "motorCurrent") },
    ];
    let strategies = [("P/PI", 1), ("WBC", 2), ("VWBC", 3), ("VWBC, washed out", 4)];
    let mut runs = Vec::new();
    for (name, number) in strategies {
        let r = run(&[&plant, &controller], &wires, 15.0, 5e-4, &["tipAngle", "motorCurrent"], |t, set| {
            if t == 0.0 {
                PLANT.iter().for_each(|(name, value)| set(0, name, *value));
                CONTROLLER.iter().for_each(|(name, value)| set(1, name, *value));
                set(1, "strategy", f64::from(number));
            }
            set(1, "positionReference", 1.0);
        })?;
        runs.push((name, r));
    }
    page.section(
        "JointController: wave-based control damps what P/PI leaves",
        "DELIAN's joint 2 with a flexible link, a unit step. Vibration: root mean square of the tip angle about \
         its moving average over one period of the first mode.",
    );
    let columns: Vec<_> = runs.iter().map(|(name, r)| (*name, r.column("tipAngle"))).collect();
    let chart = columns.iter().zip(&runs);
    let chart =
        chart.fold(Chart::over_time("Tip angle", "rad"), |c, ((name, y), (_, r))| c.line(name, &r.t, y));
    page.chart(&chart);
    let vibration: Vec<f64> = columns.iter().map(|(_, y)| metric::vibration(y, 5e-4, 2.388_158_46)).collect();
    let rows: Vec<_> = columns
        .iter()
        .zip(&vibration)
        .map(|((name, _), v)| {
            vec![
                (*name).to_owned(),
                format!("{v:.4} rad"),
                format!("{:.1} %", 100.0 * (1.0 - v / vibration[0])),
            ]
        })
        .collect();
    page.table(&["control", "vibration", "less than P/PI by"], &rows);
    Ok(())
}

fn arm_control(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let names: Vec<[String; 5]> = (1..=3)
        .map(|i| {
            ["motorAngle", "motorVelocity", "jointAngle", "jointVelocity", "jointTorque"]
                .map(|n| format!("{n}[{i}]"))
        })
        .collect();
    let wires: Vec<Wire> = names
        .iter()
        .flat_map(|n| {
            let back = n[..4].iter().map(|s| Wire { from: (0, s), to: (1, s) });
            back.chain([Wire { from: (1, &n[4]), to: (0, &n[4]) }])
        })
        .collect();
    let watched = ["jointAngle[1]", "jointAngle[2]", "jointAngle[3]", "baseAttitude"];
    let fmus = [fmu(folder, "PlanarManipulator"), fmu(folder, "ManipulatorController")];
    let r = run(&[&fmus[0], &fmus[1]], &wires, 60.0, 5e-3, &watched, |t, set| {
        if t == 0.0 {
            set(1, "strategy", 3.0);
        }
        [0.4, -0.3, 0.2]
            .iter()
            .enumerate()
            .for_each(|(i, q)| set(1, &format!("positionReference[{}]", i + 1), *q));
    })?;
    page.section(
        "ManipulatorController: three joints at once",
        "Velocity waves on the free-floating arm: the joints go to 0.4, -0.3 and 0.2 rad while the satellite drifts.",
    );
    picture(
        page,
        &r,
        "Angles",
        "rad",
        &[
            ("jointAngle[1]", "joint 1"),
            ("jointAngle[2]", "joint 2"),
            ("jointAngle[3]", "joint 3"),
            ("baseAttitude", "satellite"),
        ],
    );
    Ok(())
}
