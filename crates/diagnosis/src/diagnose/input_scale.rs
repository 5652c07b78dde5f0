//! The gain of each input, recording by recording, before any cause is looked for: another unit, the opposite sign.
//!
//! The gain is that of least squares. A gap in the model that moves with the input biases it, so where it is near nothing known the partial
//! gain is taken: what is missed and what the input does, both less their regression on the motion ([decision 75](../../../../docs/decisions/0075-gains-next-to-a-gap.md)).

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

use super::acting::{Acting, motion};
use super::dead;
use crate::engine::balance::GriddedRecording;
use crate::engine::search::CaseSearch;
use crate::outcome::{NoticedMistake, OutcomeSeverity};

/// What a gain comes from that is near it. Fewer than between channels (`trueup_signals::check`), whose slopes are sharp: a gain of
/// 6 or 10 may be a wrong parameter, so neither revolutions nor rpm are among them.
const CAUSES: [(f64, &str); 5] = [
    (1e-3, "thousandths were interpreted as units"),
    (1e3, "units were interpreted as thousandths"),
    (std::f64::consts::PI / 180.0, "degrees were interpreted as radians"),
    (180.0 / std::f64::consts::PI, "radians were interpreted as degrees"),
    (-1.0, "it had the opposite sign"),
];
/// As near to it (logarithm of a factor of 3): what else is missing moves the gain. Causes are a factor of 17 apart.
const NEAR: f64 = 1.1;
/// Parts of a recording whose gains give the standard deviation of that of the whole.
const PARTS: usize = 8;
/// Deviations from which on a gain is one.
const SURE: f64 = 4.0;
/// Deviations from which on a positive partial gain contradicts that the sign is wrong.
const TURNED: f64 = 2.0;
/// A sign is reported where the gain leaves less than this of what is missed with the gain as recorded (as powers).
const LEFT: f64 = 0.5;

/// The gain of an input in a recording, by least squares of the accelerations that the nominal model misses.
#[derive(Clone, Copy, Debug)]
struct ScaleGain {
    value: f64,
    /// Standard deviation, by leaving parts of the recording out in turn.
    deviation: f64,
    /// Share of what is missed with the input as recorded that it leaves, as a power.
    left: f64,
}

impl ScaleGain {
    /// Of the equation `without + gain along = 0`, row by row.
    fn new(without: &[f64], along: &[f64]) -> Option<Self> {
        let n = without.len();
        let part = |k: usize| {
            let rows = k * n / PARTS..(k + 1) * n / PARTS;
            let both = without[rows.clone()].iter().zip(&along[rows]);
            both.fold([0.0; 2], |[num, den], (a, d)| [num - a * d, den + d * d])
        };
        let parts: Vec<[f64; 2]> = (0..PARTS).map(part).collect();
        let [num, den] = parts.iter().fold([0.0; 2], |s, p| [s[0] + p[0], s[1] + p[1]]);
        let value = num / den;
        let each = parts.iter().map(|p| (num - p[0]) / (den - p[1]) - value);
        let variance = each.map(|d| d * d).sum::<f64>() * (PARTS - 1) as f64 / PARTS as f64;
        let power =
            |gain: f64| -> f64 { without.iter().zip(along).map(|(a, d)| (a + gain * d).powi(2)).sum() };
        let own = Self { value, deviation: variance.sqrt(), left: power(value) / power(1.0) };
        (den > 0.0 && value.is_finite() && own.deviation.is_finite()).then_some(own)
    }

    fn is_near(&self, value: f64) -> bool {
        (self.value / value).ln().abs() < NEAR
    }

    /// The unit that it is near, other than `usual`, however sure; `None` where it is as usual, or near none.
    fn likely(&self, usual: f64) -> Option<&'static (f64, &'static str)> {
        let cause = CAUSES.iter().find(|(c, _)| self.is_near(c * usual))?;
        (!self.is_near(usual) && (cause.0 > 0.0 || self.left < LEFT)).then_some(cause)
    }

    /// The same where it is sure.
    fn cause(&self, usual: f64) -> Option<&'static (f64, &'static str)> {
        self.likely(usual).filter(|_| self.value.abs() > SURE * self.deviation)
    }

    /// Whether the mean of all, weighted by variance, is sure.
    fn sure_together(all: &[(&str, Self)]) -> bool {
        let weight = |g: &Self| g.deviation.max(1e-100).powi(-2);
        let [sum, weights] =
            all.iter().fold([0.0; 2], |[s, w], (_, g)| [s + g.value * weight(g), w + weight(g)]);
        sum.abs() > SURE * weights.sqrt()
    }
}

/// The gain of an input in a recording, as it is reported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct InputGain {
    /// Recording.
    pub recording: String,
    /// FMU variable.
    pub input: String,
    /// By how many times the recorded input the nominal model needs it; 1: as recorded.
    pub gain: f64,
    /// Standard deviation of the gain.
    pub standard_deviation: f64,
}

/// The gain of each recorded input, recording by recording, in the output in which it acts most.
pub fn gains(search: &CaseSearch<'_>) -> Vec<InputGain> {
    let names = search.case.subject.inputs();
    let runs = Acting::all(search);
    let recorded = |input: &usize| runs.iter().any(|r| !r.prescribed.inputs[*input].is_empty());
    let of = |input: usize| {
        let one = |s: Seen<'_>| {
            let gain = s.gain?;
            Some(InputGain {
                recording: s.name().to_owned(),
                input: names[input].clone(),
                gain: gain.value,
                standard_deviation: gain.deviation,
            })
        };
        acting_most(&runs, &[input]).into_iter().filter_map(one).collect::<Vec<_>>()
    };
    (0..names.len()).filter(recorded).flat_map(of).collect()
}

/// What an input does in a channel of a recording.
struct Seen<'a> {
    prescribed: &'a GriddedRecording,
    /// Output that the channel shows.
    output: usize,
    /// Power of what it does there, over that of what the readings accelerate.
    acts: f64,
    gain: Option<ScaleGain>,
    /// What is missed without the input, and what the input does, by instant that counts.
    without: Vec<f64>,
    along: Vec<f64>,
}

impl Seen<'_> {
    fn name(&self) -> &str {
        &self.prescribed.name
    }
}

/// Reports which channels are dead and which inputs are in another unit or have the opposite sign: recording by recording where
/// recordings differ, else for the case. Those held out are looked at as well, for nothing is fitted here.
pub fn mistaken(search: &CaseSearch<'_>) -> Vec<NoticedMistake> {
    let subject = &search.case.subject;
    let names = subject.inputs();
    let all = Acting::all(search);
    let dead = dead::channels(&all, &names, &subject.outputs());
    // A drive in thousandths is nearly quiet as well.
    if dead.iter().any(|d| d.constant) {
        return dead.into_iter().map(|d| d.finding).collect();
    }
    let scaled = scaled(&all, &names);
    if scaled.is_empty() { dead.into_iter().map(|d| d.finding).collect() } else { scaled }
}

fn scaled(runs: &[Acting<'_>], names: &[String]) -> Vec<NoticedMistake> {
    let recorded = |input: &usize| runs.iter().any(|r| !r.prescribed.inputs[*input].is_empty());
    let recorded: Vec<usize> = (0..names.len()).filter(recorded).collect();
    let each = recorded.iter().map(|input| vec![*input]);
    // All of them alike first: those of one drive are in one unit.
    let all = (recorded.len() > 1).then(|| recorded.clone());
    let seen = |inputs: Vec<usize>| (acting_most(runs, &inputs), inputs);
    let sets: Vec<(Vec<Seen<'_>>, Vec<usize>)> = all.into_iter().chain(each).map(seen).collect();
    // A unit that all recordings share comes before one of some of them; a gap may bias a gain from one unit to another.
    for rule in [every_recording_by_partial_gains, every_recording, single_recordings] {
        for (seen, inputs) in &sets {
            let called = inputs.iter().map(|i| names[*i].as_str()).collect::<Vec<_>>().join(", ");
            let channel = (inputs.len() == 1).then(|| called.clone());
            let judged = rule(seen, &called);
            if !judged.is_empty() {
                let one = |(file, text)| NoticedMistake {
                    severity: OutcomeSeverity::Grave,
                    kind: "input-scale".into(),
                    file,
                    line: None,
                    channel: channel.clone(),
                    text,
                };
                return judged.into_iter().map(one).collect();
            }
        }
    }
    Vec::new()
}

/// What inputs do in all recordings, in the channel where they act most over all of them: one that is dead acts nowhere.
fn acting_most<'a>(runs: &'a [Acting<'a>], inputs: &[usize]) -> Vec<Seen<'a>> {
    let all: Vec<Seen<'_>> = runs.iter().filter_map(|run| seen(run, inputs)).flatten().collect();
    let acts = |output: usize| all.iter().filter(|s| s.output == output).map(|s| s.acts).sum::<f64>();
    let most = all.iter().map(|s| s.output).max_by(|a, b| acts(*a).total_cmp(&acts(*b)));
    all.into_iter().filter(|s| Some(s.output) == most).collect()
}

fn seen<'a>(run: &'a Acting<'a>, inputs: &[usize]) -> Option<Vec<Seen<'a>>> {
    let prescribed = run.prescribed;
    let (with, without) = (&run.with, run.without(inputs)?);
    let counts = prescribed.counts.clone();
    let one = |at: usize| {
        let along: Vec<f64> = with[at].iter().zip(&without[at]).map(|(a, b)| a - b).collect();
        let acts = run.share(&along, at);
        let [without, along] = [&without[at], &along].map(|series| series[counts.clone()].to_vec());
        let gain = ScaleGain::new(&without, &along);
        Seen { prescribed, output: prescribed.channels[at].output, acts, gain, without, along }
    };
    Some((0..with.len()).map(one).collect())
}

/// The gain of what is missed without an input and of what it does, both less their regression on the motion.
fn partial_gain(seen: &Seen<'_>) -> Option<ScaleGain> {
    let prescribed = seen.prescribed;
    let mut outputs: Vec<usize> = prescribed.channels.iter().map(|c| c.output).collect();
    outputs.sort_unstable();
    outputs.dedup();
    let width = 3 * outputs.len() + 1;
    let rows = || prescribed.counts.clone().map(|k| DVector::from_vec(motion(prescribed, &outputs, k)));
    let mut products = DMatrix::zeros(width, width);
    let mut right = [DVector::zeros(width), DVector::zeros(width)];
    for (k, row) in rows().enumerate() {
        products.ger(1.0, &row, &row, 1.0);
        right[0].axpy(seen.without[k], &row, 1.0);
        right[1].axpy(seen.along[k], &row, 1.0);
    }
    let size = DVector::from_fn(width, |i, _| products[(i, i)].sqrt().max(f64::MIN_POSITIVE));
    let gram = DMatrix::from_fn(width, width, |i, j| {
        products[(i, j)] / size[i] / size[j] + if i == j { 1e-9 } else { 0.0 }
    });
    let gram = gram.cholesky()?;
    let [of_missed, of_input] =
        right.map(|right| gram.solve(&right.component_div(&size)).component_div(&size));
    let rest = |series: &[f64], coefficients: &DVector<f64>| -> Vec<f64> {
        series.iter().zip(rows()).map(|(y, row)| y - row.dot(coefficients)).collect()
    };
    ScaleGain::new(&rest(&seen.without, &of_missed), &rest(&seen.along, &of_input))
}

/// A negative gain that is positive once the motion is taken out: a gap that moves with the input.
fn is_turned_by_the_motion(seen: &[Seen<'_>], name: &str) -> bool {
    let partial = seen.iter().find(|s| s.name() == name).and_then(partial_gain);
    partial.is_some_and(|g| g.value > TURNED * g.deviation)
}

/// The case, where all gains are surely near one unit.
fn every_recording(seen: &[Seen<'_>], called: &str) -> Vec<(String, String)> {
    let gains = named_gains(seen);
    let whole: Vec<_> = gains.iter().map(|(_, g)| g.cause(1.0)).collect();
    match whole.first() {
        Some(Some(cause)) if whole.iter().all(|c| c.is_some_and(|c| c.0 == cause.0)) => {
            vec![in_every_recording(called, cause.1, &gains)]
        }
        _ => Vec::new(),
    }
}

/// The case, where all partial gains are near one unit and are sure together, and no gain itself is as usual.
fn every_recording_by_partial_gains(seen: &[Seen<'_>], called: &str) -> Vec<(String, String)> {
    if seen.iter().any(|s| s.gain.is_none_or(|g| g.is_near(1.0))) {
        return Vec::new();
    }
    let gains: Vec<(&str, ScaleGain)> =
        seen.iter().filter_map(|s| Some((s.name(), partial_gain(s)?))).collect();
    let Some(cause) = gains.first().and_then(|(_, g)| g.likely(1.0)) else { return Vec::new() };
    let alike = gains.iter().all(|(_, g)| g.likely(1.0).is_some_and(|c| c.0 == cause.0));
    if gains.len() == seen.len() && alike && ScaleGain::sure_together(&gains) {
        vec![in_every_recording(called, cause.1, &gains)]
    } else {
        Vec::new()
    }
}

fn named_gains<'s>(seen: &'s [Seen<'_>]) -> Vec<(&'s str, ScaleGain)> {
    seen.iter().filter_map(|s| Some((s.name(), s.gain?))).collect()
}

fn in_every_recording(called: &str, cause: &str, gains: &[(&str, ScaleGain)]) -> (String, String) {
    let all = gains.iter().map(|(name, g)| format!("{:.3e} in {name}", g.value));
    let text = format!(
        "{called}: it looks as if {cause} in every recording: the model needs it times {}; give the unit or the scale of the column in the sidecar",
        all.collect::<Vec<_>>().join(", ")
    );
    ("case.toml".into(), text)
}

/// Files with what is wrong in them.
fn single_recordings(seen: &[Seen<'_>], called: &str) -> Vec<(String, String)> {
    let gains = named_gains(seen);
    // Compared with the other recordings a gap in the model, which all have, drops out.
    let usual = |own: usize| {
        let sure = |g: &ScaleGain| g.value.abs() > SURE * g.deviation;
        let others = gains.iter().enumerate().filter(|(k, g)| *k != own && sure(&g.1)).map(|g| g.1.1.value);
        let mut others: Vec<f64> = others.collect();
        others.sort_by(f64::total_cmp);
        let alike = others.len() > 1 && (others[others.len() - 1] / others[0]).ln().abs() < NEAR;
        alike.then(|| others[others.len() / 2])
    };
    let found: Vec<(usize, Option<f64>, &str)> = (0..gains.len())
        .filter_map(|k| {
            let usual_gain = usual(k);
            let cause = gains[k].1.cause(usual_gain.unwrap_or(1.0))?;
            let turned = cause.0 < 0.0 && is_turned_by_the_motion(seen, gains[k].0);
            (!turned).then_some((k, usual_gain, cause.1))
        })
        .collect();
    let alone = if found.len() == 1 { " alone" } else { "" };
    let one = |(k, usual_gain, cause): &(usize, Option<f64>, &str)| {
        let (name, gain) = &gains[*k];
        let usual_gain = usual_gain.map_or(String::new(), |b| format!(" where the others need {b:.3e}"));
        let text = format!(
            "{called}: it looks as if {cause} in this recording{alone}: the model needs it times {:.3e}{usual_gain}; give the unit or the scale of \
             the column in its sidecar",
            gain.value
        );
        ((*name).to_owned(), text)
    };
    found.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gain_is_that_of_least_squares_and_its_deviation_that_of_its_parts() {
        let along: Vec<f64> = (0..800).map(|k| (0.1 * f64::from(k)).sin()).collect();
        let noise: Vec<f64> = (0..800).map(|k| (1.7 * f64::from(k * k)).sin()).collect();
        let without: Vec<f64> = along.iter().zip(&noise).map(|(d, e)| -2.5 * d + 0.3 * e).collect();
        let g = ScaleGain::new(&without, &along).unwrap();
        assert!((g.value - 2.5).abs() < 4.0 * g.deviation && g.deviation < 0.03, "{g:?}");
        assert!((g.left - 0.09 / (2.25 + 0.09)).abs() < 0.01, "{g:?}");
        assert!(ScaleGain::new(&without, &vec![0.0; 800]).is_none());
    }

    #[test]
    fn gains_of_several_recordings_are_sure_together() {
        let gain = |value: f64, deviation: f64| ("", ScaleGain { value, deviation, left: 1.0 });
        // Four of three deviations each are one of six; of one deviation each, one of two.
        assert!(ScaleGain::sure_together(&[3.0, 3.0, 3.0, 3.0].map(|v| gain(v, 1.0))));
        assert!(!ScaleGain::sure_together(&[1.0, 1.0, 1.0, 1.0].map(|v| gain(v, 1.0))));
        // An exact one decides.
        assert!(ScaleGain::sure_together(&[gain(1.0, 0.0), gain(-1.0, 1.0)]));
    }
}
