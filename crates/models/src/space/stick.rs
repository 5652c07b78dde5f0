//! Stick-slip of a robot's drives: one that sticks is a constraint, and several may stick at once (ARM-9, in space).

use super::tree::Joints;
use super::{MAX_MODES, MAX_STATES};
use crate::friction::{self, Levels, STUCK};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate};

/// A robot with dry friction in its drives: on the motor of a flexible joint, on a rigid joint itself. The first of its modes are
/// those of friction, one per joint, and the first of its indicators, two per joint.
pub(crate) trait StickSlip {
    /// Number of joints.
    fn joints(&self) -> usize;
    /// Row of the rate that friction brakes at a joint among the states.
    fn rate_row(&self, joint: usize) -> usize;
    /// Friction in the directions +1 and -1.
    fn both_levels<T: Scalar>(&self, at: &At<T>, joint: usize) -> [Levels<T>; 2];
    /// There is dry friction.
    fn dry(&self, p: &[f64], joint: usize) -> bool;
    /// Speed up to which a drive that runs backwards at an event was stepped over ([`friction::overstep`]).
    fn overstep(&self, at: &At<f64>, joint: usize) -> f64;
    /// What friction balances at each joint that sticks, N.m; 0 of the others.
    fn balanced<T: Scalar>(&self, at: &At<T>) -> Joints<T>;
    /// How velocities jump where these drives change theirs by so much at once.
    fn jump(&self, at: At<f64>, drives: &[(usize, f64)], jump: &mut [f64]);

    /// The mode of a drive by its velocity alone, and whether it comes to rest. One that sticks keeps sticking; which breaks away is
    /// decided by [`Self::breakaway`].
    fn by_velocity(&self, at: &At<f64>, joint: usize, mode: i32) -> (i32, bool) {
        let omega = at.x[self.rate_row(joint)];
        let held = Levels { breakaway: f64::INFINITY, ..Levels::default() };
        let (dry, oversteps) = (self.dry(at.p, joint), self.overstep(at, joint));
        friction::next_mode(mode, omega, 0.0, &[held; 2], dry, oversteps)
    }

    /// The sticking drive that exceeds its break-away level most, and the direction in which it will slide. One at a time: the others'
    /// reactions change with it.
    fn breakaway(&self, at: &At<f64>) -> Option<(usize, i32)> {
        if !at.modes[..self.joints()].contains(&STUCK) {
            return None;
        }
        let applied = self.balanced(at);
        let (mut worst, mut most) = (None, 0.0);
        for j in (0..self.joints()).filter(|j| at.modes[*j] == STUCK) {
            // A strained bristle may drive against what is applied: both ways are looked at.
            for (way, level) in [1, -1].into_iter().zip(self.both_levels(at, j)) {
                let excess = applied[j] * f64::from(way) - level.breakaway;
                if excess >= most {
                    (worst, most) = (Some((j, way)), excess);
                }
            }
        }
        worst
    }

    /// Friction's modes that fit the initial state; those of effects are determined already.
    fn start_friction(&self, at: &At<f64>, modes: &mut [i32]) {
        let mut rest = [0; MAX_MODES];
        let rest = &mut rest[..modes.len()];
        for (j, mode) in modes.iter_mut().enumerate().take(self.joints()) {
            let omega = at.x[self.rate_row(j)];
            *mode = friction::moving_mode(omega, self.dry(at.p, j)).unwrap_or(STUCK);
        }
        for _ in 0..self.joints() {
            rest.copy_from_slice(modes);
            let Some((j, way)) = self.breakaway(&At { modes: rest, ..*at }) else { break };
            modes[j] = way;
        }
    }

    /// One pass of event iteration: drives that move come to rest, else one that must breaks away.
    fn update_friction(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> EventUpdate {
        let (mut changed, mut stopped) = (false, false);
        for j in 0..self.joints() {
            let (mode, stops) = self.by_velocity(&At { t, x, u, p, modes }, j, modes[j]);
            changed |= mode != modes[j];
            stopped |= stops;
            modes[j] = mode;
        }
        if stopped {
            self.stop(t, x, u, p, modes);
        }
        if !changed && let Some((j, way)) = self.breakaway(&At { t, x, u, p, modes }) {
            modes[j] = way;
            changed = true;
        }
        EventUpdate { modes: changed, states: stopped }
    }

    /// Brings the sticking drives to rest by an impulse of their friction; it acts on what carries them, too.
    fn stop(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &[i32]) {
        let mut jump = [0.0; MAX_STATES];
        let jump = &mut jump[..x.len()];
        let stuck: Joints<(usize, f64)> =
            (0..self.joints()).filter(|j| modes[*j] == STUCK).map(|j| (j, -x[self.rate_row(j)])).collect();
        self.jump(At { t, x, u, p, modes }, &stuck, jump);
        x.iter_mut().zip(jump.iter()).for_each(|(x, change)| *x += change);
        for (j, _) in stuck {
            x[self.rate_row(j)] = 0.0;
        }
    }

    /// Two per joint.
    fn friction_indicators<T: Scalar>(&self, at: &At<T>, z: &mut [T]) {
        let applied = at.modes[..self.joints()].contains(&STUCK).then(|| self.balanced(at));
        for j in 0..self.joints() {
            let applied = applied.as_ref().map_or(T::zero(), |a| a[j]);
            let levels = self.both_levels(at, j);
            [z[2 * j], z[2 * j + 1]] =
                friction::indicators(at.modes[j], at.x[self.rate_row(j)], applied, &levels);
        }
    }
}
