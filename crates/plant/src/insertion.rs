//! Where something that a plant lacks can act in it.

use crate::{Coordinate, VariableTable};

/// As what it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InsertedAs {
    /// A generalised force along a coordinate, in addition to the plant's own.
    Force,
    /// An error that is added to an output when it is read.
    Reading,
    /// A factor of an input.
    InputGain,
    /// What is added to an input.
    InputOffset,
}

impl InsertedAs {
    /// For reports.
    pub fn title(self) -> &'static str {
        match self {
            Self::Force => "force",
            Self::Reading => "error of a reading",
            Self::InputGain => "gain of an input",
            Self::InputOffset => "offset of an input",
        }
    }
}

/// One insertion point.
#[derive(Clone, Debug, PartialEq)]
pub struct InsertionPoint {
    /// As what something acts there.
    pub acts: InsertedAs,
    /// Index of the coordinate, the output or the input.
    pub at: usize,
    /// Its name.
    pub name: String,
    /// Unit of what acts; 1: none.
    pub unit: &'static str,
}

/// Insertion points of a plant with these variables and coordinates: a force on each coordinate, an error of each output, gain and
/// offset of each input.
pub fn insertion_points(table: &VariableTable, coordinates: &[Coordinate]) -> Vec<InsertionPoint> {
    let point = |acts, at, name: &str, unit| InsertionPoint { acts, at, name: name.to_owned(), unit };
    let force = |(i, c): (usize, &Coordinate)| point(InsertedAs::Force, i, &c.name, c.force_unit);
    let mut all: Vec<InsertionPoint> = coordinates.iter().enumerate().map(force).collect();
    let outputs = table.outputs.iter().enumerate();
    all.extend(outputs.map(|(i, q)| point(InsertedAs::Reading, i, &q.name, q.unit)));
    for (i, q) in table.inputs.iter().enumerate() {
        all.push(point(InsertedAs::InputGain, i, &q.name, "1"));
        all.push(point(InsertedAs::InputOffset, i, &q.name, q.unit));
    }
    all
}
