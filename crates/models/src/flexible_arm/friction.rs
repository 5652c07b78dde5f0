//! Stick-slip of the arm's motors: one that sticks is a constraint, and several may stick at once (ARM-9, in space).

use super::MAX_JOINTS;
use super::model::{FlexibleArm, MAX_STATES};
use crate::friction::{self, Levels, STUCK};
use trueup_numerics::Scalar;
use trueup_numerics::hybrid::{At, EventUpdate};

impl FlexibleArm {
    fn dry(&self, p: &[f64], joint: usize) -> bool {
        let at = &self.parameter;
        p[at.coulomb_friction + joint] > 0.0 || p[at.static_friction + joint] > 0.0
    }

    /// The mode of a motor by its velocity alone, and whether it comes to rest. One that sticks keeps sticking; which breaks
    /// away is decided by [`Self::breakaway`].
    fn by_velocity(&self, at: &At<f64>, joint: usize, mode: i32) -> (i32, bool) {
        let omega = at.x[self.rate_row(joint)];
        let level = self.levels(at, joint, 1.0).breakaway;
        let inertia = at.p[self.body_parameter.motor_inertia + joint];
        let torque = self.bodies.transmission_torque(at, joint);
        let oversteps = friction::overstep(level + torque.abs(), inertia);
        let held = Levels { breakaway: f64::INFINITY, ..Levels::default() };
        friction::next_mode(mode, omega, 0.0, &[held; 2], self.dry(at.p, joint), oversteps)
    }

    /// The sticking motor that exceeds its break-away level most, and the direction in which it will slide. One at a time: the
    /// others' reactions change with it.
    fn breakaway(&self, at: &At<f64>) -> Option<(usize, i32)> {
        if !at.modes.contains(&STUCK) {
            return None;
        }
        let mut dx = [0.0; MAX_STATES];
        let applied = self.rates_and_held(at, &mut dx[..at.x.len()]);
        let (mut worst, mut most) = (None, 0.0);
        for j in (0..self.joints()).filter(|j| at.modes[*j] == STUCK) {
            let excess = applied[j].abs() - self.levels(at, j, 1.0).breakaway;
            if excess >= most {
                (worst, most) = (Some((j, if applied[j] < 0.0 { -1 } else { 1 })), excess);
            }
        }
        worst
    }

    /// Modes that fit the initial state.
    pub(super) fn start_friction(&self, at: &At<f64>, modes: &mut [i32]) {
        for (j, mode) in modes.iter_mut().enumerate() {
            let omega = at.x[self.rate_row(j)];
            *mode = friction::moving_mode(omega, self.dry(at.p, j)).unwrap_or(STUCK);
        }
        let mut rest = [0; MAX_JOINTS];
        let rest = &mut rest[..modes.len()];
        for _ in 0..self.joints() {
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

    /// Brings the sticking motors to rest by an impulse of their friction; it acts on what they carry through their gears.
    fn stop(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &[i32]) {
        let mut jump = [0.0; MAX_STATES];
        let jump = &mut jump[..x.len()];
        let stuck: arrayvec::ArrayVec<(usize, f64), MAX_JOINTS> =
            (0..self.joints()).filter(|j| modes[*j] == STUCK).map(|j| (j, -x[self.rate_row(j)])).collect();
        self.bodies.impulse(At { t, x, u, p, modes }, &stuck, jump);
        x.iter_mut().zip(jump.iter()).for_each(|(x, change)| *x += change);
        for (j, _) in stuck {
            x[self.rate_row(j)] = 0.0;
        }
    }

    /// Two per joint.
    pub(super) fn friction_indicators<T: Scalar>(&self, at: &At<T>, z: &mut [T]) {
        let mut dx = [T::zero(); MAX_STATES];
        let stuck = at.modes.contains(&STUCK);
        let applied = stuck.then(|| self.rates_and_held(at, &mut dx[..at.x.len()]));
        for j in 0..self.joints() {
            let levels = [self.levels(at, j, 1.0), self.levels(at, j, -1.0)];
            let applied = applied.as_ref().map_or(T::zero(), |a| a[j]);
            [z[2 * j], z[2 * j + 1]] =
                friction::indicators(at.modes[j], at.x[self.rate_row(j)], applied, &levels);
        }
    }
}
