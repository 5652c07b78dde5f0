//! Dry friction of the motor where the nominal model has none.

use trueup_estimation::innovations::column::FilterColumn;

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{DryFriction, EffectLaw, LawFit, LawTerm, LawTerms, LawValue, Refinement};
use crate::innovations::place::JointPlace;
use crate::innovations::run_along::JointMotion;
use crate::innovations::shape::LawShape;
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::{SlidingLevel, of_friction};

/// Level with a viscous companion: of the frame's own dry pair, or slipping over a length `x` in rad with companions of longer ones.
pub(super) struct MotorFrictionColumns {
    /// Units of the amplitudes, in usual torques: dry, viscous (at the usual speed).
    units: [f64; 2],
    /// Prior means of both.
    means: [f64; 2],
    /// Prior standard deviation of both.
    deviation: f64,
    /// Lengths that are looked for, rad; none: the frame's own dry pair.
    lengths: &'static [f64],
}

/// Lengths of companions in lengths of the law, and the prior standard deviation of their amplitudes.
const LONGER: ([f64; 2], f64) = ([4.0, 16.0], 0.3);

impl MotorFrictionColumns {
    pub(super) const JOINT: Self =
        Self { units: [1.0, 1.0], means: [0.3, 0.3], deviation: 0.5, lengths: &[] };
    pub(super) const ARM: Self = Self {
        units: [0.1, 0.3],
        means: [0.3, 0.1],
        deviation: 0.7,
        lengths: &[1e-4, 3e-4, 8e-4, 2e-3, 6e-3],
    };

    /// Unit of a level, N.m.
    pub(super) fn level(&self, joint: &JointPlace) -> f64 {
        self.units[0] * joint.torque
    }
    /// Sliding at a level of 1 times what `f` is at each moment.
    pub(super) fn dry(
        &self,
        along: &PlantAlong<'_>,
        joint: usize,
        length: Option<f64>,
        f: impl Fn(&JointMotion, usize) -> f64,
    ) -> FilterColumn {
        let level = self.level(&along.joints[joint]);
        along.on_motor(joint, |m| {
            let z = m.sliding(length);
            m.each(|i| -level * z[i] * f(m, i))
        })
    }
    /// Its terms at a joint.
    pub(super) fn at(&self, along: &PlantAlong<'_>, joint: usize, length: Option<f64>) -> Vec<LawTerm> {
        let j = &along.joints[joint];
        // (COL-5)
        let viscous = self.units[1] * j.torque / j.motor_speed;
        let viscous = along.on_motor(joint, |m| m.each(|i| -viscous * m.motor_speed[i]));
        let mut terms = vec![
            (self.dry(along, joint, length, |_, _| 1.0), self.means[0], self.deviation),
            (viscous, self.means[1], self.deviation),
        ];
        if let Some(x) = length {
            let longer = |k: f64| (self.dry(along, joint, Some(k * x), |_, _| 1.0), 0.0, LONGER.1);
            terms.extend(LONGER.0.map(longer));
        }
        terms
    }

    /// Slopes of its terms at a joint with these amplitudes, and of a level more that falls with speed.
    pub(super) fn slopes_at(
        &self,
        along: &PlantAlong<'_>,
        joint: usize,
        length: f64,
        amplitudes: &[f64],
        falling: &dyn Fn(f64) -> f64,
    ) -> Option<LawSlopes> {
        let j = &along.joints[joint];
        let unit = self.units[0] * j.torque;
        let [dry, viscous, first, second] = *amplitudes.first_chunk::<4>()?;
        let short = |v: f64| unit * (dry + falling(v));
        let longer = [first, second].map(|a| move |_: f64| unit * a);
        let levels = [
            SlidingLevel { length, level: &short },
            SlidingLevel { length: LONGER.0[0] * length, level: &longer[0] },
            SlidingLevel { length: LONGER.0[1] * length, level: &longer[1] },
        ];
        let viscous = self.units[1] * j.torque * viscous / j.motor_speed;
        Some(of_friction(along, joint, false, &levels, viscous))
    }
}

impl EffectLaw for MotorFrictionColumns {
    fn id(&self) -> &'static str {
        "motor-friction"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn companions(&self) -> (usize, &'static [usize]) {
        (4, &[2, 3])
    }
    fn dry_friction(&self) -> Option<DryFriction> {
        Some(DryFriction::Plain)
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let shape =
            |form, values: &[(&'static str, f64)], k| LawShape::new("motor-friction", form, values).at(&[k]);
        let at = |k: usize| match self.lengths {
            [] => vec![shape("level", &[], k)],
            lengths => lengths.iter().map(|x| shape("length", &[("x", *x)], k)).collect(),
        };
        (0..along.joints.len()).filter(|k| along.joints[*k].dry <= 0.0).flat_map(at).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        Some(LawTerms::new(self.at(along, shape.joint(), shape.get("x")), &[0]))
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        self.slopes_at(along, shape.joint(), shape.get("x")?, amplitudes, &|_| 0.0)
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        shape.get("x").map(|_| Refinement::relative("x", 0.4)).into_iter().collect()
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        // Where the plant's structure has it, it is among the plant's own parameters.
        if fit.amplitudes.is_empty() {
            return Vec::new();
        }
        let j = fit.place();
        let dry = fit.amplitude(0) + fit.amplitude(2) + fit.amplitude(3);
        let viscous = self.units[1] * j.torque * fit.amplitude(1) / j.motor_speed;
        let mut all = vec![
            LawValue::new("coulombFriction", (self.units[0] * j.torque * dry).max(0.0)),
            LawValue::new("viscousFriction", viscous.max(0.0)),
        ];
        // An arm's dry friction slips.
        all.extend(fit.shape.get("x").map(|x| LawValue::new("preslidingDisplacement", x)));
        all
    }
}
