//! A current that is recorded in another unit or with the opposite sign, and gaps that are none of that.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::made::Joint;
use trueup_diagnosis::diagnose::input_scale::mistaken;
use trueup_diagnosis::engine::recordings::PreparedCase;
use trueup_diagnosis::engine::search::CaseSearch;
use trueup_diagnosis::outcome::{NoticedMistake, OutcomeSeverity};
use trueup_signals::Loaded;

/// Findings for a joint whose spring has a play of `slack`, in rad, to both sides; 0: nothing is missing.
fn found(current_gain: f64, slack: f64) -> Vec<NoticedMistake> {
    reported(&recorded(current_gain, slack))
}

fn recorded(current_gain: f64, slack: f64) -> Loaded {
    let j = Joint { current_gain, ..Joint::default() };
    j.recorded(|current, [q, w, l, v]| {
        let twist = q - l;
        let spring = j.stiffness * (twist - twist.clamp(-slack, slack)) + j.damping * (w - v);
        let drive = j.torque_constant * current - j.coulomb * (w / 0.05).tanh() - j.viscous * w;
        [*w, (drive - spring) / j.motor_inertia, *v, spring / j.reflected()]
    })
}

fn reported(loaded: &Loaded) -> Vec<NoticedMistake> {
    let case = PreparedCase::new(loaded).unwrap();
    mistaken(&CaseSearch::new(&case, 1).unwrap())
}

/// Multiplies the current of a file.
fn times(loaded: &mut Loaded, file: &str, factor: f64) {
    let run = loaded.recordings.get_mut(file).unwrap();
    let current = run.channels.iter_mut().find(|c| c.name == "motorCurrent").unwrap();
    current.values.iter_mut().for_each(|x| *x *= factor);
}

/// One of four files, the one held out too, in another unit, turned, or dead: named with its file, and nothing else is.
fn one_file(seed: u64, count: usize) {
    println!("seed {seed}");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let degrees = std::f64::consts::PI / 180.0;
    for k in 0..count {
        let slack: f64 = [0.0, 0.1, 0.3][rng.random_range(0..3)];
        let file = ["1.csv", "2.csv", "3.csv", "4.csv"][rng.random_range(0..4)];
        let (factor, message) = [
            (1e3, "thousandths were interpreted as units in this recording alone"),
            (0.0, "the channel is dead"),
            (-1.0, "it had the opposite sign in this recording alone"),
            (1e-3, "units were interpreted as thousandths in this recording alone"),
            (degrees, "radians were interpreted as degrees in this recording alone"),
            (1.0 / degrees, "degrees were interpreted as radians in this recording alone"),
        ][k % 6];
        let mut loaded = recorded(1.0, slack);
        times(&mut loaded, file, factor);
        let all = reported(&loaded);
        let [one] = &all[..] else { panic!("{file} times {factor}, slack {slack}: {all:?}") };
        assert_eq!((one.severity, &*one.file), (OutcomeSeverity::Grave, file), "{}", one.text);
        assert!(one.text.contains(message), "times {factor}, slack {slack}: {}", one.text);
    }
}

#[test]
fn a_file_in_another_unit_is_reported_by_its_name() {
    one_file(62, 2);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn any_file_in_any_unit_is_reported_by_its_name() {
    one_file(6203, 36);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn a_current_in_another_unit_is_reported_next_to_a_gap() {
    for (gain, slack) in [(1e3, 0.3), (1e3, 2.0), (1e-3, 0.1), (1e-3, 0.3)] {
        let all = found(gain, slack);
        let [one] = &all[..] else { panic!("times {gain}, slack {slack}: {all:?}") };
        assert!(one.file == "case.toml" && one.text.contains("in every recording"), "{}", one.text);
    }
}

/// Next to any slack: the unit in which a current is, or none.
fn next_to_any_slack(seed: u64, count: usize) {
    println!("seed {seed}");
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let degrees = std::f64::consts::PI / 180.0;
    let mut named = 0;
    for k in 0..count {
        let slack: f64 = rng.random_range(0.0..2.2);
        let (factor, message) = [
            (1e3, "thousandths were interpreted as units in every recording"),
            (1e-3, "units were interpreted as thousandths in every recording"),
            (degrees, "radians were interpreted as degrees in every recording"),
            (1.0 / degrees, "degrees were interpreted as radians in every recording"),
            (1.0, ""),
        ][k % 5];
        let all = found(factor, slack);
        println!("times {factor}, slack {slack}: {:?}", all.iter().map(|m| &m.text).collect::<Vec<_>>());
        match &all[..] {
            [] => named += usize::from(factor == 1.0),
            [one] => {
                assert!(
                    factor != 1.0 && one.text.contains(message),
                    "times {factor}, slack {slack}: {}",
                    one.text
                );
                named += 1;
            }
            _ => panic!("times {factor}, slack {slack}: {all:?}"),
        }
    }
    println!("{named} of {count} named, none wrongly");
    assert!(named * 10 >= count * 9, "{named} of {count}");
}

#[test]
fn a_current_in_milliamperes_is_reported_next_to_the_widest_slack() {
    let all = found(1e3, 2.0);
    let [one] = &all[..] else { panic!("{all:?}") };
    assert!(
        one.file == "case.toml" && one.text.contains("thousandths were interpreted as units in every"),
        "{}",
        one.text
    );
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn any_unit_is_reported_next_to_any_slack() {
    next_to_any_slack(6204, 40);
}

#[test]
fn a_current_in_another_unit_or_turned_is_reported() {
    let (milli, turned) = ("thousandths were interpreted", "opposite sign");
    for (gain, slack, message) in [
        (1e3, 0.0, milli),
        (1e3, 0.1, milli),
        (1e-3, 0.0, "units were interpreted"),
        (-1.0, 0.0, turned),
        (-1.0, 0.1, turned),
    ] {
        let all = found(gain, slack);
        let [reported] = &all[..] else { panic!("times {gain}, slack {slack}: {all:?}") };
        println!("times {gain}, slack {slack}: {}", reported.text);
        assert_eq!(
            (reported.severity, reported.channel.as_deref()),
            (OutcomeSeverity::Grave, Some("motorCurrent"))
        );
        assert!(reported.text.contains(message), "{}", reported.text);
    }
}

/// Recordings need not have the same channels: the motion that all show is what is compared.
#[test]
fn a_recording_without_a_reading_of_the_others_is_compared_with_them() {
    let mut loaded = recorded(1.0, 0.3);
    loaded.recordings.get_mut("2.csv").unwrap().channels.retain(|c| c.name != "loadAngle");
    assert_eq!(reported(&loaded), []);
    // Nor do they have where a reading keeps one value.
    let mut loaded = recorded(1.0, 0.3);
    let run = loaded.recordings.get_mut("3.csv").unwrap();
    let angle = run.channels.iter_mut().find(|c| c.name == "motorAngle").unwrap();
    angle.values.fill(0.25);
    let all = reported(&loaded);
    assert!(all.iter().all(|m| m.file == "3.csv"), "{all:?}");
}

#[test]
fn what_is_missing_is_no_unit() {
    for slack in [0.0, 0.3, 2.0] {
        assert_eq!(found(1.0, slack), [], "slack {slack}");
    }
    // A motor that is a third weaker than assumed has no other unit.
    assert_eq!(found(1.5, 0.3), []);
}
