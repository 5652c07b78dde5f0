//! Measured and simulated over time.

use trueup_diagnosis::outcome::{Diagnosis, Verdict};

use super::evidence::{Evidence, EvidenceTrace, RECORDINGS};
use crate::chart::Chart;
use crate::page::Page;

/// Residuals so many times smaller than others have a panel of their own.
const APART: f64 = 4.0;
/// Colours as of the gaps: before, tuned, after, noise.
const BEFORE: usize = 1;
const TUNED: usize = 4;
const AFTER: usize = 2;
const NOISE: usize = 7;

/// What was measured with what was simulated, and the difference on its own scale.
pub(super) fn series(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    if e.traces.is_empty() {
        return;
    }
    page.section(
        "Measured and simulated",
        "Residuals first: simulated minus measured, then the signals themselves. Drag to zoom, double click for all, click in the legend to hide; charts zoom together. The fine dark line is what was \
         measured. Shaded: stretches with the largest shares.",
    );
    let mut recordings: Vec<&str> = Vec::new();
    for t in &e.traces {
        if !recordings.contains(&t.recording) {
            recordings.push(t.recording);
        }
    }
    for recording in recordings.iter().take(RECORDINGS) {
        for t in e.twists.iter().chain(&e.traces).filter(|t| t.recording == *recording) {
            trace(page, d, t);
        }
    }
    if recordings.len() > RECORDINGS {
        page.text(&format!("Not drawn: {}.", recordings[RECORDINGS..].join(", ")));
    }
}

/// One channel of one recording.
pub(super) fn trace(page: &mut Page, d: &Diagnosis, t: &EvidenceTrace<'_>) {
    let with = matches!(d.verdict, Verdict::Effects | Verdict::Ambiguous) || !d.effects.is_empty();
    let (last, name, colour) = match with {
        true => (t.after, "with the effects", AFTER),
        false => (t.tuned, "own parameters refitted", TUNED),
    };
    let mut draw = |mut chart: Chart<'_>| {
        for i in d.location.intervals.iter().filter(|i| i.recording == t.recording) {
            chart = chart.band(i.start, i.end);
        }
        page.chart(&chart);
    };
    let difference = |x: &[f64]| x.iter().zip(t.measured).map(|(x, m)| x - m).collect::<Vec<f64>>();
    let (before, after) = (difference(t.before), difference(last));
    let ends: Vec<f64> = [t.time.first(), t.time.last()].into_iter().flatten().copied().collect();
    let (high, low) = (vec![2.0 * t.floor; ends.len()], vec![-2.0 * t.floor; ends.len()]);
    let title = |what: &str| format!("{}, {}: simulated minus measured{what}", t.channel, t.recording);
    let apart = rms(&before) > APART * rms(&after).max(t.floor);
    if apart {
        draw(Chart::over_time(&title(", before"), t.unit).coloured("before", t.time, &before, BEFORE));
    }
    let what = if apart { format!(", {name}") } else { String::new() };
    let heading = title(&what);
    let mut chart = Chart::over_time(&heading, t.unit);
    if !apart {
        chart = chart.coloured("before", t.time, &before, BEFORE);
    }
    chart = chart.coloured(name, t.time, &after, colour);
    if t.floor > 0.0 {
        chart =
            chart.coloured("2 sigma of noise", &ends, &high, NOISE).coloured("-2 sigma", &ends, &low, NOISE);
    }
    draw(chart);
    let title = format!("{}, {}", t.channel, t.recording);
    draw(
        Chart::over_time(&title, t.unit)
            .coloured("before", t.time, t.before, BEFORE)
            .coloured(name, t.time, last, colour)
            .ink("measured", t.time, t.measured),
    );
}

fn rms(x: &[f64]) -> f64 {
    (x.iter().map(|x| x * x).sum::<f64>() / x.len().max(1) as f64).sqrt()
}
