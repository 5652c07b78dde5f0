//! The load bends: a share of its inertia is a tip on a spring.

use std::f64::consts::PI;

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::operator::resonator;
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Pole of frequency `f` in Hz and damping ratio `z`; the amplitude is m / (1 - m), m the tip's share of the inertia.
pub(super) struct FlexibleLinkColumns;

impl EffectLaw for FlexibleLinkColumns {
    fn id(&self) -> &'static str {
        "flexible-link"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        if along.stiffness <= 0.0 {
            return Vec::new();
        }
        let ratio = (40.0f64 / 1.2).ln() / 29.0;
        let poles = (0..30).map(|k| 1.2 * (ratio * f64::from(k)).exp());
        poles.map(|f| LawShape::new("load", "pole", &[("f", f), ("z", 0.05)])).collect()
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (w, zeta) = (2.0 * PI * shape.value("f"), shape.value("z"));
        let column = along.on_load(|r| resonator(&r.torque, r.dt, w, zeta).iter().map(|u| -u).collect());
        Some(LawTerms::new(vec![(column, 0.3, 0.5)], true))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        [("f", 0.06), ("z", 0.6), ("f", 0.06 * 0.3)].map(|(n, s)| Refinement::relative(n, s)).to_vec()
    }
    fn bounded(&self, _: &JointAlong<'_>, name: &str, value: f64) -> f64 {
        if name == "z" { value.max(0.004) } else { value }
    }
}
