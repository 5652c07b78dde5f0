//! Friction that yields before it slides.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::two_mass::coordinate::MOTOR;

use crate::innovations::along::{JointAlong, PARTS};
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::operator::dahl;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Length `x` in rad over which it slips, and what of it slips four times later.
pub(super) struct PreslidingFrictionColumns;

const LENGTHS: [f64; 14] = [0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.8, 1.2, 2.0, 3.5, 6.0, 10.0, 20.0, 40.0];

/// What the encoder does not resolve is sticking.
fn least(along: &JointAlong<'_>) -> f64 {
    3.0 * along.frame.intake.channels.first().map_or(0.0, |c| c.resolution)
}

impl EffectLaw for PreslidingFrictionColumns {
    fn id(&self) -> &'static str {
        "presliding-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.frame.dry_level() <= 0.0 {
            return Vec::new();
        }
        let own = if along.stiffness > 0.0 { along.unit / along.stiffness } else { along.angle_unit };
        let read = along.frame.intake.channels.first().is_some_and(|c| c.state == 0);
        let least = if read { least(along) } else { 0.0 };
        let lengths = LENGTHS.iter().map(|x| x * own).filter(|x| *x >= least);
        lengths.map(|x| LawShape::new("motor-friction", "length", &[("x", x)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (mut early, mut late): (FilterColumn, FilterColumn) = (Vec::new(), Vec::new());
        for (k, r) in along.runs.iter().enumerate() {
            let w = along.within(k);
            let (first, second) = (dahl(&w.angle, shape.value("x")), dahl(&w.angle, 4.0 * shape.value("x")));
            let force = |f: &dyn Fn(usize) -> f64| {
                let mean = |t: usize| (PARTS * t..PARTS * (t + 1)).map(f).sum::<f64>() / PARTS as f64;
                ColumnPart::force(MOTOR, r.by_node(|t| -along.unit * mean(t)))
            };
            early.push(force(&|i| first[i] - w.sign[i]));
            late.push(force(&|i| second[i] - first[i]));
        }
        Some(LawTerms::new(vec![(early, 1.0, 0.2), (late, 0.0, 0.3)], true))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("x", 0.35)]
    }
    fn bounded(&self, along: &JointAlong<'_>, _: &str, value: f64) -> f64 {
        value.max(least(along))
    }
}
