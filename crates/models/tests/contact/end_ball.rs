//! The dummy gripper: an end ball on a mount against a plate. Golden facts C41 and C42, computed by others.

use super::capture::{Sim, seconds};
use super::run::TIGHT;
use trueup_models::contact::{GripperStructure, Mount, PortShape};

fn dummy() -> Sim {
    Sim::of(GripperStructure {
        balls: 1,
        mount: Mount::Elastic,
        against: PortShape::Plate,
        ..GripperStructure::default()
    })
    .set("targetCenterOfMass", &[5.0, 0.0])
    .set("portNormal", &[-1.0, 0.0])
    .set("initialPortOffset", &[0.05, 0.0])
}

/// Checks CON-8, C41 and C42: 1 kg on 2000 N/m and 30 N.s/m, 5 mm/s, 6 s; the plate is met at once.
#[test]
fn the_end_ball_is_the_golden_fact() {
    let sim = dummy();
    let all = sim.run(&seconds(6), TIGHT);
    let y = all.end();
    let ball = all.x.last().unwrap();
    println!("{:?} {:?}", all.changes(0), ball);
    let [chaser, target, force] = ["chaserVelocity", "targetVelocity", "contactForce"].map(|n| sim.output(n));
    println!("{} {} {}", y[chaser], y[target], all.largest(force));
    assert!((y[chaser] + 0.003049055549083343).abs() < 1e-6);
    assert!((y[target] - 0.0018132790076840037).abs() < 1e-6);
    // The fact is a largest sample, 8.00048; the largest at every step is 8.0005287.
    assert!((all.largest(force) - 8.0005287).abs() < 1e-6);
    let release = all.changes(0).last().copied().unwrap();
    assert!(release.1 == 3 && (release.0 - 2.7916528767328765).abs() < 1e-6, "{release:?}");
    let p = sim.output("linearMomentum");
    let drift = all.y.iter().map(|y| (y[p] - all.y[0][p]).abs()).fold(0.0, f64::max);
    assert!(drift < 1e-10, "{drift}");
}

/// Energy with a mount, friction and a plate that is not across: nothing is lost but what dampers take.
#[test]
fn the_balance_of_energy_holds_on_a_mount() {
    let oblique = dummy()
        .set("portNormal", &[-1.0, 0.4])
        .set("frictionCoefficient", &[0.2])
        .set("targetCenterOfMass", &[5.0, 1.3]);
    // Without mass, too: the mount is then of first order.
    let massless = dummy().set("ballMass", &[0.0]).set("portNormal", &[-1.0, 0.4]);
    for (sim, name) in [(oblique, "with mass"), (massless, "without")] {
        let all = sim.run(&seconds(6), TIGHT);
        let [p, l, t, elastic, lost] =
            ["linearMomentum", "angularMomentum", "kineticEnergy", "elasticEnergy", "dissipatedEnergy"]
                .map(|n| sim.output(n));
        let balance = |y: &[f64]| y[t] + y[elastic] + y[lost];
        let off = |of: &dyn Fn(&[f64]) -> f64| {
            all.y.iter().map(|y| (of(y) - of(&all.y[0])).abs()).fold(0.0, f64::max)
        };
        println!(
            "{name}: energy {:.1e} J, momenta {:.1e} {:.1e}",
            off(&balance),
            off(&|y| y[p]),
            off(&|y| y[l])
        );
        assert!(
            off(&balance) < 1e-9
                && off(&|y| y[p]) < 1e-10
                && off(&|y| y[p + 1]) < 1e-10
                && off(&|y| y[l]) < 1e-9
        );
        assert!(all.end()[lost] > 1e-4, "something has to happen");
    }
}
