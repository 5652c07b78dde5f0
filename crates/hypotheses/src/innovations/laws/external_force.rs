//! Impulses on the base, the tip, a link or a motor.

use std::f64::consts::PI;

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Raised cosines, each with its begin and width in s, at the same times in all recordings or each in one of them. They are found by
/// pursuit of the scores, by no grid.
pub(super) struct ExternalForceColumns {
    /// Prior standard deviation of the amplitudes.
    deviation: f64,
}

impl ExternalForceColumns {
    pub(super) const JOINT: Self = Self { deviation: 1.0 };
    pub(super) const ARM: Self = Self { deviation: 2.0 };
}

/// Impulses on a place.
pub fn pushes_at(place: &'static str, pulses: Vec<[f64; 2]>) -> LawShape {
    LawShape { pulses, ..LawShape::new(place, "pulses", &[]) }
}

/// Names of the numbers of each impulse that an effect has: forces, torque, begin, duration, edge; force along the third axis.
const NAMES: [[&str; 7]; 3] = [
    ["forceX", "forceY", "torque", "start", "duration", "edge", "forceZ"],
    [
        "secondForceX",
        "secondForceY",
        "secondTorque",
        "secondStart",
        "secondDuration",
        "secondEdge",
        "secondForceZ",
    ],
    ["thirdForceX", "thirdForceY", "thirdTorque", "thirdStart", "thirdDuration", "thirdEdge", "thirdForceZ"],
];
/// Names of forces by axis.
const AXES: [usize; 3] = [0, 1, 6];

/// Which numbers of an impulse its amplitudes at a place are, with their units.
fn sizes(along: &PlantAlong<'_>, place: &str, joint: usize) -> Vec<(usize, f64)> {
    let j = &along.joints[joint];
    match place {
        "base" => along.base.iter().flat_map(|b| b.force.into_iter().enumerate()).collect(),
        "tip" => AXES[..along.tip_axes].iter().map(|name| (*name, along.tip_unit())).collect(),
        "actuator" => vec![(2, j.torque)],
        _ => vec![(2, j.torque * j.turns)],
    }
}

fn pulse(time: f64, [begin, width]: [f64; 2]) -> f64 {
    let inside = time > begin && time < begin + width;
    // (COL-22)
    if inside { 0.5 * (1.0 - (2.0 * PI * (time - begin) / width).cos()) } else { 0.0 }
}

/// Columns of one impulse: one an axis of the place.
fn columns(along: &PlantAlong<'_>, shape: &LawShape, of: [f64; 2]) -> Option<Vec<FilterColumn>> {
    let j = &along.joints[shape.joint()];
    Some(match shape.place {
        "base" => {
            let base = along.base.as_ref()?;
            let axis = |i: usize| along.over_time(base.coordinates[i], |t| base.force[i] * pulse(t, of));
            (0..3).map(axis).collect()
        }
        "tip" => {
            (0..along.tip_axes).map(|axis| along.on_tip(axis, |t| pulse(t, of))).collect::<Option<_>>()?
        }
        "actuator" => vec![along.over_time(j.motor, |t| j.torque * pulse(t, of))],
        _ => vec![along.over_time(j.link, |t| j.torque * pulse(t, of))],
    })
}

impl EffectLaw for ExternalForceColumns {
    fn id(&self) -> &'static str {
        "external-force"
    }
    fn is_impulses(&self) -> bool {
        true
    }
    fn shapes(&self, _: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        Vec::new()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let mut terms = Vec::new();
        for (n, p) in shape.pulses.iter().enumerate() {
            for mut column in columns(along, shape, *p)? {
                if let Some(only) = shape.only.get(n) {
                    let others = column.iter_mut().enumerate().filter(|(k, _)| k != only);
                    others.for_each(|(_, part)| *part = ColumnPart::default());
                }
                terms.push((column, 0.0, self.deviation));
            }
        }
        Some(LawTerms::new(terms, &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let sizes = sizes(fit.along, fit.shape.place, fit.joint);
        let each = fit.amplitudes.chunks(sizes.len().max(1));
        let strength = |a: &[f64]| a.iter().map(|a| a * a).sum::<f64>().sqrt();
        let mut all: Vec<(usize, [f64; 2], &[f64])> =
            fit.shape.pulses.iter().zip(each).enumerate().map(|(n, (p, a))| (n, *p, a)).collect();
        all.sort_by(|a, b| (strength(b.2) * b.1[1]).total_cmp(&(strength(a.2) * a.1[1])));
        // Of impulses in single recordings each recording has its largest, else all have the largest ones.
        let own = |n: usize| fit.shape.only.get(n).copied();
        let mut kept: Vec<(Option<usize>, [f64; 2], &[f64])> = Vec::new();
        for (n, p, a) in all {
            let alike = kept.iter().filter(|k| k.0 == own(n)).count();
            if alike < if own(n).is_some() { 1 } else { NAMES.len() } {
                kept.push((own(n), p, a));
            }
        }
        kept.sort_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        let mut values = Vec::new();
        for (k, (recording, [begin, width], a)) in kept.into_iter().enumerate() {
            let names = &NAMES[if recording.is_some() { 0 } else { k }];
            // A raised cosine of a width is edges of half of it.
            let times = [(names[3], begin), (names[4], 0.5 * width), (names[5], 0.5 * width)];
            let forces = sizes.iter().zip(a).map(|((axis, unit), a)| (names[*axis], a * unit));
            let all =
                forces.chain(times).map(|(name, value)| LawValue { recording, ..LawValue::new(name, value) });
            values.extend(all);
        }
        values
    }
}
