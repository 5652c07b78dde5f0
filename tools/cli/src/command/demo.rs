//! `trueup demo`: packs the FMUs, lets the master run systems of them, draws what they did; before that it
//! identifies and diagnoses a case whose cause is sealed, and opens the seal.

mod loops;
mod metric;
mod story;
mod waves;

use std::path::Path;

use crate::args::{Demo, Pack};
use crate::error::CliError;
use loops::{column, run};
use trueup_cosim::SeriesMemory;
use trueup_report::{Chart, Page};

pub(crate) fn demo(args: &Demo) -> Result<(), CliError> {
    let folder = &args.output;
    crate::output::folder(folder)?;
    eprintln!("[1/8] packing all models for FMI 2.0 and 3.0");
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
        "Trueup: a gap explained, and the FMUs of this build at work",
        "First a simulation that does not match its recordings, and the missing effect. Then the models: every curve below was made by packed FMUs that the master ran, as it runs FMUs of other vendors. The systems are next to this \
         page as TOML: trueup simulate runs them again.",
    );
    story::tell(folder, &mut page)?;
    eprintln!("[5/8] TwoMassJoint: current pulses on a joint with stick-slip friction");
    joint(folder, &mut page)?;
    eprintln!("[6/8] PlanarManipulator: a free-floating arm moves its base");
    arm(folder, &mut page)?;
    eprintln!("[7/8] JointController and TwoMassJoint: P/PI against wave-based control");
    waves::draw(folder, &mut page)?;
    eprintln!("[8/8] ManipulatorController and PlanarManipulator: three joints to their references");
    arm_control(folder, &mut page)?;

    let path = folder.join("index.html");
    trueup_fmi_description::pack::write_file(&path, page.finish().as_bytes())
        .map_err(|e| CliError::Failed(e.to_string()))?;
    crate::output::say(&format!("{}\n", path.display()))
}

fn picture(page: &mut Page, r: &SeriesMemory, title: &str, unit: &str, names: &[(&str, &str)]) {
    let chart = Chart::over_time(title, unit);
    page.chart(&names.iter().fold(chart, |c, (name, label)| c.line(label, r.time(), column(r, name))));
}

/// Of joint 1 of the arm, the flexible one; its motor's angle is joint-referred.
fn twist(page: &mut Page, r: &SeriesMemory) {
    let both = column(r, "arm.motorAngle[1]").iter().zip(column(r, "arm.jointAngle[1]"));
    let twist: Vec<f64> = both.map(|(motor, joint)| motor - joint).collect();
    let chart = Chart::over_time("Twist of joint 1, the flexible one (motor angle - joint angle)", "rad");
    page.chart(&chart.line("twist", r.time(), &twist));
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

fn joint(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    let r = run(folder, "pulses", JOINT, Some(PULSES), &[])?;
    page.section(
        "TwoMassJoint: break-away, sliding, sticking",
        "DELIAN's joint 1, current pulses of 18 and -17 mA, no load torque. Friction holds the motor up to the static level, drops to the Coulomb level when it \
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

fn arm(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    let r = run(folder, "floating", ARM, Some(TORQUE), &[])?;
    page.section(
        "PlanarManipulator: nothing holds the base",
        "The CBK PAN test-bed, joint 1 flexible, the other two rigid and free to turn, no friction and no force from outside. The \
         motor of joint 1 is driven out and back; the satellite turns against it, and the angular momentum of the whole stays \
         where it was, as far as the step allows.",
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
    twist(page, &r);
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

fn arm_control(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    let r = run(folder, "arm-control", ARM_CONTROL, None, &[])?;
    page.section(
        "ManipulatorController: three joints at once",
        "Velocity waves on the free-floating arm without friction, each joint by its own controller: the joints go to 0.4, -0.3 and \
         0.2 rad while the satellite drifts.",
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
    twist(page, &r);
    Ok(())
}
