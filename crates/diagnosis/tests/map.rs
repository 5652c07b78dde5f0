//! Maps of a law that is known.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::locate::map::{curve, loop_area, surface};

const N: usize = 20_000;

fn motion() -> (Vec<f64>, Vec<f64>) {
    let t = |i: usize| 0.002 * i as f64;
    let x = |t: f64| (2.0 * t).sin() + 0.6 * (4.7 * t).cos();
    let v = |t: f64| 2.0 * (2.0 * t).cos() - 2.82 * (4.7 * t).sin();
    ((0..N).map(|i| x(t(i))).collect(), (0..N).map(|i| v(t(i))).collect())
}

#[test]
fn a_curve_has_the_law_within_its_band_although_the_noise_is_coloured() {
    let (_, v) = motion();
    let law = |v: f64| 0.3 * v.tanh() + 0.1 * v.powi(3);
    let (mut inside, mut all) = (0, 0);
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut state = 0.0;
        let noisy: Vec<f64> = v
            .iter()
            .map(|v| {
                state = 0.9 * state + 0.05 * rng.sample::<f64, _>(StandardNormal);
                law(*v) + state
            })
            .collect();
        let c = curve(&v, &noisy, 30).unwrap();
        // Bins of the law itself, so that its bend within a bin is no error.
        let exact = curve(&v, &v.iter().map(|v| law(*v)).collect::<Vec<_>>(), 30).unwrap();
        inside += (0..30).filter(|k| c.low[*k] <= exact.mean[*k] && exact.mean[*k] <= c.high[*k]).count();
        all += 30;
    }
    let share = inside as f64 / all as f64;
    println!("bands that hold the truth: {:.1} %", 100.0 * share);
    assert!((0.88..=0.99).contains(&share), "{share}");
    assert_eq!(curve(&[1.0; 20], &[1.0; 20], 10), None);
}

#[test]
fn a_surface_is_the_law_and_empty_where_nothing_was() {
    let (x, v) = motion();
    let law = |x: f64, v: f64| 2.0 * x + 0.5 * x.powi(3) + 0.2 * v;
    let z: Vec<f64> = x.iter().zip(&v).map(|(x, v)| law(*x, *v)).collect();
    let s = surface(&x, &v, &z, 15).unwrap();
    let middle = |e: &[f64], k: usize| 0.5 * (e[k] + e[k + 1]);
    let mut seen = 0;
    for (b, row) in s.z.iter().enumerate() {
        for (a, z) in row.iter().enumerate().filter_map(|(a, z)| Some((a, (*z)?))) {
            seen += 1;
            let (dx, dv) = (s.x[1] - s.x[0], s.y[1] - s.y[0]);
            let slope = 2.0 + 1.5 * s.x[a].abs().max(s.x[a + 1].abs()).powi(2);
            assert!((z - law(middle(&s.x, a), middle(&s.y, b))).abs() <= 0.5 * (slope * dx + 0.2 * dv));
        }
    }
    assert!(seen > 80 && seen < 225, "{seen}");
    assert_eq!(surface(&[0.0; 60], &[0.0; 60], &[0.0; 60], 5), None);
}

#[test]
fn the_area_of_a_loop_is_what_a_damper_takes() {
    let (a, w, c) = (0.7, 3.0, 0.25);
    let t: Vec<f64> = (0..N).map(|i| 0.001 * i as f64).collect();
    let x: Vec<f64> = t.iter().map(|t| a * (w * t).sin()).collect();
    let damper: Vec<f64> = t.iter().map(|t| c * a * w * (w * t).cos() + 4.0 * a * (w * t).sin()).collect();
    let area = loop_area(&x, &damper).unwrap();
    let exact = std::f64::consts::PI * c * w * a * a;
    assert!((area / exact - 1.0).abs() < 1e-3, "{area} for {exact}");
    let spring: Vec<f64> = x.iter().map(|x| 4.0 * x + x.powi(3)).collect();
    assert!(loop_area(&x, &spring).unwrap().abs() < 1e-3 * exact);
    assert_eq!(loop_area(&t, &t), None);
}
