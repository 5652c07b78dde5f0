//! JointController and ManipulatorController as FMUs: binding only.

mod adaptation;
mod builder;
pub mod variables;

use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_fmi_export::reference::Schedule;
use trueup_models::controller::{JointController, ManipulatorController};

/// The models of this library.
pub const MODELS: &[&str] = &["JointController", "ManipulatorController"];

/// Either controller: the library is the one that its configuration names.
#[derive(Clone, Copy, Debug)]
pub enum Controller {
    /// `JointController`.
    Joint(JointController),
    /// `ManipulatorController`.
    Manipulator(ManipulatorController),
}

trueup_numerics::delegate_hybrid!(Controller { Controller::Joint(m) => m, Controller::Manipulator(m) => m });

impl FmuModel for Controller {
    fn build(c: &Configuration) -> Result<Self, String> {
        if !c.effects.is_empty() {
            return Err(format!("{} takes no effects; they belong to the plants", c.model));
        }
        match c.model.as_str() {
            "JointController" if c.joint_flexible.len() <= 1 => Ok(Self::Joint(JointController)),
            "JointController" => {
                Err(format!("JointController has one joint, not {}", c.joint_flexible.len()))
            }
            // The number of joints is that of the structure given; which are flexible does not matter here.
            "ManipulatorController" => {
                let joints = if c.joint_flexible.is_empty() { 3 } else { c.joint_flexible.len() };
                Ok(Self::Manipulator(ManipulatorController { joints }))
            }
            other => Err(format!("this library has no model {other:?}; it has {}", MODELS.join(" and "))),
        }
    }
    fn table(&self) -> ModelTable {
        match self {
            Self::Joint(_) => variables::joint_controller(),
            Self::Manipulator(m) => variables::manipulator_controller(m.joints),
        }
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        match self {
            Self::Joint(m) => m.check(p),
            Self::Manipulator(m) => m.check(p),
        }
    }
}

/// Inputs of the reference experiment of a controller: a step of the reference, a motor that follows late.
pub fn schedule(model: &str) -> Option<Schedule<'static>> {
    match model {
        "JointController" => Some(&[
            (0.1, "positionReference", 1e-4),
            (0.2, "motorAngle", 2.0),
            (0.2, "motorVelocity", 0.5),
            (0.4, "loadAngle", 5e-5),
            (0.6, "positionReference", -2e-4),
            (0.8, "velocityFeedforward", 1e-4),
        ]),
        "ManipulatorController" => Some(&[
            (1.0, "positionReference[1]", 0.1),
            (2.0, "motorAngle[1]", 0.05),
            (3.0, "jointAngle[1]", 0.04),
            (4.0, "motorVelocity[1]", 0.01),
            (6.0, "positionReference[1]", -0.1),
        ]),
        _ => None,
    }
}
