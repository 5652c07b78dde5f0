//! Effects as columns, one file each.

mod actuator_lag;
mod asymmetric_friction;
mod backlash;
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
mod torque_ripple;
mod transmission_hysteresis;

pub use external_force::pushes_at;
pub use stribeck_friction::stribeck;

use super::law::EffectLaw;

/// A law of the library.
pub type LawRef = &'static dyn EffectLaw;

/// All of them.
pub static LAWS: [LawRef; 22] = [
    &current_saturation::CurrentSaturationColumns,
    &actuator_lag::ActuatorLagColumns,
    &stribeck_friction::StribeckFrictionColumns,
    &asymmetric_friction::AsymmetricFrictionColumns,
    &load_dependent_friction::LoadDependentFrictionColumns,
    &nonlinear_viscous_friction::NonlinearViscousFrictionColumns,
    &friction_drift::FrictionDriftColumns,
    &presliding_friction::PreslidingFrictionColumns,
    &motor_friction::MotorFrictionColumns,
    &backlash::BacklashColumns,
    &nonlinear_stiffness::NonlinearStiffnessColumns,
    &transmission_hysteresis::TransmissionHysteresisColumns,
    &nonlinear_damping::NonlinearDampingColumns,
    &flexible_link::FlexibleLinkColumns,
    &load_friction::LoadFrictionColumns,
    &gravity_torque::GravityTorqueColumns,
    &cable_stiffness::CableStiffnessColumns,
    &sensor_delay::SensorDelayColumns,
    &sensor_drift::SensorDriftColumns,
    &sensor_eccentricity::SensorEccentricityColumns,
    &torque_ripple::TorqueRippleColumns,
    &kinematic_error::KinematicErrorColumns,
];

/// Impulses, which no grid searches.
pub static PUSHES: LawRef = &external_force::ExternalForceColumns;

/// The law with an id.
pub fn law_of(id: &str) -> Option<LawRef> {
    LAWS.iter().copied().chain([PUSHES]).find(|l| l.id() == id)
}
