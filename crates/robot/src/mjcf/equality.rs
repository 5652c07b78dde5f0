//! <equality>: joints that follow others are fixed; what closes a loop is refused.

use roxmltree::Node;
use trueup_models::space::attitude::about;
use trueup_models::space::spatial::SpatialFrame;
use trueup_models::space::vector::{dot, identity, scale};

use super::defaults::DefaultClasses;
use crate::attributes::{line, needed, numbers};
use crate::tree::{FileFault, FileJoint, FileJointKind};

/// Fixes the joints that follow; their names.
pub(super) fn couple(
    model: Node<'_, '_>,
    classes: &DefaultClasses,
    joints: &mut [FileJoint],
) -> Result<Vec<String>, FileFault> {
    let mut coupled = Vec::new();
    let sections = model.children().filter(|c| c.has_tag_name("equality"));
    for node in sections.flat_map(|s| s.children().filter(Node::is_element)) {
        let active = classes.of_element(node, "equality", "active", None)?;
        if active == Some("false") {
            continue;
        }
        match node.tag_name().name() {
            what @ ("connect" | "weld") => {
                let why = format!(
                    "<{what}> of <equality> closes a loop of joints, which a tree has not; take it out, or cut the loop open"
                );
                return Err((line(node), why));
            }
            "joint" => {
                let name = needed(node, "joint1")?;
                let known = joints.iter_mut().find(|j| j.name == name);
                let joint = known.ok_or_else(|| {
                    (line(node), format!("there is no joint `{name}`; name one of this file"))
                })?;
                fix(node, joint)?;
                coupled.push(name.to_owned());
            }
            _ => {}
        }
    }
    Ok(coupled)
}

/// Where it is while the joint that it follows is where it is in the file.
fn fix(node: Node<'_, '_>, joint: &mut FileJoint) -> Result<(), FileFault> {
    let offset = match node.attribute("polycoef") {
        Some(text) => numbers(node, "polycoef", text)?.first().copied().unwrap_or(0.0),
        None => 0.0,
    };
    let length = dot(joint.axis, joint.axis).sqrt();
    if offset != 0.0 && length > 0.0 {
        let axis = scale(1.0 / length, joint.axis);
        let moved = match joint.kind {
            FileJointKind::Prismatic => SpatialFrame { rotation: identity(), origin: scale(offset, axis) },
            _ => SpatialFrame { rotation: about(axis, offset), origin: [0.0; 3] },
        };
        joint.frame = joint.frame.then(&moved);
    }
    joint.kind = FileJointKind::Fixed;
    Ok(())
}
