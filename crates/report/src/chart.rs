//! A chart as data.

/// Curves over a common axis.
#[derive(Clone, Debug)]
pub struct Chart<'a> {
    pub(crate) title: String,
    pub(crate) x: Axis,
    pub(crate) y: Axis,
    pub(crate) series: Vec<Series<'a>>,
    pub(crate) bands: Vec<(f64, f64)>,
}

/// The label of an axis and its divisions.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Axis {
    /// Quantity; may be empty.
    pub label: String,
    /// Unit; may be empty.
    pub unit: String,
    /// Logarithmic: values that are not positive are left out.
    pub logarithmic: bool,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Straight lines between samples.
    Line,
    /// Each value holds until the next sample.
    Step,
    /// Samples alone.
    Points,
    /// Straight lines, and a mark at every sample.
    LineAndPoints,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Series<'a> {
    pub(crate) name: &'a str,
    pub(crate) x: &'a [f64],
    pub(crate) y: &'a [f64],
    pub(crate) style: Style,
    pub(crate) colour: Colour,
}

/// Colours of the series in their order; the first ones again after the last.
const COLOURS: [&str; 8] =
    ["#1f6fb4", "#d9541e", "#2e8b57", "#8e4ec6", "#b8860b", "#0f9aa8", "#c2337f", "#6b7280"];

/// What a series is drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colour {
    /// One of the palette, the first ones again after the last.
    Palette(usize),
    /// The colour of text, in a fine line: what was measured.
    Ink,
}

impl Colour {
    /// Its name in the page's style, without the dashes of a variable.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Palette(k) => format!("c{}", k % COLOURS.len()),
            Self::Ink => "ink".to_owned(),
        }
    }
    /// In the light.
    pub(crate) fn hex(self) -> &'static str {
        match self {
            Self::Palette(k) => COLOURS[k % COLOURS.len()],
            Self::Ink => "#1c2025",
        }
    }
}

impl Axis {
    /// An even axis.
    pub fn new(label: &str, unit: &str) -> Self {
        Self { label: label.to_owned(), unit: unit.to_owned(), logarithmic: false }
    }

    /// The same, logarithmic.
    pub fn logarithmic(self) -> Self {
        Self { logarithmic: true, ..self }
    }

    /// `label in unit`.
    pub(crate) fn text(&self) -> String {
        match (self.label.as_str(), self.unit.as_str()) {
            (label, "") => label.to_owned(),
            ("", unit) => unit.to_owned(),
            (label, unit) => format!("{label} in {unit}"),
        }
    }
}

impl<'a> Chart<'a> {
    /// An empty chart.
    pub fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self { title: title.to_owned(), x, y, series: Vec::new(), bands: Vec::new() }
    }

    /// An empty chart over time in s. Charts of a section with the same x axis zoom together.
    pub fn over_time(title: &str, unit: &str) -> Self {
        Self::new(title, Axis::new("time", "s"), Axis::new("", unit))
    }

    /// Adds a series. `x` does not fall; the shorter of both slices counts; values that are not finite are
    /// left out.
    /// Several series may have different `x`.
    pub fn series(self, name: &'a str, x: &'a [f64], y: &'a [f64], style: Style) -> Self {
        let next = Colour::Palette(self.series.len());
        self.drawn(name, (x, y), style, next)
    }

    /// Adds a line with a colour of the palette, the same in every chart that shows the same thing.
    pub fn coloured(self, name: &'a str, x: &'a [f64], y: &'a [f64], colour: usize) -> Self {
        self.drawn(name, (x, y), Style::Line, Colour::Palette(colour))
    }

    /// Adds a fine dark line; drawn last it stays to be seen on top of the others.
    pub fn ink(self, name: &'a str, x: &'a [f64], y: &'a [f64]) -> Self {
        self.drawn(name, (x, y), Style::Line, Colour::Ink)
    }

    fn drawn(mut self, name: &'a str, (x, y): (&'a [f64], &'a [f64]), style: Style, colour: Colour) -> Self {
        let n = x.len().min(y.len());
        self.series.push(Series { name, x: &x[..n], y: &y[..n], style, colour });
        self
    }

    /// Adds a line.
    pub fn line(self, name: &'a str, x: &'a [f64], y: &'a [f64]) -> Self {
        self.series(name, x, y, Style::Line)
    }

    /// Shades the stretch of the x axis between two values.
    pub fn band(mut self, from: f64, to: f64) -> Self {
        self.bands.push((from, to));
        self
    }
}
