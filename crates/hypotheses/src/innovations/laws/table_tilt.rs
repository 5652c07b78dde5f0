//! The table under the robot is not level: a uniform field.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Both components of the field.
pub(super) struct TableTiltColumns;

/// Unit of the amplitudes, m/s2.
const UNIT: f64 = 1e-3;

impl EffectLaw for TableTiltColumns {
    fn id(&self) -> &'static str {
        "table-tilt"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.mechanics.map(|_| LawShape::new("base", "field", &[])).into_iter().collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, _: &LawShape) -> Option<LawTerms> {
        let mechanics = along.mechanics?;
        let part = |run: usize, axis: usize| {
            let forces = mechanics.field(run, axis)?.into_iter().enumerate();
            let on = |(c, f): (usize, Vec<f64>)| ColumnPart::force(c, f.iter().map(|f| UNIT * f).collect());
            Some(ColumnPart { forces: forces.flat_map(|f| on(f).forces).collect(), readings: Vec::new() })
        };
        // (COL-19)
        let column =
            |axis: usize| (0..along.runs.len()).map(|k| part(k, axis)).collect::<Option<FilterColumn>>();
        Some(LawTerms::new(vec![(column(0)?, 0.0, 4.0), (column(1)?, 0.0, 4.0)], &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        vec![
            LawValue::new("tiltAccelerationX", UNIT * fit.amplitude(0)),
            LawValue::new("tiltAccelerationY", UNIT * fit.amplitude(1)),
        ]
    }
}
