//! The arm against other forms of the same physics: Lagrange's equations from energies of points, closed forms, balances.

use super::chain::{JOINTS, SerialChain};
use super::channels::index_of;
use super::drive::draw;
use super::law::{HeldLaw, HeldLawEffect};
use super::plant::{HeldArm, HeldMode};
use super::run::HeldArmRun;
use super::space::{Arrow, LEVEL, Turning, about, after, apply, cross, dot, of_quaternion, plus, times};
use super::values::{HeldArmState, HeldArmValues, RATE};
use crate::draw::SeededDraw;

/// An arm without friction, of a seed; every second one with springs.
fn frictionless(seed: u64) -> HeldArmValues {
    let mut d = SeededDraw::new("held-arm/check", seed, 0, 0);
    let v = draw(&mut d, Some(seed % 2 == 1)).values;
    HeldArmValues { coulomb: [0.0; 6], breakaway: [0.0; 6], viscous: [0.0; 6], damping: [0.0; 6], ..v }
}

fn state(seed: u64, v: &HeldArmValues) -> HeldArmState {
    let mut d = SeededDraw::new("held-arm/state", seed, 0, 0);
    let mut x = [0.0; 2 * RATE + 4];
    for j in 0..JOINTS {
        x[j] = d.uniform(-3.0, 3.0);
        x[RATE + j] = d.uniform(-2.0, 2.0);
        if v.flexible[j] {
            x[JOINTS + j] = x[j] + d.uniform(-0.02, 0.02);
            x[RATE + JOINTS + j] = d.uniform(-2.0, 2.0);
        }
    }
    x
}

/// Where the bodies are, by products of rotations: centres, attitudes, axes of the joints.
fn places(chain: &SerialChain, q: &[f64]) -> ([Arrow; JOINTS], [Turning; JOINTS], [Arrow; JOINTS]) {
    let (mut at, mut turned) = ([0.0; 3], LEVEL);
    let (mut centers, mut all, mut axes) = ([[0.0; 3]; JOINTS], [LEVEL; JOINTS], [[0.0; 3]; JOINTS]);
    for (j, b) in chain.bodies.iter().enumerate() {
        at = plus(at, apply(&turned, b.position));
        turned = after(&after(&turned, &of_quaternion(b.orientation)), &about(b.axis, q[j]));
        (centers[j], all[j], axes[j]) = (plus(at, apply(&turned, b.center)), turned, apply(&turned, b.axis));
    }
    (centers, all, axes)
}

/// Differences over eight points: error of the eighth power of the step, which is short for spins of 10 rad/s.
fn slope<const N: usize>(f: impl Fn(f64) -> [f64; N]) -> [f64; N] {
    let h = 4e-3;
    let weights = [0.8, -0.2, 4.0 / 105.0, -1.0 / 280.0];
    let mut sum = [0.0; N];
    for (k, w) in weights.iter().enumerate() {
        let s = h * (k + 1) as f64;
        let (a, b) = (f(s), f(-s));
        (0..N).for_each(|i| sum[i] += w * (a[i] - b[i]) / h);
    }
    sum
}

/// Kinetic energy at the coordinates `q` (joints, then motors) moving along `v`: speeds of centres and spins by differences.
fn kinetic(values: &HeldArmValues, q: &[f64; RATE], v: &[f64; RATE]) -> f64 {
    let chain = &values.chain;
    let along = |s: f64| -> [f64; RATE] { std::array::from_fn(|i| q[i] + s * v[i]) };
    let moved: [f64; 12 * JOINTS] = slope(|s| {
        let (centers, turned, _) = places(chain, &along(s)[..JOINTS]);
        let mut all = [0.0; 12 * JOINTS];
        for j in 0..JOINTS {
            all[12 * j..12 * j + 3].copy_from_slice(&centers[j]);
            (0..3).for_each(|i| all[12 * j + 3 + 3 * i..12 * j + 6 + 3 * i].copy_from_slice(&turned[j][i]));
        }
        all
    });
    let (_, turned, axes) = places(chain, &q[..JOINTS]);
    let (mut energy, mut carrier) = (0.0, [0.0; 3]);
    for (j, b) in chain.bodies.iter().enumerate() {
        let speed: Arrow = std::array::from_fn(|i| moved[12 * j + i]);
        let rate: Turning = std::array::from_fn(|i| std::array::from_fn(|k| moved[12 * j + 3 + 3 * i + k]));
        // d(R) R' is the cross-product matrix of the spin.
        let w = |i: usize, k: usize| dot(rate[i], turned[j][k]);
        let spin = [w(2, 1), w(0, 2), w(1, 0)];
        let own: Arrow = std::array::from_fn(|k| (0..3).map(|i| turned[j][i][k] * spin[i]).sum());
        energy += 0.5 * (b.mass * dot(speed, speed) + dot(own, apply(&b.inertia, own)));
        let rotor = v[values.motor(j)] + dot(axes[j], carrier) / chain.gear_ratio[j];
        energy += 0.5 * chain.rotor[j] * rotor * rotor;
        carrier = spin;
    }
    energy
}

fn potential(values: &HeldArmValues, q: &[f64; RATE]) -> f64 {
    let (centers, ..) = places(&values.chain, &q[..JOINTS]);
    let mut energy = 0.0;
    for j in 0..JOINTS {
        energy -= values.chain.bodies[j].mass * dot(values.chain.gravity, centers[j]);
        if values.flexible[j] {
            energy += 0.5 * values.stiffness[j] * (q[JOINTS + j] - q[j]).powi(2);
        }
    }
    energy
}

fn split(x: &HeldArmState) -> ([f64; RATE], [f64; RATE]) {
    (std::array::from_fn(|i| x[i]), std::array::from_fn(|i| x[RATE + i]))
}

#[test]
fn accelerations_fulfil_lagranges_equations() {
    let mut worst: f64 = 0.0;
    for seed in 0..6 {
        let v = frictionless(seed);
        let x = state(seed, &v);
        let mut d = SeededDraw::new("held-arm/torque", seed, 0, 0);
        let u: [f64; JOINTS] = std::array::from_fn(|_| d.uniform(-50.0, 50.0));
        let slides = [HeldMode::Slides(1.0); JOINTS];
        let a = HeldArm::new(v, Vec::new(), 1.0).instant(0.0, &x, &slides, |j, _| u[j]).rates;
        let (q, rate) = split(&x);
        let coordinates: Vec<usize> = (0..RATE).filter(|i| *i < JOINTS || v.flexible[i - JOINTS]).collect();
        let with = |base: &[f64; RATE], i: usize, s: f64| {
            let mut own = *base;
            own[i] += s;
            own
        };
        // T is a quadratic form of the rates: its momentum p_i = T(v + e_i / 2) - T(v - e_i / 2), exactly.
        let momentum = |q: &[f64; RATE], v_: &[f64; RATE], i: usize| {
            kinetic(&v, q, &with(v_, i, 0.5)) - kinetic(&v, q, &with(v_, i, -0.5))
        };
        let mut scale: f64 = 1.0;
        let mut errors = Vec::new();
        for i in coordinates {
            let change = slope(|s| {
                let later = std::array::from_fn(|k| q[k] + s * rate[k]);
                [momentum(&later, &std::array::from_fn(|k| rate[k] + s * a[RATE + k]), i)]
            })[0];
            let pull = slope(|s| [kinetic(&v, &with(&q, i, s), &rate) - potential(&v, &with(&q, i, s))])[0];
            let driven = (0..JOINTS).find(|j| v.motor(*j) == i).map_or(0.0, |j| u[j]);
            scale = scale.max(change.abs()).max(pull.abs());
            errors.push(change - pull - driven);
        }
        worst = errors.iter().fold(worst, |w, e| w.max(e.abs() / scale));
    }
    println!("Lagrange's equations hold to {worst:.1e} of the largest force");
    assert!(worst < 1e-9, "{worst}");
}

#[test]
fn left_alone_it_keeps_its_energy() {
    for seed in 0..4 {
        let v = frictionless(seed);
        let mut x = state(seed, &v);
        for j in 0..JOINTS {
            (x[RATE + j], x[RATE + JOINTS + j]) = (0.3 * x[RATE + j], 0.3 * x[RATE + JOINTS + j]);
        }
        let mut run = HeldArmRun::new(HeldArm::new(v, Vec::new(), 1.0), 0.0, x, 2.5e-4);
        let energy = |x: &HeldArmState| {
            let (q, rate) = split(x);
            kinetic(&v, &q, &rate) + potential(&v, &q)
        };
        let before = energy(&x);
        run.hold(1.0, [0.0; JOINTS]);
        let (q, rate) = split(&run.state);
        let moving = kinetic(&v, &q, &rate);
        let off = (energy(&run.state) - before).abs();
        println!("seed {seed}: {off:.1e} J of {moving:.1} J");
        assert!(off < 1e-8 * moving.max(1.0) && moving > 1.0, "{off} of {moving}");
    }
}

/// The first joint's axis is vertical: without torque about it, the momentum about it stays, whatever falls.
#[test]
fn what_falls_keeps_its_momentum_about_the_vertical() {
    for seed in [1, 2] {
        let v = frictionless(seed);
        let v = HeldArmValues { flexible: [false, v.flexible[1], v.flexible[2], false, false, false], ..v };
        let mut x = state(seed, &v);
        (0..JOINTS).for_each(|j| x[RATE + j] *= 0.3);
        let momentum = |x: &HeldArmState| {
            let (q, rate) = split(x);
            let with = |by: f64| {
                let mut own = rate;
                own[0] += by;
                kinetic(&v, &q, &own)
            };
            with(0.5) - with(-0.5)
        };
        let before = momentum(&x);
        let mut run = HeldArmRun::new(HeldArm::new(v, Vec::new(), 1.0), 0.0, x, 2.5e-4);
        run.hold(0.8, [0.0, 8.0, -5.0, 2.0, 0.5, -0.3]);
        let off = (momentum(&run.state) - before).abs();
        println!("seed {seed}: momentum {before:.3} N.m.s, off by {off:.1e}");
        assert!(off < 1e-9 * before.abs().max(1.0), "{off} of {before}");
    }
}

#[test]
fn a_pendulum_has_its_closed_forms() {
    // All joints but the second are stuck: a compound pendulum about a horizontal axis.
    let mut v = frictionless(2);
    v.chain.bodies[1].orientation =
        [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0];
    v.chain.bodies[1].turned = of_quaternion(v.chain.bodies[1].orientation);
    v.breakaway = [1e9; JOINTS];
    let mut x = state(2, &v);
    (0..JOINTS).for_each(|j| x[RATE + j] = 0.0);
    x[RATE + 1] = 0.7;
    let modes = std::array::from_fn(|j| if j == 1 { HeldMode::Slides(1.0) } else { HeldMode::Stuck });
    let arm = HeldArm::new(v, Vec::new(), 1.0);
    let now = arm.instant(0.0, &x, &modes, |_, _| 3.0);
    let (centers, turned, axes) = places(&v.chain, &x[..JOINTS]);
    let at = v.chain.bodies[0].position;
    let pivot = plus(at, apply(&turned[0], v.chain.bodies[1].position));
    let (mut inertia, mut torque) = (v.chain.rotor[1], 3.0);
    for j in 1..JOINTS {
        let b = &v.chain.bodies[j];
        let arm = plus(centers[j], times(-1.0, pivot));
        let own: Arrow = std::array::from_fn(|k| (0..3).map(|i| turned[j][i][k] * axes[1][i]).sum());
        let lever = cross(axes[1], arm);
        inertia += dot(own, apply(&b.inertia, own)) + b.mass * dot(lever, lever);
        torque += b.mass * dot(lever, v.chain.gravity);
    }
    // Rotors on the bodies that turn: about their own axes by the gear ratio's share.
    for j in 2..JOINTS {
        let share = dot(axes[1], axes[j]) / v.chain.gear_ratio[j];
        inertia += v.chain.rotor[j] * share * share;
    }
    let expected = torque / inertia;
    let off = (now.rates[RATE + 1] - expected).abs() / expected.abs();
    println!("compound pendulum {off:.1e}");
    assert!(off < 1e-12, "{} {expected}", now.rates[RATE + 1]);
    // What holds the first joint: the rate of the angular momentum about its axis, less what is commanded.
    let rate = slope(|s| {
        let q: [f64; RATE] =
            std::array::from_fn(|i| x[i] + if i == 1 { 0.7 * s + 0.5 * expected * s * s } else { 0.0 });
        let mut own = [0.0; RATE];
        own[1] = 0.7 + expected * s;
        let with = |by: f64| {
            let mut moved = own;
            moved[0] += by;
            kinetic(&v, &q, &moved)
        };
        [with(0.5) - with(-0.5)]
    })[0];
    let off = (now.holds[0].0 - (3.0 - rate)).abs();
    println!("torque that holds the first joint {off:.1e} N.m of {rate:.3}");
    assert!(off < 1e-9 * rate.abs().max(1.0), "{} {rate}", now.holds[0].0);
}

#[test]
fn friction_holds_breaks_away_and_takes_its_work() {
    let mut v = frictionless(0);
    v.chain.gravity = [0.0; 3];
    (v.coulomb, v.breakaway, v.viscous) = ([2.0; JOINTS], [3.0; JOINTS], [0.0; JOINTS]);
    let x = [0.0; 2 * RATE + 4];
    let mut run = HeldArmRun::new(HeldArm::new(v, Vec::new(), 1.0), 0.0, x, 1e-3);
    run.hold(0.5, [2.9, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(run.state, x, "below the level at which it breaks away nothing moves");
    // The first joint alone: all others hold, so it is a wheel under 3.5 - 2 N.m, then under 2 N.m of friction.
    let inertia = {
        let m = v.chain.mass_matrix(&v.chain.motion(&[0.0; JOINTS], &[0.0; JOINTS]));
        let (_, _, axes) = places(&v.chain, &[0.0; JOINTS]);
        let share = |j: usize| dot(axes[0], axes[j]) / v.chain.gear_ratio[j];
        m[0][0] + v.chain.rotor[0] + (1..JOINTS).map(|j| v.chain.rotor[j] * share(j) * share(j)).sum::<f64>()
    };
    v.breakaway = [3.0, 1e9, 1e9, 1e9, 1e9, 1e9];
    let mut run = HeldArmRun::new(HeldArm::new(v, Vec::new(), 1.0), 0.0, x, 1e-3);
    run.hold(0.4, [3.5, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let speed = 1.5 / inertia * 0.4;
    assert!((run.state[RATE] - speed).abs() < 1e-12 * speed.max(1.0), "{} {speed}", run.state[RATE]);
    run.hold(2.0, [0.0; JOINTS]);
    let way = 0.5 * speed * 0.4 + speed * speed * inertia / 4.0;
    assert!((run.state[0] - way).abs() < 1e-9, "{} {way}", run.state[0]);
    assert_eq!(run.state[RATE], 0.0, "it has come to rest");
}

#[test]
fn a_force_at_the_tip_does_its_work() {
    let v = HeldArmValues { flexible: [false; JOINTS], ..frictionless(3) };
    let x = state(3, &v);
    let way = [0.3, -0.5, 0.8];
    let pulse = crate::joint::Pulse { start: -0.5, length: 1.0, height: 10.0, triangle: false };
    let push = HeldLawEffect::new(HeldLaw::PushTip { pulses: vec![pulse], way }, 1.0, 0);
    let slides = [HeldMode::Slides(1.0); JOINTS];
    let with = HeldArm::new(v, vec![push], 1.0).instant(0.0, &x, &slides, |_, _| 0.0).rates;
    let without = HeldArm::new(v, Vec::new(), 1.0).instant(0.0, &x, &slides, |_, _| 0.0).rates;
    let (q, rate) = split(&x);
    // Power: the difference of the accelerations changes the energy by force times the tip's velocity.
    let tip = slope(|s| {
        let moved: Vec<f64> = (0..JOINTS).map(|i| q[i] + s * rate[i]).collect();
        let (centers, turned, _) = places(&v.chain, &moved);
        let b = &v.chain.bodies[JOINTS - 1];
        let own: Arrow = std::array::from_fn(|k| v.tip[k] - b.center[k]);
        plus(centers[JOINTS - 1], apply(&turned[JOINTS - 1], own))
    });
    let gained: f64 = {
        let difference: [f64; RATE] = std::array::from_fn(|i| with[RATE + i] - without[RATE + i]);
        // v' M dv by the quadratic form.
        let sum = |sign: f64| std::array::from_fn(|i| rate[i] + sign * 0.5 * difference[i]);
        kinetic(&v, &q, &sum(1.0)) - kinetic(&v, &q, &sum(-1.0))
    };
    let power = 10.0 * dot(way, tip);
    println!("power of a force at the tip: {gained:.6} W, off by {:.1e}", (gained - power).abs());
    assert!((gained - power).abs() < 1e-9 * power.abs().max(1.0), "{gained} {power}");
}

/// Every law with amplitude 0 leaves the accelerations, the torques that friction holds and the readings as they are.
#[test]
fn a_law_of_no_size_is_no_effect() {
    use super::choice::{HeldScales, IDS, OUTSIDE, choose};
    use super::scene::reading;
    let v = {
        let mut d = SeededDraw::new("held-arm/check", 5, 0, 0);
        HeldArmValues {
            flexible: [true; JOINTS],
            stiffness: [900.0; JOINTS],
            damping: [0.5; JOINTS],
            ..draw(&mut d, Some(true)).values
        }
    };
    let ones = [1.0; JOINTS];
    let s = HeldScales {
        torque: [9.0; JOINTS],
        speed: ones,
        deflection: ones,
        rate: ones,
        posture: [0.2; JOINTS],
        span: 8.0,
    };
    let channels: Vec<usize> = (0..2 * JOINTS).collect();
    let x = state(5, &v);
    let modes = std::array::from_fn(|j| if j < 4 { HeldMode::Slides(1.0) } else { HeldMode::Stuck });
    let plain = HeldArm::new(v, Vec::new(), 8.0).instant(3.0, &x, &modes, |j, _| j as f64);
    let mut seen = 0;
    for (turn, id) in IDS.iter().chain(&OUTSIDE).enumerate() {
        let mut d = SeededDraw::new("held-arm/laws", 5, turn, 0);
        let c = choose(id, turn, &mut d, &v, &s, &channels, None).unwrap();
        // Bristles of presliding take over all dry friction, contact damps as it penetrates; others have no size 0.
        if matches!(
            c.law,
            HeldLaw::Presliding { .. }
                | HeldLaw::Play { .. }
                | HeldLaw::Compliant { .. }
                | HeldLaw::Stutter { .. }
                | HeldLaw::TwoLags
        ) {
            continue;
        }
        let of = |size: f64| {
            let effect = HeldLawEffect::new(c.law.clone(), size, c.joint);
            let arm = HeldArm::new(v, vec![effect.clone()], 8.0);
            let now = arm.instant(3.0, &x, &modes, |j, _| j as f64);
            let track = [(7.0, x), (8.0, state(6, &v))];
            let read: Vec<f64> = channels
                .iter()
                .map(|k| reading(&v, std::slice::from_ref(&effect), &track, 7.5, *k, 8.0))
                .collect();
            (now.rates[..2 * RATE].to_vec(), now.holds, read)
        };
        let read: Vec<f64> =
            channels.iter().map(|k| 0.5 * (x[index_of(&v, *k)] + state(6, &v)[index_of(&v, *k)])).collect();
        let (rates, holds, readings) = of(0.0);
        let near = |a: &f64, b: &f64| (a - b).abs() < 1e-12 * b.abs().max(1.0);
        assert!(rates.iter().zip(&plain.rates).all(|(a, b)| near(a, b)), "{id}");
        assert!(holds.iter().zip(&plain.holds).all(|(a, b)| near(&a.0, &b.0) && near(&a.1, &b.1)), "{id}");
        assert!(readings.iter().zip(&read).all(|(a, b)| (a - b).abs() < 1e-14), "{id}");
        let (rates, holds, readings) = of(c.most);
        let acts = rates[..] != plain.rates[..2 * RATE] || holds != plain.holds || readings != read;
        // What comes late, in spells, or in pulses need not act at this instant.
        let later = matches!(
            c.law,
            HeldLaw::DeadTime
                | HeldLaw::PushMotor { .. }
                | HeldLaw::PushTip { .. }
                | HeldLaw::Brushes { .. }
                | HeldLaw::Clip { .. }
                | HeldLaw::Heat { .. }
                | HeldLaw::Presliding { .. }
                | HeldLaw::Hysteresis { .. }
                | HeldLaw::LoadSlip { .. }
        );
        assert!(acts || later, "{id} does not act");
        seen += 1;
    }
    assert!(seen > 22, "{seen}");
}
