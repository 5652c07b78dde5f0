//! The gain of each input, recording by recording, before any cause is looked for: another unit, the opposite sign.

use serde::Serialize;

use super::acting::Acting;
use super::dead;
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

    /// The unit that it is near, other than `usual`; `None` where it is as usual, or near none.
    fn cause(&self, usual: f64) -> Option<&'static (f64, &'static str)> {
        let times = self.value / usual;
        let near = |c: f64| (times / c).ln().abs() < NEAR;
        let sure = self.value.abs() > SURE * self.deviation;
        let cause = CAUSES.iter().find(|(c, _)| near(*c))?;
        (sure && !near(1.0) && (cause.0 > 0.0 || self.left < LEFT)).then_some(cause)
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
                recording: s.name.to_owned(),
                input: names[input].clone(),
                gain: gain.value,
                standard_deviation: gain.deviation,
            })
        };
        where_it_acts(&runs, &[input]).into_iter().filter_map(one).collect::<Vec<_>>()
    };
    (0..names.len()).filter(recorded).flat_map(of).collect()
}

/// What inputs do in the output in which they act most over all recordings: one that is dead acts nowhere.
fn where_it_acts<'a>(runs: &[Acting<'a>], inputs: &[usize]) -> Vec<Seen<'a>> {
    let mut all: Vec<Seen<'_>> = runs.iter().filter_map(|run| seen(run, inputs)).flatten().collect();
    let acts = |output: usize| all.iter().filter(|s| s.output == output).map(|s| s.acts).sum::<f64>();
    let most = all.iter().map(|s| s.output).max_by(|a, b| acts(*a).total_cmp(&acts(*b)));
    all.retain(|s| Some(s.output) == most);
    all
}

/// What an input does in a channel of a recording.
struct Seen<'a> {
    name: &'a str,
    /// Output that the channel shows.
    output: usize,
    /// Power of what it does there, over that of what the readings accelerate.
    acts: f64,
    gain: Option<ScaleGain>,
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
    for inputs in all.into_iter().chain(each) {
        let seen = where_it_acts(runs, &inputs);
        let called = inputs.iter().map(|i| names[*i].as_str()).collect::<Vec<_>>().join(", ");
        let channel = (inputs.len() == 1).then(|| called.clone());
        let judged_files = judged(&seen, &called);
        if !judged_files.is_empty() {
            let one = |(file, text)| NoticedMistake {
                severity: OutcomeSeverity::Grave,
                kind: "input-scale".into(),
                file,
                line: None,
                channel: channel.clone(),
                text,
            };
            return judged_files.into_iter().map(one).collect();
        }
    }
    Vec::new()
}

fn seen<'a>(run: &Acting<'a>, inputs: &[usize]) -> Option<Vec<Seen<'a>>> {
    let prescribed = run.prescribed;
    let (with, without) = (&run.with, run.without(inputs)?);
    let counts = prescribed.counts.clone();
    let along = |c: usize| -> Vec<f64> { with[c].iter().zip(&without[c]).map(|(a, b)| a - b).collect() };
    let one = |at: usize| {
        let along = along(at);
        Seen {
            name: &prescribed.name,
            output: prescribed.channels[at].output,
            acts: run.share(&along, at),
            gain: ScaleGain::new(&without[at][counts.clone()], &along[counts.clone()]),
        }
    };
    Some((0..with.len()).map(one).collect())
}

/// Files with what is wrong in them.
fn judged(seen: &[Seen<'_>], called: &str) -> Vec<(String, String)> {
    let gains: Vec<(&str, ScaleGain)> = seen.iter().filter_map(|s| Some((s.name, s.gain?))).collect();
    // Compared with the other recordings a gap in the model, which all have, drops out.
    let usual = |own: usize| {
        let sure = |g: &ScaleGain| g.value.abs() > SURE * g.deviation;
        let others = gains.iter().enumerate().filter(|(k, g)| *k != own && sure(&g.1)).map(|g| g.1.1.value);
        let mut others: Vec<f64> = others.collect();
        others.sort_by(f64::total_cmp);
        let alike = others.len() > 1 && (others[others.len() - 1] / others[0]).ln().abs() < NEAR;
        alike.then(|| others[others.len() / 2])
    };
    let whole: Vec<_> = gains.iter().map(|(_, g)| g.cause(1.0)).collect();
    if let Some(Some(cause)) = whole.first()
        && whole.iter().all(|c| c.is_some_and(|c| c.0 == cause.0))
    {
        let all = gains.iter().map(|(name, g)| format!("{:.3e} in {name}", g.value));
        let text = format!(
            "{called}: it looks as if {} in every recording: the model needs it times {}; give the unit or the scale of the column in the \
             sidecar",
            cause.1,
            all.collect::<Vec<_>>().join(", ")
        );
        return vec![("case.toml".into(), text)];
    }
    let one = |(k, (name, gain)): (usize, &(&str, ScaleGain))| {
        let usual_gain = usual(k);
        let (_, cause) = gain.cause(usual_gain.unwrap_or(1.0))?;
        let usual_gain = usual_gain.map_or(String::new(), |b| format!(" where the others need {b:.3e}"));
        let text = format!(
            "{called}: it looks as if {cause} in this recording alone: the model needs it times {:.3e}{usual_gain}; give the unit or the scale of \
             the column in its sidecar",
            gain.value
        );
        Some(((*name).to_owned(), text))
    };
    gains.iter().enumerate().filter_map(one).collect()
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
}
