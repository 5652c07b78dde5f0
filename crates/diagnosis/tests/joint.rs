//! A joint with something missing at one known place: that place has to be found, and what is missing there.
//!
//! The truth comes from a solver and friction law of this file's own.

#![allow(clippy::unwrap_used)]

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use trueup_diagnosis::engine::subject::DiagnosisSubject;
use trueup_diagnosis::locate::unknown_input::place_shares;
use trueup_diagnosis::locate::{JointColumns, joint_balances, joint_intervals, joint_unknown_inputs};
use trueup_diagnosis::picture::picture;
use trueup_models::effect::PlantKind;
use trueup_models::joint::parameter as j;

const H: f64 = 0.002;
const N: usize = 5000;
const GEAR: f64 = 100.0;
const MOTOR_FLOOR: f64 = 2e-4;
const LOAD_FLOOR: f64 = 2e-6;

fn parameters() -> [f64; j::COUNT] {
    let mut p = [0.0; j::COUNT];
    p[j::MOTOR_INERTIA] = 1e-4;
    p[j::LOAD_INERTIA] = 3.0;
    p[j::GEAR_RATIO] = GEAR;
    p[j::TORQUE_CONSTANT] = 0.05;
    p[j::STIFFNESS] = 0.4;
    p[j::DAMPING] = 4e-4;
    p[j::COULOMB_FRICTION] = 0.008;
    p[j::STATIC_FRICTION] = 0.008;
    p[j::VISCOUS_FRICTION] = 2e-4;
    p
}

/// Unknown torques on motor, transmission and load (motor side), by time, motor speed and twist.
type Missing = fn(f64, f64, f64) -> [f64; 3];

struct Run {
    current: Vec<f64>,
    motor: Vec<f64>,
    load: Vec<f64>,
    /// The unknown torques.
    missing: Vec<[f64; 3]>,
}

fn current(t: f64) -> f64 {
    0.9 * (1.7 * t).sin() + 0.5 * (5.1 * t).cos() + 0.25 * (17.0 * t).sin()
}

fn simulate(missing: Missing, seed: u64) -> Run {
    let p = parameters();
    let reflected = p[j::LOAD_INERTIA] / GEAR.powi(2);
    let rates = |t: f64, x: &[f64; 4]| {
        let [q, w, l, v] = *x; // the load's motion times the gear ratio
        let (twist, rate) = (q - l, w - v);
        let d = missing(t, w, twist);
        let spring = p[j::STIFFNESS] * twist + p[j::DAMPING] * rate;
        let friction = p[j::COULOMB_FRICTION] * (w / 0.05).tanh() + p[j::VISCOUS_FRICTION] * w;
        let drive = p[j::TORQUE_CONSTANT] * current(t) - friction;
        [w, (drive - spring - d[1] + d[0]) / p[j::MOTOR_INERTIA], v, (spring + d[1] + d[2]) / reflected]
    };
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut x = [0.0; 4];
    let mut run = Run { current: vec![], motor: vec![], load: vec![], missing: vec![] };
    for k in 0..N {
        let t = k as f64 * H;
        run.current.push(current(t));
        run.motor.push(x[0] + MOTOR_FLOOR * rng.sample::<f64, _>(StandardNormal));
        run.load.push(x[2] / GEAR + LOAD_FLOOR * rng.sample::<f64, _>(StandardNormal));
        run.missing.push(missing(t, x[1], x[0] - x[2]));
        let sub = 20;
        let h = H / f64::from(sub);
        for i in 0..sub {
            let t = t + f64::from(i) * h;
            let step = |x: &[f64; 4], k: &[f64; 4], h: f64| std::array::from_fn(|i| x[i] + h * k[i]);
            let a = rates(t, &x);
            let b = rates(t + h / 2.0, &step(&x, &a, h / 2.0));
            let c = rates(t + h / 2.0, &step(&x, &b, h / 2.0));
            let d = rates(t + h, &step(&x, &c, h));
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
    }
    run
}

fn columns(run: &Run) -> JointColumns<'_> {
    JointColumns {
        step: H,
        current: &run.current,
        hold: false,
        external: &[],
        motor: &run.motor,
        load: &run.load,
        current_floor: 0.0,
        motor_floor: MOTOR_FLOOR,
        load_floor: LOAD_FLOOR,
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len()) as f64;
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (ma, mb) = (mean(a), mean(b));
    let dot = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum::<f64>();
    dot(&|x, y| x * y) / (dot(&|x, _| x * x) * dot(&|_, y| y * y)).sqrt()
}

const CASES: [(&str, usize, Missing); 5] = [
    ("motor", 0, |t, _, _| [if (3.0..3.6).contains(&t) { -0.02 } else { 0.0 }, 0.0, 0.0]), // a push on the motor
    ("motor", 0, |_, w, _| [-0.006 * (w / 0.05).tanh() * (-(w / 4.0).powi(2)).exp(), 0.0, 0.0]), // Stribeck
    ("transmission", 1, |_, _, e| [0.0, 30.0 * e.powi(3), 0.0]), // a hardening spring
    ("load", 2, |t, _, _| [0.0, 0.0, if (4.0..4.5).contains(&t) { 0.01 } else { 0.0 }]), // contact
    ("load", 2, |t, _, _| [0.0, 0.0, 0.004 * (0.9 * t).sin()]),  // gravity
];

#[test]
fn the_place_where_something_is_missing_whitens_the_innovations() {
    for (seed, (place, which, missing)) in CASES.into_iter().enumerate() {
        let run = simulate(missing, seed as u64);
        let found = joint_unknown_inputs(&parameters(), true, &columns(&run));
        for e in &found {
            println!(
                "{seed} {place}: {} gain {:.0}, explained {:.3}, white {:.3}",
                e.place, e.gain, e.explained, e.whiteness
            );
        }
        assert_eq!(found[0].place, place, "case {seed}");
        assert!(found[0].gain > found[1].gain + 50.0 && found[0].explained > 0.8);
        let truth: Vec<f64> = run.missing.iter().map(|m| m[which]).collect();
        let r = correlation(&truth, &found[0].value);
        println!("  course: correlation {r:.3}");
        assert!(r > if seed == 1 { 0.5 } else { 0.9 }, "case {seed}: {r}");
        let shares = place_shares(&found);
        assert!(shares[0].0 == place && shares.iter().map(|s| s.1).sum::<f64>() <= 1.0 + 1e-12);
    }
}

#[test]
fn an_error_of_a_sensor_is_placed_there() {
    let mut run = simulate(|_, _, _| [0.0; 3], 11);
    run.load.iter_mut().enumerate().for_each(|(k, q)| *q += 2e-4 * (k as f64 / N as f64).powi(2));
    let found = joint_unknown_inputs(&parameters(), true, &columns(&run));
    assert_eq!(found[0].place, "sensor:loadAngle");
    let drift = found[0].value[N - 1] - found[0].value[0];
    assert!((drift / 2e-4 - 1.0).abs() < 0.1, "{drift}");
}

#[test]
fn without_anything_missing_no_place_explains_anything() {
    let run = simulate(|_, _, _| [0.0; 3], 12);
    let found = joint_unknown_inputs(&parameters(), true, &columns(&run));
    for e in &found {
        println!("{}: gain {:.1}, explained {:.3}", e.place, e.gain, e.explained);
        assert_eq!(e.explained, 0.0, "{}", e.place);
    }
    let balances = joint_balances(&parameters(), &columns(&run), 25.0).unwrap();
    for (name, b) in [("motor", &balances.motor), ("load", &balances.load), ("total", &balances.total)] {
        let moving: Vec<f64> =
            b.value.iter().zip(&balances.sliding).filter(|(_, s)| **s).map(|(v, _)| v / b.floor).collect();
        let rms = (moving.iter().map(|v| v * v).sum::<f64>() / moving.len() as f64).sqrt();
        println!("{name}: {rms:.2} floors, {} samples", moving.len());
        assert!((0.85..1.25).contains(&rms), "{name}: {rms}");
    }
}

#[test]
fn the_balance_that_is_not_concerned_stays_quiet() {
    for (seed, (place, _, missing)) in CASES.into_iter().enumerate() {
        let run = simulate(missing, seed as u64);
        let b = joint_balances(&parameters(), &columns(&run), 25.0).unwrap();
        let size = |x: &trueup_diagnosis::locate::EquationBalance| {
            let moving =
                x.value.iter().zip(&b.sliding).filter(|(_, s)| **s).map(|(v, _)| (v / x.floor).powi(2));
            (moving.sum::<f64>() / b.sliding.iter().filter(|s| **s).count() as f64).sqrt()
        };
        let sizes = [("load", size(&b.motor)), ("motor", size(&b.load)), ("transmission", size(&b.total))];
        println!("{place}: {sizes:.1?}");
        let quiet = sizes.iter().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
        assert_eq!(quiet.0, place);
        assert!(quiet.1 < 1.3 && sizes.iter().filter(|s| s.1 > 1.5 * quiet.1).count() == 2, "{sizes:?}");
    }
}

#[test]
fn a_push_is_found_in_time_by_its_estimate() {
    let run = simulate(CASES[3].2, 3);
    let found = joint_unknown_inputs(&parameters(), true, &columns(&run));
    let when = joint_intervals(&parameters(), true, &columns(&run), &found[0], "a.csv", 10.0, 0.05);
    println!("{when:?}");
    assert_eq!(when.len(), 1);
    assert!(when[0].share > 0.7 && when[0].share <= 1.0);
    for (edge, truth) in [(when[0].start, 14.0), (when[0].end, 14.5)] {
        assert!((edge - truth).abs() <= f64::max(2.0 * H, 5e-3) + 1e-9, "{edge}");
    }
}

/// As a case on the disk, all its recordings of the same effect.
fn case(missing: Missing, seeds: &[u64]) -> (tempfile::TempDir, trueup_signals::Loaded) {
    use std::fmt::Write as _;
    let folder = tempfile::tempdir().unwrap();
    let p = parameters();
    let names: Vec<String> = seeds.iter().map(|s| format!("\"{s}.csv\"")).collect();
    let mut toml = format!("model = \"TwoMassJoint\"\ntrain = [{}]\n[parameters]\n", names.join(", "));
    for (name, k) in [
        ("motorInertia", j::MOTOR_INERTIA),
        ("loadInertia", j::LOAD_INERTIA),
        ("gearRatio", j::GEAR_RATIO),
        ("torqueConstant", j::TORQUE_CONSTANT),
        ("stiffness", j::STIFFNESS),
        ("damping", j::DAMPING),
        ("coulombFriction", j::COULOMB_FRICTION),
        ("viscousFriction", j::VISCOUS_FRICTION),
    ] {
        writeln!(toml, "{name} = {:?}", p[k]).unwrap();
    }
    writeln!(
        toml,
        "[channels.motorAngle]\nnoise = {MOTOR_FLOOR:?}\n[channels.loadAngle]\nnoise = {LOAD_FLOOR:?}"
    )
    .unwrap();
    std::fs::write(folder.path().join("case.toml"), toml).unwrap();
    for &seed in seeds {
        let run = simulate(missing, seed);
        let mut csv = "time,motorCurrent,motorAngle,loadAngle\n".to_owned();
        for (k, ((u, m), l)) in run.current.iter().zip(&run.motor).zip(&run.load).enumerate() {
            writeln!(csv, "{:?},{u:?},{m:?},{l:?}", k as f64 * H).unwrap();
        }
        std::fs::write(folder.path().join(format!("{seed}.csv")), csv).unwrap();
    }
    let (loaded, _) = trueup_signals::Case::load(folder.path(), |_| Ok(Vec::new())).unwrap();
    (folder, loaded)
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn the_picture_of_a_case_shows_what_is_missing_and_where() {
    let subject = DiagnosisSubject::new(PlantKind::Joint, vec![true]);
    for (k, (place, components, missing)) in [
        ("motor", ["motor-friction", "actuator"], CASES[1].2),
        ("transmission", ["transmission"; 2], CASES[2].2),
        ("load", ["load"; 2], CASES[3].2),
    ]
    .into_iter()
    .enumerate()
    {
        let (_folder, loaded) = case(missing, &[20 + 2 * k as u64, 21 + 2 * k as u64]);
        let seen = picture(&loaded, &subject, &parameters());
        println!("{place}: {:?}", seen.places);
        assert!(components.contains(&seen.places[0].component.as_str()));
        assert!(seen.places[0].share > 0.8 && seen.places.iter().map(|p| p.share).sum::<f64>() < 1.0 + 1e-12);
        assert_eq!(seen.floors.len(), 2);
        // By structure: motor friction and actuator are one class, transmission and load each by itself.
        let reported = &seen.isolability;
        assert!(
            reported.isolable("transmission")
                && reported.isolable("load")
                && !reported.isolable("motor-friction")
        );
        assert_eq!(seen.courses.len(), 2);
        let law = |name: &str| seen.curves.iter().find(|c| c.title.contains(name)).unwrap();
        match place {
            // As the truth has it: 30 e^3 over the twist e.
            "transmission" => {
                let c = &law("against twist").map;
                let ends = [0, c.x.len() - 1].map(|i| c.mean[i] / (30.0 * c.x[i].powi(3)));
                println!("  of the truth at both ends: {ends:.2?}");
                assert!(ends.iter().all(|r| (r - 1.0).abs() < 0.15), "{ends:?}");
                // The spring hardens: more torque per twist outside than in the middle.
                let s = &seen.surfaces[0].map;
                let cells = |x: usize| s.z.iter().filter_map(|row| row[x]).collect::<Vec<f64>>();
                let mean = |v: Vec<f64>| v.iter().sum::<f64>() / v.len() as f64;
                let rise = mean(cells(s.x.len() - 2)) - mean(cells(0));
                let secant = rise / (s.x[s.x.len() - 2] - s.x[0]);
                println!("  secant stiffness {secant:.3} N.m/rad");
                assert!(secant > 1.05 * parameters()[j::STIFFNESS]);
            }
            "load" => {
                let edges: Vec<f64> = seen.intervals.iter().flat_map(|i| [i.start, i.end]).collect();
                println!("  {edges:?}");
                for truth in [4.0, 4.5] {
                    let near = edges.iter().filter(|e| (*e - truth).abs() <= 5e-3).count();
                    assert_eq!(near, 2, "{truth} in both recordings: {edges:?}");
                }
            }
            _ => {
                // It brakes, most at low speed.
                let c = &law("against motor speed").map;
                let at = |v: f64| {
                    let k = (0..c.x.len()).min_by(|a, b| (c.x[*a] - v).abs().total_cmp(&(c.x[*b] - v).abs()));
                    c.mean[k.unwrap()]
                };
                println!("  {:.4} {:.4} {:.4} {:.4}", at(-10.0), at(-1.5), at(1.5), at(10.0));
                assert!(at(1.5) < -0.002 && at(-1.5) > 0.002);
                assert!(at(10.0).abs() < 0.4 * at(1.5).abs());
            }
        }
    }
}

#[test]
fn the_picture_of_a_case_without_a_gap_has_no_place() {
    let (_folder, loaded) = case(|_, _, _| [0.0; 3], &[30]);
    let seen = picture(&loaded, &DiagnosisSubject::new(PlantKind::Joint, vec![true]), &parameters());
    assert_eq!(seen.places, []);
}
