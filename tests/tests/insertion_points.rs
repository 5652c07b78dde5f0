//! Our own joint as an FMU of others: with the ports that are guessed of it, it has the coordinates, forces and readings of the model that it
//! was made of, and the forces have the same effect.
//!
//! Runs on the FMUs in the folder that `TRUEUP_FMUS` names; `./test` packs them there.

use std::path::PathBuf;

use trueup_fmi_import::{UnpackedFmu, UsedInterface};
use trueup_models::compiled::Compiled;
use trueup_models::joint::TwoMassJoint;
use trueup_numerics::hybrid::At;
use trueup_plant::{Coordinate, InsertionPoint, Plant, tangent};
use trueup_ports::plant::{PlantOfPorts, plant};
use trueup_ports::{Experiment, FmuQuantities, guess};

const SEED: u64 = 63;

/// Steele's and Vigna's splitmix64, on (-1, 1).
struct Draws(u64);
impl Draws {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

fn strangers() -> Vec<PlantOfPorts> {
    let Some(folder) = std::env::var_os("TRUEUP_FMUS").map(PathBuf::from) else {
        eprintln!("SKIPPED: TRUEUP_FMUS is not set, so there is no FMU; run ./test");
        return Vec::new();
    };
    let open = |version: &str| {
        let fmu = UnpackedFmu::open(folder.join(format!("TwoMassJoint.{version}.fmu"))).unwrap();
        let all = FmuQuantities::of(fmu.description()).unwrap();
        let found = Experiment::run(&fmu, &all, UsedInterface::ModelExchange).unwrap();
        let ports = guess::guess(&found, &all, "TwoMassJoint.fmu");
        plant(&fmu, &ports, &all, &found).unwrap()
    };
    vec![open("fmi2"), open("fmi3")]
}

/// What a coordinate is made of, by name.
fn named(plant: &dyn Plant, c: &Coordinate) -> [Option<String>; 8] {
    let t = plant.table();
    let state = |i: usize| t.states[i].name.trim_start_matches("state.").to_owned();
    let (parameter, output) = (|i: usize| t.parameters[i].name.clone(), |i: usize| t.outputs[i].name.clone());
    [
        Some(c.force_unit.to_owned()),
        c.position.map(state),
        Some(state(c.rate)),
        Some(parameter(c.initial_position)),
        Some(parameter(c.initial_rate)),
        Some(output(c.position_output)),
        Some(output(c.rate_output)),
        c.follows.and_then(|f| f.ratio).map(parameter),
    ]
}

/// A run's beginning with its events processed: modes.
fn begin(plant: &dyn Plant, u: &[f64], p: &[f64]) -> Vec<i32> {
    let (mut x, mut modes) = (vec![0.0; plant.sizes().states], vec![0; plant.sizes().modes]);
    plant.start(p, &mut x);
    plant.start_modes(At { t: 0.0, x: &x, u, p, modes: &modes.clone() }, &mut modes);
    while !plant.update(0.0, &mut x, u, p, &mut modes).settled() {}
    modes
}

fn off(a: &[f64], b: &[f64]) -> f64 {
    let size = a.iter().fold(1e-300, |s: f64, v| s.max(v.abs()));
    assert_eq!(a.len(), b.len());
    assert!(b.iter().all(|v| v.is_finite()), "{b:?}");
    a.iter().zip(b).fold(0.0, |e: f64, (a, b)| e.max((a - b).abs() / size))
}

#[test]
fn a_joint_of_others_has_the_insertion_points_of_the_model() {
    let model = Compiled::new(TwoMassJoint::new(true, &[] as &[&str]).unwrap());
    let words = |all: &[InsertionPoint]| -> Vec<(&str, String, &str)> {
        // Names of coordinates are of the ports.
        let name = |p: &InsertionPoint| {
            if p.acts.title() == "force" { String::new() } else { p.name.clone() }
        };
        all.iter().map(|p| (p.acts.title(), name(p), p.unit)).collect()
    };
    // A truth value of the model, which is no real output of the FMU.
    let (truths, wanted): (Vec<_>, Vec<_>) =
        model.insertion_points().into_iter().partition(|p| p.unit.is_empty());
    assert_eq!(truths.iter().map(|p| p.name.as_str()).collect::<Vec<_>>(), ["sticking"]);
    for found in strangers() {
        let points = found.points();
        assert_eq!(words(&points), words(&wanted));
        assert_eq!(found.unreached, [""; 0]);
        let own: Vec<_> = found.plant.coordinates().iter().map(|c| named(&found.plant, c)).collect();
        let theirs: Vec<_> = model.coordinates().iter().map(|c| named(&model, c)).collect();
        assert_eq!(own, theirs);
    }
}

#[test]
fn forces_on_a_joint_of_others_have_the_effect_that_they_have_on_the_model() {
    println!("seed {SEED}");
    let model = Compiled::new(TwoMassJoint::new(true, &[] as &[&str]).unwrap());
    let table = model.table();
    for found in strangers() {
        let (plant, mut draws, mut worst) = (&found.plant, Draws(SEED), [0.0_f64; 3]);
        for _ in 0..10 {
            // Also another torque constant than the one of the ports' experiments; the motor slides.
            let mut p: Vec<f64> =
                table.parameters.iter().map(|q| q.start * (1.0 + 0.2 * draws.next())).collect();
            p[table.parameter("staticFriction").unwrap()] = p[table.parameter("coulombFriction").unwrap()];
            p[table.parameter("initialMotorVelocity").unwrap()] = 10.0 * draws.next().abs() + 1.0;
            let u = [draws.next(), 5.0 * draws.next()];
            let x: Vec<f64> = (0..4).map(|_| draws.next()).collect();
            let force = [0.02 * draws.next(), 3.0 * draws.next()];
            let of = plant.table();
            let own_p: Vec<f64> =
                of.parameters.iter().map(|q| p[table.parameter(&q.name).unwrap()]).collect();
            let (modes, own_modes) = (begin(&model, &u, &p), begin(plant, &u, &own_p));
            let at = At { t: 0.5, x: &x, u: &u, p: &p, modes: &modes };
            let own_at = At { p: &own_p, modes: &own_modes, ..at };
            let mut dx = [vec![0.0; 4], vec![0.0; 4]];
            model.rates(at, &force, &mut dx[0]);
            plant.rates(own_at, &force, &mut dx[1]);
            worst[0] = worst[0].max(off(&dx[0], &dx[1]));
            for stuck in [[false; 2], [true, false]] {
                let (a, b) = (
                    tangent(&model, at, &force, &stuck).unwrap(),
                    tangent(plant, own_at, &force, &stuck).unwrap(),
                );
                worst[1] = worst[1].max(off(&a.by_state, &b.by_state));
                worst[2] = worst[2].max(off(&a.by_force, &b.by_force));
            }
            assert_eq!(plant.failure(), None);
        }
        println!(
            "{}: rates {:.1e}, tangent by states {:.1e}, by forces {:.1e}",
            plant.fmu().file().display(),
            worst[0],
            worst[1],
            worst[2]
        );
        assert!(worst.iter().all(|w| *w <= 1e-13), "{worst:?}");
    }
}
