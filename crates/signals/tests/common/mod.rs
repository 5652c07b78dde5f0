//! What tests of this crate share.

use std::path::PathBuf;

use trueup_signals::{Role, Variable};

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
