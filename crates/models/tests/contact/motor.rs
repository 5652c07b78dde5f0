//! Jaws that a motor drives (CON-11).

use super::capture::{Sim, seconds};
use super::run::{Moments, TIGHT, place, run};
use trueup_models::contact::layout::{Command, Outputs, Parameters, Poses, States};
use trueup_models::contact::{Closing, GripperContact, GripperStructure};
use trueup_numerics::driver::DriverOptions;
use trueup_numerics::hybrid::{At, Hybrid};

const DRIVEN: GripperStructure = GripperStructure {
    balls: 3,
    closing: Closing::Motor,
    mount: trueup_models::contact::Mount::Rigid,
    against: trueup_models::contact::PortShape::Ball,
};

/// A capture with this torque, N.m.
fn capture(sim: &Sim, torque: f64, times: &[f64], options: DriverOptions) -> Moments {
    let mut u = vec![0.0; sim.scene.sizes().inputs];
    u[place(&Command::list(&DRIVEN), "motorTorque")] = torque;
    run(&sim.scene, &sim.p, &u, times, &sim.nominal, options)
}

/// Checks CON-11 without contact: viscous friction alone, to the stop, where the jaws stay and their energy is lost.
#[test]
fn free_jaws_are_the_closed_form() {
    let (inertia, friction, torque) = (0.5, 2.0, 0.4);
    let sim = Sim::of(DRIVEN).set("initialPortOffset", &[50.0, 0.0]);
    let states = States::list(&DRIVEN);
    let (jaw, rate) = (place(&states, "jaw"), place(&states, "jawRate"));
    let (end, lag) = (torque / friction, inertia / friction);
    let all = capture(&sim, torque, &seconds(8), TIGHT);
    let mut worst = 0.0f64;
    for (t, x) in all.t.iter().zip(&all.x).filter(|(t, _)| **t < 5.2) {
        let expected = end * (t - lag * (1.0 - (-t / lag).exp()));
        worst = worst.max((x[jaw] - expected).abs()).max((x[rate] - end * (1.0 - (-t / lag).exp())).abs());
    }
    // s = 1 at t - lag (1 - exp(-t / lag)) = 5 s, by repetition.
    let closed = (0..50).fold(5.0, |t: f64, _| 5.0 + lag * (1.0 - (-t / lag).exp()));
    let changes = all.changes(3);
    println!("off by {worst:.1e}; at the stop at {:?}, closed form {closed}", changes);
    assert!(worst < 1e-11);
    // At rest at the stop to begin with, it left at once.
    assert_eq!(changes.len(), 1, "{changes:?}");
    assert!((changes[0].0 - closed).abs() < 1e-9);
    let last = all.x.last().unwrap();
    assert_eq!((last[jaw], last[rate]), (1.0, 0.0));
    let [work, lost, energy] =
        ["jawWork", "dissipatedEnergy", "jawKineticEnergy"].map(|name| sim.output(name));
    assert!((all.end()[work] - torque).abs() < 1e-10 && (all.end()[lost] - torque).abs() < 1e-10);
    assert_eq!(all.end()[energy], 0.0);
    assert!((all.largest(energy) - 0.5 * inertia * end * end).abs() < 1e-6);
}

/// Checks CON-11: what contacts do against the jaws is the virtual work of their forces.
#[test]
fn the_load_is_the_slope_of_the_energy() {
    let g = GripperContact::new(DRIVEN).unwrap();
    let (n, p) = (g.sizes(), g.defaults());
    let (states, poses) = (States::list(&DRIVEN), Poses::list(&DRIVEN));
    let inertia = p[place(&Parameters::list(&DRIVEN), "jawInertia")];
    let (jaw, elastic) = (place(&states, "jaw"), place(&Outputs::list(&DRIVEN), "elasticEnergy"));
    let mut met = 0;
    for k in 0..400 {
        let mut u = vec![0.0; n.inputs];
        let port = [0.1 + 0.00025 * f64::from(k), 0.04 * (0.37 * f64::from(k)).sin()];
        u[1 + place(&poses, "portPosition")..][..2].copy_from_slice(&port);
        let turned = 0.001 * f64::from(k);
        u[1 + place(&poses, "hostAttitude")] = turned;
        let s = 0.5 + 0.4 * (0.73 * f64::from(k)).cos();
        let mut modes = vec![0; n.modes];
        let energy = |s: f64, modes: &[i32]| {
            let (mut x, mut y) = (vec![0.0; n.states], vec![0.0; n.outputs]);
            x[jaw] = s;
            g.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes }, &mut y);
            y[elastic]
        };
        let (mut x, mut dx) = (vec![0.0; n.states], vec![0.0; n.states]);
        x[jaw] = s;
        g.start_modes(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes.clone() }, &mut modes);
        let touching = modes[..3].iter().any(|m| *m != 0);
        g.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, &mut dx);
        let load = -inertia * dx[place(&states, "jawRate")];
        let h = 1e-5;
        let slope = (energy(s + h, &modes) - energy(s - h, &modes)) / (2.0 * h);
        met += usize::from(touching && load.abs() > 0.1);
        assert!((load - slope).abs() < 1e-6 * load.abs().max(1.0), "{k}: {load} {slope}");
    }
    println!("{met} of 400 touch");
    assert!(met > 50);
}

/// A capture with motor: momentum, and the balance of energy with what jaws have and take.
#[test]
fn momentum_and_energy_are_kept() {
    let sim = Sim::of(DRIVEN).set("frictionCoefficient", &[0.2]);
    for torque in [0.4, 5.0] {
        let all = capture(&sim, torque, &seconds(30), TIGHT);
        let [p, t, elastic, lost, jaws, work] = [
            "linearMomentum",
            "kineticEnergy",
            "elasticEnergy",
            "dissipatedEnergy",
            "jawKineticEnergy",
            "jawWork",
        ]
        .map(|name| sim.output(name));
        let balance = |y: &[f64]| y[t] + y[elastic] + y[lost] + y[jaws] - y[work];
        let first = &all.y[0];
        let energy = all.y.iter().map(|y| (balance(y) - balance(first)).abs()).fold(0.0, f64::max);
        let momentum = all.y.iter().map(|y| (y[p] / first[p] - 1.0).abs()).fold(0.0, f64::max);
        let force = all.largest(sim.output("contactForce") + 1);
        println!(
            "{torque} N.m: energy {energy:.1e} J, momentum {momentum:.1e}, largest force {force:.1} N, work {:.3} J",
            all.end()[work]
        );
        assert!(energy < 1e-9 && momentum < 1e-10);
        assert!(force > 1.0, "something has to happen");
    }
}

/// They leave a stop when they are pulled away, and come to rest at the other one.
#[test]
fn jaws_open_again() {
    let sim = Sim::of(DRIVEN).set("initialPortOffset", &[50.0, 0.0]);
    let (n, torque) = (sim.scene.sizes(), place(&Command::list(&DRIVEN), "motorTorque"));
    let mut u = vec![0.0; n.inputs];
    u[torque] = -1.0;
    let states = States::list(&DRIVEN);
    let mut x = vec![0.0; n.states];
    sim.scene.start(&sim.p, &mut x);
    let mut modes = vec![0; n.modes];
    let update = |x: &mut Vec<f64>, modes: &mut Vec<i32>, u: &[f64]| {
        for _ in 0..10 {
            if sim.scene.update(0.0, x, u, &sim.p, modes).settled() {
                return modes[3];
            }
        }
        panic!("does not settle");
    };
    assert_eq!(update(&mut x, &mut modes, &u), 3); // held open
    u[torque] = 1.0;
    assert_eq!(update(&mut x, &mut modes, &u), 0); // on its way
    (x[place(&states, "jaw")], x[place(&states, "jawRate")]) = (1.0 + 1e-15, 0.2);
    assert_eq!(update(&mut x, &mut modes, &u), 1); // closed
    assert_eq!((x[place(&states, "jaw")], x[place(&states, "jawRate")]), (1.0, 0.0));
    let lost = x[place(&states, "dissipatedEnergy")];
    assert!((lost - 0.5 * 0.5 * 0.2 * 0.2).abs() < 1e-15, "{lost}");
    u[torque] = -1.0;
    assert_eq!(update(&mut x, &mut modes, &u), 0);
    // More than the motor has is reported, and limited to what it has.
    u[torque] = 25.0;
    let at = At { t: 1.0, x: &x, u: &u, p: &sim.p, modes: &modes };
    let said = sim.scene.clipped(&at).unwrap();
    assert!(said.contains("`motorTorque` = 25") && said.contains("taken as 20"), "{said}");
}
