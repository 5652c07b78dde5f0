//! The gallery: plants of this build at work, drawn and moving, each with one chart.

use std::path::Path;

use super::loops::{DemoRun, column, run};
use crate::args::Pack;
use crate::error::CliError;
use trueup_report::{Chart, Page};

/// One of its pictures.
struct Exhibit {
    /// Of its files: the TOML and the inputs.
    name: &'static str,
    title: &'static str,
    text: &'static str,
    toml: &'static str,
    inputs: Option<&'static str>,
    /// Title, unit, columns with their labels.
    chart: (&'static str, &'static str, &'static [(&'static str, &'static str)]),
}

const EXHIBITS: [Exhibit; 5] = [
    Exhibit {
        name: "pulses",
        title: "TwoMassJoint: break-away, sliding, sticking",
        text: "DELIAN's joint 1, current pulses of 18 and -17 mA, no load torque. Friction holds the motor up to the static level, drops to the Coulomb level when it breaks away, and turns with \
               the motion; the joint coasts to a stop and sticks again.",
        toml: r#"# Current pulses on a joint with stick-slip friction.
inputs = "pulses.csv"

[run]
stop = 2
step = 1e-3

[components.joint]
fmu = "TwoMassJoint.fmi3.fmu"
"#,
        inputs: Some(
            "time,joint.motorCurrent\n0,0\n0.1,0\n0.101,0.018\n0.25,0.018\n0.251,0\n0.9,0\n0.901,-0.017\n1,-0.017\n1.001,0\n2,0\n",
        ),
        chart: (
            "Torques at the motor",
            "N.m",
            &[
                ("joint.motorTorque", "motor"),
                ("joint.frictionTorque", "friction"),
                ("joint.transmissionTorque", "transmission"),
            ],
        ),
    },
    Exhibit {
        name: "floating",
        title: "PlanarManipulator: nothing holds the base",
        text: "The CBK PAN test-bed, joint 1 flexible, the other two rigid and free to turn, no friction and no force from outside. The motor of joint 1 is driven out and back; the satellite turns \
               against it.",
        toml: r#"# The motor of joint 1 of a free-floating arm is driven out and back.
inputs = "floating.csv"

[run]
stop = 10
step = 1e-2

[components.arm]
fmu = "PlanarManipulator.fmi3.fmu"
"#,
        inputs: Some(
            "time,arm.jointTorque[1]\n0,0\n0.49,0\n0.5,0.2\n1.99,0.2\n2,-0.2\n3.49,-0.2\n3.5,0\n10,0\n",
        ),
        chart: (
            "Angles",
            "rad",
            &[
                ("arm.jointAngle[1]", "joint 1"),
                ("arm.motorAngle[1]", "its motor"),
                ("arm.baseAttitude", "satellite"),
            ],
        ),
    },
    Exhibit {
        name: "panels",
        title: "SpatialFreeFlyer: a satellite whose panels bend",
        text: "The satellite of paper S1 with two panels: its arm turns one way and back, and the panels go on swinging.",
        toml: r#"# An arm on a satellite with flexible panels turns out and back.
inputs = "panels.csv"

[run]
stop = 12
step = 2e-2

[components.satellite]
fmu = "panels/SpatialFreeFlyer.fmi3.fmu"
"#,
        inputs: Some(
            "time,satellite.jointTorque[1],satellite.jointTorque[2],satellite.jointTorque[3]\n0,0.6,-0.3,0.15\n2.99,0.6,-0.3,0.15\n3,-0.6,0.3,-0.15\n5.99,-0.6,0.3,-0.15\n6,0,0,0\n12,0,0,0\n",
        ),
        chart: (
            "Modal coordinates: what each shape moves the panels' tips",
            "m",
            &[
                ("satellite.modalCoordinate[1]", "eta 1"),
                ("satellite.modalCoordinate[2]", "eta 2"),
                ("satellite.modalCoordinate[3]", "eta 3"),
                ("satellite.modalCoordinate[4]", "eta 4"),
            ],
        ),
    },
    Exhibit {
        name: "delian",
        title: "FlexibleArm and ManipulatorController: DELIAN to its references",
        text: "ESA's DELIAN arm on the ground under its weight, six flexible joints with stick-slip, links that bend; velocity waves with a washout, one controller per joint.",
        toml: r#"# DELIAN with velocity waves: six joints to their references.
connections = [
    "controller.jointTorque -> arm.jointTorque",
    "arm.motorAngle -> controller.motorAngle",
    "arm.motorVelocity -> controller.motorVelocity",
    "arm.jointAngle -> controller.jointAngle",
    "arm.jointVelocity -> controller.jointVelocity",
]

[run]
stop = 4
step = 4e-3

[components.arm]
fmu = "delian/FlexibleArm.fmi3.fmu"

[components.controller]
fmu = "delian/ManipulatorController.fmi3.fmu"

[components.controller.start]
strategy = "VWBC_WASHOUT"
waveFrequency = [20, 20, 20, 20, 20, 20]
washoutFrequency = [1, 1, 1, 1, 1, 1]
positionReference = [0.8, 0.9, -0.7, 0.4, 0.5, 0.3]
positionGain = [2, 2, 2, 2, 2, 2]
velocityGain = [14155, 3406, 4500, 4500, 4500, 4500]
velocityIntegralTime = [0.1, 0.1, 0.1, 0.1, 0.1, 0.1]
torqueLimit = [1e5, 1e5, 1e5, 1e5, 1e5, 1e5]
"#,
        inputs: None,
        chart: (
            "The tip against that of the rigid arm at the same motor angles",
            "m",
            &[("arm.tipDeflection[1]", "x"), ("arm.tipDeflection[2]", "y"), ("arm.tipDeflection[3]", "z")],
        ),
    },
    Exhibit {
        name: "capture",
        title: "CaptureScene: three balls close about a port",
        text: "SIM2 of paper S2: a chaser approaches a target of eight tonnes, its jaws close about the docking port.",
        toml: r#"# A capture by a gripper of three balls.
[run]
stop = 30

[components.scene]
fmu = "CaptureScene.fmi3.fmu"
"#,
        inputs: None,
        chart: (
            "Normal forces on the balls",
            "N",
            &[
                ("scene.contactForce[1]", "P1"),
                ("scene.contactForce[2]", "P2"),
                ("scene.contactForce[3]", "P3"),
            ],
        ),
    },
];

/// Packs what is not a default FMU, runs the systems, and draws them.
pub(super) fn draw(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    let pack = |model: &str, below: &str, more: Pack| {
        crate::command::pack::run(&Pack {
            model: vec![model.to_owned()],
            output: folder.join(below),
            fmi: Some(3),
            ..more
        })
    };
    let preset = Some("table-1-with-panels".to_owned());
    pack("SpatialFreeFlyer", "panels", Pack { preset, ..Pack::default() })?;
    let structure = vec!["drive=torque".to_owned(), "solver=fixed".to_owned()];
    pack("FlexibleArm", "delian", Pack { structure, ..Pack::default() })?;
    let preset = Some("delian".to_owned());
    pack("ManipulatorController", "delian", Pack { preset, ..Pack::default() })?;
    for exhibit in &EXHIBITS {
        let DemoRun { results, plants } = run(folder, exhibit.name, exhibit.toml, exhibit.inputs, &[])?;
        page.section(exhibit.title, exhibit.text);
        crate::moving::onto(page, &plants, &results);
        let (title, unit, columns) = exhibit.chart;
        let chart = Chart::over_time(title, unit);
        let lines = columns.iter();
        page.chart(
            &lines.fold(chart, |c, (name, label)| c.line(label, results.time(), column(&results, name))),
        );
    }
    Ok(())
}
