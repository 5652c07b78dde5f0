//! What holds for every effect: it vanishes where it is neutral, it goes along with every other, and a passive one
//! never makes energy.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout)]

use crate::arm_common::Random;
use trueup_models::arm::{PlanarManipulator, output as arm_output};
use trueup_models::effect::set::PlacedEffect;
use trueup_models::effect::{EffectChoice, EffectSet, ParameterRole, PlantKind};
use trueup_models::joint::{TwoMassJoint, output as joint_output, parameter};
use trueup_models::presets::delian;
use trueup_numerics::driver::{DriverOptions, SimulationRecord, simulate};
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};
use trueup_numerics::{Dual, Scalar};

const FLEXIBLE: [bool; 3] = [true, false, true];

/// A plant with those effects and the start values of all parameters.
fn joint(ids: &[String]) -> (TwoMassJoint, Vec<f64>) {
    let model = TwoMassJoint::new(true, ids).unwrap();
    let mut p = delian(1).unwrap().to_vec();
    for e in model.effects().iter() {
        p.extend(e.choice.parameters().iter().map(|s| s.joint_start));
    }
    (model, p)
}
/// On a base that floats, unless one of them requires a fixed one.
fn arm(ids: &[String]) -> (PlanarManipulator, Vec<f64>) {
    arm_on(ids.iter().any(|id| grounded(id)), ids)
}
fn grounded(id: &str) -> bool {
    !EffectChoice::parse(id, PlantKind::Arm).unwrap().spec().acts_in(PlantKind::Arm, false)
}
fn arm_on(fixed: bool, ids: &[String]) -> (PlanarManipulator, Vec<f64>) {
    let model = PlanarManipulator::on_base(fixed, &FLEXIBLE, ids).unwrap();
    let p = model.defaults();
    (model, p)
}

/// Sets the amplitudes of an effect to `f` of their specification, element by element.
fn amplitudes(effects: &EffectSet, p: &mut [f64], f: impl Fn(&PlacedEffect, usize) -> f64) {
    for e in effects.iter() {
        for (k, spec) in e.choice.parameters().iter().enumerate() {
            if spec.role == ParameterRole::Amplitude {
                p[e.begin.parameters + k * e.sites..][..e.sites].fill(f(e, k));
            }
        }
    }
}

/// Rates of the first `states` states and the first `outputs` outputs at a random instant.
fn seen(model: &impl Hybrid, p: &[f64], x: &[f64], u: &[f64], own: ModelSizes) -> Vec<f64> {
    let s = model.sizes();
    let (mut dx, mut y) = (vec![0.0; s.states], vec![0.0; s.outputs]);
    let mut modes = vec![0; s.modes];
    let mut x = x.to_vec();
    x.resize(s.states, 0.3);
    model.start_modes(At { t: 2.0, x: &x, u, p, modes: &[] }, &mut modes);
    while !model.update(2.0, &mut x, u, p, &mut modes).settled() {}
    let at = At { t: 2.0, x: &x, u, p, modes: &modes };
    model.rates(at, &mut dx);
    model.outputs(at, &mut y);
    [&dx[..own.states], &y[..own.outputs]].concat()
}

fn same(id: &str, with: &[f64], without: &[f64]) {
    for (i, (a, b)) in with.iter().zip(without).enumerate() {
        assert!((a - b).abs() <= 1e-12 * (1.0 + b.abs()), "{id}, value {i}: {a}, without it {b}");
    }
}

/// Runs a model for a while and gives the states at the end.
fn run(
    id: &str,
    model: &impl Hybrid,
    p: &[f64],
    u: &dyn Fn(f64, &mut [f64]),
    times: &[f64],
) -> SimulationRecord {
    let options = DriverOptions { tolerance: 1e-8, ..DriverOptions::default() };
    let run = simulate(model, p, &vec![0.01; model.sizes().states], options, u, times);
    let run = run.unwrap_or_else(|e| panic!("{id}: {e}"));
    for v in run.x.iter().chain(&run.y).flatten() {
        assert!(v.is_finite(), "{id}");
    }
    run
}
fn drive_joint(t: f64, u: &mut [f64]) {
    u[0] = if t < 0.05 { 0.02 } else { -0.018 };
    u[1] = 3.0 * (40.0 * t).sin();
}
fn drive_arm(t: f64, u: &mut [f64]) {
    u[0] = if t < 0.05 { 0.3 } else { -0.2 };
    (u[1], u[2]) = (-0.05, 0.03 * (40.0 * t).sin());
}

#[test]
fn every_effect_vanishes_where_it_is_neutral() {
    let mut random = Random(3);
    for choice in EffectChoice::all(PlantKind::Joint) {
        let id = choice.id();
        let ((with, mut p), (without, q)) = (joint(std::slice::from_ref(&id)), joint(&[]));
        amplitudes(with.effects(), &mut p, |e, k| e.choice.parameters()[k].neutral);
        p[parameter::STATIC_FRICTION] = p[parameter::COULOMB_FRICTION]; // neutral for stribeck-friction
        let mut q = q;
        q[parameter::STATIC_FRICTION] = q[parameter::COULOMB_FRICTION];
        for still in [false, true] {
            let speed = if still { 0.0 } else { 900.0 };
            let x =
                [random.within(-9.0, 9.0), random.within(-1.0, 1.0) * speed, random.within(-2.0, 2.0), 0.01];
            let u = [random.within(-0.02, 0.02), 1.5];
            let own = without.sizes();
            same(&id, &seen(&with, &p, &x, &u, own), &seen(&without, &q, &x, &u, own));
        }
    }
    for choice in EffectChoice::all(PlantKind::Arm) {
        let id = choice.id();
        let with = arm(std::slice::from_ref(&id));
        // What a plant with that structure is without the effect: with friction where the effect brings it along.
        let base: Vec<String> =
            if choice.spec().friction { vec!["motor-friction".into()] } else { Vec::new() };
        let plain = if id == "joint-flexibility" { vec![id.clone()] } else { base };
        let ((with, mut p), (without, mut q)) = (with, arm_on(grounded(&id), &plain));
        amplitudes(with.effects(), &mut p, |e, k| e.choice.parameters()[k].neutral);
        if with.has_friction() {
            let n = without.sizes().parameters;
            for p in [&mut p, &mut q] {
                let (sticking, sliding) = (n - 6, n - 9);
                p.copy_within(sliding..sliding + 3, sticking);
            }
        }
        for _ in 0..3 {
            let x = random.vector(without.sizes().states, 0.5);
            let u = random.vector(9, 0.5);
            let own = without.sizes();
            same(&id, &seen(&with, &p, &x, &u, own), &seen(&without, &q, &x, &u, own));
        }
    }
}

#[test]
fn every_effect_shows_at_its_start_values() {
    let times = [0.0, 0.055, 0.4];
    let differs = |id: &str, a: &SimulationRecord, b: &SimulationRecord, outputs: usize| {
        let (a, b) = (a.y.iter(), b.y.iter());
        let mut both = a.zip(b).flat_map(|(a, b)| a[..outputs].iter().zip(&b[..outputs]));
        let shows = both.any(|(a, b)| (a - b).abs() > (1e-5 * (a.abs() + b.abs())).min(1e-3));
        assert!(shows, "{id}");
    };
    let (plain, q) = joint(&[]);
    let without = run("", &plain, &q, &drive_joint, &times);
    for id in EffectChoice::all(PlantKind::Joint).map(|c| c.id()) {
        // The joint has these by itself.
        if ["motor-friction", "joint-flexibility"].contains(&id.as_str()) {
            continue;
        }
        let (model, p) = joint(std::slice::from_ref(&id));
        differs(&id, &run(&id, &model, &p, &drive_joint, &times), &without, plain.sizes().outputs);
    }
    let times = [0.0, 0.055, 1.5];
    let plain = [false, true].map(|fixed| {
        let (plain, q) = arm_on(fixed, &[]);
        (run("", &plain, &q, &drive_arm, &times), plain)
    });
    for id in EffectChoice::all(PlantKind::Arm).map(|c| c.id()) {
        let (without, plain) = &plain[usize::from(grounded(&id))];
        let (model, p) = arm(std::slice::from_ref(&id));
        differs(&id, &run(&id, &model, &p, &drive_arm, &times), without, plain.sizes().outputs);
    }
}

/// Effects, the sensors on one channel each.
/// Whatever a joint has: where its angles go, its speeds show, but where a sensor errs.
#[test]
fn speeds_are_the_derivatives_of_angles_with_every_effect() {
    let mut rng = Random(5);
    for id in ids(PlantKind::Joint).into_iter().filter(|id| !id.contains("sensor")) {
        let (model, p) = joint(std::slice::from_ref(&id));
        let s = model.sizes();
        let x: Vec<f64> = rng.vector(s.states, 0.5);
        let (mut dx, mut modes) = (vec![0.0; s.states], vec![0; s.modes]);
        let u = [0.01, 0.02];
        model.start_modes(At { t: 2.0, x: &x, u: &u, p: &p, modes: &[] }, &mut modes);
        model.rates(At { t: 2.0, x: &x, u: &u, p: &p, modes: &modes }, &mut dx);
        let along = |v: &f64, by: f64| Dual::<1> { re: *v, eps: [by] };
        let x: Vec<_> = x.iter().zip(&dx).map(|(x, dx)| along(x, *dx)).collect();
        let u = u.map(|u| along(&u, 0.0));
        let p: Vec<_> = p.iter().map(|p| along(p, 0.0)).collect();
        let mut y = vec![Dual::constant(0.0); s.outputs];
        model.outputs(At { t: along(&2.0, 1.0), x: &x, u: &u, p: &p, modes: &modes }, &mut y);
        for (angle, speed) in [
            (joint_output::MOTOR_ANGLE, joint_output::MOTOR_VELOCITY),
            (joint_output::LOAD_ANGLE, joint_output::LOAD_VELOCITY),
        ] {
            let (moves, tells) = (y[angle].eps[0], y[speed].re);
            assert!((moves - tells).abs() <= 1e-12 * (1.0 + tells.abs()), "{id}: {moves}, not {tells}");
        }
    }
}

fn ids(plant: PlantKind) -> Vec<String> {
    let one =
        |c: &EffectChoice| c.component().strip_prefix("sensor:").is_none_or(|name| name == "motorAngle");
    EffectChoice::all(plant).filter(one).map(|c| c.id()).collect()
}

/// Each effect next to four others.
#[test]
fn pairs_run() {
    pairs_run_within(4);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn every_pair_runs() {
    pairs_run_within(usize::MAX);
}

/// Pairs of effects, and all of them, where in the list of all the second one comes so many places after the first one at most.
fn pairs_run_within(places: usize) {
    let times = [0.0, 0.1];
    let mut count = 0;
    for plant in [PlantKind::Joint, PlantKind::Arm] {
        let all = ids(plant);
        for (i, a) in all.iter().enumerate() {
            for b in all[i + 1..].iter().take(places) {
                let pair = [a.clone(), b.clone()];
                let name = pair.join("+");
                if plant == PlantKind::Joint {
                    let (model, p) = joint(&pair);
                    run(&name, &model, &p, &drive_joint, &times);
                } else {
                    let (model, p) = arm(&pair);
                    run(&name, &model, &p, &drive_arm, &times);
                }
                count += 1;
            }
        }
        let name = "all together";
        if plant == PlantKind::Joint {
            let (model, p) = joint(&all);
            run(name, &model, &p, &drive_joint, &times);
        } else {
            let (model, p) = arm(&all);
            run(name, &model, &p, &drive_arm, &times);
        }
    }
    println!("{count} pairs");
}

/// A plant with one more state: the work that its inputs have done.
struct Audited<M>(M, fn(&M, &At<f64>) -> f64);

impl<M: Hybrid> Hybrid for Audited<M> {
    fn sizes(&self) -> ModelSizes {
        let s = self.0.sizes();
        ModelSizes { states: s.states + 1, ..s }
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        let n = x.len() - 1;
        self.0.start(p, &mut x[..n]);
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        self.0.start_modes(at, modes);
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        let n = dx.len() - 1;
        self.0.rates(at, &mut dx[..n]);
        let [x, u, p] = [at.x, at.u, at.p].map(|v| v.iter().map(|v| v.value()).collect::<Vec<_>>());
        let power = self.1(&self.0, &At { t: at.t.value(), x: &x, u: &u, p: &p, modes: at.modes });
        dx[n] = T::constant(power);
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        self.0.outputs(at, y);
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        self.0.indicators(at, z);
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        self.0.update(t, x, u, p, modes)
    }
}

/// Passive effects whose energy is least in the plant at rest at 0: the inputs' work then is never less than the
/// kinetic energy.
fn passive(plant: PlantKind) -> Vec<String> {
    let low = |c: &&EffectChoice| c.spec().passive && c.spec().id != "table-tilt";
    EffectChoice::all(plant).collect::<Vec<_>>().iter().filter(low).map(|c| c.id()).collect()
}

/// What hangs does so at the angle 0.
fn hang_at_rest(effects: &EffectSet, p: &mut [f64]) {
    for e in effects.iter().filter(|e| e.spec().id == "gravity-torque") {
        p[e.begin.parameters + e.sites..][..e.sites].fill(0.0);
    }
}

/// The largest excess of the kinetic energy over the work, as a share of the largest kinetic energy.
fn made(run: &SimulationRecord, kinetic: impl Fn(usize) -> f64) -> f64 {
    let energy: Vec<f64> = (0..run.t.len()).map(kinetic).collect();
    let excess = run.x.iter().zip(&energy).map(|(x, e)| e - x[x.len() - 1]).fold(0.0, f64::max);
    excess / energy.iter().copied().fold(0.0, f64::max)
}

/// Each effect alone and next to another one.
#[test]
fn passive_effects_make_no_energy() {
    make_no_energy(2);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn passive_effects_make_no_energy_alone_or_in_pairs() {
    make_no_energy(usize::MAX);
}

/// Alone, and with those that come in the list of all less than so many places later.
fn make_no_energy(places: usize) {
    let times: Vec<f64> = (0..=40).map(|k| 0.01 * f64::from(k)).collect();
    let mut worst = 0.0f64;
    for plant in [PlantKind::Joint, PlantKind::Arm] {
        let all = passive(plant);
        for (i, a) in all.iter().enumerate() {
            for b in all[i..].iter().take(places) {
                let mut pair = vec![a.clone(), b.clone()];
                pair.dedup();
                let name = pair.join("+");
                let share = if plant == PlantKind::Joint {
                    let (model, mut p) = joint(&pair);
                    hang_at_rest(model.effects(), &mut p);
                    let power = |_: &TwoMassJoint, at: &At<f64>| {
                        at.p[parameter::TORQUE_CONSTANT] * at.u[0] * at.x[1] + at.u[1] * at.x[3]
                    };
                    let inertia = [p[parameter::MOTOR_INERTIA], p[parameter::LOAD_INERTIA]];
                    let run = run(&name, &Audited(model, power), &p, &drive_joint, &times);
                    made(&run, |k| {
                        0.5 * (inertia[0] * run.x[k][1].powi(2) + inertia[1] * run.x[k][3].powi(2))
                    })
                } else {
                    let (model, mut p) = arm(&pair);
                    hang_at_rest(model.effects(), &mut p);
                    let power = |m: &PlanarManipulator, at: &At<f64>| {
                        (0..3).map(|j| at.u[j] * at.x[m.dofs() + m.motor(j)]).sum()
                    };
                    let run = run(&name, &Audited(model, power), &p, &drive_arm, &times);
                    made(&run, |k| run.y[k][arm_output::kinetic_energy(3)])
                };
                // What the integrator makes: its tolerance is 1e-8 per step, and there are some hundred steps.
                assert!(share < 1e-5, "{name}: {share:e}");
                worst = worst.max(share);
            }
        }
    }
    println!("energy made: at most {worst:.1e} of the largest kinetic energy");
}

/// A servo with k_P = K_v K_p / n^2, k_D = K_v / n^2, r = 1 / T_i is the controller's cascade of P and PI (CTL-1, CTL-7).
#[test]
fn ef33_is_a_cascade_of_p_and_pi() {
    use trueup_models::controller::law::ControlledJoint;
    use trueup_models::controller::{Strategy, input, parameter as c, state};
    use trueup_models::joint::output::MOTOR_TORQUE;
    let mut random = Random(33);
    let (servo, mut p) = joint(&["position-servo".to_owned()]);
    let (n, [kp, kv, ti]) = (p[parameter::GEAR_RATIO], [7.0, 30.0, 0.4]);
    let gains = servo.effects().servo().unwrap().begin.parameters;
    p[gains..].copy_from_slice(&[kv * kp / (n * n), kv / (n * n), 1.0 / ti]);
    for _ in 0..20 {
        let x = random.vector(5, 2.0);
        let u = [0.0, 0.0, random.within(-1.0, 1.0)];
        let mut law = ControlledJoint {
            strategy: Strategy::PPi,
            p: [0.0; c::COUNT],
            u: [0.0; input::COUNT],
            x: [0.0; state::COUNT],
            omega: 1.0,
            feedforward: 0.0,
        };
        (law.p[c::POSITION_GAIN], law.p[c::VELOCITY_GAIN], law.p[c::GEAR_RATIO]) = (kp, kv, n);
        law.u[input::POSITION_REFERENCE] = u[2];
        (law.u[input::MOTOR_ANGLE], law.u[input::MOTOR_VELOCITY]) = (x[0], x[1]);
        law.u[input::LOAD_ANGLE] = (x[0] - x[2]) / n;
        law.x[state::INTEGRAL_TORQUE] = x[4] / ti * n;
        let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &[1] };
        let (mut y, mut dx) = ([0.0; joint_output::COUNT], [0.0; 5]);
        servo.outputs(at, &mut y);
        servo.rates(at, &mut dx);
        let asked = law.command().torque / n;
        assert!((y[MOTOR_TORQUE] - asked).abs() < 1e-12 * (1.0 + asked.abs()));
        // The controller's integral grows by K_v times the error of the velocity, over T_i.
        let kept = law.x[state::INTEGRAL_TORQUE];
        let grows = (law.command().torque - kept) / ti;
        assert!((dx[4] / ti * n - grows).abs() < 1e-13 * kept.abs() + 1e-12 * grows.abs());
    }
}
