//! Jaws, outcomes, starts, limits.

use super::capture::{Sim, seconds};
use super::run::{TIGHT, run};
use trueup_models::contact::{
    CaptureOutcome, CaptureScene, Closing, GripperContact, GripperStructure, RigidChaser,
};
use trueup_numerics::driver::DriverOptions;
use trueup_numerics::hybrid::{At, Hybrid};

/// A hand whose closed balls are a cage: with strong damping it holds the port.
fn cage() -> Sim {
    Sim::of(GripperStructure::default())
        .set("ballPositionClosed", &[0.0, 0.0, 0.15, 0.086, 0.15, -0.086])
        .set("normalDamping", &[9000.0])
}

#[test]
fn a_hand_that_closes_to_a_cage_holds() {
    let held = cage();
    let all = held.run(&seconds(60), TIGHT);
    let outcome = held.output("outcome");
    println!("cage: {} after 60 s", all.end()[outcome]);
    assert_eq!(all.end()[outcome], f64::from(CaptureOutcome::Held as i32));
    assert_eq!(all.y[0][outcome], f64::from(CaptureOutcome::Open as i32));
    assert_eq!(all.end()[held.output("jawPosition")], 1.0);
}

/// At the limit of force the jaws stop, and stay.
#[test]
fn jaws_stop_at_their_limit() {
    let jammed = cage().set("holdForceLimit", &[2.0]);
    let all = jammed.run(&seconds(30), TIGHT);
    let jaw = jammed.output("jawPosition");
    let last = all.end()[jaw];
    assert!(last > 0.5 && last < 1.0, "{last}");
    let stop = all.y.iter().position(|y| y[jaw] == last).unwrap();
    assert!(all.y[stop..].iter().all(|y| y[jaw] == last));
    assert!(all.y.iter().any(|y| y[jammed.output("outcome")] == f64::from(CaptureOutcome::Jammed as i32)));
}

/// A command moves the jaws as the schedule does that is its own, and is held to its ends.
#[test]
fn a_command_is_held_to_its_ends() {
    let g =
        GripperContact::new(GripperStructure { closing: Closing::Command, ..GripperStructure::default() })
            .unwrap();
    let (p, n) = (g.defaults(), g.sizes());
    let mut u = vec![0.0; n.inputs];
    (u[8], u[9]) = (0.12, 0.01);
    let seen = |close: f64, rate: f64| {
        let mut u = u.clone();
        (u[0], u[1]) = (close, rate);
        let (x, modes, mut y) = (vec![0.0; n.states], vec![0; n.modes], vec![0.0; n.outputs]);
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
        g.outputs(at, &mut y);
        (y, g.clipped(&At { t: 1.0, ..at }))
    };
    let (half, said) = seen(0.5, 0.1);
    assert!(said.is_none() && half.contains(&0.5));
    let (over, said) = seen(1.5, 0.1);
    let said = said.unwrap();
    assert!(over.contains(&1.0) && said.contains("`close` = 1.5") && said.contains("taken as 1"), "{said}");
}

/// Line 8 of the design: what begins overlapping is named, what begins too deep or concentric is refused, nothing is NaN unsaid.
#[test]
fn starts_that_overlap() {
    let scene = CaptureScene::new(RigidChaser::default(), GripperStructure::default()).unwrap();
    let refusal = |offset: &[f64]| {
        let sim = Sim::of(GripperStructure::default()).set("initialPortOffset", offset);
        scene.check(&sim.p).err().map(|e| e.1)
    };
    assert_eq!(refusal(&[0.09, 0.0]), None);
    let deep = refusal(&[0.04, 0.0]).unwrap();
    assert!(
        deep.contains("ball 1") && deep.contains("0.0600 m deep") && deep.contains("further apart"),
        "{deep}"
    );
    let hand = GripperContact::new(GripperStructure::default()).unwrap();
    let (n, p) = (hand.sizes(), hand.defaults());
    let (x, u, modes) = (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]);
    let at = At { t: 2.0, x: &x, u: &u, p: &p, modes: &modes };
    let concentric = hand.fault(&at).unwrap();
    assert!(concentric.contains("ball 1") && concentric.contains("concentric at t = 2 s"), "{concentric}");
    let sim =
        Sim::of(GripperStructure::default()).set("ballPositionClosed", &[0.0, 0.0, 0.06, 0.04, 0.06, -0.04]);
    let (_, closed) = scene.check(&sim.p).unwrap_err();
    assert!(closed.contains("ball 2 would overlap ball 1"), "{closed}");

    let overlapping = Sim::of(GripperStructure::default()).set("initialPortOffset", &[0.09, 0.0]);
    let n = scene.sizes();
    let u = vec![0.0; n.inputs];
    let all = run(
        &scene,
        &overlapping.p,
        &u,
        &[0.5],
        &overlapping.nominal,
        DriverOptions { tolerance: 1e-9, ..TIGHT },
    );
    let at = At { t: 0.0, x: &all.x[0], u: &u, p: &overlapping.p, modes: &all.modes[0] };
    let said = scene.overlap(&at).unwrap();
    assert!(said.contains("ball 1 begins 0.010000 m deep"), "{said}");
    assert!(scene.overlap(&At { t: 0.5, ..at }).is_none(), "reported once");
}

#[test]
fn structures_that_cannot_be_had_are_refused() {
    for (balls, said) in [(0, "1 to 8"), (9, "1 to 8")] {
        let e = GripperContact::new(GripperStructure { balls, ..GripperStructure::default() }).unwrap_err();
        assert!(e.contains(said), "{e}");
    }
    let elastic =
        GripperStructure { mount: trueup_models::contact::Mount::Elastic, ..GripperStructure::default() };
    assert!(GripperContact::new(elastic).unwrap_err().contains("numberOfBalls=1"));
}
