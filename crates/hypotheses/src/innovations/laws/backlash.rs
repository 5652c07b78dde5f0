//! Play between motor and link.

use trueup_estimation::innovations::numeric::sign;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::{LawShape, geometric};
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::of_spring;

/// Whole play `gap` in rad at the motor's coordinate.
pub(super) struct BacklashColumns {
    /// Whole plays that are looked for, in usual twists: from, to, and how many in even ratios.
    even: (f64, f64, usize),
    /// Wider ones.
    wide: &'static [f64],
    /// Prior standard deviation of the amplitude.
    deviation: f64,
    /// Whether companions absorb damping that begins with the contact, and a contact that does not pull.
    contact: bool,
    /// First step of the search.
    step: f64,
}

/// Twist over which damping begins with the contact, in usual twists.
const CONTACT: f64 = 0.15;

impl BacklashColumns {
    pub(super) const JOINT: Self =
        Self { even: (0.015, 2.2, 18), wide: &[3.0, 4.5, 7.0], deviation: 0.1, contact: false, step: 0.12 };
    pub(super) const ARM: Self =
        Self { even: (0.03, 8.0, 16), wide: &[], deviation: 0.15, contact: true, step: 0.14 };
}

impl EffectLaw for BacklashColumns {
    fn id(&self) -> &'static str {
        "backlash"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.at_springs(|j| {
            let shape = |x: f64| LawShape::new("transmission", "gap", &[("gap", x * j.twist)]);
            geometric(self.even).chain(self.wide.iter().copied()).map(shape).collect()
        })
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let j = &along.joints[shape.joint()];
        let (k, d, half) = (j.stiffness, j.damping, 0.5 * shape.value("gap"));
        let column = |f: &dyn Fn(f64, f64) -> f64| {
            along.in_spring(shape.joint(), |m| m.each(|i| f(m.twist[i], m.twist_rate[i])))
        };
        let beyond = |w: f64| (w.abs() - half).max(0.0);
        let touches = |w: f64| f64::from(u8::from(w.abs() > half));
        // (COL-8)
        let free = column(&|w, r| {
            let inside = f64::from(u8::from(w.abs() < half));
            k * (sign(w) * beyond(w) - w) - d * r * inside
        });
        let mut terms = vec![(free, 1.0, self.deviation)];
        if self.contact {
            let late = |w: f64| (-beyond(w) / (CONTACT * j.twist)).exp() * touches(w);
            let pulls = |w: f64, r: f64| (-(k * beyond(w) + d * r * sign(w))).max(0.0);
            terms.push((column(&|w, r| -d * r * late(w)), 0.5, 0.5));
            terms.push((column(&|w, r| sign(w) * pulls(w, r) * touches(w)), 0.5, 0.5));
        }
        let mut terms = LawTerms::new(terms, &[0]);
        terms.applied.spring = Some(shape.joint());
        Some(terms)
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        of_spring(self, along, shape, amplitudes)
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("gap", self.step)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let mut all = vec![LawValue::new("backlashGap", fit.number("gap"))];
        if !self.contact && fit.amplitudes.len() > 1 {
            // A spring of two slopes that has none inside.
            all.push(LawValue::new(
                fit.place().stiffness_name,
                (1.0 + fit.amplitude(1)) * fit.place().stiffness,
            ));
        }
        all
    }
}
