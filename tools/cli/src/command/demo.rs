//! `trueup demo`: packs the FMUs, lets the master run systems of them, draws what they did.

mod loops;
mod metric;

use std::path::Path;

use crate::args::{Demo, Pack};
use crate::error::Error;
use loops::{column, run};
use trueup_cosim::Memory;
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
        "Every curve below was made by packed FMUs that the master ran, as it runs anybody's. The systems lie beside this \
         page as TOML: trueup simulate runs them again.",
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

fn picture(page: &mut Page, r: &Memory, title: &str, unit: &str, names: &[(&str, &str)]) {
    let chart = Chart::over_time(title, unit);
    page.chart(&names.iter().fold(chart, |c, (name, label)| c.line(label, r.time(), column(r, name))));
}

const JOINT: &str = r#"# Current pulses on a joint with stick-slip friction.
record = [
    "joint.motorVelocity", "joint.loadAngle", "joint.frictionTorque", "joint.motorTorque", "joint.transmissionTorque",
]
inputs = "pulses.csv"

[run]
stop = 2
step = 1e-3

[components.joint]
fmu = "TwoMassJoint.fmi3.fmu"
"#;
const PULSES: &str = "time,joint.motorCurrent\n0,0\n0.1,0\n0.101,0.018\n0.25,0.018\n0.251,0\n0.9,0\n0.901,-0.017\n\
                      1,-0.017\n1.001,0\n2,0\n";

fn joint(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let r = run(folder, "pulses", JOINT, Some(PULSES), &[])?;
    page.section(
        "TwoMassJoint: break-away, sliding, sticking",
        "DELIAN's joint 1. Friction holds the motor up to the static level, drops to the Coulomb level when it \
         breaks away, and turns with the motion; the joint coasts to a stop and sticks again.",
    );
    picture(page, &r, "Motor velocity", "rad/s", &[("joint.motorVelocity", "motor")]);
    picture(
        page,
        &r,
        "Torques at the motor",
        "N.m",
        &[
            ("joint.motorTorque", "motor"),
            ("joint.frictionTorque", "friction"),
            ("joint.transmissionTorque", "transmission"),
        ],
    );
    picture(page, &r, "Load angle", "rad", &[("joint.loadAngle", "load")]);
    Ok(())
}

const ARM: &str = r#"# The motor of joint 1 of a free-floating arm is driven out and back.
inputs = "floating.csv"

[run]
stop = 10
step = 1e-2

[components.arm]
fmu = "PlanarManipulator.fmi3.fmu"
"#;
const TORQUE: &str =
    "time,arm.jointTorque[1]\n0,0\n0.49,0\n0.5,0.2\n1.99,0.2\n2,-0.2\n3.49,-0.2\n3.5,0\n10,0\n";

fn arm(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let r = run(folder, "floating", ARM, Some(TORQUE), &[])?;
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
        &[
            ("arm.jointAngle[1]", "joint 1"),
            ("arm.motorAngle[1]", "its motor"),
            ("arm.baseAttitude", "satellite"),
        ],
    );
    picture(
        page,
        &r,
        "Energies",
        "J",
        &[("arm.kineticEnergy", "kinetic"), ("arm.potentialEnergy", "in the spring")],
    );
    let drift = column(&r, "arm.angularMomentum").iter().fold(0.0f64, |m, v| m.max(v.abs()));
    page.text(&format!("Largest angular momentum over the run: {drift:.1e} kg m²/s."));
    Ok(())
}

/// The reference plant: joint 2 with a flexible link, no dry friction, no limit of the current; bandwidths of P/PI of 60
/// and 10 rad/s; a unit step.
const WAVES: &str = r#"# P/PI or wave-based control of a joint with a flexible link.
connections = [
    "controller.motorCurrent -> plant.motorCurrent",
    "plant.motorAngle -> controller.motorAngle",
    "plant.motorVelocity -> controller.motorVelocity",
    "plant.loadAngle -> controller.loadAngle",
    "plant.loadVelocity -> controller.loadVelocity",
]
record = ["plant.tipAngle", "controller.motorCurrent"]

[run]
start = 0
stop = 15
step = 1e-3

[components.plant]
fmu = "TwoMassJoint+flexible-link.fmi3.fmu"

[components.plant.start]
gearRatio = 21750.0
loadInertia = 0.5
stiffness = 2.2e-5
damping = 3.18e-8
coulombFriction = 0.0
staticFriction = 0.0
viscousFriction = 2.5e-8
tipInertia = 6.0
linkStiffness = 1555.0
linkDamping = 0.9659192512

[components.controller]
fmu = "JointController.fmi3.fmu"

[components.controller.start]
strategy = "VWBC"
positionReference = 1.0
gearRatio = 21750.0
torqueConstant = 0.02
positionGain = 2.5
velocityGain = 3406.05
velocityIntegralTime = 0.1
waveFrequency = 41.648
currentLimit = 1e6
"#;

fn wave_based(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let strategies =
        [("P/PI", "P_PI"), ("WBC", "WBC"), ("VWBC", "VWBC"), ("VWBC, washed out", "VWBC_WASHOUT")];
    let one = |(_, item): &(&str, &str)| {
        run(folder, "waves", WAVES, None, &[("controller.strategy", (*item).to_owned())])
    };
    let runs = strategies.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    page.section(
        "JointController: wave-based control damps what P/PI leaves",
        "DELIAN's joint 2 with a flexible link, a unit step. Vibration: root mean square of the tip angle about \
         its moving average over one period of the first mode.",
    );
    for (title, unit, name) in
        [("Tip angle", "rad", "plant.tipAngle"), ("Motor current", "A", "controller.motorCurrent")]
    {
        let both = strategies.iter().zip(&runs);
        let chart = both.fold(Chart::over_time(title, unit), |c, ((label, _), r)| {
            c.line(label, r.time(), column(r, name))
        });
        page.chart(&chart);
    }
    let tips = runs.iter().map(|r| column(r, "plant.tipAngle"));
    let vibration: Vec<f64> = tips.map(|tip| metric::vibration(tip, 1e-3, 2.388_158_46)).collect();
    let row = |((name, _), v): (&(&str, &str), &f64)| {
        vec![(*name).to_owned(), format!("{v:.4} rad"), format!("{:.1} %", 100.0 * (1.0 - v / vibration[0]))]
    };
    let rows: Vec<_> = strategies.iter().zip(&vibration).map(row).collect();
    page.table(&["control", "vibration", "less than P/PI by"], &rows);
    Ok(())
}

const ARM_CONTROL: &str = r#"# Velocity waves on a free-floating arm: three joints to their references.
connections = [
    "controller.jointTorque -> arm.jointTorque",
    "arm.motorAngle -> controller.motorAngle",
    "arm.motorVelocity -> controller.motorVelocity",
    "arm.jointAngle -> controller.jointAngle",
    "arm.jointVelocity -> controller.jointVelocity",
]

[run]
start = 0
stop = 60
step = 5e-3

[components.arm]
fmu = "PlanarManipulator.fmi3.fmu"

[components.controller]
fmu = "ManipulatorController.fmi3.fmu"
start = { positionReference = [0.4, -0.3, 0.2], strategy = "VWBC" }
"#;

fn arm_control(folder: &Path, page: &mut Page) -> Result<(), Error> {
    let r = run(folder, "arm-control", ARM_CONTROL, None, &[])?;
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
            ("arm.jointAngle[1]", "joint 1"),
            ("arm.jointAngle[2]", "joint 2"),
            ("arm.jointAngle[3]", "joint 3"),
            ("arm.baseAttitude", "satellite"),
        ],
    );
    Ok(())
}
