//! What names suggest. A hint only: experiments decide.

use trueup_fmi_description::description::DescriptionCausality;

use crate::kind::PortKind;

/// The side of a joint, or the body, that a name suggests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NamedSite {
    Motor,
    Link,
    Base,
    Tip,
}

const MOTOR: &[&str] = &["motor", "mot", "rotor", "m", "drive", "actuator", "mtr"];
const LINK: &[&str] = &["link", "load", "joint", "l", "arm", "ext", "external", "disturbance", "body"];
const BASE: &[&str] = &[
    "base",
    "satellite",
    "spacecraft",
    "platform",
    "chassis",
    "bus",
    "chaser",
    "thruster",
    "vehicle",
    "trunk",
];
const TIP: &[&str] = &["tip", "tool", "tcp", "hand", "ee", "effector", "gripper", "flange"];
/// From outside of the drive train.
const EXTERNAL: &[&str] = &["ext", "external", "load", "disturbance", "dist", "environment", "contact"];

const TORQUE: &[&str] = &["torque", "tau", "trq", "moment", "effort"];
const FORCE: &[&str] = &["force"];
const CURRENT: &[&str] = &["current", "iq", "amps"];
const ANGLE: &[&str] = &["angle", "phi", "theta", "q", "attitude", "position", "pos"];
const VELOCITY: &[&str] = &["velocity", "omega", "w", "speed", "qd", "dq", "rate", "vel"];
const ACCELERATION: &[&str] = &["acceleration", "acc", "qdd", "ddq"];
/// Words that name the quantity, not the place.
const GENERIC: &[&[&str]] =
    &[TORQUE, FORCE, CURRENT, ANGLE, VELOCITY, ACCELERATION, &["cmd", "command", "meas", "ref", "der"]];

/// Words in lower case, and numbers, of `J1.phi_m`, `motorAngle[2]`.
pub(crate) fn tokens(name: &str) -> Vec<String> {
    let (mut all, mut last) = (Vec::<String>::new(), ' ');
    for c in name.chars() {
        let starts = c.is_uppercase() && last.is_lowercase()
            || c.is_numeric() != last.is_numeric()
            || !last.is_alphanumeric();
        if c.is_alphanumeric() {
            match all.last_mut() {
                Some(word) if !starts => word.extend(c.to_lowercase()),
                _ => all.push(c.to_lowercase().collect()),
            }
        }
        last = c;
    }
    all
}

fn any(tokens: &[String], list: &[&str]) -> bool {
    tokens.iter().any(|t| list.contains(&t.as_str()))
}

/// The numbers of a name: of an array's element its indices.
pub(crate) fn numbers(name: &str) -> Vec<u32> {
    tokens(name).iter().filter_map(|t| t.parse().ok()).collect()
}

/// Where a name suggests that it is.
pub(crate) fn site(name: &str) -> Option<NamedSite> {
    let t = tokens(name);
    [(BASE, NamedSite::Base), (TIP, NamedSite::Tip), (MOTOR, NamedSite::Motor), (LINK, NamedSite::Link)]
        .into_iter()
        .find_map(|(list, site)| any(&t, list).then_some(site))
}

/// A torque that the name places outside of the drive train.
pub(crate) fn external(name: &str) -> bool {
    any(&tokens(name), EXTERNAL)
}

/// An element of a quaternion.
pub(crate) fn quaternion(name: &str) -> bool {
    any(&tokens(name), &["quaternion", "quat", "orientation"])
}

/// What a variable without a unit measures, by its name.
pub(crate) fn kind(name: &str, causality: DescriptionCausality) -> PortKind {
    let t = tokens(name);
    let effort = [(TORQUE, PortKind::Torque), (FORCE, PortKind::Force), (CURRENT, PortKind::Current)];
    let motion = [
        (ACCELERATION, PortKind::AngularAcceleration),
        (VELOCITY, PortKind::AngularVelocity),
        (ANGLE, PortKind::Angle),
    ];
    let all: Vec<_> = match causality {
        DescriptionCausality::Parameter => Vec::new(),
        _ => effort.into_iter().chain(motion).collect(),
    };
    all.into_iter().find_map(|(list, kind)| any(&t, list).then_some(kind)).unwrap_or(PortKind::Other)
}

/// How much two names suggest one place: shared words, and the same numbers.
pub(crate) fn affinity(a: &str, b: &str) -> f64 {
    let (ta, tb) = (tokens(a), tokens(b));
    let place =
        |t: &&String| t.parse::<u32>().is_err() && !GENERIC.iter().any(|list| list.contains(&t.as_str()));
    let shared = ta.iter().filter(place).filter(|t| tb.contains(t)).count();
    let (na, nb) = (numbers(a), numbers(b));
    let same = match (na.is_empty() || nb.is_empty(), na == nb) {
        (true, _) => 0.0,
        (_, true) => 4.0,
        _ => -4.0,
    };
    let sites = match (site(a), site(b)) {
        (Some(x), Some(y)) if x == y => 2.0,
        (Some(NamedSite::Base | NamedSite::Tip), Some(_))
        | (Some(_), Some(NamedSite::Base | NamedSite::Tip)) => -4.0,
        _ => 0.0,
    };
    2.0 * shared as f64 + same + sites
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn names_of_several_tools() {
        assert_eq!(tokens("J1.phi_m"), ["j", "1", "phi", "m"]);
        assert_eq!(tokens("motorAngle[2]"), ["motor", "angle", "2"]);
        assert_eq!(tokens("der(state.tipForce)[1,3]"), ["der", "state", "tip", "force", "1", "3"]);
        assert_eq!(site("base.Fx"), Some(NamedSite::Base));
        assert_eq!(site("J1.w_l"), Some(NamedSite::Link));
        assert_eq!(site("xyz"), None);
        assert_eq!(kind("qd1", DescriptionCausality::Output), PortKind::AngularVelocity);
        assert!(
            affinity("jointTorque[2]", "motorVelocity[2]") > affinity("jointTorque[2]", "motorVelocity[1]")
        );
        assert!(affinity("tipTorque", "tipRate") > affinity("tipTorque", "baseRate"));
    }
}
