//! One recording in every way of writing it that loggers have: it reads as the plain one does. The ways are drawn.

use std::fmt::Write as _;
use std::fs;

use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};

use crate::common::joint;
use trueup_signals::{DeclaredFigures, Finding, FindingKind, InputTable, Recording, Severity};

const FEW: u64 = 60;
const ALL: u64 = 2000;

/// Time in s, current in A, angle in rad; a jump where two times are the same.
struct Plain {
    rows: Vec<[f64; 3]>,
}

fn plain(rng: &mut StdRng) -> Plain {
    let n = rng.random_range(4..40);
    let step = [1e-3, 0.01, 0.125][rng.random_range(0..3)];
    let jump = rng.random_range(1..n);
    let mut rows = Vec::new();
    for k in 0..n {
        let t = f64::from(k) * step;
        let mut row =
            || [t, rng.random_range(-1000..1000) as f64 / 1e3, rng.random_range(-1000..1000) as f64 / 64.0];
        rows.push(row());
        if k == jump {
            rows.push(row());
        }
    }
    Plain { rows }
}

/// A way of writing it.
#[derive(Debug)]
struct Way {
    separator: char,
    comma: bool,
    /// The column of times: its head, and what it counts.
    clock: Clock,
    quoted: bool,
    /// Milliamperes, degrees: given in the names, or in a line under them.
    units: Units,
    /// Lines that begin with `#`: above the names and among the rows; or that of the names itself, as of numpy.
    comments: Comments,
    /// A separator at the end of each line.
    trailing: bool,
    /// A column of words that is no signal.
    words: bool,
    crlf: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Clock {
    Seconds,
    Milliseconds,
    Unix(i64),
    Dates(bool),
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Units {
    None,
    InNames,
    InLine,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Comments {
    None,
    Beside,
    Names,
}

fn way(rng: &mut StdRng) -> Way {
    let separator = [',', ';', '\t', '|'][rng.random_range(0..4)];
    let clock = match rng.random_range(0..5) {
        0 => Clock::Milliseconds,
        1 => Clock::Unix([1, 1_000, 1_000_000, 1_000_000_000][rng.random_range(0..4)]),
        2 => Clock::Dates(rng.random()),
        _ => Clock::Seconds,
    };
    Way {
        separator,
        comma: separator != ',' && rng.random(),
        clock,
        quoted: rng.random(),
        units: [Units::None, Units::InNames, Units::InLine][rng.random_range(0..3)],
        comments: [Comments::None, Comments::Beside, Comments::Names][rng.random_range(0..3)],
        trailing: rng.random(),
        words: rng.random(),
        crlf: rng.random(),
    }
}

fn written(plain: &Plain, way: &Way) -> String {
    let end = if way.crlf { "\r\n" } else { "\n" };
    let quote = |name: &str| if way.quoted { format!("\"{name}\"") } else { name.to_owned() };
    let unit = |name: &str, unit: &str| {
        if way.units == Units::InNames { format!("{name} [{unit}]") } else { name.to_owned() }
    };
    let milliseconds = way.clock == Clock::Milliseconds;
    let in_line = way.units == Units::InLine;
    let time = if milliseconds && !in_line { "time (ms)" } else { "time" };
    let mut heads = vec![quote(time), quote(&unit("motorCurrent", "mA")), quote(&unit("motorAngle", "deg"))];
    if way.words {
        heads.push(quote("mode"));
    }
    let separator = way.separator.to_string();
    let end = if way.trailing { format!("{separator}{end}") } else { end.to_owned() };
    let mut text = match way.comments {
        Comments::None => String::new(),
        Comments::Beside => format!("# bench 3, 20.5 degC{end}#{end}"),
        // numpy's `savetxt` has no line of units.
        Comments::Names => format!("{}# ", if in_line { "" } else { "# logged by hand\n" }),
    };
    text += &(heads.join(&separator) + &end);
    if in_line {
        let time = match way.clock {
            Clock::Milliseconds => "[ms]",
            Clock::Seconds => "[s]",
            _ => "",
        };
        let mut units = vec![time, "(mA)", "deg"];
        if way.words {
            units.push("-");
        }
        text += &(units.join(&separator) + &end);
    }
    for [t, current, angle] in &plain.rows {
        let nanos = 1_709_294_400_000_000_000 + (t * 1e9).round() as i64;
        let clock = match way.clock {
            Clock::Seconds => format!("{t}"),
            Clock::Milliseconds => format!("{}", t * 1e3),
            Clock::Unix(per_second) => {
                let one = 1_000_000_000 / per_second;
                let fraction = format!("{:09}", nanos % one * per_second);
                let dot = if one > 1 { format!(".{fraction}") } else { String::new() };
                format!("{}{dot}", nanos / one)
            }
            Clock::Dates(zone) => {
                let since = nanos - 1_709_294_400_000_000_000;
                let (minute, second, rest) =
                    (since / 60_000_000_000, since / 1_000_000_000 % 60, since % 1_000_000_000);
                let blank = if zone { 'T' } else { ' ' };
                let zone = if zone { "Z" } else { "" };
                format!("2024-03-01{blank}12:{minute:02}:{second:02}.{rest:09}{zone}")
            }
        };
        let (current, angle) =
            if way.units != Units::None { (current * 1e3, angle.to_degrees()) } else { (*current, *angle) };
        let mark = |x: String| if way.comma { x.replace('.', ",") } else { x };
        let clock = if matches!(way.clock, Clock::Dates(_)) { clock } else { mark(clock) };
        write!(text, "{clock}{separator}{}{separator}{}", mark(current.to_string()), mark(angle.to_string()))
            .unwrap();
        if way.words {
            write!(text, "{separator}idle").unwrap();
        }
        text += &end;
        if way.comments == Comments::Beside && *t == plain.rows[1][0] {
            text += &format!("# a word between{end}");
        }
    }
    text
}

/// A comment above the line of names that itself begins with `#`.
fn text_has_comment(text: &str) -> bool {
    text.lines().filter(|line| line.starts_with('#')).count() > 1
}

fn same(plain: &Recording, other: &Recording, seed: u64, way: &Way) {
    assert_eq!(other.channels.len(), 2, "seed {seed}: {way:?}");
    for (a, b) in plain.channels.iter().zip(&other.channels) {
        assert_eq!((&a.name, a.len()), (&b.name, b.len()), "seed {seed}: {way:?}");
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * x.abs().max(1.0);
        assert!(a.time.iter().zip(&b.time).all(|(x, y)| near(*x, *y)), "seed {seed}: times of {way:?}");
        assert!(
            a.values.iter().zip(&b.values).all(|(x, y)| near(*x, *y)),
            "seed {seed}: {} of {way:?}",
            a.name
        );
        assert!(b.time.windows(2).all(|w| w[1] > w[0]), "seed {seed}: {way:?}");
    }
}

fn every_way(count: u64) {
    let first = std::env::var("TRUEUP_SEED").ok().and_then(|s| s.parse().ok()).unwrap_or(1_u64);
    let folder = tempfile::tempdir().unwrap();
    for seed in first..first + count {
        let mut rng = StdRng::seed_from_u64(seed);
        let (table, way) = (plain(&mut rng), way(&mut rng));
        let usual = Way {
            separator: ',',
            comma: false,
            clock: Clock::Seconds,
            quoted: false,
            units: Units::None,
            comments: Comments::None,
            trailing: false,
            words: false,
            crlf: false,
        };
        let read = |way: &Way| {
            let text = written(&table, way);
            Recording::parse_csv("run.csv", text.as_bytes(), &joint())
                .unwrap_or_else(|e| panic!("seed {seed}, {way:?}: {e}\n{text}"))
        };
        let (plain, findings) = read(&usual);
        let (other, found) = read(&way);
        same(&plain, &other, seed, &way);
        // What was chosen is reported.
        let says = |found: &[Finding], kind: FindingKind, channel: Option<&str>| {
            found.iter().any(|f| f.kind == kind && channel.is_none_or(|c| f.channel.as_deref() == Some(c)))
        };
        assert!(
            says(&findings, FindingKind::Jump, None) && says(&found, FindingKind::Jump, None),
            "seed {seed}"
        );
        assert_eq!(
            says(&found, FindingKind::Separator, None),
            way.separator != ',',
            "seed {seed}: {found:?}"
        );
        assert_eq!(
            says(&found, FindingKind::Unit, None),
            way.units == Units::InLine,
            "seed {seed}: {found:?}"
        );
        let comments = way.comments == Comments::Beside || text_has_comment(&written(&table, &way));
        assert_eq!(says(&found, FindingKind::Comment, None), comments, "seed {seed}: {found:?}");
        let calendar = !matches!(way.clock, Clock::Seconds | Clock::Milliseconds);
        assert_eq!(says(&found, FindingKind::TimeUnit, Some("time")), calendar, "seed {seed}: {found:?}");
        let words =
            found.iter().any(|f| f.channel.as_deref() == Some("mode") && f.severity <= Severity::Warning);
        assert_eq!(words, way.words, "seed {seed}: {found:?}");
        // The same file drives a simulation by the same values.
        let file = folder.path().join("run.csv");
        fs::write(&file, written(&table, &way)).unwrap();
        let (inputs, _) = InputTable::read(&file, "".as_ref()).unwrap();
        let near = |x: f64, y: f64| (x - y).abs() <= 1e-12 * x.abs().max(1.0);
        assert!(inputs.time.iter().zip(&table.rows).all(|(t, row)| near(*t, row[0])), "seed {seed}");
        let current = inputs.columns.iter().find(|c| c.name == "motorCurrent").unwrap();
        let factor = current.unit.as_ref().map_or(1.0, |(_, unit)| unit.factor);
        assert!(
            current.values.iter().zip(&table.rows).all(|(x, row)| near(factor * x, row[1])),
            "seed {seed}"
        );
    }
    println!("{count} ways of writing, seeds from {first}");
}

#[test]
fn every_way_of_writing_reads_alike() {
    every_way(FEW);
}

#[test]
#[ignore = "takes long: ./test --full"]
fn every_way_of_writing_reads_alike_at_length() {
    every_way(ALL);
}

/// Rows of one rate under a clock of another: drawn rates and ticks; without a rate such a file is refused, with the remedy.
#[test]
fn a_rate_goes_before_a_coarse_clock() {
    let folder = tempfile::tempdir().unwrap();
    for seed in 0..20 {
        let mut rng = StdRng::seed_from_u64(seed);
        let rate = rng.random_range(100..5000) as f64;
        let tick = rng.random_range(2.5..40.0) / rate;
        let rows = rng.random_range(100..400);
        let at = |k: i32| f64::from(k) / rate;
        let mut text = "time,motorCurrent,motorAngle\n".to_owned();
        for k in 0..rows {
            writeln!(text, "{},{k},{}", (at(k) / tick).floor() * tick, at(k)).unwrap();
        }
        let file = folder.path().join("run.csv");
        fs::write(&file, &text).unwrap();
        let read = |declared: &DeclaredFigures| Recording::read(&file, &joint(), declared);
        let error = read(&DeclaredFigures::default()).unwrap_err().to_string();
        assert!(error.contains("the clock repeats") && error.contains("rate = N"), "seed {seed}: {error}");
        let (run, found) = read(&DeclaredFigures { rate: Some(rate), ..DeclaredFigures::default() }).unwrap();
        let angle = run.channel("motorAngle").unwrap();
        assert!(angle.time.iter().zip(&angle.values).all(|(t, x)| (t - x).abs() < 1e-12), "seed {seed}");
        assert!(found.iter().any(|f| f.what.contains("evenly spaced")), "seed {seed}: {found:?}");
        // The sidecar's word goes before that of the case.
        fs::write(folder.path().join("run.toml"), format!("rate = {rate:?}\n")).unwrap();
        let (own, _) = read(&DeclaredFigures { rate: Some(1.0), ..DeclaredFigures::default() }).unwrap();
        assert_eq!(own.channels, run.channels);
        fs::remove_file(folder.path().join("run.toml")).unwrap();
    }
}
