//! Robots as URDF: links with their inertia on joints. What is fixed to a link becomes part of it.

use std::path::Path;

use roxmltree::{Document, Node};
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, RobotDesign};
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::tree::JointType as Kind;
use trueup_models::space::vector::{Matrix3, Vector3, add, identity, product, scale};

use crate::error::CliError;
use crate::near::suggestion;

/// Place in the file, error and remedy.
type UrdfFault = (u32, String);

struct UrdfJoint<'a> {
    name: &'a str,
    kind: &'a str,
    parent: &'a str,
    child: &'a str,
    /// Its axes in those of the parent link.
    frame: SpatialFrame<f64>,
    axis: Vector3<f64>,
    friction: JointFriction,
    /// Elements of it that say what no model here has.
    unread: Vec<&'static str>,
    line: u32,
}

/// What makers publish of a joint's losses, on the joint's side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct JointFriction {
    /// N.m.s/rad; of a prismatic joint N.s/m.
    pub(crate) viscous: f64,
    /// N.m; of a prismatic joint N.
    pub(crate) coulomb: f64,
}

impl JointFriction {
    fn is_there(self) -> bool {
        self != Self::default()
    }
}

/// What a file makes.
pub(super) struct UrdfRobot {
    pub(super) design: RobotDesign,
    /// Of each moving body, in the order of the design's links.
    pub(super) friction: Vec<JointFriction>,
    /// What of the file is not used.
    pub(super) notes: Vec<String>,
    /// Why the base is free, if it is.
    pub(super) floats: Option<String>,
}

struct UrdfBody<'a> {
    name: &'a str,
    /// About the link's origin; `None`: the file gives no inertia.
    rigid: Option<Rigid<f64>>,
    line: u32,
}

/// Reads a robot; it is not checked yet.
pub(super) fn read(path: &Path, text: &str) -> Result<UrdfRobot, CliError> {
    parsed(path, text).map_err(CliError::Failed)
}

fn parsed(path: &Path, text: &str) -> Result<UrdfRobot, String> {
    let at = |(line, why): UrdfFault| format!("{}:{line}: {why}", path.display());
    let document = Document::parse(text).map_err(|e| at((e.pos().row, e.to_string())))?;
    design(&document).map_err(at)
}

fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|c| c.has_tag_name(name))
}

fn needed<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, UrdfFault> {
    let why = || format!("<{}> has no attribute `{name}`; give it one", node.tag_name().name());
    node.attribute(name).ok_or_else(|| (line(node), why()))
}

fn numbers<const N: usize>(node: Node<'_, '_>, name: &str, default: [f64; N]) -> Result<[f64; N], UrdfFault> {
    let Some(text) = node.attribute(name) else { return Ok(default) };
    let list: Vec<f64> = text.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let fine = list.len() == N
        && list.len() == text.split_whitespace().count()
        && list.iter().all(|v| v.is_finite());
    fine.then(|| std::array::from_fn(|k| list[k])).ok_or_else(|| {
        (line(node), format!("{name}=\"{text}\": give {N} finite number(s), with blanks between"))
    })
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64, UrdfFault> {
    needed(node, name)?;
    Ok(numbers::<1>(node, name, [0.0])?[0])
}

/// `<origin xyz rpy>` of a node: roll about x, pitch about y, yaw about z, in this order about the parent's axes.
fn origin(node: Node<'_, '_>) -> Result<SpatialFrame<f64>, UrdfFault> {
    let Some(o) = child(node, "origin") else {
        return Ok(SpatialFrame { rotation: identity(), origin: [0.0; 3] });
    };
    let [r, p, y] = numbers(o, "rpy", [0.0; 3])?;
    let turn = |axis: usize, angle: f64| {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        trueup_models::space::attitude::about(unit, angle)
    };
    let rotation = product(&turn(2, y), &product(&turn(1, p), &turn(0, r)));
    Ok(SpatialFrame { rotation, origin: numbers(o, "xyz", [0.0; 3])? })
}

fn inertial(link: Node<'_, '_>) -> Result<Option<Rigid<f64>>, UrdfFault> {
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

/// Mass, centre of mass, inertia about it.
fn central(r: &Rigid<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let center = if r.mass > 0.0 { scale(1.0 / r.mass, r.first) } else { [0.0; 3] };
    let back = Rigid::new(r.mass, center, &[[0.0; 3]; 3]);
    let inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|k| r.inertia[i][k] - back.inertia[i][k]));
    (r.mass, center, inertia)
}

/// What a body of the robot is made of: links fixed to each other.
struct MergedLinks<'a> {
    rigid: Rigid<f64>,
    /// Joints that move, in the axes of the body's own link.
    joints: Vec<(&'a UrdfJoint<'a>, SpatialFrame<f64>)>,
    /// Fixed links without anything on them, those without mass last: names and places.
    frames: Vec<(&'a str, Vector3<f64>)>,
}

impl<'a> MergedLinks<'a> {
    /// What it carries at its end: the last of its fixed links, one without mass before one that has some.
    fn tip(&self) -> Option<(&'a str, Vector3<f64>)> {
        self.frames.last().copied()
    }
}

const NOTHING: Rigid<f64> = Rigid { mass: 0.0, first: [0.0; 3], inertia: [[0.0; 3]; 3] };

fn gather<'a>(link: &'a str, bodies: &'a [UrdfBody<'a>], joints: &'a [UrdfJoint<'a>]) -> MergedLinks<'a> {
    let mut all = MergedLinks { rigid: NOTHING, joints: Vec::new(), frames: Vec::new() };
    let (whole, mut bare) = (link, Vec::new());
    let mut rest = vec![(link, SpatialFrame { rotation: identity(), origin: [0.0; 3] })];
    while let Some((link, frame)) = rest.pop() {
        let own = bodies.iter().find(|b| b.name == link).and_then(|b| b.rigid.as_ref());
        if let Some(own) = own {
            all.rigid = all.rigid.plus(&own.outwards(&frame));
        }
        let mut carries = false;
        for joint in joints.iter().filter(|j| j.parent == link) {
            carries = true;
            let place = frame.then(&joint.frame);
            if joint.kind == "fixed" {
                rest.push((joint.child, place));
            } else {
                all.joints.push((joint, place));
            }
        }
        // A hand of mass 0 is a place all the same.
        let massless = own.is_none_or(|own| own.mass == 0.0);
        if !carries && (massless || link != whole) {
            (if massless { &mut bare } else { &mut all.frames }).push((link, frame.origin));
        }
    }
    all.frames.append(&mut bare);
    all
}

/// Two of one name, which a reference by name cannot distinguish.
fn once<'a>(what: &str, all: impl Iterator<Item = (&'a str, u32)>) -> Result<(), UrdfFault> {
    let mut seen: Vec<(&str, u32)> = Vec::new();
    for (name, line) in all {
        if let Some((_, first)) = seen.iter().find(|(before, _)| *before == name) {
            return Err((
                line,
                format!("{what} `{name}` is defined in line {first} already; give one of them another name"),
            ));
        }
        seen.push((name, line));
    }
    Ok(())
}

fn design(document: &Document<'_>) -> Result<UrdfRobot, UrdfFault> {
    let robot = document.root_element();
    if !robot.has_tag_name("robot") {
        let found = robot.tag_name().name();
        return Err((
            line(robot),
            format!("the root is <{found}>, of URDF it is <robot>; is this another format?"),
        ));
    }
    written::check(robot)?;
    let mut bodies = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("link")) {
        bodies.push(UrdfBody { name: needed(node, "name")?, rigid: inertial(node)?, line: line(node) });
    }
    once("the link", bodies.iter().map(|b| (b.name, b.line)))?;
    let mut joints = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("joint")) {
        joints.push(joint(node, &bodies)?);
    }
    once("the joint", joints.iter().map(|j| (j.name, j.line)))?;
    let root = root(robot, &bodies, &joints)?;
    let mut made = assemble(robot.attribute("name").unwrap_or("robot"), root, &bodies, &joints)?;
    made.notes.extend(written::transmissions(robot, &joints));
    Ok(made)
}

/// The link on which all others hang: the links are a tree.
fn root<'b, 'a>(
    robot: Node<'_, '_>,
    bodies: &'b [UrdfBody<'a>],
    joints: &[UrdfJoint<'a>],
) -> Result<&'b UrdfBody<'a>, UrdfFault> {
    if let Some((joint, first)) = joints.iter().enumerate().find_map(|(k, j)| {
        joints[..k].iter().find(|other: &&UrdfJoint<'_>| other.child == j.child).map(|other| (j, other))
    }) {
        let (child, name, other) = (joint.child, joint.name, first.name);
        return Err((
            joint.line,
            format!(
                "link `{child}` hangs on two joints, `{other}` and `{name}`: a loop, which a tree has not; cut it open"
            ),
        ));
    }
    let mut roots = bodies.iter().filter(|b| !joints.iter().any(|j| j.child == b.name));
    let Some(root) = roots.next() else {
        let why = "every link hangs on another one: a loop, which a tree has not; cut it open";
        return Err((line(robot), if bodies.is_empty() { "there is no <link>".into() } else { why.into() }));
    };
    if let Some(other) = roots.next() {
        let why = format!("links `{}` and `{}` both hang on nothing; join them", root.name, other.name);
        return Err((other.line, why));
    }
    // What does not hang on the root, however far down, hangs on itself.
    let mut hangs = vec![root.name];
    let mut at = 0;
    while let Some(link) = hangs.get(at).copied() {
        hangs.extend(joints.iter().filter(|j| j.parent == link).map(|j| j.child));
        at += 1;
    }
    if let Some(joint) = joints.iter().find(|j| !hangs.contains(&j.child)) {
        let why = format!(
            "link `{}` hangs on itself by joint `{}`: a loop, which a tree has not; cut it open",
            joint.child, joint.name
        );
        return Err((joint.line, why));
    }
    Ok(root)
}

fn joint<'a>(node: Node<'a, '_>, bodies: &[UrdfBody<'_>]) -> Result<UrdfJoint<'a>, UrdfFault> {
    let (name, kind) = (needed(node, "name")?, needed(node, "type")?);
    let wrong = |why: String| Err((line(node), format!("joint `{name}`: {why}")));
    if child(node, "mimic").is_some() {
        return wrong(
            "it mimics another joint, which cannot be had; give it a drive of its own, or make it fixed"
                .into(),
        );
    }
    if !["revolute", "continuous", "prismatic", "fixed", "floating"].contains(&kind) {
        return wrong(format!("type `{kind}` cannot be had; it is revolute, continuous, prismatic or fixed"));
    }
    let link = |tag: &str| -> Result<&'a str, UrdfFault> {
        let part = child(node, tag).ok_or_else(|| (line(node), format!("joint `{name}` has no <{tag}>")))?;
        let wanted = needed(part, "link")?;
        if bodies.iter().any(|b| b.name == wanted) {
            return Ok(wanted);
        }
        let near = suggestion(wanted, bodies.iter().map(|b| b.name), "name a link of this file");
        Err((line(part), format!("joint `{name}`: there is no link `{wanted}`; {near}")))
    };
    let axis = child(node, "axis").map_or(Ok([1.0, 0.0, 0.0]), |a| numbers(a, "xyz", [1.0, 0.0, 0.0]))?;
    let of_dynamics = |name: &str| -> Result<f64, UrdfFault> {
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
    let moves = kind != "fixed" && kind != "floating";
    let unread = UNREAD.into_iter().filter(|tag| moves && child(node, tag).is_some()).collect();
    Ok(UrdfJoint {
        name,
        kind,
        parent: link("parent")?,
        child: link("child")?,
        frame: origin(node)?,
        axis,
        friction,
        unread,
        line: line(node),
    })
}

/// Parts of a joint that no model here has.
const UNREAD: [&str; 3] = ["limit", "safety_controller", "calibration"];

/// The name of a link that is the world: what is fixed to it is bolted to the ground.
const WORLD: &str = "world";

fn assemble(
    name: &str,
    root: &UrdfBody<'_>,
    bodies: &[UrdfBody<'_>],
    joints: &[UrdfJoint<'_>],
) -> Result<UrdfRobot, UrdfFault> {
    let mut base = gather(root.name, bodies, joints);
    // A world that carries a robot which floats is no part of it.
    if base.rigid.mass == 0.0
        && let [(only, _)] = base.joints[..]
        && only.kind == "floating"
    {
        base = gather(only.child, bodies, joints);
    }
    let bolted = root.name == WORLD && joints.iter().any(|j| j.parent == WORLD && j.kind == "fixed");
    let held = base.rigid.mass == 0.0 || bolted;
    let mut friction = Vec::new();
    let (base_mass, center, base_inertia) =
        if held { (1.0, [0.0; 3], identity()) } else { central(&base.rigid) };
    let floats = (!held).then(|| {
        let name = root.name;
        format!("no link is bolted down: the base (`{name}`, {base_mass} kg) floats; --held holds it, as does a root link `{WORLD}` to which it is fixed")
    });
    let mut design = RobotDesign {
        name: name.to_owned(),
        base_mass,
        base_inertia,
        links: Vec::new(),
        tips: Vec::new(),
        thrusters: Vec::new(),
        appendages: Vec::new(),
        held,
        geared: true,
        analysis: false,
        tables: Vec::new(),
        flexures: Vec::new(),
        link_tables: Vec::new(),
        axial_stiffening: None,
    };
    // Base axes have their origin in the centre of mass.
    let mut rest: Vec<(usize, &UrdfJoint<'_>, SpatialFrame<f64>)> = Vec::new();
    let shifted = |f: &SpatialFrame<f64>| SpatialFrame { origin: add(f.origin, scale(-1.0, center)), ..*f };
    base.joints.iter().rev().for_each(|(j, f)| rest.push((0, *j, shifted(f))));
    while let Some((parent, joint, frame)) = rest.pop() {
        let wrong = |why: &str| Err((joint.line, format!("joint `{}`: {why}", joint.name)));
        if joint.kind == "floating" {
            return wrong("a floating joint can only carry the base");
        }
        let body = gather(joint.child, bodies, joints);
        if body.rigid.mass <= 0.0 {
            let line = bodies.iter().find(|b| b.name == joint.child).map_or(joint.line, |b| b.line);
            let why = "it moves and has no mass; give it an <inertial> with <mass> and <inertia>";
            return Err((line, format!("link `{}`: {why}", joint.child)));
        }
        let (mass, center_of_mass, inertia) = central(&body.rigid);
        design.links.push(DesignLink {
            name: joint.child.to_owned(),
            parent,
            joint: if joint.kind == "prismatic" { Kind::Prismatic } else { Kind::Revolute },
            mass,
            center_of_mass,
            inertia,
            position: frame.origin,
            orientation: quaternion(&frame.rotation),
            axis: joint.axis,
            motor: DesignMotor::default(),
        });
        friction.push(joint.friction);
        let own = design.links.len();
        if body.joints.is_empty() {
            let (tip, offset) = body.tip().unwrap_or((joint.child, [0.0; 3]));
            let mount = design.mount(own);
            design.tips.push(DesignTip { name: tip.to_owned(), body: own, offset, mount });
        }
        body.joints.iter().rev().for_each(|(j, f)| rest.push((own, *j, *f)));
    }
    Ok(UrdfRobot { design, friction, notes: unread(joints), floats })
}

/// A line for each kind of what joints say and no model here has.
fn unread(joints: &[UrdfJoint<'_>]) -> Vec<String> {
    let note = |tag: &&str| {
        let names: Vec<_> = joints.iter().filter(|j| j.unread.contains(tag)).map(|j| j.name).collect();
        (!names.is_empty())
            .then(|| format!("<{tag}> of {} is not read: no model here has it", counted(&names)))
    };
    UNREAD.iter().filter_map(note).collect()
}

/// `3 joints (a, b, c)`.
fn counted(names: &[&str]) -> String {
    let s = if names.len() == 1 { "" } else { "s" };
    format!("{} joint{s} ({})", names.len(), names.join(", "))
}

impl UrdfRobot {
    /// That nothing is made of what its joints lose.
    pub(super) fn without_friction(&self) -> Option<String> {
        let lossy = self.design.links.iter().zip(&self.friction).filter(|(_, f)| f.is_there());
        let names: Vec<_> = lossy.map(|(l, _)| l.name.as_str()).collect();
        (!names.is_empty()).then(|| {
            let n = names.len();
            format!("<dynamics> (damping, friction) of the joints of {n} links ({}) is not in this model; FlexibleArm has both", names.join(", "))
        })
    }
}

/// Of a rotation, by the largest of its elements.
fn quaternion(r: &Matrix3<f64>) -> [f64; 4] {
    let trace = r[0][0] + r[1][1] + r[2][2];
    let squares = [trace, r[0][0], r[1][1], r[2][2]];
    let most = (0..4).fold(0, |b, k| if squares[k] > squares[b] { k } else { b });
    let mut q = [0.0; 4];
    q[most] = 0.5 * (1.0 + 2.0 * squares[most] - trace).max(0.0).sqrt();
    let f = 0.25 / q[most];
    if most == 0 {
        (0..3).for_each(|i| q[1 + i] = (r[(i + 2) % 3][(i + 1) % 3] - r[(i + 1) % 3][(i + 2) % 3]) * f);
    } else {
        let (i, j, k) = (most - 1, most % 3, (most + 1) % 3);
        q[0] = (r[k][j] - r[j][k]) * f;
        q[1 + j] = (r[i][j] + r[j][i]) * f;
        q[1 + k] = (r[i][k] + r[k][i]) * f;
    }
    q
}

mod written;

#[cfg(test)]
mod tests;
