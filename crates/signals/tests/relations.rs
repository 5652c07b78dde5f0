//! Channels that contradict each other: a gear ratio that angles deny, a unit in one of several files, a channel that is dead;
//! and none of that where a joint has play, twist and coarse encoders. Drawn by a seed.

use std::collections::BTreeMap;
use std::ops::Range;

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_signals::check::{self, Relation};
use trueup_signals::{Case, Finding, FindingKind, Severity};

const SEED: u64 = 6205;
const CASE: &str = "model = \"TwoMassJoint\"\ntrain = [\"a.csv\", \"b.csv\", \"c.csv\"]\n[parameters]\n\
                    [channels.motorAngle]\nnoise = 1e-3\n[channels.loadAngle]\nresolution = 2e-5\n";

type Columns = Vec<(String, Vec<f64>)>;

/// Three swings of a joint with this gear ratio: twist by a spring, play, noise, counts.
fn swings(rng: &mut StdRng, gear: f64) -> BTreeMap<String, Columns> {
    swings_of(rng, gear, 1.0..9.0, [0.05, 0.05])
}

/// The same at these angular frequencies, with twist and play up to these shares of the swing.
fn swings_of(
    rng: &mut StdRng,
    gear: f64,
    frequencies: Range<f64>,
    most: [f64; 2],
) -> BTreeMap<String, Columns> {
    let one = |name: &str, rng: &mut StdRng| {
        let (size, w) = (gear * rng.random_range(0.05..0.5), rng.random_range(frequencies.clone()));
        let [twist, play] = most.map(|most| rng.random_range(0.0..most));
        let (mut time, mut motor, mut load, mut rate) = (vec![], vec![], vec![], vec![]);
        let mut held: f64 = 0.0;
        for k in 0..1500 {
            let t = f64::from(k) * 4e-3;
            let q = size * (w * t).sin();
            // The load follows within the play.
            held = held.clamp(q - play * size, q + play * size);
            let l = (held - twist * size * (w * t).sin()) / gear;
            time.push(t);
            motor.push(q + 1e-3 * rng.random_range(-1.0..1.0));
            rate.push(size * w * (w * t).cos() + 0.01 * size * rng.random_range(-1.0..1.0));
            load.push((l / 2e-5).round() * 2e-5);
        }
        let columns = [("time", time), ("motorAngle", motor), ("motorVelocity", rate), ("loadAngle", load)];
        (name.to_owned(), columns.map(|(n, v)| (n.to_owned(), v)).into())
    };
    ["a.csv", "b.csv", "c.csv"].map(|name| one(name, rng)).into()
}

fn grave(tables: &BTreeMap<String, Columns>, factor: f64) -> Vec<Finding> {
    grave_in(CASE, tables, factor)
}

fn grave_in(case: &str, tables: &BTreeMap<String, Columns>, factor: f64) -> Vec<Finding> {
    let (left, right) = ("motorAngle".to_owned(), "loadAngle".to_owned());
    let relations = [
        Relation::Proportional { left, right, factor, parameter: "gearRatio".into() },
        Relation::Rate { rate: "motorVelocity".into(), of: "motorAngle".into() },
    ];
    let (loaded, _) = Case::of_tables(case, tables, |_| Ok(Vec::new())).unwrap();
    let all = check::case(&loaded, &[], &relations);
    all.into_iter().filter(|f| f.severity >= Severity::Grave).collect()
}

fn column<'a>(columns: &'a mut Columns, name: &str) -> &'a mut Vec<f64> {
    &mut columns.iter_mut().find(|c| c.0 == name).unwrap().1
}

fn drawn() -> (StdRng, [&'static str; 3]) {
    println!("seed {SEED}");
    (StdRng::seed_from_u64(SEED), ["a.csv", "b.csv", "c.csv"])
}

#[test]
fn a_healthy_joint_contradicts_nothing() {
    let (mut rng, _) = drawn();
    for _ in 0..30 {
        let gear = rng.random_range(20.0..300.0);
        let found = grave(&swings(&mut rng, gear), gear * rng.random_range(0.95..1.05));
        assert!(found.is_empty(), "{found:#?}");
    }
}

#[test]
fn a_joint_with_a_wide_play_contradicts_nothing() {
    let (mut rng, _) = drawn();
    // About one slow swing in a recording: the load rests in the play for more than a tenth of it.
    for _ in 0..40 {
        let gear = rng.random_range(20.0..300.0);
        let tables = swings_of(&mut rng, gear, 0.3..2.0, [0.05, 0.25]);
        let found = grave(&tables, gear * rng.random_range(0.95..1.05));
        assert!(found.is_empty(), "{found:#?}");
    }
}

/// A recording at rest of a geared joint: noise and counts alone, by the sizes of encoders that are in use; some are not declared.
fn rests(rng: &mut StdRng, gear: f64) -> (String, BTreeMap<String, Columns>) {
    let mut size = |least: f64, most: f64| (least.ln() + rng.random::<f64>() * (most / least).ln()).exp();
    let counts = [size(1e-4, 0.3), size(1e-5, 2e-4), size(0.1, 5.0)];
    let noise = [0, 1, 2].map(|k| counts[k] * size(0.05, 1.0));
    let step = size(1e-3, 1e-2);
    let mut case =
        String::from("model = \"TwoMassJoint\"\ntrain = [\"a.csv\", \"b.csv\", \"c.csv\"]\n[parameters]\n");
    for (k, name) in ["motorAngle", "loadAngle"].into_iter().enumerate() {
        if rng.random_bool(0.7) {
            case += &format!("[channels.{name}]\nresolution = {:e}\nnoise = {:e}\n", counts[k], noise[k]);
        }
    }
    let mut tables = swings(rng, gear);
    let mut normal = || (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
    let mut read = |k: usize, at: f64| ((at + noise[k] * normal()) / counts[k]).round() * counts[k];
    let time: Vec<f64> = (0..300).map(|k| step * f64::from(k)).collect();
    let mut rows = |k: usize| time.iter().map(|_| read(k, 0.0)).collect::<Vec<_>>();
    let [motor, load, rate] = [rows(0), rows(1), rows(2)];
    let all = [("motorAngle", motor), ("motorVelocity", rate), ("loadAngle", load), ("time", time)];
    tables.insert("c.csv".into(), all.map(|(n, v)| (n.to_owned(), v)).into());
    (case, tables)
}

#[test]
fn a_joint_at_rest_contradicts_nothing() {
    let (mut rng, _) = drawn();
    for _ in 0..60 {
        let gear = 10.0 * 5e3_f64.powf(rng.random::<f64>());
        let (case, tables) = rests(&mut rng, gear);
        let found = grave_in(&case, &tables, gear);
        let at_rest: Vec<_> = found.iter().filter(|f| f.file.ends_with("c.csv")).collect();
        assert!(at_rest.is_empty(), "gear {gear}: {at_rest:#?}");
    }
}

#[test]
fn a_gear_ratio_that_all_recordings_deny_is_named_once_and_never_as_rpm() {
    let (mut rng, _) = drawn();
    // No unit makes these.
    for times in [0.1, 0.3, 0.6, 1.5, 3.0, 9.5, 10.0, 0.1047] {
        let gear = rng.random_range(20.0..300.0);
        let found = grave(&swings(&mut rng, gear), gear * times);
        let [one] = &found[..] else { panic!("{times}: {found:#?}") };
        assert_eq!(
            (one.kind, one.file.display().to_string().contains("case")),
            (FindingKind::GearRatio, true),
            "{one:?}"
        );
        assert!(one.what.contains("gearRatio contradicts") && !one.what.contains("rpm"), "{}", one.what);
        // The value that the angles give is in the message.
        let said: f64 =
            one.what.split("it would be ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
        assert!((said / gear - 1.0).abs() < 0.1, "{said}, not {gear}");
    }
}

#[test]
fn a_unit_in_one_of_three_files_is_of_that_file() {
    let (mut rng, names) = drawn();
    for (factor, said) in [
        (57.29578, "degrees"),
        (1e3, "milli"),
        (-1.0, "opposite sign"),
        (3.7, "the other recordings agree with gearRatio"),
    ] {
        let gear = rng.random_range(20.0..300.0);
        let mut tables = swings(&mut rng, gear);
        let name = names[rng.random_range(0..3)];
        column(tables.get_mut(name).unwrap(), "loadAngle").iter_mut().for_each(|x| *x *= factor);
        let found = grave(&tables, gear);
        let [one] = &found[..] else { panic!("{factor}: {found:#?}") };
        assert!(one.file.ends_with(name) && one.what.contains(said), "{one:?}");
    }
}

#[test]
fn a_dead_channel_is_named_with_its_file() {
    let (mut rng, names) = drawn();
    for k in 0..24 {
        let gear = rng.random_range(20.0..300.0);
        let mut tables = swings(&mut rng, gear);
        let (name, channel) =
            (names[rng.random_range(0..3)], ["loadAngle", "motorAngle", "motorVelocity"][k % 3]);
        // All along, or from somewhere on; a rate that is not 0 need not be wrong.
        let from = if k % 2 == 0 { 0 } else { rng.random_range(200..900) };
        let own = column(tables.get_mut(name).unwrap(), channel);
        let held = if channel == "motorVelocity" { 0.0 } else { own[from] };
        own[from..].fill(held);
        let found = grave(&tables, gear);
        let told = found.iter().find(|f| f.kind == FindingKind::DeadChannel);
        let one = told.unwrap_or_else(|| panic!("{name} {channel} from {from}: {found:#?}"));
        assert!(one.file.ends_with(name), "{one:?}");
        assert_eq!(one.channel.as_deref(), Some(channel), "{found:#?}");
    }
}
