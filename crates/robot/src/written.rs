//! A robot as a file of TOML, which reads back as the same robot.

use std::fmt::Write as _;

use trueup_models::space::design::{DesignMotor, RobotDesign};
use trueup_models::space::tree::JointType;

use super::JointFriction;

const BASE: &str = "base";

/// The file; refused for a robot with what is not written.
pub(super) fn toml(design: &RobotDesign, friction: &[JointFriction]) -> Result<String, String> {
    let bends =
        design.appendages.len() + design.tables.len() + design.flexures.len() + design.link_tables.len();
    if bends > 0 {
        return Err("a robot with appendages or links that bend is not written as TOML; docs/robots.md shows such files".into());
    }
    let mut out = String::from(
        "# A robot of trueup (docs/robots.md): SI units; the base's axes are in its centre of mass, a body's in its joint.\n",
    );
    let text = |s: &str| toml::Value::from(s).to_string();
    let _ = writeln!(out, "name = {}", text(&design.name));
    if design.analysis {
        out.push_str("analysis = true\n");
    }
    let _ = write!(out, "\n[base]\nmass = {:?}\ninertia = {:?}\n", design.base_mass, design.base_inertia);
    if design.held {
        out.push_str("held = true\n");
    }
    // `base` names the base alone.
    let called = |name: &str| if name == BASE { "base link".to_owned() } else { name.to_owned() };
    let name = |body: usize| body.checked_sub(1).map_or(BASE.to_owned(), |k| called(&design.links[k].name));
    for (k, link) in design.links.iter().enumerate() {
        let _ =
            write!(out, "\n[[body]]\nname = {}\nparent = {}\n", text(&name(k + 1)), text(&name(link.parent)));
        if link.joint == JointType::Prismatic {
            out.push_str("joint = \"prismatic\"\n");
        }
        let _ = write!(
            out,
            "mass = {:?}\ncenter-of-mass = {:?}\ninertia = {:?}\nposition = {:?}\norientation = {:?}\naxis = {:?}\n",
            link.mass, link.center_of_mass, link.inertia, link.position, link.orientation, link.axis
        );
        if link.motor != DesignMotor::default() {
            let m = &link.motor;
            let _ = writeln!(
                out,
                "motor = {{ flexible = {}, inertia = {:?}, gear-ratio = {:?}, stiffness = {:?}, damping = {:?} }}",
                m.flexible, m.inertia, m.gear_ratio, m.stiffness, m.damping
            );
        }
        if let Some(friction) = friction.get(k).filter(|f| f.is_there()) {
            let _ = writeln!(
                out,
                "friction = {{ viscous = {:?}, coulomb = {:?} }}",
                friction.viscous, friction.coulomb
            );
        }
    }
    for tip in &design.tips {
        let (own, body) = (text(&tip.name), text(&name(tip.body)));
        let _ = write!(
            out,
            "\n[[tip]]\nname = {own}\nbody = {body}\noffset = {:?}\nmount = {:?}\n",
            tip.offset, tip.mount
        );
    }
    for thruster in &design.thrusters {
        let _ = write!(
            out,
            "\n[[thruster]]\nposition = {:?}\ndirection = {:?}\n",
            thruster.position, thruster.direction
        );
    }
    Ok(out)
}
