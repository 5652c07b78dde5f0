//! Robots as other tools describe them: links on joints. What is fixed to a link becomes part of it.

use trueup_models::space::attitude::quaternion;
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, RobotDesign};
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::tree::JointType;
use trueup_models::space::vector::{Matrix3, Vector3, identity, scale, sub};

/// Line of the file, error and remedy.
pub(super) type FileFault = (u32, String);

/// What a joint of a file leaves free.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FileJointKind {
    Fixed,
    Floating,
    Revolute,
    Prismatic,
}

/// What makers publish of a joint's losses, on the joint's side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct JointFriction {
    /// N.m.s/rad; of a prismatic joint N.s/m.
    pub viscous: f64,
    /// N.m; of a prismatic joint N.
    pub coulomb: f64,
}

impl JointFriction {
    pub(super) fn is_there(self) -> bool {
        self != Self::default()
    }
}

/// A joint of a file.
pub(super) struct FileJoint {
    pub(super) name: String,
    pub(super) kind: FileJointKind,
    pub(super) parent: String,
    pub(super) child: String,
    /// Its axes in those of the parent link.
    pub(super) frame: SpatialFrame<f64>,
    pub(super) axis: Vector3<f64>,
    pub(super) friction: JointFriction,
    /// Inertia that turns with the joint alone, kg.m2 (kg).
    pub(super) armature: f64,
    pub(super) line: u32,
}

/// A link of a file.
pub(super) struct FileLink {
    pub(super) name: String,
    /// About the link's origin; `None`: the file gives no inertia.
    pub(super) rigid: Option<Rigid<f64>>,
    pub(super) line: u32,
}

/// What a file makes.
pub(super) struct TreeRobot {
    pub(super) design: RobotDesign,
    /// Of each moving body, in the order of the design's links.
    pub(super) friction: Vec<JointFriction>,
    /// Names of the joints, in that order.
    pub(super) joints: Vec<String>,
    /// Each link of the file with the body (0: the base) that it is part of, and its axes in those of the body.
    pub(super) places: Vec<(String, usize, SpatialFrame<f64>)>,
    /// The base about the origin of its axes; without mass where the file gives none.
    pub(super) base: Rigid<f64>,
    /// What of the file is not used.
    pub(super) notes: Vec<String>,
    /// Why the base is free, if it is.
    pub(super) floats: Option<String>,
    /// What the file calls losses of joints.
    pub(super) losses: &'static str,
}

/// Mass, centre of mass, inertia about it.
pub(super) fn central(r: &Rigid<f64>) -> (f64, Vector3<f64>, Matrix3<f64>) {
    let center = if r.mass > 0.0 { scale(1.0 / r.mass, r.first) } else { [0.0; 3] };
    let back = Rigid::new(r.mass, center, &[[0.0; 3]; 3]);
    let inertia = [0, 1, 2].map(|i| [0, 1, 2].map(|k| r.inertia[i][k] - back.inertia[i][k]));
    (r.mass, center, inertia)
}

/// What a body of the robot is made of: links fixed to each other.
struct MergedLinks<'a> {
    rigid: Rigid<f64>,
    /// Joints that move, in the axes of the body's own link.
    joints: Vec<(&'a FileJoint, SpatialFrame<f64>)>,
    /// Fixed links without anything on them, those without mass last: names and places.
    frames: Vec<(&'a str, Vector3<f64>)>,
    /// All of its links, in the axes of the body's own one.
    links: Vec<(&'a str, SpatialFrame<f64>)>,
}

impl<'a> MergedLinks<'a> {
    /// What it carries at its end: the last of its fixed links, one without mass before one that has some.
    fn tip(&self) -> Option<(&'a str, Vector3<f64>)> {
        self.frames.last().copied()
    }
}

pub(super) const NOTHING: Rigid<f64> = Rigid { mass: 0.0, first: [0.0; 3], inertia: [[0.0; 3]; 3] };

fn gather<'a>(link: &'a str, links: &'a [FileLink], joints: &'a [FileJoint]) -> MergedLinks<'a> {
    let mut all = MergedLinks { rigid: NOTHING, joints: Vec::new(), frames: Vec::new(), links: Vec::new() };
    let (whole, mut bare) = (link, Vec::new());
    let mut rest = vec![(link, SpatialFrame::identity())];
    while let Some((link, frame)) = rest.pop() {
        all.links.push((link, frame));
        let own = links.iter().find(|b| b.name == link).and_then(|b| b.rigid.as_ref());
        if let Some(own) = own {
            all.rigid = all.rigid.plus(&own.outwards(&frame));
        }
        let mut carries = false;
        for joint in joints.iter().filter(|j| j.parent == link) {
            carries = true;
            let place = frame.then(&joint.frame);
            if joint.kind == FileJointKind::Fixed {
                rest.push((&joint.child, place));
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

/// The name of a link that is the world: what is fixed to it is bolted to the ground.
pub(super) const WORLD: &str = "world";

/// The link on which all others hang: the links are a tree.
pub(super) fn root<'b>(
    line: u32,
    links: &'b [FileLink],
    joints: &[FileJoint],
) -> Result<&'b FileLink, FileFault> {
    if let Some((joint, first)) = joints
        .iter()
        .enumerate()
        .find_map(|(k, j)| joints[..k].iter().find(|other| other.child == j.child).map(|other| (j, other)))
    {
        let (child, name, other) = (&joint.child, &joint.name, &first.name);
        return Err((
            joint.line,
            format!(
                "link `{child}` hangs on two joints, `{other}` and `{name}`: a loop, which a tree has not; cut it open"
            ),
        ));
    }
    let mut roots = links.iter().filter(|b| !joints.iter().any(|j| j.child == b.name));
    let Some(root) = roots.next() else {
        let why = "every link hangs on another one: a loop, which a tree has not; cut it open";
        return Err((line, if links.is_empty() { "there is no <link>".into() } else { why.into() }));
    };
    if let Some(other) = roots.next() {
        let why = format!("links `{}` and `{}` both hang on nothing; join them", root.name, other.name);
        return Err((other.line, why));
    }
    // What does not hang on the root, however far down, hangs on itself.
    let mut hangs = vec![root.name.as_str()];
    let mut at = 0;
    while let Some(link) = hangs.get(at).copied() {
        hangs.extend(joints.iter().filter(|j| j.parent == link).map(|j| j.child.as_str()));
        at += 1;
    }
    if let Some(joint) = joints.iter().find(|j| !hangs.contains(&j.child.as_str())) {
        let why = format!(
            "link `{}` hangs on itself by joint `{}`: a loop, which a tree has not; cut it open",
            joint.child, joint.name
        );
        return Err((joint.line, why));
    }
    Ok(root)
}

/// Two of one name, which a reference by name cannot distinguish.
pub(super) fn once<'a>(what: &str, all: impl Iterator<Item = (&'a str, u32)>) -> Result<(), FileFault> {
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

/// The robot of links and joints that are a tree with this root.
pub(super) fn assemble(
    name: &str,
    root: &FileLink,
    links: &[FileLink],
    joints: &[FileJoint],
) -> Result<TreeRobot, FileFault> {
    let ground = root.name == WORLD;
    let mut base_link = root.name.as_str();
    let mut base = gather(&root.name, links, joints);
    let mut bolted = ground && joints.iter().any(|j| j.parent == WORLD && j.kind == FileJointKind::Fixed);
    // A world that carries a robot which floats is no part of it, nor is what is fixed to it.
    if (base.rigid.mass == 0.0 || ground)
        && let [(only, _)] = base.joints[..]
        && only.kind == FileJointKind::Floating
    {
        base_link = &only.child;
        base = gather(base_link, links, joints);
        bolted = false;
        if base.rigid.mass <= 0.0 {
            return Err(massless(&only.child, only.line, links));
        }
    }
    let held = base.rigid.mass == 0.0 || bolted;
    let (base_mass, center, base_inertia) =
        if held { (1.0, [0.0; 3], identity()) } else { central(&base.rigid) };
    let floats = (!held).then(|| {
        format!("no link is bolted down: the base (`{base_link}`, {base_mass} kg) floats; --held holds it, as does a root link `{WORLD}` to which it is fixed")
    });
    let design = RobotDesign {
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
    let mut made = TreeRobot {
        design,
        friction: Vec::new(),
        joints: Vec::new(),
        places: Vec::new(),
        base: base.rigid,
        notes: Vec::new(),
        floats,
        losses: "friction",
    };
    // Base axes have their origin in the centre of mass.
    let mut rest: Vec<(usize, &FileJoint, SpatialFrame<f64>)> = Vec::new();
    let shifted = |f: &SpatialFrame<f64>| SpatialFrame { origin: sub(f.origin, center), ..*f };
    base.joints.iter().rev().for_each(|(j, f)| rest.push((0, *j, shifted(f))));
    made.places.extend(base.links.iter().map(|(link, f)| ((*link).to_owned(), 0, shifted(f))));
    while let Some((parent, joint, frame)) = rest.pop() {
        if joint.kind == FileJointKind::Floating {
            let why = format!("joint `{}`: a floating joint can only carry the base", joint.name);
            return Err((joint.line, why));
        }
        let body = gather(&joint.child, links, joints);
        if body.rigid.mass <= 0.0 {
            return Err(massless(&joint.child, joint.line, links));
        }
        let (mass, center_of_mass, inertia) = central(&body.rigid);
        let prismatic = joint.kind == FileJointKind::Prismatic;
        made.design.links.push(DesignLink {
            name: joint.child.clone(),
            parent,
            joint: if prismatic { JointType::Prismatic } else { JointType::Revolute },
            mass,
            center_of_mass,
            inertia,
            position: frame.origin,
            orientation: quaternion(&frame.rotation),
            axis: joint.axis,
            motor: motor(joint.armature),
        });
        made.friction.push(joint.friction);
        made.joints.push(joint.name.clone());
        let own = made.design.links.len();
        made.places.extend(body.links.iter().map(|(link, f)| ((*link).to_owned(), own, *f)));
        if body.joints.is_empty() {
            let (tip, offset) = body.tip().unwrap_or((&joint.child, [0.0; 3]));
            let mount = made.design.mount(own);
            made.design.tips.push(DesignTip { name: tip.to_owned(), body: own, offset, mount });
        }
        body.joints.iter().rev().for_each(|(j, f)| rest.push((own, *j, *f)));
    }
    Ok(made)
}

fn massless(link: &str, joint: u32, links: &[FileLink]) -> FileFault {
    let line = links.iter().find(|b| b.name == link).map_or(joint, |b| b.line);
    (line, format!("link `{link}`: it moves and has no mass; give it an <inertial> with mass and inertia"))
}

/// An inertia that turns with a joint and that its carrier does not see: a rotor behind a gear of endless ratio.
fn motor(armature: f64) -> DesignMotor {
    if armature == 0.0 {
        return DesignMotor::default();
    }
    DesignMotor { inertia: armature, gear_ratio: ENDLESS, ..DesignMotor::default() }
}

/// Of an armature the share 1 / ENDLESS reaches the carrier: below the rounding of its own inertia.
const ENDLESS: f64 = 1e9;

/// `3 joints (a, b, c)`.
pub(super) fn counted(names: &[&str]) -> String {
    let s = if names.len() == 1 { "" } else { "s" };
    format!("{} joint{s} ({})", names.len(), names.join(", "))
}

impl TreeRobot {
    /// That nothing is made of what its joints lose.
    pub(super) fn without_friction(&self) -> Option<String> {
        without_friction(self.losses, &self.design.links, &self.friction)
    }
}

/// That these links' joints lose what a model without friction does not; `None`: they lose nothing. `what` is the file's word for it.
pub(super) fn without_friction(
    what: &str,
    links: &[DesignLink],
    friction: &[JointFriction],
) -> Option<String> {
    let lossy = links.iter().zip(friction).filter(|(_, f)| f.is_there());
    let names: Vec<_> = lossy.map(|(l, _)| l.name.as_str()).collect();
    let (n, all) = (names.len(), names.join(", "));
    (n > 0).then(|| {
        format!("{what} of the joints of {n} links ({all}) is not in this model; FlexibleArm has both")
    })
}
