//! docs/cases.md has every key of the reader of cases, as the reader has it, and no other; its examples are cases.

#![allow(clippy::unwrap_used, clippy::panic)]

use std::path::Path;

use trueup_signals::keys::{self, Keys};
use trueup_signals::{Case, DeclaredFigures, Finding, Recording, SignalsError};

use crate::key_tables::{compare, document};

/// `TRUEUP_BLESS=1` writes the tables again.
#[test]
fn every_key_of_the_reader_is_told_and_no_other() {
    compare("cases.md", keys::ALL);
}

fn errors(result: Result<Vec<Finding>, SignalsError>) -> Vec<Finding> {
    match result {
        Ok(_) => Vec::new(),
        Err(SignalsError::Wrong(findings)) => findings.into_iter().filter(Finding::is_error).collect(),
        Err(other) => panic!("{other}"),
    }
}

/// A key that nothing reads may have any value: a date is none for any of them.
#[test]
fn every_key_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("run.csv");
    std::fs::write(&recording, "time,motorAngle\n0,0\n1,1\n").unwrap();
    let case =
        |text: &str| errors(Case::parse(Path::new("case.toml"), text, &[]).map(|(_, findings)| findings));
    let sidecar = |text: &str| {
        std::fs::write(folder.path().join("run.toml"), text).unwrap();
        errors(Recording::read(&recording, &[], &DeclaredFigures::default()).map(|(_, findings)| findings))
    };
    let base = [("model", "model = \"TwoMassJoint\"\n"), ("train", "train = [\"run.csv\"]\n")];
    for keys in keys::ALL {
        for name in keys.names().chain(["unknown"]) {
            let line = format!("{name} = 2024-01-01\n");
            let without: String =
                base.iter().filter(|(key, _)| *key != name).map(|(_, text)| *text).collect();
            let whole: String = base.iter().map(|(_, text)| *text).collect();
            let said = match keys.of {
                // Anything else is a parameter.
                "effects" if name == "unknown" => continue,
                "effects" => case(&format!("{whole}[effects.backlash]\n{line}")),
                "payload" | "a figure of payload" => {
                    let of = match keys.of {
                        "payload" => line.clone(),
                        _ => format!("mass = {{ {} }}\n", line.trim_end()),
                    };
                    case(&format!("{}[payload]\n{of}", whole.replace("TwoMassJoint", "PlanarManipulator")))
                }
                "gain, offset or delay" => {
                    case(&format!("{whole}[channels.motorAngle]\ngain = {{ {} }}\n", line.trim_end()))
                }
                "a case" => case(&format!("{line}{without}")),
                "fit" => case(&format!("{whole}[fit]\n{line}")),
                "a stretch of weight" => {
                    let rest = if name == "weight" { "end = 1.0" } else { "weight = 0.5" };
                    case(&format!("{whole}[[fit.weight]]\n{rest}\n{line}"))
                }
                "recordings" => case(&format!("{whole}[recordings]\n{line}")),
                "channels" => case(&format!("{whole}[channels.motorAngle]\n{line}")),
                "a sidecar" => sidecar(&line),
                "columns" => sidecar(&format!("[columns.motorAngle]\n{line}")),
                other => panic!("say here how a value of {other} is given"),
            };
            let of = keys.of;
            let about = said.iter().any(|f| f.what.contains(&format!("`{name}`")));
            assert!(about, "`{name}` of {of}: {said:?}");
            let unknown = said.iter().any(|f| f.what.contains(&format!("has no `{name}`")));
            assert_eq!(unknown, name == "unknown", "`{name}` of {of}: {said:?}");
        }
    }
}

/// The examples use every key, and are read without an error.
#[test]
fn the_examples_are_read_and_use_every_key() {
    let document = document("cases.md");
    let blocks: Vec<&str> =
        document.split("```toml\n").skip(1).map(|b| b.split("```").next().unwrap()).collect();
    let [case, robot, grounded, servo, arm, sidecar] = blocks[..] else {
        panic!("five cases and a sidecar, not {}", blocks.len())
    };
    let (held, findings) = Case::parse(Path::new("case.toml"), servo, &[]).unwrap();
    assert!(
        findings.is_empty() && held.known_effects() == ["current-saturation", "position-servo"],
        "{findings:?}"
    );
    assert_eq!(
        (held.number("servoProportionalGain"), held.doubt("servoProportionalGain")),
        (Some(17.8), Some(0.3))
    );
    let (pulled, findings) = Case::parse(Path::new("case.toml"), grounded, &[]).unwrap();
    assert!(findings.is_empty() && pulled.known_effects() == ["gravity-torque"], "{findings:?}");
    let torque = |joint: usize| format!("gravityTorque[{joint}]");
    assert_eq!((pulled.number(&torque(1)), pulled.doubt(&torque(1))), (Some(40.0), None));
    assert_eq!((pulled.number(&torque(2)), pulled.doubt(&torque(2))), (Some(110.0), Some(0.1)));
    let (carried, findings) = Case::parse(Path::new("case.toml"), arm, &[]).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    let doubt = |name: &str| carried.doubt(&format!("payload.{name}"));
    assert_eq!((carried.payload, carried.number("payload.centerOfMass[1]")), (Some(3), Some(0.4)));
    assert_eq!([doubt("mass"), doubt("centerOfMass[2]"), doubt("inertia")], [Some(2.0), Some(0.05), None]);
    let (described, findings) = Case::parse(Path::new("case.toml"), robot, &[]).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!((described.robot.as_deref(), described.doubt("bodyMass[2]")), (Some("arm.urdf"), Some(0.05)));
    assert_eq!(described.number("coulombFriction[2]"), Some(0.3));
    let (read, findings) = Case::parse(Path::new("case.toml"), case, &[]).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!((read.train.len(), read.channels.len(), read.repeats.len()), (2, 2, 1));
    let folder = tempfile::tempdir().unwrap();
    let table = "time,Encoder A,Tacho,Current,Temperature\n0,0,60,1,20\n1,1000,60,2,20\n";
    std::fs::write(folder.path().join("run.csv"), table).unwrap();
    std::fs::write(folder.path().join("run.toml"), sidecar).unwrap();
    let declared =
        DeclaredFigures { channels: read.channels.clone(), rate: read.rate, ..DeclaredFigures::default() };
    let (recording, _) = Recording::read(&folder.path().join("run.csv"), &[], &declared).unwrap();
    let last = |name: &str| recording.channels.iter().find(|c| c.name == name).unwrap().values[1];
    assert_eq!(recording.channels.len(), 3);
    assert!((last("motorAngle") - 1.7339808).abs() < 1e-9 && (last("motorCurrent") - 2.0).abs() < 1e-12);
    assert!((last("motorVelocity") - std::f64::consts::TAU).abs() < 1e-9, "60 rpm is a turn a second");
    let all = format!("{case}{robot}{arm}{grounded}{sidecar}");
    for key in keys::ALL.iter().flat_map(Keys::names) {
        assert!(all.contains(key), "`{key}` is in no example");
    }
}
