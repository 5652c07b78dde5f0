//! Friction of the load.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::operator::{balancing, dahl};
use crate::innovations::shape::{LawShape, geometric};
use crate::innovations::slope::LawSlopes;
use crate::innovations::spectrum::OrderPeaks;
use crate::innovations::tangent::{SlidingLevel, of_friction};

/// Form `level` (level `a` in usual torques, which balances the spring below the speed `v`), form `length` (slips over `x` rad),
/// or form `speed` (grows over `v` rad/s).
pub(super) struct LoadFrictionColumns {
    /// Unit of the dry and of the viscous amplitudes of form `length`, in usual torques (viscous: at the usual speed).
    units: [f64; 2],
    /// Their prior means and standard deviations.
    priors: [[f64; 2]; 2],
    /// Length of the companion of form `length` in lengths of the law, and its prior standard deviation.
    longer: [f64; 2],
    /// First step of the search for the length.
    step: f64,
    lengths: LoadFrictionLengths,
}

/// Lengths that are looked for.
enum LoadFrictionLengths {
    /// From, to, and how many in even ratios, in ranges of the motor; in addition to the other two forms.
    OfRange(f64, f64, usize),
    /// rad, at joints with a spring.
    Angles([f64; 4]),
}

impl LoadFrictionColumns {
    pub(super) const JOINT: Self = Self {
        units: [1.0, 1.0],
        priors: [[0.1, 0.5], [0.03, 0.1]],
        longer: [4.0, 0.2],
        step: 0.35,
        lengths: LoadFrictionLengths::OfRange(0.002, 0.3, 6),
    };
    pub(super) const ARM: Self = Self {
        units: [0.1, 0.3],
        priors: [[0.3, 0.7], [0.1, 0.7]],
        longer: [6.0, 0.3],
        step: 0.4,
        lengths: LoadFrictionLengths::Angles([3e-4, 1e-3, 3e-3, 1e-2]),
    };
}

impl EffectLaw for LoadFrictionColumns {
    fn id(&self) -> &'static str {
        "load-friction"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn companions(&self) -> (usize, &'static [usize]) {
        (3, &[2])
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let mut all = Vec::new();
        for (k, j) in along.joints.iter().enumerate() {
            let length = |x: f64| LawShape::new("load", "length", &[("x", x)]).at(&[k]);
            match &self.lengths {
                LoadFrictionLengths::Angles(lengths) if j.stiffness > 0.0 => {
                    all.extend(lengths.iter().map(|x| length(*x)));
                }
                LoadFrictionLengths::Angles(_) => {}
                LoadFrictionLengths::OfRange(least, most, count) => {
                    let speed = |x| LawShape::new("load", "speed", &[("v", x * j.link_speed)]).at(&[k]);
                    all.extend([0.01, 0.04].map(speed));
                    all.extend(geometric((*least, *most, *count)).map(|x| length(x * j.range)));
                    for v in [0.004, 0.02].into_iter().filter(|_| j.stiffness > 0.0) {
                        let level = |a| LawShape::new("load", "level", &[("v", v * j.link_speed), ("a", a)]);
                        all.extend([0.03, 0.1, 0.3, 0.45, 0.65, 0.9, 1.25].map(|a| level(a).at(&[k])));
                    }
                }
            }
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (joint, v) = (shape.joint(), shape.value("v"));
        let j = &along.joints[joint];
        let viscous = |unit: f64| {
            along.on_link(joint, |m| m.each(|i| -unit * j.torque * m.link_speed[i] / j.link_speed))
        };
        let terms = if let Some(a) = shape.get("a") {
            let dry = along
                .on_link(joint, |m| m.each(|i| balancing(m.link_speed[i], m.torque[i], a * j.torque, v)));
            vec![(dry, 1.0, 0.15), (viscous(1.0), 0.05, 0.1)]
        } else if let Some(x) = shape.get("x") {
            let unit = self.units[0] * j.torque;
            // (COL-13)
            let slips =
                |x: f64| along.on_link(joint, |m| dahl(&m.link, x).iter().map(|z| -unit * z).collect());
            let [dry, slow] = self.priors;
            vec![
                (slips(x), dry[0], dry[1]),
                (viscous(self.units[1]), slow[0], slow[1]),
                (slips(self.longer[0] * x), 0.0, self.longer[1]),
            ]
        } else {
            let dry = along.on_link(joint, |m| m.each(|i| -j.torque * (m.link_speed[i] / v).tanh()));
            vec![(dry, 0.3, 0.5), (viscous(1.0), 0.03, 0.1)]
        };
        Some(LawTerms::new(terms, &[0]))
    }
    fn slopes(&self, along: &PlantAlong<'_>, shape: &LawShape, amplitudes: &[f64]) -> Option<LawSlopes> {
        let (joint, x) = (shape.joint(), shape.get("x")?);
        let j = &along.joints[joint];
        let [dry, viscous, longer] = *amplitudes else { return None };
        let unit = self.units[0] * j.torque;
        let (short, long) = (|_: f64| unit * dry, |_: f64| unit * longer);
        let levels = [
            SlidingLevel { length: x, level: &short },
            SlidingLevel { length: self.longer[0] * x, level: &long },
        ];
        let viscous = self.units[1] * j.torque * viscous / j.link_speed;
        Some(of_friction(along, joint, true, &levels, viscous))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        match shape.form {
            "level" => vec![Refinement::relative("a", 0.3)],
            "length" => vec![Refinement::relative("x", self.step)],
            _ => Vec::new(),
        }
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (j, a) = (fit.place(), |k: usize| fit.amplitude(k));
        let (torque, n) = (j.torque, j.turns);
        let length = fit.shape.get("x");
        let [dry, slow] = if length.is_some() { self.units } else { [1.0; 2] };
        let level = fit.shape.get("a").map_or(dry * (a(0) + a(2)), |level| a(0) * level);
        let mut all = vec![
            LawValue::new("loadFriction", (level * torque * n).max(0.0)),
            LawValue::new("loadViscousFriction", (slow * a(1) * torque * n * n / j.link_speed).max(0.0)),
        ];
        all.extend(length.map(|x| LawValue::new("loadFrictionDisplacement", x / n)));
        all
    }
}
