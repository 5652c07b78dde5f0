//! Conditions between the parameters of a controller, on top of the bounds of each.

use super::{
    ManipulatorController, Strategy,
    adaptation::{Adaptation, KNOTS, parameter as a},
    parameter, waves,
};

/// The index of the parameter and what is wrong with it.
type Complaint = (usize, String);

impl ManipulatorController {
    /// Conditions between parameters, on top of the bounds of each: the index of the parameter and what is
    /// wrong with it.
    pub fn check(&self, p: &[f64]) -> Result<(), Complaint> {
        let n = self.joints;
        let at = parameter::COUNT * n;
        let Some(strategy) = Strategy::from_number(p[at + 1]) else {
            let number = p[at + 1];
            return Err((
                at + 1,
                format!(
                    "strategy is {number}: choose 1 (P_PI), 2 (WBC), 3 (VWBC), 4 (VWBC_WASHOUT), 5 (WBC_ADAPTIVE) or \
                     6 (VWBC_ADAPTIVE)"
                ),
            ));
        };
        if strategy == Strategy::PPi {
            return Ok(());
        }
        for j in 0..n {
            let omega = p[parameter::WAVE_FREQUENCY * n + j];
            let (mut name, mut largest) = ("waveFrequency", omega);
            if strategy.adapts() && p[a::first(n) + a::RATE * n + j] > 0.0 {
                self.check_adaptation(p, j)?;
                (name, largest) = ("waveFrequencyMax", p[a::first(n) + a::MAX * n + j]);
            }
            self.check_period(p, j, name, largest)?;
        }
        Ok(())
    }

    /// The sampled waves at the largest frequency that they may get.
    fn check_period(&self, p: &[f64], j: usize, name: &str, largest: f64) -> Result<(), Complaint> {
        let period = self.period(p);
        if largest * period <= waves::LARGEST_STEP {
            return Ok(());
        }
        let longest = waves::LARGEST_STEP / largest;
        Err((
            parameter::COUNT * self.joints,
            format!(
                "samplePeriod {period} s is too long for the waves of joint {} at {name} {largest} rad/s, whose sampled \
                 filters would be unstable: take at most {longest:.3e} s",
                j + 1
            ),
        ))
    }

    fn check_adaptation(&self, p: &[f64], j: usize) -> Result<(), Complaint> {
        let n = self.joints;
        let index = |i: usize| a::first(n) + i * n + j;
        let joint = j + 1;
        let [kind, min, max] = [a::ADAPTATION, a::MIN, a::MAX].map(|i| p[index(i)]);
        let Some(kind) = Adaptation::from_number(kind) else {
            return Err((
                index(a::ADAPTATION),
                format!("adaptation of joint {joint} is {kind}: choose 1 (schedule) or 2 (estimate)"),
            ));
        };
        if min >= max {
            return Err((
                index(a::MAX),
                format!("waveFrequencyMax of joint {joint} must be above its waveFrequencyMin {min} rad/s"),
            ));
        }
        let omega = p[parameter::WAVE_FREQUENCY * n + j];
        if !(min..=max).contains(&omega) {
            return Err((
                parameter::WAVE_FREQUENCY * n + j,
                format!(
                    "waveFrequency of joint {joint}, where the adaptation starts, is outside of waveFrequencyMin {min} \
                     to waveFrequencyMax {max} rad/s: move it or the bounds"
                ),
            ));
        }
        if kind == Adaptation::Schedule { self.check_schedule(p, j, min, max) } else { Ok(()) }
    }

    fn check_schedule(&self, p: &[f64], j: usize, min: f64, max: f64) -> Result<(), Complaint> {
        let (n, joint) = (self.joints, j + 1);
        let [angles, frequencies] = [a::schedule_angle(n), a::schedule_frequency(n)].map(|i| i + j * KNOTS);
        for k in 0..KNOTS {
            let before = if k > 0 { p[angles + k - 1] } else { f64::NEG_INFINITY };
            if p[angles + k] <= before {
                return Err((
                    angles + k,
                    format!(
                        "scheduleAngle of joint {joint} must ascend: knot {} is not above knot {k}, {before} rad; give all \
                         {KNOTS} knots, those that are not needed beyond the range of the joint",
                        k + 1
                    ),
                ));
            }
            if !(min..=max).contains(&p[frequencies + k]) {
                return Err((
                    frequencies + k,
                    format!(
                        "scheduleFrequency of joint {joint}, knot {}, must be positive and within waveFrequencyMin {min} \
                         to waveFrequencyMax {max} rad/s: move it or the bounds",
                        k + 1
                    ),
                ));
            }
        }
        if n > 1 {
            let (index, of) = (a::schedule_joint(n) + j, p[a::schedule_joint(n) + j]);
            if !(1..=n).any(|k| k as f64 == of) {
                return Err((
                    index,
                    format!("scheduleJoint of joint {joint} must be a joint's number, 1 to {n}"),
                ));
            }
        }
        Ok(())
    }
}
