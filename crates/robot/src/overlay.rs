//! A robot of another tool's file with what that file cannot have: `[robot]` in a robot's TOML.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use trueup_models::space::attitude::{product, quaternion, rotation};
use trueup_models::space::design::{DesignTip, Thruster};
use trueup_models::space::spatial::{Rigid, SpatialFrame};
use trueup_models::space::vector::{Vector3, add, sub, times};

use super::tree::{NOTHING, TreeRobot, central};
use super::wrong::RobotFileError;
use super::{DriveEntry, FrictionEntry, Nozzle, RobotFile, panel};
use trueup_signals::did_you_mean;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct Overlay {
    robot: Source,
    name: Option<String>,
    #[serde(default)]
    analysis: bool,
    /// What the robot is mounted on.
    #[schemars(with = "Option<Satellite>")]
    satellite: Option<Spanned<Satellite>>,
    /// By the names of the file.
    #[serde(default)]
    #[schemars(with = "BTreeMap<String, JointOverlay>")]
    joint: BTreeMap<Spanned<String>, JointOverlay>,
    #[serde(default)]
    #[schemars(with = "Vec<LinkTip>")]
    tip: Vec<Spanned<LinkTip>>,
    #[serde(default)]
    thruster: Vec<Nozzle>,
    #[serde(default)]
    appendage: Vec<panel::Panel>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Source {
    #[schemars(with = "Option<String>")]
    urdf: Option<Spanned<String>>,
    #[schemars(with = "Option<String>")]
    mjcf: Option<Spanned<String>>,
    /// The base: held or free; as the file has it when left out.
    held: Option<bool>,
    #[schemars(with = "Option<[f64; 3]>")]
    gravity: Option<Spanned<[f64; 3]>>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Satellite {
    mass: f64,
    inertia: [[f64; 3]; 3],
    /// The root link's axes in the satellite's, whose origin is its centre of mass.
    #[serde(default)]
    mount: [f64; 3],
    #[serde(default = "panel::unturned")]
    orientation: [f64; 4],
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct JointOverlay {
    motor: Option<DriveEntry>,
    friction: Option<FrictionEntry>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LinkTip {
    name: Option<String>,
    /// A link of the file.
    link: String,
    #[serde(default)]
    offset: [f64; 3],
}

/// Whether a text is one.
pub(super) fn is_overlay(text: &str) -> bool {
    toml::from_str::<toml::Table>(text).is_ok_and(|t| t.contains_key("robot"))
}

impl Overlay {
    /// The file that it is about, with the byte where that is named.
    pub(super) fn source(&self) -> Result<(&str, usize), RobotFileError> {
        match (&self.robot.urdf, &self.robot.mjcf) {
            (Some(file), None) | (None, Some(file)) => Ok((file.get_ref(), file.span().start)),
            _ => Err("[robot] has one of urdf and mjcf: the file that it is about".to_owned().into()),
        }
    }

    /// The robot of that file, changed.
    pub(super) fn over(self, mut robot: TreeRobot) -> Result<RobotFile, RobotFileError> {
        let held = self.robot.held.unwrap_or(robot.design.held && self.satellite.is_none());
        if !held && robot.base.mass == 0.0 && self.satellite.is_none() {
            let why =
                "[robot] held = false: the root link of its file has no mass; give the robot a [satellite]";
            return Err(why.to_owned().into());
        }
        let mut shift = [0.0; 3];
        match &self.satellite {
            Some(satellite) if held => {
                let why = "[satellite] moves, and the base is held; leave one of them out";
                return Err(RobotFileError::at(satellite.span().start, why.to_owned()));
            }
            Some(satellite) => {
                let frame = satellite.get_ref().frame(satellite.span().start)?;
                shift = satellite.get_ref().under(&mut robot, &frame);
            }
            None if held != robot.design.held && !held => {
                // What was on the ground floats: its base axes move into its centre of mass.
                shift = rebase(&mut robot, NOTHING, &SpatialFrame::identity());
            }
            None => {}
        }
        robot.design.held = held;
        let mut start = Vec::new();
        if let Some(gravity) = &self.robot.gravity {
            if !held {
                let why = "gravity needs a base that is held: write held = true, or leave gravity out";
                return Err(RobotFileError::at(gravity.span().start, why.to_owned()));
            }
            start.extend(
                gravity.get_ref().iter().enumerate().map(|(i, g)| (format!("gravity[{}]", i + 1), *g)),
            );
        }
        let inward = |place: Vector3<f64>| sub(place, shift);
        self.joints(&mut robot)?;
        self.tips(&mut robot)?;
        let design = &mut robot.design;
        design.thrusters = self
            .thruster
            .into_iter()
            .map(|t| Thruster { position: inward(t.position), direction: t.direction })
            .collect();
        (design.appendages, design.tables) = panel::sorted(self.appendage)?;
        design.appendages.iter_mut().for_each(|a| a.position = inward(a.position));
        design.tables.iter_mut().for_each(|t| t.position = inward(t.position));
        design.analysis = self.analysis;
        if let Some(name) = self.name {
            design.name = name;
        }
        // Where the overlay decides on the base there is nothing to report.
        let floats = robot.floats.take().filter(|_| self.robot.held.is_none() && self.satellite.is_none());
        Ok(RobotFile { start, floats, ..super::of_tree(robot) })
    }

    /// Motors, gears, springs, losses.
    fn joints(&self, robot: &mut TreeRobot) -> Result<(), RobotFileError> {
        for (name, joint) in &self.joint {
            let own = robot.joints.iter().position(|j| j == name.get_ref());
            let own = own.or_else(|| robot.design.links.iter().position(|l| l.name == *name.get_ref()));
            let Some(own) = own else {
                let near = did_you_mean(
                    name.get_ref(),
                    robot.joints.iter().map(String::as_str),
                    "name a joint that moves",
                );
                let why = format!(
                    "[joint.{0}]: the robot's file has no joint `{0}` that moves; {near}",
                    name.get_ref()
                );
                return Err(RobotFileError::at(name.span().start, why));
            };
            if let Some(motor) = &joint.motor {
                robot.design.links[own].motor = motor.design();
            }
            if let Some(friction) = &joint.friction {
                let friction = friction.of(name.get_ref());
                robot.friction[own] = friction.map_err(|why| RobotFileError::at(name.span().start, why))?;
            }
        }
        Ok(())
    }

    /// Hands by the names of links, instead of those at the ends of branches.
    fn tips(&self, robot: &mut TreeRobot) -> Result<(), RobotFileError> {
        if self.tip.is_empty() {
            return Ok(());
        }
        let mut tips = Vec::new();
        for tip in &self.tip {
            let (at, tip) = (tip.span().start, tip.get_ref());
            let Some((_, body, frame)) = robot.places.iter().find(|(link, ..)| *link == tip.link) else {
                let near =
                    did_you_mean(&tip.link, robot.places.iter().map(|p| p.0.as_str()), "name a link of it");
                let why = format!("[[tip]]: the robot's file has no link `{}`; {near}", tip.link);
                return Err(RobotFileError::at(at, why));
            };
            if *body == 0 {
                let why = format!(
                    "[[tip]]: link `{}` is part of the base, whose motion has outputs of its own",
                    tip.link
                );
                return Err(RobotFileError::at(at, why));
            }
            let offset = add(frame.origin, times(&frame.rotation, tip.offset));
            let name = tip.name.clone().unwrap_or_else(|| tip.link.clone());
            tips.push(DesignTip { name, body: *body, offset, mount: robot.design.mount(*body) });
        }
        robot.design.tips = tips;
        Ok(())
    }
}

impl Satellite {
    /// The root link's axes in the satellite's.
    fn frame(&self, at: usize) -> Result<SpatialFrame<f64>, RobotFileError> {
        let square: f64 = self.orientation.iter().map(|c| c * c).sum();
        if (square.sqrt() - 1.0).abs() > 1e-3 || !self.mount.iter().all(|c| c.is_finite()) {
            let why = "[satellite]: give a finite mount, and a unit quaternion as orientation, w first";
            return Err(RobotFileError::at(at, why.to_owned()));
        }
        if !(self.mass > 0.0 && self.mass.is_finite()) {
            return Err(RobotFileError::at(
                at,
                format!("[satellite]: mass = {}: give one above 0, kg", self.mass),
            ));
        }
        Ok(SpatialFrame { rotation: rotation(self.orientation), origin: self.mount })
    }

    /// Puts it under a robot; gives the new origin of the base's axes, satellite's axes.
    fn under(&self, robot: &mut TreeRobot, frame: &SpatialFrame<f64>) -> Vector3<f64> {
        rebase(robot, Rigid::new(self.mass, [0.0; 3], &self.inertia), frame)
    }
}

/// Puts a body under a robot whose root link's axes are `frame` in its own; gives the common centre of mass, those axes: the new
/// origin of the base's axes, which keep that body's directions.
fn rebase(robot: &mut TreeRobot, body: Rigid<f64>, frame: &SpatialFrame<f64>) -> Vector3<f64> {
    // Base axes begin in the robot's own centre of mass, unless it is held.
    let before = if robot.design.held { [0.0; 3] } else { central(&robot.base).1 };
    let (mass, center, inertia) = central(&body.plus(&robot.base.outwards(frame)));
    let moved = |place: Vector3<f64>| {
        let of_root = add(place, before);
        sub(add(frame.origin, times(&frame.rotation, of_root)), center)
    };
    (robot.design.base_mass, robot.design.base_inertia) = (mass, inertia);
    for link in robot.design.links.iter_mut().filter(|l| l.parent == 0) {
        link.position = moved(link.position);
        link.orientation = product(quaternion(&frame.rotation), link.orientation);
    }
    robot.design.tips.iter_mut().for_each(|tip| tip.mount = moved(tip.mount));
    center
}
