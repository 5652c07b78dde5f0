//! The joint as a plant: its equations as those of the model, forces on its coordinates, its tangent, forces that have the
//! effect of its parameters. Cases are drawn; the seed is printed.

use crate::draws::Draws;
use trueup_models::compiled::Compiled;
use trueup_models::joint::{TwoMassJoint, input, parameter};
use trueup_numerics::hybrid::At;
use trueup_plant::{Plant, force_sensitivity, tangent};

fn plant(flexible: bool, effects: &[&str]) -> Box<dyn Plant> {
    Box::new(Compiled::new(TwoMassJoint::new(flexible, effects).unwrap()))
}

/// Parameters around DELIAN's, states and inputs of usual sizes.
fn drawn(plant: &dyn Plant, draws: &mut Draws) -> (Vec<f64>, Vec<f64>, [f64; 2]) {
    let p: Vec<f64> = plant.table().parameters.iter().map(|q| q.start * draws.between(0.5, 1.5)).collect();
    let x = (0..plant.sizes().states).map(|_| draws.between(-2.0, 2.0)).collect();
    (p, x, [draws.between(-0.05, 0.05), draws.between(-2.0, 2.0)])
}

#[test]
fn forces_are_what_inputs_do() {
    let mut draws = Draws::new(0x6a31);
    for flexible in [true, false] {
        let plant = plant(flexible, &["gravity-torque", "nonlinear-stiffness"]);
        for _ in 0..50 {
            let (p, x, u) = drawn(&*plant, &mut draws);
            let (motor, load) = (draws.between(-1e-3, 1e-3), draws.between(-3.0, 3.0));
            let force =
                if flexible { vec![motor, load] } else { vec![motor + load / p[parameter::GEAR_RATIO]] };
            let mut v = u;
            v[input::MOTOR_CURRENT] += motor / p[parameter::TORQUE_CONSTANT];
            v[input::EXTERNAL_TORQUE] += load;
            for mode in [-1, 1, 2] {
                let modes = vec![mode; plant.sizes().modes];
                let (mut forced, mut driven) = (x.clone(), x.clone());
                plant.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, &force, &mut forced);
                plant.rates(At { t: 0.0, x: &x, u: &v, p: &p, modes: &modes }, &[], &mut driven);
                for (a, b) in forced.iter().zip(&driven) {
                    assert!((a - b).abs() <= 1e-11 * (1.0 + a.abs()), "{draws}: {forced:?} {driven:?}");
                }
            }
        }
    }
}

/// The value of a lane is the `f64` result, bit by bit.
#[test]
fn lanes_have_the_values() {
    use trueup_numerics::{Dual, Scalar};
    let mut draws = Draws::new(0x77);
    let all: Vec<String> = trueup_models::effect::EffectChoice::all(trueup_models::effect::PlantKind::Joint)
        .map(|c| c.id())
        .collect();
    let names: Vec<&str> = all.iter().map(String::as_str).collect();
    for effects in [&[][..], &names] {
        let plant = plant(true, effects);
        let sizes = plant.sizes();
        let p: Vec<f64> = plant.table().parameters.iter().map(|q| q.start).collect();
        for _ in 0..20 {
            let x: Vec<f64> = (0..sizes.states).map(|_| draws.between(-1.0, 1.0)).collect();
            let u: Vec<f64> = (0..sizes.inputs).map(|_| draws.between(-0.1, 0.1)).collect();
            let mut modes = vec![0; sizes.modes];
            plant.start_modes(At { t: 0.0, x: &x, u: &u, p: &p, modes: &vec![0; sizes.modes] }, &mut modes);
            let lift = |v: &[f64]| v.iter().map(|v| Dual::constant(*v)).collect::<Vec<_>>();
            let (lx, lu, lp) = (lift(&x), lift(&u), lift(&p));
            let at = At { t: 0.1, x: &x, u: &u, p: &p, modes: &modes };
            let along = At { t: Dual::constant(0.1), x: &lx, u: &lu, p: &lp, modes: &modes };
            let (mut a, mut b) = (vec![0.0; sizes.states], lift(&x));
            plant.rates(at, &[1e-4, 0.1], &mut a);
            plant.rates_lanes(along, &[Dual::constant(1e-4), Dual::constant(0.1)], &mut b);
            assert!(a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.re.to_bits()), "{draws}");
            let (mut a, mut b) = (vec![0.0; sizes.outputs], lift(&vec![0.0; sizes.outputs]));
            plant.outputs(at, &mut a);
            plant.outputs_lanes(along, &mut b);
            assert!(a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.re.to_bits()), "{draws}");
        }
    }
}

/// The tangent against central differences; a motor that is held keeps its place and moves nothing.
#[test]
fn the_tangent_is_that_of_the_rates() {
    let mut draws = Draws::new(0x3141);
    for effects in [&[][..], &["nonlinear-stiffness", "gravity-torque", "nonlinear-viscous-friction"]] {
        let plant = plant(true, effects);
        for _ in 0..20 {
            let (p, x, u) = drawn(&*plant, &mut draws);
            let modes = vec![1; plant.sizes().modes];
            let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
            let (n, c) = (x.len(), plant.coordinates().len());
            let t = tangent(&*plant, at, &[], &[]).unwrap();
            let rates = |x: &[f64], force: &[f64]| {
                let mut dx = vec![0.0; n];
                plant.rates(At { x, ..at }, force, &mut dx);
                dx
            };
            let close = |difference: &dyn Fn(f64) -> Vec<f64>, exact: &dyn Fn(usize) -> f64, h: f64| {
                let (up, down) = (difference(h), difference(-h));
                for row in 0..n {
                    let (slope, exact) = ((up[row] - down[row]) / (2.0 * h), exact(row));
                    let size = up[row].abs() + down[row].abs() + exact.abs();
                    assert!(
                        (slope - exact).abs() < 1e-6 * (size + 1.0) / h.min(1.0),
                        "{draws} {slope} {exact}"
                    );
                    assert!(
                        (slope - exact).abs() < 1e-5 * (exact.abs() + 1e-4 * size),
                        "{draws} {slope} {exact}"
                    );
                }
            };
            for i in 0..n {
                let moved = |h: f64| {
                    let mut x = x.clone();
                    x[i] += h;
                    rates(&x, &[])
                };
                close(&moved, &|row| t.by_state[row * n + i], 1e-4);
            }
            for i in 0..c {
                let moved = |h: f64| {
                    let mut f = vec![0.0; c];
                    f[i] = h;
                    rates(&x, &f)
                };
                close(&moved, &|row| t.by_force[row * c + i], 1e-2);
            }
            let held = tangent(&*plant, at, &[], &[true, false]).unwrap();
            assert!(held.by_state[..2 * n].iter().chain(&held.by_force[..2 * c]).all(|v| *v == 0.0));
            assert!((0..n).all(|row| held.by_state[row * n + 1] == 0.0));
            assert_eq!(
                held.by_state[3 * n + 2],
                t.by_state[3 * n + 2],
                "the load is on its spring as before"
            );
        }
    }
}

/// All inertias, stiffnesses, dampings, friction and torque constants times one factor change no motion where nothing else
/// acts: the forces that have the effect of each add up to 0 to rounding. Each one has that effect.
#[test]
fn forces_of_parameters_have_their_effect_and_sum_to_zero() {
    let mut draws = Draws::new(0x2718);
    for flexible in [true, false] {
        let plant = plant(flexible, &[]);
        let scaled = [
            parameter::MOTOR_INERTIA,
            parameter::LOAD_INERTIA,
            parameter::TORQUE_CONSTANT,
            parameter::STIFFNESS,
            parameter::DAMPING,
            parameter::COULOMB_FRICTION,
            parameter::STATIC_FRICTION,
            parameter::VISCOUS_FRICTION,
        ];
        for _ in 0..50 {
            let (p, x, mut u) = drawn(&*plant, &mut draws);
            u[input::EXTERNAL_TORQUE] = 0.0;
            let modes = vec![if draws.between(0.0, 1.0) < 0.5 { -1 } else { 1 }; plant.sizes().modes];
            let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
            let c = plant.coordinates().len();
            let all = force_sensitivity(&*plant, at, &[], &scaled).unwrap();
            for i in 0..c {
                let column = || all.iter().skip(i).step_by(c);
                let (sum, size) = (column().sum::<f64>(), column().map(|f| f.abs()).fold(0.0, f64::max));
                assert!(size > 0.0 && sum.abs() < 1e-12 * size, "{draws}: {sum} of {size}");
            }
            for (k, own) in scaled.iter().zip(all.chunks(c)) {
                let h: f64 = 1e-4;
                let (mut changed, mut pushed) = (p.clone(), x.clone());
                changed[*k] *= h.exp();
                let mut back = p.clone();
                back[*k] *= (-h).exp();
                let (mut up, mut down, mut base) = (x.clone(), x.clone(), x.clone());
                plant.rates(At { p: &changed, ..at }, &[], &mut up);
                plant.rates(At { p: &back, ..at }, &[], &mut down);
                plant.rates(at, own, &mut pushed);
                plant.rates(at, &[], &mut base);
                for row in 0..x.len() {
                    let (slope, force) = ((up[row] - down[row]) / (2.0 * h), pushed[row] - base[row]);
                    let size = base[row].abs() + force.abs() + 1.0;
                    assert!((slope - force).abs() < 1e-6 * size, "{draws} parameter {k}: {slope} {force}");
                }
            }
        }
    }
}
