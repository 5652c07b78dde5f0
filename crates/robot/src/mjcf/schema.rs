//! Which elements and attributes MJCF has where robots are read: any other is a slip of the pen.

use roxmltree::Node;

use super::compiler::COMPILED;
use crate::attributes::line;
use crate::tree::FileFault;
use trueup_signals::did_you_mean;

/// Sections of a model.
const SECTIONS: &str = "compiler option size visual statistic default extension custom asset worldbody deformable contact equality tendon actuator sensor keyframe";
/// Elements of a body.
const PARTS: &str = "body inertial joint freejoint geom site camera light frame";
/// Elements that make bodies by rules which are not read.
const MACROS: [&str; 5] = ["replicate", "attach", "composite", "flexcomp", "plugin"];
const ORIENTATIONS: &str = "quat axisangle xyaxes zaxis euler";

/// Attributes of elements, as `mj_printSchema` of MuJoCo 2.3 to 4.0 has them. <geom>, <camera> and <light> are not read.
const ATTRIBUTES: [(&str, &str); 8] = [
    (
        "compiler",
        "alignfree angle assetdir autolimits balanceinertia boundinertia boundmass conflict convexhull coordinate discardvisual eulerseq exactmeshinertia fitaabb fusestatic inertiafromgeom inertiagrouprange meshdir passthrough savecanonical savecompiled saveinertial settotalmass strippath texturedir usethread",
    ),
    ("worldbody", "name pos"),
    ("body", "name pos childclass mocap user gravcomp sleep fuse simple"),
    ("frame", "name pos childclass"),
    ("inertial", "pos mass diaginertia fullinertia"),
    (
        "joint",
        "name class type group pos axis springdamper limited actuatorfrclimited solreflimit solimplimit solreffriction solimpfriction stiffness range actuatorfrcrange actuatorgravcomp margin ref springref springyield armature damping frictionloss user",
    ),
    ("freejoint", "name group align"),
    ("site", "name class pos type group material mesh size fromto rgba user"),
];

/// Checks the names of what is read, and that nothing makes bodies by rules which are not.
pub(super) fn check(model: Node<'_, '_>) -> Result<(), FileFault> {
    for section in model.children().filter(Node::is_element) {
        known(section, SECTIONS)?;
        match section.tag_name().name() {
            "compiler" => attributes(section)?,
            "worldbody" => parts(section)?,
            "default" => defaults(section)?,
            _ => {}
        }
    }
    Ok(())
}

/// Of a body, a frame or the world.
fn parts(outer: Node<'_, '_>) -> Result<(), FileFault> {
    let mut rest = vec![outer];
    while let Some(node) = rest.pop() {
        attributes(node)?;
        for part in node.children().filter(Node::is_element) {
            let what = part.tag_name().name();
            if MACROS.contains(&what) {
                return Err((line(part), format!("<{what}> is not read; {COMPILED}")));
            }
            known(part, PARTS)?;
            if what == "body" || what == "frame" {
                rest.push(part);
            } else {
                attributes(part)?;
            }
        }
    }
    Ok(())
}

/// Of <default>, whose elements have no names.
fn defaults(section: Node<'_, '_>) -> Result<(), FileFault> {
    for node in section.descendants().filter(|n| n.has_tag_name("joint") || n.has_tag_name("site")) {
        attributes(node)?;
    }
    Ok(())
}

fn known(node: Node<'_, '_>, all: &str) -> Result<(), FileFault> {
    let (name, place) = (node.tag_name().name(), node.parent_element().map(|p| p.tag_name().name()));
    if all.split(' ').any(|one| one == name) {
        return Ok(());
    }
    let hint = did_you_mean(name, all.split(' '), "see MuJoCo's XML reference");
    Err((line(node), format!("<{}> has no element <{name}>; {hint}", place.unwrap_or_default())))
}

fn attributes(node: Node<'_, '_>) -> Result<(), FileFault> {
    let element = node.tag_name().name();
    let Some((_, own)) = ATTRIBUTES.iter().find(|(name, _)| *name == element) else { return Ok(()) };
    let turned = if ["body", "frame", "inertial", "site"].contains(&element) { ORIENTATIONS } else { "" };
    let all = || own.split(' ').chain(turned.split_whitespace());
    for attribute in node.attributes() {
        let name = attribute.name();
        if all().all(|one| one != name) {
            let hint = did_you_mean(name, all(), "see MuJoCo's XML reference");
            return Err((line(node), format!("<{element}> has no attribute `{name}`; {hint}")));
        }
    }
    Ok(())
}
