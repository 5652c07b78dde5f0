//! Channels that must agree.

use std::ops::Range;

use crate::case::Loaded;
use crate::finding::{Finding, FindingKind, Severity};
use crate::names::short;
use crate::outlier::median;
use crate::quantum::Quantum;
use crate::recording::{Channel, Recording};

/// Two channels that go with each other, up to small differences, as the caller derives from the model.
#[derive(Clone, Debug, PartialEq)]
pub enum Relation {
    /// `left` = `factor` * `right` + a constant: `motorAngle` = gearRatio * `loadAngle`.
    Proportional {
        /// A channel.
        left: String,
        /// Another one.
        right: String,
        /// What leads from the right to the left, in SI.
        factor: f64,
        /// The parameter of `case.toml` that gives the factor.
        parameter: String,
    },
    /// `rate` is the time derivative of `of`: `motorVelocity` of `motorAngle`.
    Rate {
        /// A velocity.
        rate: String,
        /// Its position.
        of: String,
    },
}

/// What a wrong factor may come from, and whether that is of a rate alone.
const CAUSES: &[(f64, &str, bool)] = &[
    (180.0 / std::f64::consts::PI, "degrees were interpreted as radians", false),
    (30.0 / std::f64::consts::PI, "rpm were interpreted as rad/s", true),
    (std::f64::consts::TAU, "revolutions were interpreted as radians", false),
    (1000.0, "milli-units were interpreted as units", false),
    (-1.0, "one of them has the opposite sign", false),
];
/// Correlation from which two angles go with each other but for their factor: a spring between them would show.
const RIGID: f64 = 0.99;
/// Slopes that are off by less are no contradiction.
const OFF: f64 = 0.2;
/// In some recordings of several a slope up to this may be one of a swing that is hardly wider than a play.
const SLACK: f64 = 1.5;
/// Share of a recording for which a reading may be constant while the other one moves,
const STILL: f64 = 0.1;
/// by this share of its range, and by so many counts of either. A play keeps the load still for as large a share of its swing.
const MOVES: f64 = 0.3;
const COUNTS: f64 = 10.0;

impl Relation {
    /// A finding where one is constant while the other one moves, or where the slope between both is off by more than [`OFF`];
    /// none where both are not there or hardly move.
    pub(super) fn check(&self, run: &Recording) -> Option<Finding> {
        let (left, right, factor) = match self {
            Self::Proportional { left, right, factor, .. } => (left, right, *factor),
            Self::Rate { rate, of } => (of, rate, 1.0),
        };
        let (a, b) = (run.channel(left)?, run.channel(right)?);
        let y = &a.values;
        let x = match self {
            Self::Proportional { .. } => b.sample(&a.time),
            // The angle against the integral of its rate: noise averages out.
            Self::Rate { .. } => integral(&a.time, &b.sample(&a.time)),
        };
        let scaled: Vec<f64> = x.iter().map(|x| factor * x).collect();
        // What noise and counts of the right one come to in the left one's unit.
        let beside = |within: &Range<usize>| match self {
            Self::Proportional { .. } => factor.abs() * least(b),
            // An integral of noise is a random walk.
            Self::Rate { .. } => {
                let span = a.time[within.end - 1] - a.time[within.start];
                least(b) * span / (within.len() as f64).sqrt()
            }
        };
        let stands = still(a)
            .filter(|within| moves(&scaled, y, within, count(a).max(beside(within))))
            .map(|within| (a, b, within));
        let other = || match self {
            Self::Proportional { .. } => {
                still(b).map(|w| (&b.time, w, (count(b) * factor.abs()).max(least(a))))
            }
            // A rate that is always 0 means that nothing turns.
            Self::Rate { .. } => {
                still(b).filter(|w| b.values[w.start] == 0.0).map(|w| (&b.time, w, least(a)))
            }
        };
        let stands = stands.or_else(|| {
            let (time, w, count) = other()?;
            let [from, to] = [time[w.start], time[w.end - 1]];
            let within = a.time.partition_point(|t| *t < from)..a.time.partition_point(|t| *t <= to);
            moves(y, &scaled, &within, count).then_some((b, a, w))
        });
        if let Some((dead, live, within)) = stands {
            return Some(stands_still(run, dead, live, &within));
        }
        let (slope, correlation) = line(&x, y)?;
        if correlation.abs() < 0.9 {
            return None;
        }
        let off = slope / factor;
        if (off - 1.0).abs() < OFF {
            return None;
        }
        let near = |cause: f64| (off / cause - 1.0).abs() < 0.1;
        let angles = matches!(self, Self::Proportional { .. });
        let swapped = angles && near(1.0 / (factor * factor)) && factor != 1.0;
        let causes = CAUSES.iter().filter(|c| !(c.2 && angles));
        let unit =
            causes.filter(|(c, ..)| near(*c) || near(1.0 / c)).map(|(c, cause, _)| (*c, *cause)).next();
        let what = format!("it moves {} times as far as", short(slope));
        match self {
            Self::Rate { .. } => {
                // A factor that a unit or a sign makes is an error of the recording.
                let (severity, cause) = match unit {
                    Some((_, cause)) => (Severity::Grave, format!("it looks as if {cause}")),
                    None => (Severity::Warning, "one of them has another unit, sign or meaning".to_owned()),
                };
                let what = format!("{what} the integral of `{right}`: {cause}");
                let finding =
                    Finding::warning(FindingKind::Inconsistent, &run.file, what, MEND).channel(left);
                Some(Finding { severity, ..finding })
            }
            Self::Proportional { parameter, .. } => {
                let what = format!("{what} `{right}`, expected is {}", short(factor));
                let or = format!("or {parameter} would be {} (case.toml: {})", short(slope), short(factor));
                let (severity, kind, what) = match unit {
                    _ if swapped => {
                        (Severity::Grave, FindingKind::SwappedChannels, format!("{what}: they look swapped"))
                    }
                    Some((-1.0, cause)) => (
                        Severity::Grave,
                        FindingKind::Inconsistent,
                        format!("{what}: it looks as if {cause}"),
                    ),
                    Some((_, cause)) => (
                        Severity::Grave,
                        FindingKind::Inconsistent,
                        format!("{what}: it looks as if {cause}, {or}"),
                    ),
                    None if correlation.abs() >= RIGID => (
                        Severity::Grave,
                        FindingKind::GearRatio,
                        format!("{what}: {parameter} contradicts it, it would be {}", short(slope)),
                    ),
                    None => (
                        Severity::Warning,
                        FindingKind::Inconsistent,
                        format!("{what}: one of them has another unit, sign or meaning, {or}"),
                    ),
                };
                let mend = match kind {
                    FindingKind::GearRatio => format!(
                        "correct {parameter} in case.toml, or declare the unit of one of them in the sidecar's [columns]"
                    ),
                    _ => MEND.to_owned(),
                };
                let finding = Finding::warning(kind, &run.file, what, mend).channel(left);
                Some(Finding { severity, ..finding })
            }
        }
    }
}

impl Relation {
    /// If all recordings contradict, the parameter is wrong, reported once; if one of several does, that recording is.
    pub(super) fn of_all(&self, loaded: &Loaded, findings: &mut Vec<Finding>) {
        let Self::Proportional { left, right, parameter, .. } = self else { return };
        let own = |f: &Finding| f.kind == FindingKind::GearRatio && f.channel.as_deref() == Some(left);
        let told = findings.iter().filter(|f| own(f)).count();
        let has = |run: &&Recording| run.channel(left).is_some() && run.channel(right).is_some();
        let of = loaded.recordings.values().filter(has).count();
        let mut first = true;
        if told == of {
            findings.retain(|f| !own(f) || std::mem::take(&mut first));
            for f in findings.iter_mut().filter(|f| own(f)) {
                f.what = format!("{} in {of} of {of} recordings", f.what);
                f.file.clone_from(&loaded.case.file);
            }
            return;
        }
        for f in findings.iter_mut().filter(|f| own(f)) {
            f.kind = FindingKind::Inconsistent;
            f.what = format!(
                "{}; the other recordings agree with {parameter}: one of both has another unit or scale here",
                f.what
            );
            f.mend = MEND.to_owned();
            let run = loaded.recordings.values().find(|run| run.file == f.file);
            if run.and_then(|run| self.off(run)).is_some_and(|off| (1.0..SLACK).contains(&off)) {
                f.severity = Severity::Warning;
                f.what = format!("{}, or it moves hardly farther than a play", f.what);
            }
        }
    }

    /// By how many times the expected slope the left one moves.
    fn off(&self, run: &Recording) -> Option<f64> {
        let Self::Proportional { left, right, factor, .. } = self else { return None };
        let (a, b) = (run.channel(left)?, run.channel(right)?);
        Some(line(&b.sample(&a.time), &a.values)?.0 / factor)
    }
}

/// What to do about a factor.
const MEND: &str = "declare the unit or the right name in the sidecar's [columns]";

/// What a rate comes to from its first sample on, by trapezoids.
fn integral(time: &[f64], rate: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    let steps = time.windows(2).zip(rate.windows(2));
    std::iter::once(0.0)
        .chain(steps.map(|(t, v)| {
            sum += 0.5 * (v[0] + v[1]) * (t[1] - t[0]);
            sum
        }))
        .collect()
}

/// The longest time for which a reading keeps one value, if that is long.
fn still(c: &Channel) -> Option<Range<usize>> {
    let mut at = 0;
    let runs = c.values.chunk_by(|a, b| a == b).map(|run| {
        at += run.len();
        at - run.len()..at
    });
    let longest = runs.max_by_key(Range::len)?;
    (longest.len() >= 20 && longest.len() as f64 >= STILL * c.len() as f64).then_some(longest)
}

/// What a constant reading may hide: one count, or its noise.
fn count(c: &Channel) -> f64 {
    let sensor = c.sensor.resolution.unwrap_or(0.0).max(c.sensor.deviation().unwrap_or(0.0));
    let quantum = Quantum::of(&c.values);
    if quantum.regular { sensor.max(quantum.least) } else { sensor }
}

/// The same of a reading that is not constant: at least its noise as second differences show it, also where none is declared.
fn least(c: &Channel) -> f64 {
    let mut seconds: Vec<f64> = c.values.windows(3).map(|x| (x[0] - 2.0 * x[1] + x[2]).abs()).collect();
    // Of normal noise: median of the magnitude 0.6745, and 6 times the variance in second differences.
    count(c).max(median(&mut seconds) / (0.6745 * 6f64.sqrt()))
}

/// Whether `live` moves meanwhile by far more than a count, and than `dead` does.
fn moves(live: &[f64], dead: &[f64], within: &Range<usize>, count: f64) -> bool {
    let range = |x: &[f64]| {
        let (low, high) =
            x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        high - low
    };
    let [whole, own] = [live, live.get(within.clone()).unwrap_or_default()].map(range);
    let beside = dead.get(within.clone()).map_or(0.0, range);
    own > (COUNTS * count).max(MOVES * whole) && own > 5.0 * beside
}

fn stands_still(run: &Recording, dead: &Channel, live: &Channel, within: &Range<usize>) -> Finding {
    let (value, from, to) = (dead.values[within.start], dead.time[within.start], dead.time[within.end - 1]);
    let when = if within.len() == dead.len() {
        "all along".to_owned()
    } else {
        format!("from {} s to {} s", short(from), short(to))
    };
    let what =
        format!("it stays at {} {when} while `{}` moves: the channel is dead", short(value), live.name);
    let mend = "look at the sensor and its cable; leave the column out (`false` in the sidecar's [columns]), or the recording";
    let finding = Finding::warning(FindingKind::DeadChannel, &run.file, what, mend).channel(&dead.name);
    Finding { severity: Severity::Grave, ..finding }.time(from)
}

/// Slope of y over x, and their correlation.
fn line(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let n = x.len().min(y.len()) as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mx, my) = (mean(x), mean(y));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        xx += (a - mx) * (a - mx);
        xy += (a - mx) * (b - my);
        yy += (b - my) * (b - my);
    }
    (n >= 20.0 && xx > 0.0 && yy > 0.0).then(|| (xy / xx, xy / (xx * yy).sqrt()))
}
