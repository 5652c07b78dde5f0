//! Residuals whose excess was put in one place by the test: that place has to be found.

#![allow(clippy::unwrap_used)]

use std::f64::consts::TAU;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::locate::{
    Feature, ResidualSeries, bands, change_points, intervals, orders, regimes, shares,
};

const H: f64 = 0.002;

fn white(n: usize, sd: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| sd * rng.sample::<f64, _>(StandardNormal)).collect()
}

fn time(n: usize) -> Vec<f64> {
    (0..n).map(|i| H * i as f64).collect()
}

fn residual<'a>(time: &'a [f64], value: &'a [f64], floor: f64) -> ResidualSeries<'a> {
    ResidualSeries { recording: "train-1.csv", time, value, floor }
}

/// Length of what two stretches share over that of both together.
fn overlap(a: (f64, f64), b: (f64, f64)) -> f64 {
    (a.1.min(b.1) - a.0.max(b.0)).max(0.0) / (a.1.max(b.1) - a.0.min(b.0))
}

#[test]
fn shares_are_of_the_overall_excess() {
    let found = shares(&[(0.5, 0.3), (0.2, 0.0), (0.1, 0.2)]);
    assert!((found[0] - 0.8).abs() < 1e-12 && (found[1] - 0.2).abs() < 1e-12 && found[2] == 0.0);
    assert_eq!(shares(&[(0.1, 0.2)]), [0.0]);
}

#[test]
fn edges_of_pushes_are_found_to_the_sample() {
    let n = 5000;
    let t = time(n);
    // A push, a softer one, a stretch that is only noisier; 40 repetitions.
    let mut late: f64 = 0.0;
    for seed in 0..40 {
        let pushes = [(800, 1050, 4.0), (2400 + 7 * seed as usize, 2700, -3.0)];
        let mut r = white(n, 0.1, seed);
        for (from, to, size) in pushes {
            r[from..to].iter_mut().for_each(|r| *r += 0.1 * size);
        }
        let mut found = intervals(&[residual(&t, &r, 0.1)], 0.05);
        assert_eq!(found.len(), 2, "{found:?}");
        let shares: f64 = found.iter().map(|i| i.share).sum();
        assert!(shares > 0.9 && shares < 1.1, "{shares}");
        assert!(found[0].share >= found[1].share && found.iter().all(|i| i.lift > 5.0));
        found.sort_by(|a, b| a.start.total_cmp(&b.start));
        for ((from, to, _), i) in pushes.iter().zip(&found) {
            late = late.max((i.start - t[*from]).abs()).max((i.end - t[*to]).abs());
        }
    }
    println!("largest error of 160 edges: {:.1} ms", 1e3 * late);
    assert!(late <= f64::max(2.0 * H, 5e-3) + 1e-9, "{late}");
}

#[test]
fn a_noisier_stretch_is_found_in_a_long_series_and_in_coloured_noise() {
    found_in_noise(24_000, 4);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_noisier_stretch_is_found_in_twenty_draws_of_coloured_noise() {
    found_in_noise(24_000, 20);
}

fn found_in_noise(n: usize, draws: u64) {
    let t = time(n);
    let mut r = white(n, 1.0, 3);
    r[9000..12_000].iter_mut().for_each(|r| *r *= 5.0);
    let found = intervals(&[residual(&t, &r, 1.0)], 0.1);
    assert_eq!(found.len(), 1, "{found:?}");
    // An outlier more or less decides: 5 samples.
    assert!(
        (found[0].start - t[9000]).abs() <= 5.0 * H && (found[0].end - t[12_000]).abs() <= 5.0 * H,
        "{found:?}"
    );
    // Correlated noise alone changes nothing.
    for seed in 0..draws {
        let mut state = 0.0;
        let coloured: Vec<f64> = white(5000, 1.0, 100 + seed)
            .iter()
            .map(|e| {
                state = 0.95 * state + e;
                state
            })
            .collect();
        let edges = change_points(&coloured, 25);
        assert!(edges.len() <= 1, "seed {seed}: {edges:?}");
        assert_eq!(change_points(&white(5000, 1.0, 200 + seed), 25), [0usize; 0], "seed {seed}");
    }
}

#[test]
fn an_excess_that_is_always_there_is_in_no_interval_and_noise_in_none() {
    let t = time(5000);
    assert_eq!(intervals(&[residual(&t, &white(5000, 3.0, 1), 1.0)], 0.05), []);
    assert_eq!(intervals(&[residual(&t, &white(5000, 0.9, 1), 1.0)], 0.05), []);
    assert_eq!(intervals(&[], 0.05), []);
    assert_eq!(change_points(&[1.0, f64::NAN, 2.0, 1.0, 5.0, 6.0, 7.0], 2), [0usize; 0]);
}

#[test]
fn bands_of_an_excess_are_found() {
    let n = 10_000;
    let t = time(n);
    let mut worst: f64 = 1.0;
    for (seed, (low, high)) in [(8.0, 14.0), (30.0, 60.0), (0.0, 2.0), (100.0, 103.0)].into_iter().enumerate()
    {
        // Many sines side by side, in addition to noise of a density of its own.
        let mut rng = ChaCha8Rng::seed_from_u64(seed as u64);
        let lines: Vec<(f64, f64)> =
            (0..200).map(|k| (low + (high - low) * k as f64 / 199.0, TAU * rng.random::<f64>())).collect();
        let wave = |t: f64| lines.iter().map(|(f, p)| (TAU * f * t + p).sin()).sum::<f64>() * 0.1;
        let r: Vec<f64> = white(n, 0.5, seed as u64).iter().zip(&t).map(|(e, t)| e + wave(*t)).collect();
        let found = bands(&[residual(&t, &r, 0.5)], None).unwrap();
        let best = found.bands[0];
        worst = worst.min(overlap((low, high), (best.low, best.high)));
        let total: f64 = found.bands.iter().map(|b| b.share).sum();
        assert!(best.share > 0.6 && total <= 1.0 + 1e-12, "{low}..{high}: {:?}", found.bands);
    }
    println!("least overlap of bands: {worst:.2}");
    assert!(worst >= 0.6, "{worst}");
    let quiet = white(n, 0.5, 9);
    assert_eq!(bands(&[residual(&t, &quiet, 0.5)], None).unwrap().bands, []);
    assert_eq!(bands(&[residual(&t[..40], &quiet[..40], 0.5)], None), None);
}

#[test]
fn orders_of_an_angle_are_found_although_it_reverses() {
    let n = 5000;
    let angle: Vec<f64> = time(n).iter().map(|t| 40.0 * (0.9 * t).sin() + 3.0 * t).collect();
    let noise = white(n, 0.02, 4);
    let r: Vec<f64> = angle.iter().zip(&noise).map(|(a, e)| 0.05 * (2.0 * a + 0.7).cos() + 1.0 + e).collect();
    let found = orders(&angle, &r, 12.0);
    let best = found.iter().max_by(|a, b| a.share.total_cmp(&b.share)).unwrap();
    assert_eq!(best.order, 2.0);
    assert!((best.amplitude() - 0.05).abs() < 0.002, "{best:?}");
    assert!((best.sine.atan2(best.cosine) + 0.7).abs() < 0.05, "{best:?}");
    let variance = 0.00125 / (0.00125 + 4e-4);
    assert!((best.share - variance).abs() < 0.03, "{} for {variance}", best.share);
    assert!(found.iter().filter(|o| (o.order - 2.0).abs() > 0.2).all(|o| o.share < 0.05));
    let little: Vec<f64> = angle.iter().map(|a| 0.1 * a).collect();
    assert!(orders(&little, &r, 12.0).is_empty());
}

#[test]
fn regimes_of_an_excess_are_found_and_chance_is_none() {
    let n = 5000;
    let t = time(n);
    let v: Vec<f64> = t.iter().map(|t| 1.5 * (2.0 * t).sin() + 0.8 * (5.3 * t).cos()).collect();
    let speed: Vec<f64> = v.iter().map(|v| v.abs()).collect();
    let q: Vec<f64> = t.iter().map(|t| -0.75 * (2.0 * t).cos() + 0.15 * (5.3 * t).sin()).collect();
    let torque: Vec<f64> = t.iter().map(|t| 0.4 * (11.0 * t).sin()).collect();
    let features = [
        Feature { name: "|motorVelocity|", value: &speed },
        Feature { name: "motorVelocity", value: &v },
        Feature { name: "motorAngle", value: &q },
        Feature { name: "motorTorque", value: &torque },
    ];
    type Law = fn(f64, f64) -> bool;
    let cases: [(&str, Law); 3] = [
        ("motorVelocity", |v, _| v.abs() < 0.25),
        ("motorVelocity", |v, _| v > 1.4),
        ("motorAngle", |_, q| q > 0.5),
    ];
    for (seed, (name, inside)) in cases.into_iter().enumerate() {
        let mut w = white(n, 1.0, seed as u64);
        let truth: Vec<bool> = (0..n).map(|i| inside(v[i], q[i])).collect();
        w.iter_mut().zip(&truth).filter(|(_, t)| **t).for_each(|(w, _)| *w *= 4.0);
        let found = regimes(&features, &w, 1);
        let best = &found[0];
        let (variable, low, high) = best.main().unwrap();
        let value = if variable == "motorAngle" { &q } else { &v };
        let flagged: Vec<bool> =
            value.iter().map(|x| low.is_none_or(|l| *x >= l) && high.is_none_or(|h| *x <= h)).collect();
        let count =
            |f: &dyn Fn(bool, bool) -> bool| truth.iter().zip(&flagged).filter(|(a, b)| f(**a, **b)).count();
        let overlap = count(&|a, b| a && b) as f64 / count(&|a, b| a || b) as f64;
        println!(
            "{variable} {low:?} {high:?}: share {:.2}, lift {:.1}, p {:.2}, overlap {overlap:.2}",
            best.share, best.lift, best.p_value
        );
        assert_eq!(variable, name);
        assert!(overlap >= 0.7, "{found:?}");
        assert!(best.share > 0.7 && best.share <= 1.001 && best.lift > 2.0 && best.p_value <= 0.02);
    }
    // Bursts that have nothing to do with any feature: at most one in 20 tests may find something.
    let by_chance = (0..40)
        .filter(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(*seed);
            let mut w = white(n, 1.0, 500 + seed);
            for _ in 0..8 {
                let from = rng.random_range(0..n - 60);
                w[from..from + 60].iter_mut().for_each(|w| *w *= 4.0);
            }
            !regimes(&features, &w, *seed).is_empty()
        })
        .count();
    println!("found by chance: {by_chance} of 40");
    assert!(by_chance <= 5, "{by_chance} of 40");
    assert!(regimes(&features, &white(n, 1.0, 77), 1).is_empty());
}
