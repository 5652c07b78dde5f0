//! Plants under test: as the library has them compiled, not compiled again for a test.

use trueup_identification::model::SimulatedPlant;
use trueup_models::plants::PlantStructure;

/// A flexible joint with these effects.
pub(crate) fn joint(effects: &[&str]) -> SimulatedPlant {
    let effects = effects.iter().map(|e| (*e).to_owned()).collect();
    SimulatedPlant::new(PlantStructure {
        model: "TwoMassJoint".into(),
        flexible: vec![true],
        effects,
        ..PlantStructure::default()
    })
    .unwrap()
}
