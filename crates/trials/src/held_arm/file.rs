//! The nominal robot as a file (docs/robots.md).

use std::fmt::Write as _;

use super::chain::JOINTS;
use super::space::LEVEL;
use super::values::HeldArmValues;

/// Text of `robot.toml`.
pub(super) fn robot(v: &HeldArmValues, name: &str) -> String {
    let mut text = format!("name = \"{name}\"\n\n[base]\nheld = true\nmass = 1.0\ninertia = {LEVEL:?}\n");
    for (j, b) in v.chain.bodies.iter().enumerate() {
        let _ = write!(
            text,
            "\n[[body]]\nname = \"link {}\"\nmass = {:?}\ncenter-of-mass = {:?}\ninertia = {:?}\n\
             position = {:?}\norientation = {:?}\naxis = {:?}\n",
            j + 1,
            b.mass,
            b.center,
            b.inertia,
            b.position,
            b.orientation,
            b.axis
        );
        let (inertia, gear) = (v.chain.rotor[j], v.chain.gear_ratio[j]);
        let _ = if v.flexible[j] {
            writeln!(
                text,
                "motor = {{ flexible = true, inertia = {inertia:?}, gear-ratio = {gear:?}, stiffness = {:?}, damping = {:?} }}",
                v.stiffness[j], v.damping[j]
            )
        } else {
            writeln!(text, "motor = {{ flexible = false, inertia = {inertia:?}, gear-ratio = {gear:?} }}")
        };
    }
    let _ = write!(text, "\n[[tip]]\nname = \"flange\"\nbody = \"link {JOINTS}\"\noffset = {:?}\n", v.tip);
    text
}
