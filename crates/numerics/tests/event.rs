//! Location of events on given indicator functions.
#![allow(missing_docs, clippy::unwrap_used)]

use proptest::prelude::*;
use trueup_numerics::event::{Crossing, Direction, Locator};

/// First event of `z` in (t0, t1] and the number of evaluations.
fn find(
    t0: f64,
    t1: f64,
    count: usize,
    way: Direction,
    z: impl Fn(f64, &mut [f64]),
) -> (Option<Crossing>, usize) {
    find_by(Locator::new(count, false), (t0, t1), way, z)
}

fn find_by(
    mut locator: Locator,
    (t0, t1): (f64, f64),
    way: Direction,
    z: impl Fn(f64, &mut [f64]),
) -> (Option<Crossing>, usize) {
    z(t0, locator.start());
    let mut calls = 0;
    let found = locator.find(t0, t1, &|_| way, &mut |t, out| {
        calls += 1;
        z(t, out);
    });
    (found.unwrap(), calls)
}

#[test]
fn finds_the_earliest_of_several() {
    let (found, _) = find(1.0, 2.0, 3, Direction::Both, |t, z| {
        z.copy_from_slice(&[1.7 - t, t - 1.55, (t - 1.6).powi(3)]);
    });
    let found = found.unwrap();
    assert_eq!(found.indicator, 1);
    assert!(found.t > 1.55 && found.t - 1.55 < 1e-15);
}

#[test]
fn direction_is_heeded() {
    let z = |t: f64, z: &mut [f64]| z[0] = (t - 0.3) * (t - 0.62);
    let at = |way| find(0.0, 1.0, 1, way, z).0.unwrap().t;
    assert!((at(Direction::Both) - 0.3).abs() < 1e-14);
    assert!((at(Direction::Down) - 0.3).abs() < 1e-14);
    assert!((at(Direction::Up) - 0.62).abs() < 1e-14);
    assert_eq!(find(0.0, 0.5, 1, Direction::Up, z).0, None);
    // Both crossings between two samples.
    let z = |t: f64, z: &mut [f64]| z[0] = (t - 0.30) * (t - 0.32);
    assert!((find(0.0, 1.0, 1, Direction::Up, z).0.unwrap().t - 0.32).abs() < 1e-14);
    assert!((find(0.0, 1.0, 1, Direction::Down, z).0.unwrap().t - 0.30).abs() < 1e-14);
}

#[test]
fn returns_to_zero_soon_after_a_restart_is_found() {
    // A hop of 2e-8 of the step, as after a bounce: z starts at 0.
    let (found, _) = find(0.0, 1.0, 1, Direction::Down, |t, z| z[0] = t * (2e-8 - t));
    assert!((found.unwrap().t - 2e-8).abs() < 1e-20);
}

#[test]
fn a_slow_indicator_is_left_below_zero() {
    // 0 exactly from 0.3 - 1e-6 to 0.3 + 1e-6, as rounding makes it of a small change of a large number.
    let z = |t: f64| ((0.3 - t) * 1e6).trunc();
    let (found, _) = find(0.0, 1.0, 1, Direction::Both, |t, out| out[0] = z(t));
    let t = found.unwrap().t;
    assert!(z(t) < 0.0 && (t - 0.3 - 1e-6).abs() < 1e-15);
}

#[test]
fn touching_from_afar_costs_little() {
    let (found, calls) = find(0.0, 1.0, 1, Direction::Both, |t, z| z[0] = (t - 0.4).powi(2) + 0.2);
    assert_eq!(found, None);
    assert!(calls < 30, "{calls}");
}

#[test]
fn not_a_number_is_reported() {
    let mut locator = Locator::new(2, false);
    locator.start().fill(1.0);
    let bad = locator.find(0.0, 1.0, &|_| Direction::Both, &mut |t, z| {
        z.copy_from_slice(&[1.0, (0.6 - t).sqrt()]);
    });
    assert_eq!(bad, Err(1));
}

proptest! {
    /// The time is behind the crossing, by no more than a few units in the last place.
    #[test]
    fn crossing_is_bracketed(t0 in -1e3..1e3f64, h in 1e-6..10.0f64, s in 0.001..0.999f64, steep in 1e-6..1e6f64, p in 0..3i32) {
        let tc = t0 + s * h;
        let f = |t: f64| steep * f64::powi(t - tc, 2 * p + 1);
        let (found, calls) = find(t0, t0 + h, 1, Direction::Both, |t, z| z[0] = f(t));
        let t = found.unwrap().t;
        prop_assert!(f(t) > 0.0 || (2 * p + 1 > 1 && t >= tc));
        prop_assert!(t - tc <= 8.0 * f64::EPSILON * (t0.abs() + h), "{} late", t - tc);
        prop_assert!(calls < if p == 0 { 45 } else { 220 }, "{calls}");
    }

    /// Of a parabola two samples show every crossing, wherever in the step and however near each other.
    #[test]
    fn crossings_of_parabolas_are_found(
        centre in -0.2..1.2f64, width in -6.0..0.0f64, up in any::<bool>()
    ) {
        let (half, sign): (f64, f64) = (10f64.powf(width), if up { 1.0 } else { -1.0 });
        let f = |t: f64| sign * (f64::powi(t - centre, 2) - half * half);
        let (found, calls) = find_by(Locator::new(1, true), (0.0, 1.0), Direction::Both, |t, z| z[0] = f(t));
        let first = [centre - half, centre + half].into_iter().find(|t| *t > 0.0 && *t <= 1.0);
        match (found, first) {
            (None, None) => prop_assert!(calls < 25, "{calls}"),
            (Some(c), Some(t)) => prop_assert!((c.t - t).abs() < 1e-9, "{} instead of {t}", c.t),
            other => prop_assert!(false, "{other:?}"),
        }
    }

    /// An indicator that dips below zero and returns within one step is found, however shallow.
    #[test]
    fn dips_are_found(centre in 0.02..0.98f64, depth in -12.0..-2.0f64, up in any::<bool>()) {
        let (depth, sign): (f64, f64) = (10f64.powf(depth), if up { 1.0 } else { -1.0 });
        let f = |t: f64| sign * (f64::powi(t - centre, 2) * (1.0 + 0.5 * t) - depth);
        let (found, _) = find(0.0, 1.0, 1, Direction::Both, |t, z| z[0] = f(t));
        if f(0.0) * sign > 0.0 {
            let first = centre - f64::sqrt(depth / (1.0 + 0.5 * centre));
            let t = found.unwrap().t;
            prop_assert!((t - first).abs() < 0.1 * depth.sqrt(), "{t} instead of {first}");
        }
    }
}
