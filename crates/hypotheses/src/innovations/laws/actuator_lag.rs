//! The drive follows its command late: one first-order lag, two equal ones, or a dead time.

use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// `lag` (one lag), `two` (the sum of two equal ones) or `delay` in s.
pub(super) struct ActuatorLagColumns {
    /// Lags that are looked for, s.
    lags: &'static [f64],
    /// Sums of two equal lags.
    two: &'static [f64],
    /// Dead times.
    delays: &'static [f64],
    /// Dead time beyond which a recording has its own torque until it is over: what was commanded before is not known.
    before: f64,
    /// First steps of the search: of a lag, of a dead time.
    steps: [f64; 2],
}

impl ActuatorLagColumns {
    pub(super) const JOINT: Self = Self {
        lags: &[0.0012, 0.002, 0.0032, 0.005, 0.008, 0.014, 0.02, 0.028, 0.038, 0.05, 0.065, 0.09],
        two: &[],
        delays: &[
            0.0007, 0.0012, 0.002, 0.0032, 0.005, 0.008, 0.012, 0.016, 0.02, 0.026, 0.032, 0.04, 0.05, 0.06,
        ],
        before: f64::INFINITY,
        steps: [0.25, 0.2],
    };
    pub(super) const ARM: Self = Self {
        lags: &[0.006, 0.012, 0.02, 0.035, 0.05, 0.08, 0.13],
        two: &[0.02, 0.04, 0.07, 0.12],
        delays: &[
            0.003, 0.006, 0.01, 0.015, 0.022, 0.03, 0.04, 0.055, 0.075, 0.1, 0.14, 0.2, 0.28, 0.39, 0.52,
        ],
        before: 0.02,
        steps: [0.3, 0.2],
    };
}

/// The usual torque of a joint in one recording until a dead time is over.
fn before(along: &PlantAlong<'_>, recording: usize, joint: usize, delay: f64) -> FilterColumn {
    let part = |k: usize| {
        if k != recording {
            return ColumnPart::default();
        }
        let (r, j) = (&along.runs[k], &along.joints[joint]);
        let within = |t: &f64| j.torque * f64::from(u8::from(*t < delay));
        ColumnPart::force(j.motor, r.means(&r.part_times().iter().map(within).collect::<Vec<_>>()))
    };
    (0..along.runs.len()).map(part).collect()
}

impl EffectLaw for ActuatorLagColumns {
    fn id(&self) -> &'static str {
        "actuator-lag"
    }
    fn spreads(&self) -> bool {
        true
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let forms = [("lag", self.lags), ("two", self.two), ("delay", self.delays)];
        let all = |joints: &Vec<usize>| -> Vec<LawShape> {
            let of = |(form, values): &(&'static str, &[f64])| -> Vec<LawShape> {
                values.iter().map(|x| LawShape::new("actuator", form, &[(form, *x)]).at(joints)).collect()
            };
            forms.iter().flat_map(of).collect()
        };
        along.joint_sets().iter().flat_map(all).collect()
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (value, joints) = (shape.value(shape.form), shape.joints());
        let late = along.of_drives(joints, |drive| match shape.form {
            "lag" => drive.lagged(value, 1),
            "two" => drive.lagged(0.5 * value, 2),
            _ => drive.delayed(value),
        });
        let mut terms = vec![(late, 1.0, 0.15)];
        if shape.form == "delay" && value > self.before {
            for k in 0..along.runs.len() {
                terms.extend(joints.iter().map(|j| (before(along, k, *j, value), 0.0, 1.0)));
            }
        }
        Some(LawTerms::new(terms, &[0]))
    }
    fn refined(&self, shape: &LawShape) -> Vec<Refinement> {
        let step = self.steps[usize::from(shape.form == "delay")];
        vec![Refinement::relative(shape.form, step)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        // Two equal lags: one lag with a dead time, of the same mean delay and the same spread.
        let two = fit.number("two");
        let lag = two * std::f64::consts::FRAC_1_SQRT_2;
        vec![
            LawValue::new("actuatorLag", fit.number("lag") + lag),
            LawValue::new("actuatorDelay", fit.number("delay") + two - lag),
        ]
    }
}
