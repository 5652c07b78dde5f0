//! Friction of the load.

use crate::innovations::along::JointAlong;
use crate::innovations::law::{EffectLaw, LawTerms, Refinement};
use crate::innovations::operator::{balancing, dahl};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `level` (level `a` in usual torques, which balances the spring below the speed `v`), form `length` (slips over `x` rad),
/// or form `speed` (grows over `v` rad/s).
pub(super) struct LoadFrictionColumns;

impl EffectLaw for LoadFrictionColumns {
    fn id(&self) -> &'static str {
        "load-friction"
    }
    fn shapes(&self, along: &JointAlong<'_>, _: &OrderPeaks) -> Vec<LawShape> {
        let usual = along.sizes.load_speed;
        let mut all: Vec<LawShape> =
            [0.01, 0.04].map(|x| LawShape::new("load", "speed", &[("v", x * usual)])).to_vec();
        let ratio = (0.3f64 / 0.002).ln() / 5.0;
        let lengths = (0..6).map(|k| 0.002 * (ratio * f64::from(k)).exp() * along.sizes.range);
        all.extend(lengths.map(|x| LawShape::new("load", "length", &[("x", x)])));
        if along.stiffness > 0.0 {
            for v in [0.004, 0.02] {
                let level = |a: f64| LawShape::new("load", "level", &[("v", v * usual), ("a", a)]);
                all.extend([0.03, 0.1, 0.3, 0.45, 0.65, 0.9, 1.25].map(level));
            }
        }
        all
    }
    fn terms(&self, along: &JointAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (unit, usual, v) = (along.unit, along.sizes.load_speed, shape.value("v"));
        let viscous = || along.on_load(|r| r.by_node(|t| -unit * r.load_speed[t] / usual));
        let slips = |x: f64| along.on_load(|r| dahl(&r.load, x).iter().map(|z| -unit * z).collect());
        let terms = if let Some(a) = shape.get("a") {
            let dry = along.on_load(|r| r.by_node(|t| balancing(r.load_speed[t], r.torque[t], a * unit, v)));
            vec![(dry, 1.0, 0.15), (viscous(), 0.05, 0.1)]
        } else if let Some(x) = shape.get("x") {
            vec![(slips(x), 0.1, 0.5), (viscous(), 0.03, 0.1), (slips(4.0 * x), 0.0, 0.2)]
        } else {
            let dry = along.on_load(|r| r.by_node(|t| -unit * (r.load_speed[t] / v).tanh()));
            vec![(dry, 0.3, 0.5), (viscous(), 0.03, 0.1)]
        };
        Some(LawTerms::new(terms, true))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        match shape.form {
            "level" => vec![Refinement::relative("a", 0.3)],
            "length" => vec![Refinement::relative("x", 0.35)],
            _ => Vec::new(),
        }
    }
}
