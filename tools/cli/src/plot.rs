//! Line plots as SVG, and a page that holds them: one file, no network, no scripts.

use plotters::prelude::*;
use std::fmt::Write as _;

/// One line of a plot.
pub(crate) struct Line<'a> {
    pub(crate) label: &'a str,
    pub(crate) t: &'a [f64],
    pub(crate) y: &'a [f64],
}

const SIZE: (u32, u32) = (860, 300);
const COLOURS: [RGBColor; 5] = [
    RGBColor(0, 90, 160),
    RGBColor(208, 80, 20),
    RGBColor(40, 130, 60),
    RGBColor(130, 60, 150),
    RGBColor(90, 90, 90),
];

/// Most points drawn per line: beyond it a line is thinned by the extremes of each stretch.
const POINTS: usize = 1500;

/// A plot over time in s.
pub(crate) fn svg(title: &str, y_label: &str, lines: &[Line]) -> Result<String, String> {
    let mut out = String::new();
    draw(&mut out, title, y_label, lines)
        .map_err(|e| format!("the plot {title:?} could not be drawn: {e}"))?;
    Ok(out)
}

fn draw(
    out: &mut String,
    title: &str,
    y_label: &str,
    lines: &[Line],
) -> Result<(), Box<dyn std::error::Error>> {
    let all = |pick: fn(&Line<'_>) -> Vec<f64>| {
        lines.iter().flat_map(pick).filter(|v| v.is_finite()).collect::<Vec<_>>()
    };
    let (t, y) = (range(&all(|l| l.t.to_vec()), 0.0), range(&all(|l| l.y.to_vec()), 0.06));
    let root = SVGBackend::with_string(out, SIZE).into_drawing_area();
    let mut chart = ChartBuilder::on(&root)
        .caption(title, ("sans-serif", 17))
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(76)
        .build_cartesian_2d(t, y)?;
    chart
        .configure_mesh()
        .x_desc("time in s")
        .y_desc(y_label)
        .y_label_formatter(&|v| number(*v))
        .light_line_style(WHITE.mix(0.0))
        .draw()?;
    for (line, colour) in lines.iter().zip(COLOURS.iter().cycle()) {
        let style = ShapeStyle::from(colour).stroke_width(2);
        chart
            .draw_series(LineSeries::new(thin(line), style))?
            .label(line.label)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
    }
    if lines.len() > 1 {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .draw()?;
    }
    root.present()?;
    Ok(())
}

fn range(values: &[f64], margin: f64) -> std::ops::Range<f64> {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if low >= high {
        let centre = if low.is_finite() { low } else { 0.0 };
        return centre - 1.0..centre + 1.0;
    }
    low - margin * (high - low)..high + margin * (high - low)
}

/// Few digits, powers of ten where they are shorter.
fn number(v: f64) -> String {
    let a = v.abs();
    if a < 1e-15 {
        return "0".to_owned(); // what rounding leaves of 0
    }
    if a != 0.0 && !(1e-3..1e5).contains(&a) {
        format!("{v:.1e}")
    } else {
        format!("{:.4}", v).trim_end_matches('0').trim_end_matches('.').to_owned()
    }
}

fn thin(line: &Line) -> Vec<(f64, f64)> {
    let n = line.t.len().min(line.y.len());
    let stretch = (2 * n).div_ceil(POINTS).max(1);
    if stretch == 1 {
        return line.t.iter().copied().zip(line.y.iter().copied()).collect();
    }
    let mut points = Vec::with_capacity(POINTS + 2);
    for begin in (0..n).step_by(stretch) {
        let part = begin..(begin + stretch).min(n);
        let by = |a: &usize, b: &usize| line.y[*a].total_cmp(&line.y[*b]);
        let (low, high) = (part.clone().min_by(by), part.max_by(by));
        let mut ends = [low, high].into_iter().flatten().collect::<Vec<_>>();
        ends.sort_unstable();
        points.extend(ends.into_iter().map(|i| (line.t[i], line.y[i])));
    }
    points
}

/// A page of sections: a heading, a paragraph, and pictures.
pub(crate) struct Page(String);

impl Page {
    pub(crate) fn new(title: &str, lead: &str) -> Self {
        Self(format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>\n<style>body{{font-family:sans-serif;\
             max-width:900px;margin:2em auto;padding:0 1em;color:#222}}svg{{max-width:100%;height:auto}}table{{border-collapse:collapse}}\
             td,th{{padding:.25em .8em;border-bottom:1px solid #ddd;text-align:left}}</style></head><body>\n<h1>{0}</h1>\n<p>{1}</p>\n",
            escape(title),
            escape(lead)
        ))
    }
    pub(crate) fn section(&mut self, heading: &str, text: &str) {
        let _ = writeln!(self.0, "<h2>{}</h2>\n<p>{}</p>", escape(heading), escape(text));
    }
    pub(crate) fn text(&mut self, text: &str) {
        let _ = writeln!(self.0, "<p>{}</p>", escape(text));
    }
    pub(crate) fn picture(&mut self, svg: &str) {
        self.0.push_str(svg);
        self.0.push('\n');
    }
    pub(crate) fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let row = |cells: &[String], tag: &str| {
            cells.iter().fold(String::from("<tr>"), |s, c| s + &format!("<{tag}>{}</{tag}>", escape(c)))
                + "</tr>\n"
        };
        self.0.push_str("<table>\n");
        self.0.push_str(&row(&head.iter().map(|h| (*h).to_owned()).collect::<Vec<_>>(), "th"));
        rows.iter().for_each(|r| self.0.push_str(&row(r, "td")));
        self.0.push_str("</table>\n");
    }
    pub(crate) fn finish(mut self) -> String {
        self.0.push_str("</body></html>\n");
        self.0
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}
