//! The plants as one type: a library is any of them, as its configuration declares.

use crate::arm::{self, TEST_BED};
use crate::contact::{self, Contact};
use crate::structure::chosen;
use crate::{flexible_arm, joint, space, space_controller};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_models::arm::{BASE_CHOICE, FIXED_BASE, PlanarManipulator};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::joint::{TwoMassJoint, parameter};
use trueup_models::space::SpatialFreeFlyer;
use trueup_models::space::control::SpaceController;
use trueup_numerics::hybrid::At;

/// A plant and its variable table.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum PlantModelTable {
    /// `TwoMassJoint`; the gear ratio packed, if it is not the default.
    Joint(TwoMassJoint, Option<f64>),
    /// `PlanarManipulator`.
    Arm(PlanarManipulator),
    /// `SpatialFreeFlyer` with the start values of its parameters.
    Space(SpatialFreeFlyer, Vec<f64>),
    /// `FlexibleArm` with the start values of its parameters.
    FlexibleArm {
        /// The model.
        arm: FlexibleArm,
        /// Start values of its parameters.
        start: Vec<f64>,
        /// Size of the steps of Co-Simulation where they are fixed, s.
        step: Option<f64>,
    },
    /// `SpaceController` with the start values of its parameters.
    SpaceController(SpaceController, Vec<f64>),
    /// `FreeBody`, `GripperContact` or `CaptureScene`.
    Contact(Contact),
}

trueup_numerics::delegate_hybrid!(PlantModelTable {
    PlantModelTable::Joint(m, _) => m,
    PlantModelTable::Arm(m) => m,
    PlantModelTable::Space(m, _) => m,
    PlantModelTable::SpaceController(m, _) => m,
    PlantModelTable::FlexibleArm { arm, .. } => arm,
    PlantModelTable::Contact(m) => m
});

impl FmuModel for PlantModelTable {
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
                let fixed = chosen(c)?(BASE_CHOICE) == Some(FIXED_BASE as usize);
                PlanarManipulator::on_base(fixed, flexible, &c.effects)
                    .map(Self::Arm)
                    .map_err(|e| e.to_string())
            }
            "SpatialFreeFlyer" => space::build(c).map(|(m, start)| Self::Space(m, start)),
            SpaceController::NAME => {
                space_controller::build(c).map(|(m, start)| Self::SpaceController(m, start))
            }
            "FlexibleArm" => {
                let step = flexible_arm::fixed(c).then_some(flexible_arm::STEP);
                flexible_arm::build(c).map(|(arm, start)| Self::FlexibleArm { arm, start, step })
            }
            name if contact::MODELS.contains(&name) => contact::build(c).map(Self::Contact),
            other => Err(format!("this library has no model {other:?}; it has {}", crate::MODELS.join(", "))),
        }
    }
    fn table(&self) -> ModelTable {
        match self {
            Self::Joint(m, gear_ratio) => joint::table(m, *gear_ratio),
            Self::Arm(m) => arm::table(m, &m.defaults()),
            Self::Space(m, start) => space::table(m, start),
            Self::SpaceController(m, start) => space_controller::table(m, start),
            Self::FlexibleArm { arm, start, step } => flexible_arm::table(arm, start, step.is_some()),
            Self::Contact(m) => m.table(),
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
            Self::Space(m, _) => m.check(p),
            Self::SpaceController(m, _) => m.check(p),
            Self::FlexibleArm { arm, .. } => arm.check(p),
            Self::Contact(m) => m.check(p),
        }
    }
    fn watch(&self, at: At<'_, f64>, said: u32) -> Option<(u32, String)> {
        match self {
            Self::Space(m, _) if said == 0 => m.too_fast(&at).map(|text| (1, text)),
            Self::Contact(m) => m.watch(&at, said),
            Self::Space(..)
            | Self::SpaceController(..)
            | Self::FlexibleArm { .. }
            | Self::Joint(..)
            | Self::Arm(_) => None,
        }
    }
    fn long_step(&self, h: f64, p: &[f64]) -> Option<String> {
        match self {
            Self::Contact(m) => m.long_step(h, p),
            Self::Space(..)
            | Self::SpaceController(..)
            | Self::FlexibleArm { .. }
            | Self::Joint(..)
            | Self::Arm(_) => None,
        }
    }
    fn singular(&self, at: At<'_, f64>) -> Option<String> {
        match self {
            Self::Contact(m) => m.singular(&at),
            Self::Space(..)
            | Self::SpaceController(..)
            | Self::FlexibleArm { .. }
            | Self::Joint(..)
            | Self::Arm(_) => None,
        }
    }
    fn fixed_step(&self) -> Option<f64> {
        match self {
            Self::FlexibleArm { step, .. } => *step,
            Self::Space(..)
            | Self::SpaceController(..)
            | Self::Joint(..)
            | Self::Arm(_)
            | Self::Contact(_) => None,
        }
    }
    fn remark(&self, p: &[f64]) -> Option<String> {
        match self {
            Self::Space(m, _) => m.remark(p),
            Self::FlexibleArm { arm, .. } => arm.bodies().remark(p),
            Self::SpaceController(..) | Self::Joint(..) | Self::Arm(_) | Self::Contact(_) => None,
        }
    }
}
