//! Drag of a free base: a power of its speed, dry friction, or both.

use trueup_estimation::innovations::numeric::sign;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `viscous` (power `p` of the speed), form `dry` (grows over the speed `v0` in m/s) or form `both` (`p` is 1). Translation and
/// rotation have amplitudes of their own.
pub(super) struct BaseDragColumns;

/// Units of the amplitudes in usual forces: viscous (at the usual speed), dry.
const UNITS: [f64; 2] = [0.3, 0.1];
/// Speed over which dry friction grows, in usual speeds; of a power alone, m/s.
const SPEEDS: [f64; 2] = [0.03, 1e-5];
/// Rate over which dry friction of the rotation grows, over the speed of the translation.
const RATE: f64 = 5.0;

impl EffectLaw for BaseDragColumns {
    fn id(&self) -> &'static str {
        "base-drag"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let Some(base) = &along.base else { return Vec::new() };
        let dry = |form| LawShape::new("base", form, &[("v0", SPEEDS[0] * base.speed[0])]);
        let power = |p| LawShape::new("base", "viscous", &[("v0", SPEEDS[1]), ("p", p)]);
        ["dry", "both"].map(dry).into_iter().chain([1.0, 1.3, 2.0].map(power)).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let base = along.base.as_ref()?;
        let (v0, p) = (shape.value("v0"), shape.get("p").unwrap_or(1.0));
        let usual = base.speed[0].max(base.speed[1]);
        let mut columns = Vec::new();
        // (COL-21)
        let mut add = |f: &dyn Fn([f64; 3], f64) -> [f64; 3]| {
            columns.push(along.on_base(base, |m, i| {
                let v = [0, 1, 2].map(|c| m[c].rate[i]);
                f(v, (v[0] * v[0] + v[1] * v[1] + v0 * v0).sqrt())
            }));
        };
        let [force, _, torque] = base.force;
        if shape.form != "dry" {
            let unit = UNITS[0] * force / usual;
            add(&|v, speed| {
                let k = -unit * (speed / usual).powf(p - 1.0);
                [k * v[0], k * v[1], 0.0]
            });
            let rotation = |v: f64| UNITS[0] * torque * sign(v) * (v.abs() / base.speed[2]).powf(p);
            add(&|v, _| [0.0, 0.0, -rotation(v[2])]);
        }
        if shape.form != "viscous" {
            add(&|v, speed| [-UNITS[1] * force * v[0] / speed, -UNITS[1] * force * v[1] / speed, 0.0]);
            add(&|v, _| [0.0, 0.0, -UNITS[1] * torque * (v[2] / (RATE * v0)).tanh()]);
        }
        let positive: Vec<usize> = (0..columns.len()).collect();
        Some(LawTerms::new(columns.into_iter().map(|c| (c, 0.2, 0.7)).collect(), &positive))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        shape.get("p").map(|_| Refinement::relative("p", 0.2)).into_iter().collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let Some(base) = &fit.along.base else { return Vec::new() };
        // The line that has the force of the law at the usual speed.
        let own = match fit.shape.form {
            "dry" => [[0.0; 2], [fit.amplitude(0), fit.amplitude(1)]],
            _ => [[fit.amplitude(0), fit.amplitude(1)], [fit.amplitude(2), fit.amplitude(3)]],
        };
        let size = |k: usize| UNITS[0] * own[0][k] + UNITS[1] * own[1][k];
        let usual = base.speed[0].max(base.speed[1]);
        vec![
            LawValue::new("baseDrag", size(0) * base.force[0] / usual),
            LawValue::new("baseRotationalDrag", size(1) * base.force[2] / base.speed[2]),
        ]
    }
}
