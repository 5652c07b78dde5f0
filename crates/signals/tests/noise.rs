//! The noise floor from repeats, rest and declarations.

#![allow(clippy::unwrap_used)]

use rand::{Rng, SeedableRng, rngs::StdRng};
use rand_distr::Normal;
use trueup_signals::noise::{NoiseFloorSource, correlation, floor};
use trueup_signals::{Channel, Loaded, Recording};

/// A motion from this start, read with noise of standard deviation 0.02.
fn run(name: &str, start: f64, moves: f64, rng: &mut StdRng) -> Recording {
    let noise = Normal::new(0.0, 0.02).unwrap();
    let time: Vec<f64> = (0..4000).map(|i| start + 0.001 * f64::from(i)).collect();
    let values = time.iter().map(|t| moves * (3.0 * (t - start)).sin() + rng.sample(noise)).collect();
    let end = time[3999];
    Recording {
        name: name.into(),
        start,
        end,
        channels: vec![Channel::new("motorAngle", "rad", time, values)],
        ..Recording::default()
    }
}

fn loaded() -> Loaded {
    let mut rng = StdRng::seed_from_u64(1);
    let runs = [("a", 0.0, 5.0), ("b", 7.0, 5.0), ("c", -1.0, 5.0), ("rest", 0.0, 0.0)];
    let recordings = runs.map(|(name, start, moves)| (name.to_owned(), run(name, start, moves, &mut rng)));
    Loaded { recordings: recordings.into_iter().collect(), ..Loaded::default() }
}

#[test]
fn repeats_go_before_rest_and_rest_before_what_is_declared() {
    let mut loaded = loaded();
    assert_eq!(floor(&loaded, "motorAngle"), None);
    for run in loaded.recordings.values_mut() {
        run.channels[0].sensor.noise = Some(0.3);
        run.channels[0].sensor.resolution = Some(0.12);
    }
    let declared = floor(&loaded, "motorAngle").unwrap();
    assert_eq!(declared.source, NoiseFloorSource::Declared);
    assert!((declared.deviation - 0.0912_f64.sqrt()).abs() < 1e-12);
    loaded.recordings.values_mut().for_each(|r| r.channels[0].sensor.resolution = None);
    loaded.case.rest = vec!["rest".into()];
    // 4000 values: 1.1 % is one standard error of a standard deviation.
    let rest = floor(&loaded, "motorAngle").unwrap();
    assert_eq!(rest.source, NoiseFloorSource::Rest);
    assert!((rest.deviation / 0.02 - 1.0).abs() < 0.04, "{rest:?}");
    loaded.case.repeats = vec![vec!["a".into(), "b".into(), "c".into()]];
    let repeats = floor(&loaded, "motorAngle").unwrap();
    assert_eq!(repeats.source, NoiseFloorSource::Repeats);
    assert!((repeats.deviation / 0.02 - 1.0).abs() < 0.03, "{repeats:?}");
    assert_eq!(floor(&loaded, "loadAngle"), None);
}

#[test]
fn a_reading_that_stays_in_one_count_is_not_free_of_noise() {
    let mut loaded = loaded();
    loaded.case.rest = vec!["rest".into()];
    let channel = &mut loaded.recordings.get_mut("rest").unwrap().channels[0];
    channel.values.fill(0.25);
    channel.sensor.resolution = Some(0.12);
    assert!((floor(&loaded, "motorAngle").unwrap().deviation - 0.12 / 12f64.sqrt()).abs() < 1e-15);
}

#[test]
fn noise_that_lasts_shows_at_rest() {
    let normal = Normal::new(0.0, 1.0).unwrap();
    for (told, resolution) in [(0.0, 0.0), (0.6, 0.0), (0.6, 0.02), (0.9, 0.02)] {
        let mut rng = StdRng::seed_from_u64(5);
        let mut noise = 0.0;
        let mut loaded = loaded();
        let channel = &mut loaded.recordings.get_mut("rest").unwrap().channels[0];
        for v in &mut channel.values {
            noise = told * noise + f64::sqrt(1.0 - told * told) * rng.sample(normal);
            *v = 3.0 + 0.02 * noise;
            if resolution > 0.0 {
                *v = (*v / resolution).round() * resolution;
            }
        }
        channel.sensor.resolution = Some(resolution);
        assert_eq!(correlation(&loaded, "motorAngle"), 0.0, "no recording is declared to be at rest");
        loaded.case.rest = vec!["rest".into()];
        let found = correlation(&loaded, "motorAngle");
        assert!((found - told).abs() < 0.05, "{told} at {resolution}: {found}");
    }
}

#[test]
fn what_drifts_between_repeats_is_no_noise() {
    let mut loaded = loaded();
    loaded.case.repeats = vec![vec!["a".into(), "b".into(), "c".into()]];
    assert!(floor(&loaded, "motorAngle").unwrap().drift < 0.005);
    // The motion of the second and the third is 4 % and 8 % larger: about their mean 0.2 sin(3 t).
    for (name, more) in [("b", 0.2), ("c", 0.4)] {
        let run = loaded.recordings.get_mut(name).unwrap();
        let start = run.start;
        let channel = &mut run.channels[0];
        let moved = channel.time.iter().map(|t| more * (3.0 * (t - start)).sin());
        channel.values.iter_mut().zip(moved).for_each(|(v, m)| *v += m);
    }
    let found = floor(&loaded, "motorAngle").unwrap();
    assert!((found.deviation / 0.02 - 1.0).abs() < 0.03, "{found:?}");
    // 0.2 sin(3 t) twice in three runs, over 12 rad: 0.04 (0.5 - sin(24) / 48) of each, over two degrees of freedom.
    let exact = (0.04 * (0.5 - 24f64.sin() / 48.0)).sqrt();
    assert!((found.drift / exact - 1.0).abs() < 0.02, "{found:?} {exact}");
}
