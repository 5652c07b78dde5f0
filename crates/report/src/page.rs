//! The page: headings, texts, tables and charts, one after the other.

use std::fmt::Write as _;

use crate::chart::{Axis, Chart, Style};
use crate::join::join;
use crate::svg::svg;

/// Samples that a chart hands to the script; enough to zoom into, little enough to load at once.
const POINTS: usize = 12_000;

/// What a page may load: nothing that is not in it.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:";

const STYLE: &str = include_str!("../assets/page.css");
const SCRIPT: &str = include_str!("../assets/page.js");
const SCENES: &str = include_str!("../assets/scene.js");
const TILES: &str = include_str!("../assets/tiles.js");
const UPLOT_STYLE: &str = include_str!("../assets/uplot/uPlot.min.css");
const UPLOT: &str = include_str!("../assets/uplot/uPlot.iife.min.js");
const UPLOT_LICENSE: &str = include_str!("../assets/uplot/LICENSE");

/// A page under way.
pub struct Page {
    html: String,
    charts: usize,
    tiles: bool,
    scenes: bool,
    open: bool,
    /// Where the table of contents goes, if there is one.
    contents: Option<usize>,
    headings: Vec<String>,
}

impl Page {
    /// A page with its title and a paragraph below it.
    pub fn new(title: &str, lead: &str) -> Self {
        let title = escape(title);
        let html = format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n<title>{title}</title>\n\
             <style>\n{STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{title}</h1>\n{}</header>\n<main>\n",
            if lead.is_empty() { String::new() } else { format!("<p>{}</p>\n", escape(lead)) }
        );
        Self {
            html,
            charts: 0,
            tiles: false,
            scenes: false,
            open: false,
            contents: None,
            headings: Vec::new(),
        }
    }

    /// A table of contents with all sections of the page.
    pub fn contents(&mut self) {
        self.close();
        self.contents = Some(self.html.len());
    }

    /// Begins a section; the text may be empty.
    pub fn section(&mut self, heading: &str, text: &str) {
        self.close();
        self.open = true;
        self.headings.push(heading.to_owned());
        let id = anchor(self.headings.len());
        let _ = writeln!(self.html, "<section id=\"{id}\">\n<h2>{}</h2>", escape(heading));
        if !text.is_empty() {
            self.text(text);
        }
    }

    /// A paragraph.
    pub fn text(&mut self, text: &str) {
        let _ = writeln!(self.html, "<p>{}</p>", prose(text));
    }

    /// A part in HTML of its own, as it is.
    pub fn html(&mut self, html: &str) {
        self.html.push_str(html);
        self.html.push('\n');
    }

    /// A table. Cells that are numbers are aligned right.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let numeric = |c: &str| c.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '<'));
        self.html.push_str("<div class=\"table\"><table>\n<thead><tr>");
        head.iter().for_each(|h| {
            let _ = write!(self.html, "<th>{}</th>", escape(h));
        });
        self.html.push_str("</tr></thead>\n<tbody>\n");
        for row in rows {
            self.html.push_str("<tr>");
            // On a narrow screen each row becomes a list, in which each cell has its heading.
            for (cell, head) in row.iter().zip(head) {
                let class = match cell.as_str() {
                    "" => " class=\"empty\"",
                    c if numeric(c) => " class=\"number\"",
                    _ => "",
                };
                // One element: the parts of a cell would be placed apart there.
                let text = prose(cell);
                let text = if text.contains(FIGURE) { format!("<span>{text}</span>") } else { text };
                let _ = write!(self.html, "<td{class} data-label=\"{}\">{text}</td>", escape(head));
            }
            self.html.push_str("</tr>\n");
        }
        self.html.push_str("</tbody></table></div>\n");
    }

    /// A chart: its picture, its legend, and its samples for the script.
    pub fn chart(&mut self, chart: &Chart<'_>) {
        self.charts += 1;
        let html = &mut self.html;
        let _ = write!(
            html,
            "<figure class=\"chart\">\n<figcaption>{}</figcaption>\n<ul class=\"legend\">",
            escape(&chart.title)
        );
        for s in &chart.series {
            let (colour, name) = (s.colour.name(), escape(s.name));
            let _ = write!(html, "<li><i class=\"{colour}\"></i>{name} <output></output></li>");
        }
        let _ = write!(
            html,
            "</ul>\n<div class=\"plot\">{}</div>\n<script type=\"application/json\">{}</script>\n</figure>\n",
            svg(chart),
            data(chart)
        );
    }

    /// There are scenes, which have a script.
    pub(crate) fn has_scenes(&mut self) {
        self.scenes = true;
    }

    /// There are tiles, which have a script.
    pub(crate) fn has_tiles(&mut self) {
        self.tiles = true;
    }

    /// The whole page.
    pub fn finish(mut self) -> String {
        self.close();
        if let Some(at) = self.contents {
            let item =
                |(k, h): (usize, &String)| format!("<a href=\"#{}\">{}</a>\n", anchor(k + 1), escape(h));
            let items: String = self.headings.iter().enumerate().map(item).collect();
            self.html.insert_str(at, &format!("<nav aria-label=\"Contents\">\n{items}</nav>\n"));
        }
        self.html.push_str("</main>\n");
        if self.charts > 0 {
            let _ = write!(
                self.html,
                "<!-- uPlot\n{UPLOT_LICENSE}\n-->\n<style>{UPLOT_STYLE}</style>\n<script>{UPLOT}</script>\n<script>\n{SCRIPT}</script>\n"
            );
        }
        if self.tiles {
            let _ = write!(self.html, "<script>\n{TILES}</script>\n");
        }
        if self.scenes {
            let _ = write!(self.html, "<script>\n{SCENES}</script>\n");
        }
        self.html.push_str("</body>\n</html>\n");
        self.html
    }

    fn close(&mut self) {
        if self.open {
            self.html.push_str("</section>\n");
        }
        self.open = false;
    }
}

/// Of the k-th section.
fn anchor(k: usize) -> String {
    format!("section-{k}")
}

/// What the script needs of a chart.
fn data(chart: &Chart<'_>) -> String {
    let joined = join(&chart.series, POINTS);
    let columns = std::iter::once(numbers(&joined.x, false)).chain(joined.y.iter().map(|y| numbers(y, true)));
    let style = |s: Style| match s {
        Style::Line => "line",
        Style::Step => "step",
        Style::Points => "points",
        Style::LineAndPoints => "both",
    };
    let axis = |a: &Axis| format!("{{\"text\":{},\"log\":{}}}", quote(&a.text()), a.logarithmic);
    let series = chart.series.iter().map(|s| {
        let (name, style, colour) = (quote(s.name), style(s.style), s.colour.name());
        format!("{{\"name\":{name},\"style\":\"{style}\",\"colour\":\"{colour}\"}}")
    });
    let bands = chart.bands.iter().map(|(a, b)| format!("[{a:?},{b:?}]"));
    format!(
        "{{\"x\":{},\"y\":{},\"series\":[{}],\"bands\":[{}],\"data\":[{}]}}",
        axis(&chart.x),
        axis(&chart.y),
        series.collect::<Vec<_>>().join(","),
        bands.collect::<Vec<_>>().join(","),
        columns.collect::<Vec<_>>().join(",")
    )
}

/// As JSON; of y seven digits, which no screen resolves.
pub(crate) fn numbers(values: &[f64], short: bool) -> String {
    let mut out = String::with_capacity(10 * values.len());
    out.push('[');
    for (k, v) in values.iter().enumerate() {
        out.push_str(if k > 0 { "," } else { "" });
        let single = *v as f32;
        let _ = match v {
            v if !v.is_finite() => write!(out, "null"),
            _ if short && single.is_finite() && (single != 0.0 || *v == 0.0) => write!(out, "{single:?}"),
            v => write!(out, "{v:?}"),
        };
    }
    out.push(']');
    out
}

/// A JSON string that is safe inside a script.
pub(crate) fn quote(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('<', "\\u003c")
}

/// Text as HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Begins a figure that stays in one line.
const FIGURE: &str = "<span class=\"figure\">";

/// Escaped text. A browser may end a line after the hyphen of `2e-4`: not here.
fn prose(text: &str) -> String {
    let digit = |c: Option<&u8>| c.is_some_and(u8::is_ascii_digit);
    let figure = |w: &str| {
        let b = w.as_bytes();
        let exponent = |(at, _): (usize, _)| digit(b[..at].last()) && digit(b.get(at + 2));
        w.len() <= LONGEST && w.match_indices("e-").any(exponent)
    };
    let word = |w: &str| if figure(w) { format!("{FIGURE}{}</span>", escape(w)) } else { escape(w) };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// Longer words (a list of values without spaces) would not fit a telephone in one line.
const LONGEST: usize = 24;
