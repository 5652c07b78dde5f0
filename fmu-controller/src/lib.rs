//! JointController and ManipulatorController as FMUs: binding only.

pub mod variables;

use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_fmi_export::reference::Schedule;
use trueup_models::controller::{JointController, ManipulatorController};
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, Hybrid, Sizes, Update};

/// The models of this library.
pub const MODELS: &[&str] = &["JointController", "ManipulatorController"];

/// Either controller: the library stands for the one that its configuration names.
#[derive(Clone, Copy, Debug)]
pub enum Controller {
    /// `JointController`.
    Joint(JointController),
    /// `ManipulatorController`.
    Manipulator(ManipulatorController),
}

macro_rules! each {
    ($controller:expr, $model:ident => $body:expr) => {
        match $controller {
            Controller::Joint($model) => $body,
            Controller::Manipulator($model) => $body,
        }
    };
}

impl Hybrid for Controller {
    fn sizes(&self) -> Sizes {
        each!(self, m => m.sizes())
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        each!(self, m => m.start(p, x));
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        each!(self, m => m.start_modes(at, modes));
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        each!(self, m => m.rates(at, dx));
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        each!(self, m => m.outputs(at, y));
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        each!(self, m => m.indicators(at, z));
    }
    fn direction(&self, indicator: usize) -> Direction {
        each!(self, m => m.direction(indicator))
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> Update {
        each!(self, m => m.update(t, x, u, p, modes))
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        each!(self, m => m.next_event(p, modes))
    }
}

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
        each!(self, m => m.check(p))
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
