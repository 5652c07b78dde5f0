//! The variables by name are those of the FMUs, in the same order, with the same units and bounds.

#![allow(clippy::unwrap_used)]

use fmu_plant::PlantModelTable;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, Storage, TableVariable};
use trueup_fmi_export::FmuModel;
use trueup_identification::model::{PlantQuantity, SimulatedPlant};
use trueup_models::arm::{BASE_CHOICE, FIXED_BASE};
use trueup_models::effect::{self, EffectChoice};
use trueup_models::plants::PlantStructure;
use trueup_signals::element_name;

fn elements(v: &TableVariable) -> Vec<String> {
    match v.dimensions[..] {
        [] => vec![v.name.clone()],
        [n] => (1..=n).map(|i| element_name(&v.name, &[i])).collect(),
        [n, m] => (1..=n)
            .flat_map(|i| (1..=m).map(move |j| (i, j)))
            .map(|(i, j)| element_name(&v.name, &[i, j]))
            .collect(),
        _ => unreachable!("no such array"),
    }
}

fn agree(model: &str, flexible: &[bool], effects: &[&str]) {
    agree_on(false, model, flexible, effects);
}

fn agree_on(fixed_base: bool, model: &str, flexible: &[bool], effects: &[&str]) {
    let c = Configuration {
        model: model.into(),
        structure: if fixed_base { vec![(BASE_CHOICE.to_owned(), vec![FIXED_BASE])] } else { vec![] },
        joint_flexible: flexible.to_vec(),
        effects: effects.iter().map(|e| (*e).to_owned()).collect(),
        ..Configuration::default()
    };
    let table = PlantModelTable::build(&c).unwrap().table();
    let ours = SimulatedPlant::new(PlantStructure {
        model: model.into(),
        flexible: flexible.to_vec(),
        fixed_base,
        effects: c.effects.clone(),
        ..PlantStructure::default()
    })
    .unwrap();
    let place = |v: &TableVariable| match v.storage {
        Storage::Parameter(i) => Some((ours.parameters(), i)),
        Storage::Input(i) => Some((ours.inputs(), i)),
        Storage::Output(i) => Some((ours.outputs(), i)),
        _ => None,
    };
    let mut seen = 0;
    for v in &table.variables {
        let Some((list, begin)): Option<(&[PlantQuantity], usize)> = place(v) else { continue };
        for (k, name) in elements(v).iter().enumerate() {
            let q = &list[begin + k];
            assert_eq!(&q.name, name, "{model} {effects:?}");
            assert_eq!(q.unit, v.unit, "{name}");
            if matches!(v.kind, BoundaryType::Real) && matches!(v.storage, Storage::Parameter(_)) {
                assert_eq!(q.min, v.min.unwrap_or(f64::NEG_INFINITY), "{name}");
            }
            seen += 1;
        }
    }
    assert_eq!(seen, ours.parameters().len() + ours.inputs().len() + ours.outputs().len());
}

#[test]
fn names_units_and_order_are_those_of_the_fmus() {
    agree("TwoMassJoint", &[true], &[]);
    agree("TwoMassJoint", &[false], &[]);
    agree("PlanarManipulator", &[true, false, false], &[]);
    agree("PlanarManipulator", &[true], &[]);
    for choice in EffectChoice::all(effect::PlantKind::Joint) {
        agree("TwoMassJoint", &[true], &[&choice.id()]);
    }
    for choice in EffectChoice::all(effect::PlantKind::Arm) {
        let fixed_base = !choice.spec().acts_in(effect::PlantKind::Arm, false);
        agree_on(fixed_base, "PlanarManipulator", &[true, false, true], &[&choice.id()]);
    }
}
