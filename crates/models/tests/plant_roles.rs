//! Roles of the variables of every plant: those that their names announce to a reader of a recording.

use crate::draws::Draws;
use trueup_models::compiled::PlantModel;
use trueup_models::effect::{EffectChoice, PlantKind};
use trueup_models::flexible_arm::{self, FlexibleArm, FlexibleArmStructure};
use trueup_models::plants::{PlantStructure, build};
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_plant::{PlantQuantity, VariableTable};

fn stem(q: &PlantQuantity) -> &str {
    q.name.split('[').next().unwrap()
}

/// First states and angles of joints.
fn roles(t: &VariableTable, of: &str) {
    for q in &t.parameters {
        assert_eq!(q.is_initial(), q.name.starts_with("initial"), "{of}: {}", q.name);
    }
    for q in &t.outputs {
        assert_eq!(q.is_joint_angle(), stem(q).ends_with("Angle"), "{of}: {}", q.name);
    }
}

/// Velocities, each with the position that its name announces.
fn velocities(t: &VariableTable, of: &str) {
    let named = |q: &PlantQuantity| q.name.contains("Velocity") || q.name.contains("Rate");
    for list in [&t.outputs, &t.parameters] {
        for (k, q) in
            list.iter().enumerate().filter(|(_, q)| std::ptr::eq(list, &t.outputs) || q.is_initial())
        {
            assert_eq!(PlantQuantity::is_velocity(list, k), named(q), "{of}: {}", q.name);
            let Some(position) = q.rate_of.filter(|_| named(q)).map(|p| &list[p].name) else { continue };
            let announced = position.replace("Angle", "Velocity").replace("Position", "Velocity");
            assert_eq!(announced.replace("Attitude", "Rate"), q.name, "{of}");
        }
    }
}

#[test]
fn joints_and_arms_with_every_effect_have_the_roles_of_their_names() {
    let mut draws = Draws::new(63);
    for (model, kind) in [("TwoMassJoint", PlantKind::Joint), ("PlanarManipulator", PlantKind::Arm)] {
        let effects = EffectChoice::all(kind).map(|c| Some(c)).chain([None]);
        for effect in effects {
            let links = if kind == PlantKind::Joint { 1 } else { draws.between(1.0, 6.0) as usize };
            let needs_ground = effect.is_some_and(|e| !e.spec().acts_in(kind, false));
            let structure = PlantStructure {
                model: model.into(),
                flexible: (0..links).map(|_| draws.between(0.0, 1.0) < 0.5).collect(),
                fixed_base: kind == PlantKind::Arm && (needs_ground || draws.between(0.0, 1.0) < 0.5),
                effects: effect.iter().map(EffectChoice::id).collect(),
                ..PlantStructure::default()
            };
            let of = format!("{draws}, {structure:?}");
            let plant = build(&structure).unwrap_or_else(|e| panic!("{of}: {e:?}"));
            roles(plant.table(), &of);
            velocities(plant.table(), &of);
        }
    }
}

#[test]
fn robots_have_the_roles_of_their_names() {
    for design in [presets::table_1_with_panels(), presets::test_bed()] {
        let robot = SpatialFreeFlyer::new(design.structure()).unwrap();
        roles(&PlantModel::table(&robot), SpatialFreeFlyer::NAME);
    }
    let robot = flexible_arm::presets::delian().structure();
    let arm = FlexibleArm::new(FlexibleArmStructure { robot, by_current: true }).unwrap();
    roles(&PlantModel::table(&arm), FlexibleArm::NAME);
}
