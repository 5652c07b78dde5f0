//! The list of our plants as objects: what a case names, and the model behind one.

use crate::arm::{ArmError, PlanarManipulator, Replay};
use crate::compiled::{Compiled, PlantModel};
use crate::effect::{self, EffectSet};
use crate::flexible_arm::FlexibleArm;
use crate::joint::TwoMassJoint;
use crate::space::SpatialFreeFlyer;
use crate::space::design::RobotDesign;
use crate::space::presets;
use std::sync::Arc;
use trueup_plant::Plant;

/// How a plant is built.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PlantStructure {
    /// One of [`NAMES`].
    pub model: String,
    /// What a robot is made of; of the others: none.
    pub robot: Option<Arc<RobotDesign>>,
    /// Which joints have a spring; one entry per joint. Empty: as a robot's file has it.
    pub flexible: Vec<bool>,
    /// An arm's base stays where it begins.
    pub fixed_base: bool,
    /// Ids of its effects.
    pub effects: Vec<String>,
    /// Joints (from 0) whose motor moves as measured, whatever torque that takes; for the arm.
    pub led: Vec<usize>,
    /// Which link carries a body more, from 0; for the arm.
    pub payload: Option<usize>,
}

/// A plant that cannot be had.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StructureError {
    /// No such plant.
    Model(String),
    /// Its structure: what is wrong, with the remedy.
    Structure(String),
    /// Something that a case declares of its structure.
    Parameter {
        /// Its name.
        name: String,
        /// What is wrong, with the remedy.
        what: String,
    },
    /// A payload on a link that is not there, of an arm with so many.
    Payload {
        /// From 1.
        link: usize,
        /// Of the arm.
        links: usize,
    },
}

/// A plant of the list.
struct Listed {
    name: &'static str,
    build: fn(&PlantStructure) -> Result<Arc<dyn Plant>, StructureError>,
    /// Which joints are flexible where that is not chosen.
    flexible: &'static [bool],
    /// What its parameters are unless chosen otherwise.
    preset: &'static str,
}

const LIST: &[Listed] = &[
    Listed { name: TwoMassJoint::NAME, build: joint_of, flexible: &[true], preset: "joint 1 of DELIAN" },
    Listed {
        name: PlanarManipulator::NAME,
        build: arm_of,
        flexible: &[true, false, false],
        preset: "the CBK PAN test-bed",
    },
    Listed {
        name: SpatialFreeFlyer::NAME,
        build: robot_of,
        flexible: &[],
        preset: "the robot's file, or the chaser",
    },
];

/// Names of the plants that recordings can be taken of.
pub const NAMES: [&str; LIST.len()] = [LIST[0].name, LIST[1].name, LIST[2].name];

/// The one that a robot's file describes.
pub const ROBOT: &str = SpatialFreeFlyer::NAME;

/// Whether a robot's file describes it.
pub fn is_robot(model: &str) -> bool {
    model == ROBOT
}

fn listed(model: &str) -> Option<&'static Listed> {
    LIST.iter().find(|l| l.name == model)
}

/// The plant of that structure.
///
/// # Errors
/// See [`StructureError`].
pub fn build(s: &PlantStructure) -> Result<Arc<dyn Plant>, StructureError> {
    (listed(&s.model).ok_or_else(|| StructureError::Model(s.model.clone()))?.build)(s)
}

/// Which joints of that model are flexible where that is not chosen; of an unknown one: none is there.
pub fn usual_flexible(model: &str) -> &'static [bool] {
    listed(model).map_or(&[], |l| l.flexible)
}

/// What the parameters of that model are unless chosen otherwise.
pub fn preset(model: &str) -> &'static str {
    listed(model).map_or("", |l| l.preset)
}

fn joint_of(s: &PlantStructure) -> Result<Arc<dyn Plant>, StructureError> {
    let [flexible] = s.flexible[..] else {
        let n = s.flexible.len();
        let text = format!(
            "jointFlexible has {n} values, {} has one joint; write jointFlexible = true",
            TwoMassJoint::NAME
        );
        return Err(StructureError::Structure(text));
    };
    let joint = TwoMassJoint::new(flexible, &s.effects);
    Ok(Arc::new(Compiled::new(joint.map_err(|e| StructureError::Structure(e.to_string()))?)))
}

fn arm_of(s: &PlantStructure) -> Result<Arc<dyn Plant>, StructureError> {
    let wrong = |e: ArmError| StructureError::Structure(e.to_string());
    let arm = PlanarManipulator::on_base(s.fixed_base, &s.flexible, &s.effects).map_err(wrong)?;
    if let Some(link) = s.payload.filter(|l| *l >= arm.links()) {
        return Err(StructureError::Payload { link: link + 1, links: arm.links() });
    }
    let arm = arm.with_payload(s.payload);
    if s.led.is_empty() {
        return Ok(Arc::new(Compiled::new(arm)));
    }
    let text = "a manipulator with friction cannot follow measured motion; record jointTorque";
    led(arm, &s.led).ok_or_else(|| StructureError::Structure(text.into()))
}

/// Of a case's robot; without a file the chaser.
fn robot_of(s: &PlantStructure) -> Result<Arc<dyn Plant>, StructureError> {
    let wrong = StructureError::Structure;
    let mut design = s.robot.as_deref().cloned().unwrap_or_else(presets::chaser);
    if !s.flexible.is_empty() {
        design.flex(&s.flexible).map_err(wrong)?;
    }
    design.held |= s.fixed_base;
    if s.payload.is_some() {
        let text = "payload: it is for PlanarManipulator; add what a link of a robot carries to bodyMass and bodyInertia";
        return Err(wrong(text.into()));
    }
    if !s.led.is_empty() {
        return Err(wrong("motors of a robot cannot follow measured motion; record jointTorque".into()));
    }
    let model = SpatialFreeFlyer::with_effects(design.structure(), &s.effects).map_err(wrong)?;
    let start = design.parameters();
    Ok(Arc::new(Compiled::starting(model, start)))
}

/// A robot on a base in space.
pub fn flyer(model: SpatialFreeFlyer) -> Arc<dyn Plant> {
    Arc::new(Compiled::new(model))
}

/// An arm on the ground.
pub fn flexible_arm(model: FlexibleArm) -> Arc<dyn Plant> {
    Arc::new(Compiled::new(model))
}

/// An arm with a passive hinge inside link `link` (from 0) at the share `at` of its length, and its parameters where the arm's are `p`
/// ([`PlanarManipulator::hinged`]); `None`: no arm, or one that cannot have it.
pub fn hinged(plant: &dyn Plant, p: &[f64], link: usize, at: f64) -> Option<(Arc<dyn Plant>, Vec<f64>)> {
    let (hinged, q) = arm(plant)?.hinged(p, link, at)?;
    Some((Arc::new(Compiled::new(hinged)), q))
}

/// An arm whose motors of these joints (from 0) move as measured: after its own inputs it has their accelerations, rad/s2, in
/// this order. `None`: it has no such joint, or friction.
pub fn led(arm: PlanarManipulator, led: &[usize]) -> Option<Arc<dyn Plant>> {
    Some(Arc::new(Compiled::new(Replay::new(arm, led)?)))
}

macro_rules! as_object {
    ($($model:ty)*) => {$(
        impl Compiled<$model> {
            /// As an object. Neither generic nor inlined: where this is called none of its equations are compiled again.
            #[inline(never)]
            pub fn plant(&self) -> &dyn Plant {
                self
            }
        }
    )*};
}
as_object!(TwoMassJoint PlanarManipulator FlexibleArm);

fn model<M: PlantModel>(plant: &dyn Plant) -> Option<&M> {
    plant.as_any().downcast_ref::<Compiled<M>>().map(Compiled::inner)
}

/// The joint behind a plant, if it is one.
pub fn joint(plant: &dyn Plant) -> Option<&TwoMassJoint> {
    model(plant)
}

/// The arm behind a plant, if it is one, its motors prescribed or not.
pub fn arm(plant: &dyn Plant) -> Option<&PlanarManipulator> {
    model(plant).or_else(|| model::<Replay>(plant).map(Replay::arm))
}

/// The effects of a plant; none of one without.
pub fn effects(plant: &dyn Plant) -> &EffectSet {
    static NONE: EffectSet = EffectSet::none();
    let own = joint(plant).and_then(PlantModel::effect_set);
    let own = own.or_else(|| arm(plant).and_then(PlantModel::effect_set));
    own.or_else(|| model::<SpatialFreeFlyer>(plant).and_then(PlantModel::effect_set)).unwrap_or(&NONE)
}

/// Which tables of effects hold for a plant: those of an arm, unless it is a joint or a robot in space.
pub fn effect_plant(plant: &dyn Plant) -> effect::PlantKind {
    if joint(plant).is_some() {
        effect::PlantKind::Joint
    } else if model::<SpatialFreeFlyer>(plant).is_some() {
        effect::PlantKind::Space
    } else {
        effect::PlantKind::Arm
    }
}
