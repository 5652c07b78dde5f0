//! A chart as a file of its own.

use std::fmt::Write as _;

use crate::chart::Chart;
use crate::page::escape;
use crate::svg::{COLOURS, SCALE, SIZE, svg};

impl Chart<'_> {
    /// The chart with its title and its legend as an SVG file, for documents; empty if there is nothing to draw.
    pub fn picture(&self) -> String {
        let inner = svg(self);
        if inner.is_empty() {
            return inner;
        }
        let (width, height, head) = (SIZE.0, SIZE.1, 62 * SCALE);
        let (title, size) = (escape(&self.title), 15 * SCALE);
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {}\" font-family=\"sans-serif\" \
             font-size=\"{size}\" fill=\"#222\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
             <text x=\"{}\" y=\"{}\" font-weight=\"bold\">{title}</text>\n",
            height + head,
            12 * SCALE,
            24 * SCALE
        );
        let mut x = 12 * SCALE;
        for (s, colour) in self.series.iter().zip(COLOURS.iter().cycle()) {
            let (y, text) = (42 * SCALE, x + 16 * SCALE);
            let _ = writeln!(
                out,
                "<rect x=\"{x}\" y=\"{y}\" width=\"{0}\" height=\"{0}\" fill=\"{colour}\"/><text x=\"{text}\" y=\"{1}\">{2}</text>",
                11 * SCALE,
                y + 11 * SCALE,
                escape(s.name)
            );
            x = text + (9 * s.name.chars().count() as u32 + 16) * SCALE;
        }
        let _ = writeln!(out, "<g transform=\"translate(0,{head})\">{inner}</g>\n</svg>");
        out
    }
}
