//! Our own joint as an FMU, by the importer alone, against the model that it was made of.
//!
//! Runs on the FMUs in the folder that `TRUEUP_FMUS` names; `./test` packs them there.

use std::path::PathBuf;

use trueup_fmi_import::{HybridFmu, UnpackedFmu};
use trueup_models::compiled::Compiled;
use trueup_models::joint::TwoMassJoint;
use trueup_numerics::hybrid::At;
use trueup_numerics::{Dual, Scalar};
use trueup_plant::{LANES, Lanes, Plant, VariableTable};

const SEED: u64 = 20_261_129;

/// Steele's and Vigna's splitmix64, on (-1, 1).
pub(crate) struct Draws(pub(crate) u64);
impl Draws {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

pub(crate) fn fmus() -> Vec<HybridFmu> {
    let Some(folder) = std::env::var_os("TRUEUP_FMUS").map(PathBuf::from) else {
        eprintln!("SKIPPED: TRUEUP_FMUS is not set, so there is no FMU; run ./test");
        return Vec::new();
    };
    let open = |version: &str| {
        let fmu = UnpackedFmu::open(folder.join(format!("TwoMassJoint.{version}.fmu"))).unwrap();
        HybridFmu::new(&fmu, 0.0).unwrap()
    };
    vec![open("fmi2"), open("fmi3")]
}

pub(crate) fn joint() -> Compiled<TwoMassJoint> {
    Compiled::new(TwoMassJoint::new(true, &[] as &[&str]).unwrap())
}

/// Values of one plant's list in the order of another's.
pub(crate) fn in_order(of: &VariableTable, names: &VariableTable, values: &[f64]) -> Vec<f64> {
    names.parameters.iter().map(|q| values[of.parameter(&q.name).unwrap()]).collect()
}

/// A run's beginning with its events processed: modes and states.
pub(crate) fn begin(plant: &dyn Plant, u: &[f64], p: &[f64]) -> (Vec<i32>, Vec<f64>) {
    let (mut x, mut modes) = (vec![0.0; plant.sizes().states], vec![0; plant.sizes().modes]);
    plant.start(p, &mut x);
    plant.start_modes(At { t: 0.0, x: &x, u, p, modes: &modes.clone() }, &mut modes);
    settle(plant, 0.0, &mut x, u, p, &mut modes);
    (modes, x)
}

fn settle(plant: &dyn Plant, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) {
    for _ in 0..20 {
        if plant.update(t, x, u, p, modes).settled() {
            return;
        }
    }
    panic!("no end of events");
}

fn rates(plant: &dyn Plant, x: &[f64], u: &[f64], p: &[f64], modes: &[i32]) -> Vec<f64> {
    let mut dx = vec![f64::NAN; x.len()];
    plant.rates(At { t: 0.5, x, u, p, modes }, &[], &mut dx);
    dx
}

/// Rates with derivatives along states, then inputs.
fn jacobian(plant: &dyn Plant, x: &[f64], u: &[f64], p: &[f64], modes: &[i32]) -> Vec<Lanes> {
    let sown = |v: &[f64], first: usize| -> Vec<Lanes> {
        v.iter().enumerate().map(|(i, v)| Dual::variable(*v, first + i)).collect()
    };
    let p: Vec<Lanes> = p.iter().map(|v| Dual::constant(*v)).collect();
    let mut dx = vec![Lanes::default(); x.len()];
    let (x, u) = (sown(x, 0), sown(u, x.len()));
    plant.rates_lanes(At { t: Dual::constant(0.5), x: &x, u: &u, p: &p, modes }, &[], &mut dx);
    dx
}

/// Largest difference, as a share of the largest of the same row.
fn off(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let mut worst = 0.0_f64;
    for (a, b) in a.iter().zip(b) {
        let size = a.iter().fold(1e-300, |s, v| v.abs().max(s));
        a.iter().zip(b).for_each(|(a, b)| {
            assert!(b.is_finite(), "{b}");
            worst = worst.max((a - b).abs() / size);
        });
    }
    worst
}

fn rows(lanes: &[Lanes]) -> Vec<Vec<f64>> {
    lanes.iter().map(|v| v.eps.to_vec()).collect()
}

/// Drawn parameters, inputs and states; the motor slides at the beginning.
fn drawn(model: &dyn Plant, draws: &mut Draws) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let table = model.table();
    let mut p: Vec<f64> = table.parameters.iter().map(|q| q.start * (1.0 + 0.2 * draws.next())).collect();
    p[table.parameter("staticFriction").unwrap()] = p[table.parameter("coulombFriction").unwrap()] * 1.3;
    p[table.parameter("initialMotorVelocity").unwrap()] = 10.0 * draws.next().abs() + 1.0;
    let u = vec![draws.next(), 5.0 * draws.next()];
    let x = (0..model.sizes().states).map(|_| draws.next()).collect();
    (p, u, x)
}

#[test]
fn rates_and_jacobians_are_those_of_the_model() {
    println!("seed {SEED}");
    let model = joint();
    for fmu in fmus() {
        // A state that an FMU shows under another name as well has `state.` before its own.
        let names = |t: &VariableTable| -> Vec<String> {
            t.states.iter().map(|q| q.name.trim_start_matches("state.").to_owned()).collect()
        };
        assert_eq!(names(fmu.table()), names(model.table()));
        let again = HybridFmu::new(fmu.fmu(), 0.0).unwrap().by_differences();
        let mut draws = Draws(SEED);
        let mut worst = [0.0_f64; 3];
        for _ in 0..20 {
            let (p, u, x) = drawn(&model, &mut draws);
            let (modes, first) = begin(&model, &u, &p);
            let wanted = jacobian(&model, &x, &u, &p, &modes);
            let values: Vec<f64> = wanted.iter().map(|v| v.re).collect();
            let p = in_order(model.table(), fmu.table(), &p);
            let (own, own_first) = begin(&fmu, &u, &p);
            assert_eq!(first, own_first);
            worst[0] = worst[0].max(off(&[values], &[rates(&fmu, &x, &u, &p, &own)]));
            worst[1] = worst[1].max(off(&rows(&wanted), &rows(&jacobian(&fmu, &x, &u, &p, &own))));
            let (own, _) = begin(&again, &u, &p);
            worst[2] = worst[2].max(off(&rows(&wanted), &rows(&jacobian(&again, &x, &u, &p, &own))));
            assert_eq!((fmu.failure(), again.failure()), (None, None));
        }
        println!(
            "{}: rates {:e}, Jacobian {:e}, by differences {:e}",
            fmu.model(),
            worst[0],
            worst[1],
            worst[2]
        );
        assert!(worst[0] <= 1e-13 && worst[1] <= 1e-13 && worst[2] <= 1e-8, "{worst:?}");
    }
}

#[test]
fn parameters_that_are_tunable_have_derivatives_and_others_say_that_they_have_none() {
    println!("seed {SEED}");
    let model = joint();
    // Of FMI 2.0, parameters are no knowns of directional derivatives.
    for fmu in fmus().into_iter().skip(1) {
        let (p, u, x) = drawn(&model, &mut Draws(SEED));
        let (modes, _) = begin(&model, &u, &p);
        let own_p = in_order(model.table(), fmu.table(), &p);
        let (own, _) = begin(&fmu, &u, &own_p);
        let along = |plant: &dyn Plant, p: &[f64], name: &str, modes: &[i32]| -> Vec<f64> {
            let constant = |v: &[f64]| -> Vec<Lanes> { v.iter().map(|v| Dual::constant(*v)).collect() };
            let (x, u, mut p) = (constant(&x), constant(&u), constant(p));
            p[plant.table().parameter(name).unwrap()].eps[LANES - 1] = 1.0;
            let mut dx = vec![Lanes::default(); x.len()];
            plant.rates_lanes(At { t: Dual::constant(0.5), x: &x, u: &u, p: &p, modes }, &[], &mut dx);
            dx.iter().map(|v| v.eps[LANES - 1]).collect()
        };
        for name in ["stiffness", "damping", "motorInertia", "viscousFriction", "coulombFriction"] {
            let (a, b) = (along(&model, &p, name, &modes), along(&fmu, &own_p, name, &own));
            assert!(off(&[a.clone()], &[b.clone()]) <= 1e-13, "{name}: {a:?} {b:?} {:?}", fmu.failure());
        }
        let refused = along(&fmu, &own_p, "initialMotorAngle", &own);
        assert!(refused.iter().all(|v| v.is_nan()), "{refused:?}");
        assert!(fmu.failure().unwrap().contains("`initialMotorAngle`"));
    }
}

#[test]
fn an_event_changes_the_equations_as_it_does_those_of_the_model() {
    let model = joint();
    for fmu in fmus() {
        let p: Vec<f64> = model.table().parameters.iter().map(|q| q.start).collect();
        let own_p = in_order(model.table(), fmu.table(), &p);
        let still = [0.0, 0.0];
        let (mut modes, mut x) = begin(&model, &still, &p);
        let (mut own, mut own_x) = begin(&fmu, &still, &own_p);
        let stuck = own.clone();
        assert_eq!(rates(&model, &x, &still, &p, &modes), rates(&fmu, &own_x, &still, &own_p, &own));
        // It breaks away.
        let at = |name: &str| p[model.table().parameter(name).unwrap()];
        let driven = [3.0 * at("staticFriction") / at("torqueConstant"), 0.0];
        settle(&model, 0.5, &mut x, &driven, &p, &mut modes);
        settle(&fmu, 0.5, &mut own_x, &driven, &own_p, &mut own);
        let (a, b) = (rates(&model, &x, &driven, &p, &modes), rates(&fmu, &own_x, &driven, &own_p, &own));
        assert!(a[1] > 0.0 && off(&[a.clone()], &[b.clone()]) <= 1e-13, "{a:?} {b:?}");
        assert!(!fmu.completed_step());
        assert_eq!(fmu.failure(), None);
        // It cannot go back to an earlier time.
        assert!(rates(&fmu, &own_x, &still, &own_p, &stuck).iter().all(|v| v.is_nan()));
        assert!(fmu.failure().unwrap().contains("start again"));
    }
}
