//! What the gap before is made of. Gaps do not add, their squares do.

use std::fmt::Write as _;

use trueup_diagnosis::outcome::{Diagnosis, HeldOutGap};

use super::words::{percent, size};
use crate::page::{Page, escape};

/// A part of the square of a gap, with its colour.
struct GapPart {
    what: &'static str,
    square: f64,
    colour: usize,
}

/// Parts of `before`², which add up to it.
fn parts(g: &HeldOutGap, effects: bool) -> Vec<GapPart> {
    let [before, tuned, after, floor] = [g.before, g.tuned, g.after, g.floor].map(|x| x * x);
    let part = |what, square, colour| GapPart { what, square, colour };
    // What does worse than the nominal model explains nothing of its gap.
    let left = after.min(before);
    let noise = floor.min(left);
    let gained = before - left;
    let mut all = match (effects, tuned) {
        (false, _) => vec![part("wrong values of the model's own parameters", gained, 4)],
        (true, t) if t <= before && t >= left => {
            vec![
                part("wrong values of the model's own parameters", before - t, 4),
                part("effects that the model lacks", t - left, 2),
            ]
        }
        // Refitting alone made it worse: its part cannot be separated from that of the effects.
        (true, _) => vec![part("parameters and effects together", gained, 2)],
    };
    all.push(part("the sensors' noise", noise, 7));
    all.push(part("left unexplained", left - noise, 1));
    all
}

/// Of the overall gap as a table, of every channel as a bar.
pub(super) fn budget(page: &mut Page, d: &Diagnosis) {
    let Some(overall) = d.gap.overall.as_ref().filter(|g| (g.before * g.before).is_normal()) else { return };
    let effects = !d.effects.is_empty();
    page.html("<h3>Error budget: what the gap before is made of</h3>");
    let of = parts(overall, effects);
    page.text(
        "Gaps do not add, their squares do, for errors of different causes go up and down by themselves. Of the square of the \
         gap before, the parameters have what refitting takes away, the effects what they take away after that, noise what it \
         would leave of a perfect model, and the rest is unexplained; together they are the whole.",
    );
    if overall.after > overall.before {
        page.text("Here the gap after is larger than the gap before, so nothing of it is explained.");
    } else if effects && of.iter().any(|p| p.what.ends_with("together")) {
        page.text("Here refitting the parameters without the effects gains nothing by itself, so both have one share.");
    }
    let whole = overall.before * overall.before;
    let rows: Vec<Vec<String>> = of
        .iter()
        .map(|p| vec![p.what.to_owned(), percent(p.square / whole), size(p.square.max(0.0).sqrt())])
        .chain([vec!["together: the gap before".to_owned(), percent(1.0), size(overall.before)]])
        .collect();
    let mut html = "<table class=\"bars\"><tbody>\n".to_owned();
    let channels = d.gap.channels.iter().map(|(name, g)| (name.as_str(), g));
    let many = d.gap.channels.len() > 1;
    for (name, g) in [("overall", overall)].into_iter().chain(channels.filter(|_| many)) {
        let whole = g.before * g.before;
        if !whole.is_normal() {
            continue;
        }
        let mut bar = String::new();
        for p in parts(g, effects).iter().filter(|p| p.square > 0.0) {
            let (share, colour, what) = (100.0 * p.square / whole, p.colour, p.what);
            let _ = write!(
                bar,
                "<i class=\"c{colour}\" style=\"width:{share:.2}%\" title=\"{what}: {share:.1} %\"></i>"
            );
        }
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"bar stack\">{bar}</td><td class=\"number\">{}</td></tr>",
            escape(name),
            escape(&size(g.before))
        );
    }
    html.push_str("</tbody></table>");
    let legend: String =
        of.iter().map(|p| format!("<li><i class=\"c{}\"></i>{}</li>", p.colour, p.what)).collect();
    page.html(&format!("<ul class=\"legend\">{legend}</ul>"));
    page.html(&html);
    page.table(&["part", "share of the square", "alone it would be a gap of"], &rows);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_the_whole_whatever_the_figures() {
        const VALUES: [f64; 6] = [0.0, 0.01, 0.011, 0.2, 0.21, 3.8];
        // All fours of them.
        for k in 0..VALUES.len().pow(4) {
            let [before, tuned, after, floor] =
                [0, 1, 2, 3].map(|at| VALUES[k / VALUES.len().pow(at) % VALUES.len()]);
            let g = HeldOutGap { before, tuned, after, floor, closed: None, ci95: None, window: None };
            for effects in [false, true] {
                let of = parts(&g, effects);
                let sum: f64 = of.iter().map(|p| p.square).sum();
                assert!((sum - before * before).abs() < 1e-12 * before.max(1.0), "{g:?}: {sum}");
                assert!(of.iter().all(|p| p.square >= 0.0), "{g:?}");
            }
        }
        let g = HeldOutGap {
            before: 0.5,
            tuned: 0.4,
            after: 0.1,
            floor: 0.06,
            closed: None,
            ci95: None,
            window: None,
        };
        let of: Vec<f64> = parts(&g, true).iter().map(|p| (1e4 * p.square).round() / 1e4).collect();
        assert_eq!(of, [0.09, 0.15, 0.0036, 0.0064]);
    }
}
