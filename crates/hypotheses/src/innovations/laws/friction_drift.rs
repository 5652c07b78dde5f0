//! Friction of the nominal plant that changes with time.

use crate::innovations::along::PlantAlong;
use crate::innovations::law::{EffectLaw, LawFit, LawTerms, LawValue, Refinement};
use crate::innovations::shape::LawShape;
use crate::innovations::spectrum::OrderPeaks;

/// Time constant `time` in s; 0: along a line. Of the frame's own dry pair with its viscous friction, or of dry friction alone that
/// slips over `x` rad.
pub(super) struct FrictionDriftColumns {
    /// Times that are looked for, s.
    times: &'static [f64],
    /// Lengths, rad; none: the frame's own dry pair.
    lengths: &'static [f64],
    /// Prior standard deviation of the amplitude.
    deviation: f64,
}

/// Unit of dry friction that slips over a length, in usual torques.
const UNIT: f64 = 0.1;
/// The form that goes on from one recording to the next, as if each began where the one before ended.
const GOES_ON: &str = "goes-on";
/// Longest recordings in which a change along a line is the beginning of one that settles.
const LONG: f64 = 10.0;

/// When each recording ends if each begins where the one before ended, s.
fn ends(along: &PlantAlong<'_>) -> Vec<f64> {
    let lasts = along.runs.iter().map(|r| r.times.last().copied().unwrap_or(0.0));
    lasts
        .scan(0.0, |sum, last| {
            *sum += last;
            Some(*sum)
        })
        .collect()
}

impl FrictionDriftColumns {
    pub(super) const JOINT: Self =
        Self { times: &[0.0, 2.0, 3.5, 6.0, 10.0, 20.0], lengths: &[], deviation: 0.5 };
    pub(super) const ARM: Self = Self { times: &[0.0, 3.0, 8.0], lengths: &[2e-4, 1e-3], deviation: 0.7 };
}

impl EffectLaw for FrictionDriftColumns {
    fn id(&self) -> &'static str {
        "friction-drift"
    }
    fn shapes(&self, along: &PlantAlong<'_>, _: &[OrderPeaks]) -> Vec<LawShape> {
        let timed = |shape: LawShape| {
            let with = move |time: &f64| {
                let mut shape = shape.clone();
                shape.values.insert(0, ("time", *time));
                shape
            };
            self.times.iter().map(with).collect::<Vec<_>>()
        };
        let mut all: Vec<LawShape> =
            along.at_dry_joints("time", self.lengths).into_iter().flat_map(timed).collect();
        if along.runs.len() > 1 {
            let total = ends(along).last().copied().unwrap_or(0.0);
            let on = along.at_dry_joints(GOES_ON, self.lengths).into_iter();
            all.extend(on.flat_map(|shape| {
                [0.0, 0.5 * total].map(|time| {
                    let mut shape = shape.clone();
                    shape.values.insert(0, ("time", time));
                    shape
                })
            }));
        }
        all
    }
    fn terms(&self, along: &PlantAlong<'_>, shape: &LawShape) -> Option<LawTerms> {
        let (j, length) = (&along.joints[shape.joint()], shape.get("x"));
        let (time, ends) = (shape.value("time"), ends(along));
        let goes_on = shape.form == GOES_ON;
        let duration = if goes_on { ends.last().copied().unwrap_or(0.0) } else { along.duration };
        let before = |run: usize| if goes_on && run > 0 { ends[run - 1] } else { 0.0 };
        let course = |t: f64| if time > 0.0 { (-t / time).exp() } else { t / duration - 0.5 };
        let (dry, viscous) = if length.is_some() { (UNIT * j.torque, 0.0) } else { (j.dry, j.viscous) };
        // (COL-7)
        let column = along.on_motor_by_run(shape.joint(), |run, m| {
            let (z, begun) = (m.sliding(length), before(run));
            m.each(|i| -(dry * z[i] + viscous * m.motor_speed[i]) * course(begun + m.time[i]))
        });
        Some(LawTerms::new(vec![(column, 0.0, self.deviation)], &[]))
    }
    fn refined(&self, _: &LawShape) -> Vec<Refinement> {
        vec![Refinement::relative("time", 0.3)]
    }
    fn values(&self, fit: &LawFit<'_>) -> Vec<LawValue> {
        let (j, time) = (fit.place(), fit.number("time"));
        // Of the friction of the nominal model.
        let share =
            if fit.shape.get("x").is_some() { UNIT * j.torque / j.dry.max(f64::MIN_POSITIVE) } else { 1.0 };
        let a = share * fit.amplitude(0);
        let ends = if fit.shape.form == GOES_ON { ends(fit.along) } else { Vec::new() };
        let duration = ends.last().copied().unwrap_or(fit.along.duration);
        // 1 + a exp(-t/T) = (1 + a) (1 - a / (1 + a) (1 - exp(-t/T))); along a line it begins at 1 - a/2.
        let settles = time > 0.0;
        let begins = if settles { 1.0 + a } else { 1.0 - 0.5 * a }.max(0.1);
        let rate = if settles { -a / (begins * time) } else { a / (begins * duration) };
        let begun = std::iter::once(0.0).chain(ends.iter().copied()).zip(0..ends.len());
        let begun = begun.map(|(t, run)| LawValue {
            recording: Some(run),
            ..LawValue::new("initialFrictionDriftTime", t)
        });
        let all = [
            LawValue::new("frictionDriftRate", rate),
            LawValue::new("frictionDriftTime", if settles { time } else { LONG * duration }),
            LawValue::new("coulombFriction", begins * j.dry),
            LawValue::new("viscousFriction", begins * j.viscous),
        ];
        all.into_iter().chain(begun).collect()
    }
}
