//! Effects in a capture in space act in its robot.

use super::run::TIGHT;
use super::space::SpaceSim;
use trueup_models::contact::spatial::SpatialGripperStructure;
use trueup_models::space::presets;

/// The chaser of S2 with effects, its arm bent, and a light target that turns about all axes.
fn capture(effects: &[&str], flexible: bool) -> SpaceSim {
    let mut design = presets::chaser();
    design.flex(&[flexible; 6]).unwrap();
    let bent = [0.3, -0.9, 1.4, 0.2, -0.6, 0.5];
    SpaceSim::affected(&design, SpatialGripperStructure::default(), effects)
        .set("initialJointAngle", &bent)
        .set("initialMotorAngle", &bent)
        .set("targetMass", &[200.0])
        .set("targetInertia", &[40.0, 1.0, 0.0, 1.0, 50.0, -2.0, 0.0, -2.0, 60.0])
        .set("targetCenterOfMass", &[0.06, 0.01, 0.02])
        .set("initialTargetAngularVelocity", &[0.02, -0.015, 0.01])
}

/// Friction in the joints of the robot that captures: momentum of robot and target within 1e-10, and the energy that is gone is what
/// contacts and joints took, Coulomb's torque times the ways; joints stick and are broken loose by contacts.
#[test]
fn joints_with_friction_capture_without_losing_momentum() {
    let coulomb = 0.3;
    let sim = capture(&["motor-friction"], false)
        .set("coulombFriction", &[coulomb; 6])
        .set("staticFriction", &[0.4; 6])
        .set("viscousFriction", &[0.0; 6]);
    let all = sim.run(&[8.0], TIGHT);
    let at = |name: &str| sim.output(name);
    let [p, l, t] = ["linearMomentum", "angularMomentum", "kineticEnergy"].map(at);
    let [elastic, lost, work] = ["elasticEnergy", "dissipatedEnergy", "jawWork"].map(at);
    let (q, sticks) = (at("jointAngle"), at("sticking"));
    let balance = |y: &[f64]| y[t] + y[elastic] + y[lost] - y[work];
    let (first, mut braked, mut broke) = (&all.y[0], 0.0, 0);
    let mut drift = [0.0f64; 3];
    for (a, y) in all.y.iter().zip(&all.y[1..]) {
        braked += (0..6).map(|j| coulomb * (y[q + j] - a[q + j]).abs()).sum::<f64>();
        broke += (0..6).filter(|j| a[sticks + j] == 1.0 && y[sticks + j] == 0.0).count();
        for i in 0..3 {
            drift[0] = drift[0].max((y[p + i] - first[p + i]).abs());
            drift[1] = drift[1].max((y[l + i] - first[l + i]).abs());
        }
        drift[2] = drift[2].max((balance(y) + braked - balance(first)).abs());
    }
    let force = (0..3).map(|i| all.largest(at("contactForce") + i)).fold(0.0, f64::max);
    println!(
        "{} moments, {force:.1} N, {broke} times broken loose, {braked:.1e} J in joints: momenta within {:.1e} and {:.1e}, energy {:.1e} J",
        all.y.len(),
        drift[0],
        drift[1],
        drift[2]
    );
    assert!(drift[0] < 1e-10 && drift[1] < 1e-10 && drift[2] < 1e-9);
    assert!(force > 1.0 && broke > 3 && braked > 1e-5, "something has to happen");
}

/// Play and stiffening springs, friction of the load, a force at the hand: momentum changes by the impulse alone.
#[test]
fn a_capture_with_effects_of_all_families_has_the_momentum_of_the_impulse() {
    let ids =
        ["external-force:tip", "load-friction", "backlash", "nonlinear-stiffness", "sensor-delay:jointAngle"];
    let sim = capture(&ids, true).set("jointStiffness", &[200.0; 6]);
    let all = sim.run(&[3.0], super::run::TIGHT);
    let p = sim.output("linearMomentum");
    let (first, end) = (&all.y[0][p..p + 3], &all.end()[p..p + 3]);
    // 0.5 N along x for 1 s.
    let off = (0..3).map(|i| (end[i] - first[i] - [0.5, 0.0, 0.0][i]).abs()).fold(0.0, f64::max);
    println!("{} moments, impulse within {off:.1e} N.s", all.y.len());
    assert!(off < 1e-9);
}
