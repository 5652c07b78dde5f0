//! `CaptureScene` with the planar manipulator as its chaser: closed forms, limits, what is conserved.

use super::capture::{Sim, seconds};
use super::run::TIGHT;
use trueup_models::arm::PlanarManipulator;
use trueup_models::contact::GripperStructure;
use trueup_models::contact::impact::Impact;
use trueup_numerics::driver::DriverOptions;

/// The test-bed with springs without damping, its arm bent.
fn bent(flexible: &[bool]) -> Sim<PlanarManipulator> {
    let n = flexible.len();
    Sim::with_arm(flexible, GripperStructure::default())
        .set("jointDamping", &vec![0.0; n])
        .set("initialJointAngle", &[0.4, -0.7, 0.5][..n])
        .set("initialMotorAngle", &[0.4, -0.7, 0.5][..n])
        .set("initialJointVelocity", &[0.01, 0.0, -0.01][..n])
        .set("initialMotorVelocity", &[0.01, 0.0, -0.01][..n])
}

/// Over 30 s of a capture nothing of momentum or energy is lost, rigid and flexible joints, with friction of the contact too.
#[test]
fn momentum_and_energy_are_kept() {
    kept(&[([true, false, false], 0.0), ([false; 3], 0.3)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn momentum_and_energy_are_kept_with_flexible_joints_alone() {
    kept(&[([true; 3], 0.0)]);
}

/// With these joints flexible, and such a friction of the contact.
fn kept(cases: &[([bool; 3], f64)]) {
    for &(flexible, friction) in cases {
        let sim = bent(&flexible).set("frictionCoefficient", &[friction]);
        let all = sim.run(&seconds(30), TIGHT);
        let at = |name: &str| sim.output(name);
        let [p, l, t] = ["linearMomentum", "angularMomentum", "kineticEnergy"].map(at);
        let [v, elastic, lost, work] =
            ["potentialEnergy", "elasticEnergy", "dissipatedEnergy", "jawWork"].map(at);
        // Against what the bodies exchange.
        let largest = |name: &str| all.y.iter().map(|y| y[at(name)].abs()).fold(0.0, f64::max);
        let exchanged = 213.3 * largest("targetVelocity");
        let turning = 313.7 * largest("targetRate");
        let mut drift = [0.0f64; 4];
        for y in &all.y {
            let balance = |y: &[f64]| y[t] + y[v] + y[elastic] + y[lost] - y[work];
            let first = &all.y[0];
            let now = [
                (y[p] - first[p]) / exchanged,
                (y[p + 1] - first[p + 1]) / exchanged,
                (y[l] - first[l]) / turning,
                balance(y) - balance(first),
            ];
            drift = core::array::from_fn(|i| drift[i].max(now[i].abs()));
        }
        let end = all.end();
        println!(
            "{flexible:?}: drift of momenta {:.1e} {:.1e} {:.1e}, of energy {:.1e} J; lost {:.1e} J",
            drift[0], drift[1], drift[2], drift[3], end[lost]
        );
        assert!(drift[..3].iter().all(|d| *d < 1e-10), "{drift:?}");
        assert!(drift[3] < 1e-9, "{drift:?}");
        assert!(end[lost] > 1e-6 && exchanged > 1e-2 && turning > 1e-3, "something has to happen");
    }
}

/// Checks CON-4: an arm stretched on the line of the impact acts along it with all its mass.
#[test]
fn an_impact_along_a_stretched_arm_is_the_closed_form() {
    let sim = Sim::with_arm(&[false; 3], GripperStructure { balls: 1, ..GripperStructure::default() })
        .set("mountPosition", &[0.337, 0.0])
        .set("linkCenterOfMass", &[0.1362, 0.0, 0.134, 0.0, 0.1511, 0.0])
        .set("targetCenterOfMass", &[1.5, 0.0])
        .set("initialPortOffset", &[0.03 + 0.005, 0.0]);
    let (chaser, target) = (58.69 + 2.81 + 2.82 + 4.64, 213.3);
    let impact =
        Impact { mass: chaser * target / (chaser + target), stiffness: 6000.0, damping: 81.0, speed: 0.005 };
    let all = sim.run(&[3.0], DriverOptions { max_step: 1e-3, ..TIGHT });
    let changes = all.changes(0);
    let turn = 1.0 + impact.compression();
    let wanted = [1.0, turn, turn + impact.restitution_time()];
    assert_eq!(changes.iter().map(|c| c.1).collect::<Vec<_>>(), [1, 2, 3]);
    let worst = changes.iter().zip(wanted).map(|(c, want)| (c.0 - want).abs()).fold(0.0, f64::max);
    let y = all.end();
    let parting = (y[sim.output("targetVelocity")] - y[sim.output("baseVelocity")]) / 0.005;
    let loss = y[sim.output("dissipatedEnergy")];
    println!(
        "times within {worst:.1e} s, restitution off by {:.1e}, loss by {:.1e} J",
        parting - impact.restitution(),
        loss - impact.loss()
    );
    assert!(worst < 1e-9 && (parting - impact.restitution()).abs() < 1e-9);
    assert!((loss - impact.loss()).abs() < 1e-12);
}

/// An arm whose joint gets ever stiffer becomes the rigid chaser of the same mass, as one over the stiffness.
#[test]
#[ignore = "long: ./test --full runs it"]
fn a_stiff_arm_is_a_rigid_chaser() {
    let (base, link, mount, com, length) = (58.69, 10.27, 0.337, 0.4, 1.0);
    let (base_inertia, link_inertia) = (2.42, 0.9);
    let arm = |stiffness: f64| {
        Sim::with_arm(&[true], GripperStructure::default())
            .set("mountPosition", &[mount, 0.0])
            .set("linkMass", &[link])
            .set("linkInertia", &[link_inertia])
            .set("linkCenterOfMass", &[com, 0.0])
            .set("linkLength", &[length])
            // A rotor that stays where it is against the satellite, and has no effect there.
            .set("motorCoupling", &[2.0])
            .set("motorInertia", &[1e9])
            .set("gearRatio", &[1e12])
            .set("jointStiffness", &[stiffness])
            .set("jointDamping", &[0.0])
    };
    let center = link * (mount + com) / (base + link);
    let inertia = base_inertia
        + link_inertia
        + base * center * center
        + link * (mount + com - center) * (mount + com - center);
    let mut body = Sim::of(GripperStructure::default());
    // Gripper, port and target as of the arm; they come first in both.
    let gripper = body.p.len() - 15;
    body.p[..gripper].copy_from_slice(&arm(1.0).p[..gripper]);
    let body = body
        .set("chaserMass", &[base + link])
        .set("chaserInertia", &[inertia])
        .set("endEffectorPosition", &[mount + length - center, 0.0])
        .set("initialPortOffset", &[0.036, 0.003]);
    let end = |y: &[f64], at: usize| [y[at], y[at + 1]];
    let rigid = body.run(&[5.0], TIGHT);
    let wanted = end(rigid.end(), body.output("targetVelocity"));
    let off = [1e5, 1e6].map(|stiffness| {
        let sim = arm(stiffness);
        let all = sim.run(&[5.0], TIGHT);
        let have = end(all.end(), sim.output("targetVelocity"));
        (have[0] - wanted[0]).hypot(have[1] - wanted[1]) / wanted[0].hypot(wanted[1])
    });
    println!(
        "target's velocity {wanted:?}: off by {:.1e} and {:.1e} of it at 1e5 and 1e6 N.m/rad",
        off[0], off[1]
    );
    assert!(wanted[0].hypot(wanted[1]) > 1e-4, "something has to happen");
    assert!(off[1] < 1e-3 && off[0] / off[1] > 5.0, "{off:?}");
}
