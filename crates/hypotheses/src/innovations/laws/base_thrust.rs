//! A constant force on a free base: in its own axes (a leaking thruster) or in those of the ground.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Form `body` or form `ground`: the two components of the force, and the torque.
pub(super) struct BaseThrustColumns;

/// Unit of the amplitudes, in usual forces.
const UNIT: f64 = 0.1;

impl EffectLaw for BaseThrustColumns {
    fn id(&self) -> &'static str {
        "base-thrust"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let forms = along.base.iter().flat_map(|_| ["ground", "body"]);
        forms.map(|form| LawShape::new("base", form, &[])).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let base = along.base.as_ref()?;
        let turned = f64::from(u8::from(shape.form == "body"));
        let [force, _, torque] = base.force.map(|f| UNIT * f);
        // (COL-20)
        let of = |f: &dyn Fn(f64, f64) -> [f64; 3]| {
            along.on_base(base, |m, i| {
                let (sin, cos) = (turned * m[2].position[i]).sin_cos();
                f(sin, cos)
            })
        };
        let columns = [
            of(&|sin, cos| [force * cos, force * sin, 0.0]),
            of(&|sin, cos| [-force * sin, force * cos, 0.0]),
            of(&|_, _| [0.0, 0.0, torque]),
        ];
        Some(LawTerms::new(columns.map(|c| (c, 0.0, 1.0)).to_vec(), &[]))
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let Some(base) = &fit.along.base else { return Vec::new() };
        let [x, y, turn] = [0, 1, 2].map(|k| UNIT * base.force[k] * fit.amplitude(k));
        // A force in the axes of the ground: that of the base at its usual attitude.
        let turned = if fit.shape.form == "body" { 0.0 } else { base.middle[2] };
        let (sin, cos) = turned.sin_cos();
        vec![
            LawValue::new("thrustForceX", cos * x + sin * y),
            LawValue::new("thrustForceY", cos * y - sin * x),
            LawValue::new("thrustTorque", turn),
        ]
    }
}
