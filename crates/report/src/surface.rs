//! A quantity over two others as a surface in space.

use std::fmt::Write as _;

use crate::heat::colour;
use crate::number::number;
use crate::page::{Page, escape};

const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 420.0;
/// Cells along each side at most: the resolution of the eye.
const CELLS: usize = 48;

/// Values over a grid.
#[derive(Clone, Copy, Debug)]
pub struct GridSurface<'a> {
    /// Title of the picture.
    pub title: &'a str,
    /// Quantity and unit along x.
    pub x: [&'a str; 2],
    /// Quantity and unit along y.
    pub y: [&'a str; 2],
    /// Unit of the quantity.
    pub unit: &'a str,
    /// Places along x and along y, ascending.
    pub at: [&'a [f64]; 2],
    /// Values, row by row along y.
    pub values: &'a [Vec<f64>],
}

/// Where a point of the cube 0 .. 1 is drawn: seen from above, y to the back.
fn drawn(x: f64, y: f64, z: f64) -> (f64, f64) {
    let (x, y) = (x - 0.5, y - 0.5);
    let (sin, cos) = 0.6_f64.sin_cos();
    let (right, back) = (x * cos + y * sin, y * cos - x * sin);
    (0.5 * WIDTH + 360.0 * right, 0.62 * HEIGHT - 150.0 * back - 200.0 * (z - 0.25))
}

impl Page {
    /// A surface in space.
    pub fn surface(&mut self, s: &GridSurface<'_>) {
        let GridSurface { title, x, y, unit, at, values } = *s;
        let (nx, ny) = (at[0].len(), at[1].len());
        if nx < 2 || ny < 2 || values.len() != ny || values.iter().any(|row| row.len() != nx) {
            return;
        }
        let all = || values.iter().flatten().copied().filter(|v| v.is_finite());
        let (low, high) = (all().fold(0.0, f64::min), all().fold(0.0, f64::max));
        let span = if high > low { high - low } else { 1.0 };
        let pick = |n: usize| {
            let step = n.div_ceil(CELLS).max(1);
            let mut list: Vec<usize> = (0..n).step_by(step).collect();
            if list.last() != Some(&(n - 1)) {
                list.push(n - 1);
            }
            list
        };
        let (columns, rows) = (pick(nx), pick(ny));
        let point = |i: usize, k: usize| {
            let part = |list: &[f64], i: usize| (list[i] - list[0]) / (list[list.len() - 1] - list[0]);
            drawn(part(at[0], i), part(at[1], k), (values[k][i] - low) / span)
        };
        let mut svg = format!(
            "<figure><figcaption>{}</figcaption>\n<div class=\"plot heat\"><svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" \
             aria-label=\"{}\">",
            escape(title),
            escape(title)
        );
        // From the back to the front: what is near covers what is far.
        for r in rows.windows(2).rev() {
            for c in columns.windows(2) {
                let corners = [(c[0], r[0]), (c[1], r[0]), (c[1], r[1]), (c[0], r[1])];
                let mean = corners.iter().map(|(i, k)| values[*k][*i]).sum::<f64>() / 4.0;
                if !mean.is_finite() {
                    continue;
                }
                let points: String = corners.iter().fold(String::new(), |mut text, (i, k)| {
                    let (a, b) = point(*i, *k);
                    let _ = write!(text, "{a:.1},{b:.1} ");
                    text
                });
                let _ = write!(
                    svg,
                    "<polygon points=\"{}\" fill=\"{}\" stroke=\"#555\" stroke-width=\"0.3\"/>",
                    points.trim_end(),
                    colour(mean, low.abs().max(high.abs()))
                );
            }
        }
        let mut text = |x: f64, y: f64, anchor: &str, text: &str| {
            let _ = write!(
                svg,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>",
                escape(text)
            );
        };
        let ends = |list: &[f64]| [0, list.len() - 1].map(|i| number(list[i]));
        let named = |a: [&str; 2], [from, to]: [String; 2]| format!("{} from {from} to {to} {}", a[0], a[1]);
        let (a, b) = drawn(0.5, 0.0, 0.0);
        text((a - 60.0).max(200.0), (b + 34.0).min(HEIGHT - 8.0), "end", &named(x, ends(at[0])));
        let (a, b) = drawn(1.0, 0.5, 0.0);
        text((a + 14.0).min(WIDTH - 200.0), (b + 44.0).min(HEIGHT - 8.0), "start", &named(y, ends(at[1])));
        text(8.0, 18.0, "start", &format!("height from {} to {} {unit}", number(low), number(high)));
        svg.push_str("</svg></div></figure>");
        self.html(&svg);
    }
}
