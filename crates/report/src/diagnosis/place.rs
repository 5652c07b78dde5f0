//! Where the gap is.

use trueup_diagnosis::outcome::Diagnosis;

use super::bars::{Bar, bars};
use super::words::{LEAST_SHARE, at, percent, with_unit};
use crate::number::number;
use crate::page::Page;

/// Stretches of time beyond these.
const INTERVALS: usize = 8;

/// By component, channel, frequency, regime and time.
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
    page.section(
        "Where",
        "Shares of the excess over the noise floor with nominal structure; those below 5 % are left out (all are in \
         diagnosis.json).",
    );
    match w.cause.as_deref() {
        Some("external") => page.text(
            "The total momentum is not conserved: an external force acts (in addition to what may be missing inside).",
        ),
        Some("internal") => {
            page.text("The total momentum is conserved, a joint's balance is not: the cause is inside the arm.");
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
    let rows: Vec<Bar> = w
        .components
        .iter()
        .filter(|c| c.share >= LEAST_SHARE)
        .map(|c| bar(at(d, &c.id, c.joint), c.share, 0))
        .collect();
    bars(page, "Component", &rows);
    let rows: Vec<Bar> = w
        .channels
        .iter()
        .filter(|c| c.share >= LEAST_SHARE)
        .map(|c| bar(c.name.clone(), c.share, 5))
        .collect();
    bars(page, "Channel", &rows);
    let rows: Vec<Bar> = w
        .bands
        .iter()
        .filter(|b| b.share >= LEAST_SHARE)
        .map(|b| bar(format!("{} to {} Hz", number(b.low_hz), number(b.high_hz)), b.share, 3))
        .collect();
    bars(page, "Frequency", &rows);
    let rows: Vec<Bar> = w
        .regimes
        .iter()
        .filter(|r| r.share >= LEAST_SHARE)
        .map(|r| {
            let of = |x: f64| with_unit(number(x), &r.unit);
            let label = match (r.low, r.high) {
                (Some(a), Some(b)) => format!("{} from {} to {}", r.variable, number(a), of(b)),
                (Some(a), None) => format!("{} above {}", r.variable, of(a)),
                (None, Some(b)) => format!("{} below {}", r.variable, of(b)),
                (None, None) => r.variable.clone(),
            };
            bar(label, r.share, 4)
        })
        .collect();
    bars(page, "Operating regime", &rows);
    let rows: Vec<Bar> = w
        .intervals
        .iter()
        .filter(|i| i.share >= LEAST_SHARE)
        .take(INTERVALS)
        .map(|i| bar(format!("{}: {} s to {} s", i.recording, number(i.start), number(i.end)), i.share, 1))
        .collect();
    bars(page, "Time", &rows);
    page.html("</div>");
    let more = w.intervals.iter().skip(INTERVALS).filter(|i| i.share >= LEAST_SHARE).count();
    if more > 0 {
        page.text(&format!("And {more} more stretches of time: see diagnosis.json."));
    }
}
