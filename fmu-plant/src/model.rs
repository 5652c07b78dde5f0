//! The plants as one type: a library is any of them, as its configuration declares.

use crate::arm::{self, TEST_BED};
use crate::contact::{self, Contact};
use crate::structure::chosen;
use crate::{flexible_arm, joint, space, space_controller};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_models::arm::{
    BASE_CHOICE, BY_ACCELERATION, FIXED_BASE, InverseDynamics, JOINT_DRIVE_CHOICE, PlanarManipulator,
};
use trueup_models::flexible_arm::FlexibleArm;
use trueup_models::joint::{GEARBOX_CHOICE, TWO_STAGES, TwoMassJoint, TwoStageJoint, parameter};
use trueup_models::space::SpatialFreeFlyer;
use trueup_models::space::control::SpaceController;
use trueup_numerics::hybrid::At;

/// A plant and its variable table.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum PlantModelTable {
    /// `TwoMassJoint`; the gear ratio packed, if it is not the default.
    Joint(TwoMassJoint, Option<f64>),
    /// `TwoMassJoint` whose gearbox has two stages; the gear ratio packed.
    TwoStageJoint(TwoStageJoint, f64),
    /// `PlanarManipulator`.
    Arm(PlanarManipulator),
    /// `PlanarManipulator` driven by accelerations.
    InverseDynamics(InverseDynamics),
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
    PlantModelTable::TwoStageJoint(m, _) => m,
    PlantModelTable::Arm(m) => m,
    PlantModelTable::InverseDynamics(m) => m,
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
                let packed =
                    |name: &str| c.start.iter().find(|(own, _)| own == name).map(|(_, value)| *value);
                let joint = TwoMassJoint::new(flexible, &c.effects).map_err(|e| e.to_string())?;
                if chosen(c)?(GEARBOX_CHOICE) != Some(TWO_STAGES as usize) {
                    return Ok(Self::Joint(joint, packed("gearRatio")));
                }
                let joint = TwoStageJoint::new(joint)?;
                let (places, own) = (joint.places(), joint.defaults());
                let ratio = packed("planetaryRatio").unwrap_or(own[places.planetary_ratio])
                    * packed("harmonicDriveRatio").unwrap_or(own[places.harmonic_drive_ratio]);
                Ok(Self::TwoStageJoint(joint, ratio))
            }
            "PlanarManipulator" => {
                let flexible = if c.joint_flexible.is_empty() { &TEST_BED[..] } else { &c.joint_flexible };
                let item = chosen(c)?;
                let fixed = item(BASE_CHOICE) == Some(FIXED_BASE as usize);
                let arm =
                    PlanarManipulator::on_base(fixed, flexible, &c.effects).map_err(|e| e.to_string())?;
                match item(JOINT_DRIVE_CHOICE) == Some(BY_ACCELERATION as usize) {
                    true => InverseDynamics::new(arm).map(Self::InverseDynamics),
                    false => Ok(Self::Arm(arm)),
                }
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
            Self::TwoStageJoint(m, gear_ratio) => joint::two_stage_table(m, *gear_ratio),
            Self::Arm(m) => arm::table(m, &m.defaults()),
            Self::InverseDynamics(m) => arm::inverse_table(m),
            Self::Space(m, start) => space::table(m, start),
            Self::SpaceController(m, start) => space_controller::table(m, start),
            Self::FlexibleArm { arm, start, step } => flexible_arm::table(arm, start, step.is_some()),
            Self::Contact(m) => m.table(),
        }
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        let driven = |at: usize| match p[at] == 0.0 {
            true => Err((at, "torqueConstant is 0: no current moves the motor; give K_t".into())),
            false => Ok(()),
        };
        match self {
            Self::Joint(..) => driven(parameter::TORQUE_CONSTANT),
            Self::TwoStageJoint(m, _) => driven(m.places().torque_constant),
            Self::Arm(m) => m.check(p),
            Self::InverseDynamics(m) => m.arm().check(p),
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
            | Self::TwoStageJoint(..)
            | Self::InverseDynamics(_)
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
            | Self::TwoStageJoint(..)
            | Self::InverseDynamics(_)
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
            | Self::TwoStageJoint(..)
            | Self::InverseDynamics(_)
            | Self::Arm(_) => None,
        }
    }
    fn fixed_step(&self) -> Option<f64> {
        match self {
            Self::FlexibleArm { step, .. } => *step,
            Self::Space(..)
            | Self::SpaceController(..)
            | Self::Joint(..)
            | Self::TwoStageJoint(..)
            | Self::InverseDynamics(_)
            | Self::Arm(_)
            | Self::Contact(_) => None,
        }
    }
    fn remark(&self, p: &[f64]) -> Option<String> {
        match self {
            Self::Space(m, _) => m.remark(p),
            Self::FlexibleArm { arm, .. } => arm.bodies().remark(p),
            Self::SpaceController(..)
            | Self::Joint(..)
            | Self::TwoStageJoint(..)
            | Self::InverseDynamics(_)
            | Self::Arm(_)
            | Self::Contact(_) => None,
        }
    }
}
