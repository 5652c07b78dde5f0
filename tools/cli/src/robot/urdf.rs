//! Robots as URDF: links with their inertia on joints. What is fixed to a link becomes part of it.

use std::path::Path;

use roxmltree::{Document, Node};
use trueup_models::space::design::{Design, Link, Motor, Tip};
use trueup_models::space::spatial::{Frame, Rigid};
use trueup_models::space::tree::Joint as Kind;
use trueup_models::space::vector::{Matrix, Vector, add, identity, product, scale};

use crate::error::Error;
use crate::near::suggestion;

/// Place in the file and what is wrong with the mend.
type Fault = (u32, String);

struct Joint<'a> {
    name: &'a str,
    kind: &'a str,
    parent: &'a str,
    child: &'a str,
    /// Its axes in those of the parent link.
    frame: Frame<f64>,
    axis: Vector<f64>,
    line: u32,
}

struct Body<'a> {
    name: &'a str,
    /// About the link's origin; `None`: the file gives no inertia.
    rigid: Option<Rigid<f64>>,
    line: u32,
}

/// Reads a robot; it is not checked yet.
pub(super) fn read(path: &Path, text: &str) -> Result<Design, Error> {
    parsed(path, text).map_err(Error::Failed)
}

fn parsed(path: &Path, text: &str) -> Result<Design, String> {
    let at = |(line, why): Fault| format!("{}:{line}: {why}", path.display());
    let document = Document::parse(text).map_err(|e| at((e.pos().row, e.to_string())))?;
    design(&document).map_err(at)
}

fn line(node: Node<'_, '_>) -> u32 {
    node.document().text_pos_at(node.range().start).row
}

fn child<'a, 'i>(node: Node<'a, 'i>, name: &str) -> Option<Node<'a, 'i>> {
    node.children().find(|c| c.has_tag_name(name))
}

fn needed<'a>(node: Node<'a, '_>, name: &str) -> Result<&'a str, Fault> {
    let why = || format!("<{}> has no attribute `{name}`; give it one", node.tag_name().name());
    node.attribute(name).ok_or_else(|| (line(node), why()))
}

fn numbers<const N: usize>(node: Node<'_, '_>, name: &str, default: [f64; N]) -> Result<[f64; N], Fault> {
    let Some(text) = node.attribute(name) else { return Ok(default) };
    let list: Vec<f64> = text.split_whitespace().filter_map(|w| w.parse().ok()).collect();
    let fine = list.len() == N
        && list.len() == text.split_whitespace().count()
        && list.iter().all(|v| v.is_finite());
    fine.then(|| std::array::from_fn(|k| list[k])).ok_or_else(|| {
        (line(node), format!("{name}=\"{text}\": give {N} finite number(s), with blanks between"))
    })
}

fn number(node: Node<'_, '_>, name: &str) -> Result<f64, Fault> {
    needed(node, name)?;
    Ok(numbers::<1>(node, name, [0.0])?[0])
}

/// `<origin xyz rpy>` of a node: roll about x, pitch about y, yaw about z, in this order about the parent's axes.
fn origin(node: Node<'_, '_>) -> Result<Frame<f64>, Fault> {
    let Some(o) = child(node, "origin") else {
        return Ok(Frame { rotation: identity(), origin: [0.0; 3] });
    };
    let [r, p, y] = numbers(o, "rpy", [0.0; 3])?;
    let turn = |axis: usize, angle: f64| {
        let mut unit = [0.0; 3];
        unit[axis] = 1.0;
        trueup_models::space::attitude::about(unit, angle)
    };
    let rotation = product(&turn(2, y), &product(&turn(1, p), &turn(0, r)));
    Ok(Frame { rotation, origin: numbers(o, "xyz", [0.0; 3])? })
}

fn inertial(link: Node<'_, '_>) -> Result<Option<Rigid<f64>>, Fault> {
    let Some(node) = child(link, "inertial") else { return Ok(None) };
    let part = |name: &str| {
        child(node, name).ok_or_else(|| (line(node), format!("<inertial> has no <{name}>; give it one")))
    };
    let (mass, i) = (number(part("mass")?, "value")?, part("inertia")?);
    let of = |name: &str| number(i, name);
    let (xy, xz, yz) = (of("ixy")?, of("ixz")?, of("iyz")?);
    let own: Matrix<f64> = [[of("ixx")?, xy, xz], [xy, of("iyy")?, yz], [xz, yz, of("izz")?]];
    let frame = origin(node)?;
    Ok(Some(Rigid::new(mass, [0.0; 3], &own).outwards(&frame)))
}

/// Mass, centre of mass, inertia about it.
fn central(r: &Rigid<f64>) -> (f64, Vector<f64>, Matrix<f64>) {
    let center = if r.mass > 0.0 { scale(1.0 / r.mass, r.first) } else { [0.0; 3] };
    let back = Rigid::new(r.mass, center, &[[0.0; 3]; 3]);
    let inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|k| r.inertia[i][k] - back.inertia[i][k]));
    (r.mass, center, inertia)
}

/// What a body of the robot is made of: links fixed to each other.
struct Gathered<'a> {
    rigid: Rigid<f64>,
    /// Joints that move, in the axes of the body's own link.
    joints: Vec<(&'a Joint<'a>, Frame<f64>)>,
    /// Fixed links without inertia and without anything on them: names and places.
    frames: Vec<(&'a str, Vector<f64>)>,
}

const NOTHING: Rigid<f64> = Rigid { mass: 0.0, first: [0.0; 3], inertia: [[0.0; 3]; 3] };

fn gather<'a>(link: &'a str, bodies: &'a [Body<'a>], joints: &'a [Joint<'a>]) -> Gathered<'a> {
    let mut all = Gathered { rigid: NOTHING, joints: Vec::new(), frames: Vec::new() };
    let mut rest = vec![(link, Frame { rotation: identity(), origin: [0.0; 3] })];
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
        if own.is_none() && !carries {
            all.frames.push((link, frame.origin));
        }
    }
    all
}

fn design(document: &Document<'_>) -> Result<Design, Fault> {
    let robot = document.root_element();
    if !robot.has_tag_name("robot") {
        let found = robot.tag_name().name();
        return Err((
            line(robot),
            format!("the root is <{found}>, of URDF it is <robot>; is this another format?"),
        ));
    }
    let mut bodies = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("link")) {
        bodies.push(Body { name: needed(node, "name")?, rigid: inertial(node)?, line: line(node) });
    }
    let mut joints = Vec::new();
    for node in robot.children().filter(|c| c.has_tag_name("joint")) {
        joints.push(joint(node, &bodies)?);
    }
    if let Some((joint, first)) = joints.iter().enumerate().find_map(|(k, j)| {
        joints[..k].iter().find(|other: &&Joint<'_>| other.child == j.child).map(|other| (j, other))
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
    assemble(robot.attribute("name").unwrap_or("robot"), root, &bodies, &joints)
}

fn joint<'a>(node: Node<'a, '_>, bodies: &[Body<'_>]) -> Result<Joint<'a>, Fault> {
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
    let link = |tag: &str| -> Result<&'a str, Fault> {
        let part = child(node, tag).ok_or_else(|| (line(node), format!("joint `{name}` has no <{tag}>")))?;
        let wanted = needed(part, "link")?;
        if bodies.iter().any(|b| b.name == wanted) {
            return Ok(wanted);
        }
        let near = suggestion(wanted, bodies.iter().map(|b| b.name), "name a link of this file");
        Err((line(part), format!("joint `{name}`: there is no link `{wanted}`; {near}")))
    };
    let axis = child(node, "axis").map_or(Ok([1.0, 0.0, 0.0]), |a| numbers(a, "xyz", [1.0, 0.0, 0.0]))?;
    Ok(Joint {
        name,
        kind,
        parent: link("parent")?,
        child: link("child")?,
        frame: origin(node)?,
        axis,
        line: line(node),
    })
}

fn assemble(name: &str, root: &Body<'_>, bodies: &[Body<'_>], joints: &[Joint<'_>]) -> Result<Design, Fault> {
    let mut base = gather(root.name, bodies, joints);
    // A world that carries a robot which floats is no part of it.
    if base.rigid.mass == 0.0
        && let [(only, _)] = base.joints[..]
        && only.kind == "floating"
    {
        base = gather(only.child, bodies, joints);
    }
    let held = base.rigid.mass == 0.0;
    let (base_mass, center, base_inertia) =
        if held { (1.0, [0.0; 3], identity()) } else { central(&base.rigid) };
    let mut design = Design {
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
        axial_stiffening: false,
    };
    // Base axes lie in the centre of mass.
    let mut rest: Vec<(usize, &Joint<'_>, Frame<f64>)> = Vec::new();
    let shifted = |f: &Frame<f64>| Frame { origin: add(f.origin, scale(-1.0, center)), ..*f };
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
        design.links.push(Link {
            name: joint.child.to_owned(),
            parent,
            joint: if joint.kind == "prismatic" { Kind::Prismatic } else { Kind::Revolute },
            mass,
            center_of_mass,
            inertia,
            position: frame.origin,
            orientation: quaternion(&frame.rotation),
            axis: joint.axis,
            motor: Motor::default(),
        });
        let own = design.links.len();
        if body.joints.is_empty() {
            let (tip, offset) = body.frames.last().copied().unwrap_or((joint.child, [0.0; 3]));
            let mount = design.mount(own);
            design.tips.push(Tip { name: tip.to_owned(), body: own, offset, mount });
        }
        body.joints.iter().rev().for_each(|(j, f)| rest.push((own, *j, *f)));
    }
    Ok(design)
}

/// Of a rotation, by the largest of its elements.
fn quaternion(r: &Matrix<f64>) -> [f64; 4] {
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

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_models::space::attitude::rotation;

    #[test]
    fn quaternions_are_those_of_their_rotations() {
        for q in [[1.0, 0.0, 0.0, 0.0], [0.1, 0.9, -0.3, 0.2], [0.0, 0.1, 0.9, 0.2], [-0.3, 0.2, 0.1, 0.9]] {
            let r = rotation(q);
            let again = rotation(quaternion(&r));
            let off = r.iter().flatten().zip(again.iter().flatten()).map(|(a, b)| (a - b).abs());
            assert!(off.fold(0.0, f64::max) < 1e-15, "{q:?}");
        }
    }

    const ARM: &str = include_str!("../../tests/data/arm.urdf");

    /// Against numbers by hand: what is fixed to a link is part of it, the base's axes lie in its centre of mass.
    #[test]
    fn an_arm_on_a_base() {
        let d = parsed(Path::new("arm.urdf"), ARM).unwrap();
        d.check().unwrap();
        assert_eq!((d.name.as_str(), d.held, d.links.len()), ("arm", false, 2));
        // 90 kg at the origin and 10 kg at x = 1.
        assert!((d.base_mass - 100.0).abs() < 1e-12 && (d.base_inertia[0][0] - 10.0).abs() < 1e-12);
        assert!((d.base_inertia[1][1] - (10.0 + 90.0 * 0.01 + 10.0 * 0.81)).abs() < 1e-12);
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(near(&d.links[0].position, &[0.3, 0.0, 0.2]));
        // Turned by 90 degrees about z.
        let half = 0.5_f64.sqrt();
        assert!(near(&d.links[0].orientation, &[half, 0.0, 0.0, half]));
        assert_eq!((d.links[1].parent, d.links[1].joint), (1, Kind::Prismatic));
        assert_eq!((d.tips[0].name.as_str(), d.tips[0].body, d.tips[0].offset), ("hand", 2, [0.3, 0.0, 0.0]));
    }

    #[test]
    fn what_is_no_tree_is_told_with_its_line() {
        for (from, to, said) in [
            ("<child link=\"slide\"/>", "<child link=\"slidee\"/>", "did you mean `slide`?"),
            ("type=\"prismatic\"", "type=\"planar\"", "type `planar` cannot be had"),
            ("<!-- mimic -->", "<mimic joint=\"turn\"/>", "joint `push`: it mimics another joint"),
            (
                "<!-- loop -->",
                "<joint name=\"loop\" type=\"fixed\"><parent link=\"slide\"/><child link=\"upper\"/></joint>",
                "a loop, which a tree has not",
            ),
            ("<mass value=\"2\"/>", "<mass value=\"0\"/>", "it moves and has no mass"),
            ("<mass value=\"2\"/>", "", "<inertial> has no <mass>"),
            ("xyz=\"0.4 0 0.2\"", "xyz=\"0.4 0\"", "give 3 finite number(s)"),
            ("<robot name=\"arm\">", "<sdf name=\"arm\">", "expected"),
        ] {
            assert!(ARM.contains(from), "{from}");
            let text = ARM.replacen(from, to, 1);
            let why = parsed(Path::new("arm.urdf"), &text).unwrap_err();
            assert!(why.contains(said) && why.starts_with("arm.urdf:"), "{from}: {why}");
        }
    }
}
