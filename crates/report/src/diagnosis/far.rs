//! How far the gap shrinks.

use trueup_diagnosis::outcome::{Diagnosis, HeldOutGap, Verdict, WindowGap};

use super::bars::{Bar, decades};
use super::budget::budget;
use super::summary_gap::SummaryGap;
use super::words::{closed, judged_on, percent, size};
use crate::number;
use crate::page::Page;

/// Gaps of all stages, overall and by channel, and what the gap before is made of.
pub(super) fn gap(page: &mut Page, d: &Diagnosis) {
    let Some(overall) = &d.gap.overall else { return };
    page.section(
        "How far",
        &format!(
            "The gap of a channel is the RMS of simulated minus measured over the RMS of the measured signal about its mean, \
             in free-running simulations of {}; overall it is the root mean square over the channels. The scale is \
             logarithmic: each line is ten times the one before.{}",
            judged_on(d),
            SummaryGap::of(d).map_or("", |g| g.why_windows())
        ),
    );
    let many = d.gap.channels.len() > 1;
    let channels = d.gap.channels.iter().filter(|_| many).map(|(name, g)| (name.clone(), g));
    let blocks = [("Overall".to_owned(), overall)].into_iter().chain(channels);
    decades(page, blocks.map(|(name, g)| (name, stages(d, g))).collect());
    let row = |name: &str, g: &HeldOutGap| {
        vec![name.to_owned(), size(g.before), size(g.tuned), size(g.after), size(g.floor), closed(g)]
    };
    let mut rows = vec![row("overall", overall)];
    rows.extend(d.gap.channels.iter().map(|(name, g)| row(name, g)));
    page.html("<details><summary>The figures</summary>");
    rows.extend(d.gap.derived.iter().map(|(name, g)| row(&format!("{name} (not in overall)"), g)));
    page.table(&["channel", "before", "tuned", "after", "noise alone", "closed (95 % interval)"], &rows);
    page.html("</details>");
    rms(page, d);
    below_noise(page, d, overall);
    windows(page, d);
    if !d.gap.left_out.is_empty() {
        page.text(&format!("Without variation and left out: {}.", d.gap.left_out.join(", ")));
    }
    match d.verdict {
        Verdict::NoGap => page.text(
            "There is no gap to be divided among causes: the difference between before and noise alone is within what chance makes \
             of noise.",
        ),
        _ => budget(page, d),
    }
}

/// RMS of simulated minus measured in the channels' units, of angles in degrees as well.
fn rms(page: &mut Page, d: &Diagnosis) {
    let all = d.gap.channels.iter().chain(&d.gap.derived);
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (name, r) in all.filter_map(|(name, g)| Some((name, g.rms.as_ref()?))) {
        let mut add = |unit: &str, factor: f64| {
            let of = |x: f64| number(factor * x);
            let cells = [of(r.before), of(r.tuned), of(r.after), of(r.floor)];
            rows.push([vec![name.clone(), unit.to_owned()], cells.to_vec()].concat());
        };
        add(&r.unit, 1.0);
        if let Some(rest) = r.unit.strip_prefix("rad").filter(|rest| rest.is_empty() || rest.starts_with('/'))
        {
            add(&format!("deg{rest}"), 1f64.to_degrees());
        }
    }
    if rows.is_empty() {
        return;
    }
    page.html("<h3>RMS of simulated minus measured</h3>");
    page.table(&["channel", "unit", "before", "tuned", "after", "noise alone"], &rows);
    if !d.gap.derived.is_empty() {
        page.text(
            "The twist of a transmission is motor angle over gear ratio less load angle, on the load's side: compliance and play show \
             in it, and what moves both ends alike does not.",
        );
    }
}

/// Why a model may miss less than what noise alone leaves.
fn below_noise(page: &mut Page, d: &Diagnosis, overall: &HeldOutGap) {
    if d.effects.is_empty() || overall.after >= overall.floor {
        return;
    }
    page.text(&format!(
        "With the effects the gap ({}) is below what noise alone leaves ({}). This is no contradiction: the latter is an expected value, \
         the declared noise of the sensors with that of the measured inputs carried through the simulation. The input noise of these \
         recordings is one draw, the first states of each recording are estimated and absorb a part of it, and declared noise may be \
         larger than the actual one. The remaining residual is at the level of the noise; a smaller one shows nothing more.",
        size(overall.after),
        size(overall.floor)
    ));
}

/// Gaps of runs that begin again every few periods.
fn windows(page: &mut Page, d: &Diagnosis) {
    let all = d.gap.overall.iter().map(|g| ("overall", g));
    let all = all.chain(d.gap.channels.iter().map(|(name, g)| (name.as_str(), g)));
    let all: Vec<(&str, WindowGap)> = all.filter_map(|(name, g)| Some((name, g.window?))).collect();
    let Some((_, first)) = all.first() else { return };
    page.html("<h3>Over windows</h3>");
    page.text(&format!(
        "The same where the run begins again every {} s, a few periods of the slowest mode, from first states that are \
         estimated there: how well the model predicts, without what a free run of a whole recording gathers at every stop and \
         slip. Which of two estimates of the parameters is reported was decided by such windows of the recordings for fitting.",
        number(first.seconds)
    ));
    let closed = |w: &WindowGap| w.closed.map_or_else(|| "–".to_owned(), |c| percent(c.clamp(0.0, 1.0)));
    let row = |(name, w): &(&str, WindowGap)| {
        vec![(*name).to_owned(), size(w.before), size(w.tuned), size(w.after), size(w.floor), closed(w)]
    };
    let rows: Vec<Vec<String>> = all.iter().map(row).collect();
    page.table(&["channel", "before", "tuned", "after", "noise alone", "closed"], &rows);
}

fn stages(d: &Diagnosis, g: &HeldOutGap) -> Vec<Bar> {
    let all = [
        ("before", g.before, 1),
        ("own parameters refitted", g.tuned, 4),
        ("with the effects", g.after, 2),
        ("noise alone", g.floor, 7),
    ];
    let shown = all.into_iter().filter(|s| s.0 != "with the effects" || !d.effects.is_empty());
    shown
        .map(|(label, gap, colour)| Bar { label: label.to_owned(), length: gap, figure: size(gap), colour })
        .collect()
}

/// The overall gaps alone.
pub(super) fn overall(page: &mut Page, d: &Diagnosis) {
    if let Some(g) = &d.gap.overall {
        decades(page, vec![(format!("Gap on {}", judged_on(d)), stages(d, g))]);
    }
}
