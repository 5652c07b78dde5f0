//! The variable table of `SpatialFreeFlyer`, and robots as configurations.

use crate::builder::PlantTableBuilder;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{BoundaryType, Enumeration, ModelTable, Storage, TableExperiment};
use trueup_models::effect::PlantKind;
use trueup_models::flexible_arm::layout::{AXIAL, AXIAL_CHOICE, LINK_MODES};
use trueup_models::space::appendage::Shapes;
use trueup_models::space::control::SpaceController;
use trueup_models::space::design::RobotDesign;
use trueup_models::space::layout::{COUPLING, Inputs, Outputs, Parameters, States};
use trueup_models::space::tree::{JointType, Tree};
use trueup_models::space::{RobotStructure, SpatialFreeFlyer, presets};
use trueup_numerics::hybrid::Hybrid;

/// Relative tolerance of the default experiment: see [`crate::experiment::TOLERANCE`].
const SPACE_TOLERANCE: f64 = 1e-6;

/// What the configuration fixes, by these names.
const PARENT: &str = "parent";
const JOINT_TYPE: &str = "jointType";
const TIP: &str = "tip";
const THRUSTERS: &str = "thrusters";
const HELD: &str = "held";
const ANALYSIS: &str = "analysis";
const TABLE_MODES: &str = "modesOfTable";
const LINK_TABLE_MODES: &str = "modesOfLinkTable";
/// Item of [`AXIAL`]: on.
pub(crate) const STIFFENING: usize = 2;
const SHAPES: [&str; 3] = ["shapesX", "shapesY", "shapesTorsion"];

/// The model of a configuration, and start values of its parameters before those of the configuration.
pub(crate) fn build(c: &Configuration) -> Result<(SpatialFreeFlyer, Vec<f64>), String> {
    if has_bodies(c) {
        let model = SpatialFreeFlyer::with_effects(structure(c)?, &c.effects)?;
        let start = model.defaults();
        return Ok((model, start));
    }
    let mut design = presets::chaser();
    if c.effects.iter().any(|id| id == "joint-flexibility") {
        design.flex(&vec![true; design.links.len()])?;
    } else if !c.joint_flexible.is_empty() {
        design.flex(&c.joint_flexible)?;
    }
    let model = SpatialFreeFlyer::with_effects(design.structure(), &c.effects)?;
    let start = [design.parameters(), model.effect_defaults()].concat();
    Ok((model, start))
}

/// The structure that a configuration gives body by body.
pub(crate) fn structure(c: &Configuration) -> Result<RobotStructure, String> {
    let found = |name: &str| {
        c.structure
            .iter()
            .find(|s| s.0 == name)
            .map_or(&[][..], |s| s.1.as_slice())
            .iter()
            .map(|v| *v as usize)
    };
    let first = |name: &str| found(name).next().unwrap_or(0);
    let kind = |v: usize| match v {
        0 => Ok(JointType::Revolute),
        1 => Ok(JointType::Prismatic),
        other => Err(format!("{JOINT_TYPE} {other} is none: 0 is revolute, 1 prismatic")),
    };
    let parent: Vec<usize> = found(PARENT).collect();
    let flexible =
        if c.joint_flexible.is_empty() { vec![false; parent.len()] } else { c.joint_flexible.clone() };
    let [x, y, torsion] = SHAPES.map(|name| found(name).collect::<Vec<usize>>());
    if x.len() != y.len() || x.len() != torsion.len() {
        return Err(format!("{} want one number per appendage each", SHAPES.join(", ")));
    }
    let shapes = x.into_iter().zip(y).zip(torsion);
    Ok(RobotStructure {
        appendages: shapes.map(|((x, y), torsion)| Shapes { x, y, torsion }).collect(),
        tree: Tree { parent, joint: found(JOINT_TYPE).map(kind).collect::<Result<_, _>>()? },
        flexible,
        tips: found(TIP).collect(),
        thrusters: first(THRUSTERS),
        axial_stiffening: first(AXIAL_CHOICE) == STIFFENING,
        held: first(HELD) == 1,
        analysis: first(ANALYSIS) == 1,
        tables: found(TABLE_MODES).collect(),
        links: found(LINK_MODES)
            .collect::<Vec<_>>()
            .chunks(3)
            .map(|l| match l {
                [x, y, torsion] => Ok(Shapes { x: *x, y: *y, torsion: *torsion }),
                _ => Err(format!("{LINK_MODES} requires three numbers per body")),
            })
            .collect::<Result<_, _>>()?,
        tabled_links: found(LINK_TABLE_MODES).collect(),
    })
}

/// The configuration of a model of this robot: its structure, and every value that is not the model's own.
///
/// # Errors
/// A structure that cannot be had, with the remedy.
pub fn of_design(design: &RobotDesign) -> Result<Configuration, String> {
    let s = design.structure();
    let model = SpatialFreeFlyer::new(s.clone())?;
    let own = model.defaults();
    let table = table(&model, &own);
    Ok(Configuration {
        structure: encoded(&s),
        joint_flexible: s.flexible,
        start: differing(&table, &own, &design.parameters()),
        ..Configuration::of("SpatialFreeFlyer")
    })
}

/// It is a plant whose structure is given body by body: a robot that a user describes.
pub fn is_robot(c: &Configuration) -> bool {
    c.model != SpaceController::NAME && has_bodies(c)
}

/// Its structure is given body by body.
pub(crate) fn has_bodies(c: &Configuration) -> bool {
    c.structure.iter().any(|(name, _)| name == PARENT)
}

/// It is one of the names of [`encoded`].
pub(crate) fn of_bodies(name: &str) -> bool {
    const NAMES: [&str; 11] = [
        PARENT,
        JOINT_TYPE,
        TIP,
        THRUSTERS,
        HELD,
        ANALYSIS,
        TABLE_MODES,
        LINK_TABLE_MODES,
        SHAPES[0],
        SHAPES[1],
        SHAPES[2],
    ];
    NAMES.contains(&name) || [LINK_MODES, AXIAL_CHOICE].contains(&name)
}

/// Start values by element names where they are not the model's own.
pub(crate) fn differing(table: &ModelTable, own: &[f64], wanted: &[f64]) -> Vec<(String, f64)> {
    let parameters = table.variables.iter().filter(|v| matches!(v.storage, Storage::Parameter(_)));
    let names = parameters.flat_map(|v| (0..v.len()).map(|e| v.element_name(e)));
    let start = names.zip(own.iter().zip(wanted));
    start.filter(|(_, (a, b))| a != b).map(|(name, (_, b))| (name, *b)).collect()
}

/// Gives parameters, in the order of their table, those of these start values that it has.
pub(crate) fn assign(table: &ModelTable, start: &[(String, f64)], p: &mut [f64]) {
    let parameters = table.variables.iter().filter(|v| matches!(v.storage, Storage::Parameter(_)));
    let names = parameters.flat_map(|v| (0..v.len()).map(|e| v.element_name(e)));
    for (name, p) in names.zip(p) {
        if let Some((_, value)) = start.iter().rfind(|(own, _)| *own == name) {
            *p = *value;
        }
    }
}

/// A structure, body by body, as [`structure`] reads it.
pub(crate) fn encoded(s: &RobotStructure) -> Vec<(String, Vec<u32>)> {
    let numbers = |list: &[usize]| list.iter().map(|v| *v as u32).collect::<Vec<u32>>();
    let shapes = |of: fn(&Shapes) -> usize| s.appendages.iter().map(|a| of(a) as u32).collect();
    let mut structure = vec![
        (SHAPES[0], shapes(|a| a.x)),
        (SHAPES[1], shapes(|a| a.y)),
        (SHAPES[2], shapes(|a| a.torsion)),
        (PARENT, numbers(&s.tree.parent)),
        (JOINT_TYPE, s.tree.joint.iter().map(|j| u32::from(*j == JointType::Prismatic)).collect()),
        (TIP, numbers(&s.tips)),
        (THRUSTERS, vec![s.thrusters as u32]),
        (HELD, vec![u32::from(s.held)]),
    ];
    if s.analysis {
        structure.push((ANALYSIS, vec![1]));
    }
    if s.axial_stiffening {
        structure.push((AXIAL_CHOICE, vec![STIFFENING as u32]));
    }
    if !s.tables.is_empty() {
        structure.push((TABLE_MODES, numbers(&s.tables)));
    }
    if !s.links.is_empty() {
        let all = s.links.iter().flat_map(|l| [l.x, l.y, l.torsion]).collect::<Vec<_>>();
        structure.push((LINK_MODES, numbers(&all)));
    }
    if !s.tabled_links.is_empty() {
        structure.push((LINK_TABLE_MODES, numbers(&s.tabled_links)));
    }
    structure.into_iter().map(|(name, values)| (name.to_owned(), values)).collect()
}

/// The table of a model with those start values (in the model's order).
pub(crate) fn table(model: &SpatialFreeFlyer, start: &[f64]) -> ModelTable {
    let s = model.structure();
    let experiment = TableExperiment { stop_time: 10.0, tolerance: SPACE_TOLERANCE, step_size: 1e-2 };
    let text = "Base with arms in space (dynamics of free-flying robots, eq. 1-18)";
    let mut b = PlantTableBuilder::new("SpatialFreeFlyer", text, experiment);
    b.items(&COUPLING);
    constants(&mut b, s);
    if s.links() > 0 {
        stiffening(&mut b, s);
    }
    let (of_friction, friction_outputs) = model.friction_lists();
    b.parameters(&[Parameters::list(s), of_friction].concat(), start);
    b.inputs(&Inputs::list(s));
    b.outputs(&[Outputs::list(s), friction_outputs].concat());
    b.moved(&States::list(s));
    b.effects(model.effects(), PlantKind::Space);
    if s.bodies() > 0 {
        b.terminal(
            "drive",
            "What a manipulator controller is wired to",
            &["jointTorque", "motorAngle", "motorVelocity", "jointAngle", "jointVelocity"],
        );
    }
    if !s.tips.is_empty() {
        b.terminal(
            "tip",
            "What is held at the tips",
            &["tipForce", "tipTorque", "tipPosition", "tipQuaternion", "tipVelocity", "tipAngularVelocity"],
        );
    }
    let of_base = ["baseForce", "baseTorque"].into_iter().filter(|_| !s.held);
    let base: Vec<&str> =
        of_base.chain(["basePosition", "baseQuaternion", "baseVelocity", "baseAngularVelocity"]).collect();
    b.terminal("base", "What controls the base's attitude", &base);
    b.finish(model.sizes().indicators)
}

/// Whether loads along links stiffen them.
pub(crate) fn stiffening(b: &mut PlantTableBuilder, s: &RobotStructure) {
    let kind = b.items(&AXIAL);
    let item = if s.axial_stiffening { STIFFENING as f64 } else { 1.0 };
    let text = "Whether loads along the links stiffen them (fixed when packed)";
    b.constant(AXIAL_CHOICE, kind, &[], &[item], text);
}

/// What of a robot is fixed when it is packed.
pub(crate) fn constants(b: &mut PlantTableBuilder, s: &RobotStructure) {
    let kind = b.enumeration(Enumeration {
        name: "JointType",
        description: "What a joint leaves free",
        items: vec![("revolute", "turning about its axis"), ("prismatic", "sliding along its axis")],
    });
    let reals = |list: &[usize]| list.iter().map(|v| *v as f64).collect::<Vec<f64>>();
    let flags = |list: &[bool]| list.iter().map(|v| f64::from(*v)).collect::<Vec<f64>>();
    let n = s.bodies();
    b.constant(
        "numberOfBodies",
        BoundaryType::Integer,
        &[],
        &[n as f64],
        "Moving bodies, n (fixed when packed)",
    );
    b.constant(
        "baseHeld",
        BoundaryType::Boolean,
        &[],
        &flags(&[s.held]),
        "The base does not move (fixed when packed)",
    );
    if n > 0 {
        let parent = reals(&s.tree.parent);
        b.constant(
            PARENT,
            BoundaryType::Integer,
            &[n],
            &parent,
            "Body that carries the body; 0: the base (fixed when packed)",
        );
        let types: Vec<f64> =
            s.tree.joint.iter().map(|j| if *j == JointType::Prismatic { 2.0 } else { 1.0 }).collect();
        b.constant(JOINT_TYPE, kind, &[n], &types, "Of the joint that the body hangs on (fixed when packed)");
        let text = "The joint has its spring (fixed when packed)";
        b.constant("jointFlexible", BoundaryType::Boolean, &[n], &flags(&s.flexible), text);
    }
    if !s.tips.is_empty() {
        let text = "Body that the end effector is fixed to (fixed when packed)";
        b.constant(TIP, BoundaryType::Integer, &[s.tips.len()], &reals(&s.tips), text);
    }
    let panels = s.appendages.len();
    if panels > 0 {
        for (name, of, text) in [
            (
                SHAPES[0],
                (|a| a.x) as fn(&Shapes) -> usize,
                "Shapes of bending along the appendage's x (fixed when packed)",
            ),
            (SHAPES[1], |a| a.y, "Shapes of bending along the appendage's y (fixed when packed)"),
            (SHAPES[2], |a| a.torsion, "Shapes of torsion (fixed when packed)"),
        ] {
            let numbers: Vec<f64> = s.appendages.iter().map(|a| of(a) as f64).collect();
            b.constant(name, BoundaryType::Integer, &[panels], &numbers, text);
        }
    }

    if !s.links.is_empty() {
        let text =
            "Shapes of the body's link along its x, along its y and of torsion; 0: rigid (fixed when packed)";
        let numbers: Vec<f64> =
            s.links.iter().flat_map(|l| [l.x, l.y, l.torsion]).map(|n| n as f64).collect();
        b.constant(LINK_MODES, BoundaryType::Integer, &[n, 3], &numbers, text);
    }
    if !s.tabled_links.is_empty() {
        let text = "Modes of the body's link that is given by a table; 0: it is none (fixed when packed)";
        b.constant(LINK_TABLE_MODES, BoundaryType::Integer, &[n], &reals(&s.tabled_links), text);
    }
    if !s.tables.is_empty() {
        let text = "Modes of an appendage that is given by a table, behind the beams (fixed when packed)";
        b.constant(TABLE_MODES, BoundaryType::Integer, &[s.tables.len()], &reals(&s.tables), text);
    }
}
