//! The bodies of a model with their joints, inertias and sites.

use std::collections::HashSet;

use roxmltree::Node;
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::vector::{Matrix3, Vector3, add, identity, scale, times};

use super::compiler::{COMPILED, ShapeInertia};
use super::defaults::DefaultClasses;
use super::orientation::{AngleUnits, orientations};
use super::unread::UnreadParts;
use crate::attributes::{fixed, line, needed, numbers};
use crate::tree::{FileFault, FileJoint, FileJointKind, FileLink, JointFriction, WORLD};

/// A file on its way to links and joints.
pub(super) struct MjcfReader<'a> {
    pub(super) classes: DefaultClasses,
    units: AngleUnits,
    shapes: ShapeInertia,
    /// Names of the bodies.
    names: HashSet<&'a str>,
    pub(super) links: Vec<FileLink>,
    pub(super) joints: Vec<FileJoint>,
    pub(super) unread: UnreadParts,
}

/// A body on which others are.
#[derive(Clone, Copy)]
struct Carrier<'a> {
    link: &'a str,
    /// The axes of the body in those of its link.
    frame: SpatialFrame<f64>,
    /// Nothing moves it: its mass does not matter.
    still: bool,
}

/// An element of a body, through the frames around it.
struct BodyPart<'a, 'i> {
    node: Node<'a, 'i>,
    /// The axes of the frames in those of the body.
    frame: SpatialFrame<f64>,
    class: Option<&'a str>,
}

impl BodyPart<'_, '_> {
    fn is(&self, name: &str) -> bool {
        self.node.has_tag_name(name)
    }
}

impl<'a> MjcfReader<'a> {
    pub(super) fn new(model: Node<'a, '_>) -> Result<Self, FileFault> {
        let compilers = || model.children().filter(|c| c.has_tag_name("compiler"));
        let bodies = model.descendants().filter(|n| n.has_tag_name("body"));
        Ok(Self {
            shapes: ShapeInertia::read(compilers())?,
            classes: DefaultClasses::read(model)?,
            units: AngleUnits::read(compilers())?,
            names: bodies.filter_map(|n| n.attribute("name")).collect(),
            links: vec![FileLink { name: WORLD.into(), rigid: None, line: line(model) }],
            joints: Vec::new(),
            unread: UnreadParts::default(),
        })
    }

    pub(super) fn world(&mut self, node: Node<'_, '_>) -> Result<(), FileFault> {
        let parts = self.parts(node, None)?;
        self.inside(&parts, Carrier { link: WORLD, frame: SpatialFrame::identity(), still: true })
    }

    /// The elements of a body, those in its frames included.
    fn parts<'n, 'i>(
        &self,
        node: Node<'n, 'i>,
        class: Option<&'n str>,
    ) -> Result<Vec<BodyPart<'n, 'i>>, FileFault> {
        let (mut all, mut rest) =
            (Vec::new(), vec![BodyPart { node, frame: SpatialFrame::identity(), class }]);
        while let Some(outer) = rest.pop() {
            for child in outer.node.children().filter(Node::is_element) {
                let class = child.attribute("childclass").or(outer.class);
                if let Some(name) = child.attribute("class").or(class) {
                    self.classes.known(child, name)?;
                }
                if child.has_tag_name("frame") {
                    let frame = outer.frame.then(&self.units.frame(child)?);
                    rest.push(BodyPart { node: child, frame, class });
                } else {
                    all.push(BodyPart { node: child, frame: outer.frame, class: outer.class });
                }
            }
        }
        all.sort_by_key(|part| part.node.range().start);
        Ok(all)
    }

    /// The bodies and sites on a body.
    fn inside(&mut self, parts: &[BodyPart<'_, '_>], carrier: Carrier<'_>) -> Result<(), FileFault> {
        for part in parts {
            let on = Carrier { frame: carrier.frame.then(&part.frame), ..carrier };
            match part.node.tag_name().name() {
                "body" => self.body(part.node, on, part.class)?,
                "site" => self.site(part.node, on, part.class)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// A place with a name: a link without mass.
    fn site(
        &mut self,
        node: Node<'_, '_>,
        carrier: Carrier<'_>,
        class: Option<&str>,
    ) -> Result<(), FileFault> {
        let Some(name) = node.attribute("name") else { return Ok(()) };
        if self.classes.of(node, "fromto", class)?.is_some() {
            return Err((line(node), format!("site `{name}`: fromto is not read; give it pos")));
        }
        let mut own = self.units.frame(node)?;
        if let Some(text) = self.classes.of(node, "pos", class)? {
            own.origin = fixed(node, "pos", text)?;
        }
        if orientations(node).is_empty()
            && let Some(text) = self.classes.of(node, "quat", class)?
        {
            own.rotation = trueup_models::space::attitude::rotation(fixed(node, "quat", text)?);
        }
        // Bodies and sites may share a name in MJCF.
        let shared = self.names.contains(name);
        let name = if shared { format!("{name} (site)") } else { name.to_owned() };
        self.links.push(FileLink { name: name.clone(), rigid: None, line: line(node) });
        let frame = carrier.frame.then(&own);
        self.hang(format!("{name} (fixed)"), FileJointKind::Fixed, carrier.link, &name, frame, line(node));
        Ok(())
    }

    fn hang(
        &mut self,
        name: String,
        kind: FileJointKind,
        parent: &str,
        child: &str,
        frame: SpatialFrame<f64>,
        line: u32,
    ) {
        let (parent, child) = (parent.to_owned(), child.to_owned());
        let friction = JointFriction::default();
        let axis = [0.0, 0.0, 1.0];
        self.joints.push(FileJoint { name, kind, parent, child, frame, axis, friction, armature: 0.0, line });
    }

    fn body(
        &mut self,
        node: Node<'_, '_>,
        carrier: Carrier<'_>,
        class: Option<&str>,
    ) -> Result<(), FileFault> {
        let class = node.attribute("childclass").or(class);
        let name = node.attribute("name").map_or_else(|| format!("body {}", self.links.len()), str::to_owned);
        let frame = carrier.frame.then(&self.units.frame(node)?);
        let parts = self.parts(node, class)?;
        let joints: Vec<_> = parts.iter().filter(|p| p.is("joint") || p.is("freejoint")).collect();
        if let [_, second, ..] = joints[..] {
            let why = format!(
                "body `{name}` has {} joints; one is possible: give each a body of its own, with some mass",
                joints.len()
            );
            return Err((line(second.node), why));
        }
        if node.attribute("gravcomp").is_some_and(|text| text.trim().parse() != Ok(0.0)) {
            self.unread.lifted.push(name.clone());
        }
        if node.attribute("mocap") == Some("true") {
            self.unread.moved.push(name.clone());
        }
        let at = self.links.len();
        self.links.push(FileLink { name: name.clone(), rigid: None, line: line(node) });
        // The link's own axes have their origin in its joint.
        let mut origin = [0.0; 3];
        match joints.first() {
            None => {
                let joint = format!("{name} (fixed)");
                self.hang(joint, FileJointKind::Fixed, carrier.link, &name, frame, line(node));
            }
            Some(joint) => origin = self.joint(joint, carrier.link, &name, &frame)?,
        }
        let still = carrier.still && joints.is_empty();
        let own = SpatialFrame { rotation: identity(), origin: scale(-1.0, origin) };
        let inertia = self.inertial(&parts, &name, still, !joints.is_empty())?;
        self.links[at].rigid = inertia.map(|r| r.outwards(&own));
        self.inside(&parts, Carrier { link: &name, frame: own, still })
    }

    /// Adds a joint; gives its place in the body's axes.
    fn joint(
        &mut self,
        part: &BodyPart<'_, '_>,
        parent: &str,
        child: &str,
        frame: &SpatialFrame<f64>,
    ) -> Result<Vector3<f64>, FileFault> {
        let node = part.node;
        let name = node.attribute("name").map_or_else(|| format!("joint of {child}"), str::to_owned);
        let of = |what: &str| self.classes.of(node, what, part.class);
        let nonzero = |what: &str| -> Result<bool, FileFault> {
            Ok(of(what)?.is_some_and(|text| text.split_whitespace().any(|w| w.parse() != Ok(0.0))))
        };
        let kind = if node.has_tag_name("freejoint") { "free" } else { of("type")?.unwrap_or("hinge") };
        if kind == "free" {
            let own = ["damping", "armature", "frictionloss", "stiffness"];
            if node.has_tag_name("joint")
                && own.into_iter().map(nonzero).collect::<Result<Vec<_>, _>>()?.contains(&true)
            {
                self.unread.lossy_free.push(name.clone());
            }
            self.hang(name, FileJointKind::Floating, parent, child, *frame, line(node));
            return Ok([0.0; 3]);
        }
        let kind = match kind {
            "hinge" => FileJointKind::Revolute,
            "slide" => FileJointKind::Prismatic,
            other => {
                let why = format!("joint `{name}`: type `{other}` cannot be had; it is hinge, slide or free");
                return Err((line(node), why));
            }
        };
        let number = |what: &str| -> Result<f64, FileFault> {
            let Some(text) = of(what)? else { return Ok(0.0) };
            match numbers(node, what, text)?[..] {
                [value, ref higher @ ..] if value >= 0.0 && higher.iter().all(|v| *v == 0.0) => Ok(value),
                _ => {
                    let why = format!("joint `{name}`: {what}=\"{text}\": give one number, not below 0");
                    Err((line(node), why))
                }
            }
        };
        let vector = |what: &str, default: Vector3<f64>| match of(what)? {
            Some(text) => fixed(node, what, text),
            None => Ok(default),
        };
        // In the axes of the body.
        let place = add(part.frame.origin, times(&part.frame.rotation, vector("pos", [0.0; 3])?));
        let axis = times(&part.frame.rotation, vector("axis", [0.0, 0.0, 1.0])?);
        let timed = nonzero("springdamper")?;
        let viscous = if timed { 0.0 } else { number("damping")? };
        let friction = JointFriction { viscous, coulomb: number("frictionloss")? };
        let armature = number("armature")?;
        let limited = of("range")?.is_some() || of("actuatorfrcrange")?.is_some();
        let (referred, sprung) = (nonzero("ref")?, !timed && nonzero("stiffness")?);
        for (is, list) in [
            (referred, &mut self.unread.referred),
            (sprung, &mut self.unread.sprung),
            (timed, &mut self.unread.timed),
            (limited, &mut self.unread.limited),
        ] {
            if is {
                list.push(name.clone());
            }
        }
        let frame = frame.then(&SpatialFrame { rotation: identity(), origin: place });
        self.hang(name, kind, parent, child, frame, line(node));
        if let Some(joint) = self.joints.last_mut() {
            (joint.axis, joint.friction, joint.armature) = (axis, friction, armature);
        }
        Ok(place)
    }

    /// About the origin of the body's axes.
    fn inertial(
        &self,
        parts: &[BodyPart<'_, '_>],
        name: &str,
        still: bool,
        moves: bool,
    ) -> Result<Option<Rigid<f64>>, FileFault> {
        let mut given = parts.iter().filter(|p| p.is("inertial"));
        let Some(BodyPart { node, frame, .. }) = given.next() else {
            return if still { Ok(None) } else { self.without_inertial(parts, name) };
        };
        let node = *node;
        if let Some(second) = given.next() {
            let why = format!(
                "body `{name}` has two <inertial> (lines {} and {}); take one of them out",
                line(node),
                line(second.node)
            );
            return Err((line(second.node), why));
        }
        needed(node, "pos")?;
        let [mass] = fixed(node, "mass", needed(node, "mass")?)?;
        if mass < 0.0 {
            return Err((line(node), format!("mass = {mass}: no body has a mass below 0")));
        }
        let inertia: Matrix3<f64> = match (node.attribute("diaginertia"), node.attribute("fullinertia")) {
            (Some(_), Some(_)) => {
                let why = format!(
                    "body `{name}`: diaginertia and fullinertia both give the inertia; take one of them out"
                );
                return Err((line(node), why));
            }
            (None, Some(text)) => {
                if let Some((turned, _)) = orientations(node).first() {
                    let why = format!(
                        "body `{name}`: fullinertia is about the body's axes, and {turned} turns them; take {turned} out, or give diaginertia"
                    );
                    return Err((line(node), why));
                }
                let [xx, yy, zz, xy, xz, yz] = fixed(node, "fullinertia", text)?;
                [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            }
            (Some(text), None) => {
                let [x, y, z] = fixed(node, "diaginertia", text)?;
                [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
            }
            (None, None) if moves && mass > 0.0 => {
                let why =
                    format!("body `{name}`: <inertial> has neither diaginertia nor fullinertia; give it one");
                return Err((line(node), why));
            }
            // A point that is part of another body.
            (None, None) => [[0.0; 3]; 3],
        };
        let own = frame.then(&self.units.frame(node)?);
        Ok(Some(Rigid::new(mass, [0.0; 3], &inertia).outwards(&own)))
    }

    /// MuJoCo would take it from the shapes: fine where these have no mass.
    fn without_inertial(
        &self,
        parts: &[BodyPart<'_, '_>],
        name: &str,
    ) -> Result<Option<Rigid<f64>>, FileFault> {
        if !self.shapes.counted {
            return Ok(None);
        }
        for geom in parts.iter().filter(|p| p.is("geom")) {
            let number = |what: &str| -> Result<Option<f64>, FileFault> {
                let Some(text) = self.classes.of(geom.node, what, geom.class)? else { return Ok(None) };
                let [value] = fixed(geom.node, what, text)?;
                Ok(Some(value))
            };
            let group = number("group")?.unwrap_or(0.0);
            let counted = (self.shapes.groups[0]..=self.shapes.groups[1]).contains(&group);
            let heavy = match number("mass")? {
                Some(mass) => mass != 0.0,
                None => number("density")? != Some(0.0),
            };
            if counted && heavy {
                let why = format!(
                    "body `{name}` has no <inertial>, and the inertias of shapes (<geom>, meshes) are not read; give it one, or {COMPILED}"
                );
                return Err((line(geom.node), why));
            }
        }
        Ok(None)
    }
}
