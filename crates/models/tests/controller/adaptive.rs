//! The wave frequency as it adapts: its filters, what it learns of a joint in motion, and what it leaves alone.

use super::bench::{Bench, Control, LOAD_STEP, MOTOR_STEP, RATIO, SMOOTH, Seen, controller};
use super::chain::{CONTROLLER_STATES, PARAMETERS, arranged};
use super::sampled::noise;
use trueup_models::controller::{
    JointController, ManipulatorController, Strategy, adaptation, adaptation::parameter as a, input, output,
    parameter, state,
};
use trueup_numerics::{
    Dual, Scalar,
    hybrid::{At, Hybrid},
};

const ADAPTIVE: [(Strategy, Strategy); 2] =
    [(Strategy::WbcAdaptive, Strategy::Wbc), (Strategy::VwbcAdaptive, Strategy::Vwbc)];

/// To and fro by 5 deg, 2 s each.
fn moves(t: f64) -> f64 {
    if ((t / 2.0) as usize).is_multiple_of(2) { 0.0873 } else { 0.0 }
}

/// A rate of 0 is the constant law bit by bit, with stick-slip, quantised sensors and a current at its limit,
/// sampled and continuous.
#[test]
fn a_rate_of_0_is_the_constant_law() {
    let bench = Bench { friction: [7.37e-5, 2.99e-4], quantised: true, ..SMOOTH };
    for (adaptive, constant) in ADAPTIVE {
        for h in [0.0, 1e-3] {
            let of = |s| bench.run(&controller(s, 41.648, h, 0.0), 5.0, moves);
            let (got, want) = (of(adaptive), of(constant));
            assert!(want.current.contains(&0.25) && want.current.iter().any(|i| i.abs() < 0.25));
            assert!(got.current.iter().zip(&want.current).all(|(a, b)| a.to_bits() == b.to_bits()));
            assert!(got.omega.iter().all(|w| *w == 41.648) && got.active.iter().all(|a| !a));
            assert!(want.omega.iter().all(|w| *w == 41.648) && want.active.iter().all(|a| !a));
        }
    }
}

/// The estimate finds √(K/J) of a rigid load, from a third and from three times it; sensors as good as you like and
/// with steps, sampled at 1 kHz and continuous.
#[test]
fn finds_the_mode_of_the_joint_with_the_motor_held() {
    finds_the_mode_with(6.0, &[(0.0, false)], &[(0, 3.0)]);
    finds_the_mode_with(6.0, &[(1e-3, true)], &[(1, 1.0 / 3.0)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn finds_the_mode_of_light_and_heavy_loads() {
    for inertia in [1.5, 6.0, 24.0] {
        let sensors = [(0.0, false), (1e-3, false), (1e-3, true)];
        finds_the_mode_with(inertia, &sensors, &[(0, 3.0), (0, 1.0 / 3.0), (1, 3.0), (1, 1.0 / 3.0)]);
    }
}

/// Of a load in kg.m², by a period and sensors with steps or not, by a law from that much of the mode.
fn finds_the_mode_with(inertia: f64, sensors: &[(f64, bool)], laws: &[(usize, f64)]) {
    for &(h, quantised) in sensors {
        for &(law, factor) in laws {
            let (strategy, _) = ADAPTIVE[law];
            let bench = Bench { inertia, quantised, ..SMOOTH };
            let start = factor * bench.mode();
            let seen = bench.run(&controller(strategy, start, h, 2.0), 16.0, moves);
            let (end, off) = (seen.omega[16_000], 100.0 * (seen.omega[16_000] / bench.mode() - 1.0));
            println!(
                "{strategy:?}, {inertia} kg.m2, T_s {h} s, steps {quantised}: {start:.2} -> {end:.3} rad/s, off by {off:.2} %"
            );
            assert!((seen.omega[0] / start - 1.0).abs() < 0.01, "starts at waveFrequency");
            assert!(off.abs() < 1.0);
        }
    }
}

/// Inputs of a load that swings at `omega` behind a spring with the mode `mode` and a twist of amplitude `twist`,
/// under a constant load that twists by `constant`.
fn swing(t: f64, omega: f64, mode: f64, twist: f64, constant: f64) -> [f64; input::COUNT] {
    let delta = twist * (omega * t).sin();
    let load = -(mode / omega).powi(2) * delta + 0.3;
    [0.0, 0.0, RATIO * (load + delta + constant), 0.0, load, 0.0]
}

/// Whatever it swings at, the slope is the mode's square: y and φ went through the same filter, y is the second
/// derivative with its sign, and what is constant is washed out. Checks CTL-9, CTL-11 and CTL-12.
#[test]
fn the_slope_is_that_of_the_equation_of_motion() {
    has_the_slope(&[(0.0, 120.0, 2.5), (1e-3, 8.0, 1.0)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn the_slope_is_that_of_the_equation_of_motion_at_any_frequency() {
    let periods = [0.0, 1e-3].into_iter().flat_map(|h| [(h, 8.0), (h, 25.0), (h, 120.0)]);
    has_the_slope(&periods.flat_map(|(h, omega)| [(h, omega, 1.0), (h, omega, 2.5)]).collect::<Vec<_>>());
}

/// By a period, swinging at a frequency in rad/s, for a frequency that many times the mode.
fn has_the_slope(cases: &[(f64, f64, f64)]) {
    for &(h, omega, ratio) in cases {
        let mut p = controller(Strategy::VwbcAdaptive, 40.0, h, 1.0);
        p[a::first(1) + a::RATIO] = ratio;
        let mut control = Control::new(&p);
        let mut y = [0.0; output::COUNT];
        for k in 0..30_000 {
            let t = f64::from(k) * 1e-3;
            y = control.step(t, 1e-3, &swing(t, omega, 25.0, 1e-3, 3e-3));
        }
        let got = y[output::WAVE_FREQUENCY_USED] / ratio;
        println!("T_s {h} s, swinging at {omega} rad/s, ratio {ratio}: {got:.4} rad/s");
        // The second central difference of the sampled form: (sin(ωh/2)/(ωh/2))² of the acceleration.
        assert!((got / 25.0 - 1.0).abs() < 2e-3 && y[output::ADAPTATION_ACTIVE] == 1.0);
    }
}

/// The gate opens where the root mean square of F δ passes the threshold, by the magnitude of F; shut, nothing moves.
/// Checks CTL-10.
#[test]
fn the_gate_opens_at_the_threshold() {
    for (h, omega) in [0.0, 1e-3].into_iter().flat_map(|h| [(h, 20.0), (h, 60.0)]) {
        let p = controller(Strategy::VwbcAdaptive, 40.0, h, 1.0);
        let [threshold, low, high] = [a::THRESHOLD, a::MIN, a::MAX].map(|i| p[a::first(1) + i]);
        let magnitude = omega / f64::hypot(omega, low) / (1.0 + (omega / high) * (omega / high));
        for share in [0.85, 1.15] {
            let amplitude = share * threshold * 2f64.sqrt() / magnitude;
            let mut control = Control::new(&p);
            let (mut active, mut omegas) = (vec![], vec![]);
            for k in 0..10_000 {
                let t = f64::from(k) * 1e-3;
                let y = control.step(t, 1e-3, &swing(t, omega, 25.0, amplitude, 0.0));
                active.push(y[output::ADAPTATION_ACTIVE]);
                omegas.push(y[output::WAVE_FREQUENCY_USED]);
            }
            let open = active[5000..].iter().sum::<f64>() / 5000.0;
            println!("T_s {h} s, {omega} rad/s, {share} of the threshold: open for {open} of the time");
            assert_eq!(open, if share > 1.0 { 1.0 } else { 0.0 });
            // Shut from the first to the last, the frequency is still the start.
            assert_eq!(omegas.iter().all(|w| *w == 40.0), share < 1.0);
        }
    }
}

/// At rest both sensors flicker by their last steps, against each other, at any frequency of the band.
#[test]
fn sensors_at_rest_teach_nothing() {
    rest_teaches_nothing(4_000);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn sensors_at_rest_teach_nothing_for_long() {
    rest_teaches_nothing(20_000);
}

fn rest_teaches_nothing(steps: i32) {
    for (h, half_period) in [0.0, 1e-3].into_iter().flat_map(|h| [1, 8, 30, 79, 300].map(|k| (h, k))) {
        for (strategy, _) in ADAPTIVE {
            let mut control = Control::new(&controller(strategy, 41.648, h, 2.0));
            for k in 0..steps {
                let up = f64::from((k / half_period) % 2);
                let (load, motor) = (0.3 - LOAD_STEP * up, 0.3 * RATIO + MOTOR_STEP * up);
                let u = [0.3, 0.0, motor, 0.0, load, 0.0];
                let y = control.step(f64::from(k) * 1e-3, 1e-3, &u);
                assert_eq!((y[output::WAVE_FREQUENCY_USED], y[output::ADAPTATION_ACTIVE]), (41.648, 0.0));
            }
        }
    }
}

/// A constant load and play: within the bounds while it moves, and held once it has come to rest; under the load VWBC
/// is off by ω_n δ/K_p, whatever ω_n was on the way. Checks CTL-15.
#[test]
fn a_load_leaves_it_within_its_bounds() {
    within_its_bounds(0..1, &[(1, 1e-3)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_load_with_friction_and_play_leave_it_within_its_bounds() {
    within_its_bounds(0..4, &[(0, 0.0), (0, 1e-3), (1, 0.0), (1, 1e-3)]);
}

/// Of a load, a load with dry friction, play, play with dry friction; laws with their periods.
fn within_its_bounds(chosen: std::ops::Range<usize>, laws: &[(usize, f64)]) {
    let friction = [7.37e-5, 2.99e-4];
    let cases = [
        ("a load of 30.9 N.m", Bench { load: 30.9, quantised: true, ..SMOOTH }),
        ("a load, dry friction", Bench { load: 30.9, friction, quantised: true, ..SMOOTH }),
        ("play", Bench { effects: &["backlash"], with: [5.0, 0.0, 0.0], quantised: true, ..SMOOTH }),
        (
            "play, dry friction",
            Bench { effects: &["backlash"], with: [5.0, 0.0, 0.0], friction, quantised: true, ..SMOOTH },
        ),
    ];
    for (name, bench) in &cases[chosen] {
        for &(law, h) in laws {
            let (strategy, constant) = ADAPTIVE[law];
            let reference = |t| if t < 6.0 { moves(t) } else { 0.0 };
            let seen = bench.run(&controller(strategy, 41.648, h, 2.0), 16.0, reference);
            let least = seen.omega.iter().copied().fold(f64::INFINITY, f64::min);
            let most = seen.omega.iter().copied().fold(0.0, f64::max);
            let last = seen.active.iter().rposition(|a| *a).map_or(0.0, |k| k as f64 * 1e-3);
            // What still moves over the last second, and with the constant law.
            let swing = |seen: &Seen| {
                let tail = &seen.angle[15_000..];
                let most = tail.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                (most - tail.iter().copied().fold(f64::INFINITY, f64::min)).to_degrees()
            };
            let still = bench.run(&controller(constant, 41.648, h, 0.0), 16.0, reference);
            println!(
                "{name}, {strategy:?}, T_s {h} s: {least:.2} to {most:.2} rad/s, {:.2} at the end, last active at {last} s; moves \
                 by {:.4} deg, constant {:.4} deg",
                seen.omega[16_000],
                swing(&seen),
                swing(&still)
            );
            assert!(least >= 5.0 && most <= 400.0 && seen.omega[..7000].iter().any(|w| *w != 41.648));
            if bench.effects.is_empty() {
                assert!(last < 10.0 && (seen.omega[16_000] / bench.mode() - 1.0).abs() < 0.05);
                // Sampled waves hold their inputs: half a sample less.
                let omega = seen.omega[16_000];
                let off = omega * (1.0 - omega * h / 2.0) * bench.twist() / 2.0;
                if strategy == Strategy::VwbcAdaptive && bench.friction == [0.0; 2] {
                    assert!((seen.angle[16_000] / off - 1.0).abs() < 5e-3, "{} of {off}", seen.angle[16_000]);
                }
            }
        }
    }
}

/// What ω_n did on the way leaves no error: at rest without a load all is as if it had been constant. Checks CTL-15.
#[test]
fn a_change_on_the_way_leaves_no_error() {
    changes_without_error(&[(1, 1e-3)]);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_change_on_the_way_leaves_no_error_with_either_law() {
    changes_without_error(&[(0, 0.0), (0, 1e-3), (1, 0.0), (1, 1e-3)]);
}

/// Laws with their periods.
fn changes_without_error(laws: &[(usize, f64)]) {
    for &(law, h) in laws {
        let (strategy, _) = ADAPTIVE[law];
        let seen = SMOOTH
            .run(&controller(strategy, 125.0, h, 2.0), 40.0, |t| if t < 6.0 { moves(t) } else { 0.0873 });
        let error = (seen.angle[40_000] - 0.0873).to_degrees();
        println!("{strategy:?}, T_s {h} s: 125 to {:.2} rad/s, error {:.2e} deg", seen.omega[40_000], error);
        assert!(seen.omega[40_000] < 43.0 && error.abs() < 1e-3);
    }
}

/// Bounded by construction: noise of any size, in and out of the band. Checks CTL-13.
#[test]
fn no_input_takes_it_out_of_its_bounds_or_beyond_its_rate() {
    let mut seed = 11;
    for h in [0.0, 1e-3] {
        for scale in [1e-4, 1.0, 1e6] {
            let (rate, min, max) = (3.0, 5.0, 400.0);
            let mut control = Control::new(&controller(Strategy::WbcAdaptive, 41.648, h, rate));
            let (mut last, mut walk) = (41.648, 0.0);
            for k in 0..5000 {
                let t = f64::from(k) * 1e-3;
                walk = 0.98 * walk + scale * noise(&mut seed);
                let load = walk + scale * (if k < 2500 { 10.0 * t } else { (80.0 * t).sin() });
                let u = [0.0, 0.0, RATIO * scale * noise(&mut seed), 0.0, load, 0.0];
                let omega = control.step(t, 1e-3, &u)[output::WAVE_FREQUENCY_USED];
                assert!((min..=max).contains(&omega), "{omega}");
                assert!((omega - last).abs() <= 1e-3 * rate * (max - min), "{last} to {omega}");
                last = omega;
            }
            assert!(last != 41.648 && control.x.iter().all(|x| x.is_finite()));
        }
    }
}

const ANGLES: [f64; 9] = [-2.0, -1.0, -0.75, -0.5, 0.0, 0.125, 0.5, 1.0, 3.0];
const FREQUENCIES: [f64; 9] = [20.0, 30.0, 10.0, 40.0, 80.0, 60.0, 50.0, 50.0, 90.0];

fn with_schedule(mut p: [f64; PARAMETERS]) -> [f64; PARAMETERS] {
    p[a::first(1) + a::ADAPTATION] = 1.0;
    p[a::schedule_angle(1)..][..9].copy_from_slice(&ANGLES);
    p[a::schedule_frequency(1)..][..9].copy_from_slice(&FREQUENCIES);
    p
}

/// Checks CTL-14.
#[test]
fn a_schedule_is_linear_between_its_knots() {
    let at = |angle: f64| adaptation::scheduled(&ANGLES, &FREQUENCIES, angle);
    for k in 0..9 {
        assert_eq!(at(ANGLES[k]), FREQUENCIES[k]);
    }
    for (angle, want) in
        [(-9.0, 20.0), (-1.5, 25.0), (-0.875, 20.0), (-0.25, 60.0), (0.75, 50.0), (2.0, 70.0), (9.0, 90.0)]
    {
        assert_eq!(at(angle), want, "at {angle}");
    }
}

/// The frequency used goes to the scheduled one as exp(−λ t), and at rest the waves do not notice. Checks CTL-13.
#[test]
fn the_frequency_follows_the_schedule_at_its_rate() {
    for ((strategy, _), h) in ADAPTIVE.into_iter().flat_map(|s| [(s, 0.0), (s, 1e-3)]) {
        let p = with_schedule(controller(strategy, 25.0, h, 4.0));
        let mut control = Control::new(&p);
        let u = [-0.25, 0.0, -0.25 * RATIO, 0.0, -0.25, 0.0];
        // A sample's output is what holds after it.
        let ahead = h;
        for k in 0..2000 {
            let t = f64::from(k) * 1e-3;
            let y = control.step(t, 1e-3, &u);
            let want = 60.0 + (25.0 - 60.0) * (-4.0 * (t + ahead)).exp();
            assert!((y[output::WAVE_FREQUENCY_USED] - want).abs() < 1e-9, "{strategy:?} {h} {t}");
            assert_eq!((y[output::COMMAND], y[output::ADAPTATION_ACTIVE]), (0.0, 1.0));
            let waves =
                if strategy == Strategy::WbcAdaptive { state::POSITION_WAVES } else { state::VELOCITY_WAVES };
            let half = if strategy == Strategy::WbcAdaptive { -0.125 } else { 0.0 };
            assert_eq!(control.x[waves..waves + 4], [half, 0.0, half, 0.0]);
        }
    }
}

#[test]
fn a_schedule_may_run_over_the_angle_of_another_joint() {
    let n = 3;
    let mut p = arranged(&[with_schedule(controller(Strategy::VwbcAdaptive, 25.0, 1e-3, 4e3)); 3]);
    let model = ManipulatorController { joints: n };
    p[a::schedule_joint(n)..].copy_from_slice(&[2.0, 2.0, 1.0]);
    assert_eq!(model.check(&p), Ok(()));
    let mut u = vec![0.0; input::COUNT * n];
    u[input::LOAD_ANGLE * n..][..n].copy_from_slice(&[-1.5, 2.0, 0.0]);
    let (mut x, mut modes) = (vec![0.0; model.sizes().states], vec![0; model.sizes().modes]);
    for k in 0..20 {
        let t = f64::from(k) * 1e-3;
        while !model.update(t, &mut x, &u, &p, &mut modes).settled() {}
    }
    let mut y = vec![0.0; model.sizes().outputs];
    model.outputs(At { t: 0.02, x: &x, u: &u, p: &p, modes: &modes }, &mut y);
    for (j, want) in [70.0, 70.0, 25.0].into_iter().enumerate() {
        assert!((y[output::WAVE_FREQUENCY_USED * n + j] - want).abs() < 1e-9, "{y:?}");
    }
}

#[test]
fn a_mistake_in_the_parameters_is_told_with_its_mend() {
    let good = with_schedule(controller(Strategy::VwbcAdaptive, 25.0, 1e-3, 1.0));
    assert_eq!(JointController.check(&good), Ok(()));
    let told = |index: usize, value: f64, words: &[&str]| {
        let mut p = good;
        p[index] = value;
        let (i, text) = JointController.check(&p).expect_err("a mistake");
        assert!(i == index && words.iter().all(|w| text.contains(w)), "{i}, {text}");
        // A law that does not adapt does not look at it.
        p[a::first(1) + a::RATE] = 0.0;
        assert_eq!(JointController.check(&p), Ok(()));
    };
    told(a::schedule_angle(1) + 3, -0.75, &["scheduleAngle", "knot 4", "ascend", "-0.75"]);
    told(a::schedule_frequency(1) + 1, -3.0, &["scheduleFrequency", "knot 2", "waveFrequencyMin 5"]);
    told(a::schedule_frequency(1) + 8, 401.0, &["scheduleFrequency", "knot 9", "waveFrequencyMax 400"]);
    told(a::first(1) + a::MAX, 5.0, &["waveFrequencyMax", "above"]);
    told(a::first(1) + a::ADAPTATION, 3.0, &["adaptation", "1 (schedule)", "2 (estimate)"]);
    told(parameter::WAVE_FREQUENCY, 4.0, &["waveFrequency", "outside", "waveFrequencyMin 5"]);
    // The period has to be good for the largest frequency that may come.
    let mut p = good;
    p[parameter::COUNT] = 6e-3;
    let (index, text) = JointController.check(&p).expect_err("2.4 > 2");
    assert!(index == parameter::COUNT && text.contains("waveFrequencyMax 400"), "{text}");
    let mut arm = arranged(&[good; 2]);
    arm[a::schedule_joint(2) + 1] = 3.0;
    let (index, text) = ManipulatorController { joints: 2 }.check(&arm).expect_err("two joints");
    assert!(index == a::schedule_joint(2) + 1 && text.contains("scheduleJoint of joint 2"), "{text}");
}

/// Values and derivatives of duals against plain numbers and their differences.
#[test]
fn derivatives_are_those_of_the_rates() {
    let mut seed = 5;
    for p in [
        controller(Strategy::VwbcAdaptive, 41.648, 0.0, 2.0),
        with_schedule(controller(Strategy::WbcAdaptive, 41.648, 0.0, 2.0)),
    ] {
        let mut control = Control::new(&p);
        let mut u = [0.0; input::COUNT];
        for k in 0..400 {
            u = [0.1, 0.0, RATIO * (0.1 + 1e-3 * noise(&mut seed)), 3.0, 0.1 * f64::from(k).sin(), 0.2];
            control.step(f64::from(k) * 1e-3, 1e-3, &u);
        }
        let rates = |x: &[f64], u: &[f64]| {
            let mut dx = [0.0; CONTROLLER_STATES];
            JointController.rates(At { t: 0.4, x, u, p: &p, modes: &[1, 0, 0, 0, 1] }, &mut dx);
            dx
        };
        let all: Vec<f64> = control.x.iter().chain(&u).copied().collect();
        for i in 0..all.len() {
            let seeded = |k: usize| Dual::<1>::new(all[k], [f64::from(k == i)]);
            let (x, rest): (Vec<_>, Vec<_>) = (
                (0..CONTROLLER_STATES).map(seeded).collect(),
                (CONTROLLER_STATES..all.len()).map(seeded).collect(),
            );
            let q: Vec<_> = p.iter().map(|v| Dual::<1>::constant(*v)).collect();
            let mut dx = [Dual::<1>::zero(); CONTROLLER_STATES];
            JointController.rates(
                At { t: Dual::constant(0.4), x: &x, u: &rest, p: &q, modes: &[1, 0, 0, 0, 1] },
                &mut dx,
            );
            let moved = |by: f64| {
                let mut all = all.clone();
                all[i] += by;
                rates(&all[..CONTROLLER_STATES], &all[CONTROLLER_STATES..])
            };
            let (plain, by) = (moved(0.0), 1e-6 * all[i].abs().max(1e-3));
            let (up, down) = (moved(by), moved(-by));
            for k in 0..CONTROLLER_STATES {
                assert_eq!(dx[k].value().to_bits(), plain[k].to_bits());
                let difference = (up[k] - down[k]) / (2.0 * by);
                let allowed = 1e-5 * difference.abs() + 1e-8 * plain[k].abs() / by + 1e-9;
                assert!(
                    (dx[k].eps[0] - difference).abs() <= allowed,
                    "rate {k} by {i}: {:?}, {difference}",
                    dx[k]
                );
            }
        }
    }
}
