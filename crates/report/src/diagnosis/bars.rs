//! Bars of plain HTML.

use std::fmt::Write as _;

use crate::page::{Page, escape};

/// A row: what, how long from 0 to 1, the figure beside it; the colour's number.
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
    let mut html =
        format!("<figure><figcaption>{}</figcaption>\n<table class=\"bars\"><tbody>\n", escape(title));
    for row in rows {
        let width = if row.length.is_finite() { 100.0 * row.length.clamp(0.0, 1.0) } else { 0.0 };
        let _ = writeln!(
            html,
            "<tr><th scope=\"row\">{}</th><td class=\"bar\"><i class=\"c{}\" style=\"width:{width:.1}%\"></i></td>\
             <td class=\"number\">{}</td></tr>",
            escape(&row.label),
            row.colour % 8,
            escape(&row.figure)
        );
    }
    html.push_str("</tbody></table></figure>");
    page.html(&html);
}
