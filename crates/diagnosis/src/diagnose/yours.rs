//! What was found next to the user's values: nominal value, its standard deviation, and both sides of the gear.

use trueup_identification::unknown::Scale;
use trueup_models::effect::PlantKind;
use trueup_models::gearbox::{BothSides, both_sides};
use trueup_plant::PlantQuantity;

use crate::engine::recordings::PreparedCase;
use crate::engine::subject::EngineModel;
use crate::outcome::{ClaimedAmount, Diagnosis, GearSides};

/// Adds them to all that is reported; `model`: the reported one, which has the parameters of its effects.
pub(super) fn compared(d: &mut Diagnosis, case: &PreparedCase, model: &EngineModel) {
    let subject = &case.subject;
    let named = subject.parameters(model);
    let ratio = |joint: Option<usize>| {
        let name = match (subject.plant, joint) {
            (PlantKind::Joint, _) => "gearRatio".to_owned(),
            (PlantKind::Arm | PlantKind::Space, joint) => format!("gearRatio[{}]", joint.unwrap_or(0)),
        };
        let found = d.parameters.get(&name).map(|a| a.value);
        found.or(nominal(case, &name).map(|n| n.value)).unwrap_or(1.0)
    };
    let sides = |component: Option<&str>, name: &str, value: f64, joint: Option<usize>| {
        let q = named.iter().find(|q| q.name == name)?;
        let BothSides { motor, load } = both_sides(subject.plant, component, q, value, ratio(joint))?;
        Some(GearSides { motor, load })
    };
    let mut parameters = d.parameters.clone();
    for (name, amount) in &mut parameters {
        let index = name.split_once('[').and_then(|i| i.1.trim_end_matches(']').parse().ok());
        amount.sides = sides(None, name, amount.value, index);
        amount.compare_with(nominal(case, name));
    }
    let mut effects = d.effects.clone();
    for e in &mut effects {
        for (stem, amount) in &mut e.parameters {
            let indexed = e.joint.map(|j| format!("{stem}[{j}]"));
            let name = indexed.filter(|n| named.iter().any(|q| q.name == *n)).unwrap_or_else(|| stem.clone());
            amount.sides = sides(Some(&e.component), &name, amount.value, e.joint);
            amount.compare_with(nominal(case, &name));
        }
    }
    (d.parameters, d.effects) = (parameters, effects);
}

/// A value of the user with its standard deviation, in its unit.
struct NominalValue {
    value: f64,
    deviation: Option<f64>,
}

impl ClaimedAmount {
    fn compare_with(&mut self, nominal: Option<NominalValue>) {
        self.nominal = nominal.as_ref().map(|n| n.value);
        self.nominal_deviation = nominal.and_then(|n| n.deviation);
    }
}

/// Of a parameter of the nominal model, or of what is estimated of a sensor.
fn nominal(case: &PreparedCase, name: &str) -> Option<NominalValue> {
    let named = case.subject.parameters(&case.model);
    if let Some((q, value)) = named.iter().zip(&case.nominal).find(|(q, _)| q.name == name) {
        let deviation = case.doubt.get(name).map(|d| absolute(q, *value, *d));
        return Some(NominalValue { value: *value, deviation });
    }
    let u = case.sensors.iter().find(|u| u.name == name)?;
    let deviation = match (u.scale, &u.prior) {
        (Scale::Linear(unit), Some(prior)) => Some(prior.deviation * unit),
        _ => None,
    };
    Some(NominalValue { value: u.start, deviation })
}

/// A declared standard deviation in the parameter's unit.
fn absolute(q: &PlantQuantity, value: f64, declared: f64) -> f64 {
    if q.absolute_deviation { declared } else { declared * value.abs() }
}
