//! The outputs that a sensor effect can act on.

use super::{EffectPlace, PlantKind, Scope};
use crate::arm::output as arm;

const fn channel(
    name: &'static str,
    component: &'static str,
    unit: &'static str,
    plants: &'static [PlantKind],
) -> EffectPlace {
    EffectPlace { name, prefix: name, component, plants, scope: Scope::Channel, unit, parameters: &[] }
}

const JOINT: &[PlantKind] = &[PlantKind::Joint];
const ARM: &[PlantKind] = &[PlantKind::Arm];
const SPACE: &[PlantKind] = &[PlantKind::Space];
const ARMS: &[PlantKind] = &[PlantKind::Arm, PlantKind::Space];
const EACH: &[PlantKind] = &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space];

/// All channels, encoders first.
pub(super) const ALL: &[EffectPlace] = &[
    channel("motorAngle", "sensor:motorAngle", "rad", EACH),
    channel("loadAngle", "sensor:loadAngle", "rad", JOINT),
    channel("jointAngle", "sensor:jointAngle", "rad", ARMS),
    channel("motorVelocity", "sensor:motorVelocity", "rad/s", EACH),
    channel("loadVelocity", "sensor:loadVelocity", "rad/s", JOINT),
    channel("motorAcceleration", "sensor:motorAcceleration", "rad/s2", JOINT),
    channel("loadAcceleration", "sensor:loadAcceleration", "rad/s2", JOINT),
    channel("motorTorque", "sensor:motorTorque", "N.m", JOINT),
    channel("transmissionTorque", "sensor:transmissionTorque", "N.m", JOINT),
    channel("jointVelocity", "sensor:jointVelocity", "rad/s", ARMS),
    channel("basePosition", "sensor:basePosition", "m", ARMS),
    channel("baseAttitude", "sensor:baseAttitude", "rad", ARM),
    channel("baseVelocity", "sensor:baseVelocity", "m/s", ARMS),
    channel("baseRate", "sensor:baseRate", "rad/s", ARM),
    channel("tipPosition", "sensor:tipPosition", "m", ARMS),
    channel("tipAttitude", "sensor:tipAttitude", "rad", ARM),
    channel("tipVelocity", "sensor:tipVelocity", "m/s", ARMS),
    channel("baseAngularVelocity", "sensor:baseAngularVelocity", "rad/s", SPACE),
    channel("tipAngularVelocity", "sensor:tipAngularVelocity", "rad/s", SPACE),
];

/// Channels that read an angle of a joint.
pub(super) const ENCODERS: &[EffectPlace] = ALL.split_at(3).0;

/// Outputs of TwoMassJoint in their order.
const JOINT_OUTPUTS: &[&str] = &[
    "motorAngle",
    "motorVelocity",
    "motorAcceleration",
    "loadAngle",
    "loadVelocity",
    "loadAcceleration",
    "motorTorque",
    "transmissionTorque",
];

/// First element and number of elements of that output; of a robot in space its structure decides, not the number of joints.
pub(super) fn span(channel: &str, plant: PlantKind, joints: usize) -> Option<(usize, usize)> {
    match plant {
        PlantKind::Joint => JOINT_OUTPUTS.iter().position(|name| *name == channel).map(|first| (first, 1)),
        PlantKind::Arm => {
            let at = arm::NAMES.iter().position(|(name, _)| *name == channel)?;
            let first = arm::NAMES[..at].iter().map(|(_, length)| length(joints)).sum();
            Some((first, arm::NAMES[at].1(joints)))
        }
        PlantKind::Space => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::joint::output as joint;

    #[test]
    fn every_channel_is_where_the_plants_have_it() {
        for c in ALL {
            for plant in c.plants.iter().filter(|p| **p != PlantKind::Space) {
                assert!(span(c.name, *plant, 3).is_some(), "{} on {plant:?}", c.name);
            }
        }
        let first = |name, plant| span(name, plant, 3).map(|s| s.0);
        assert_eq!(first("loadVelocity", PlantKind::Joint), Some(joint::LOAD_VELOCITY));
        assert_eq!(first("transmissionTorque", PlantKind::Joint), Some(joint::TRANSMISSION_TORQUE));
        assert_eq!(span("motorVelocity", PlantKind::Arm, 3), Some((arm::motor_velocity(3), 3)));
        assert_eq!(span("tipPosition", PlantKind::Arm, 2), Some((arm::tip_position(2), 2)));
    }
}
