//! Sizes far above the usual ones. Checks EST-24.

use trueup_hypotheses::innovations::findings::search_case;
use trueup_hypotheses::innovations::verdict::EvidenceVerdict;

use crate::made::MadeJoint;

/// A weight of 24 usual torques that swings a few degrees acts as a cable: neither is preferred for the unit of its size.
#[test]
fn a_large_weight_in_a_small_motion_may_be_a_cable() {
    const WEIGHT: f64 = 20.0;
    let effects = [("gravity-torque", &[WEIGHT, 0.0][..])];
    let made = MadeJoint { seed: 91, recordings: (2, 500), effects: &effects, ..MadeJoint::default() };
    let found = search_case(&made.case()).unwrap();
    let of = |id: &str| found.effects.iter().find(|h| h.key.0 == id).unwrap();
    let (weight, cable) = (of("gravity-torque"), of("cable-stiffness"));
    let size = weight.causes[0].values.iter().find(|v| v.name == "gravityTorque").unwrap().value;
    let apart = weight.evidence - cable.evidence;
    println!(
        "{:?}, {:?}: {size} N.m of {WEIGHT}, {apart} nats apart",
        found.judged.verdict, found.judged.set
    );
    assert_eq!(found.judged.verdict, EvidenceVerdict::Ambiguous);
    let ids: Vec<&str> = found.judged.set.iter().map(|e| e.0).collect();
    assert!(ids.contains(&"gravity-torque") && ids.contains(&"cable-stiffness"), "{ids:?}");
    assert!((size / WEIGHT - 1.0).abs() < 0.03, "{size}");
}
