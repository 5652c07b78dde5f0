//! Golden facts D01-D12: gearbox, modes and stick-slip of the two-mass joint.
//!
//! Figures of the fact list; the joint is DELIAN's joint 1 unless stated.

#![allow(clippy::unwrap_used)]

use trueup_models::gearbox::{Stage, printed_damping, series};
use trueup_models::joint::{TwoMassJoint, TwoStageJoint, output, parameter as p};
use trueup_models::presets::delian;
use trueup_numerics::Scalar;
use trueup_numerics::driver::{DriverOptions, SimulationRecord, simulate};
use trueup_numerics::hybrid::{At, EventUpdate, Hybrid, ModelSizes};

const NO_EFFECTS: &[&str] = &[];

fn joint() -> TwoMassJoint {
    TwoMassJoint::new(true, NO_EFFECTS).unwrap()
}

fn run(model: &impl Hybrid, q: &[f64], current: impl Fn(f64) -> f64, times: &[f64]) -> SimulationRecord {
    // The load turns n times slower than the motor.
    let n = q[p::GEAR_RATIO];
    let options = DriverOptions { tolerance: 1e-11, ..DriverOptions::default() };
    simulate(model, q, &[1.0, 100.0, 1.0, 100.0 / n], options, &|t, u| u[0] = current(t), times).unwrap()
}

fn grid(stop: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| stop * k as f64 / n as f64).collect()
}

/// Checks GB-1.
#[test]
fn d01_d02_d03_two_stages_in_series() {
    let pl = Stage { inertia: 0.0, stiffness: 3.0, damping: 0.02, ratio: 5.0 };
    let hd = Stage { inertia: 0.0, stiffness: 40.0, damping: 0.7, ratio: 100.0 };
    let e = series(&pl, &hd, 1.0, 1.0);
    // D01: the compliances of the two stages add on the motor side.
    let compliance = 1.0 / pl.stiffness + pl.ratio * pl.ratio / hd.stiffness;
    assert!((e.stiffness * compliance - 1.0).abs() < 1e-12);
    assert_eq!(e.ratio, 500.0);
    // D02: slope of the complex stiffness of the series at zero frequency.
    let w = 1e-6;
    let inverse = |re: f64, im: f64| (re / (re * re + im * im), -im / (re * re + im * im));
    let (a, b) = (inverse(pl.stiffness, w * pl.damping), inverse(hd.stiffness, w * hd.damping));
    let exact = inverse(a.0 + pl.ratio.powi(2) * b.0, a.1 + pl.ratio.powi(2) * b.1).1 / w;
    assert!((e.damping / exact - 1.0).abs() < 1e-9);
    // D03: the printed formula is twice too large for two equal stages.
    let s = Stage { ratio: 1.0, ..pl };
    assert!((printed_damping(&s, &s) / series(&s, &s, 0.0, 0.0).damping - 2.0).abs() < 1e-12);
}

/// Checks GB-1: with its stages a joint moves as with the equivalent of both, and shows that; with an effect whose parameters are
/// behind its own.
#[test]
fn a_joint_of_two_stages_moves_as_its_equivalent() {
    for effects in [&[][..], &["backlash"]] {
        let one = TwoMassJoint::new(true, effects).unwrap();
        let two = TwoStageJoint::new(one.clone()).unwrap();
        let (s, mut own) = (*two.places(), two.defaults());
        own[s.planetary_inertia] = 3e-8;
        own[s.harmonic_drive_inertia] = 2e-5;
        own[s.harmonic_drive_stiffness] *= 3.0;
        own[s.harmonic_drive_damping] *= 0.2;
        own[s.planetary_ratio] *= 0.5;
        own[s.initial_motor_velocity] = 4.0;
        let e = two.equivalent(&own);
        let mut q = delian(1).unwrap().to_vec();
        (q[p::STIFFNESS], q[p::DAMPING], q[p::GEAR_RATIO]) = (e.stiffness, e.damping, e.ratio);
        (q[p::MOTOR_INERTIA], q[p::LOAD_INERTIA]) = (e.motor_inertia, e.load_inertia);
        q[p::INITIAL_MOTOR_VELOCITY] = 4.0;
        let of_effects = one.sizes().parameters - p::COUNT;
        own.resize(own.len() + of_effects, 0.01);
        q.resize(q.len() + of_effects, 0.01);
        let current = |t: f64, u: &mut [f64]| u[0] = 0.02 * (3.0 * t).sin();
        let (times, options) = (grid(2.0, 50), DriverOptions { tolerance: 1e-9, ..DriverOptions::default() });
        let nominal = [1.0, 100.0, 1.0, 100.0 / e.ratio];
        let a = simulate(&one, &q, &nominal, options.clone(), &current, &times).unwrap();
        let b = simulate(&two, &own, &nominal, options, &current, &times).unwrap();
        for (a, b) in a.y.iter().zip(&b.y) {
            assert_eq!(b[..a.len()], a[..]);
            assert_eq!(b[a.len()..], [e.stiffness, e.damping, e.ratio]);
        }
        assert!(a.y.iter().any(|y| y[output::LOAD_ANGLE].abs() > 1e-7));
    }
    let rigid = TwoMassJoint::new(false, NO_EFFECTS).unwrap();
    assert!(TwoStageJoint::new(rigid).unwrap_err().contains("rigid"));
}

#[test]
fn d04_stiffness_at_the_output() {
    let out = |n: f64, k: f64| n * n * k;
    assert!((out(21750.0, delian(2).unwrap()[p::STIFFNESS]) - 10407.375).abs() < 0.01);
    let k1 = delian(1).unwrap()[p::STIFFNESS];
    assert!((out(21750.0, k1) - 14523.02).abs() < 0.01 && (out(44340.0, k1) - 60357.29).abs() < 0.01);
}

/// Frequency in rad/s of a free oscillation from the upward zero crossings, by cubic interpolation.
fn frequency(t: &[f64], signal: &[f64]) -> f64 {
    let mut crossings = Vec::new();
    for i in (1..t.len() - 2).filter(|i| signal[*i] <= 0.0 && signal[*i + 1] > 0.0) {
        let v = &signal[i - 1..i + 3];
        let cubic = |s: f64| {
            let l = [
                -s * (s - 1.0) * (s - 2.0) / 6.0,
                (s + 1.0) * (s - 1.0) * (s - 2.0) / 2.0,
                -(s + 1.0) * s * (s - 2.0) / 2.0,
                (s + 1.0) * s * (s - 1.0) / 6.0,
            ];
            (0..4).map(|k| v[k] * l[k]).sum::<f64>()
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if cubic(middle) <= 0.0 { low = middle } else { high = middle }
        }
        crossings.push(t[i] + (t[i + 1] - t[i]) * low);
    }
    2.0 * std::f64::consts::PI * (crossings.len() - 1) as f64
        / (crossings[crossings.len() - 1] - crossings[0])
}

/// Checks TMJ-2 and TMJ-3.
#[test]
fn d05_d06_antiresonance_and_resonance_of_joint_2() {
    let mut q = delian(2).unwrap();
    (q[p::DAMPING], q[p::VISCOUS_FRICTION]) = (0.0, 0.0);
    q[p::INITIAL_LOAD_ANGLE] = 1e-6;
    let times = grid(6.0, 12_000);
    // Motor locked: it sticks, friction being larger than the spring torque.
    let locked = run(&joint(), &q, |_| 0.0, &times);
    assert!(locked.events.is_empty());
    let load: Vec<f64> = locked.y.iter().map(|y| y[output::LOAD_ANGLE]).collect();
    let w_a = frequency(&times, &load);
    assert!((w_a / 41.64807918740071 - 1.0).abs() < 1e-9, "{w_a}");
    // Motor free.
    (q[p::COULOMB_FRICTION], q[p::STATIC_FRICTION]) = (0.0, 0.0);
    let free = run(&joint(), &q, |_| 0.0, &times);
    let twist: Vec<f64> = free.y.iter().map(|y| -y[output::TRANSMISSION_TORQUE]).collect();
    let w_r = frequency(&times, &twist);
    assert!((w_r / 43.793787611182175 - 1.0).abs() < 1e-9, "{w_r}");
    let ratio = (1.0 + q[p::LOAD_INERTIA] / (q[p::GEAR_RATIO].powi(2) * q[p::MOTOR_INERTIA])).sqrt();
    assert!((w_r / w_a / ratio - 1.0).abs() < 1e-9 && (ratio - 1.0515199852105204).abs() < 1e-12);
}

#[test]
fn d07_no_motion_below_the_static_level() {
    let r = run(&joint(), &delian(1).unwrap(), |_| 2.98e-4 / 0.02, &grid(5.0, 50));
    assert!(r.y.iter().all(|y| y[output::MOTOR_ANGLE] == 0.0 && y[output::STICKING] == 1.0));
}

/// A millionth of the static level decides, in both directions. Checks TMJ-4.
#[test]
fn break_away_levels_of_both_directions() {
    let q = delian(1).unwrap();
    for side in [1.0, -1.0] {
        let turned = |factor: f64| {
            run(&joint(), &q, |_| side * factor * 2.99e-4 / 0.02, &[0.0, 1.0]).y[1][output::MOTOR_ANGLE]
        };
        assert_eq!(turned(1.0 - 1e-6), 0.0, "{side}");
        assert!(side * turned(1.0 + 1e-6) > 100.0, "{side}: {}", turned(1.0 + 1e-6));
    }
}

/// Checks TMJ-1 and TMJ-4.
#[test]
fn d08_d09_d10_breakaway_terminal_speed_and_hysteresis() {
    let q = delian(1).unwrap();
    // D09: at break-away the level drops from tau_s to tau_c.
    let r = run(&joint(), &q, |_| 2.99e-4 / 0.02 * (1.0 + 1e-12), &[0.0]);
    assert!((r.y[0][output::MOTOR_ACCELERATION] - 1877.5).abs() < 1e-6);
    // D08.
    let r = run(&joint(), &q, |_| 3.0e-4 / 0.02, &[0.0, 40.0]);
    assert!((r.y[1][output::MOTOR_VELOCITY] - 3143.0555555).abs() < 0.01);
    // D10: 2.0e-4 N.m keeps it running but does not start it.
    let r = run(&joint(), &q, |t| if t < 1.0 { 3.0e-4 / 0.02 } else { 2.0e-4 / 0.02 }, &[0.0, 1.0, 60.0]);
    assert!((r.y[2][output::MOTOR_VELOCITY] - 1754.1666667).abs() < 0.01);
    let r = run(&joint(), &q, |_| 2.0e-4 / 0.02, &[0.0, 10.0]);
    assert_eq!(r.y[1][output::MOTOR_VELOCITY], 0.0);
}

/// Checks TMJ-4 and TMJ-5.
#[test]
fn d12_coast_down() {
    // Motor and load run at 1000 rad/s together; the closed form takes them for one mass.
    let mut q = delian(1).unwrap();
    q[p::INITIAL_MOTOR_VELOCITY] = 1000.0;
    q[p::INITIAL_LOAD_VELOCITY] = 1000.0 / q[p::GEAR_RATIO];
    let r = run(&joint(), &q, |_| 0.0, &[0.0, 2.0]);
    assert!((r.events[0].0 - 1.1744293583658065).abs() < 0.005, "{}", r.events[0].0);
    // The rigid joint is one mass: there the closed form is exact.
    let rigid = TwoMassJoint::new(false, NO_EFFECTS).unwrap();
    let r = run(&rigid, &q, |_| 0.0, &[0.0, 2.0]);
    assert!((r.events[0].0 - 1.1744293583658065).abs() < 1e-9, "{}", r.events[0].0);
}

/// The joint with one more state: work done on it less the losses.
struct Audited(TwoMassJoint);

impl Hybrid for Audited {
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
        let mut y = [T::zero(); output::COUNT];
        self.0.outputs(at, &mut y);
        let q = at.p;
        let rate = at.x[1] - q[p::GEAR_RATIO] * at.x[3];
        dx[n] = y[output::MOTOR_TORQUE] * at.x[1] + at.u[1] * at.x[3]
            - y[output::FRICTION_TORQUE] * at.x[1]
            - q[p::DAMPING] * rate * rate;
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

#[test]
fn d11_energy_balance_of_a_stick_slip_run() {
    let q = delian(1).unwrap();
    let model = Audited(joint());
    let current = |t: f64| if (t * 20.0 + 1e-9) as i64 % 8 == 0 { 0.016 } else { 0.0 };
    let r = run(&model, &q, current, &grid(3.2, 64));
    assert!(r.events.len() >= 8, "{} events", r.events.len());
    let energy = |x: &[f64]| {
        let twist = x[2];
        0.5 * (q[p::MOTOR_INERTIA] * x[1] * x[1]
            + q[p::LOAD_INERTIA] * x[3] * x[3]
            + q[p::STIFFNESS] * twist * twist)
    };
    let peak = r.x.iter().map(|x| energy(x)).fold(0.0, f64::max);
    let worst = r.x.iter().map(|x| (energy(x) - x[4]).abs()).fold(0.0, f64::max);
    println!("energy balance over {} events: {:.1e} of the peak", r.events.len(), worst / peak);
    assert!(worst < 1e-6 * peak);
}
