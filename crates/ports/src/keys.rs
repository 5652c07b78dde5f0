//! The keys of `ports.toml`: the reader takes these and no other, docs/ports.md has the same tables.

use trueup_signals::keys::KeyValue::{Named, Number, OneOf, Table, Text, Texts};
use trueup_signals::keys::{KeyValue, Keys, key};

const JOINTS: &[KeyValue] = &[Table(&JOINT)];
const SENSORS: &[KeyValue] = &[Table(&SENSOR)];

/// Of the root.
pub const PORTS: Keys = Keys {
    of: "ports",
    list: &[
        key("fmu", "the FMU", "file name", "must be given", Text),
        key("joint", "tables `[joint.NAME]`, a number or a name each", "", "none", Named(JOINTS)),
        key("base", "table: forces on the base and its motion", "", "none", Table(&BASE)),
        key("tip", "table: forces on the end effector and its motion", "", "none", Table(&TIP)),
        key("sensors", "table: outputs that are readings, by the output's name", "", "none", Named(SENSORS)),
    ],
};

/// Of a joint.
pub const JOINT: Keys = Keys {
    of: "a joint",
    list: &[
        key("torque", "torque on the motor: times `motorVelocity` it is a power", "input, N.m", "none", Text),
        key("current", "current of the motor, in place of `torque`", "input, A", "none", Text),
        key(
            "torqueConstant",
            "torque that `torque` would have, per current",
            "N.m/A",
            "none: effects act on the current",
            Number,
        ),
        key("motorAngle", "angle of the motor", "output, rad", "none", Text),
        key("motorVelocity", "its derivative", "output, rad/s", "none", Text),
        key("linkAngle", "angle of the link behind the transmission", "output, rad", "none", Text),
        key("linkVelocity", "its derivative", "output, rad/s", "none", Text),
        key(
            "gearRatio",
            "turns of `motorAngle` per turn of `linkAngle`, as the FMU has both",
            "1",
            "1",
            Number,
        ),
        key(
            "externalTorque",
            "torque on the link: times `linkVelocity` it is a power",
            "input, N.m",
            "none",
            Text,
        ),
        key("transmissionTorque", "torque that the transmission carries", "output, N.m", "none", Text),
        key("stiffness", "parameter: stiffness of the transmission", "name", "none", Text),
        key("damping", "parameter: damping of the transmission", "name", "none", Text),
    ],
};

const FORCE: (&str, &str, &str) = ("force", "force on the body, element by element", "inputs, N");

/// Of the base.
pub const BASE: Keys = Keys { of: "base", list: BODY };
/// Of the tip.
pub const TIP: Keys = Keys { of: "tip", list: BODY };

const BODY: &[trueup_signals::keys::CaseFileKey] = &[
    key(FORCE.0, FORCE.1, FORCE.2, "none", Texts),
    key("torque", "torque on the body", "inputs, N.m", "none", Texts),
    key("position", "position of the point where `force` acts", "outputs, m", "none", Texts),
    key("velocity", "velocity of that point, element by element as `force`", "outputs, m/s", "none", Texts),
    key("attitude", "angle, or the four elements of a quaternion", "outputs, rad or 1", "none", Texts),
    key("rate", "angular velocity, element by element as `torque`", "outputs, rad/s", "none", Texts),
    key("mass", "mass of the body", "kg", "unknown", Number),
];

/// Of a sensor.
pub const SENSOR: Keys = Keys {
    of: "a sensor",
    list: &[key("kind", "what it measures", "a word", "must be given", OneOf(SENSOR_KINDS))],
};

/// Kinds of sensors.
pub const SENSOR_KINDS: &[&str] = &[
    "encoder",
    "tachometer",
    "accelerometer",
    "torque",
    "force",
    "position",
    "velocity",
    "current",
    "other",
];

/// All tables.
pub const ALL: &[Keys] = &[PORTS, JOINT, BASE, TIP, SENSOR];
