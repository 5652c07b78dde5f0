//! Impulses on the load or the motor, at the same times in all recordings.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::numeric::over_steps;
use trueup_estimation::innovations::two_mass::coordinate::{LOAD, MOTOR};

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Raised cosines, each with its begin and width in s. They are found by pursuit of the scores, by no grid.
pub(super) struct ExternalForceColumns;

/// Impulses on a place.
pub fn pushes_at(place: &'static str, pulses: Vec<[f64; 2]>) -> LawShape {
    LawShape { pulses, ..LawShape::new(place, "pulses", &[]) }
}

fn pulse(time: f64, [begin, width]: [f64; 2]) -> f64 {
    let inside = time > begin && time < begin + width;
    if inside { 0.5 * (1.0 - (2.0 * PI * (time - begin) / width).cos()) } else { 0.0 }
}

impl EffectLaw for ExternalForceColumns {
    fn id(&self) -> &'static str {
        "external-force"
    }
    fn shapes(&self, _: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        Vec::new()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let on = if shape.place == "actuator" { MOTOR } else { LOAD };
        let column = |p: &[f64; 2]| -> FilterColumn {
            let part = |r: &crate::innovations::along::JointSeries| {
                let nodes = r.by_node(|t| along.unit * pulse(r.time(t), *p));
                ColumnPart::force(on, over_steps(&nodes))
            };
            along.runs.iter().map(part).collect()
        };
        Some(LawTerms::new(shape.pulses.iter().map(|p| (column(p), 0.0, 1.0)).collect(), false))
    }
}
