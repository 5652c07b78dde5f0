//! Friction that falls with speed out of rest.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{DryFriction, EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::laws::motor_friction::MotorFrictionColumns;
use crate::innovations::shape::LawShape;
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;

/// Speed `speed` in rad/s over which it falls, with exponent `k`; where the nominal model has no friction with that friction, which
/// slips over `x` rad.
pub(super) struct StribeckFrictionColumns {
    /// Friction of the same units and lengths.
    plain: MotorFrictionColumns,
    /// Prior mean of the amplitude.
    mean: f64,
    /// Speeds that are looked for, in usual speeds.
    speeds: &'static [f64],
    /// Exponents.
    exponents: &'static [f64],
    /// Lengths, rad; none: in addition to the friction of the nominal model.
    lengths: &'static [f64],
    /// First step of the search for the speed.
    step: f64,
}

impl StribeckFrictionColumns {
    pub(super) const JOINT: Self = Self {
        plain: MotorFrictionColumns::JOINT,
        mean: 0.5,
        speeds: &[0.01, 0.02, 0.035, 0.05, 0.075, 0.12, 0.2],
        exponents: &[1.0, 2.0],
        lengths: &[],
        step: 0.35,
    };
    pub(super) const ARM: Self = Self {
        plain: MotorFrictionColumns::ARM,
        mean: 0.4,
        speeds: &[0.06, 0.15, 0.35],
        exponents: &[1.0],
        lengths: &[3e-4, 1.2e-3],
        step: 0.4,
    };
}

/// Length over which it slips, rad, in addition to the friction of the nominal model.
pub const SLIP: &str = "slip";

/// A shape of it in addition to the friction of the nominal model.
pub fn stribeck(speed: f64, k: f64) -> LawShape {
    LawShape::new("motor-friction", "stribeck", &[("speed", speed), ("k", k)])
}

/// How friction falls with the speed of a joint's motor: at several joints over the same share of the usual speed.
fn falls(along: &PlantAlong<'_>, shape: &LawShape, joint: usize) -> impl Fn(f64) -> f64 {
    let share = along.joints[joint].motor_speed / along.joints[shape.joint()].motor_speed;
    let (speed, k) = (shape.value("speed") * share, shape.value("k"));
    move |v| (-(v.abs() / speed).powf(k)).exp()
}

impl EffectLaw for StribeckFrictionColumns {
    fn id(&self) -> &'static str {
        "stribeck-friction"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn companions(&self) -> (usize, &'static [usize]) {
        (5, &[2, 3])
    }
    fn dry_friction(&self) -> Option<DryFriction> {
        Some(DryFriction::Falling)
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for (joint_index, joint) in along.joints.iter().enumerate() {
            let usual = joint.motor_speed;
            let speeds = self.speeds.iter().flat_map(|v| self.exponents.iter().map(move |k| (v * usual, *k)));
            for shape in speeds.map(|(v, k)| stribeck(v, k).at(&[joint_index])) {
                // Where the nominal model has friction this is in addition to it.
                let name = if joint.dry > 0.0 { SLIP } else { "x" };
                let with = |x: &f64| {
                    let mut shape = shape.clone();
                    shape.values.push((name, *x));
                    shape
                };
                match self.lengths {
                    [] if joint.dry > 0.0 => all.push(shape),
                    lengths => all.extend(lengths.iter().map(with)),
                }
            }
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let length = shape.get("x");
        let (mut terms, mut positive) = (Vec::new(), Vec::new());
        for joint in shape.joints() {
            if length.is_some() {
                positive.push(terms.len());
                terms.extend(self.plain.at(along, *joint, length));
            }
            positive.push(terms.len());
            let falls = falls(along, shape, *joint);
            // (COL-6)
            let slips = length.or_else(|| shape.get(SLIP));
            let column = self.plain.dry(along, *joint, slips, |m, i| falls(m.motor_speed[i]));
            terms.push((column, self.mean, 0.7));
        }
        Some(LawTerms::new(terms, &positive))
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        let length = shape.get("x")?;
        let mut all: LawSlopes = vec![Vec::new(); along.runs.len()];
        let each = amplitudes.len() / shape.joints().len();
        for (joint, own) in shape.joints().iter().zip(amplitudes.chunks_exact(each.max(1))) {
            let (falls, level) = (falls(along, shape, *joint), own.last()?);
            let slopes = self.plain.slopes_at(along, *joint, length, own, &|v| level * falls(v))?;
            all.iter_mut().zip(slopes).for_each(|(all, more)| all.extend(more));
        }
        Some(all)
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        let length = ["x", SLIP].into_iter().find(|name| shape.get(name).is_some());
        let length = length.map(|name| Refinement::relative(name, self.step));
        length.into_iter().chain([Refinement::relative("speed", self.step)]).collect()
    }
    fn cause(&self, shape: &LawShape) -> &'static str {
        // A plant without friction lacks friction, however it falls with speed.
        if shape.get("x").is_some() { self.plain.id() } else { self.id() }
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        if fit.shape.get("x").is_some() {
            return self.plain.values(fit);
        }
        vec![
            LawValue::new("staticFriction", fit.amplitude(0) * self.plain.level(fit.place())),
            LawValue::new("stribeckVelocity", fit.number("speed")),
        ]
    }
}
