//! What a URDF has in it that cannot be read as it is meant: unexpanded macros, elements that are there twice.

use roxmltree::Node;

use crate::attributes::line;
use crate::tree::{FileFault, FileJoint, counted};

/// Elements that their parent has once.
const ONCE: [&str; 11] = [
    "inertial",
    "mass",
    "inertia",
    "origin",
    "parent",
    "child",
    "axis",
    "limit",
    "dynamics",
    "mimic",
    "calibration",
];

/// An element of xacro, or one that is there twice.
pub(super) fn check(robot: Node<'_, '_>) -> Result<(), FileFault> {
    let xacro = |n: &Node<'_, '_>| n.tag_name().namespace().is_some_and(|space| space.contains("xacro"));
    if let Some(node) = robot.descendants().find(xacro) {
        let why = format!(
            "`xacro:{}` is a macro, which is not expanded here: run `xacro FILE > robot.urdf` (ROS), and give its output",
            node.tag_name().name()
        );
        return Err((line(node), why));
    }
    let parts = ["link", "joint", "inertial"];
    for node in robot.descendants().filter(|n| parts.iter().any(|p| n.has_tag_name(*p))) {
        for name in ONCE {
            if let Some(second) = node.children().filter(|c| c.has_tag_name(name)).nth(1) {
                let of = node.tag_name().name();
                return Err((
                    line(second),
                    format!("<{name}> is there twice in one <{of}>; take one of them out"),
                ));
            }
        }
    }
    Ok(())
}

/// Transmissions are named: what they reduce is not in the model.
pub(super) fn transmissions(robot: Node<'_, '_>, joints: &[FileJoint]) -> Option<String> {
    let all: Vec<&str> = robot
        .children()
        .filter(|c| c.has_tag_name("transmission"))
        .filter_map(|t| t.children().find(|c| c.has_tag_name("joint"))?.attribute("name"))
        .filter(|name| joints.iter().any(|j| j.name == *name))
        .collect();
    (!all.is_empty()).then(|| {
        format!(
            "<transmission> of {} is not read: torques are those of the joints, without motors and gears",
            counted(&all)
        )
    })
}
