//! A spring that is no line: powers of the twist, or bends.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::of_spring;

/// Form `power`; form `slopes` with the twist `bend` in rad at which the slope changes; form `knees` with the twists `b` and `b2` in
/// rad from which on it is stiffer to either side.
pub(super) enum NonlinearStiffnessColumns {
    /// Third and fifth power; two slopes.
    Joint,
    /// Second, third and fifth power with a line; knees with a line.
    Arm,
}

/// Bends that are looked for, in usual twists.
const BENDS: [f64; 6] = [0.12, 0.22, 0.35, 0.5, 0.7, 0.9];
/// The same of knees.
const KNEES: [f64; 7] = [0.06, 0.12, 0.2, 0.35, 0.55, 0.75, 1.0];

/// Line and cube that are nearest to the square and to the fifth power, by least squares up to the usual twist: solutions of
/// [[1/3, 1/5], [1/5, 1/7]] c = [1/4, 1/6] and = [1/7, 1/9].
const SQUARE: [f64; 2] = [5.0 / 16.0, 35.0 / 48.0];
const FIFTH: [f64; 2] = [-5.0 / 21.0, 10.0 / 9.0];
/// Least share of its stiffness that a spring keeps.
const LEAST: f64 = 0.02;

impl EffectLaw for NonlinearStiffnessColumns {
    fn id(&self) -> &'static str {
        "nonlinear-stiffness"
    }
    fn forms_apart(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        along.at_springs(|j| {
            let bent = |x: f64| match self {
                Self::Joint => LawShape::new("transmission", "slopes", &[("bend", x * j.twist)]),
                Self::Arm => {
                    LawShape::new("transmission", "knees", &[("b", x * j.twist), ("b2", x * j.twist)])
                }
            };
            let bends = match self {
                Self::Joint => &BENDS[..],
                Self::Arm => &KNEES,
            };
            let bent = bends.iter().map(|x| bent(*x));
            [LawShape::new("transmission", "power", &[])].into_iter().chain(bent).collect()
        })
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let j = &along.joints[shape.joint()];
        let (k, usual) = (j.stiffness, j.twist);
        let of = |f: &dyn Fn(f64) -> f64| along.in_spring(shape.joint(), |m| m.each(|i| k * f(m.twist[i])));
        // (COL-9)
        let power = |p: i32| of(&|w| w * (w / usual).abs().powi(p));
        let terms = match shape.form {
            "slopes" => {
                let b = shape.value("bend");
                vec![(of(&|w| w.clamp(-b, b)), 0.0, 0.7), (of(&|w| w), 0.0, 0.5)]
            }
            "knees" => {
                let (b, b2) = (shape.value("b"), shape.value("b2"));
                let (over, under) = (of(&|w| (w - b).max(0.0)), of(&|w| (w + b2).min(0.0)));
                vec![(over, 0.0, 0.7), (under, 0.0, 0.7), (of(&|w| w), 0.0, 0.5)]
            }
            _ => match self {
                Self::Joint => vec![(power(2), 0.0, 0.7), (power(4), 0.0, 0.7)],
                Self::Arm => {
                    [(1, 0.7), (2, 0.7), (4, 0.3), (0, 0.4)].map(|(p, sd)| (power(p), 0.0, sd)).to_vec()
                }
            },
        };
        let mut terms = LawTerms::new(terms, &[]);
        terms.applied.spring = Some(shape.joint());
        Some(terms)
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        of_spring(self, along, shape, amplitudes)
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        let steps = [("bend", 0.25), ("b", 0.3), ("b2", 0.3)];
        let own = steps.into_iter().filter(|(name, _)| shape.get(name).is_some());
        own.map(|(name, step)| Refinement::relative(name, step)).collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (a, j) = (|k: usize| fit.amplitude(k), fit.place());
        let (stiffness, twist) = (j.stiffness, j.twist);
        let [cubic, knee, bend, line] = match (fit.shape.form, self) {
            ("slopes", _) => [0.0, -a(0), fit.number("bend"), 1.0 + a(0) + a(1)],
            ("knees", _) => {
                [0.0, 0.5 * (a(0) + a(1)), 0.5 * (fit.number("b") + fit.number("b2")), 1.0 + a(2)]
            }
            (_, Self::Joint) => [a(0), 0.0, 0.0, 1.0],
            (_, Self::Arm) => {
                let of = |k: usize| a(0) * SQUARE[k] + a(2) * FIFTH[k];
                [a(1) + of(1), 0.0, 0.0, 1.0 + a(3) + of(0)]
            }
        };
        let mut all = vec![
            LawValue::new("cubicStiffness", cubic * stiffness / twist.powi(2)),
            LawValue::new("kneeStiffness", knee * stiffness),
        ];
        if bend > 0.0 {
            all.push(LawValue::new("kneeDeflection", bend));
        }
        if line != 1.0 {
            all.push(LawValue::new(j.stiffness_name, line.max(LEAST) * stiffness));
        }
        all
    }
}
