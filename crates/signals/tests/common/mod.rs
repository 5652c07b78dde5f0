//! What tests of this crate share.

use std::fs;
use std::path::PathBuf;

use trueup_signals::check::{self, Relation};
use trueup_signals::{Case, Error, Finding, Role, Takes, Variable};

/// The scalar variables of a joint.
pub(crate) fn joint() -> Vec<Variable> {
    let mut all = vec![
        Variable::new("motorCurrent", "A", Role::Input),
        Variable::new("externalTorque", "N.m", Role::Input),
        Variable::new("motorAngle", "rad", Role::Output),
        Variable::new("motorVelocity", "rad/s", Role::Output),
        Variable::new("loadAngle", "rad", Role::Output),
        Variable::new("sticking", "", Role::Output),
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
    all.extend(parameters.map(|(name, unit)| Variable::new(name, unit, Role::Parameter)));
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
pub(crate) fn found(files: &[(&str, &[u8])], known: &[Variable], relations: &[Relation]) -> Vec<Finding> {
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
        Err(Error::Wrong(findings)) => findings,
        Err(other) => panic!("{other}"),
    }
}

/// A joint's variables, and an array, a choice and a truth value.
pub(crate) fn with_links() -> Vec<Variable> {
    let mut all = joint();
    all.extend((1..3).map(|i| Variable::new(&format!("linkMass[{i}]"), "kg", Role::Parameter)));
    let center =
        |i: usize| Variable::new(&format!("center[{},{}]", i / 2 + 1, i % 2 + 1), "m", Role::Parameter);
    all.extend((0..4).map(center));
    all.push(Variable { takes: Takes::Boolean, ..Variable::new("jointFlexible", "", Role::Parameter) });
    all.push(Variable { takes: Takes::Item, ..Variable::new("motorCoupling", "", Role::Parameter) });
    all.push(Variable { positive: true, ..Variable::new("baseMass", "kg", Role::Parameter) });
    all.push(Variable { min: Some(0.0), ..Variable::new("baseInertia", "kg.m2", Role::Parameter) });
    all
}
