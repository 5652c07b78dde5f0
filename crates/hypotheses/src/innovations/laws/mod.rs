//! Effects as columns, one file each. What differs from plant to plant are fields of a law: units and priors of its amplitudes,
//! companions, and what is looked for.

mod actuator_lag;
mod appendage_mode;
mod asymmetric_friction;
mod backlash;
mod base_cable;
mod base_drag;
mod base_thrust;
mod cable_stiffness;
mod current_saturation;
mod external_force;
mod flexible_link;
mod friction_drift;
mod gravity_torque;
mod kinematic_error;
mod load_dependent_friction;
mod load_friction;
mod motor_friction;
mod nonlinear_damping;
mod nonlinear_stiffness;
mod nonlinear_viscous_friction;
mod presliding_friction;
mod sensor;
mod sensor_delay;
mod sensor_drift;
mod sensor_eccentricity;
mod stribeck_friction;
mod table_tilt;
mod torque_ripple;
mod transmission_hysteresis;

pub use external_force::pushes_at;
pub use stribeck_friction::{SLIP, stribeck};

use super::law::EffectLaw;

/// A law of the library.
pub type LawRef = &'static dyn EffectLaw;

/// Those of a joint.
pub static LAWS: [LawRef; 22] = [
    &current_saturation::CurrentSaturationColumns::JOINT,
    &actuator_lag::ActuatorLagColumns::JOINT,
    &stribeck_friction::StribeckFrictionColumns::JOINT,
    &asymmetric_friction::AsymmetricFrictionColumns::JOINT,
    &load_dependent_friction::LoadDependentFrictionColumns::JOINT,
    &nonlinear_viscous_friction::NonlinearViscousFrictionColumns::JOINT,
    &friction_drift::FrictionDriftColumns::JOINT,
    &presliding_friction::PreslidingFrictionColumns::Joint,
    &motor_friction::MotorFrictionColumns::JOINT,
    &backlash::BacklashColumns::JOINT,
    &nonlinear_stiffness::NonlinearStiffnessColumns::Joint,
    &transmission_hysteresis::TransmissionHysteresisColumns::JOINT,
    &nonlinear_damping::NonlinearDampingColumns::JOINT,
    &flexible_link::FlexibleLinkColumns::Joint,
    &load_friction::LoadFrictionColumns::JOINT,
    &gravity_torque::GravityTorqueColumns::JOINT,
    &cable_stiffness::CableStiffnessColumns,
    &sensor_delay::SensorDelayColumns::JOINT,
    &sensor_drift::SensorDriftColumns::JOINT,
    &sensor_eccentricity::SensorEccentricityColumns::JOINT,
    &torque_ripple::TorqueRippleColumns::JOINT,
    &kinematic_error::KinematicErrorColumns::JOINT,
];

/// Those of an arm.
pub static ARM_LAWS: [LawRef; 27] = [
    &current_saturation::CurrentSaturationColumns::ARM,
    &actuator_lag::ActuatorLagColumns::ARM,
    &stribeck_friction::StribeckFrictionColumns::ARM,
    &asymmetric_friction::AsymmetricFrictionColumns::ARM,
    &load_dependent_friction::LoadDependentFrictionColumns::ARM,
    &nonlinear_viscous_friction::NonlinearViscousFrictionColumns::ARM,
    &friction_drift::FrictionDriftColumns::ARM,
    &presliding_friction::PreslidingFrictionColumns::Arm,
    &motor_friction::MotorFrictionColumns::ARM,
    &backlash::BacklashColumns::ARM,
    &nonlinear_stiffness::NonlinearStiffnessColumns::Arm,
    &transmission_hysteresis::TransmissionHysteresisColumns::ARM,
    &nonlinear_damping::NonlinearDampingColumns::ARM,
    &flexible_link::FlexibleLinkColumns::Arm,
    &load_friction::LoadFrictionColumns::ARM,
    &gravity_torque::GravityTorqueColumns::ARM,
    &cable_stiffness::CableStiffnessColumns,
    &sensor_delay::SensorDelayColumns::ARM,
    &sensor_drift::SensorDriftColumns::ARM,
    &sensor_eccentricity::SensorEccentricityColumns::ARM,
    &torque_ripple::TorqueRippleColumns::ARM,
    &kinematic_error::KinematicErrorColumns::ARM,
    &table_tilt::TableTiltColumns,
    &base_drag::BaseDragColumns,
    &base_thrust::BaseThrustColumns,
    &base_cable::BaseCableColumns,
    &appendage_mode::AppendageModeColumns,
];

/// Impulses on a joint, which no grid searches.
pub static PUSHES: LawRef = &external_force::ExternalForceColumns::JOINT;
/// Impulses on an arm.
pub static ARM_PUSHES: LawRef = &external_force::ExternalForceColumns::ARM;

/// The law of a joint with an id.
pub fn law_of(id: &str) -> Option<LawRef> {
    LAWS.iter().copied().chain([PUSHES]).find(|l| l.id() == id)
}

/// The law of an arm with an id at a place.
pub fn arm_law_of(id: &str, place: &str) -> Option<LawRef> {
    if id == "cable-stiffness" && place == "base" {
        return Some(&base_cable::BaseCableColumns);
    }
    ARM_LAWS.iter().copied().chain([ARM_PUSHES]).find(|l| l.id() == id)
}
