//! `modelDescription/` holds what the packer writes for every model as it is by default; it is committed so that
//! a change of the interface shows in a review. `TRUEUP_BLESS=1` writes it again.

#![allow(clippy::expect_used, clippy::panic)]

use std::path::{Path, PathBuf};

use trueup_fmi::configuration::Configuration;
use trueup_fmi_description::write::with_token;
use trueup_fmi_description::{FmiVersion, check, read};
use trueup_models::effect::{EffectChoice, PlantKind};

mod robots {
    pub(super) use trueup_models::space::design::{RobotDesign, Thruster};
    pub(super) use trueup_models::space::presets::{chaser, table_1, table_1_with_panels, test_bed};
    pub(super) use trueup_models::space::table::{ModeTable, TabledMode};
}

const MODELS: [&str; 10] = [
    "TwoMassJoint",
    "PlanarManipulator",
    "SpatialFreeFlyer",
    "FlexibleArm",
    "FreeBody",
    "GripperContact",
    "CaptureScene",
    "SpaceController",
    "JointController",
    "ManipulatorController",
];

pub(crate) fn written(configuration: &Configuration, version: FmiVersion) -> String {
    let table = fmu_library::table(configuration).expect("the default configuration is valid");
    with_token(&table, configuration, version).expect("the table is consistent").0
}

fn file(model: &str, version: FmiVersion) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../modelDescription");
    root.join(model).join(format!("fmi{}.xml", version.major()))
}

#[test]
fn committed_descriptions_are_what_the_packer_writes() {
    let bless = std::env::var_os("TRUEUP_BLESS").is_some();
    let mut stale = Vec::new();
    for model in MODELS {
        for version in FmiVersion::ALL {
            let (path, xml) = (file(model, version), written(&Configuration::of(model), version));
            if std::fs::read_to_string(&path).ok().as_ref() == Some(&xml) {
                continue;
            }
            if bless {
                std::fs::create_dir_all(path.parent().expect("it has a folder")).expect("folder can be made");
                std::fs::write(&path, xml).expect("file can be written");
            } else {
                stale.push(format!("modelDescription/{model}/fmi{}.xml", version.major()));
            }
        }
    }
    assert!(
        stale.is_empty(),
        "{} differ from what the packer writes. If the change is meant: \
         TRUEUP_BLESS=1 cargo test --release --workspace --test integration model_description",
        stale.join(", ")
    );
}

/// Every model as it is by default, with each effect, and in other structures.
pub(crate) fn configurations() -> Vec<Configuration> {
    let plain = MODELS.map(Configuration::of);
    let with_effect = [PlantKind::Joint, PlantKind::Arm].into_iter().flat_map(|plant| {
        let model = if plant == PlantKind::Joint { "TwoMassJoint" } else { "PlanarManipulator" };
        EffectChoice::all(plant).map(move |c| Configuration {
            effects: vec![c.id()],
            structure: if c.spec().acts_in(plant, false) {
                vec![]
            } else {
                vec![("base".to_owned(), vec![2])]
            },
            ..Configuration::of(model)
        })
    });
    let structures = [
        ("TwoMassJoint", vec![false]),
        ("PlanarManipulator", vec![false, true]),
        ("PlanarManipulator", vec![false; 4]),
        ("SpatialFreeFlyer", vec![true, false, true, true, false, true]),
        ("ManipulatorController", vec![true; 5]),
    ]
    .map(|(model, joint_flexible)| Configuration { joint_flexible, ..Configuration::of(model) });
    let mut satellite = robots::chaser();
    satellite.links.clear();
    satellite.tips.clear();
    satellite.thrusters.push(robots::Thruster { position: [1.0, 0.0, 0.0], direction: [0.0, 1.0, 0.0] });
    let held = robots::RobotDesign { held: true, ..robots::table_1() };
    let analysed = robots::RobotDesign { analysis: true, ..robots::table_1_with_panels() };
    let mut tabled = analysed.clone();
    let mode = robots::TabledMode {
        frequency: 3.0,
        damping_ratio: 0.01,
        participation: [1.0, 0.0, 0.0, 0.0, 2.0, 0.0],
    };
    tabled.tables.push(robots::ModeTable {
        name: "array".to_owned(),
        position: [0.0, 0.0, 1.0],
        orientation: [1.0, 0.0, 0.0, 0.0],
        mass: 8.0,
        center_of_mass: [0.0, 0.0, 2.0],
        inertia: [[11.0, 0.0, 0.0], [0.0, 11.0, 0.0], [0.0, 0.0, 0.2]],
        modes: vec![mode; 2],
    });
    let robots = [robots::table_1_with_panels(), robots::test_bed(), satellite, held, analysed, tabled]
        .map(|d| fmu_library::of_design(&d).expect("a robot that can be had"));
    let controlled =
        [robots::RobotDesign { held: true, ..robots::test_bed() }, robots::table_1_with_panels()]
            .map(|d| fmu_library::controller_of_design(&d).expect("a robot that can be had"));
    let contact = [
        ("FreeBody", vec![("numberOfPorts", 3)]),
        ("GripperContact", vec![("numberOfBalls", 5), ("closing", 2)]),
        ("GripperContact", vec![("numberOfBalls", 1), ("endBallMount", 2), ("against", 2)]),
        ("CaptureScene", vec![("numberOfBalls", 1), ("endBallMount", 2), ("against", 2)]),
        ("CaptureScene", vec![("numberOfBalls", 8), ("closing", 2)]),
        ("CaptureScene", vec![("chaser", 2), ("numberOfBalls", 1)]),
        ("CaptureScene", vec![("numberOfBalls", 7), ("endBallMount", 3), ("against", 3)]),
        ("GripperContact", vec![("closing", 3), ("endBallMount", 3), ("against", 3)]),
        ("CaptureScene", vec![("chaser", 3), ("against", 4)]),
        ("CaptureScene", vec![("chaser", 3), ("closing", 2), ("against", 5)]),
    ]
    .map(|(model, chosen)| Configuration {
        structure: chosen.into_iter().map(|(name, value)| (name.to_owned(), vec![value])).collect(),
        ..Configuration::of(model)
    });
    let capture = [
        (2, vec!["motor-friction", "backlash", "position-servo", "sensor-delay:jointAngle"]),
        (3, vec!["actuator-lag", "external-force:actuator", "position-servo"]),
    ]
    .map(|(chaser, effects)| Configuration {
        structure: vec![("chaser".to_owned(), vec![chaser])],
        effects: effects.into_iter().map(str::to_owned).collect(),
        ..Configuration::of("CaptureScene")
    });
    plain
        .into_iter()
        .chain(with_effect)
        .chain(structures)
        .chain(robots)
        .chain(controlled)
        .chain(contact)
        .chain(capture)
        .collect()
}

#[test]
fn no_description_has_a_finding_with_any_effect_or_structure() {
    for configuration in configurations() {
        for version in FmiVersion::ALL {
            let xml = written(&configuration, version);
            let description = read::read(xml.as_bytes()).expect("what is written can be read");
            let findings: Vec<String> =
                check::description(&description).iter().map(ToString::to_string).collect();
            assert!(findings.is_empty(), "{configuration:?}, FMI {}: {findings:#?}", version.as_str());
        }
    }
}
