//! Dry friction with a static level: true stick-slip by modes, no smoothed sign (S3 eq. 3 and 4).
//!
//! | mode | meaning | event |
//! |---|---|---|
//! | +1, -1 | slides in that direction | the velocity turns |
//! | 0 | sticks; friction balances what is applied | the applied torque exceeds the break-away level |
//! | 2 | no dry friction at all | none |
//!
//! What it gets wrong: nothing moves before break-away (no pre-sliding), and the level does not depend on
//! how long the joint has rested.

use trueup_numerics::Scalar;

/// Sticks.
pub const STUCK: i32 = 0;
/// Without dry friction.
pub const SMOOTH: i32 = 2;

/// A sliding motor is taken to have turned when it runs backwards by this much, rad/s: far below anything
/// that can be measured, yet enough that a motor that has just broken away does not count as turning.
/// The event comes late by this over the deceleration, 1e-9 s and less on DELIAN's joints.
pub const TURNED: f64 = 1e-11;

/// Magnitudes of the friction torque in one direction of motion, N.m; below 0 it drives (a strained bristle).
#[derive(Clone, Copy, Debug, Default)]
pub struct Levels<T> {
    /// Up to this much the joint holds.
    pub breakaway: T,
    /// The dry part of the sliding level far from rest.
    pub coulomb: T,
    /// The dry part of what brakes while it slides, at this speed.
    pub sliding: T,
    /// What brakes because it moves: 0 at rest.
    pub viscous: T,
    /// The plant's own Coulomb level: what bristles are strained by.
    pub nominal: T,
    /// The dry level that bristles settle at (see `presliding-friction`).
    pub bristles: T,
}

impl<T: Scalar> Levels<T> {
    /// This much it brakes while it slides.
    pub fn braking(&self) -> T {
        self.sliding + self.viscous
    }
}

/// The friction of the paper: break-away at tau_s, sliding at tau_c + D_m |omega| (S3 eq. 3, 4).
/// Break-away is never below the Coulomb level.
pub fn paper<T: Scalar>(tau_c: T, tau_s: T, d_m: T, speed: T) -> Levels<T> {
    Levels {
        breakaway: tau_s.max(tau_c),
        coulomb: tau_c,
        sliding: tau_c,
        viscous: d_m * speed,
        nominal: tau_c,
        bristles: T::zero(),
    }
}

/// The direction in which a mode evaluates its levels; `SMOOTH` follows the velocity.
pub fn direction<T: Scalar>(mode: i32, omega: T) -> f64 {
    match mode {
        SMOOTH => {
            if omega.value() < 0.0 {
                -1.0
            } else {
                1.0
            }
        }
        m => f64::from(m),
    }
}

/// Two indicators: positive while the mode may go on. `applied` is the torque that friction has to balance
/// for the joint to stick; `levels[0]` for the positive direction, `levels[1]` for the negative one.
pub fn indicators<T: Scalar>(mode: i32, omega: T, applied: T, levels: &[Levels<T>; 2]) -> [T; 2] {
    moving_indicators(mode, omega).unwrap_or_else(|| holding_indicators(applied, levels))
}

/// The same where the velocity alone determines them; `None`: it sticks.
pub fn moving_indicators<T: Scalar>(mode: i32, omega: T) -> Option<[T; 2]> {
    match mode {
        STUCK => None,
        SMOOTH => Some([T::one(), T::one()]),
        d => Some([omega * f64::from(d) + TURNED, T::one()]),
    }
}

/// The same of what sticks.
pub fn holding_indicators<T: Scalar>(applied: T, levels: &[Levels<T>; 2]) -> [T; 2] {
    [levels[0].breakaway - applied, levels[1].breakaway + applied]
}

/// An importer that steps over the event may find the motor running backwards by what friction and load do to
/// it in this time, s.
const OVERSTEP: f64 = 2e-3;

/// Speed in rad/s up to which a motor that runs backwards at an event is held to have been stepped over; one that
/// runs faster was given its velocity and is not brought to rest. Torque in N.m, inertia in kg.m2.
pub fn overstep(torque: f64, inertia: f64) -> f64 {
    OVERSTEP * torque.abs() / inertia + TURNED
}

/// The mode that follows at an event.
///
/// `dry`: whether there is any dry friction; `oversteps`: see [`overstep`]. Returns the new mode and whether the
/// velocity is to be set to 0.
pub fn next_mode(
    mode: i32,
    omega: f64,
    applied: f64,
    levels: &[Levels<f64>; 2],
    dry: bool,
    oversteps: f64,
) -> (i32, bool) {
    if let Some(next) = mode_by_velocity(mode, omega, dry) {
        return (next, false);
    }
    match mode {
        STUCK | SMOOTH => (from_rest(applied, levels), false),
        // It has just broken away or is about to stop: another input may hold it already, and what holds does not slide.
        d if omega * f64::from(d) + TURNED > 0.0 && !holds(d, applied, levels) => (d, false),
        _ if omega.abs() > oversteps => (along(omega), false),
        _ => (from_rest(applied, levels), true),
    }
}

/// The mode that follows at an event where velocity and mode determine it; `None`: the torque decides. Nothing is brought to rest.
pub fn mode_by_velocity(mode: i32, omega: f64, dry: bool) -> Option<i32> {
    match mode {
        _ if !dry => Some(SMOOTH),
        STUCK | SMOOTH => moving_mode(omega, dry),
        d => (omega * f64::from(d) > TURNED).then_some(d),
    }
}

/// The mode where the velocity alone determines it; `None`: at rest with dry friction.
pub fn moving_mode(omega: f64, dry: bool) -> Option<i32> {
    if !dry {
        return Some(SMOOTH);
    }
    (omega.abs() > TURNED).then(|| along(omega))
}

/// The mode that follows at rest with dry friction. Exactly at the level counts as beyond, as it does for the indicator:
/// the event may be located there.
pub fn from_rest(applied: f64, levels: &[Levels<f64>; 2]) -> i32 {
    if applied >= levels[0].breakaway {
        1
    } else if applied <= -levels[1].breakaway {
        -1
    } else {
        STUCK
    }
}

/// A motor at rest in this direction of sliding would neither slide on nor break away again.
fn holds(d: i32, applied: f64, levels: &[Levels<f64>; 2]) -> bool {
    let level = &levels[usize::from(d < 0)];
    applied * f64::from(d) < level.braking().min(level.breakaway)
}

/// The mode of this velocity.
fn along(omega: f64) -> i32 {
    if omega < 0.0 { -1 } else { 1 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEVELS: [Levels<f64>; 2] =
        [Levels { breakaway: 3.0, coulomb: 1.0, sliding: 1.0, viscous: 0.0, nominal: 1.0, bristles: 0.0 }; 2];

    #[test]
    fn tmj4_modes_follow_velocity_and_applied_torque() {
        let next = |mode, omega, applied| next_mode(mode, omega, applied, &LEVELS, true, overstep(5.0, 1.0));
        assert_eq!(next(STUCK, 0.0, 2.9), (STUCK, false));
        assert_eq!(next(STUCK, 0.0, -3.0), (-1, false));
        assert_eq!(next(1, 5.0, -9.0), (1, false));
        assert_eq!(next(1, -2.0 * TURNED, 2.0), (STUCK, true));
        assert_eq!(next(1, -2.0 * TURNED, -4.0), (-1, true));
        // Stepped over by a coarse importer: brought to rest. Given from outside: left as it is.
        assert_eq!(next(1, -0.5 * OVERSTEP * 5.0, 2.0), (STUCK, true));
        assert_eq!(next(1, -7.0, 2.0), (-1, false));
        assert_eq!(next(STUCK, 4.0, 0.0), (1, false));
        // Just broken away: slides on above the sliding level (1), is held below it, whichever way.
        assert_eq!(next(1, 0.0, 1.5), (1, false));
        assert_eq!(next(1, 0.0, 0.9), (STUCK, true));
        assert_eq!(next(-1, 0.5 * TURNED, -1.5), (-1, false));
        assert_eq!(next(-1, 0.5 * TURNED, -0.9), (STUCK, true));
        assert_eq!(next(1, 2.0 * TURNED, 0.9), (1, false));
        let first = [-3.0, 0.0, 2.0].map(|omega| moving_mode(omega, true));
        assert_eq!(first, [Some(-1), None, Some(1)]);
        assert_eq!(moving_mode(0.0, false), Some(SMOOTH));
        assert_eq!([3.0, 0.0, -3.0].map(|applied| from_rest(applied, &LEVELS)), [1, STUCK, -1]);
    }
}
