//! Several runs of one model that differ in where they begin: their laws are computed once.

use trueup_identification::predict::{InputMap, KeptLaws, Prediction, PredictionPlan, predict_again};
use trueup_identification::run::{IdentificationRun, InputDrive, InputInterpolation, OutputChannel};
use trueup_models::joint::{input, output, parameter as p};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::At;
use trueup_plant::{Lanes, Plant};

use crate::plants::joint;

/// Parameters of which each has a derivative of its own.
const BEGINS: [usize; 4] =
    [p::INITIAL_MOTOR_ANGLE, p::INITIAL_MOTOR_VELOCITY, p::INITIAL_LOAD_ANGLE, p::INITIAL_LOAD_VELOCITY];

/// Two seconds through stick and slip, samples of the current and readings at times of their own.
fn plan(jitter: f64) -> PredictionPlan {
    let t = |n: usize, h: f64| -> Vec<f64> {
        (0..n).map(|k| h * (k as f64 + jitter * (7.0 * k as f64).sin())).map(|t| t.max(0.0)).collect()
    };
    let drive = InputDrive {
        input: input::MOTOR_CURRENT,
        u: t(400, 5e-3).iter().map(|t| 0.4 * (3.0 * t).sin() + 0.2 * (19.0 * t).sin()).collect(),
        t: t(400, 5e-3),
        between: InputInterpolation::Linear,
        ..InputDrive::default()
    };
    let channel = |output| OutputChannel {
        output,
        t: t(250, 8e-3),
        y: vec![0.0; 250],
        sigma: 1e-4,
        ..OutputChannel::default()
    };
    let channels = vec![channel(output::MOTOR_ANGLE), channel(output::LOAD_VELOCITY)];
    let run = IdentificationRun { drives: vec![drive], channels, ..IdentificationRun::default() };
    PredictionPlan::new(&run, 2)
}

fn largest(one: &[f64], other: &[f64]) -> f64 {
    let size = one.iter().fold(0.0, |s: f64, v| s.max(v.abs()));
    one.iter().zip(other).fold(0.0, |s: f64, (a, b)| s.max((a - b).abs())) / size
}

/// With constant laws a run has the same readings, events and derivatives by where it begins as with laws that carry derivatives.
#[test]
fn constant_laws_give_the_same_run_and_the_same_derivatives() {
    let model = joint(&[]);
    for jitter in [0.0, 0.2] {
        let plan = plan(jitter);
        let mut begins = model.defaults();
        let kept = KeptLaws::default();
        for start in [0.0, 0.01] {
            begins[p::INITIAL_LOAD_ANGLE] = start;
            begins[p::INITIAL_MOTOR_ANGLE] = start * begins[p::GEAR_RATIO] + 0.002;
            let run = |friction: bool, kept: &KeptLaws| -> Prediction<Lanes> {
                let mut q: Vec<Lanes> = begins.iter().map(|v| Lanes::constant(*v)).collect();
                BEGINS.iter().enumerate().for_each(|(lane, at)| q[*at].eps[lane] = 1.0);
                // A parameter of the law with a derivative: its matrices have derivatives, too.
                q[p::VISCOUS_FRICTION].eps[7] = f64::from(u8::from(friction));
                predict_again(model.plant(), &plan, &q, &InputMap::default(), false, kept).unwrap()
            };
            let values =
                predict_again(model.plant(), &plan, &begins, &InputMap::default(), false, &kept).unwrap();
            let [own, constant] = [true, false].map(|friction| run(friction, &kept));
            assert!(own.events.len() > 1, "it sticks and slips: {:?}", own.events.len());
            let modes = |run: &Prediction<Lanes>| run.events.iter().map(|e| e.1.clone()).collect::<Vec<_>>();
            assert_eq!(modes(&own), modes(&constant));
            let plain = |run: &Prediction<Lanes>| run.y.iter().map(|y| y.re).collect::<Vec<_>>();
            assert!(largest(&plain(&own), &plain(&constant)) < 1e-12);
            assert_eq!(plain(&constant), values.y, "with kept laws of another start");
            let alone = run(false, &KeptLaws::default());
            assert_eq!(plain(&alone), plain(&constant));
            for lane in 0..BEGINS.len() {
                let slope = |run: &Prediction<Lanes>| run.y.iter().map(|y| y.eps[lane]).collect::<Vec<_>>();
                let apart = largest(&slope(&own), &slope(&constant));
                assert!(apart < 1e-9, "lane {lane}, jitter {jitter}: {apart}");
            }
        }
    }
}

/// A model with other values has laws of its own.
#[test]
fn kept_laws_are_those_of_the_values() {
    let (model, plan, kept) = (joint(&[]), plan(0.0), KeptLaws::default());
    let mut q = model.defaults();
    let mut all = Vec::new();
    for stiffness in [1.0, 1.2, 1.0] {
        let mut q = q.clone();
        q[p::STIFFNESS] *= stiffness;
        all.push(predict_again(model.plant(), &plan, &q, &InputMap::default(), false, &kept).unwrap().y);
    }
    assert_eq!(all[0], all[2]);
    q[p::STIFFNESS] *= 1.2;
    let alone = predict_again(model.plant(), &plan, &q, &InputMap::default(), false, &KeptLaws::default());
    assert_eq!(all[1], alone.unwrap().y);
    assert!(largest(&all[0], &all[1]) > 1e-6);
}

/// Steps take the own rate of bristles from a difference, which is the derivative where rates of what follows are affine in it.
#[test]
fn a_difference_over_a_strain_is_the_own_rate_of_bristles() {
    for effect in ["presliding-friction", "load-friction", "transmission-hysteresis"] {
        let joint = joint(&[effect]);
        let (model, p): (&dyn Plant, Vec<f64>) = (joint.plant(), joint.defaults());
        let sizes = model.sizes();
        let (row, modes, u) = (model.followers()[0], vec![1; sizes.modes], vec![0.1; sizes.inputs]);
        for strain in [-1.0, -0.3, 0.0, 0.7, 1.2] {
            let rate = |strain: f64| {
                let mut x = vec![0.0; sizes.states];
                (x[1], x[2], x[3], x[row]) = (12.0, 0.02, 0.4, strain);
                let mut dx = vec![0.0; sizes.states];
                model.rates(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, &[], &mut dx);
                (dx[row], x)
            };
            let ((here, x), (there, _)) = (rate(strain), rate(strain + 1.0));
            let lanes = |v: &[f64]| v.iter().map(|v| Lanes::constant(*v)).collect::<Vec<_>>();
            let (p, u, mut x, mut dx) = (lanes(&p), lanes(&u), lanes(&x), lanes(&x));
            x[row].eps[0] = 1.0;
            let at = At { t: Lanes::constant(0.0), x: &x, u: &u, p: &p, modes: &modes };
            model.rates_lanes(at, &[], &mut dx);
            let exact = dx[row].eps[0];
            assert!(exact < 0.0 && ((there - here) / exact - 1.0).abs() < 1e-12, "{effect}: {exact}");
        }
    }
}
