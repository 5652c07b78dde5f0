//! Channels that must agree.

use crate::finding::{Finding, Kind, Severity};
use crate::names::short;
use crate::recording::Recording;

/// Two channels that go with each other, up to small differences, as the caller knows from the model.
#[derive(Clone, Debug, PartialEq)]
pub enum Relation {
    /// `left` = `factor` * `right` + a constant: `motorAngle` = gearRatio * `loadAngle`.
    Proportional {
        /// A channel.
        left: String,
        /// Another one.
        right: String,
        /// What leads from the right to the left, in SI.
        factor: f64,
    },
    /// `rate` is the time derivative of `of`: `motorVelocity` of `motorAngle`.
    Rate {
        /// A velocity.
        rate: String,
        /// Its position.
        of: String,
    },
}

/// What a wrong factor may come from.
const CAUSES: &[(f64, &str)] = &[
    (180.0 / std::f64::consts::PI, "degrees were taken for radians"),
    (30.0 / std::f64::consts::PI, "rpm were taken for rad/s"),
    (std::f64::consts::TAU, "revolutions were taken for radians"),
    (1000.0, "milli-units were taken for units"),
    (-1.0, "one of them has the opposite sign"),
];

impl Relation {
    /// A finding if the slope between both is off by more than 20 %; none where both are not there or hardly move.
    pub(super) fn check(&self, run: &Recording) -> Option<Finding> {
        let (left, right, factor) = match self {
            Self::Proportional { left, right, factor } => (left, right, *factor),
            Self::Rate { rate, of } => (of, rate, 1.0),
        };
        let (a, b) = (run.channel(left)?, run.channel(right)?);
        let y = &a.values;
        let x = match self {
            Self::Proportional { .. } => b.sample(&a.time),
            // The angle against the integral of its rate: noise averages out.
            Self::Rate { .. } => {
                let rate = b.sample(&a.time);
                let mut sum = 0.0;
                let steps = a.time.windows(2).zip(rate.windows(2));
                std::iter::once(0.0)
                    .chain(steps.map(|(t, v)| {
                        sum += 0.5 * (v[0] + v[1]) * (t[1] - t[0]);
                        sum
                    }))
                    .collect()
            }
        };
        let (slope, correlation) = line(&x, y)?;
        if correlation.abs() < 0.9 {
            return None;
        }
        let off = slope / factor;
        if (off - 1.0).abs() < 0.2 {
            return None;
        }
        let near = |cause: f64| (off / cause - 1.0).abs() < 0.1;
        let swapped =
            matches!(self, Self::Proportional { .. }) && near(1.0 / (factor * factor)) && factor != 1.0;
        // A factor that a unit or a sign makes is an error of the recording; another one may be a wrong parameter.
        let (severity, cause) = match CAUSES.iter().find(|(c, _)| near(*c) || near(1.0 / c)) {
            _ if swapped => (Severity::Grave, "they look swapped".to_owned()),
            Some((_, cause)) => (Severity::Grave, format!("it looks as if {cause}")),
            None => (Severity::Warning, "one of them has another unit, sign or meaning".to_owned()),
        };
        let (kind, what) = match self {
            Self::Proportional { .. } => (
                if swapped { Kind::SwappedChannels } else { Kind::Inconsistent },
                format!(
                    "it moves {} times as far as `{right}`, expected is {}: {cause}",
                    short(slope),
                    short(factor)
                ),
            ),
            Self::Rate { .. } => (
                Kind::Inconsistent,
                format!("it moves {} times as far as the integral of `{right}`: {cause}", short(slope)),
            ),
        };
        let mend = "say the unit or the right name in the sidecar's [columns]";
        let finding = Finding::warning(kind, &run.file, what, mend).channel(left);
        Some(Finding { severity, ..finding })
    }
}

/// Slope of y over x, and their correlation.
fn line(x: &[f64], y: &[f64]) -> Option<(f64, f64)> {
    let n = x.len().min(y.len()) as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mx, my) = (mean(x), mean(y));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y) {
        xx += (a - mx) * (a - mx);
        xy += (a - mx) * (b - my);
        yy += (b - my) * (b - my);
    }
    (n >= 20.0 && xx > 0.0 && yy > 0.0).then(|| (xy / xx, xy / (xx * yy).sqrt()))
}
