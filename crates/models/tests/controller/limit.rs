//! The limit of the output: continuous law, few events, no wind-up.

use super::chain::{
    CONTROLLER_STATES, INERTIA, LOOP, RUNNING, loop_rates, measured, parameters, response, with_adaptation,
};
use trueup_models::controller::{
    JointController, ManipulatorController, Strategy, input, output, parameter, state,
};
use trueup_numerics::{
    driver::{DriverOptions, simulate},
    hybrid::{At, Hybrid},
};

/// A step of the loop by the classical Runge-Kutta method with frozen modes.
fn rk4(p: &[f64], modes: &[i32], x: &[f64; LOOP], reference: f64, h: f64) -> [f64; LOOP] {
    let shifted = |k: &[f64; LOOP], c: f64| core::array::from_fn::<f64, LOOP, _>(|i| x[i] + c * h * k[i]);
    let f = |x: &[f64; LOOP]| loop_rates(p, modes, x, reference, 0.0);
    let k1 = f(x);
    let k2 = f(&shifted(&k1, 0.5));
    let k3 = f(&shifted(&k2, 0.5));
    let k4 = f(&shifted(&k3, 1.0));
    core::array::from_fn(|i| x[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]))
}

struct Step {
    /// Hub angle beyond the reference, as a share of the step.
    overshoot: f64,
    /// Hub angle at the end, as a share of the step.
    end: f64,
    events: usize,
}

/// The response to a step of the reference, with events at the ends of steps.
fn step(p: &[f64], reference: f64, time: f64) -> Step {
    let (h, limit) = (2e-4, p[parameter::LIMIT]);
    let (mut x, mut modes) = ([0.0; LOOP], [0; 5]);
    let (mut overshoot, mut events): (f64, _) = (0.0, 0);
    for k in 0..(time / h) as usize {
        let t = k as f64 * h;
        let u = measured(reference, &x[CONTROLLER_STATES..]);
        let before = modes;
        for pass in 0.. {
            assert!(pass < 4);
            if JointController.update(t, &mut x[..CONTROLLER_STATES], &u, p, &mut modes).settled() {
                break;
            }
        }
        events += usize::from(before != modes);
        let mut y = [0.0; output::COUNT];
        JointController.outputs(At { t, x: &x[..CONTROLLER_STATES], u: &u, p, modes: &modes }, &mut y);
        assert!(y[0].abs() <= limit);
        assert!(
            x[state::INTEGRAL_TORQUE].abs() <= limit * (1.0 + 1e-9),
            "the integral left the actuator's range"
        );
        x = rk4(p, &modes, &x, reference, h);
        overshoot = overshoot.max(x[CONTROLLER_STATES + 1] / reference - 1.0);
    }
    Step { overshoot, end: x[CONTROLLER_STATES + 1] / reference, events }
}

/// Checks CTL-7 and CTL-8. In deep saturation the integral, left alone, would grow with the step; limited it recovers without more
/// overshoot than the linear loop has.
#[test]
fn recovers_without_winding_up() {
    recovers(&[10.0]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn recovers_without_winding_up_at_any_size() {
    recovers(&[0.1, 1.0, 10.0]);
}

/// From steps of this size in rad.
fn recovers(steps: &[f64]) {
    for strategy in [Strategy::PPi, Strategy::Vwbc, Strategy::VwbcWashout] {
        let mut p = parameters(strategy, 1.0, 41.648);
        let linear = response(&p, [1.0, 0.0], 1e-3, 10_000);
        let linear = linear.iter().map(|x| x[CONTROLLER_STATES + 1] - 1.0).fold(0.0, f64::max);
        // The torque that decelerates the linear approach is K_p² e J: with twice that the limit must not show
        // at the end, although K_vp K_p e is 30 times the limit at the beginning.
        for &reference in steps {
            p[parameter::LIMIT] = 2.0 * INERTIA[0] * reference;
            let got = step(&p, reference, 10.0);
            println!(
                "{strategy:?}, step {reference}: overshoot {:.4} (linear {linear:.4}), {} events",
                got.overshoot, got.events
            );
            assert!(got.overshoot <= linear + 0.01, "{strategy:?}: {} against {linear}", got.overshoot);
            assert!((got.end - 1.0).abs() < 2e-3, "{strategy:?}: ends at {}", got.end);
            assert!(got.events < 20, "{strategy:?}: {} events", got.events);
        }
    }
}

/// At the limit itself both modes give the same rates and outputs, and the indicators leave their domain there.
#[test]
fn the_law_is_continuous_at_the_limit() {
    let mut p = parameters(Strategy::VwbcWashout, 2.0, 41.648);
    p[parameter::LIMIT] = 100.0;
    let mut x = [0.0; CONTROLLER_STATES];
    x[state::INTEGRAL_TORQUE] = 20.0;
    for side in [1, -1] {
        // K_vp (v_ff − 0) + z at the limit, by the feedforward.
        let speed = (f64::from(side) * 100.0 - 20.0) / p[parameter::VELOCITY_GAIN];
        let saturated = [1, 0, 0, side, 0];
        let evaluate = |speed: f64, modes: &[i32]| {
            let u = [0.0, speed, 0.0, 0.0, 0.0, 0.0];
            let at = At { t: 1.0, x: &x, u: &u, p: &p, modes };
            let (mut dx, mut y, mut z) = ([0.0; CONTROLLER_STATES], [0.0; output::COUNT], [0.0; 3]);
            JointController.rates(at, &mut dx);
            JointController.outputs(at, &mut y);
            JointController.indicators(at, &mut z);
            (dx, y, z)
        };
        let (free, stopped) = (evaluate(speed, &RUNNING), evaluate(speed, &saturated));
        for (a, b) in free.0.iter().zip(&stopped.0) {
            assert!((a - b).abs() < 1e-10);
        }
        assert!((free.1[0] - stopped.1[0]).abs() < 1e-12);
        let side_index = usize::from(side < 0);
        assert!(evaluate(speed * 0.999, &RUNNING).2[side_index] > 0.0);
        assert!(evaluate(speed * 1.001, &RUNNING).2[side_index] < 0.0);
        // Inputs that jump past the limit are limited before any event was handled.
        assert_eq!(evaluate(speed * 3.0, &RUNNING).1[0].abs(), 100.0);
    }
}

/// A feedforward that rises and falls at `a` rad/s², P_PI, all else at rest: the torque K_vp v_ff + z reaches the
/// limit L at t1 = −T_i + √(T_i² + 2 T_i L/(K_vp a)) and leaves it where K_vp v_ff = (L − z(t1)) exp(−(t − t1)/T_i).
#[test]
fn the_limit_is_reached_and_left_at_the_exact_times() {
    let (kv, ti, limit, a, top) = (50.0, 0.5, 40.0, 2.0, 1.0);
    let p = with_adaptation([2.0, kv, ti, 1.0, 1.0, limit, 1.0, 1.0, 0.0, 1.0]);
    let feedforward = |t: f64| a * if t < top { t } else { 2.0 * top - t };
    let inputs = |t: f64, u: &mut [f64]| {
        u.fill(0.0);
        u[1] = feedforward(t);
    };
    let times: Vec<f64> = (0..=10).map(|i| f64::from(i) * 0.2).collect();
    let options = DriverOptions { tolerance: 1e-12, ..DriverOptions::default() };
    let run =
        simulate(&JointController, &p, &[1.0; CONTROLLER_STATES], options, &inputs, &times).expect("runs");
    let reached = -ti + (ti * ti + 2.0 * ti * limit / (kv * a)).sqrt();
    let below = limit - kv * a * reached * reached / (2.0 * ti);
    let missing = |t: f64| below * (-(t - reached) / ti).exp();
    let (mut low, mut high) = (top, 2.0 * top);
    for _ in 0..60 {
        let t = 0.5 * (low + high);
        *(if kv * feedforward(t) > missing(t) { &mut low } else { &mut high }) = t;
    }
    let events: Vec<_> = run.events.iter().filter(|e| e.0 > 0.0).map(|e| (e.0, e.1[3])).collect();
    println!("limit reached and left at {events:?}, exact {reached}, {low}");
    assert_eq!(events.iter().map(|e| e.1).collect::<Vec<_>>(), [1, 0]);
    assert!((events[0].0 - reached).abs() < 1e-10 && (events[1].0 - low).abs() < 1e-10);
    // Well within the limit's interval.
    let z = run.x[4][state::INTEGRAL_TORQUE];
    assert!((z - limit + missing(times[4])).abs() < 1e-9 * limit);
}

#[test]
fn a_driver_stops_at_every_sample() {
    let mut p = parameters(Strategy::Vwbc, 2.0, 41.648);
    p[parameter::COUNT] = 1e-2;
    let inputs = |t: f64, u: &mut [f64]| u.fill(t.sin());
    let options = DriverOptions::default();
    let run = simulate(&JointController, &p, &[1.0; CONTROLLER_STATES], options, &inputs, &[0.0, 0.355, 1.0]);
    let mut times: Vec<f64> = run.expect("runs").events.iter().map(|e| e.0).collect();
    times.dedup();
    // The one at 0 belongs to the initialisation, the one at the end to the next call.
    assert_eq!(times, (1..100).map(|k| f64::from(k) * 1e-2).collect::<Vec<_>>());
}

/// Checks CTL-7: a torque that is added acts at once and is no error, so the integral does not take it up; at the limit neither winds up.
#[test]
fn an_added_torque_is_not_integrated() {
    let model = ManipulatorController { joints: 2 };
    let mut p = vec![0.0; model.sizes().parameters];
    for j in 0..2 {
        for (i, value) in [2.0, 50.0, 0.1, 1.0, 1.0, 30.0, 10.0, 1.0].into_iter().enumerate() {
            p[i * 2 + j] = value;
        }
    }
    p[parameter::COUNT * 2 + 1] = f64::from(Strategy::PPi as u8);
    let sizes = model.sizes();
    assert_eq!(sizes.inputs, (input::COUNT + 1) * 2);
    let mut u = vec![0.0; sizes.inputs];
    u[input::COUNT * 2..].copy_from_slice(&[12.0, -45.0]);
    let (mut x, mut modes) = (vec![0.0; sizes.states], vec![0; sizes.modes]);
    while !model.update(0.0, &mut x, &u, &p, &mut modes).settled() {}
    let at = At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes };
    let (mut y, mut dx) = (vec![0.0; sizes.outputs], vec![0.0; sizes.states]);
    model.outputs(at, &mut y);
    model.rates(at, &mut dx);
    assert_eq!(y[..2], [12.0, -30.0]);
    // Of the second joint 15 N.m are cut off: z goes to what then remains of the limit.
    assert_eq!(dx[state::INTEGRAL_TORQUE * 2..][..2], [0.0, 150.0]);
    // Sampled, by its exact lag.
    p[parameter::COUNT * 2] = 1e-3;
    let (mut x, mut modes) = (vec![0.0; sizes.states], vec![0; sizes.modes]);
    while !model.update(0.0, &mut x, &u, &p, &mut modes).settled() {}
    assert_eq!(x[state::HELD_OUTPUT * 2..][..2], [12.0, -30.0]);
    let z = &x[state::INTEGRAL_TORQUE * 2..][..2];
    assert!(z[0] == 0.0 && (z[1] - 15.0 * (1.0 - (-0.01_f64).exp())).abs() < 1e-12, "{z:?}");
}
