//! Bars of plain HTML.

use std::fmt::Write as _;

use super::words::{percent, times};
use crate::page::{Page, escape};

/// A row: what, length from 0 to 1, the figure next to it; the colour's number.
pub(super) struct Bar {
    pub(super) label: String,
    pub(super) length: f64,
    pub(super) figure: String,
    pub(super) colour: usize,
}

/// A titled block of bars; nothing if there is none.
pub(super) fn bars(page: &mut Page, title: &str, rows: &[Bar]) {
    if rows.is_empty() {
        return;
    }
    page.html(&format!(
        "<figure><figcaption>{}</figcaption>\n{}</figure>",
        escape(title),
        table(rows, "", "")
    ));
}

fn table(rows: &[Bar], first: &str, style: &str) -> String {
    let mut html = format!("<table class=\"bars\"><tbody>\n{first}");
    for row in rows {
        let width = if row.length.is_finite() { 100.0 * row.length.clamp(0.0, 1.0) } else { 0.0 };
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"bar\"{style}><i class=\"c{}\" style=\"width:{width:.1}%\"></i></td>\
             <td class=\"number\">{}</td></tr>",
            escape(&row.label),
            row.colour % 8,
            escape(&row.figure)
        );
    }
    html + "</tbody></table>"
}

/// Values over several decades, as bars on one logarithmic scale: blocks of rows, each with its title. What is not positive
/// has no length.
pub(super) fn decades(page: &mut Page, blocks: Vec<(String, Vec<Bar>)>) {
    let values = || blocks.iter().flat_map(|b| &b.1).map(|r| r.length).filter(|v| v.is_normal() && *v > 0.0);
    let (least, most) = values().fold((f64::INFINITY, 0.0), |(a, b), v| (v.min(a), v.max(b)));
    if most <= 0.0 {
        return;
    }
    // The smallest has a bar to be seen.
    let (low, high) = ((0.8 * least).log10().floor(), most.log10().ceil());
    let count = (high - low).max(1.0);
    let mut ticks = "<tr class=\"scale\"><th></th><td><div>".to_owned();
    let each = (count / 6.0).ceil().max(1.0);
    let mut at = 0.0;
    while at <= count {
        let value = 10f64.powf(low + at);
        let text = if value > 1.5 {
            format!("{}\u{a0}×", times(value).trim_end_matches(".0"))
        } else {
            short(value)
        };
        let _ = write!(ticks, "<span style=\"left:{:.2}%\">{text}</span>", 100.0 * at / count);
        at += each;
    }
    ticks.push_str("</div></td><td></td></tr>\n");
    let grid = format!(" style=\"background-size:{:.4}% 100%\"", 100.0 / count);
    for (title, mut rows) in blocks {
        for row in &mut rows {
            let along = (row.length.max(f64::MIN_POSITIVE).log10() - low) / count;
            row.length = if row.length > 0.0 { along } else { 0.0 };
        }
        page.html(&format!(
            "<figure class=\"decades\"><figcaption>{}</figcaption>\n{}</figure>",
            escape(&title),
            table(&rows, &ticks, &grid)
        ));
    }
}

/// `0.1 %`
fn short(value: f64) -> String {
    let text = percent(value);
    match text.split_once('\u{a0}') {
        Some((number, rest)) if number.contains('.') && !number.starts_with('<') => {
            format!("{}\u{a0}{rest}", number.trim_end_matches('0').trim_end_matches('.'))
        }
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_a_thousand_times_smaller_has_a_bar_too() {
        let bar = |length| Bar { label: "x".into(), length, figure: String::new(), colour: 1 };
        let mut page = Page::new("", "");
        decades(&mut page, vec![("overall".into(), vec![bar(3.8), bar(0.02), bar(0.011), bar(0.0)])]);
        let html = page.finish();
        let widths: Vec<f64> =
            html.split("style=\"width:").skip(1).filter_map(|s| s.split('%').next()?.parse().ok()).collect();
        assert_eq!(widths, [89.5, 32.5, 26.0, 0.0]);
        for tick in ["1\u{a0}%", "10\u{a0}%", "100\u{a0}%", "10\u{a0}×"] {
            assert!(html.contains(&format!(">{tick}<")), "{tick}");
        }
    }
}
