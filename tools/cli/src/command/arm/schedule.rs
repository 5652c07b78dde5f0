//! A schedule of the wave frequency for `ManipulatorController`, from a map.

use std::fmt::Write;

use trueup_models::controller::adaptation::KNOTS;
use trueup_report::number;

use super::asked::ArmRequest;
use super::found::ArmMapResult;
use crate::error::CliError;

/// The value of `--schedule`.
#[derive(Clone, Copy)]
pub(super) struct ScheduleRequest {
    /// K_p of all joints, 1/s.
    gain: f64,
    /// Of the frequency at which the arm would run away.
    share: f64,
    /// Largest wave frequency, rad/s.
    most: f64,
}

const SHARE: f64 = 0.15;
const MOST: f64 = 200.0;

impl ScheduleRequest {
    pub(super) fn of(asked: &ArmRequest<'_>) -> Result<Option<Self>, CliError> {
        let wanted = match asked.args.schedule.as_deref() {
            None => return Ok(None),
            Some(&[gain]) => Self { gain, share: SHARE, most: MOST },
            Some(&[gain, share]) => Self { gain, share, most: MOST },
            Some(&[gain, share, most]) => Self { gain, share, most },
            Some(list) => {
                return Err(CliError::Usage(format!(
                    "--schedule has {} numbers: give K_p in 1/s, a share, the largest wave frequency in rad/s, as in --schedule 2,0.15,200",
                    list.len()
                )));
            }
        };
        let Self { gain, share, most } = wanted;
        let positive = |v: f64| v.is_finite() && v > 0.0;
        if positive(gain) && positive(share) && share <= 1.0 && positive(most) {
            return Ok(Some(wanted));
        }
        Err(CliError::Usage(
            "--schedule: give K_p above 0, a share above 0 and up to 1, a largest wave frequency above 0, as in --schedule 2,0.15,200"
                .into(),
        ))
    }

    /// Angles and frequencies of the knots over one of the map's joints (0 or 1). Each knot has the least of all poses up to its
    /// neighbours, so that lines between them stay below it.
    fn knots(&self, found: &ArmMapResult, which: usize) -> [[f64; KNOTS]; 2] {
        let along = &found.grid.at[which];
        let first = along.first().copied().unwrap_or(0.0);
        let step = (along.last().copied().unwrap_or(1.0) - first) / (KNOTS - 1) as f64;
        let angles: [f64; KNOTS] = core::array::from_fn(|k| first + step * k as f64);
        let least = |near: &dyn Fn(f64) -> bool| {
            let poses = found.poses.iter().filter(|p| near(found.place(p)[which]));
            let of = |droop: f64| if droop > 0.0 { self.share * self.gain / droop } else { self.most };
            poses.map(|p| of(p.droop)).reduce(f64::min).map(|omega| rounded(omega.min(self.most)))
        };
        let everywhere = least(&|_| true).unwrap_or(self.most);
        let frequencies =
            angles.map(|angle| least(&|q| (q - angle).abs() <= step * (1.0 + 1e-9)).unwrap_or(everywhere));
        [angles, frequencies]
    }

    /// Start values of a `ManipulatorController`, as TOML.
    pub(super) fn toml(&self, asked: &ArmRequest<'_>, found: &ArmMapResult) -> String {
        let tables = [0, 1].map(|which| self.knots(found, which));
        let sum = |which: usize| tables[which][1].iter().sum::<f64>();
        // Over the joint that leaves more.
        let which = usize::from(sum(1) >= sum(0));
        let ([angles, frequencies], joint) = (tables[which], found.grid.joints[which] + 1);
        let least = frequencies.iter().copied().fold(self.most, f64::min);
        let n = asked.design.links.len();
        let all = |one: &str| format!("[{}]", vec![one; n].join(", "));
        let row =
            |v: &[f64]| format!("[{}]", v.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", "));
        let [a, b] = found.grid.joints.map(|j| j + 1);
        let mut out = format!(
            "# Velocity waves of {}, {}: omega_n over the angle of joint {joint}, {} of what lets the arm run away with K_p = {} 1/s at the\n# worst angle of the other one (joints {a} and {b} as mapped). Start values of a ManipulatorController of {n} joints; what they are\n# worth: docs/flexible-arm-control.md.\n",
            asked.design.name,
            asked.loads(),
            number(self.share),
            number(self.gain)
        );
        for (name, value) in [
            ("strategy", "\"VWBC_ADAPTIVE\"".to_owned()),
            ("positionGain", all(&format!("{:?}", self.gain))),
            ("adaptation", all("\"schedule\"")),
            ("adaptationRate", all("2.0")),
            ("waveFrequency", all(&format!("{least:?}"))),
            ("waveFrequencyMin", all(&format!("{:?}", 0.5 * least))),
            ("waveFrequencyMax", all(&format!("{:?}", self.most))),
            ("scheduleJoint", all(&joint.to_string())),
            ("scheduleAngle", all(&row(&angles))),
            ("scheduleFrequency", all(&row(&frequencies))),
        ] {
            let _ = writeln!(out, "{name} = {value}");
        }
        out
    }
}

/// Down to a thousandth of a rad/s, where that is little.
fn rounded(omega: f64) -> f64 {
    if omega > 1.0 { (1e3 * omega).floor() / 1e3 } else { omega }
}
