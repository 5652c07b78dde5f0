//! Where along one joint the arm, and the floating robot, is singular.

use std::fmt::Write;

use serde_json::{Value, json};
use trueup_models::space::design::{DesignTip, RobotDesign};

use super::{form, singular_values};
use crate::args::JointWay;
use crate::error::CliError;

/// Poses looked at before minima are closed in on.
const POINTS: usize = 400;
/// Halvings of the interval about a minimum.
const HALVINGS: usize = 60;
/// A smallest singular value below this share of the largest is 0.
const ZERO: f64 = 1e-7;

/// Singular poses along one joint.
pub(super) struct SingularPoses {
    sweep: JointWay,
    /// Of J_M and of J_g.
    at: [Vec<f64>; 2],
}

pub(super) fn along(
    design: &RobotDesign,
    tip: &DesignTip,
    q: &[f64],
    sweep: &JointWay,
) -> Result<SingularPoses, CliError> {
    if sweep.joint == 0 || sweep.joint > q.len() {
        let n = q.len();
        return Err(CliError::Usage(format!(
            "--sweep {}: there is no such joint; it is one of 1 to {n}",
            sweep.joint
        )));
    }
    let share = |floating: bool, angle: f64| {
        let mut q = q.to_vec();
        q[sweep.joint - 1] = angle;
        let form = form(design, tip, &q);
        let j = if floating { form.generalized_jacobian().unwrap_or_default() } else { form.j_m };
        let all = singular_values(&j);
        all.last().copied().unwrap_or(f64::NAN) / all.first().copied().unwrap_or(f64::NAN)
    };
    let at = [false, true].map(|floating| zeros(&|angle| share(floating, angle), sweep.from, sweep.to));
    Ok(SingularPoses { sweep: sweep.clone(), at })
}

/// Minima of a function that is never below 0, as far as they are 0.
fn zeros(f: &dyn Fn(f64) -> f64, from: f64, to: f64) -> Vec<f64> {
    let x = |k: usize| from + (to - from) * k as f64 / POINTS as f64;
    let values: Vec<f64> = (0..=POINTS).map(|k| f(x(k))).collect();
    let mut found = Vec::new();
    for k in 0..=POINTS {
        let [before, after] = [k.saturating_sub(1), (k + 1).min(POINTS)];
        if values[k] > values[before] || values[k] > values[after] || (k > 0 && values[k] == values[before]) {
            continue;
        }
        // Golden section.
        let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut a, mut b) = (x(before), x(after));
        for _ in 0..HALVINGS {
            let (c, d) = (b - ratio * (b - a), a + ratio * (b - a));
            if f(c) <= f(d) { b = d } else { a = c }
        }
        let at = 0.5 * (a + b);
        if f(at) < ZERO {
            found.push(at);
        }
    }
    found
}

impl SingularPoses {
    pub(super) fn json(&self) -> Value {
        let JointWay { joint, from, to } = self.sweep;
        json!({"joint": joint, "from": from, "to": to, "J_M": self.at[0], "J_g": self.at[1]})
    }
    pub(super) fn text(&self, design: &RobotDesign) -> String {
        let JointWay { joint, from, to } = self.sweep;
        let list = |v: &[f64]| {
            if v.is_empty() {
                "nowhere".into()
            } else {
                v.iter().map(|x| format!("{x:.6}")).collect::<Vec<_>>().join(", ")
            }
        };
        let name = &design.links[joint - 1].name;
        let mut out = format!("\nsingular along joint {joint} (`{name}`) from {from} to {to}:\n");
        let _ = writeln!(out, "  J_M, base held:     {}", list(&self.at[0]));
        let _ = writeln!(out, "  J_g, base floating: {}", list(&self.at[1]));
        out
    }
}

#[cfg(test)]
mod tests {
    use super::zeros;

    #[test]
    fn zeros_are_found_and_other_minima_are_none() {
        // |x| at 0.3, |sin| at multiples of pi, and a minimum of 0.1 that is none.
        assert!((zeros(&|x: f64| (x - 0.3).abs(), -1.0, 1.0)[0] - 0.3).abs() < 1e-9);
        let sines = zeros(&|x: f64| x.sin().abs(), -4.0, 4.0);
        assert_eq!(sines.len(), 3, "{sines:?}");
        assert!(zeros(&|x: f64| x * x + 0.1, -1.0, 1.0).is_empty());
    }
}
