//! What of a model is not used: one note each.

use roxmltree::Node;

use crate::attributes::numbers;
use crate::tree::counted;

/// Names of joints and bodies, by what of theirs is not used.
#[derive(Default)]
pub(super) struct UnreadParts {
    /// Joints that follow others.
    pub(super) coupled: Vec<String>,
    /// Joints with limits of angle or force.
    pub(super) limited: Vec<String>,
    pub(super) sprung: Vec<String>,
    /// Joints whose spring and damper MuJoCo computes.
    pub(super) timed: Vec<String>,
    /// Joints whose angle in the file is not 0.
    pub(super) referred: Vec<String>,
    /// Free joints with losses or inertia of their own.
    pub(super) lossy_free: Vec<String>,
    /// Bodies without weight, in whole or in part.
    pub(super) lifted: Vec<String>,
    /// Bodies that a user moves.
    pub(super) moved: Vec<String>,
}

/// Attributes of <option> that act on bodies.
const ACTING: [&str; 5] = ["gravity", "density", "viscosity", "wind", "magnetic"];

impl UnreadParts {
    pub(super) fn notes(&self, model: Node<'_, '_>) -> Vec<String> {
        let mut notes = Vec::new();
        for (all, what) in [
            (&self.coupled, "<equality> of {} is not read: they are fixed where they are in the file"),
            (&self.limited, "range and actuatorfrcrange of {} are not read: no model here has them"),
            (
                &self.sprung,
                "stiffness of {} is not read: no model here has a spring towards the base of a joint",
            ),
            (
                &self.timed,
                "springdamper of {} is not read: the stiffness and damping that MuJoCo computes of it are missing",
            ),
            (&self.referred, "ref of {} is not read: their angles are 0 as they are in the file"),
            (
                &self.lossy_free,
                "damping, armature, frictionloss and stiffness of {} are not read: a free base has none",
            ),
        ] {
            if !all.is_empty() {
                let names: Vec<_> = all.iter().map(String::as_str).collect();
                notes.push(what.replace("{}", &counted(&names)));
            }
        }
        for (all, what) in [
            (&self.lifted, "gravcomp is not read: their weight acts"),
            (&self.moved, "mocap is not read: they are fixed where they are in the file"),
        ] {
            if !all.is_empty() {
                notes.push(format!("bodies {}: {what}", all.join(", ")));
            }
        }
        let given = |section: &str| -> Vec<Node<'_, '_>> {
            let sections = model.children().filter(|c| c.has_tag_name(section));
            sections.flat_map(|s| s.children().filter(Node::is_element)).collect()
        };
        for (section, what) in [
            ("actuator", "(nor its gear, armature and damping): torques are those of the joints"),
            ("tendon", "(nor its stiffness, damping, frictionloss and armature)"),
            ("deformable", "(skins and flexible bodies)"),
        ] {
            if !given(section).is_empty() {
                notes.push(format!("<{section}> is not read {what}"));
            }
        }
        let equalities = given("equality");
        let others = equalities.iter().map(|n| n.tag_name().name());
        let mut others: Vec<_> = others.filter(|name| !["joint", "connect", "weld"].contains(name)).collect();
        others.dedup();
        if !others.is_empty() {
            notes.push(format!("<equality> of {} is not read", others.join(", ")));
        }
        for option in model.children().filter(|c| c.has_tag_name("option")) {
            let acts = |name: &&&str| {
                let text = option.attribute(**name).unwrap_or_default();
                numbers(option, name, text).is_ok_and(|all| all.iter().any(|v| *v != 0.0))
            };
            let names: Vec<&str> = ACTING.iter().filter(acts).copied().collect();
            if !names.is_empty() {
                let list = names.join(", ");
                notes.push(format!(
                    "<option {list}> is not read: set what acts at the FMU (`gravity` of a base that is held)"
                ));
            }
        }
        notes
    }
}
