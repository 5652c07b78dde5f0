//! Runs as tiles, coloured by what became of each; a script, where there is one, shows the time line of the tile that is chosen.

use std::fmt::Write as _;

use crate::number::number;
use crate::page::{Page, escape, numbers, quote};

/// Of a picture, by whether it is alone or next to others.
const SIZES: [(f64, f64); 2] = [(640.0, 480.0), (320.0, 300.0)];
/// Margins left, right, above, below.
const ROOM: [f64; 4] = [64.0, 8.0, 24.0, 44.0];
/// Tiles that are smaller have no text.
const TEXT: f64 = 22.0;
/// Levels of an axis that are all written down.
const ALL: usize = 6;
/// Colours of the page's palette for the kinds, good ones first.
const COLOURS: [usize; 8] = [2, 5, 4, 1, 3, 7, 0, 6];

/// Runs over two quantities.
#[derive(Clone, Debug)]
pub struct Tiles<'a> {
    /// The name.
    pub title: &'a str,
    /// Quantity and unit along x.
    pub x: [&'a str; 2],
    /// Quantity and unit along y.
    pub y: [&'a str; 2],
    /// Positions of the tiles, from left to right and from bottom to top.
    pub levels: [&'a [String]; 2],
    /// What a run may have come to.
    pub kinds: &'a [String],
    /// Maps side by side: what each of them is of.
    pub panels: &'a [String],
    /// Numbers that are shown for each run: name and unit.
    pub columns: &'a [[String; 2]],
    /// Names of the lines of a run; the first one shows kinds, by their place from 1, the others when something is not 0.
    pub lines: &'a [String],
    /// Begin and end of the lines, s.
    pub span: [f64; 2],
    /// The runs.
    pub tiles: &'a [Tile],
}

/// A run.
#[derive(Clone, Debug, Default)]
pub struct Tile {
    /// The name.
    pub name: String,
    /// Which map.
    pub panel: usize,
    /// Which level along x and along y.
    pub at: [usize; 2],
    /// What it came to; `None` if it failed.
    pub kind: Option<usize>,
    /// A few letters in it.
    pub mark: String,
    /// More about it, a sentence; empty: nothing.
    pub remark: String,
    /// A number for each column.
    pub values: Vec<Option<f64>>,
    /// Of each line: when it changed (the first time is its begin), and to what.
    pub lines: Vec<Vec<(f64, f64)>>,
}

impl Page {
    /// Runs as tiles: a picture for each panel, a legend, and next to the first tile that a reader chooses its time line.
    pub fn tiles(&mut self, tiles: &Tiles<'_>) {
        let mut html = format!("<figure class=\"tiles\"><figcaption>{}</figcaption>\n", escape(tiles.title));
        html.push_str("<ul class=\"legend\">");
        for (k, kind) in tiles.kinds.iter().enumerate() {
            let count = tiles.tiles.iter().filter(|t| t.kind == Some(k)).count();
            let _ = write!(html, "<li><i class=\"c{}\"></i>{} {count}</li>", colour(k), escape(kind));
        }
        let failed = tiles.tiles.iter().filter(|t| t.kind.is_none()).count();
        if failed > 0 {
            let _ = write!(html, "<li><i class=\"none\"></i>failed {failed}</li>");
        }
        html.push_str("</ul>\n<div class=\"panels heat\">");
        (0..tiles.panels.len()).for_each(|panel| draw(&mut html, tiles, panel));
        let _ = write!(
            html,
            "</div>\n<div class=\"cell\" aria-live=\"polite\"></div>\n<script type=\"application/json\">{}</script>\n</figure>",
            data(tiles)
        );
        self.html(&html);
        self.has_tiles();
    }
}

/// Of a kind.
fn colour(kind: usize) -> usize {
    COLOURS[kind % COLOURS.len()]
}

fn draw(html: &mut String, tiles: &Tiles<'_>, panel: usize) {
    let (width, height) = SIZES[usize::from(tiles.panels.len() > 1)];
    let [left, right, top, bottom] = ROOM;
    let (w, h) = (width - left - right, height - top - bottom);
    let [nx, ny] = tiles.levels.map(|l| l.len().max(1) as f64);
    let (dx, dy) = (w / nx, h / ny);
    let title = &tiles.panels[panel];
    let _ = write!(
        html,
        "<svg viewBox=\"0 0 {width} {height}\" role=\"img\" tabindex=\"0\" aria-label=\"{}\">",
        escape(title)
    );
    let text = |html: &mut String, x: f64, y: f64, anchor: &str, text: &str| {
        let _ =
            write!(html, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escape(text));
    };
    text(html, left + 0.5 * w, 15.0, "middle", title);
    for (k, tile) in tiles.tiles.iter().enumerate().filter(|(_, t)| t.panel == panel) {
        let [x, y] = tile.at.map(|at| at as f64);
        let (x, y) = (left + x * dx, top + h - (y + 1.0) * dy);
        let class = tile.kind.map_or_else(|| "none".to_owned(), |kind| format!("c{}", colour(kind)));
        let what = tile.kind.and_then(|kind| tiles.kinds.get(kind)).map_or("failed", String::as_str);
        let _ = write!(
            html,
            "<rect data-k=\"{k}\" class=\"{class}\" x=\"{x:.2}\" y=\"{y:.2}\" width=\"{:.2}\" height=\"{:.2}\">\
             <title>{}: {}</title></rect>",
            dx - (0.04 * dx).min(1.0),
            dy - (0.04 * dy).min(1.0),
            escape(&tile.name),
            escape(what)
        );
        if !tile.mark.is_empty() && dx.min(dy) >= TEXT {
            let _ = write!(
                html,
                "<text class=\"mark\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                x + 0.5 * dx,
                y + 0.5 * dy + 5.0,
                escape(&tile.mark)
            );
        }
    }
    for k in marked(tiles.levels[0].len()) {
        text(html, left + (k as f64 + 0.5) * dx, top + h + 17.0, "middle", &tiles.levels[0][k]);
    }
    for k in marked(tiles.levels[1].len()) {
        text(html, left - 6.0, top + h - (k as f64 + 0.5) * dy + 4.0, "end", &tiles.levels[1][k]);
    }
    let axis = |a: [&str; 2]| if a[1].is_empty() { a[0].to_owned() } else { format!("{} in {}", a[0], a[1]) };
    text(html, left + 0.5 * w, top + h + 37.0, "middle", &axis(tiles.x));
    let _ = writeln!(
        html,
        "<text transform=\"translate(13 {:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text></svg>",
        top + 0.5 * h,
        escape(&axis(tiles.y))
    );
}

/// Levels of an axis that are written down.
fn marked(count: usize) -> Vec<usize> {
    match count {
        0 => Vec::new(),
        n if n <= ALL => (0..n).collect(),
        n => (0..=4).map(|k| k * (n - 1) / 4).collect(),
    }
}

/// What the script needs.
fn data(tiles: &Tiles<'_>) -> String {
    let list = |texts: &[String]| texts.iter().map(|t| quote(t)).collect::<Vec<_>>().join(",");
    let colours = (0..tiles.kinds.len()).map(|k| colour(k).to_string()).collect::<Vec<_>>().join(",");
    let columns = tiles.columns.iter().map(|[name, unit]| format!("[{},{}]", quote(name), quote(unit)));
    let cells = tiles.tiles.iter().map(|t| {
        let told = t.values.iter().map(|v| v.map_or("none".into(), number)).collect::<Vec<_>>();
        let lines = t.lines.iter().map(|line| {
            let flat: Vec<f64> = line.iter().flat_map(|(t, v)| [*t, *v]).collect();
            numbers(&flat, true)
        });
        format!(
            "{{\"name\":{},\"kind\":{},\"at\":[{},{},{}],\"remark\":{},\"told\":[{}],\"lines\":[{}]}}",
            quote(&t.name),
            t.kind.map_or_else(|| "null".to_owned(), |k| k.to_string()),
            t.panel,
            t.at[0],
            t.at[1],
            quote(&t.remark),
            list(&told),
            lines.collect::<Vec<_>>().join(",")
        )
    });
    format!(
        "{{\"kinds\":[{}],\"colours\":[{colours}],\"columns\":[{}],\"lines\":[{}],\"span\":{},\"cells\":[{}]}}",
        list(tiles.kinds),
        columns.collect::<Vec<_>>().join(","),
        list(tiles.lines),
        numbers(&tiles.span, false),
        cells.collect::<Vec<_>>().join(",\n")
    )
}
