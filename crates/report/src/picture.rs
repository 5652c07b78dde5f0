//! A chart as a file of its own.

use std::fmt::Write as _;

use crate::chart::Chart;
use crate::page::escape;
use crate::svg::{SCALE, SIZE, svg};

/// Of the title and the legend.
const MARGIN: u32 = 12 * SCALE;

impl Chart<'_> {
    /// The chart with its title and its legend as an SVG file, for documents; empty if there is nothing to draw.
    pub fn picture(&self) -> String {
        let inner = svg(self);
        if inner.is_empty() {
            return inner;
        }
        // The legend, as many lines as it needs.
        let (mut legend, mut x, mut y) = (String::new(), MARGIN, 42 * SCALE);
        for s in &self.series {
            let colour = s.colour.hex();
            let width = (30 + 8 * s.name.chars().count() as u32) * SCALE;
            if x > MARGIN && x + width > SIZE.0 {
                (x, y) = (MARGIN, y + 22 * SCALE);
            }
            let _ = writeln!(
                legend,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{0}\" height=\"{0}\" fill=\"{colour}\"/><text x=\"{1}\" y=\"{2}\">{3}</text>",
                11 * SCALE,
                x + 16 * SCALE,
                y + 11 * SCALE,
                escape(s.name)
            );
            x += width;
        }
        let (width, head) = (SIZE.0, y + 20 * SCALE);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\" font-family=\"sans-serif\" \
             font-size=\"{}\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <text x=\"{MARGIN}\" y=\"{}\" font-weight=\"bold\">{}</text>\n{legend}\
             <g transform=\"translate(0,{head})\">{inner}</g>\n</svg>\n",
            SIZE.1 + head,
            15 * SCALE,
            24 * SCALE,
            escape(&self.title)
        )
    }
}
