//! The noise floor and the gap against it, where the truth is known.

#![allow(clippy::unwrap_used)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::floor::{ChannelFloorSource, ReplayedChannel, carried, gaps, input, output};
use trueup_signals::{Channel, Loaded, Recording};

fn run(name: &str, values: Vec<f64>) -> Recording {
    let time: Vec<f64> = (0..values.len()).map(|i| 0.002 * i as f64).collect();
    let end = 0.002 * (values.len() - 1) as f64;
    let channels = vec![Channel::new("motorAngle", "rad", time, values)];
    Recording { name: name.into(), end, channels, ..Recording::default() }
}

fn case(runs: Vec<Recording>) -> Loaded {
    Loaded { recordings: runs.into_iter().map(|r| (r.name.clone(), r)).collect(), ..Loaded::default() }
}

fn white(n: usize, sd: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..n).map(|_| sd * rng.sample::<f64, _>(StandardNormal)).collect()
}

#[test]
fn without_a_declaration_the_noise_under_a_motion_is_estimated_and_reported() {
    let motion = |i: usize| 3.0 * (0.002 * i as f64 * 9.0).sin();
    let noisy = white(5000, 0.01, 1).iter().enumerate().map(|(i, e)| motion(i) + e).collect();
    let floor = output(&case(vec![run("a", noisy)]), "motorAngle").unwrap();
    assert_eq!(floor.source, ChannelFloorSource::HighFrequency);
    assert!((floor.deviation / 0.01 - 1.0).abs() < 0.07, "{floor:?}");
    // Encoder counts: neighbouring samples are often equal, so that differences alone would say 0.
    let counts = (0..5000).map(|i| (motion(i) / 0.05).round() * 0.05).collect();
    let floor = output(&case(vec![run("a", counts)]), "motorAngle").unwrap();
    assert!((floor.deviation / (0.05 / 12f64.sqrt()) - 1.0).abs() < 0.5, "{floor:?}");
    assert_eq!(output(&case(vec![run("a", vec![1.0; 100])]), "motorAngle"), None);
}

#[test]
fn coloured_noise_has_a_spectrum_and_white_noise_none() {
    let mut state = 0.0;
    let coloured: Vec<f64> = white(8000, 0.01, 2)
        .iter()
        .map(|e| {
            state = 0.9 * state + e;
            state
        })
        .collect();
    let mut loaded = case(vec![run("rest", coloured.clone()), run("white", white(8000, 0.01, 3))]);
    loaded.case.rest = vec!["rest".into()];
    let floor = output(&loaded, "motorAngle").unwrap();
    assert_eq!(floor.source, ChannelFloorSource::Rest);
    // AR(1): variance 1/(1 - 0.81), (1 + 0.9)/(1 - 0.9) samples for one.
    assert!((floor.deviation / (0.01 / 0.19_f64.sqrt()) - 1.0).abs() < 0.06, "{}", floor.deviation);
    assert!((floor.correlation / 19.0 - 1.0).abs() < 0.35, "{}", floor.correlation);
    let spectrum = floor.spectrum.unwrap();
    let density = |f: f64| {
        let z = std::f64::consts::TAU * f / 500.0;
        2.0 * 1e-4 / 500.0 / (1.0 - 1.8 * z.cos() + 0.81)
    };
    for (f, p) in spectrum.frequency.iter().zip(&spectrum.value).skip(2).step_by(40) {
        assert!((p / density(*f)).ln().abs() < 1.2, "{f} Hz: {p} for {}", density(*f));
    }
    loaded.case.rest = vec!["white".into()];
    assert_eq!(output(&loaded, "motorAngle").unwrap().spectrum, None);
    // Repeats: the same motion, another noise.
    let motion = |e: &[f64]| e.iter().enumerate().map(|(i, e)| (0.01 * i as f64).sin() + e).collect();
    let mut loaded = case(vec![run("a", motion(&coloured)), run("b", motion(&white(8000, 0.01, 5)))]);
    loaded.case.repeats = vec![vec!["a".into(), "b".into()]];
    let floor = output(&loaded, "motorAngle").unwrap();
    assert_eq!(floor.source, ChannelFloorSource::Repeats);
    assert!(
        (floor.deviation / (0.5 * (1e-4 + 1e-4 / 0.19_f64)).sqrt() - 1.0).abs() < 0.05,
        "{}",
        floor.deviation
    );
    assert!(floor.spectrum.is_some());
    // An input: in repeats it differs because it was another one.
    assert_eq!(input(&loaded, "motorAngle"), None);
}

#[test]
fn noise_of_an_input_grows_on_its_way_as_theory_predicts() {
    // Twice integrated white noise of a current: variance h^4 sd^2 sum k^2.
    let (n, h, sd) = (400, 0.01, 0.5);
    let twice = |inputs: &[Vec<f64>]| -> Result<Vec<Vec<f64>>, ()> {
        let (mut v, mut x) = (0.0, 0.0);
        let step = |u: &f64| {
            x += h * v;
            v += h * u;
            x
        };
        Ok(vec![inputs[0].iter().map(step).collect(), vec![0.0; n]])
    };
    let inputs = [vec![1.0; n], vec![2.0; n]];
    let found = carried(&inputs, &[[sd, 0.0], [0.0; 2]], 400, 7, twice).unwrap();
    let variance = |k: usize| (1..k).map(|j| (h * h * sd).powi(2) * (j * j) as f64).sum::<f64>();
    let theory = ((0..n).map(variance).sum::<f64>() / n as f64).sqrt();
    assert!((found[0] / theory - 1.0).abs() < 0.12, "{} for {theory}", found[0]);
    assert_eq!(found[1], 0.0);
    // Noise that lasts is more of what is slow: (1 + r) / (1 - r) as a power.
    let lasting = carried(&inputs, &[[sd, 0.6], [0.0; 2]], 400, 7, twice).unwrap();
    assert!((lasting[0] / found[0] / 2.0 - 1.0).abs() < 0.12, "{} for {}", lasting[0], found[0]);
    assert_eq!(found, carried(&inputs, &[[sd, 0.0], [0.0; 2]], 400, 7, twice).unwrap());
    assert_eq!(carried(&inputs, &[[0.0; 2]; 2], 400, 7, twice).unwrap(), [0.0, 0.0]);
    assert_eq!(carried(&inputs, &[[1.0, 0.0], [0.0; 2]], 2, 7, |_| Err("no")), Err("no"));
}

#[test]
fn gaps_are_pooled_closed_and_bounded() {
    let (n, sd) = (4000, 0.05);
    let truth: Vec<f64> = (0..n).map(|i| (0.01 * i as f64).sin()).collect();
    let measured: Vec<f64> = truth.iter().zip(white(n, sd, 4)).map(|(x, e)| x + e).collect();
    let scaled = |by: f64| truth.iter().map(|x| by * x).collect::<Vec<_>>();
    let (before, tuned, after) = (scaled(0.5), scaled(0.7), scaled(0.95));
    let still = vec![3.0; n];
    let replayed = |channel, measured, before| ReplayedChannel {
        recording: "holdout-1.csv",
        channel,
        measured,
        before,
        tuned: &tuned,
        after: &after,
        floor: sd,
    };
    let found = gaps(&[replayed("loadAngle", &measured, &before), replayed("still", &still, &before)], 1);
    assert_eq!(found.left_out, ["still"]);
    let gap = found.overall.unwrap();
    // Independent of the noise: (a^2/2 + sd^2) over (1/2 + sd^2).
    let theory = |a: f64| ((a * a / 2.0 + sd * sd) / (0.5 + sd * sd)).sqrt();
    for (figure, a) in [(gap.before, 0.5), (gap.tuned, 0.3), (gap.after, 0.05), (gap.floor, 0.0)] {
        assert!((figure / theory(a) - 1.0).abs() < 0.02, "{figure} for {}", theory(a));
    }
    let closed = (theory(0.5) - theory(0.05)) / (theory(0.5) - theory(0.0));
    assert!((gap.closed.unwrap() - closed).abs() < 0.01);
    let [low, high] = gap.ci95.unwrap();
    assert!(low < closed && closed < high && high - low < 0.03, "{low} {high}");
    // Nothing to close.
    let found = gaps(&[replayed("loadAngle", &measured, &truth)], 1).overall.unwrap();
    assert!(found.closed.is_none() || found.ci95.is_none());
    assert_eq!(gaps(&[], 1).overall, None);
}
