//! A surface as coloured cells.

use std::fmt::Write as _;

use crate::number::number;
use crate::page::{Page, escape};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 360.0;
/// Margins left, right, above, below.
const ROOM: [f64; 4] = [90.0, 130.0, 8.0, 46.0];

/// Blue below 0, orange above, by the size of the largest.
pub(crate) fn colour(z: f64, largest: f64) -> String {
    let part = if largest > 0.0 { (z / largest).clamp(-1.0, 1.0) } else { 0.0 };
    let end = if part < 0.0 { [31.0, 111.0, 180.0] } else { [217.0, 84.0, 30.0] };
    let mix = |e: f64| (240.0 + (e - 240.0) * part.abs()).round() as u8;
    format!("#{:02x}{:02x}{:02x}", mix(end[0]), mix(end[1]), mix(end[2]))
}

/// A quantity over two others, by cells.
#[derive(Clone, Copy, Debug)]
pub struct Heat<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Quantity and unit along x.
    pub x: [&'a str; 2],
    /// Quantity and unit along y.
    pub y: [&'a str; 2],
    /// Unit of the quantity.
    pub unit: &'a str,
    /// Edges of the cells along x and along y, ascending.
    pub edges: [&'a [f64]; 2],
    /// Values, row by row along y; cells without one stay empty.
    pub cells: &'a [Vec<Option<f64>>],
    /// Points with a ring about them.
    pub marks: &'a [(f64, f64)],
}

impl Page {
    /// A quantity over two others as coloured cells.
    pub fn heat(&mut self, heat: &Heat<'_>) {
        draw(self, heat);
    }
}

fn draw(page: &mut Page, heat: &Heat<'_>) {
    let Heat { title, x, y, unit, edges, cells, marks } = *heat;
    let [left, right, top, bottom] = ROOM;
    let (w, h) = (WIDTH - left - right, HEIGHT - top - bottom);
    let ends = |e: &[f64]| Some((*e.first()?, *e.last()?));
    let (Some((x0, x1)), Some((y0, y1))) = (ends(edges[0]), ends(edges[1])) else { return };
    let largest = cells.iter().flatten().flatten().fold(0.0, |m: f64, z| m.max(z.abs()));
    let mut svg = format!(
        "<figure><figcaption>{}</figcaption>\n<div class=\"plot heat\"><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
         aria-label=\"{}\">",
        escape(title),
        escape(title)
    );
    let px = |v: f64| left + (v - x0) / (x1 - x0) * w;
    let py = |v: f64| top + h - (v - y0) / (y1 - y0) * h;
    for (row, ys) in cells.iter().zip(edges[1].windows(2)) {
        for (z, xs) in row.iter().zip(edges[0].windows(2)).filter_map(|(z, xs)| Some(((*z)?, xs))) {
            let (a, b) = (px(xs[0]), py(ys[1]));
            let _ = write!(
                svg,
                "<rect x=\"{a:.1}\" y=\"{b:.1}\" width=\"{:.2}\" height=\"{:.2}\" fill=\"{}\"><title>{}</title></rect>",
                px(xs[1]) - a + 0.3,
                py(ys[0]) - b + 0.3,
                colour(z, largest),
                escape(&format!("{} {unit}", number(z)))
            );
        }
    }
    for (x, y) in marks {
        let _ = write!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"6\" fill=\"none\" stroke=\"#000\" stroke-width=\"2\"/>",
            px(*x),
            py(*y)
        );
    }
    let text = |svg: &mut String, x: f64, y: f64, anchor: &str, text: &str| {
        let _ =
            write!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escape(text));
    };
    let axis = |a: [&str; 2]| if a[1].is_empty() { a[0].to_owned() } else { format!("{} in {}", a[0], a[1]) };
    for part in [0.0, 0.5, 1.0] {
        text(
            &mut svg,
            left + part * w,
            top + h + 18.0,
            "middle",
            &number(round(x0 + part * (x1 - x0), x1 - x0)),
        );
        text(
            &mut svg,
            left - 8.0,
            top + h - part * h + 4.0,
            "end",
            &number(round(y0 + part * (y1 - y0), y1 - y0)),
        );
    }
    text(&mut svg, left + 0.5 * w, top + h + 38.0, "middle", &axis(x));
    let middle = top + 0.5 * h;
    let _ = write!(
        svg,
        "<text transform=\"translate(14 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
        escape(&axis(y))
    );
    // Where nothing is below 0, but for rounding, the scale ends there.
    let signed = cells.iter().flatten().flatten().any(|z| *z < -1e-6 * largest);
    let least = if signed { -1.0 } else { 0.0 };
    for k in 0..21 {
        let part = 1.0 - (1.0 - least) * f64::from(k) / 20.0;
        let fill = colour(part, 1.0);
        let (at, step) = (top + h * f64::from(k) / 21.0, h / 21.0 + 0.3);
        let _ = write!(
            svg,
            "<rect x=\"{:.1}\" y=\"{at:.1}\" width=\"14\" height=\"{step:.1}\" fill=\"{fill}\"/>",
            WIDTH - right + 20.0
        );
    }
    for (part, z) in [(0.0, largest), (0.5, 0.5 * (1.0 + least) * largest), (1.0, least * largest)] {
        text(
            &mut svg,
            WIDTH - right + 40.0,
            top + 9.0 + part * (h - 10.0),
            "start",
            &format!("{} {unit}", number(z)),
        );
    }
    svg.push_str("</svg></div></figure>");
    page.html(&svg);
}

/// To a thousandth of the range, so that 0 is 0.
fn round(v: f64, range: f64) -> f64 {
    let step = 10f64.powf((range.abs() * 1e-3).log10().floor());
    if step > 0.0 && step.is_finite() { (v / step).round() * step } else { v }
}
