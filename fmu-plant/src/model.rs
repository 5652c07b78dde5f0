//! The two plants as one type: a library stands for either, as its configuration says.

use crate::{arm, joint};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_models::arm::PlanarManipulator;
use trueup_models::joint::{TwoMassJoint, parameter};
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, Hybrid, Sizes, Update};

/// A plant and its variable table.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum Plant {
    /// `TwoMassJoint`; the gear ratio packed, if it is not the default.
    Joint(TwoMassJoint, Option<f64>),
    /// `PlanarManipulator`.
    Arm(PlanarManipulator),
}

/// The structure of the CBK PAN test-bed: joint 1 flexible, joints 2 and 3 rigid.
pub const TEST_BED: [bool; 3] = [true, false, false];

macro_rules! each {
    ($plant:expr, $model:ident => $body:expr) => {
        match $plant {
            Plant::Joint($model, _) => $body,
            Plant::Arm($model) => $body,
        }
    };
}

impl Hybrid for Plant {
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

impl FmuModel for Plant {
    fn build(c: &Configuration) -> Result<Self, String> {
        match c.model.as_str() {
            "TwoMassJoint" => {
                if c.joint_flexible.len() > 1 {
                    return Err(format!("TwoMassJoint has one joint, not {}", c.joint_flexible.len()));
                }
                let flexible = c.joint_flexible.first().copied().unwrap_or(true);
                let gear_ratio =
                    c.start.iter().find(|(name, _)| name == "gearRatio").map(|(_, value)| *value);
                TwoMassJoint::new(flexible, &c.effects)
                    .map(|m| Self::Joint(m, gear_ratio))
                    .map_err(|e| e.to_string())
            }
            "PlanarManipulator" => {
                let flexible = if c.joint_flexible.is_empty() { &TEST_BED[..] } else { &c.joint_flexible };
                PlanarManipulator::new(flexible, &c.effects).map(Self::Arm).map_err(|e| e.to_string())
            }
            other => {
                Err(format!("this library has no model {other:?}; it has {}", crate::MODELS.join(" and ")))
            }
        }
    }
    fn table(&self) -> ModelTable {
        match self {
            Self::Joint(m, gear_ratio) => joint::table(m, *gear_ratio),
            Self::Arm(m) => arm::table(m, &m.defaults()),
        }
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        match self {
            Self::Joint(..) if p[parameter::TORQUE_CONSTANT] == 0.0 => Err((
                parameter::TORQUE_CONSTANT,
                "torqueConstant is 0: no current moves the motor; give K_t".into(),
            )),
            Self::Joint(..) => Ok(()),
            Self::Arm(m) => m.check(p),
        }
    }
}
