//! Numbers that are kept of a run, found row by row.

use trueup_cosim::{ColumnKind, CosimError, ResultColumn, ResultRow, ResultSink, RowValues, slots};

use crate::file::{Output, Take};

/// A sink that keeps of each output what is requested, and no row.
pub struct Measures<'a> {
    outputs: &'a [Output],
    taps: Vec<Tap>,
    begun: Option<f64>,
    time: f64,
}

/// Of one output.
struct Tap {
    kind: ColumnKind,
    slot: usize,
    last: f64,
    least: f64,
    most: f64,
    /// Integral over time of the value, or of its square.
    integral: f64,
    /// When a level was passed.
    passed: Option<f64>,
}

impl<'a> Measures<'a> {
    /// Of these outputs, each of which is a column of the results.
    pub fn new(outputs: &'a [Output]) -> Self {
        Self { outputs, taps: Vec::new(), begun: None, time: 0.0 }
    }

    /// What was found, in the order of the outputs; `None` where a level was never passed, or nothing was computed.
    pub fn values(&self) -> Vec<Option<f64>> {
        let Some(begun) = self.begun else { return vec![None; self.outputs.len()] };
        let whole = self.time - begun;
        // A run that ends where it begins has no mean but its value.
        let mean = |tap: &Tap| if whole > 0.0 { tap.integral / whole } else { tap.last };
        let value = |(output, tap): (&Output, &Tap)| match output.take {
            Take::Final => Some(tap.last),
            Take::Min => Some(tap.least),
            Take::Max => Some(tap.most),
            Take::Mean => Some(mean(tap)),
            Take::Rms => Some(if whole > 0.0 { mean(tap).sqrt() } else { tap.last.abs() }),
            Take::Above(_) | Take::Below(_) | Take::StaysAbove(_) | Take::StaysBelow(_) => tap.passed,
        };
        self.outputs.iter().zip(&self.taps).map(value).collect()
    }
}

impl Take {
    /// The integral over a line from `a` to `b` in the time `h`.
    fn integral(self, a: f64, b: f64, h: f64) -> f64 {
        match self {
            Self::Mean => h * 0.5 * (a + b),
            Self::Rms => h * (a * a + a * b + b * b) / 3.0,
            _ => 0.0,
        }
    }

    /// When a line from `a` to `b` passes the level, as a part of it; at once where it begins beyond.
    fn passes(self, a: f64, b: f64) -> Option<f64> {
        let (a, b) = match self {
            Self::Above(level) | Self::StaysAbove(level) => (a - level, b - level),
            Self::Below(level) | Self::StaysBelow(level) => (level - a, level - b),
            _ => return None,
        };
        if a > 0.0 {
            Some(0.0)
        } else if b > 0.0 {
            Some(a / (a - b))
        } else {
            None
        }
    }
}

impl Take {
    /// A value at which what was passed does not count any more.
    fn returns(self, x: f64) -> bool {
        matches!(self, Self::StaysAbove(level) if x <= level)
            || matches!(self, Self::StaysBelow(level) if x >= level)
    }
}

impl Tap {
    fn first(&mut self, take: Take, time: f64, x: f64) {
        (self.last, self.least, self.most) = (x, x, x);
        self.passed = take.passes(x, x).map(|_| time);
    }

    fn next(&mut self, take: Take, from: f64, to: f64, x: f64) {
        let (before, h) = (self.last, to - from);
        // What is discrete keeps its value until the next row.
        let held = !matches!(self.kind, ColumnKind::Real | ColumnKind::Single);
        self.integral += take.integral(before, if held { before } else { x }, h);
        if take.returns(x) {
            self.passed = None;
        } else if self.passed.is_none() {
            let passes = take.passes(before, x);
            self.passed = passes.map(|part| if held && part > 0.0 { to } else { from + part * h });
        }
        (self.last, self.least, self.most) = (x, self.least.min(x), self.most.max(x));
    }
}

fn number(values: &RowValues, kind: ColumnKind, slot: usize) -> f64 {
    match kind {
        ColumnKind::Real => values.reals[slot],
        ColumnKind::Single => f64::from(values.reals[slot] as f32),
        ColumnKind::Integer | ColumnKind::Boolean => values.integers[slot] as f64,
        ColumnKind::Unsigned => values.integers[slot] as u64 as f64,
        // Refused before.
        ColumnKind::Text => f64::NAN,
    }
}

impl ResultSink for Measures<'_> {
    fn begin(&mut self, columns: &[ResultColumn]) -> Result<(), CosimError> {
        let slots = slots(columns);
        let tap = |output: &Output| {
            let at = columns.iter().position(|c| c.name == output.variable);
            let at = at
                .ok_or_else(|| CosimError::Setting(vec![format!("`{}` is not recorded", output.variable)]))?;
            let (last, least, most, integral, passed) = (0.0, 0.0, 0.0, 0.0, None);
            Ok(Tap { kind: columns[at].kind, slot: slots[at], last, least, most, integral, passed })
        };
        self.taps = self.outputs.iter().map(tap).collect::<Result<_, CosimError>>()?;
        self.begun = None;
        Ok(())
    }

    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        for (output, tap) in self.outputs.iter().zip(&mut self.taps) {
            let x = number(row.values, tap.kind, tap.slot);
            match self.begun {
                None => tap.first(output.take, row.time, x),
                Some(_) => tap.next(output.take, self.time, row.time, x),
            }
        }
        self.begun.get_or_insert(row.time);
        self.time = row.time;
        Ok(())
    }
}
