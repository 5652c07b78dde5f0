//! Recordings that can be read and cannot be right: sensors that fail, recordings that do not fit, each with its finding.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, clippy::type_complexity)]

use std::fmt::Write as _;

use crate::common::{CASE, HEALTHY, found, joint, says};
use trueup_signals::check::Relation;
use trueup_signals::{FindingKind, Severity};

/// Pseudo-random numbers between -1 and 1.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43_758.545_3;
    2.0 * (x - x.floor()) - 1.0
}

/// A healthy swing of 2000 samples at 100 Hz, spoiled sample by sample: index, current, motor angle, velocity, load angle.
fn swing(spoil: impl Fn(usize, &mut [f64; 4])) -> String {
    let mut text = String::from("time,motorCurrent,motorAngle,motorVelocity,loadAngle\n");
    for i in 0..2000 {
        let t = i as f64 / 100.0;
        let w = 1.3;
        let mut x = [
            0.8 * (w * t + 0.3).cos() + 1e-3 * noise(i),
            16.0 * (w * t).sin() + 1e-3 * noise(7 * i + 1),
            16.0 * w * (w * t).cos() + 1e-2 * noise(3 * i + 5),
            ((0.1 * (w * t).sin() + 1e-5 * noise(5 * i + 2)) * 1e5).round() / 1e5,
        ];
        spoil(i, &mut x);
        let cells = x.map(|x| if x.is_nan() { String::new() } else { format!("{x}") });
        writeln!(text, "{t},{}", cells.join(",")).unwrap();
    }
    text
}

fn relations() -> Vec<Relation> {
    vec![
        Relation::Proportional {
            left: "motorAngle".into(),
            right: "loadAngle".into(),
            factor: 160.0,
            parameter: "gearRatio".into(),
        },
        Relation::Rate { rate: "motorVelocity".into(), of: "motorAngle".into() },
    ]
}

/// What is done to the samples.
type Spoil = Box<dyn Fn(usize, &mut [f64; 4])>;
/// Label, spoiler, finding.
type Sensor = (&'static str, Spoil, FindingKind, &'static [&'static str]);

#[test]
fn sensors() {
    use FindingKind::*;
    let mut known = joint();
    known.iter_mut().filter(|v| v.name == "motorVelocity").for_each(|v| v.nominal = Some(20.0));
    known.iter_mut().filter(|v| v.name == "motorCurrent").for_each(|v| v.max = Some(3.0));
    let case = format!(
        "{CASE}[channels.motorAngle]\nnoise = 1e-3\n[channels.loadAngle]\nnoise = 1e-5\nresolution = 1e-5\n\
         [channels.motorVelocity]\nnoise = 1e-2\n"
    );
    let look = |spoil: &Spoil| {
        let text = swing(spoil);
        found(&[("case.toml", case.as_bytes()), ("run.csv", text.as_bytes())], &known, &relations())
    };
    let healthy: Spoil = Box::new(|_, _| {});
    let nothing: Vec<_> = look(&healthy).into_iter().filter(|f| f.severity != Severity::Note).collect();
    assert!(nothing.is_empty(), "{nothing:#?}");

    let broken: Vec<Sensor> = vec![
        ("constant", Box::new(|_, x| x[3] = 0.25), Constant, &["loadAngle", "0.25 all along", "connected"]),
        (
            "clipped input",
            Box::new(|_, x| x[0] = x[0].clamp(-0.5, 0.5)),
            Clipped,
            &["motorCurrent", "0.5: clipped"],
        ),
        (
            "clipped output",
            Box::new(|_, x| x[2] = x[2].min(12.0)),
            Clipped,
            &["motorVelocity", "12: clipped"],
        ),
        (
            "stuck for a while",
            Box::new(|i, x| {
                if (300..500).contains(&i) {
                    x[1] = 3.0
                }
            }),
            Stuck,
            &["motorAngle at 3 s", "stays at 3 from 3 s to 4.99 s"],
        ),
        (
            "stuck for good",
            Box::new(|i, x| {
                if i >= 900 {
                    x[1] = -12.165
                }
            }),
            Stuck,
            &["motorAngle at 9 s", "to 19.99 s"],
        ),
        (
            "spikes",
            Box::new(|i, x| {
                if i == 700 || i == 901 {
                    x[3] += 0.05
                }
            }),
            Spike,
            &["loadAngle", "2 spikes", "left out", "leave these cells empty"],
        ),
        (
            "dropout",
            Box::new(|i, x| {
                if (400..460).contains(&i) {
                    x[1] = f64::NAN
                }
            }),
            Dropout,
            &["motorAngle at 3.99 s", "1 gap", "0.01 s is usual"],
        ),
        (
            "coarse steps",
            Box::new(|_, x| x[3] = (x[3] / 0.002).round() * 0.002),
            Quantisation,
            &["loadAngle", "steps of 0.00", "declared is a resolution of 1e-5"],
        ),
        (
            "twice the same",
            Box::new(|_, x| x[3] = x[1]),
            DuplicateChannel,
            &["loadAngle", "those of `motorAngle`"],
        ),
        (
            "degrees",
            Box::new(|_, x| x[3] *= 57.29578),
            Inconsistent,
            &["motorAngle", "expected is 160", "degrees were interpreted as radians"],
        ),
        ("swapped", Box::new(|_, x| x.swap(1, 3)), SwappedChannels, &["motorAngle", "swapped"]),
        ("sign", Box::new(|_, x| x[3] = -x[3]), Inconsistent, &["opposite sign"]),
        (
            "rpm",
            Box::new(|_, x| x[2] *= 9.549297),
            Inconsistent,
            &["integral of `motorVelocity`", "rpm were interpreted as rad/s"],
        ),
        (
            "far from usual",
            Box::new(|_, x| x[2] *= 1e4),
            UnitSuspicion,
            &["motorVelocity", "about 20 rad/s is usual"],
        ),
        (
            "milliamperes",
            Box::new(|_, x| x[0] *= 1e3),
            UnitSuspicion,
            &["motorCurrent", "largest sensible one, 3 A", "unit"],
        ),
        (
            "input ends early",
            Box::new(|i, x| {
                if i > 1500 {
                    x[0] = f64::NAN
                }
            }),
            InputShort,
            &["motorCurrent", "15 s"],
        ),
    ];
    for (label, spoil, kind, parts) in &broken {
        // What a sign or a unit explains is grave: a verdict would be about the recording, not about the plant.
        let grave = ["degrees", "swapped", "sign", "rpm"].contains(label);
        let severity = if grave { Severity::Grave } else { Severity::Warning };
        says(label, &look(spoil), severity, *kind, parts);
    }
}

#[test]
fn recordings_as_a_whole() {
    use FindingKind::*;
    use Severity::*;
    let in_ms: String = swing(|_, _| {})
        .lines()
        .enumerate()
        .map(|(i, line)| {
            let rest = line.split_once(',').unwrap().1;
            if i == 0 { format!("{line}\n") } else { format!("{},{rest}\n", 10 * i) }
        })
        .collect();
    // One channel has 50 samples within a millisecond, the other 50 over a thousand seconds.
    let rows = (0..100).map(|i| match i {
        0..50 => format!("{},{i},\n", f64::from(i) * 1e-5),
        _ => format!("{},,{i}\n", f64::from(i - 49) * 20.0),
    });
    let burst = format!("time,motorCurrent,motorAngle\n{}", rows.collect::<String>());
    let quantised = swing(|_, x| x[3] = (x[3] / 0.002).round() * 0.002);
    let broken: &[(&str, &str, Severity, FindingKind, &[&str])] = &[
        ("time in ms", &in_ms, Grave, TimeUnit, &["a sample every 10 s", "unit = \"ms\""]),
        ("three samples", HEALTHY, Warning, TooShort, &["3 samples"]),
        (
            "nothing moves",
            "time,motorCurrent,motorAngle\n0,0,1\n1,1,1\n2,0,1\n",
            Error,
            LittleExcitation,
            &["case.toml", "no output moves", "record a motion"],
        ),
        (
            "two samples",
            "time,motorCurrent,motorAngle\n0,1,1\n1,2,2\n",
            Error,
            TooShort,
            &["2 samples", "record"],
        ),
        ("one sample", "time,motorCurrent,motorAngle\n0,1,1\n", Error, TooShort, &["1 sample are"]),
        (
            "a clock that jumps",
            "time,motorCurrent,motorAngle\n0,0,0\n1,1,1\n2,0,1\n1e9,0,1\n",
            Error,
            TimeSpan,
            &["run.csv:5", "from 2 s to 1000000000 s", "two runs are two recordings"],
        ),
        ("a burst", &burst, Error, TimeSpan, &["motorCurrent", "a sample every 1e-5 s", "thin it out"]),
        (
            "beyond all quantities",
            "time,motorCurrent,motorAngle\n0,0,0\n1,1,1e160\n2,0,1\n",
            Error,
            BadValue,
            &["motorAngle at 1 s", "values up to 1e160", "`scale`"],
        ),
        (
            "unknown column",
            "time,motorCurrent,motorAngel,loadAngle\n0,1,1,1\n",
            Warning,
            UnknownColumn,
            &["motorAngel", "did you mean `motorAngle`?", "left out"],
        ),
        (
            "column of something else",
            "time,motorCurrent,motorAngle,temperature\n0,1,1,1\n",
            Warning,
            UnknownColumn,
            &["temperature", "or false"],
        ),
        ("no input", "time,motorAngle\n0,1\n1,2\n", Error, NoInput, &["nothing drives", "`motorCurrent`"]),
        ("no output", "time,motorCurrent\n0,1\n1,2\n", Error, NoOutput, &["no output", "`motorAngle`"]),
        ("one input missing", HEALTHY, Note, MissingInput, &["`externalTorque` not recorded", "takes 0"]),
        (
            "undeclared steps",
            &quantised,
            Note,
            Quantisation,
            &["loadAngle", "goes in steps of 0.00", "resolution = "],
        ),
    ];
    for (label, text, severity, kind, parts) in broken {
        says(label, &found(&[("run.csv", text.as_bytes())], &joint(), &relations()), *severity, *kind, parts);
    }
}
