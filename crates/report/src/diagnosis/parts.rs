//! The sections, one after the other.

use std::collections::BTreeSet;

use trueup_diagnosis::diagnose::began;
use trueup_diagnosis::outcome::{Amount, Candidate, Diagnosis, Gap, Noticed, Severity, Verdict};

use super::bars::{Bar, bars};
use super::heat::heat;
use super::words::{badge, effect_name, percent, place, sentence};
use super::{Evidence, Map, RECORDINGS};
use crate::chart::{Axis, Chart, Style};
use crate::number::number;
use crate::page::{Page, escape};

/// Candidates beyond these are not worth a row.
const CANDIDATES: usize = 15;
/// Stretches of time beyond these.
const INTERVALS: usize = 8;
/// Of a spectrum what is below this part of its largest value is not drawn.
const DEPTH: f64 = 1e-9;

/// `[a, b]`, open ends as words.
fn interval(ci: &[Option<f64>; 2]) -> String {
    match ci {
        [Some(a), Some(b)] => format!("{} to {}", number(*a), number(*b)),
        [Some(a), None] => format!("at least {}", number(*a)),
        [None, Some(b)] => format!("at most {}", number(*b)),
        [None, None] => "not bounded by these recordings".to_owned(),
    }
}

fn amount(a: &Amount) -> String {
    format!("{} {}", number(a.value), a.unit).trim_end().to_owned()
}

fn closed(g: &Gap) -> String {
    let Some(closed) = g.closed else { return "–".to_owned() };
    match g.ci95 {
        Some([a, b]) => format!("{} ({} to {})", percent(closed), percent(a), percent(b)),
        None => percent(closed),
    }
}

/// The verdict, its figures, and what is claimed.
pub(super) fn summary(page: &mut Page, d: &Diagnosis) {
    page.section("Verdict", "");
    page.html(&format!(
        "<p class=\"verdict\"><b class=\"badge\">{}</b> {}</p>",
        badge(d.verdict),
        escape(&sentence(d))
    ));
    noticed(page, d);
    if !d.effects.is_empty() {
        let rows: Vec<Vec<String>> = d
            .effects
            .iter()
            .flat_map(|e| {
                let head =
                    [effect_name(&e.id).to_owned(), at(d, &e.component, e.joint), percent(e.probability)];
                let alone = e.closed_alone.map_or_else(|| "–".to_owned(), percent);
                let first = e.parameters.iter().enumerate().map(move |(k, (name, a))| {
                    let lead = if k == 0 { head.clone() } else { Default::default() };
                    let alone = if k == 0 { alone.clone() } else { String::new() };
                    [lead.to_vec(), vec![alone, name.clone(), amount(a), interval(&a.ci95)]].concat()
                });
                let mut rows: Vec<_> = first.collect();
                if rows.is_empty() {
                    let alone = e.closed_alone.map_or_else(|| "–".to_owned(), percent);
                    let head = vec![
                        effect_name(&e.id).to_owned(),
                        at(d, &e.component, e.joint),
                        percent(e.probability),
                    ];
                    rows.push([head, vec![alone, String::new(), String::new(), String::new()]].concat());
                }
                rows
            })
            .collect();
        page.table(
            &["effect", "where", "probability", "closes alone", "parameter", "value", "95 % interval"],
            &rows,
        );
    }
    for line in d.effects.iter().filter_map(|e| basis(d, &e.component, e.joint)).collect::<BTreeSet<_>>() {
        page.text(&line);
    }
    if !d.parameters.is_empty() {
        page.html("<details><summary>The plant's own parameters, refitted</summary>");
        let rows: Vec<Vec<String>> =
            d.parameters.iter().map(|(name, a)| vec![name.clone(), amount(a), interval(&a.ci95)]).collect();
        page.table(&["parameter", "value", "95 % interval"], &rows);
        page.html("</details>");
    }
}

/// What the intake noticed: what may make figures wrong is seen at once, the rest on demand.
fn noticed(page: &mut Page, d: &Diagnosis) {
    let (bad, notes): (Vec<_>, Vec<_>) = d.findings.iter().partition(|f| f.severity != Severity::Note);
    let line = |f: &Noticed| {
        let place = f.line.map_or(f.file.clone(), |line| format!("{}:{line}", f.file));
        let channel = f.channel.as_ref().map_or(String::new(), |c| format!(" {c}"));
        let text = escape(&format!("{place}:{channel} {}", f.text));
        if f.severity == Severity::Grave {
            format!("<li><b>grave:</b> {text}</li>")
        } else {
            format!("<li>{text}</li>")
        }
    };
    let lines = |list: &[&Noticed]| list.iter().map(|f| line(f)).collect::<String>();
    if !bad.is_empty() {
        page.html(&format!(
            "<p>What was noticed of the recordings and the case:</p><ul>{}</ul>",
            lines(&bad)
        ));
    }
    if !notes.is_empty() {
        let n = notes.len();
        page.html(&format!(
            "<details><summary>Noted of the recordings: {n}</summary><ul>{}</ul></details>",
            lines(&notes)
        ));
    }
}

/// Where, with the joint where there are several.
fn at(d: &Diagnosis, component: &str, joint: Option<usize>) -> String {
    place(component, joint.filter(|_| d.model != "TwoMassJoint"))
}

/// Whether the sensors tell a component from the others by structure, or the form of the effect has to.
fn basis(d: &Diagnosis, component: &str, joint: Option<usize>) -> Option<String> {
    let own =
        |name: &String| *name == component || joint.is_some_and(|j| *name == format!("{component}[{j}]"));
    let class = d.sensors.classes.iter().find(|c| c.iter().any(own))?;
    let others: Vec<&str> = class.iter().filter(|name| !own(name)).map(String::as_str).collect();
    let here = at(d, component, joint);
    Some(match others.is_empty() {
        true => format!(
            "Structural: these sensors tell {here} from every other component by the equations alone."
        ),
        false => format!(
            "Form-based: with these sensors {} would show in the same balances as {here}; the form of the effect tells them apart.",
            others.join(", ")
        ),
    })
}

/// How far the gap shrinks.
pub(super) fn gap(page: &mut Page, d: &Diagnosis) {
    let Some(overall) = &d.gap.overall else { return };
    page.section(
        "How far",
        "The gap of a channel is the RMS of simulated minus measured over the RMS of the measured signal about its mean, in \
         free-running simulations of recordings that were never used for fitting; overall it is the root mean square over the \
         channels.",
    );
    let stages = |g: &Gap| {
        [
            ("before", g.before, 1),
            ("own parameters refitted", g.tuned, 4),
            ("with the effects", g.after, 2),
            ("noise alone", g.floor, 7),
        ]
    };
    let longest = stages(overall).iter().fold(1e-300, |m: f64, s| m.max(s.1));
    let rows: Vec<Bar> = stages(overall)
        .iter()
        .filter(|s| s.0 != "with the effects" || !d.effects.is_empty())
        .map(|(label, x, colour)| Bar {
            label: (*label).to_owned(),
            length: x / longest,
            figure: percent(*x),
            colour: *colour,
        })
        .collect();
    bars(page, "Overall", &rows);
    let row = |name: &str, g: &Gap| {
        vec![
            name.to_owned(),
            percent(g.before),
            percent(g.tuned),
            percent(g.after),
            percent(g.floor),
            closed(g),
        ]
    };
    let mut rows = vec![row("overall", overall)];
    rows.extend(d.gap.channels.iter().map(|(name, g)| row(name, g)));
    page.table(&["channel", "before", "tuned", "after", "noise alone", "closed (95 % interval)"], &rows);
    if !d.gap.left_out.is_empty() {
        page.text(&format!("Without variation and left out: {}.", d.gap.left_out.join(", ")));
    }
}

/// Where it lies.
pub(super) fn location(page: &mut Page, d: &Diagnosis) {
    let w = &d.location;
    let nothing = w.components.is_empty()
        && w.channels.is_empty()
        && w.intervals.is_empty()
        && w.regimes.is_empty()
        && w.bands.is_empty();
    if nothing {
        return;
    }
    page.section("Where", "Shares of what is left over the noise floor with nominal structure.");
    match w.cause.as_deref() {
        Some("external") => page.text(
            "The momentum of the whole does not stay: a force from outside acts on it (besides whatever may be missing inside).",
        ),
        Some("internal") => {
            page.text("The momentum of the whole stays, a joint's balance does not: the cause is inside the arm.");
        }
        _ => {}
    }
    let bar = |label: String, share: f64, colour: usize| Bar {
        label,
        length: share,
        figure: percent(share),
        colour,
    };
    page.html("<div class=\"columns\">");
    let rows: Vec<Bar> = w.components.iter().map(|c| bar(at(d, &c.id, c.joint), c.share, 0)).collect();
    bars(page, "Component", &rows);
    let rows: Vec<Bar> = w.channels.iter().map(|c| bar(c.name.clone(), c.share, 5)).collect();
    bars(page, "Channel", &rows);
    let rows: Vec<Bar> = w
        .bands
        .iter()
        .map(|b| bar(format!("{} to {} Hz", number(b.low_hz), number(b.high_hz)), b.share, 3))
        .collect();
    bars(page, "Frequency", &rows);
    let rows: Vec<Bar> = w
        .regimes
        .iter()
        .map(|r| {
            let label = match (r.low, r.high) {
                (Some(a), Some(b)) => format!("{} from {} to {}", r.variable, number(a), number(b)),
                (Some(a), None) => format!("{} above {}", r.variable, number(a)),
                (None, Some(b)) => format!("{} below {}", r.variable, number(b)),
                (None, None) => r.variable.clone(),
            };
            bar(label, r.share, 4)
        })
        .collect();
    bars(page, "Operating regime", &rows);
    let rows: Vec<Bar> = w
        .intervals
        .iter()
        .take(INTERVALS)
        .map(|i| bar(format!("{}: {} s to {} s", i.recording, number(i.start), number(i.end)), i.share, 1))
        .collect();
    bars(page, "Time", &rows);
    page.html("</div>");
    if w.intervals.len() > INTERVALS {
        page.text(&format!(
            "And {} more stretches of time: see diagnosis.json.",
            w.intervals.len() - INTERVALS
        ));
    }
}

/// What was looked at.
pub(super) fn candidates(page: &mut Page, d: &Diagnosis) {
    if d.candidates.is_empty() {
        return;
    }
    page.section(
        "Which",
        "Every candidate was added to the model and everything fitted again. Evidence is the logarithm of its odds against \
         nothing added, on the recordings for fitting; the gap is on the others.",
    );
    let claimed = |c: &Candidate| d.effects.iter().any(|e| e.id == c.id && e.joint == c.joint);
    let shown = d.candidates.iter().take(CANDIDATES);
    let rows: Vec<Bar> = shown
        .clone()
        .map(|c| Bar {
            label: format!("{} ({})", effect_name(&c.id), at(d, &c.component, c.joint)),
            length: c.probability,
            figure: percent(c.probability),
            colour: if claimed(c) { 2 } else { 7 },
        })
        .collect();
    bars(page, "Probability", &rows);
    page.html("<details><summary>Evidence, candidate by candidate</summary>");
    let rows: Vec<Vec<String>> = shown
        .map(|c| {
            let gap = c.holdout_gap.map_or_else(|| "not worth a fit".to_owned(), percent);
            vec![c.id.clone(), at(d, &c.component, c.joint), percent(c.probability), number(c.evidence), gap]
        })
        .collect();
    page.table(&["candidate", "where", "probability", "log evidence", "held-out gap"], &rows);
    if d.candidates.len() > CANDIDATES {
        page.text(&format!("And {} more with less: see diagnosis.json.", d.candidates.len() - CANDIDATES));
    }
    page.html("</details>");
    if d.unknown.present || d.unknown.probability > 0.01 {
        page.text(&format!("None of these: probability {}.", percent(d.unknown.probability)));
    }
}

/// What was not told apart from what, and what the sensors could tell at all.
pub(super) fn told_apart(page: &mut Page, d: &Diagnosis) {
    let structural = !d.sensors.classes.is_empty() || !d.sensors.hidden.is_empty();
    if d.indistinguishable.is_empty() && !structural {
        return;
    }
    page.section("What was not told apart", "");
    if !d.indistinguishable.is_empty() {
        page.text("These recordings cannot say which member of a set it is:");
        let items = d.indistinguishable.iter().map(|set| {
            let names: Vec<&str> = set.iter().map(|id| effect_name(id)).collect();
            format!("<li>{}</li>", escape(&names.join(" / ")))
        });
        page.html(&format!("<ul>{}</ul>", items.collect::<String>()));
    }
    if structural {
        page.html("<h3>What these sensors can tell at all</h3>");
        page.text(
            "What the equations alone allow with these channels, before anything is compared: components in one class can only \
             be told apart by the form of an effect, as long as nothing else is missing.",
        );
        let row = |c: &[String], what: &str| vec![c.join(", "), what.to_owned()];
        let apart = |c: &Vec<String>| {
            row(c, if c.len() > 1 { "only by the form of an effect" } else { "told apart from all others" })
        };
        let mut rows: Vec<Vec<String>> = d.sensors.classes.iter().map(apart).collect();
        if !d.sensors.hidden.is_empty() {
            rows.push(row(&d.sensors.hidden, "in no balance of measured quantities"));
        }
        page.table(&["component", "by structure"], &rows);
    }
}

/// What to record next.
pub(super) fn next(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    let Some(n) = &d.next_experiment else { return };
    page.section("Next experiment", "");
    let names: Vec<&str> = n.separates.iter().map(|id| effect_name(id)).collect();
    let chance = n
        .probability
        .map_or_else(String::new, |p| format!(" Predicted to tell with probability {}.", percent(p)));
    let apart =
        if names.is_empty() { String::new() } else { format!(" It tells apart: {}.", names.join(" / ")) };
    page.text(&format!("{}{apart}{chance} Its inputs: {}.", n.why, n.input));
    for (name, unit, time, values) in &e.next {
        page.chart(&Chart::over_time(name, unit).line(name, time, values));
    }
}

/// Measured and simulated over time.
pub(super) fn series(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    if e.traces.is_empty() {
        return;
    }
    page.section(
        "Measured and simulated",
        "Drag to zoom, double click for all, click in the legend to hide; charts zoom together. Shaded: stretches that stand out.",
    );
    let mut recordings: Vec<&str> = Vec::new();
    for t in &e.traces {
        if !recordings.contains(&t.recording) {
            recordings.push(t.recording);
        }
    }
    let with = matches!(d.verdict, Verdict::Effects | Verdict::Ambiguous) || !d.effects.is_empty();
    for recording in recordings.iter().take(RECORDINGS) {
        for t in e.traces.iter().filter(|t| t.recording == *recording) {
            let (last, name) =
                if with { (t.after, "with the effects") } else { (t.tuned, "own parameters refitted") };
            let shade = |mut chart: Chart<'_>| {
                for i in d.location.intervals.iter().filter(|i| i.recording == t.recording) {
                    chart = chart.band(i.start, i.end);
                }
                page.chart(&chart);
            };
            let mut shade = shade;
            let title = format!("{}, {}", t.channel, t.recording);
            shade(
                Chart::over_time(&title, t.unit)
                    .line("measured", t.time, t.measured)
                    .line("before", t.time, t.before)
                    .line(name, t.time, last),
            );
            let difference = |x: &[f64]| x.iter().zip(t.measured).map(|(x, m)| x - m).collect::<Vec<f64>>();
            let (before, after) = (difference(t.before), difference(last));
            let ends: Vec<f64> = [t.time.first(), t.time.last()].into_iter().flatten().copied().collect();
            let (high, low) = (vec![2.0 * t.floor; ends.len()], vec![-2.0 * t.floor; ends.len()]);
            let title = format!("{}, {}: simulated minus measured", t.channel, t.recording);
            let zero = vec![0.0; ends.len()];
            // Colours as in the chart above.
            let mut chart = Chart::over_time(&title, t.unit)
                .line("measured", &ends, &zero)
                .line("before", t.time, &before)
                .line(name, t.time, &after);
            if t.floor > 0.0 {
                chart = chart.line("+2 sigma of noise", &ends, &high).line("-2 sigma", &ends, &low);
            }
            shade(chart);
        }
    }
    if recordings.len() > RECORDINGS {
        page.text(&format!("Not drawn: {}.", recordings[RECORDINGS..].join(", ")));
    }
}

/// What is missing, as pictures.
pub(super) fn maps(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    if e.maps.is_empty() {
        return;
    }
    let text = match d.verdict {
        Verdict::NoGap | Verdict::Parameters => {
            "The model's own equations, solved for a torque (or a reading) that would be missing in them. What is left here is \
             noise."
        }
        _ => {
            "The model's own equations, solved for the torque (or the reading) that is missing in them, without any candidate: \
             an effect that is to be believed looks like this."
        }
    };
    page.section("What is missing, without a formula", text);
    for map in &e.maps {
        match map {
            Map::Curve { title, x, unit, before, after } => {
                let mut chart = Chart::new(title, Axis::new(x[0], x[1]), Axis::new("", unit))
                    .series("mean", &before.x, &before.mean, Style::LineAndPoints)
                    .line("95 % low", &before.x, &before.low)
                    .line("95 % high", &before.x, &before.high);
                if let Some(after) = after {
                    chart =
                        chart.series("left with the effects", &after.x, &after.mean, Style::LineAndPoints);
                }
                page.chart(&chart);
            }
            Map::Surface { title, x, y, unit, surface } => heat(page, title, *x, *y, unit, surface),
            Map::Spectrum { title, unit, bands } => {
                let unit = format!("({unit})²/Hz");
                let least = DEPTH * bands.residual.iter().copied().fold(0.0, f64::max);
                let drawn = |v: &f64| if *v > least { *v } else { f64::NAN };
                let residual: Vec<f64> = bands.residual.iter().map(drawn).collect();
                let mut chart =
                    Chart::new(title, Axis::new("frequency", "Hz"), Axis::new("", &unit).logarithmic())
                        .line("residual", &bands.frequency, &residual)
                        .line("noise alone", &bands.frequency, &bands.floor);
                for b in &bands.bands {
                    chart = chart.band(b.low, b.high);
                }
                page.chart(&chart);
            }
            Map::Orders { title, unit, orders } => {
                let (order, amplitude): (Vec<f64>, Vec<f64>) =
                    orders.iter().map(|o| (o.order, o.amplitude())).unzip();
                let (x, y) = (Axis::new("periods per turn", ""), Axis::new("amplitude", unit));
                page.chart(&Chart::new(title, x, y).line("amplitude", &order, &amplitude));
            }
            Map::Course { title, recording, unit, time, value } => {
                let title = format!("{title}, {recording}");
                page.chart(&Chart::over_time(&title, unit).line("estimate", time, value));
            }
        }
    }
}

/// How it was done.
pub(super) fn method(page: &mut Page, d: &Diagnosis, e: &Evidence<'_>) {
    page.section(
        "Method and settings",
        "Parameters first: can refitting what the model has, within its owner's doubts, explain the gap? Then every effect of \
         the library by a score test, the survivors by output-error refits with all nuisance parameters, chosen by evidence and \
         by held-out prediction together; probabilities are calibrated on trials with sealed truth.",
    );
    if !d.notes.is_empty() {
        let items: String = d.notes.iter().map(|n| format!("<li>{}</li>", escape(n))).collect();
        page.html(&format!("<ul>{items}</ul>"));
    }
    if !e.floors.is_empty() {
        page.html("<h3>Noise floor</h3>");
        page.table(
            &["channel", "standard deviation", "from"],
            &e.floors.iter().map(|r| r.to_vec()).collect::<Vec<_>>(),
        );
    }
    let pairs = |rows: &[[String; 2]]| rows.iter().map(|r| r.to_vec()).collect::<Vec<_>>();
    if !e.settings.is_empty() {
        page.html("<h3>Settings</h3>");
        page.table(&["setting", "value"], &pairs(&e.settings));
    }
    if let Some(files) = &d.augmented {
        let files = files.join(", ");
        page.text(&format!("The augmented model: {files}. Where its free runs began: {}.", began::FILE));
    }
    let mut versions = vec![["format".to_owned(), d.schema.clone()]];
    versions.extend(e.versions.iter().cloned());
    page.html("<h3>Versions</h3>");
    page.table(&["what", "version"], &pairs(&versions));
}
