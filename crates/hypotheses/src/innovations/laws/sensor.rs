//! Channels as places of laws.

use crate::innovations::along::JointAlong;
use crate::innovations::shape::LawShape;

/// Places of the angles, where both are read: what is wrong with a reading shows against the other.
pub(super) fn angles(along: &JointAlong<'_>) -> Vec<&'static str> {
    if along.frame.two_angles() { vec!["sensor:motorAngle", "sensor:loadAngle"] } else { Vec::new() }
}

/// Channel of a shape's place, and the state that it shows.
pub(super) fn channel(along: &JointAlong<'_>, shape: &LawShape) -> Option<(usize, usize)> {
    let name = shape.place.strip_prefix("sensor:")?;
    let channel = along.frame.intake.channel(name)?;
    Some((channel, along.frame.intake.channels[channel].state))
}
