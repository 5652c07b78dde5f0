//! A payload that changes: what an adaptive wave frequency leaves of the vibration, compared with constant ones.
//!
//! Joint 2 of DELIAN with its flexible link, 1 kHz; the tip's inertia is 0.25 to 4 times 6 kg.m2.

use super::bench::{Bench, SMOOTH, controller};
use super::chain::{INERTIA, STIFFNESS, vibration};
use trueup_models::controller::{Strategy, adaptation::parameter as a, parameter};

const FACTORS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];

/// First mode with the motor locked, in rad/s.
fn mode(tip: f64) -> f64 {
    let [k1, k2] = STIFFNESS;
    let (sum, product) = ((k1 + k2) / INERTIA[1] + k2 / tip, k1 * k2 / (INERTIA[1] * tip));
    ((sum - (sum * sum - 4.0 * product).sqrt()) / 2.0).sqrt()
}

/// The experiment.
#[derive(Clone, Copy)]
struct Case {
    name: &'static str,
    /// Dry friction, sensors with steps, velocities by differences, 0.25 A at most.
    real: bool,
    gain: f64,
    /// In rad.
    step: f64,
    /// In s.
    time: f64,
}

const REAL: Case =
    Case { name: "dry friction, real sensors, 2 deg", real: true, gain: 2.5, step: 0.0349, time: 10.0 };
/// Golden fact D24, at a gain that P/PI bears with every payload.
const LINEAR: Case = Case { name: "linear, 1 rad", real: false, gain: 1.5, step: 1.0, time: 15.0 };

impl Case {
    /// What is left of the tip's vibration, and the wave frequency at the end.
    fn left(&self, strategy: Strategy, omega: f64, rate: f64, ratio: f64, factor: f64) -> (f64, f64) {
        let tip = INERTIA[2] * factor;
        let bench = Bench {
            effects: &["flexible-link"],
            with: [tip, STIFFNESS[1], 0.966],
            inertia: INERTIA[1],
            friction: if self.real { [7.37e-5, 2.99e-4] } else { [0.0; 2] },
            quantised: self.real,
            ..SMOOTH
        };
        let mut p = controller(strategy, omega, 1e-3, rate);
        p[parameter::POSITION_GAIN] = self.gain;
        if !self.real {
            p[parameter::LIMIT] = 1e6;
        }
        p[a::first(1) + a::RATIO] = ratio;
        // The bounds are those of the mode, 5 to 100 rad/s.
        (p[a::first(1) + a::MIN], p[a::first(1) + a::MAX]) = (5.0 * ratio, 100.0 * ratio);
        let seen = bench.run(&p, self.time, |_| self.step);
        let window = (core::f64::consts::TAU / mode(tip) / 1e-3) as usize | 1;
        (vibration(&seen.angle, window), seen.omega[seen.omega.len() - 1])
    }

    /// By how many per cent less than with P/PI, for each payload.
    fn constant(&self, base: &[f64], factors: &[f64], strategy: Strategy, omega: f64) -> Vec<f64> {
        let less = |(f, b): (&f64, &f64)| 100.0 * (1.0 - self.left(strategy, omega, 0.0, 1.0, *f).0 / b);
        factors.iter().zip(base).map(less).collect()
    }

    /// The same of an adaptive law in its first step from 41.648 rad/s, and in a step with what that one taught; and the
    /// frequencies that it had in the end.
    fn adaptive(&self, base: &[f64], factors: &[f64], strategy: Strategy, ratio: f64) -> [Vec<f64>; 3] {
        let mut all = [vec![], vec![], vec![]];
        for (f, b) in factors.iter().zip(base) {
            let start = 41.648f64.max(5.0 * ratio);
            let (first, taught) = self.left(strategy, start, 2.0, ratio, *f);
            let (then, end) = self.left(strategy, taught, 2.0, ratio, *f);
            all[0].push(100.0 * (1.0 - first / b));
            all[1].push(100.0 * (1.0 - then / b));
            all[2].push(end);
        }
        all
    }

    fn base(&self, factors: &[f64]) -> Vec<f64> {
        factors.iter().map(|f| self.left(Strategy::PPi, 41.648, 0.0, 1.0, *f).0).collect()
    }
}

fn mean(row: &[f64]) -> f64 {
    row.iter().sum::<f64>() / row.len() as f64
}

/// WBC: the frequency that follows the mode serves all payloads, each constant one some.
#[test]
fn follows_a_payload() {
    let (case, factors) = (REAL, [0.25, 4.0]);
    let base = case.base(&factors);
    let [_, then, ends] = case.adaptive(&base, &factors, Strategy::WbcAdaptive, 1.0);
    // The best constant for all five payloads: see below.
    let best = case.constant(&base, &factors, Strategy::Wbc, 10.0);
    println!("adaptive {then:.2?} % at {ends:.2?} rad/s, 10 rad/s {best:.2?} %");
    for ((f, end), (got, want)) in factors.iter().zip(&ends).zip(then.iter().zip(&best)) {
        assert!((end / mode(INERTIA[2] * f) - 1.0).abs() < 0.05, "{end} rad/s");
        assert!(got > &(want - 1.0));
    }
    assert!(mean(&then) > mean(&best) + 0.5);
}

/// The whole table, printed. VWBC is better the higher its frequency, whatever the payload: there the best constant
/// is ahead of what follows the mode.
#[test]
#[ignore = "400 runs"]
fn table_of_payloads() {
    for case in [REAL, LINEAR] {
        let base = case.base(&FACTORS);
        let modes = FACTORS.map(|f| mode(INERTIA[2] * f));
        println!("{}, K_p = {}: P/PI {base:.5?} rad, modes {modes:.2?} rad/s", case.name, case.gain);
        table(case, &base, Strategy::Wbc, Strategy::WbcAdaptive);
        table(case, &base, Strategy::Vwbc, Strategy::VwbcAdaptive);
    }
}

fn table(case: Case, base: &[f64], strategy: Strategy, adapting: Strategy) {
    let mut best = f64::NEG_INFINITY;
    for omega in [5.0, 7.0, 10.0, 15.0, 20.0, 30.0, 41.648, 60.0, 100.0, 200.0, 400.0, 600.0] {
        let row = case.constant(base, &FACTORS, strategy, omega);
        println!("  {strategy:?} at {omega} rad/s: {row:.2?}, mean {:.2} %", mean(&row));
        best = best.max(mean(&row));
    }
    for ratio in [0.7, 1.0, 2.0, 4.0, 8.0] {
        let [first, then, ends] = case.adaptive(base, &FACTORS, adapting, ratio);
        println!(
            "  {adapting:?}, {ratio} times the mode: {first:.2?}, mean {:.2} %; then {then:.2?}, mean {:.2} %, best constant \
             {best:.2} %; at {ends:.2?} rad/s",
            mean(&first),
            mean(&then)
        );
        if ratio == 1.0 {
            assert_eq!(mean(&then) > best, strategy == Strategy::Wbc);
        }
    }
}
