//! Parameter sets with their sources.

use crate::arm::{parameter as a, rotor};
use crate::joint::parameter as j;

/// A named set of start values.
#[derive(Clone, Debug, PartialEq)]
pub struct ValuePreset {
    /// Name as on the command line.
    pub name: &'static str,
    /// The model that it is for.
    pub model: &'static str,
    /// Where the values come from.
    pub source: &'static str,
    /// Which joints are flexible where that is not chosen, one entry per joint: how many there are; empty: as the model has it.
    pub flexible: &'static [bool],
    /// Values by name of an FMU's variable, which is for all its elements, or of an element.
    pub values: &'static [(&'static str, f64)],
}

const SOURCE: &str = "K_eq, D_eq, tau_c, D_m, tau_s: Comi et al. (DELIAN), tables 1 and 2; gear ratio, inertias, torque constant: assumed (docs/parameters.md)";

const CBK_SOURCE: &str = "masses, inertias, lengths, centres of mass: CBK PAN paper, table 1 and section 3.1; k: its CAD value; I_m, b: averages of its table 2";

const DELIAN_CONTROL: &str = "for FlexibleArm driven by torques (drive=torque): velocity loop at 60 rad/s of each assumed rotor, limits of 0.5 A; K_p, waves: docs/flexible-arm-control.md";

/// Joint side: gear and drive are in the arm's torques. Velocity gain 60 rad/s x 1.2e-7 kg.m2 x n^2, limit 0.5 A x 0.02 N.m/A x n.
const DELIAN_GAINS: &[(&str, f64)] = &[
    ("strategy", 4.0),
    ("samplePeriod", 1e-3),
    ("positionGain", 2.0),
    ("velocityGain[1]", 14155.0),
    ("velocityGain[2]", 3406.0),
    ("velocityGain[3]", 4500.0),
    ("velocityGain[4]", 4500.0),
    ("velocityGain[5]", 4500.0),
    ("velocityGain[6]", 4500.0),
    ("velocityIntegralTime", 0.1),
    ("torqueLimit[1]", 443.4),
    ("torqueLimit[2]", 217.5),
    ("torqueLimit[3]", 250.0),
    ("torqueLimit[4]", 250.0),
    ("torqueLimit[5]", 250.0),
    ("torqueLimit[6]", 250.0),
    ("waveFrequency", 20.0),
    ("washoutFrequency", 1.0),
    ("waveFrequencyMin", 1.0),
    ("waveFrequencyMax", 100.0),
];

/// All presets.
pub const PRESETS: &[ValuePreset] = &[
    ValuePreset {
        name: "delian-joint-1",
        model: "TwoMassJoint",
        source: SOURCE,
        flexible: &[],
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
    ValuePreset {
        name: "delian-joint-2",
        model: "TwoMassJoint",
        source: SOURCE,
        flexible: &[],
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
    ValuePreset {
        name: "delian-joint-3",
        model: "TwoMassJoint",
        source: SOURCE,
        flexible: &[],
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
    ValuePreset {
        name: CBK_PAN,
        model: "PlanarManipulator",
        source: CBK_SOURCE,
        flexible: &[],
        values: &[
            ("baseMass", 58.69),
            ("baseInertia", 2.42),
            ("mountPosition[1]", 0.337),
            ("mountPosition[2]", -0.001),
            ("linkMass[1]", 2.81),
            ("linkMass[2]", 2.82),
            ("linkMass[3]", 4.64),
            ("linkInertia[1]", 0.0637),
            ("linkInertia[2]", 0.0635),
            ("linkInertia[3]", 0.0515),
            ("linkLength[1]", 0.449),
            ("linkLength[2]", 0.449),
            ("linkLength[3]", 0.310),
            ("linkCenterOfMass[1,1]", 0.1362),
            ("linkCenterOfMass[1,2]", -0.0017),
            ("linkCenterOfMass[2,1]", 0.1340),
            ("linkCenterOfMass[2,2]", -0.0005),
            ("linkCenterOfMass[3,1]", 0.1511),
            ("linkCenterOfMass[3,2]", 0.0004),
            ("motorInertia[1]", 5.6),
            ("motorInertia[2]", 0.0),
            ("motorInertia[3]", 0.0),
            ("gearRatio[1]", 100.0),
            ("gearRatio[2]", 100.0),
            ("gearRatio[3]", 100.0),
            ("jointStiffness[1]", 5.47),
            ("jointDamping[1]", 0.5),
        ],
    },
    ValuePreset {
        name: "delian",
        model: "ManipulatorController",
        source: DELIAN_CONTROL,
        flexible: &[true; 6],
        values: DELIAN_GAINS,
    },
];

/// Name of the preset of CBK PAN's air-bearing test-bed.
pub const CBK_PAN: &str = "cbk-pan";

/// The parameters of CBK PAN's test-bed in the order of [`crate::arm::parameter`] (without friction and effects),
/// at rest at 0, one link per entry of `flexible`. Links beyond the third are like the third; every flexible
/// joint has the spring and the motor of the test-bed's joint 1, the rotors of rigid joints are left out.
pub fn cbk_pan(flexible: &[bool]) -> Vec<f64> {
    let n = flexible.len();
    let values = PRESETS.iter().find(|p| p.name == CBK_PAN).map_or(&[][..], |p| p.values);
    let value = |name: &str| values.iter().find(|(k, _)| *k == name).map_or(0.0, |(_, v)| *v);
    let mut p = vec![0.0; a::count(n)];
    p[a::base_mass(n)] = value("baseMass");
    p[a::base_inertia(n)] = value("baseInertia");
    for i in 0..2 {
        p[a::mount_position(n) + i] = value(&format!("mountPosition[{}]", i + 1));
    }
    for (i, flexible) in flexible.iter().enumerate() {
        let like = (i + 1).min(3);
        for (name, begin) in [
            ("linkMass", a::link_mass(n)),
            ("linkInertia", a::link_inertia(n)),
            ("linkLength", a::link_length(n)),
            ("gearRatio", a::gear_ratio(n)),
        ] {
            p[begin + i] = value(&format!("{name}[{like}]"));
        }
        for axis in 0..2 {
            p[a::link_center_of_mass(n) + 2 * i + axis] =
                value(&format!("linkCenterOfMass[{like},{}]", axis + 1));
        }
        p[a::motor_inertia(n) + i] = if *flexible { value("motorInertia[1]") } else { 0.0 };
        p[a::joint_stiffness(n) + i] = value("jointStiffness[1]");
        p[a::joint_damping(n) + i] = value("jointDamping[1]");
    }
    p[a::motor_coupling(n)] = rotor::PAPER;
    p
}

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
