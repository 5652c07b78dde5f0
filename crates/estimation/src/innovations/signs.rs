//! Rest, sliding, and the sign of dry friction of a coordinate of the nominal plant.

use super::numeric::sign;

/// After the begin what went before is not known, s: a force of the size of the drive may have acted.
const BEFORE: f64 = 0.07;

/// What decides about signs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SignRule {
    /// Speed below which the coordinate is taken to rest, rad/s.
    pub rest: f64,
    /// Level of its dry friction, N.m; 0: it never rests.
    pub level: f64,
    /// Torque at which it breaks away, N.m.
    pub breakaway: f64,
    /// Largest force of the drive, N.m.
    pub drive: f64,
    /// Step, s.
    pub dt: f64,
}

/// Signs by node.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DrySigns {
    /// Where the force is not known at all: events that are misplaced.
    pub misplaced: Vec<bool>,
    /// Sign at each node, 0 at rest.
    pub sign: Vec<f64>,
    /// Its exact mean over the step that follows.
    pub mean: Vec<f64>,
    /// 1 where the coordinate rests over the step that follows.
    pub mode: Vec<u8>,
    /// Variance of an unknown force in the step that follows.
    pub unknown: Vec<f64>,
}

impl DrySigns {
    /// From a speed by node.
    pub fn new(speed: &[f64], misplaced: &[bool], rule: &SignRule) -> Self {
        let n = speed.len();
        let signs: Vec<f64> =
            speed.iter().map(|v| if v.abs() > rule.rest { sign(*v) } else { 0.0 }).collect();
        let (mut mean, mut mode, mut unknown) = (signs.clone(), vec![0; n], vec![0.0; n]);
        let mut edge = vec![false; n];
        let mut crossing = vec![false; n];
        for t in 0..n.saturating_sub(1) {
            let (a, b) = (signs[t], signs[t + 1]);
            let (va, vb) = (speed[t].abs(), speed[t + 1].abs());
            crossing[t] = a * b < 0.0;
            mean[t] = if crossing[t] { (va - vb) / (va + vb + 1e-300) * a } else { 0.5 * (a + b) };
            edge[t] = a != b && !crossing[t];
            mode[t] = u8::from(rule.level > 0.0 && a == 0.0 && b == 0.0 && !misplaced[t]);
        }
        let near = |t: usize| edge[t] || t > 0 && edge[t - 1] || t + 1 < n && edge[t + 1];
        for t in 0..n {
            if rule.level > 0.0 {
                let share = if near(t) {
                    1.0
                } else if crossing[t] {
                    0.25
                } else {
                    0.0
                };
                unknown[t] = share * rule.breakaway * rule.breakaway;
            }
            if misplaced[t] {
                unknown[t] = unknown[t].max((2.0 * rule.level).powi(2));
            }
        }
        let first = ((BEFORE / rule.dt) as usize).min(n);
        unknown[..first].fill(rule.drive * rule.drive);
        Self { misplaced: misplaced.to_vec(), sign: signs, mean, mode, unknown }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crossing_has_the_mean_of_a_line_and_rest_is_a_mode() {
        let speed = [2.0, 1.0, -3.0, -0.01, 0.0, 0.01, 5.0];
        let rule = SignRule { rest: 0.1, level: 2.0, breakaway: 2.0, drive: 9.0, dt: 1.0 };
        let s = DrySigns::new(&speed, &[false; 7], &rule);
        // From 1 to -3 a quarter of the step is forward.
        assert!((s.mean[1] - (0.25 - 0.75)).abs() < 1e-12);
        assert_eq!(s.mode, [0, 0, 0, 1, 1, 0, 0]);
        assert_eq!(s.unknown, [0.0, 4.0, 4.0, 4.0, 4.0, 4.0, 4.0]);
    }
}
