//! What a name means: words for quantities, sides and units that logs use, and that names of variables are made of.

use crate::unit::SignalUnit;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    Angle,
    /// Of something that turns or moves: an angle or a length.
    Position,
    Velocity,
    Acceleration,
    Current,
    Torque,
    Force,
    Time,
}

/// Where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    Motor,
    Load,
    Joint,
    Base,
    Tip,
    External,
}

const QUANTITIES: &[(Quantity, &[&str])] = &[
    (
        Quantity::Angle,
        &[
            "angle",
            "ang",
            "theta",
            "th",
            "phi",
            "q",
            "qm",
            "ql",
            "enc",
            "encoder",
            "rotation",
            "attitude",
            "orientation",
            "yaw",
            "heading",
            "state",
            "states",
        ],
    ),
    (Quantity::Position, &["position", "pos", "posn", "x", "y", "z"]),
    (
        Quantity::Velocity,
        &[
            "velocity", "vel", "speed", "omega", "w", "wm", "wl", "qd", "dq", "qdot", "rate", "tacho",
            "gyro", "rpm",
        ],
    ),
    (Quantity::Acceleration, &["acceleration", "accel", "acc", "qdd", "ddq", "qddot"]),
    (Quantity::Current, &["current", "cur", "curr", "i", "im", "iq", "amp", "amps"]),
    (Quantity::Torque, &["torque", "tau", "trq", "tq", "effort", "moment"]),
    (Quantity::Force, &["force", "f"]),
    (
        Quantity::Time,
        &[
            "time",
            "t",
            "stamp",
            "timestamp",
            "clock",
            "ts",
            "sec",
            "secs",
            "seconds",
            "millis",
            "ms",
            "us",
            "ns",
        ],
    ),
];

const SIDES: &[(Side, &[&str])] = &[
    (Side::Motor, &["motor", "mot", "mtr", "m", "drive", "rotor", "actuator", "servo", "qm", "wm", "im"]),
    (Side::Load, &["load", "link", "l", "output", "out", "arm", "secondary", "ql", "wl"]),
    (Side::Joint, &["joint", "jnt", "axis"]),
    (Side::Base, &["base", "satellite", "sat", "platform", "spacecraft", "chaser"]),
    (Side::Tip, &["tip", "hand", "tool", "tcp", "ee", "effector", "gripper"]),
    (Side::External, &["external", "ext", "disturbance", "contact"]),
];

/// What is commanded is not what is measured.
const COMMANDS: &[&str] = &[
    "cmd",
    "command",
    "commanded",
    "ref",
    "reference",
    "des",
    "desired",
    "set",
    "setpoint",
    "sp",
    "target",
    "goal",
    "action",
    "demand",
];

/// Words without a meaning of their own.
const EMPTY: &[&str] = &[
    "meas",
    "measured",
    "actual",
    "act",
    "fb",
    "feedback",
    "sensor",
    "raw",
    "observation",
    "value",
    "data",
    "msg",
    "no",
    "nr",
    "of",
    "the",
];

/// How logs write units that have another form here.
const UNITS: &[(&str, &str)] = &[
    ("degs", "deg/s"),
    ("dps", "deg/s"),
    ("degps", "deg/s"),
    ("rads", "rad/s"),
    ("radps", "rad/s"),
    ("ma", "mA"),
    ("amps", "A"),
    ("amp", "A"),
    ("a", "A"),
    ("nm", "Nm"),
    ("mnm", "mNm"),
    ("ncm", "Ncm"),
    ("nmm", "Nmm"),
    ("sec", "s"),
    ("secs", "s"),
    ("seconds", "s"),
    ("millis", "ms"),
    ("msec", "ms"),
    ("usec", "us"),
    ("degrees", "deg"),
    ("degree", "deg"),
    ("radians", "rad"),
    ("revs", "rev"),
    ("turns", "rev"),
];

/// Of a name.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct NameMeaning {
    pub(super) quantity: Option<Quantity>,
    pub(super) side: Option<Side>,
    /// Of an element or a numbered column, as it is written.
    pub(super) index: Option<usize>,
    /// As units are written here.
    pub(super) unit: Option<String>,
    pub(super) command: bool,
    /// What is left.
    pub(super) rest: Vec<String>,
    /// Its words are counts of an encoder.
    pub(super) counts: bool,
}

impl NameMeaning {
    /// Of a name, with another one that the file has for it.
    pub(super) fn of(name: &str, label: Option<&str>) -> Self {
        let mut own = Self::default();
        let mut parts = parts(name);
        parts.extend(label.into_iter().flat_map(self::parts));
        own.unit = take_unit(&mut parts);
        // The last word is the most exact one.
        for word in parts.iter().flat_map(|part| words(part)).rev() {
            own.add(&word);
        }
        own
    }

    fn add(&mut self, word: &str) {
        if let Ok(k) = word.parse() {
            self.index = self.index.or(Some(k));
            return;
        }
        let has = |list: &[&str]| list.contains(&word);
        let quantity = QUANTITIES.iter().find(|(_, list)| has(list)).map(|q| q.0);
        let side = SIDES.iter().find(|(_, list)| has(list)).map(|s| s.0);
        self.command |= has(COMMANDS);
        self.counts |= has(&["counts", "count", "ticks", "cnt", "inc"]);
        if quantity == Some(Quantity::Position) && matches!(word, "x" | "y" | "z") {
            self.index = self.index.or(Some(usize::from(word.as_bytes()[0] - b'x') + 1));
        }
        if quantity.is_none() && side.is_none() && !has(COMMANDS) && !has(EMPTY) && !self.counts {
            self.rest.push(word.to_owned());
        }
        // A single letter is a side only behind a quantity: `theta_m`.
        self.side = self.side.or(side);
        self.quantity = self.quantity.or(quantity);
    }
}

/// A name at its separators.
fn parts(name: &str) -> Vec<String> {
    name.split(|c: char| !c.is_alphanumeric() && c != '°' && c != '%')
        .filter(|p| !p.is_empty())
        .map(str::to_owned)
        .collect()
}

/// The words of a part: `motorAngle1` is three.
fn words(part: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut last: Option<char> = None;
    for c in part.chars() {
        let begins = match last {
            None => true,
            Some(l) => (l.is_lowercase() && c.is_uppercase()) || l.is_ascii_digit() != c.is_ascii_digit(),
        };
        if begins {
            words.push(String::new());
        }
        if let Some(word) = words.last_mut() {
            word.extend(c.to_lowercase());
        }
        last = Some(c);
    }
    words
}

/// A unit at the end: `motor_pos_deg`, `speed_rad_s`.
fn take_unit(parts: &mut Vec<String>) -> Option<String> {
    let known = |text: &str| {
        let alias = UNITS.iter().find(|(from, _)| *from == text.to_lowercase()).map(|(_, to)| *to);
        let text = alias.unwrap_or(text);
        SignalUnit::parse(text).map(|_| text.to_owned())
    };
    // What is a word as well is none: `pos_m` may be the motor's, `q_1` the first one.
    let is_word = |part: &str| part.parse::<f64>().is_ok() || (part.len() == 1 && part != "A");
    let n = parts.len();
    if n >= 3 {
        let per = usize::from(parts[n - 2].eq_ignore_ascii_case("per"));
        let above = n.checked_sub(2 + per).filter(|at| *at > 0);
        if let (Some(at), true) = (above, matches!(parts[n - 1].as_str(), "s" | "sec" | "min"))
            && matches!(parts[at].as_str(), "deg" | "rad" | "rev" | "m" | "mm" | "mrad")
        {
            let unit = format!("{}/{}", parts[at], if parts[n - 1] == "min" { "min" } else { "s" });
            parts.truncate(at);
            return Some(unit);
        }
    }
    let last = parts.last().filter(|last| n >= 2 && !is_word(last))?;
    let unit = known(last)?;
    parts.pop();
    Some(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_logs() {
        type Told<'a> = (&'a str, Option<Quantity>, Option<Side>, Option<usize>, Option<&'a str>, bool);
        let told: [Told; 16] = [
            ("motor_pos_deg", Some(Quantity::Position), Some(Side::Motor), None, Some("deg"), false),
            ("q1", Some(Quantity::Angle), None, Some(1), None, false),
            ("tau_1", Some(Quantity::Torque), None, Some(1), None, false),
            ("current_mA", Some(Quantity::Current), None, None, Some("mA"), false),
            ("/joint_states.position[0]", Some(Quantity::Position), Some(Side::Joint), Some(0), None, false),
            ("/joint_states.velocity[2]", Some(Quantity::Velocity), Some(Side::Joint), Some(2), None, false),
            ("theta_m", Some(Quantity::Angle), Some(Side::Motor), None, None, false),
            ("linkSpeed_rad_s", Some(Quantity::Velocity), Some(Side::Load), None, Some("rad/s"), false),
            ("motor_current_cmd", Some(Quantity::Current), Some(Side::Motor), None, None, true),
            ("motorAngle", Some(Quantity::Angle), Some(Side::Motor), None, None, false),
            ("externalTorque", Some(Quantity::Torque), Some(Side::External), None, None, false),
            ("jointTorque[3]", Some(Quantity::Torque), Some(Side::Joint), Some(3), None, false),
            ("t_ms", Some(Quantity::Time), None, None, Some("ms"), false),
            ("Iq_A", Some(Quantity::Current), None, None, Some("A"), false),
            ("base_x", Some(Quantity::Position), Some(Side::Base), Some(1), None, false),
            ("temperature", None, None, None, None, false),
        ];
        for (name, quantity, side, index, unit, command) in told {
            let own = NameMeaning::of(name, None);
            let found = (own.quantity, own.side, own.index, own.unit.as_deref(), own.command);
            assert_eq!(found, (quantity, side, index, unit, command), "{name}: {own:?}");
        }
        assert_eq!(NameMeaning::of("/joint_states.position[1]", Some("motor")).side, Some(Side::Motor));
        assert_eq!(NameMeaning::of("transmissionTorque", None).rest, ["transmission"]);
    }
}
