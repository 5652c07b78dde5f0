//! Stick-slip of several motors at once: a sticking motor is a constraint (ARM-9).

use super::layout::parameter;
use super::model::PlanarManipulator;
use super::motion::ArmMotion;
use super::{MAX_DOFS, MAX_LINKS, MAX_MODES};
use crate::friction::{self, Levels, STUCK};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate};

impl PlanarManipulator {
    fn dry(&self, p: &[f64], joint: usize) -> bool {
        let n = self.links();
        p[parameter::coulomb_friction(n) + joint] > 0.0
            || p[parameter::static_friction(n) + joint] > 0.0
            || self.effects().dry(p, joint)
    }

    /// The mode of each motor by its velocity alone, and whether it comes to rest. A sticking motor keeps
    /// sticking; which one breaks away is decided by [`Self::breakaway`].
    fn by_velocity(&self, at: &At<f64>, joint: usize, mode: i32) -> (i32, bool) {
        let omega = at.x[self.dofs() + self.motor(joint)];
        let motion = self.motion(at);
        let d = &motion.drives[joint];
        let (row, level) = (self.motor(joint), self.levels(at, joint, d, 1.0).breakaway);
        let inertia = self.mass(at.p, &motion).at(row, row);
        let oversteps = friction::overstep(level + d.command.abs(), inertia);
        let held = Levels { breakaway: f64::INFINITY, ..Levels::default() };
        friction::next_mode(mode, omega, 0.0, &[held; 2], self.dry(at.p, joint), oversteps)
    }

    /// The sticking motor that exceeds its break-away level most, and the direction in which it will slide.
    /// One at a time: the others' reactions change with it.
    fn breakaway(&self, at: &At<f64>) -> Option<(usize, i32)> {
        let stuck = |j: &usize| at.modes[*j] == STUCK;
        if !(0..self.links()).any(|j| stuck(&j)) {
            return None;
        }
        let motion = self.motion(at);
        let applied = self.balance(at, &motion).applied;
        let mut worst = None;
        let mut most = 0.0;
        for j in (0..self.links()).filter(stuck) {
            // A strained bristle may drive against what is applied: both ways are looked at.
            for way in [1, -1] {
                let level = self.levels(at, j, &motion.drives[j], f64::from(way)).breakaway;
                let excess = applied[j] * f64::from(way) - level;
                if excess >= most {
                    (worst, most) = (Some((j, way)), excess);
                }
            }
        }
        worst
    }

    /// Friction modes that fit the initial state, into `modes` (whose effects' part is determined already).
    pub(super) fn start_friction(&self, at: &At<f64>, modes: &mut [i32]) {
        let mut rest = [0; MAX_MODES];
        let rest = &mut rest[..modes.len()];
        for j in 0..self.links() {
            let omega = at.x[self.dofs() + self.motor(j)];
            modes[j] = friction::moving_mode(omega, self.dry(at.p, j)).unwrap_or(STUCK);
        }
        for _ in 0..self.links() {
            rest.copy_from_slice(modes);
            let Some((j, way)) = self.breakaway(&At { modes: rest, ..*at }) else { break };
            modes[j] = way;
        }
    }

    /// One pass of event iteration: motors that turn come to rest, else one that must breaks away.
    pub(super) fn update_friction(
        &self,
        t: f64,
        x: &mut [f64],
        u: &[f64],
        p: &[f64],
        modes: &mut [i32],
    ) -> EventUpdate {
        let (mut changed, mut stopped) = (false, false);
        for j in 0..self.links() {
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

    /// Brings the sticking motors to rest by an impulse of their friction: momenta stay as they are.
    fn stop(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &[i32]) {
        let mut rows = [0; MAX_DOFS];
        let count = self.free(modes, &mut rows);
        let free = &rows[..count];
        let mut change = [0.0; MAX_DOFS];
        {
            let at = At { t, x, u, p, modes };
            let motion = self.motion(&at);
            let mass = self.mass(p, &motion);
            for j in (0..self.links()).filter(|j| modes[*j] == STUCK) {
                change[self.motor(j)] = -motion.v[self.motor(j)];
            }
            let given = change;
            for row in free {
                change[*row] = -mass.row_times(*row, &given[..self.dofs()]);
            }
            // Not positive definite: the states become NaN, which the caller refuses.
            let _ = mass.solve(free, &mut change);
        }
        for (v, change) in x[self.dofs()..].iter_mut().zip(&change[..self.dofs()]) {
            *v += change;
        }
    }

    /// The indicators of friction, two per joint.
    pub(super) fn friction_indicators<T: Scalar>(&self, at: &At<T>, motion: &ArmMotion<T>, z: &mut [T]) {
        let applied = if at.modes[..self.links()].contains(&STUCK) {
            self.balance(at, motion).applied
        } else {
            [T::zero(); MAX_LINKS]
        };
        for j in 0..self.links() {
            let d = &motion.drives[j];
            let levels = [self.levels(at, j, d, 1.0), self.levels(at, j, d, -1.0)];
            [z[2 * j], z[2 * j + 1]] = friction::indicators(at.modes[j], d.omega, applied[j], &levels);
        }
    }
}
