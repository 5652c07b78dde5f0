//! What tests of this crate share.

use std::fs;
use std::path::PathBuf;

use trueup_signals::check::{self, Relation};
use trueup_signals::{
    Case, Finding, FindingKind, Severity, SignalVariable, SignalsError, Takes, VariableRole,
};

/// The scalar variables of a joint.
pub(crate) fn joint() -> Vec<SignalVariable> {
    let mut all = vec![
        SignalVariable::new("motorCurrent", "A", VariableRole::Input),
        SignalVariable::new("externalTorque", "N.m", VariableRole::Input),
        SignalVariable::new("motorAngle", "rad", VariableRole::Output),
        SignalVariable::new("motorVelocity", "rad/s", VariableRole::Output),
        SignalVariable::new("loadAngle", "rad", VariableRole::Output),
        SignalVariable::new("sticking", "", VariableRole::Output),
    ];
    let parameters = [
        ("motorInertia", "kg.m2"),
        ("loadInertia", "kg.m2"),
        ("gearRatio", ""),
        ("torqueConstant", "N.m/A"),
        ("stiffness", "N.m/rad"),
        ("damping", "N.m.s/rad"),
        ("coulombFriction", "N.m"),
        ("staticFriction", "N.m"),
        ("viscousFriction", "N.m.s/rad"),
        ("initialMotorAngle", "rad"),
    ];
    all.extend(parameters.map(|(name, unit)| SignalVariable::new(name, unit, VariableRole::Parameter)));
    all
}

/// The shared data, or a word that the check is left out.
#[allow(dead_code)]
pub(crate) fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("TRUEUP_DATA").map(PathBuf::from);
    if folder.is_none() {
        eprintln!("skipped: TRUEUP_DATA names no folder of recorded data");
    }
    folder
}

pub(crate) const CASE: &str = "model = \"TwoMassJoint\"\ntrain = [\"run.csv\"]\n";
pub(crate) const HEALTHY: &str = "time,motorCurrent,motorAngle\n0,0,0\n1,1,1\n2,0.5,3\n";

/// Everything that is found in a case made of these files.
pub(crate) fn found(
    files: &[(&str, &[u8])],
    known: &[SignalVariable],
    relations: &[Relation],
) -> Vec<Finding> {
    let folder = tempfile::tempdir().unwrap();
    if !files.iter().any(|(name, _)| *name == "case.toml") {
        fs::write(folder.path().join("case.toml"), CASE).unwrap();
    }
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    match Case::load(folder.path(), |_| Ok(known.to_vec())) {
        Ok((loaded, mut findings)) => {
            findings.extend(check::case(&loaded, known, relations));
            findings
        }
        Err(SignalsError::Wrong(findings)) => findings,
        Err(other) => panic!("{other}"),
    }
}

/// A joint's variables, and an array, a choice and a truth value.
pub(crate) fn with_links() -> Vec<SignalVariable> {
    let mut all = joint();
    all.extend((1..3).map(|i| SignalVariable::new(&format!("linkMass[{i}]"), "kg", VariableRole::Parameter)));
    let center = |i: usize| {
        SignalVariable::new(&format!("center[{},{}]", i / 2 + 1, i % 2 + 1), "m", VariableRole::Parameter)
    };
    all.extend((0..4).map(center));
    all.push(SignalVariable {
        takes: Takes::Boolean,
        ..SignalVariable::new("jointFlexible", "", VariableRole::Parameter)
    });
    all.push(SignalVariable {
        takes: Takes::Item,
        ..SignalVariable::new("motorCoupling", "", VariableRole::Parameter)
    });
    all.push(SignalVariable {
        positive: true,
        ..SignalVariable::new("baseMass", "kg", VariableRole::Parameter)
    });
    all.push(SignalVariable {
        min: Some(0.0),
        ..SignalVariable::new("baseInertia", "kg.m2", VariableRole::Parameter)
    });
    all
}

/// One of the findings is of this kind and severity, and its text has all these parts.
pub(crate) fn says(label: &str, findings: &[Finding], severity: Severity, kind: FindingKind, parts: &[&str]) {
    let hit = findings.iter().any(|f| {
        let text = f.to_string();
        f.severity == severity && f.kind == kind && parts.iter().all(|p| text.contains(p))
    });
    let all: Vec<_> = findings.iter().map(|f| format!("{:?} {:?} {f}", f.severity, f.kind)).collect();
    assert!(hit, "{label}: no {severity:?} {kind:?} with {parts:?} in\n{}", all.join("\n"));
}
