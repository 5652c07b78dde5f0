//! The joint's filter on recordings made by the adaptive driver: what drives it unseen is read off, parameters come back.

use rand::SeedableRng;
use rand::rngs::StdRng;
use rand_distr::{Distribution, Normal};
use trueup_estimation::evidence::{Gram, Prior};
use trueup_estimation::filter::{Filter, log_likelihood};
use trueup_estimation::joint::{
    Along, Channel, Column, FULL as N, Model, PLACES, Parts, Recording, Sample, sensed_trajectory,
    smoothed_trajectory,
};
use trueup_estimation::smoother::{Smoothed, smooth};
use trueup_estimation::system::{Latent, System};
use trueup_models::compiled::Compiled;
use trueup_models::joint::{TwoMassJoint, input, output, parameter as p};
use trueup_numerics::driver::{Options, simulate};
use trueup_numerics::hybrid::Hybrid;

/// A small geared drive.
fn drive() -> Vec<f64> {
    let mut q = vec![0.0; p::COUNT];
    for (i, v) in [
        (p::MOTOR_INERTIA, 1.7e-5),
        (p::LOAD_INERTIA, 0.8),
        (p::STIFFNESS, 0.084),
        (p::DAMPING, 7.7e-5),
        (p::COULOMB_FRICTION, 5.2e-3),
        (p::VISCOUS_FRICTION, 5.6e-5),
        (p::STATIC_FRICTION, 5.2e-3),
        (p::GEAR_RATIO, 160.0),
        (p::TORQUE_CONSTANT, 0.04),
    ] {
        q[i] = v;
    }
    q
}

const DT: f64 = 4e-3;
const NOISE: [f64; 2] = [2e-3, 2e-5];

/// Ten seconds with noise on both sensors; `load` is a torque on the load that nobody measures.
fn record(joint: &TwoMassJoint, q: &[f64], seed: u64, load: impl Fn(f64) -> f64) -> Recording {
    let nodes = 2500;
    let current = |k: usize| {
        let t = (k as f64 + 0.5) * DT;
        0.3 * (2.1 * t + seed as f64).sin() + 0.2 * (9.3 * t).sin()
    };
    let drive = |t: f64, u: &mut [f64]| {
        u[input::MOTOR_CURRENT] = current((t / DT + 1e-9) as usize);
        u[input::EXTERNAL_TORQUE] = load(t);
    };
    let t: Vec<f64> = (0..nodes).map(|k| k as f64 * DT).collect();
    let nominal = vec![1.0; joint.sizes().states];
    let options = Options { tolerance: 1e-10, ..Options::default() };
    let truth = simulate(joint, q, &nominal, options, &drive, &t).unwrap();
    let rng = &mut StdRng::seed_from_u64(seed);
    let noise = NOISE.map(|s| Normal::new(0.0, s).unwrap());
    let mut channel = |c: usize, output: usize| Channel {
        output,
        variance: NOISE[c].powi(2),
        delay: 0.0,
        samples: truth.y.iter().map(|y| Some(Sample::at_node(y[output] + noise[c].sample(rng)))).collect(),
    };
    Recording {
        dt: DT,
        inputs: (0..nodes).map(|k| [current(k), 0.0]).collect(),
        input_variance: [0.0; 2],
        channels: vec![channel(0, output::MOTOR_ANGLE), channel(1, output::LOAD_ANGLE)],
        resolved_speed: NOISE[0] / DT,
        friction: Vec::new(),
    }
}

/// What a model does beyond another one, passed by a filter.
fn passed(found: &Found, with: &Model, without: &Model, recording: &Recording, scale: f64) -> Vec<f64> {
    let inertia = [without.p[p::MOTOR_INERTIA], without.p[p::LOAD_INERTIA]];
    let [with, without] =
        [with, without].map(|m| Along::new(m, recording, &found.trajectory, inertia, Parts::ALL));
    pass(found, &with.beyond(&without).scaled(scale))
}

fn pass(found: &Found, column: &Column) -> Vec<f64> {
    found.filter.columns(&found.system, &[column.parts()]).remove(0)
}

/// A constant error of the load's reading, per rad.
fn load_error(recording: &Recording) -> Column {
    Column { torques: Vec::new(), errors: [0.0, 1.0].repeat(recording.nodes()) }
}

/// What a parameter does per unit of its logarithm.
fn parameter(found: &Found, model: &Model, index: usize, recording: &Recording) -> Vec<f64> {
    let moved = |by: f64| {
        let mut p = model.p.to_vec();
        p[index] *= 1.0 + by;
        p
    };
    let (up, down) = (moved(1e-4), moved(-1e-4));
    let of = |p| Model { p, ..model.clone() };
    passed(found, &of(&up), &of(&down), recording, 0.5e4)
}

fn joint(effects: &[&str]) -> Compiled<TwoMassJoint> {
    Compiled::new(TwoMassJoint::new(true, effects).unwrap())
}

fn latent(deviation: [f64; 2]) -> [Latent; 2] {
    deviation.map(|deviation| Latent { deviation, time: 0.1 })
}

struct Found {
    system: System<N, PLACES>,
    filter: Filter<N>,
    whitened: Vec<f64>,
    smoothed: Smoothed<N, PLACES>,
    trajectory: Vec<[f64; 4]>,
}

/// Linearised about what the sensors show, then three times about what was smoothed.
fn found(model: &Model, recording: &Recording) -> Found {
    let mut trajectory = sensed_trajectory(model, recording);
    let mut torques = vec![[0.0; 2]; trajectory.len() - 1];
    for round in 0.. {
        let system = model.about(recording, &trajectory, &torques).system;
        let filter = Filter::new(&system);
        let pass = filter.data(&system, true);
        let all = smooth(&system, &filter, &pass, true);
        if round == 3 {
            return Found { system, filter, whitened: pass.whitened, smoothed: all, trajectory };
        }
        (trajectory, torques) = smoothed_trajectory(&trajectory, &all);
    }
    unreachable!()
}

fn rms(all: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = all.fold((0.0, 0), |(s, n), v| (s + v * v, n + 1));
    (sum / f64::from(count)).sqrt()
}

/// A torque on the load is read off the load's latent torque, within the deviations that it tells.
#[test]
fn an_unmeasured_torque_is_seen_where_it_acts() {
    let (joint, q) = (joint(&[]), drive());
    let push = |t: f64| if (3.0..5.0).contains(&t) { 1.5 } else { 0.4 * (1.7 * t).sin() };
    let recording = record(&joint, &q, 3, push);
    let model = Model { joint: &joint, p: &q, latent: latent([2e-4, 0.5]) };
    let found = found(&model, &recording);
    let off = |k: usize| {
        let sd = found.smoothed.covariances[k][(N - 1, N - 1)].sqrt();
        let seen = found.smoothed.states[k][N - 1];
        ((seen - push(k as f64 * DT)), sd)
    };
    let inner = 100..2400;
    let quiet = |k: &usize| ![3.0, 5.0].iter().any(|e| (*k as f64 * DT - e).abs() < 0.3);
    let error = rms(inner.clone().filter(quiet).map(|k| off(k).0));
    let scaled = rms(inner.clone().filter(quiet).map(|k| off(k).0 / off(k).1));
    let motor = rms(inner.map(|k| found.smoothed.states[k][N - 2]));
    println!("load torque off by {error:.3} N.m rms ({scaled:.2} deviations); motor {motor:.1e} N.m");
    assert!(error < 0.15 && scaled < 1.5, "{error} {scaled}");
    // A tenth of friction's level: nothing is put down to the motor.
    assert!(motor < 5e-4, "{motor}");
}

/// Without anything unmodelled the innovations are white with variance 1, and more intense latent torques are less likely.
#[test]
fn innovations_of_the_right_model_are_white() {
    let (joint, q) = (joint(&[]), drive());
    let recording = record(&joint, &q, 5, |_| 0.0);
    let likelihood = |scale: f64| {
        let model = Model { joint: &joint, p: &q, latent: latent([1e-4 * scale, 0.02 * scale]) };
        let found = found(&model, &recording);
        (log_likelihood(found.filter.log_determinant, &found.whitened), found)
    };
    let ((small, found), (large, _)) = (likelihood(1.0), likelihood(30.0));
    let power = found.whitened.iter().map(|e| e * e).sum::<f64>() / found.whitened.len() as f64;
    let lag: f64 =
        found.whitened.chunks_exact(2).collect::<Vec<_>>().windows(2).map(|w| w[0][0] * w[1][0]).sum();
    let lag = lag / (0.5 * found.whitened.len() as f64);
    println!("innovations: power {power:.3}, lag one {lag:+.3}; {small:.0} nats, {large:.0} at 30 times");
    assert!((power - 1.0).abs() < 0.1 && lag.abs() < 0.08, "{power} {lag}");
    assert!(small > large + 100.0, "{small} {large}");
}

/// Parameters from columns, linearised anew, with the deviations that they tell.
#[test]
fn parameters_come_back_with_their_deviations() {
    let (joint, truth) = (joint(&[]), drive());
    let fitted = [p::STIFFNESS, p::VISCOUS_FRICTION, p::COULOMB_FRICTION, p::LOAD_INERTIA];
    let mut z = Vec::new();
    for seed in 0..4 {
        let recording = record(&joint, &truth, 20 + seed, |_| 0.0);
        let mut q = truth.clone();
        fitted.iter().zip([1.15, 0.8, 1.1, 0.9]).for_each(|(i, f)| q[*i] *= f);
        q[p::STATIC_FRICTION] = q[p::COULOMB_FRICTION];
        let mut last = None;
        for _ in 0..6 {
            let model = Model { joint: &joint, p: &q, latent: latent([1e-4, 0.02]) };
            let found = found(&model, &recording);
            let column = |i: &usize| parameter(&found, &model, *i, &recording);
            let mut columns: Vec<Vec<f64>> = fitted.iter().map(column).collect();
            columns.push(pass(&found, &load_error(&recording)));
            let mut gram = Gram::new(columns.len());
            gram.add(&found.whitened, &columns, found.filter.log_determinant);
            // About where it is now.
            let mut set: Vec<(usize, Prior)> =
                (0..4).map(|k| (k, Prior { mean: 0.0, deviation: 0.3 })).collect();
            set.push((4, Prior { mean: 0.0, deviation: 1e-3 }));
            let posterior = gram.posterior(&set).unwrap();
            fitted.iter().enumerate().for_each(|(k, i)| q[*i] *= posterior.mean[k].clamp(-0.3, 0.3).exp());
            q[p::STATIC_FRICTION] = q[p::COULOMB_FRICTION];
            last = Some(posterior);
        }
        let posterior = last.unwrap();
        for (k, i) in fitted.iter().enumerate() {
            let (off, sd) = ((q[*i] / truth[*i]).ln(), posterior.covariance[(k, k)].sqrt());
            println!("seed {seed} parameter {i}: off by {off:+.4}, {:+.2} deviations", off / sd);
            z.push(off / sd);
            assert!(sd < 0.1, "{sd}");
        }
    }
    assert!(rms(z.iter().copied()) < 1.5 && z.iter().all(|z| z.abs() < 3.5), "{z:?}");
}

/// An effect's column at its size explains what the effect did; another effect's does not.
#[test]
fn the_effect_that_acts_has_the_evidence() {
    let (plain, mut q) = (joint(&[]), drive());
    let sealed = joint(&["gravity-torque"]);
    let names: Vec<&str> = vec!["gravity-torque", "nonlinear-stiffness", "torque-ripple"];
    let with = |joint: &TwoMassJoint| {
        let mut q = q.clone();
        for e in joint.effects().iter() {
            q.extend(e.choice.parameters().iter().map(|p| p.joint_start));
        }
        q.resize(joint.sizes().parameters, 0.0);
        q
    };
    let truth = with(&sealed);
    let recording = record(&sealed, &truth, 9, |_| 0.0);
    let models: Vec<(Compiled<TwoMassJoint>, Vec<f64>)> =
        names.iter().map(|n| joint(&[n])).map(|j| (j.clone(), with(&j))).collect();
    q.truncate(p::COUNT);
    let model = Model { joint: &plain, p: &q, latent: latent([1e-3, 0.3]) };
    let found = found(&model, &recording);
    let columns: Vec<Vec<f64>> = models
        .iter()
        .map(|(joint, p)| Model { joint, p, ..model.clone() })
        .map(|m| passed(&found, &m, &model, &recording, 1.0))
        .collect();
    let mut gram = Gram::new(columns.len());
    gram.add(&found.whitened, &columns, found.filter.log_determinant);
    let none = gram.log_likelihood();
    let gain: Vec<f64> = (0..columns.len())
        .map(|k| gram.posterior(&[(k, Prior { mean: 0.0, deviation: 3.0 })]).unwrap())
        .map(|p| p.log_evidence - none)
        .collect();
    let amplitude = gram.posterior(&[(0, Prior { mean: 0.0, deviation: 3.0 })]).unwrap();
    println!("gains in nats {names:?}: {gain:.1?}; amplitude {:.3}", amplitude.mean[0]);
    assert!(gain[0] > 20.0 && gain[0] > gain[1] + 10.0 && gain[0] > gain[2] + 10.0, "{gain:?}");
    assert!((amplitude.mean[0] - 1.0).abs() < 5.0 * amplitude.covariance[(0, 0)].sqrt() + 0.1);
}
