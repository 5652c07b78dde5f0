//! Robots as MJCF: bodies, joints, inertials, armature, damping, frictionloss, with classes of defaults.

mod defaults;
mod orientation;

use std::path::Path;

use roxmltree::{Document, Node};
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::vector::{Matrix3, Vector3, identity, scale};

use super::attributes::{fixed, line, needed, numbers};
use super::tree::{
    FileFault, FileJoint, FileJointKind, FileLink, JointFriction, TreeRobot, WORLD, assemble, counted, once,
    root,
};
use crate::error::CliError;
use defaults::DefaultClasses;
use orientation::AngleUnits;

/// Most files that one file may include, one within another.
const DEEPEST: usize = 16;

/// Whether a text is MJCF.
pub(super) fn is_mjcf(text: &str) -> bool {
    Document::parse(text).is_ok_and(|d| d.root_element().has_tag_name("mujoco"))
}

/// Reads a robot; it is not checked yet.
pub(super) fn read(path: &Path, text: &str) -> Result<TreeRobot, CliError> {
    let text = included(path, text, 0)?;
    let at = |(line, why): FileFault| CliError::Failed(format!("{}:{line}: {why}", path.display()));
    let document = Document::parse(&text).map_err(|e| at((e.pos().row, e.to_string())))?;
    let fallback = path.file_stem().unwrap_or_default().to_string_lossy();
    design(&document, &fallback).map_err(at)
}

/// With the files that it includes in their places. Lines are then those of the whole.
fn included(path: &Path, text: &str, depth: usize) -> Result<String, CliError> {
    if !text.contains("<include") {
        return Ok(text.to_owned());
    }
    let at = |line: u32, why: String| CliError::Failed(format!("{}:{line}: {why}", path.display()));
    let document = Document::parse(text).map_err(|e| at(e.pos().row, e.to_string()))?;
    let mut whole = String::new();
    let mut copied = 0;
    for node in document.descendants().filter(|n| n.has_tag_name("include")) {
        let name = needed(node, "file").map_err(|(line, why)| at(line, why))?;
        let file = path.with_file_name(name);
        if depth == DEEPEST {
            return Err(at(
                line(node),
                format!("<include file=\"{name}\"> is {DEEPEST} files deep; does it include itself?"),
            ));
        }
        let inner = std::fs::read_to_string(&file)
            .map_err(|e| at(line(node), format!("<include file=\"{name}\">: {}: {e}", file.display())))?;
        let inner = included(&file, &inner, depth + 1)?;
        let parsed = Document::parse(&inner)
            .map_err(|e| CliError::Failed(format!("{}:{}: {e}", file.display(), e.pos().row)))?;
        whole.push_str(&text[copied..node.range().start]);
        for child in parsed.root_element().children() {
            whole.push_str(&inner[child.range()]);
        }
        copied = node.range().end;
    }
    whole.push_str(&text[copied..]);
    Ok(whole)
}

/// A file on its way to links and joints.
struct MjcfReader {
    classes: DefaultClasses,
    units: AngleUnits,
    /// Groups of geoms that would give a body without <inertial> its mass.
    groups: [f64; 2],
    links: Vec<FileLink>,
    joints: Vec<FileJoint>,
    /// Joints whose angle in the file is not 0.
    referred: Vec<String>,
    sprung: Vec<String>,
    limited: Vec<String>,
}

/// Elements that make bodies by rules which are not read.
const MACROS: [&str; 5] = ["replicate", "attach", "composite", "flexcomp", "plugin"];
/// Attributes of <compiler> that change masses and inertias.
const CHANGES: [&str; 4] = ["boundmass", "boundinertia", "settotalmass", "balanceinertia"];

fn design(document: &Document<'_>, fallback: &str) -> Result<TreeRobot, FileFault> {
    let model = document.root_element();
    let mut groups = [0.0, 5.0];
    let compilers = || model.children().filter(|c| c.has_tag_name("compiler"));
    for compiler in compilers() {
        for name in CHANGES {
            if compiler.attribute(name).is_some_and(|v| !["0", "false", "-1"].contains(&v)) {
                let why = format!(
                    "<compiler {name}> changes masses or inertias, which is not read; save the model as MuJoCo compiled it (mj_saveLastXML), and give that file"
                );
                return Err((line(compiler), why));
            }
        }
        if compiler.attribute("inertiafromgeom") == Some("true") {
            let why = "<compiler inertiafromgeom=\"true\"> takes inertias from shapes, which are not read; save the model as MuJoCo compiled it (mj_saveLastXML), and give that file";
            return Err((line(compiler), why.into()));
        }
        if let Some(text) = compiler.attribute("inertiagrouprange") {
            groups = fixed(compiler, "inertiagrouprange", text)?;
        }
    }
    let mut reader = MjcfReader {
        classes: DefaultClasses::read(model)?,
        units: AngleUnits::read(compilers())?,
        groups,
        links: vec![FileLink { name: WORLD.into(), rigid: None, line: line(model) }],
        joints: Vec::new(),
        referred: Vec::new(),
        sprung: Vec::new(),
        limited: Vec::new(),
    };
    if let Some(node) =
        model.descendants().find(|n| MACROS.iter().any(|m| n.has_tag_name(*m)) && in_world(*n))
    {
        let what = node.tag_name().name();
        let why = format!(
            "<{what}> is not read; save the model as MuJoCo compiled it (mj_saveLastXML), and give that file"
        );
        return Err((line(node), why));
    }
    for world in model.children().filter(|c| c.has_tag_name("worldbody")) {
        reader.inside(world, WORLD, &SpatialFrame::identity(), None)?;
    }
    once("the body or site", reader.links.iter().map(|b| (b.name.as_str(), b.line)))?;
    once("the joint", reader.joints.iter().map(|j| (j.name.as_str(), j.line)))?;
    let coupled = couple(model, &mut reader.joints)?;
    let ground = root(line(model), &reader.links, &reader.joints)?;
    let name = model.attribute("model").unwrap_or(fallback);
    let mut made = assemble(name, ground, &reader.links, &reader.joints)?;
    made.losses = "damping and frictionloss";
    made.notes = reader.notes(model, &coupled);
    Ok(made)
}

fn in_world(node: Node<'_, '_>) -> bool {
    node.ancestors().any(|a| a.has_tag_name("worldbody"))
}

/// <equality>: joints that follow others are fixed; what closes a loop is refused. Names of those fixed.
fn couple(model: Node<'_, '_>, joints: &mut [FileJoint]) -> Result<Vec<String>, FileFault> {
    let mut coupled = Vec::new();
    let sections = model.children().filter(|c| c.has_tag_name("equality"));
    for node in sections.flat_map(|s| s.children().filter(Node::is_element)) {
        if node.attribute("active") == Some("false") {
            continue;
        }
        match node.tag_name().name() {
            "connect" | "weld" => {
                let what = node.tag_name().name();
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
                joint.kind = FileJointKind::Fixed;
                coupled.push(name.to_owned());
            }
            _ => {}
        }
    }
    Ok(coupled)
}

impl MjcfReader {
    /// The children of a body (or a frame), whose axes in those of the link are `frame`.
    fn inside(
        &mut self,
        node: Node<'_, '_>,
        link: &str,
        frame: &SpatialFrame<f64>,
        class: Option<&str>,
    ) -> Result<(), FileFault> {
        for child in node.children() {
            match child.tag_name().name() {
                "body" => self.body(child, link, frame, class)?,
                "frame" => {
                    let own = frame.then(&self.units.frame(child)?);
                    self.inside(child, link, &own, child.attribute("childclass").or(class))?;
                }
                "site" => self.site(child, link, frame, class)?,
                _ => {}
            }
        }
        Ok(())
    }

    /// A place with a name: a link without mass.
    fn site(
        &mut self,
        node: Node<'_, '_>,
        link: &str,
        frame: &SpatialFrame<f64>,
        class: Option<&str>,
    ) -> Result<(), FileFault> {
        let Some(name) = node.attribute("name").filter(|name| self.links.iter().all(|l| l.name != *name))
        else {
            return Ok(());
        };
        let mut own = self.units.frame(node)?;
        if let (None, Some(text)) = (node.attribute("pos"), self.classes.of(node, "pos", class)) {
            own.origin = fixed(node, "pos", text)?;
        }
        self.links.push(FileLink { name: name.to_owned(), rigid: None, line: line(node) });
        self.hang(name, FileJointKind::Fixed, link, name, frame.then(&own), line(node));
        Ok(())
    }

    fn hang(
        &mut self,
        name: &str,
        kind: FileJointKind,
        parent: &str,
        child: &str,
        frame: SpatialFrame<f64>,
        line: u32,
    ) {
        let (parent, child) = (parent.to_owned(), child.to_owned());
        let friction = JointFriction::default();
        let axis = [0.0, 0.0, 1.0];
        let name = name.to_owned();
        self.joints.push(FileJoint { name, kind, parent, child, frame, axis, friction, armature: 0.0, line });
    }

    fn body(
        &mut self,
        node: Node<'_, '_>,
        parent: &str,
        outer: &SpatialFrame<f64>,
        class: Option<&str>,
    ) -> Result<(), FileFault> {
        let class = node.attribute("childclass").or(class);
        let name = node.attribute("name").map_or_else(|| format!("body {}", self.links.len()), str::to_owned);
        let frame = outer.then(&self.units.frame(node)?);
        let joints: Vec<_> = joints_of(node).collect();
        if let [_, second, ..] = joints[..] {
            let why = format!(
                "body `{name}` has {} joints; one is possible: give each a body of its own",
                joints.len()
            );
            return Err((line(second), why));
        }
        let at = self.links.len();
        self.links.push(FileLink { name: name.clone(), rigid: None, line: line(node) });
        // The link's own axes have their origin in its joint.
        let mut origin = [0.0; 3];
        match joints.first() {
            None => {
                self.hang(&format!("{name} (fixed)"), FileJointKind::Fixed, parent, &name, frame, line(node))
            }
            Some(joint) => origin = self.joint(*joint, parent, &name, &frame, class)?,
        }
        let own = SpatialFrame { rotation: identity(), origin: scale(-1.0, origin) };
        self.links[at].rigid = self.inertial(node, &name, class)?.map(|r| r.outwards(&own));
        self.inside(node, &name, &own, class)
    }

    /// Adds a joint; gives its place in the body's axes.
    fn joint(
        &mut self,
        node: Node<'_, '_>,
        parent: &str,
        child: &str,
        frame: &SpatialFrame<f64>,
        class: Option<&str>,
    ) -> Result<Vector3<f64>, FileFault> {
        let name = node.attribute("name").map_or_else(|| format!("joint of {child}"), str::to_owned);
        let of = |what: &str| self.classes.of(node, what, class);
        let kind = if node.has_tag_name("freejoint") { "free" } else { of("type").unwrap_or("hinge") };
        if kind == "free" {
            self.hang(&name, FileJointKind::Floating, parent, child, *frame, line(node));
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
            let Some(text) = of(what) else { return Ok(0.0) };
            let all = numbers(node, what, text)?;
            let value = all.first().copied().unwrap_or(0.0);
            if value < 0.0 || all[1..].iter().any(|v| *v != 0.0) {
                let why = format!("joint `{name}`: {what}=\"{text}\": give one number, not below 0");
                return Err((line(node), why));
            }
            Ok(value)
        };
        let vector =
            |what: &str, default: Vector3<f64>| of(what).map_or(Ok(default), |text| fixed(node, what, text));
        let (place, axis) = (vector("pos", [0.0; 3])?, vector("axis", [0.0, 0.0, 1.0])?);
        let friction = JointFriction { viscous: number("damping")?, coulomb: number("frictionloss")? };
        let armature = number("armature")?;
        let nonzero =
            |what: &str| of(what).is_some_and(|text| text.split_whitespace().any(|w| w.parse() != Ok(0.0)));
        let (referred, sprung, limited) = (nonzero("ref"), nonzero("stiffness"), of("range").is_some());
        for (is, list) in
            [(referred, &mut self.referred), (sprung, &mut self.sprung), (limited, &mut self.limited)]
        {
            if is {
                list.push(name.clone());
            }
        }
        let frame = frame.then(&SpatialFrame { rotation: identity(), origin: place });
        self.hang(&name, kind, parent, child, frame, line(node));
        if let Some(joint) = self.joints.last_mut() {
            (joint.axis, joint.friction, joint.armature) = (axis, friction, armature);
        }
        Ok(place)
    }

    /// About the origin of the body's axes.
    fn inertial(
        &self,
        body: Node<'_, '_>,
        name: &str,
        class: Option<&str>,
    ) -> Result<Option<Rigid<f64>>, FileFault> {
        let Some(node) = body.children().find(|c| c.has_tag_name("inertial")) else {
            return self.without_inertial(body, name, class);
        };
        let [mass] = fixed(node, "mass", needed(node, "mass")?)?;
        if mass < 0.0 {
            return Err((line(node), format!("mass = {mass}: no body has a mass below 0")));
        }
        let inertia: Matrix3<f64> = match (node.attribute("diaginertia"), node.attribute("fullinertia")) {
            (_, Some(text)) => {
                let [xx, yy, zz, xy, xz, yz] = fixed(node, "fullinertia", text)?;
                [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
            }
            (Some(text), None) => {
                let [x, y, z] = fixed(node, "diaginertia", text)?;
                [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
            }
            (None, None) => [[0.0; 3]; 3],
        };
        Ok(Some(Rigid::new(mass, [0.0; 3], &inertia).outwards(&self.units.frame(node)?)))
    }

    /// MuJoCo would take it from the shapes: fine where these have no mass.
    fn without_inertial(
        &self,
        body: Node<'_, '_>,
        name: &str,
        class: Option<&str>,
    ) -> Result<Option<Rigid<f64>>, FileFault> {
        let zero = |geom: Node<'_, '_>, what: &str| {
            self.classes.of(geom, what, class).is_some_and(|v| v.trim().parse() == Ok(0.0))
        };
        let heavy = |geom: &Node<'_, '_>| {
            let group: f64 =
                self.classes.of(*geom, "group", class).and_then(|g| g.parse().ok()).unwrap_or(0.0);
            let counted = (self.groups[0]..=self.groups[1]).contains(&group);
            counted
                && !zero(*geom, "mass")
                && (self.classes.of(*geom, "mass", class).is_some() || !zero(*geom, "density"))
        };
        let mut geoms = body.children().filter(|c| c.has_tag_name("geom"));
        let Some(at) = geoms.find(heavy).map(line) else { return Ok(None) };
        let why = format!(
            "body `{name}` has no <inertial>, and the inertias of shapes (<geom>, meshes) are not read; give it one, or save the model as MuJoCo compiled it (mj_saveLastXML)"
        );
        Err((at, why))
    }

    fn notes(&self, model: Node<'_, '_>, coupled: &[String]) -> Vec<String> {
        let list = |all: &[String]| counted(&all.iter().map(String::as_str).collect::<Vec<_>>());
        let mut notes = Vec::new();
        if !coupled.is_empty() {
            notes.push(format!(
                "<equality> of {} is not read: they are fixed where they are in the file",
                list(coupled)
            ));
        }
        for (all, what) in [
            (&self.limited, "range of {} is not read: no model here has it"),
            (
                &self.sprung,
                "stiffness of {} is not read: no model here has a spring towards the base of a joint",
            ),
            (&self.referred, "ref of {} is not read: their angles are 0 as they are in the file"),
        ] {
            if !all.is_empty() {
                notes.push(what.replace("{}", &list(all)));
            }
        }
        for section in ["actuator", "tendon"] {
            if model.children().any(|c| c.has_tag_name(section) && c.children().any(|n| n.is_element())) {
                notes.push(format!("<{section}> is not read: torques are those of the joints"));
            }
        }
        notes
    }
}

fn joints_of<'a, 'i>(body: Node<'a, 'i>) -> impl Iterator<Item = Node<'a, 'i>> {
    body.children().filter(|c| c.has_tag_name("joint") || c.has_tag_name("freejoint"))
}
