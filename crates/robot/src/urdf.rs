//! Robots as URDF: links with their inertia on joints. What is fixed to a link becomes part of it.

use std::path::Path;

use roxmltree::{Document, Node};
use trueup_models::space::attitude::about;
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::vector::{Matrix3, identity, product, scale};

use super::attributes::{fixed, line, needed};
use super::tree::{
    FileFault, FileJoint, FileJointKind, FileLink, JointFriction, TreeRobot, assemble, counted, once, root,
};
use crate::wrong::RobotReadError;
use trueup_signals::did_you_mean;

/// A joint with what of it is not read.
struct UrdfJoint {
    own: FileJoint,
    /// Elements of it that say what no model here has.
    unread: Vec<&'static str>,
    /// It follows this joint.
    mimics: Option<String>,
}

/// Reads a robot; it is not checked yet.
pub(super) fn read(path: &Path, text: &str) -> Result<TreeRobot, RobotReadError> {
    parsed(path, text).map_err(RobotReadError)
}

fn parsed(path: &Path, text: &str) -> Result<TreeRobot, String> {
    let at = |(line, why): FileFault| format!("{}:{line}: {why}", path.display());
    let document = Document::parse(text).map_err(|e| at((e.pos().row, e.to_string())))?;
    design(&document).map_err(at)
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|c| c.has_tag_name(name))
}

fn numbers<const N: usize>(node: Node<'_, '_>, name: &str, default: [f64; N]) -> Result<[f64; N], FileFault> {
    node.attribute(name).map_or(Ok(default), |text| fixed(node, name, text))
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64, FileFault> {
    let [value] = fixed(node, name, needed(node, name)?)?;
    Ok(value)
}

/// `<origin xyz rpy>` of a node: roll about x, pitch about y, yaw about z, in this order about the parent's axes.
fn origin(node: Node<'_, '_>) -> Result<SpatialFrame<f64>, FileFault> {
    let Some(o) = child(node, "origin") else {
        return Ok(SpatialFrame::identity());
    };
    let [r, p, y] = numbers(o, "rpy", [0.0; 3])?;
    let turn = |axis: usize, angle: f64| {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        about(unit, angle)
    };
    let rotation = product(&turn(2, y), &product(&turn(1, p), &turn(0, r)));
    Ok(SpatialFrame { rotation, origin: numbers(o, "xyz", [0.0; 3])? })
}

fn inertial(link: Node<'_, '_>) -> Result<Option<Rigid<f64>>, FileFault> {
    let Some(node) = child(link, "inertial") else { return Ok(None) };
    let part = |name: &str| {
        child(node, name).ok_or_else(|| (line(node), format!("<inertial> has no <{name}>; give it one")))
    };
    let (mass, i) = (number(part("mass")?, "value")?, part("inertia")?);
    if mass < 0.0 {
        return Err((line(node), format!("mass = {mass}: no body has a mass below 0")));
    }
    let of = |name: &str| number(i, name);
    let (xy, xz, yz) = (of("ixy")?, of("ixz")?, of("iyz")?);
    let own: Matrix3<f64> = [[of("ixx")?, xy, xz], [xy, of("iyy")?, yz], [xz, yz, of("izz")?]];
    let frame = origin(node)?;
    Ok(Some(Rigid::new(mass, [0.0; 3], &own).outwards(&frame)))
}

fn design(document: &Document<'_>) -> Result<TreeRobot, FileFault> {
    let robot = document.root_element();
    if !robot.has_tag_name("robot") {
        let found = robot.tag_name().name();
        return Err((
            line(robot),
            format!("the root is <{found}>, of URDF it is <robot>; is this another format?"),
        ));
    }
    written::check(robot)?;
    let mut links = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("link")) {
        links.push(FileLink { name: needed(node, "name")?.into(), rigid: inertial(node)?, line: line(node) });
    }
    once("the link", links.iter().map(|b| (b.name.as_str(), b.line)))?;
    let mut read = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("joint")) {
        read.push(joint(node, &links)?);
    }
    once("the joint", read.iter().map(|j| (j.own.name.as_str(), j.own.line)))?;
    let mut notes = unread(&read);
    notes.extend(mimics(&read));
    let joints: Vec<FileJoint> = read.into_iter().map(|j| j.own).collect();
    let root = root(line(robot), &links, &joints)?;
    let mut made = assemble(robot.attribute("name").unwrap_or("robot"), root, &links, &joints)?;
    made.losses = "<dynamics> (damping, friction)";
    made.notes = notes;
    made.notes.extend(written::transmissions(robot, &joints));
    Ok(made)
}

fn joint(node: Node<'_, '_>, links: &[FileLink]) -> Result<UrdfJoint, FileFault> {
    let (name, kind) = (needed(node, "name")?, needed(node, "type")?);
    let moving = match kind {
        "revolute" | "continuous" => FileJointKind::Revolute,
        "prismatic" => FileJointKind::Prismatic,
        "fixed" => FileJointKind::Fixed,
        "floating" => FileJointKind::Floating,
        other => {
            let why = "it is revolute, continuous, prismatic or fixed";
            return Err((line(node), format!("joint `{name}`: type `{other}` cannot be had; {why}")));
        }
    };
    let link = |tag: &str| -> Result<String, FileFault> {
        let part = child(node, tag).ok_or_else(|| (line(node), format!("joint `{name}` has no <{tag}>")))?;
        let wanted = needed(part, "link")?;
        if links.iter().any(|b| b.name == wanted) {
            return Ok(wanted.to_owned());
        }
        let near = did_you_mean(wanted, links.iter().map(|b| b.name.as_str()), "name a link of this file");
        Err((line(part), format!("joint `{name}`: there is no link `{wanted}`; {near}")))
    };
    let axis = child(node, "axis").map_or(Ok([1.0, 0.0, 0.0]), |a| numbers(a, "xyz", [1.0, 0.0, 0.0]))?;
    let of_dynamics = |name: &str| -> Result<f64, FileFault> {
        let Some(part) = child(node, "dynamics") else { return Ok(0.0) };
        let [value] = numbers(part, name, [0.0])?;
        if value < 0.0 {
            return Err((
                line(part),
                format!("joint `{name}`: {name}=\"{value}\" is below 0; write what it loses"),
            ));
        }
        Ok(value)
    };
    let friction = JointFriction { viscous: of_dynamics("damping")?, coulomb: of_dynamics("friction")? };
    let moves = matches!(moving, FileJointKind::Revolute | FileJointKind::Prismatic);
    let unread = UNREAD.into_iter().filter(|tag| moves && child(node, tag).is_some()).collect();
    let mut own = FileJoint {
        name: name.to_owned(),
        kind: moving,
        parent: link("parent")?,
        child: link("child")?,
        frame: origin(node)?,
        axis,
        friction,
        armature: 0.0,
        line: line(node),
    };
    let mimics = match child(node, "mimic").filter(|_| moves) {
        Some(mimic) => {
            hold(&mut own, mimic)?;
            Some(needed(mimic, "joint")?.to_owned())
        }
        None => None,
    };
    Ok(UrdfJoint { own, unread, mimics })
}

/// A joint that follows another one is fixed where it is while the other one is at 0.
fn hold(joint: &mut FileJoint, mimic: Node<'_, '_>) -> Result<(), FileFault> {
    let [at] = numbers(mimic, "offset", [0.0])?;
    let length = joint.axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    let axis = scale(1.0 / length, joint.axis);
    if at != 0.0 && !length.is_normal() {
        return Err((joint.line, format!("joint `{}`: its axis has no length; give it one", joint.name)));
    }
    if at != 0.0 {
        let (rotation, origin) = match joint.kind {
            FileJointKind::Revolute => (about(axis, at), [0.0; 3]),
            _ => (identity(), scale(at, axis)),
        };
        joint.frame = joint.frame.then(&SpatialFrame { rotation, origin });
    }
    joint.kind = FileJointKind::Fixed;
    Ok(())
}

/// A line on all joints that follow others.
fn mimics(joints: &[UrdfJoint]) -> Option<String> {
    let all: Vec<_> = joints.iter().filter(|j| j.mimics.is_some()).map(|j| j.own.name.as_str()).collect();
    (!all.is_empty()).then(|| {
        format!(
            "<mimic> of {} is not read: they are fixed where they are while the joints that they follow are at 0",
            counted(&all)
        )
    })
}

/// Parts of a joint that no model here has.
const UNREAD: [&str; 3] = ["limit", "safety_controller", "calibration"];

/// A line for each kind of what joints say and no model here has.
fn unread(joints: &[UrdfJoint]) -> Vec<String> {
    let note = |tag: &&str| {
        let names: Vec<_> =
            joints.iter().filter(|j| j.unread.contains(tag)).map(|j| j.own.name.as_str()).collect();
        (!names.is_empty())
            .then(|| format!("<{tag}> of {} is not read: no model here has it", counted(&names)))
    };
    UNREAD.iter().filter_map(note).collect()
}

mod written;

#[cfg(test)]
mod tests;
