//! A cable or hose pulls on a free base.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// A constant wrench; a torque linear in attitude and place; and the gradient of a potential in the place (x, y), a polynomial of order
/// `n` + 1 without constant and line.
pub(super) struct BaseCableColumns;

/// Unit of the amplitudes, in usual forces.
const UNIT: f64 = 0.1;
/// Gradients of the terms of the potential: x^2 / 2, y^2 / 2, x y; x^3 / 3, x^2 y, x y^2, y^3 / 3; (x^2 + y^2)^2 / 4.
const GRADIENTS: [fn(f64, f64) -> [f64; 2]; 8] = [
    |x, _| [x, 0.0],
    |_, y| [0.0, y],
    |x, y| [y, x],
    |x, _| [x * x, 0.0],
    |x, y| [2.0 * x * y, x * x],
    |x, y| [y * y, 2.0 * x * y],
    |_, y| [0.0, y * y],
    |x, y| [x * (x * x + y * y), y * (x * x + y * y)],
];
/// How many of them each order has.
const TERMS: [usize; 3] = [3, 7, 8];
/// Stiffnesses that are positive: of the attitude, of x and y.
const POSITIVE: [usize; 3] = [3, 6, 7];

impl EffectLaw for BaseCableColumns {
    fn id(&self) -> &'static str {
        "cable-stiffness"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let orders = along.base.iter().flat_map(|_| [1.0, 2.0, 3.0]);
        orders.map(|n| LawShape::new("base", "potential", &[("n", n)])).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let base = along.base.as_ref()?;
        let [force, _, torque] = base.force.map(|f| UNIT * f);
        let width = base.reach[0].max(base.reach[1]);
        let of = |f: &dyn Fn([f64; 3]) -> [f64; 3]| {
            along.on_base(base, |m, i| {
                let from = |c: usize| m[c].position[i] - base.middle[c];
                f([from(0) / width, from(1) / width, from(2) / base.reach[2]])
            })
        };
        // (COL-15)
        let mut columns = vec![
            of(&|_| [force, 0.0, 0.0]),
            of(&|_| [0.0, force, 0.0]),
            of(&|_| [0.0, 0.0, torque]),
            of(&|[_, _, a]| [0.0, 0.0, -torque * a]),
            of(&|[x, _, _]| [0.0, 0.0, torque * x]),
            of(&|[_, y, _]| [0.0, 0.0, torque * y]),
        ];
        let order = (shape.value("n") as usize).clamp(1, TERMS.len());
        for gradient in &GRADIENTS[..TERMS[order - 1]] {
            columns.push(of(&|[x, y, _]| {
                let [gx, gy] = gradient(x, y);
                [-force * gx, -force * gy, 0.0]
            }));
        }
        Some(LawTerms::new(columns.into_iter().map(|c| (c, 0.0, 1.0)).collect(), &POSITIVE))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let Some(base) = &fit.along.base else { return Vec::new() };
        let a = |k: usize| fit.amplitude(k);
        let [force, _, torque] = base.force.map(|f| UNIT * f);
        let width = base.reach[0].max(base.reach[1]);
        // One stiffness for both axes; what is constant moves the place at which it does not pull.
        let k = (0.5 * (a(6) + a(7)) * force / width).max(f64::MIN_POSITIVE);
        let turning = (a(3) * torque / base.reach[2]).max(f64::MIN_POSITIVE);
        vec![
            LawValue::new("cableStiffness", k),
            LawValue::new("cableRotationalStiffness", turning),
            LawValue::new("cablePositionX", base.middle[0] + force * a(0) / k),
            LawValue::new("cablePositionY", base.middle[1] + force * a(1) / k),
            LawValue::new("cableAttitude", base.middle[2] + torque * a(2) / turning),
        ]
    }
}
