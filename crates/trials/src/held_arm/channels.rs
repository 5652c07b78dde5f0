//! What is read of an arm: channels by number.

use super::chain::JOINTS;
use super::values::{HeldArmValues, RATE};

/// motorAngle, jointAngle, motorVelocity, six each.
pub(super) const CHANNELS: usize = 3 * JOINTS;

/// Name of the variable of channel `c`, and the joint that it reads, from 0.
pub(super) fn channel(c: usize) -> (&'static str, usize) {
    (["motorAngle", "jointAngle", "motorVelocity"][c / JOINTS], c % JOINTS)
}

/// Coordinate or rate in the state that channel `c` reads.
pub(super) fn index_of(values: &HeldArmValues, c: usize) -> usize {
    let j = c % JOINTS;
    match c / JOINTS {
        0 => values.motor(j),
        1 => j,
        _ => RATE + values.motor(j),
    }
}
