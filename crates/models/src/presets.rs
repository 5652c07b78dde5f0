//! Parameter sets with their sources.

use crate::joint::parameter as j;

/// A named set of start values.
#[derive(Clone, Debug, PartialEq)]
pub struct Preset {
    /// Name as on the command line.
    pub name: &'static str,
    /// The model that it is for.
    pub model: &'static str,
    /// Where the values come from.
    pub source: &'static str,
    /// Values by FMU variable (element) name.
    pub values: &'static [(&'static str, f64)],
}

const SOURCE: &str = "K_eq, D_eq, tau_c, D_m, tau_s: S3 tables 1 and 2; gear ratio, inertias, torque constant: assumed (docs/parameters.md)";

/// All presets.
pub const PRESETS: &[Preset] = &[
    Preset {
        name: "delian-joint-1",
        model: "TwoMassJoint",
        source: SOURCE,
        values: &[
            ("gearRatio", 44340.0),
            ("loadInertia", 8.0),
            ("stiffness", 3.07e-5),
            ("damping", 8.07e-8),
            ("coulombFriction", 7.37e-5),
            ("viscousFriction", 7.2e-8),
            ("staticFriction", 2.99e-4),
        ],
    },
    Preset {
        name: "delian-joint-2",
        model: "TwoMassJoint",
        source: SOURCE,
        values: &[
            ("gearRatio", 21750.0),
            ("loadInertia", 6.0),
            ("stiffness", 2.2e-5),
            ("damping", 3.18e-8),
            ("coulombFriction", 1.2e-4),
            ("viscousFriction", 2.5e-8),
            ("staticFriction", 2.6e-4),
        ],
    },
    Preset {
        name: "delian-joint-3",
        model: "TwoMassJoint",
        source: SOURCE,
        values: &[
            ("gearRatio", 25000.0),
            ("loadInertia", 2.0),
            ("stiffness", 2.96e-5),
            ("damping", 8.35e-8),
            ("coulombFriction", 7.73e-5),
            ("viscousFriction", 6.93e-8),
            ("staticFriction", 2.45e-4),
        ],
    },
];

/// Motor inertia of all DELIAN joints, planetary stage included (assumed: 16 mm brushed-motor class), kg.m2.
pub const DELIAN_MOTOR_INERTIA: f64 = 1.2e-7;
/// Torque constant of all DELIAN joints (assumed), N.m/A.
pub const DELIAN_TORQUE_CONSTANT: f64 = 0.02;

/// The parameters of DELIAN's joint 1, 2 or 3 in the order of [`crate::joint::parameter`], at rest at 0.
pub fn delian(joint: usize) -> Option<[f64; j::COUNT]> {
    let preset = PRESETS.get(joint.checked_sub(1)?)?;
    let value = |name: &str| preset.values.iter().find(|(n, _)| *n == name).map(|(_, v)| *v);
    let mut p = [0.0; j::COUNT];
    p[j::MOTOR_INERTIA] = DELIAN_MOTOR_INERTIA;
    p[j::TORQUE_CONSTANT] = DELIAN_TORQUE_CONSTANT;
    p[j::LOAD_INERTIA] = value("loadInertia")?;
    p[j::GEAR_RATIO] = value("gearRatio")?;
    p[j::STIFFNESS] = value("stiffness")?;
    p[j::DAMPING] = value("damping")?;
    p[j::COULOMB_FRICTION] = value("coulombFriction")?;
    p[j::STATIC_FRICTION] = value("staticFriction")?;
    p[j::VISCOUS_FRICTION] = value("viscousFriction")?;
    Some(p)
}
