//! A chart as SVG. Colours are those of [`COLOURS`]; the page's style gives them their shade, light or dark.

use std::error::Error;

use plotters::coord::ranged1d::{AsRangedCoord, Ranged, ValueFormatter};
use plotters::prelude::*;

use crate::chart::{Axis, Chart, Colour, Style};
use crate::join::join;
use crate::number::number;

const GRID: &str = "#e3e6ea";
const INK: &str = "#4a5058";
const BAND: &str = "#f3e6c8";

/// Drawn larger than shown: plotters has whole pixels only.
pub(crate) const SCALE: u32 = 5;
pub(crate) const SIZE: (u32, u32) = (920 * SCALE, 300 * SCALE);
/// Samples drawn; a pixel cannot show more.
const POINTS: usize = 4000;

/// The picture; empty if there is nothing to draw.
pub(crate) fn svg(chart: &Chart<'_>) -> String {
    let mut out = String::new();
    match draw_any(&mut out, chart) {
        Ok(()) => out,
        Err(_) => String::new(), // plotters fails on an area without extent only
    }
}

fn draw_any(out: &mut String, chart: &Chart<'_>) -> Result<(), Box<dyn Error>> {
    let fits = |axis: &Axis, v: f64| v.is_finite() && !(axis.logarithmic && v <= 0.0);
    let mut joined = join(&chart.series, POINTS);
    for y in &mut joined.y {
        y.iter_mut().filter(|v| !fits(&chart.y, **v)).for_each(|v| *v = f64::NAN);
    }
    let x = range(&chart.x, joined.x.iter().copied().filter(|v| fits(&chart.x, *v)), 0.0);
    let y = range(&chart.y, joined.y.iter().flatten().copied().filter(|v| v.is_finite()), 0.05);
    let series: Vec<Vec<(f64, f64)>> = joined
        .y
        .iter()
        .map(|y| {
            let points = joined.x.iter().copied().zip(y.iter().copied());
            points.filter(|(x, y)| fits(&chart.x, *x) && y.is_finite()).collect()
        })
        .collect();
    match (chart.x.logarithmic, chart.y.logarithmic) {
        (false, false) => draw(out, chart, x, y, &series),
        (true, false) => draw(out, chart, x.log_scale(), y, &series),
        (false, true) => draw(out, chart, x, y.log_scale(), &series),
        (true, true) => draw(out, chart, x.log_scale(), y.log_scale(), &series),
    }
}

fn draw<X, Y>(
    out: &mut String,
    chart: &Chart<'_>,
    x: X,
    y: Y,
    series: &[Vec<(f64, f64)>],
) -> Result<(), Box<dyn Error>>
where
    X: AsRangedCoord<Value = f64>,
    Y: AsRangedCoord<Value = f64>,
    X::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y::CoordDescType: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    let root = SVGBackend::with_string(out, SIZE).into_drawing_area();
    let mut area = ChartBuilder::on(&root)
        .margin(6 * SCALE)
        .margin_right(14 * SCALE)
        .x_label_area_size(42 * SCALE)
        .y_label_area_size(76 * SCALE)
        .build_cartesian_2d(x, y)?;
    let (across, up) = (area.x_range(), area.y_range());
    let (left, right) = (across.start, across.end);
    let text = |size: u32| ("sans-serif", size * SCALE).into_font().color(&colour(INK));
    area.configure_mesh()
        .x_desc(chart.x.text())
        .y_desc(chart.y.text())
        .x_labels(10)
        .y_labels(7)
        .x_label_formatter(&|v| tick(*v, &across))
        .y_label_formatter(&|v| tick(*v, &up))
        .label_style(text(15))
        .axis_desc_style(text(16))
        .axis_style(colour(GRID).stroke_width(SCALE))
        .bold_line_style(colour(GRID).stroke_width(SCALE))
        .light_line_style(TRANSPARENT)
        .draw()?;
    let (low, high) = {
        let range = area.y_range();
        (range.start, range.end)
    };
    let bands = chart.bands.iter().filter(|(from, to)| *to > left && *from < right);
    area.draw_series(bands.map(|(from, to)| {
        Rectangle::new([(from.max(left), low), (to.min(right), high)], colour(BAND).filled())
    }))?;
    for (points, s) in series.iter().zip(&chart.series) {
        let name = s.colour.hex();
        let width = if s.colour == Colour::Ink { SCALE } else { 9 * SCALE / 5 };
        let line = colour(name).stroke_width(width);
        let corners = s.style == Style::Step;
        if s.style != Style::Points {
            let path = if corners { steps(points) } else { points.clone() };
            area.draw_series(std::iter::once(PathElement::new(path, line)))?;
        }
        if matches!(s.style, Style::Points | Style::LineAndPoints) {
            area.draw_series(points.iter().map(|p| Circle::new(*p, 7 * SCALE / 2, colour(name).filled())))?;
        }
    }
    root.present()?;
    Ok(())
}

/// `#rrggbb`
fn colour(hex: &str) -> RGBColor {
    let part = |at: usize| hex.get(at..at + 2).and_then(|h| u8::from_str_radix(h, 16).ok()).unwrap_or(0);
    RGBColor(part(1), part(3), part(5))
}

/// Least and greatest value with a margin in parts of the distance; a stretch around a single value.
fn range(axis: &Axis, values: impl Iterator<Item = f64>, margin: f64) -> std::ops::Range<f64> {
    let to = |v: f64| if axis.logarithmic { v.ln() } else { v };
    let (low, high) =
        values.map(to).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    let margin = match high - low {
        width if !width.is_finite() => return if axis.logarithmic { 0.1..1.0 } else { -1.0..1.0 },
        // What rounding leaves of a constant is no signal.
        width if width <= 1e-12 * high.abs().max(low.abs()) => high.abs().max(1.0) * 0.5,
        width => margin * width,
    };
    let back = |v: f64| if axis.logarithmic { v.exp() } else { v };
    back(low - margin)..back(high + margin)
}

/// What rounding leaves of a mark at 0 is 0.
fn tick(v: f64, range: &std::ops::Range<f64>) -> String {
    number(if v.abs() < 1e-9 * (range.end - range.start) && range.start <= 0.0 { 0.0 } else { v })
}

/// Each value until the next sample.
fn steps(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let corner = |pair: &[(f64, f64)]| [pair[0], (pair[1].0, pair[0].1)];
    let mut path: Vec<_> = points.windows(2).flat_map(corner).collect();
    path.extend(points.last());
    path
}
