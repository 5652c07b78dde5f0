//! S2's gripper: carriages on springs, rollers against a bar, a spindle, the two modes (S2 section 3.1, Table 4).

use super::capture::{Sim, seconds};
use super::run::{Moments, TIGHT, place, run, set};
use trueup_models::contact::impact::Impact;
use trueup_models::contact::layout::{Command, Outputs, Parameters, Poses, States};
use trueup_models::contact::presets::SIM1;
use trueup_models::contact::{CaptureOutcome, Closing, GripperContact, GripperStructure, Mount, PortShape};
use trueup_numerics::driver::{DriverOptions, Solver};
use trueup_numerics::hybrid::{At, Hybrid};

const S2: GripperStructure = GripperStructure {
    balls: 7,
    closing: Closing::Schedule,
    mount: Mount::Carriages,
    against: PortShape::Bar,
};

/// A gripper alone, between bodies that are where the inputs have them.
struct Alone {
    model: GripperContact,
    s: GripperStructure,
    p: Vec<f64>,
    u: Vec<f64>,
}

impl Alone {
    fn of(s: GripperStructure) -> Self {
        let model = GripperContact::new(s).unwrap();
        let (p, u) = (model.defaults(), vec![0.0; model.sizes().inputs]);
        Self { model, s, p, u }
    }
    fn set(mut self, name: &str, values: &[f64]) -> Self {
        set(&Parameters::list(&self.s), &mut self.p, name, values);
        self
    }
    fn input(&mut self, name: &str, values: &[f64]) {
        if Command::list(&self.s).iter().any(|e| e.name == name) {
            set(&Command::list(&self.s), &mut self.u, name, values);
        } else {
            let from = Command::new(&self.s).count;
            set(&Poses::list(&self.s), &mut self.u[from..], name, values);
        }
    }
    fn run(&self, times: &[f64]) -> Moments {
        let states = States::list(&self.s);
        let nominal: Vec<f64> = states.iter().flat_map(|e| vec![e.kind.nominal; e.len()]).collect();
        self.model.check(&self.p).unwrap();
        run(&self.model, &self.p, &self.u, times, &nominal, TIGHT)
    }
    fn output(&self, name: &str) -> usize {
        place(&Outputs::list(&self.s), name)
    }
}

/// Checks CON-12: a ball that overlaps P2 by delta moves its carriage: d = d_end (1 - exp(-t / lag)),
/// d_end = k delta / (K_s + k), lag = C_s / (K_s + k).
#[test]
fn a_carriage_is_pushed_as_the_closed_form() {
    let (k, spring, damper, depth) = (5e4, 100.0, 1000.0, 1e-4);
    let s = GripperStructure { balls: 3, closing: Closing::Command, against: PortShape::Ball, ..S2 };
    // The ball is before P2 on the hand's x, P3 is away from it.
    let mut alone = Alone::of(s)
        .set("ballPositionOpen", &[-1.0, 0.0, 0.1, 0.0, -0.3, 0.0])
        .set("ballPositionClosed", &[-1.0, 0.0, 0.1, 0.0, -0.3, 0.0])
        .set("portBallRadius", &[0.02]);
    alone.input("portPosition", &[0.13 - depth, 0.0]);
    let all = alone.run(&[0.001, 0.01, 0.02, 0.1, 1.0]);
    let at = alone.output("carriagePosition");
    let (end, lag) = (k * depth / (spring + k), damper / (spring + k));
    let worst = all.t.iter().zip(&all.y).map(|(t, y)| (y[at] - end * (1.0 - (-t / lag).exp())).abs());
    let worst = worst.fold(0.0, f64::max);
    println!("carriage: within {worst:.1e} m of the closed form, {} of it after 1 s", all.end()[at] / end);
    assert!(worst < 1e-14);
    assert_eq!(all.end()[at + 1], 0.0, "no force on the other one");
    // It takes the force of the spring along, and no more: the ring is soft to hold.
    let force = all.end()[alone.output("hostForce")];
    assert!((force + spring * end).abs() < 1e-3 * spring * end, "{force}");
}

/// Checks CON-12: at its stop a carriage does not move, and leaves it where it is pulled away.
#[test]
fn a_carriage_stops_and_leaves_its_stop() {
    let s = GripperStructure { balls: 3, closing: Closing::Command, against: PortShape::Ball, ..S2 };
    let alone = |port: f64, speed: f64| {
        let mut alone = Alone::of(s)
            .set("ballPositionOpen", &[-1.0, 0.0, 0.1, 0.0, -0.3, 0.0])
            .set("ballPositionClosed", &[-1.0, 0.0, 0.1, 0.0, -0.3, 0.0])
            .set("carriageTravel", &[0.01])
            .set("normalDamping", &[0.0])
            .set("portBallRadius", &[0.02]);
        alone.input("portPosition", &[port, 0.0]);
        alone.input("portVelocity", &[speed, 0.0]);
        alone
    };
    let deep = alone(0.13 - 0.015, 0.0);
    let all = deep.run(&[0.5]);
    let (d, force) = (deep.output("carriagePosition"), deep.output("contactForce"));
    assert_eq!(all.end()[d], 0.01);
    assert!((all.end()[force + 1] - 5e4 * 0.005).abs() < 1e-9, "the stop bears it: {}", all.end()[force + 1]);
    let changes = all.changes(6);
    let hit = -(1000.0f64 / 50100.0) * (1.0f64 - 0.01 / (5e4 * 0.015 / 50100.0)).ln();
    assert!(
        changes.len() == 1 && changes[0].1 == 2 && (changes[0].0 - hit).abs() < 1e-9,
        "{changes:?} {hit}"
    );
}

/// Checks CON-13: the depth against the nearest of many points of the bar, and the normal against the slope of the depth.
#[test]
fn a_bar_is_its_nearest_point() {
    let mut alone = Alone::of(GripperStructure { balls: 3, mount: Mount::Rigid, ..S2 });
    let (depth, turn) = (alone.output("penetration"), 0.7f64);
    let (half, radii) = (0.03, 0.05 + 0.01);
    let (mut seed, mut ends) = (17u64, 0);
    let mut number = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    for _ in 0..500 {
        let port = [0.1 * number(), 0.1 * number()];
        alone.input("portPosition", &port);
        alone.input("portAttitude", &[turn]);
        let n = alone.model.sizes();
        let (x, modes, mut y) = (vec![0.0; n.states], vec![0; n.modes], vec![0.0; n.outputs]);
        alone.model.outputs(At { t: 0.0, x: &x, u: &alone.u, p: &alone.p, modes: &modes }, &mut y);
        let along = |k: i32| half * f64::from(k) / 2000.0;
        let distance = |h: f64| (port[0] - turn.sin() * h).hypot(port[1] + turn.cos() * h);
        let nearest = (-2000..=2000).map(along).map(distance).fold(f64::INFINITY, f64::min);
        ends += usize::from(nearest == distance(half) || nearest == distance(-half));
        assert!((y[depth] - (radii - nearest)).abs() < 2e-6, "{port:?}: {} {}", y[depth], radii - nearest);
    }
    assert!((100..450).contains(&ends), "{ends}");
}

/// Checks CON-14: the motor acts through the spindle; closed and rigid, contacts do not drive the jaws open, on springs they do.
#[test]
fn a_spindle_closes_and_locks() {
    let s = GripperStructure { balls: 3, closing: Closing::Motor, against: PortShape::Ball, ..S2 };
    // Between the jaws' rollers, which squeeze it by 2 mm each where they are closed: 100 N over a stroke of 0.07 m each.
    let (full, turns) = (2.0 * 5e4 * 2e-3 * SIM1.stroke, 30.0);
    for (rigidization, torque, closes) in [(1.0, 0.01, false), (1.0, 0.1, true), (2.0, 0.1, true)] {
        let mut alone = Alone::of(s)
            .set("rigidization", &[rigidization])
            .set("spindleTurns", &[turns])
            .set("portBallRadius", &[0.042]);
        alone.input("motorTorque", &[torque]);
        alone.input("portPosition", &[0.06, 0.0]);
        let all = alone.run(&seconds(20));
        let (jaw, mode) = (alone.output("jawPosition"), alone.output("operationMode"));
        let turned = 2.0 * std::f64::consts::PI * turns * torque;
        println!("{torque} N.m on the spindle, {turned} N.m of {full}: jaws at {}", all.end()[jaw]);
        if !closes {
            let pressed = 2.0 * all.end()[alone.output("contactForce") + 1] * SIM1.stroke;
            assert!((pressed / turned - 1.0).abs() < 1e-6, "{pressed} {turned}");
            continue;
        }
        assert_eq!((all.end()[jaw], all.end()[mode]), (1.0, if rigidization == 1.0 { 2.0 } else { 1.0 }));
        // The motor lets go: the squeezed ball drives the jaws open, unless they are locked.
        alone.input("motorTorque", &[0.0]);
        let (mut x, mut modes) = (all.x.last().unwrap().clone(), all.modes.last().unwrap().clone());
        let before = modes[3];
        alone.model.update(20.0, &mut x, &alone.u, &alone.p, &mut modes);
        assert_eq!(modes[3] == before, rigidization == 1.0, "{modes:?}");
        // It can open them.
        alone.input("motorTorque", &[-0.1]);
        alone.model.update(20.0, &mut x, &alone.u, &alone.p, &mut modes);
        assert!(modes[3] != before);
    }
}

/// Checks CON-14 and Table 4: how a ring is held along the hand in soft contact, K_s of two carriages, and rigid, k of two rollers.
#[test]
fn the_two_modes_hold_by_springs_or_by_contacts() {
    for (stiffness, spring) in [(5e4, 20.0), (1e6, 100.0)] {
        for (rigidization, held) in [(2.0, spring * stiffness / (spring + stiffness)), (1.0, stiffness)] {
            let s = GripperStructure { closing: Closing::Command, ..S2 };
            let mut alone = Alone::of(s)
                .set("stiffness", &[stiffness])
                .set("carriageStiffness", &[spring])
                .set("carriageDamping", &[10.0])
                .set("rigidization", &[rigidization]);
            alone.input("close", &[1.0]);
            // The bar is pulled away from the hand, against the two rollers behind it, which it touches from 1 mm on.
            let pulled = 2e-3;
            alone.input("portPosition", &[0.06 + pulled, 0.0]);
            let all = alone.run(&[1.0, 20.0, 100.0]);
            let force = all.end()[alone.output("portForce")];
            let wanted = -2.0 * held * (pulled - 1e-3);
            println!(
                "k {stiffness}, K_s {spring}, rigidization {rigidization}: {force} N, closed form {wanted}"
            );
            assert!((force / wanted - 1.0).abs() < 1e-6, "{force} {wanted}");
        }
    }
}

/// Table 4's corners against the closed form of one impact of a roller of S2's masses: the damper makes nearly all of the force.
#[test]
fn the_corners_of_table_4_are_impacts_in_closed_form() {
    let mass = 1778.7 * 7900.0 / (1778.7 + 7900.0);
    for (stiffness, damping) in [(5e4, 1e5), (1e6, 1e5), (5e4, 1e8), (1e6, 1e8)] {
        let impact = Impact { mass, stiffness, damping, speed: 0.005 };
        let sim = Sim::of(GripperStructure { balls: 1, ..GripperStructure::default() })
            .set("stiffness", &[stiffness])
            .set("normalDamping", &[damping])
            .set("targetCenterOfMass", &[5.0, 0.0])
            .set("initialPortOffset", &[0.1 + 0.005, 0.0]);
        let options = DriverOptions { solver: Solver::Stiff, tolerance: 1e-9, ..TIGHT };
        let all = sim.run(&[1.0, 3.0], options);
        let force = all.largest(sim.output("contactForce"));
        let deepest = all.largest(sim.output("penetration"));
        println!(
            "k {stiffness:e}, eta {damping:e}: zeta {:.3}, {force} N for {} N, {deepest} m for {} m",
            impact.damping_ratio(),
            impact.largest_force(),
            impact.deepest()
        );
        assert!((force / impact.largest_force() - 1.0).abs() < 1e-6);
        assert!((force / (damping * 0.005) - 1.0).abs() < 1e-6, "the onset, eta v");
    }
}

/// SIM1: momentum and energy of a whole capture with carriages; nothing is lost but what dampers take.
#[test]
fn momentum_and_energy_of_sim1_are_kept() {
    sim1_keeps(&[1.0], 1e-8);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn momentum_and_energy_of_sim1_are_kept_in_both_modes() {
    sim1_keeps(&[1.0, 2.0], 1e-11);
}

fn sim1_keeps(modes: &[f64], tolerance: f64) {
    for &rigidization in modes {
        let sim = Sim::of(S2).set("rigidization", &[rigidization]);
        let all = sim.run(&seconds(30), DriverOptions { solver: Solver::Stiff, tolerance, ..TIGHT });
        let at = |name: &str| sim.output(name);
        let (lost, drift) = (at("dissipatedEnergy"), sim.drift(&all));
        let end = all.end();
        let force = (0..7).map(|i| all.largest(at("contactForce") + i)).fold(0.0, f64::max);
        println!(
            "rigidization {rigidization}: {} steps, drift {drift:?}, outcome {}, mode {}, port {:?}, turned {} deg, force {force} N, lost {} J",
            all.t.len(),
            end[at("outcome")],
            end[at("operationMode")],
            &end[at("portOffset")..][..2],
            end[at("portAngle")].to_degrees(),
            end[lost]
        );
        assert!(drift[..3].iter().all(|d| *d < 1e-10) && drift[3] < 1e-9, "{drift:?}");
        assert!(end[lost] > 1e-3, "something has to happen");
        assert_eq!(end[at("operationMode")], if rigidization == 1.0 { 2.0 } else { 1.0 });
        assert_eq!(end[at("outcome")], f64::from(CaptureOutcome::Held as i32));
    }
}
