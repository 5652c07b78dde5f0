//! Robots as MJCF: bodies, joints, inertials, armature, damping, frictionloss, with classes of defaults.

mod bodies;
mod compiler;
mod defaults;
mod equality;
mod orientation;
mod schema;
mod unread;

use std::path::Path;

use roxmltree::Document;

use super::attributes::{line, needed};
use super::tree::{FileFault, TreeRobot, assemble, once, root};
use trueup_signals::unreadable;

use crate::wrong::RobotReadError;
use bodies::MjcfReader;

/// Most files that one file may include, one within another.
const DEEPEST: usize = 16;

/// Whether a text is MJCF.
pub(super) fn is_mjcf(text: &str) -> bool {
    Document::parse(text).is_ok_and(|d| d.root_element().has_tag_name("mujoco"))
}

/// Reads a robot; it is not checked yet.
pub(super) fn read(path: &Path, text: &str) -> Result<TreeRobot, RobotReadError> {
    let text = included(path, text, 0)?;
    let at = |(line, why): FileFault| RobotReadError(format!("{}:{line}: {why}", path.display()));
    let document = Document::parse(&text).map_err(|e| at((e.pos().row, e.to_string())))?;
    let fallback = path.file_stem().unwrap_or_default().to_string_lossy();
    design(&document, &fallback).map_err(at)
}

/// With the files that it includes in their places. Lines are then those of the whole.
fn included(path: &Path, text: &str, depth: usize) -> Result<String, RobotReadError> {
    if !text.contains("<include") {
        return Ok(text.to_owned());
    }
    let at = |line: u32, why: String| RobotReadError(format!("{}:{line}: {why}", path.display()));
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
        let inner = std::fs::read_to_string(&file).map_err(|e| {
            let why = format!("{}: {}; put it there, or take the line out", file.display(), unreadable(&e));
            at(line(node), format!("<include file=\"{name}\">: {why}"))
        })?;
        let inner = included(&file, &inner, depth + 1)?;
        let parsed = Document::parse(&inner)
            .map_err(|e| RobotReadError(format!("{}:{}: {e}", file.display(), e.pos().row)))?;
        whole.push_str(&text[copied..node.range().start]);
        for child in parsed.root_element().children() {
            whole.push_str(&inner[child.range()]);
        }
        copied = node.range().end;
    }
    whole.push_str(&text[copied..]);
    Ok(whole)
}

fn design(document: &Document<'_>, fallback: &str) -> Result<TreeRobot, FileFault> {
    let model = document.root_element();
    schema::check(model)?;
    let mut reader = MjcfReader::new(model)?;
    for world in model.children().filter(|c| c.has_tag_name("worldbody")) {
        reader.world(world)?;
    }
    once("the body or site", reader.links.iter().map(|b| (b.name.as_str(), b.line)))?;
    once("the joint", reader.joints.iter().map(|j| (j.name.as_str(), j.line)))?;
    reader.unread.coupled = equality::couple(model, &reader.classes, &mut reader.joints)?;
    let ground = root(line(model), &reader.links, &reader.joints)?;
    let name = model.attribute("model").unwrap_or(fallback);
    let mut made = assemble(name, ground, &reader.links, &reader.joints)?;
    made.losses = "damping and frictionloss";
    made.notes = reader.unread.notes(model);
    Ok(made)
}
