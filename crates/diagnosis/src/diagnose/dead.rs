//! Dead channels, before any cause is searched: a drive that is not recorded while it acts, a drive that is recorded while it does
//! not act, a reading that does not move although the drives act on it.
//!
//! What the nominal model misses in the acceleration of a channel, `y`, is regressed on positions, rates, their signs and on what the
//! drive does there, in the parts of all recordings that are not in question. This takes up most of a gap in the model. In the parts in
//! question the same regression is compared: what it leaves there, over what it leaves elsewhere. A drive varies: next to a gap that is as
//! large as the motion a model misses a nearly constant acceleration where the motion is small, and the regression need not be right there,
//! so what is left less its straight line is compared as well.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::acting::{Acting, motion, shown_everywhere};
use crate::engine::balance::{GriddedRecording, Smooth};
use crate::outcome::{NoticedMistake, OutcomeSeverity};

/// Parts of a recording: a channel may be dead from one of them on, or up to one.
const PARTS: usize = 16;
/// Fewest parts of which something is claimed, and by which it is compared.
const FEWEST: usize = 2;
const LIVE: usize = 4;
/// A channel is quiet where it varies by less than this share of what is usual for it,
const QUIET: f64 = 0.05;
/// and active from this share on.
const ACTIVE: f64 = 0.3;
/// Times what is left elsewhere, root mean square.
const DEAD: f64 = 3.0;
/// The same of what is missed less its straight line.
const CURVED: f64 = 2.0;
/// Share of the measured acceleration that is left.
const MOVED: f64 = 0.5;
/// A reading is constant that usually changes by so many of its standard deviations meanwhile.
const COUNTS: f64 = 10.0;
/// Of several drives of a recording that seem dead those are whose effect is missing by this share of the most.
const RIVAL: f64 = 0.5;
/// Share of the parts that show it: a short disturbance is none.
const MOST: f64 = 0.5;
/// Share of the parts in which a drive is active, and of those that are nearer without it.
const MOSTLY: f64 = 0.75;

/// Sums over the rows of a part of a recording.
#[derive(Clone)]
struct DeadPart {
    rows: f64,
    /// Products of all regressors, the effect of the drive, and what is missed, in this order.
    products: DMatrix<f64>,
    /// Square of the measured acceleration.
    moved: f64,
    /// Standard deviation of the channel in question, and of what acts.
    varies: f64,
    acts: f64,
}

/// Parts of a recording in which a channel is dead.
#[derive(Clone, Debug, PartialEq, Eq)]
struct DeadSpan(Range<usize>);

impl DeadSpan {
    /// All spans that begin with a recording or end with it, the longest first.
    fn all() -> impl Iterator<Item = Self> {
        let ends = |n: usize| [0..n, PARTS - n..PARTS].into_iter().take(if n == PARTS { 1 } else { 2 });
        (FEWEST..=PARTS).rev().flat_map(ends).map(Self)
    }

    fn when(&self, prescribed: &GriddedRecording) -> String {
        let at =
            |part: usize| prescribed.t[rows(prescribed, &(part..part)).start.min(prescribed.t.len() - 1)];
        match (self.0.start, self.0.end) {
            (0, PARTS) => "all along".to_owned(),
            (0, end) => format!("up to about {:.3} s", at(end)),
            (start, _) => format!("from about {:.3} s on", at(start)),
        }
    }
}

/// A regression of what is missed; coefficients as in [`DeadPart::products`], without the last.
struct ChannelRegression {
    coefficients: DVector<f64>,
    /// What it leaves, root mean square.
    left: f64,
}

impl ChannelRegression {
    fn new<'p>(parts: impl Iterator<Item = &'p DeadPart>) -> Option<Self> {
        let (mut products, mut rows, mut count) = (DMatrix::zeros(0, 0), 0.0, 0);
        for part in parts {
            products = if count == 0 { part.products.clone() } else { products + &part.products };
            rows += part.rows;
            count += 1;
        }
        let n = products.nrows().checked_sub(1).filter(|_| count >= LIVE)?;
        let size = DVector::from_fn(n, |i, _| products[(i, i)].sqrt().max(f64::MIN_POSITIVE));
        let gram = DMatrix::from_fn(n, n, |i, j| {
            products[(i, j)] / size[i] / size[j] + if i == j { 1e-9 } else { 0.0 }
        });
        let right = DVector::from_fn(n, |i, _| products[(i, n)] / size[i]);
        let coefficients = gram.cholesky()?.solve(&right).component_div(&size);
        let left = (power(&products, &coefficients) / rows).sqrt();
        Some(Self { coefficients, left })
    }

    /// What it leaves in these parts, root mean square, with the drive and as if it did nothing.
    fn leaves<'p>(&self, parts: impl Iterator<Item = &'p DeadPart>) -> [f64; 2] {
        let mut without = self.coefficients.clone();
        if let Some(drive) = without.iter_mut().last() {
            *drive = -1.0;
        }
        let sum = parts.fold([0.0; 3], |[a, b, n], p| {
            [a + power(&p.products, &self.coefficients), b + power(&p.products, &without), n + p.rows]
        });
        [0, 1].map(|k| (sum[k] / sum[2]).sqrt())
    }
}

/// Sum of squares of what is missed less a regression.
fn power(products: &DMatrix<f64>, coefficients: &DVector<f64>) -> f64 {
    let w = coefficients.push(-1.0);
    (w.transpose() * products * &w)[(0, 0)].max(0.0)
}

/// What is dead.
#[derive(Clone)]
pub(super) struct Dead {
    pub finding: NoticedMistake,
    /// It has one value all along.
    pub constant: bool,
    /// What is missing of a drive that is not recorded, over what it does elsewhere; 0 of all else.
    lacks: f64,
}

/// Dead channels of all recordings.
pub(super) fn channels(all: &[Acting<'_>], inputs: &[String], outputs: &[String]) -> Vec<Dead> {
    let driven: Vec<Option<usize>> = (0..inputs.len()).map(|i| Acting::most_driven(all, i)).collect();
    // Where none of them does anything in any recording, any channel shows that one is missing.
    let nothing = driven.iter().all(Option::is_none);
    let any = all.first().and_then(|a| Some(a.prescribed.channels[a.accelerated().next()?].output));
    let mut drives = Vec::new();
    for ((input, name), output) in inputs.iter().enumerate().zip(&driven) {
        if let Some(output) = output.or(any.filter(|_| nothing)) {
            drives.extend(drive(all, input, name, output));
        }
    }
    // What one drive does shows at the joints of others as well.
    let most =
        |file: &str| drives.iter().filter(|d| d.finding.file == file).map(|d| d.lacks).fold(0.0, f64::max);
    let mut found = readings(all, outputs, &driven);
    found.extend(drives.iter().filter(|d| d.lacks >= RIVAL * most(&d.finding.file)).cloned());
    found
}

/// A recording with the channel that is looked at, and its parts.
type ChannelParts<'a> = (&'a Acting<'a>, usize, Vec<DeadPart>);

/// All recordings in which an output is compared as an acceleration; `of`: what acts on its channel, and the series in question.
fn shown<'a, A: AsRef<[f64]>>(
    all: &'a [Acting<'a>],
    output: usize,
    of: impl Fn(&'a Acting<'a>, usize) -> Option<(A, &'a [f64])>,
) -> Vec<ChannelParts<'a>> {
    let outputs = shown_everywhere(all);
    let one = |a: &'a Acting<'a>| {
        let at = a.showing(output)?;
        let (along, varies) = of(a, at)?;
        Some((a, at, parts(a, &outputs, at, along.as_ref(), varies)?))
    };
    all.iter().filter_map(one).collect()
}

/// A drive that is quiet while the readings accelerate, or that does nothing while it is active.
fn drive(all: &[Acting<'_>], input: usize, name: &str, output: usize) -> Vec<Dead> {
    let runs = shown(all, output, |a, at| Some((a.along(input, at)?, &a.prescribed.inputs[input][..])));
    let usual = usual(runs.iter().flat_map(|r| &r.2).map(|p| p.varies));
    let mut drive = DriveParts { runs: &runs, input, name, usual, regression: None };
    drive.regression = ChannelRegression::new(drive.live());
    let one = |run: usize| drive.unrecorded(run).or_else(|| drive.idle(run));
    (0..runs.len()).filter_map(one).collect()
}

/// A drive in all recordings, by the output that it accelerates most.
struct DriveParts<'r, 'a> {
    runs: &'r [ChannelParts<'a>],
    input: usize,
    name: &'r str,
    /// Standard deviation that is usual for it.
    usual: f64,
    /// Of all parts in which it is not quiet; `None`: there are too few.
    regression: Option<ChannelRegression>,
}

impl DriveParts<'_, '_> {
    fn quiet(&self, part: &DeadPart) -> bool {
        part.varies <= QUIET * self.usual
    }

    fn live(&self) -> impl Iterator<Item = &DeadPart> {
        self.runs.iter().flat_map(|r| &r.2).filter(|p| !self.quiet(p))
    }

    /// It is not recorded while it acts.
    fn unrecorded(&self, run: usize) -> Option<Dead> {
        let (a, at, parts) = &self.runs[run];
        let regression = self.regression.as_ref();
        let u = &a.prescribed.inputs[self.input][a.prescribed.counts.clone()];
        let constant = u.iter().all(|v| *v == u[0]);
        let dead = |span: &DeadSpan| {
            let own = &parts[span.0.clone()];
            own.iter().all(|p| self.quiet(p))
                && regression.map_or(constant, |r| unexplained(r, own))
                && (regression.is_some() || rms(own, missed) > rms(own, |p| p.moved))
        };
        let varied = |span: &DeadSpan| {
            regression.is_none_or(|r| curved(&a.with[*at][rows(a.prescribed, &span.0)]) > CURVED * r.left)
        };
        let span = DeadSpan::all().find(|span| dead(span) && varied(span))?;
        let how = if constant { format!("it stays at {}", u[0]) } else { "it hardly changes".to_owned() };
        let text = format!(
            "{}: {how} {} while the readings accelerate as under a drive: the channel is dead; look at the sensor and the logger, and \
             leave these readings out",
            self.name,
            span.when(a.prescribed)
        );
        let own = &parts[span.0.clone()];
        let left = regression.map_or_else(|| rms(own, missed), |r| r.leaves(own.iter())[0]);
        let usual = rms(self.live(), |p| p.products[(drive_of(p), drive_of(p))]);
        let lacks = if usual > 0.0 { left / usual } else { 1.0 };
        Some(Dead { finding: finding(a.prescribed, self.name, text), constant, lacks })
    }

    /// It is recorded while it does nothing.
    fn idle(&self, run: usize) -> Option<Dead> {
        let (a, at, parts) = &self.runs[run];
        let dead = |span: &DeadSpan| {
            let own = &parts[span.0.clone()];
            let active = own.iter().filter(|p| p.varies >= ACTIVE * self.usual).count();
            let others = || {
                let all = self
                    .runs
                    .iter()
                    .enumerate()
                    .flat_map(|(k, r)| r.2.iter().enumerate().map(move |p| (k, p)));
                all.filter(|(k, (i, p))| (*k != run || !span.0.contains(i)) && !self.quiet(p))
                    .map(|(_, (_, p))| p)
            };
            active as f64 >= MOSTLY * own.len() as f64
                && !is_constant(a, *at, span)
                && self.nearer_without(run, span)
                && ChannelRegression::new(others()).is_some_and(|r| does_nothing(&r, own, others()))
        };
        let span = DeadSpan::all().find(dead)?;
        let text = format!(
            "{}: {} it has no effect, the readings move as without it, and elsewhere they follow it: the drive was off or not \
             connected; leave these readings out",
            self.name,
            span.when(a.prescribed)
        );
        Some(Dead { finding: finding(a.prescribed, self.name, text), constant: false, lacks: 0.0 })
    }

    /// Without the drive less is missed, straight lines apart.
    fn nearer_without(&self, run: usize, span: &DeadSpan) -> bool {
        let (a, at, _) = &self.runs[run];
        let missed = &a.with[*at][rows(a.prescribed, &span.0)];
        let Some(along) = a.along(self.input, *at) else { return false };
        let undriven: Vec<f64> =
            missed.iter().zip(&along[rows(a.prescribed, &span.0)]).map(|(m, d)| m - d).collect();
        curved(&undriven) < curved(missed)
    }
}

/// Readings that are constant although what is recorded of the drives accelerates them.
fn readings(all: &[Acting<'_>], outputs: &[String], driven: &[Option<usize>]) -> Vec<Dead> {
    let mut found = Vec::new();
    for (output, name) in outputs.iter().enumerate().filter(|(o, _)| driven.contains(&Some(*o))) {
        let runs = shown(all, output, |a, at| Some((a.driven(at), &a.prescribed.channels[at].enters[0][..])));
        let usual = usual(runs.iter().flat_map(|r| &r.2).map(|p| p.acts));
        let live = runs.iter().flat_map(|(a, at, parts)| {
            parts.iter().enumerate().filter(|(i, _)| !is_constant(a, *at, &DeadSpan(*i..i + 1))).map(|p| p.1)
        });
        let live: Vec<&DeadPart> = live.collect();
        let Some(regression) = ChannelRegression::new(live.iter().copied()) else { continue };
        let moved = rms(live.iter().copied(), |p| p.moved);
        // How far it usually goes in so many parts.
        let goes = |parts: usize| {
            let windows = runs.iter().flat_map(|(a, at, _)| {
                (0..=PARTS - parts).map(move |k| {
                    deviation(&a.prescribed.channels[*at].enters[0][rows(a.prescribed, &(k..k + parts))])
                })
            });
            let mut each: Vec<f64> = windows.collect();
            each.sort_by(f64::total_cmp);
            each.get(each.len() / 2).copied().unwrap_or(0.0)
        };
        for (a, at, parts) in &runs {
            let dead = |span: &DeadSpan| {
                let own = &parts[span.0.clone()];
                let active = own.iter().filter(|p| p.acts >= ACTIVE * usual && p.acts > 0.0).count();
                is_constant(a, *at, span)
                    && active as f64 >= MOSTLY * own.len() as f64
                    && goes(span.0.len()) > COUNTS * a.prescribed.channels[*at].sigma
                    && {
                        let left = regression.leaves(own.iter())[0].min(rms(own, missed));
                        left > DEAD * regression.left && left > MOVED * moved
                    }
            };
            if let Some(span) = DeadSpan::all().find(dead) {
                let value = a.prescribed.channels[*at].y[rows(a.prescribed, &span.0).start];
                let text = format!(
                    "{name}: it stays at {value:.6} {} although the drives act on it as elsewhere: the channel is dead, the joint is blocked or its drive was off; \
                     look at the sensor and its cable, and leave these readings out",
                    span.when(a.prescribed)
                );
                let constant = span.0.len() == PARTS;
                found.push(Dead { finding: finding(a.prescribed, name, text), constant, lacks: 0.0 });
            }
        }
    }
    found
}

fn finding(prescribed: &GriddedRecording, channel: &str, text: String) -> NoticedMistake {
    NoticedMistake {
        severity: OutcomeSeverity::Grave,
        kind: "dead-channel".into(),
        file: prescribed.name.clone(),
        line: None,
        channel: Some(channel.to_owned()),
        text,
    }
}

/// Far more is left than elsewhere, and most of the motion.
fn unexplained(r: &ChannelRegression, parts: &[DeadPart]) -> bool {
    let left = |parts: &[DeadPart]| r.leaves(parts.iter())[0];
    let shows = parts.iter().filter(|p| left(std::slice::from_ref(p)) > DEAD * r.left).count();
    // Without the regression as well, which may be wrong where a recording goes further than the others.
    let all = left(parts).min(rms(parts, missed));
    all > DEAD * r.left && all > MOVED * rms(parts, |p| p.moved) && shows as f64 >= MOST * parts.len() as f64
}

/// As if the drive did nothing, the readings are as well explained as elsewhere, where it does something.
fn does_nothing<'p>(
    r: &ChannelRegression,
    own: &[DeadPart],
    others: impl Iterator<Item = &'p DeadPart>,
) -> bool {
    let [with, without] = r.leaves(own.iter());
    let elsewhere = r.leaves(others)[1];
    let shows = own.iter().filter(|p| {
        let [with, without] = r.leaves(std::iter::once(*p));
        with > without
    });
    rms(own, undriven) < rms(own, missed)
        && with > DEAD * without
        && without < DEAD * r.left
        && elsewhere > DEAD * r.left
        && shows.count() as f64 >= MOSTLY * own.len() as f64
}

fn drive_of(p: &DeadPart) -> usize {
    p.products.nrows() - 2
}

fn missed(p: &DeadPart) -> f64 {
    let n = p.products.nrows() - 1;
    p.products[(n, n)]
}

/// The same as if the drive did nothing.
fn undriven(p: &DeadPart) -> f64 {
    let (drive, n) = (drive_of(p), p.products.nrows() - 1);
    p.products[(n, n)] + 2.0 * p.products[(drive, n)] + p.products[(drive, drive)]
}

/// Root mean square of a sum of squares over parts.
fn rms<'p>(parts: impl IntoIterator<Item = &'p DeadPart>, of: impl Fn(&DeadPart) -> f64) -> f64 {
    let [sum, rows] = parts.into_iter().fold([0.0; 2], |[s, n], p| [s + of(p), n + p.rows]);
    if rows > 0.0 { (sum / rows).sqrt() } else { 0.0 }
}

/// What is usual: nearly the most.
fn usual(of: impl Iterator<Item = f64>) -> f64 {
    let mut all: Vec<f64> = of.collect();
    all.sort_by(f64::total_cmp);
    all.get(all.len() * 19 / 20).or(all.last()).copied().unwrap_or(0.0)
}

/// Whether a reading does not leave its noise.
fn is_constant(a: &Acting<'_>, at: usize, span: &DeadSpan) -> bool {
    let s: &Smooth = &a.prescribed.channels[at];
    let rows = rows(a.prescribed, &span.0);
    deviation(&s.enters[0][rows]) <= 2.0 * s.sigma
}

fn rows(prescribed: &GriddedRecording, parts: &Range<usize>) -> Range<usize> {
    let (n, from) = (prescribed.counts.len(), prescribed.counts.start);
    from + parts.start * n / PARTS..from + parts.end * n / PARTS
}

fn deviation(x: &[f64]) -> f64 {
    let n = x.len().max(1) as f64;
    let mean = x.iter().sum::<f64>() / n;
    (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt()
}

/// Root mean square of a series less its straight line.
fn curved(y: &[f64]) -> f64 {
    let middle = 0.5 * (y.len() as f64 - 1.0);
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let from_middle = || y.iter().enumerate().map(|(k, v)| (k as f64 - middle, v - mean));
    let [along, squares] = from_middle().fold([0.0; 2], |[a, s], (x, v)| [a + x * v, s + x * x]);
    let slope = along / squares.max(f64::MIN_POSITIVE);
    let left = from_middle().map(|(x, v)| (v - slope * x).powi(2)).sum::<f64>();
    (left / y.len().max(1) as f64).sqrt()
}

/// Sums over the parts of a recording, of a channel `at` that `along` acts on, with the motion of these outputs; `varies` is the channel in
/// question.
fn parts(
    a: &Acting<'_>,
    outputs: &[usize],
    at: usize,
    along: &[f64],
    varies: &[f64],
) -> Option<Vec<DeadPart>> {
    let prescribed = a.prescribed;
    if prescribed.counts.len() < 4 * PARTS {
        return None;
    }
    let row = |k: usize| {
        let mut row = motion(prescribed, outputs, k);
        row.extend([along[k], -a.with[at][k]]);
        row
    };
    let one = |part: usize| {
        let rows = rows(prescribed, &(part..part + 1));
        let n = 3 * outputs.len() + 3;
        let matrix = DMatrix::from_row_iterator(rows.len(), n, rows.clone().flat_map(row));
        DeadPart {
            rows: rows.len() as f64,
            products: matrix.tr_mul(&matrix),
            moved: prescribed.channels[at].ddy[rows.clone()].iter().map(|x| x * x).sum(),
            varies: deviation(&varies[rows.clone()]),
            acts: deviation(&along[rows]),
        }
    };
    let all: Vec<DeadPart> = (0..PARTS).map(one).collect();
    all.iter().all(|p| p.products.iter().all(|v| v.is_finite())).then_some(all)
}
