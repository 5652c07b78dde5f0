//! Robots: presets, files of TOML, of URDF, of MJCF.

mod attributes;
mod flexure;
mod mjcf;
mod overlay;
mod panel;
mod reduced;
mod repair;
mod tree;
mod urdf;
mod written;
mod wrong;

use std::path::Path;

use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use trueup_models::space::design::{DesignLink, DesignMotor, DesignTip, RobotDesign, Thruster};
use trueup_models::space::presets::PRESETS;
use trueup_models::space::tree::JointType;

pub use crate::wrong::RobotReadError;
pub use tree::JointFriction;
use tree::TreeRobot;
use trueup_signals::{did_you_mean, unreadable};
use wrong::RobotFileError;

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct File {
    name: Option<String>,
    /// Its FMU has outputs of what a pose is worth.
    #[serde(default)]
    analysis: bool,
    /// Bending shortens links; left out: where the base is held and every link that bends is a beam.
    #[serde(rename = "axial-stiffening")]
    #[schemars(with = "Option<bool>")]
    axial_stiffening: Option<Spanned<bool>>,
    base: BaseEntry,
    #[serde(default)]
    body: Vec<BodyEntry>,
    #[serde(default)]
    tip: Vec<HandEntry>,
    #[serde(default)]
    thruster: Vec<Nozzle>,
    #[serde(default)]
    appendage: Vec<panel::Panel>,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BaseEntry {
    mass: f64,
    inertia: [[f64; 3]; 3],
    /// It does not move.
    #[serde(default)]
    held: bool,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct DriveEntry {
    #[serde(default)]
    flexible: bool,
    #[serde(default)]
    inertia: f64,
    #[serde(default = "one")]
    gear_ratio: f64,
    #[serde(default)]
    stiffness: f64,
    #[serde(default)]
    damping: f64,
}

impl DriveEntry {
    fn design(&self) -> DesignMotor {
        DesignMotor {
            flexible: self.flexible,
            inertia: self.inertia,
            gear_ratio: self.gear_ratio,
            stiffness: self.stiffness,
            damping: self.damping,
        }
    }
}

/// What a joint loses, at the joint's side.
#[derive(Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FrictionEntry {
    #[serde(default)]
    viscous: f64,
    #[serde(default)]
    coulomb: f64,
}

impl FrictionEntry {
    /// Of the body or joint of this name; refused where it drives.
    fn of(&self, name: &str) -> Result<JointFriction, String> {
        let Self { viscous, coulomb } = *self;
        if !(viscous >= 0.0 && coulomb >= 0.0 && (viscous + coulomb).is_finite()) {
            return Err(format!("`{name}`: friction has numbers not below 0"));
        }
        Ok(JointFriction { viscous, coulomb })
    }
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct Nozzle {
    position: [f64; 3],
    direction: [f64; 3],
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct BodyEntry {
    name: Option<String>,
    /// By name; the one before when left out.
    parent: Option<String>,
    #[serde(default)]
    joint: RobotJointKind,
    mass: f64,
    center_of_mass: [f64; 3],
    inertia: [[f64; 3]; 3],
    position: [f64; 3],
    #[serde(default = "panel::unturned")]
    orientation: [f64; 4],
    #[serde(default = "along_z")]
    axis: [f64; 3],
    motor: Option<DriveEntry>,
    #[serde(default)]
    friction: FrictionEntry,
    /// What bends between its joint and what it carries.
    #[schemars(with = "Option<flexure::BendingEntry>")]
    link: Option<Spanned<flexure::BendingEntry>>,
}

#[derive(Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
enum RobotJointKind {
    #[default]
    Revolute,
    Prismatic,
}

#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct HandEntry {
    name: Option<String>,
    /// By name; the last one when left out.
    body: Option<String>,
    #[serde(default)]
    offset: [f64; 3],
    /// The first joint of its arm when left out.
    mount: Option<[f64; 3]>,
}

fn one() -> f64 {
    1.0
}
fn along_z() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// JSON Schema of a robot's file, by what its readers take: a robot written out, or one of another file with what that cannot have.
pub fn schema() -> serde_json::Value {
    #[derive(JsonSchema)]
    #[schemars(untagged, title = "robot")]
    #[allow(dead_code)]
    enum Either {
        Whole(File),
        Overlay(overlay::Overlay),
    }
    schemars::schema_for!(Either).to_value()
}

/// A robot with what was read of it beyond its design.
pub struct RobotFile {
    /// Its parts, with their numbers.
    pub design: RobotDesign,
    /// What joints lose, of each moving body; empty where the file has no words for it.
    pub friction: Vec<JointFriction>,
    /// Start values of the FMU beyond those of the design.
    pub start: Vec<(String, f64)>,
    /// What of the file is not used, or was chosen.
    pub notes: Vec<String>,
    /// Why the base is free where that was not requested.
    pub floats: Option<String>,
    /// That joints lose what a model without friction does not.
    pub without_friction: Option<String>,
}

/// A robot by the name of a preset, or read from a file and checked; with `repair` inertias that no body has are changed first.
pub fn read(path: &Path, repair: bool) -> Result<RobotFile, RobotReadError> {
    read_among(path, repair, &[])
}

/// The same where there are presets of other names, too, which the caller has.
pub fn read_among(path: &Path, repair: bool, others: &[&str]) -> Result<RobotFile, RobotReadError> {
    if let Some(preset) = PRESETS.iter().find(|p| path.to_str() == Some(p.name)) {
        return Ok(RobotFile::of((preset.design)()));
    }
    let presets: Vec<&str> = PRESETS.iter().map(|p| p.name).chain(others.iter().copied()).collect();
    let text = std::fs::read_to_string(path).map_err(|e| {
        let named = path.to_string_lossy();
        let all = format!("give a file of TOML, URDF or MJCF, or one of {}", presets.join(", "));
        RobotReadError::at(
            path,
            format!("{}; {}", unreadable(&e), did_you_mean(&named, presets.iter().copied(), &all)),
        )
    })?;
    let mut robot = parsed(path, &text)?;
    if repair {
        robot.notes.extend(repair::repair(&mut robot.design));
    }
    let design = &robot.design;
    design.check_bodies().map_err(|faults| {
        let all: Vec<_> = faults.iter().map(ToString::to_string).collect();
        RobotReadError::at(path, all.join("\n  "))
    })?;
    design.check().map_err(|why| RobotReadError::at(path, why))?;
    let doubts: Vec<_> = design.doubts().iter().map(ToString::to_string).collect();
    robot.notes.extend(
        doubts.into_iter().map(|doubt| format!("{doubt} It is used as it is; --repair-inertia changes it")),
    );
    let others = robot.floats.iter_mut().chain(&mut robot.without_friction);
    robot
        .notes
        .iter_mut()
        .chain(others)
        .for_each(|note| note.insert_str(0, &format!("{}: ", path.display())));
    Ok(robot)
}

/// By what the text is: URDF, MJCF, a robot of its own, or an overlay.
fn parsed(path: &Path, text: &str) -> Result<RobotFile, RobotReadError> {
    let is = |end: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(end));
    if is("urdf") || is("xml") || is("mjcf") || text.trim_start().starts_with('<') {
        return described(path, text).map(of_tree);
    }
    let line = |byte: usize| text.as_bytes().iter().take(byte).filter(|b| **b == b'\n').count() + 1;
    let unread = |e: &toml::de::Error| {
        let line = e.span().map_or(1, |s| line(s.start));
        RobotReadError(format!("{}:{line}: {}; see docs/robots.md", path.display(), e.message()))
    };
    let misfit = |wrong: RobotFileError| match wrong.at {
        Some(byte) => RobotReadError(format!("{}:{}: {}", path.display(), line(byte), wrong.why)),
        None => RobotReadError::at(path, wrong.why),
    };
    if overlay::is_overlay(text) {
        let overlay: overlay::Overlay = toml::from_str(text).map_err(|e| unread(&e))?;
        let (name, at) = overlay.source().map_err(misfit)?;
        let file = path.with_file_name(name);
        let inner = std::fs::read_to_string(&file).map_err(|e| {
            let why = format!("{}: {}; name a file next to this one", file.display(), unreadable(&e));
            misfit(RobotFileError::at(at, why))
        })?;
        return overlay.over(described(&file, &inner)?).map_err(misfit);
    }
    let file: File = toml::from_str(text).map_err(|e| unread(&e))?;
    let fallback = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    file.robot(fallback).map_err(misfit)
}

/// A robot as another tool describes it.
fn described(path: &Path, text: &str) -> Result<TreeRobot, RobotReadError> {
    if mjcf::is_mjcf(text) { mjcf::read(path, text) } else { urdf::read(path, text) }
}

fn of_tree(made: TreeRobot) -> RobotFile {
    let without_friction = made.without_friction();
    RobotFile {
        design: made.design,
        friction: made.friction,
        start: Vec::new(),
        notes: made.notes,
        floats: made.floats,
        without_friction,
    }
}

impl RobotFile {
    fn of(design: RobotDesign) -> Self {
        let (friction, start, notes) = (Vec::new(), Vec::new(), Vec::new());
        Self { design, friction, start, notes, floats: None, without_friction: None }
    }

    /// The file that reads back as this robot.
    pub fn toml(&self) -> Result<String, String> {
        written::toml(&self.design, &self.friction)
    }
}

impl File {
    fn robot(self, fallback: String) -> Result<RobotFile, RobotFileError> {
        let of_body = |b: &BodyEntry| b.friction.of(b.name.as_deref().unwrap_or("a body"));
        let friction = self.body.iter().map(of_body).collect::<Result<Vec<_>, _>>()?;
        let robot = RobotFile::of(self.design(fallback)?);
        let without_friction = tree::without_friction("friction", &robot.design.links, &friction);
        Ok(RobotFile { friction, without_friction, ..robot })
    }

    fn design(self, fallback: String) -> Result<RobotDesign, RobotFileError> {
        let names: Vec<String> = (self.body.iter().enumerate())
            .map(|(k, b)| b.name.clone().unwrap_or_else(|| format!("link {}", k + 1)))
            .collect();
        let find = |who: &str, name: &str| -> Result<usize, String> {
            if name == "base" {
                return Ok(0);
            }
            names.iter().position(|n| n == name).map(|k| k + 1).ok_or_else(|| {
                let all = names.iter().map(String::as_str).chain(["base"]);
                let near = did_you_mean(name, all, "name a body of this file, or `base`");
                format!("`{who}`: there is no body `{name}`; {near}")
            })
        };
        let (mut links, mut flexures, mut link_tables) = (Vec::new(), Vec::new(), Vec::new());
        for (k, b) in self.body.into_iter().enumerate() {
            if let Some(link) = b.link {
                let begin = link.span().start;
                match link.into_inner().of(k + 1, &names[k], begin)? {
                    flexure::FlexibleLinkEntry::Beam(beam) => flexures.push(beam),
                    flexure::FlexibleLinkEntry::Table(table) => link_tables.push(table),
                }
            }
            links.push(DesignLink {
                parent: b.parent.as_deref().map_or(Ok(k), |name| find(&names[k], name))?,
                name: names[k].clone(),
                joint: match b.joint {
                    RobotJointKind::Revolute => JointType::Revolute,
                    RobotJointKind::Prismatic => JointType::Prismatic,
                },
                mass: b.mass,
                center_of_mass: b.center_of_mass,
                inertia: b.inertia,
                position: b.position,
                orientation: b.orientation,
                axis: b.axis,
                motor: b.motor.map_or_else(DesignMotor::default, |m| m.design()),
            });
        }
        let stiffening = self.axial_stiffening.as_ref().filter(|s| *s.get_ref());
        if let (Some(stiffening), Some(table)) = (stiffening, link_tables.first()) {
            let why = format!(
                "axial-stiffening = true needs beams, and the link of `{}` is a table of modes, which does not give the shortening by bending; leave axial-stiffening out, or give that link as a beam",
                table.table.name
            );
            return Err(RobotFileError::at(stiffening.span().start, why));
        }
        let (appendages, tables) = panel::sorted(self.appendage)?;
        let mut design = RobotDesign {
            name: self.name.unwrap_or(fallback),
            base_mass: self.base.mass,
            base_inertia: self.base.inertia,
            links,
            tips: Vec::new(),
            thrusters: (self.thruster.into_iter())
                .map(|t| Thruster { position: t.position, direction: t.direction })
                .collect(),
            appendages,
            tables,
            flexures,
            link_tables,
            axial_stiffening: self.axial_stiffening.map(Spanned::into_inner),
            held: self.base.held,
            geared: true,
            analysis: self.analysis,
        };
        for (k, t) in self.tip.into_iter().enumerate() {
            let name = t.name.unwrap_or_else(|| format!("tip {}", k + 1));
            let body = t.body.as_deref().map_or(Ok(design.links.len()), |body| find(&name, body))?;
            let mount = t.mount.unwrap_or_else(|| design.mount(body));
            design.tips.push(DesignTip { name, body, offset: t.offset, mount });
        }
        Ok(design)
    }
}
