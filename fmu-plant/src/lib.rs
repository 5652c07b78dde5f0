//! The plants and the contact between them as FMUs: binding only.

mod arm;
mod builder;
mod contact;
mod entries;
mod experiment;
mod flexible_arm;
mod joint;
mod model;
mod space;
mod space_capture;
mod space_controller;
mod structure;

pub use arm::TEST_BED;
pub use contact::Contact;
pub use experiment::schedule;
pub use flexible_arm::{of_arm, with_links};
pub use model::PlantModelTable;
pub use space::{is_robot, of_design};
pub use space_capture::capture_of_design;
pub use space_controller::controller_of_design;
pub use structure::{RequestedStructure, StructureOption, choices};

/// The models of this library.
pub const MODELS: &[&str] = &[
    "TwoMassJoint",
    "PlanarManipulator",
    "SpatialFreeFlyer",
    "FlexibleArm",
    "FreeBody",
    "GripperContact",
    "CaptureScene",
    "SpaceController",
];

#[cfg(test)]
mod tests {
    use crate::{PlantModelTable, of_design};
    use trueup_fmi::configuration::Configuration;
    use trueup_fmi::table::Storage as S;
    use trueup_fmi_export::FmuModel;
    use trueup_models::arm::{BASE_CHOICE, BY_ACCELERATION, FIXED_BASE, JOINT_DRIVE_CHOICE};
    use trueup_models::effect;
    use trueup_models::flexible_arm::presets::delian;
    use trueup_models::joint::{GEARBOX_CHOICE, TWO_STAGES};
    use trueup_models::space::design::RobotDesign;
    use trueup_models::space::presets;
    use trueup_models::space::table::{ModeTable, TabledMode};
    use trueup_numerics::hybrid::Hybrid;

    #[test]
    fn the_tables_cover_every_value_of_the_models() {
        let all = |plant| effect::EffectChoice::all(plant).map(|c| c.id()).collect::<Vec<_>>();
        let (joint, arm) = (all(effect::PlantKind::Joint), all(effect::PlantKind::Arm));
        let cases = [
            ("TwoMassJoint", vec![], vec![]),
            ("TwoMassJoint", vec![false], joint.clone()),
            ("TwoMassJoint", vec![true], joint),
            ("PlanarManipulator", vec![], vec![]),
            ("PlanarManipulator", vec![false], arm.clone()),
            ("PlanarManipulator", vec![true, false, true, true, false], arm),
            ("SpatialFreeFlyer", vec![], vec![]),
            ("SpatialFreeFlyer", vec![true, false, true, false, false, true], vec![]),
            ("SpatialFreeFlyer", vec![], all(effect::PlantKind::Space)),
            ("FlexibleArm", vec![], vec![]),
            ("SpaceController", vec![], vec![]),
        ];
        let mut tabled = presets::table_1_with_panels();
        tabled.analysis = true;
        tabled.tables.push(ModeTable {
            name: "array".to_owned(),
            position: [0.0; 3],
            orientation: [1.0, 0.0, 0.0, 0.0],
            mass: 1.0,
            center_of_mass: [0.0; 3],
            inertia: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            modes: vec![TabledMode { frequency: 3.0, damping_ratio: 0.0, participation: [0.5; 6] }],
        });
        let robots =
            [presets::table_1_with_panels(), presets::test_bed(), tabled].map(|d| of_design(&d).unwrap());
        let fixed = [(BASE_CHOICE.to_owned(), vec![FIXED_BASE])];
        let plain = cases.into_iter().map(|(model, joint_flexible, effects)| Configuration {
            joint_flexible,
            // All effects together want a base that is fixed.
            structure: fixed
                .iter()
                .filter(|_| model == "PlanarManipulator" && !effects.is_empty())
                .cloned()
                .collect(),
            effects,
            ..Configuration::of(model)
        });
        let contact = crate::contact::tests::structures();
        let controlled = [presets::table_1_with_panels(), RobotDesign { held: true, ..presets::test_bed() }]
            .map(|d| crate::controller_of_design(&d).unwrap());
        let arm = |structure: &[(&str, u32)]| Configuration {
            structure: structure.iter().map(|(name, item)| ((*name).to_owned(), vec![*item])).collect(),
            ..Configuration::of("FlexibleArm")
        };
        let arms = [
            arm(&[("drive", 2), ("linkShapes", 5), ("axialStiffening", 2)]),
            arm(&[("links", 2)]),
            crate::of_arm(&delian(), &[]).unwrap(),
        ];
        let around = [
            Configuration {
                effects: all(effect::PlantKind::Joint),
                structure: vec![(GEARBOX_CHOICE.to_owned(), vec![TWO_STAGES])],
                ..Configuration::of("TwoMassJoint")
            },
            Configuration {
                effects: all(effect::PlantKind::Space),
                structure: vec![("chaser".to_owned(), vec![3])],
                ..Configuration::of("CaptureScene")
            },
            Configuration {
                joint_flexible: vec![true, false],
                structure: vec![(JOINT_DRIVE_CHOICE.to_owned(), vec![BY_ACCELERATION])],
                ..Configuration::of("PlanarManipulator")
            },
        ];
        for c in plain.chain(around).chain(robots).chain(controlled).chain(contact).chain(arms) {
            let m = PlantModelTable::build(&c).unwrap();
            let t = m.table();
            let count = |pick: fn(S) -> bool| {
                t.variables.iter().filter(|v| pick(v.storage)).map(|v| v.len()).sum::<usize>()
            };
            let s = m.sizes();
            assert_eq!(count(|s| matches!(s, S::Parameter(_))), s.parameters, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::State(_))), s.states, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Rate(_))), s.states, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Output(_))), s.outputs, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Input(_))), s.inputs, "{c:?}");
            assert_eq!(t.parameter_starts().len(), s.parameters, "{c:?}");
            m.check(&t.parameter_starts()).unwrap();
        }
    }

    #[test]
    fn loads_stiffen_links_that_bend_unless_chosen_otherwise() {
        for (structure, wanted) in [
            (&[][..], true),
            (&[("drive", 2), ("linkShapes", 5)], true),
            (&[("axialStiffening", 1)], false),
            (&[("links", 1), ("axialStiffening", 2)], true),
            (&[("links", 2)], false),
            (&[("links", 2), ("axialStiffening", 1)], false),
            // There is nothing to stiffen, and no error.
            (&[("links", 2), ("axialStiffening", 2)], true),
        ] {
            let c = Configuration {
                structure: structure.iter().map(|(name, item)| ((*name).to_owned(), vec![*item])).collect(),
                ..Configuration::of("FlexibleArm")
            };
            let plant = PlantModelTable::build(&c).unwrap();
            let PlantModelTable::FlexibleArm { arm, .. } = &plant else { panic!("no arm") };
            let table = plant.table();
            let start = table.find("axialStiffening").unwrap().start[0];
            assert_eq!(
                (arm.structure().robot.axial_stiffening, start == 2.0),
                (wanted, wanted),
                "{structure:?}"
            );
        }
    }

    /// By what a robot is, what its file chooses and what is chosen when it is packed; a free base has no weight on its links.
    #[test]
    fn loads_stiffen_links_of_a_robot_that_stands() {
        for (held, file, beside, wanted) in [
            (true, None, None, true),
            (true, Some(false), None, false),
            (false, None, None, false),
            (false, Some(true), None, true),
            (true, None, Some(1), false),
            (true, Some(true), Some(1), false),
            (true, Some(false), Some(2), true),
        ] {
            let design = RobotDesign { held, axial_stiffening: file, ..delian() };
            let choices: Vec<_> =
                beside.into_iter().map(|item| ("axialStiffening".to_owned(), vec![item])).collect();
            let design = crate::with_links(design, &choices).unwrap();
            let on_ground = RobotDesign { held: true, ..design.clone() };
            let arm = crate::of_arm(&design, &choices).unwrap();
            for (c, wanted) in [(of_design(&design).unwrap(), wanted), (arm, on_ground.stiffens())] {
                let table = PlantModelTable::build(&c).unwrap().table();
                let start = table.find("axialStiffening").unwrap().start[0];
                assert_eq!(start == 2.0, wanted, "{} {held} {file:?} {beside:?}", c.model);
            }
        }
    }

    /// The presets' one tip has one terminal, and nothing of another tip is in it (decision 0012).
    #[test]
    fn a_robot_of_one_tip_has_one_terminal_for_it() {
        for preset in presets::PRESETS {
            let t = PlantModelTable::build(&of_design(&(preset.design)()).unwrap()).unwrap().table();
            let members = |name: &str| {
                let terminal = t.terminals.iter().find(|t| t.name == name).unwrap();
                terminal.members.iter().map(|m| t.find(&m.1).unwrap()).collect::<Vec<_>>()
            };
            let tip: Vec<&str> = members("tip").iter().map(|v| v.name.as_str()).collect();
            assert_eq!(
                tip,
                [
                    "tipForce",
                    "tipTorque",
                    "tipPosition",
                    "tipQuaternion",
                    "tipVelocity",
                    "tipAngularVelocity"
                ]
            );
            assert!(members("tip").iter().all(|v| v.dimensions[0] == 1), "{}", preset.name);
            assert_eq!(members("base").len(), 6);
            assert_eq!(members("drive").len(), 5);
        }
    }
}
