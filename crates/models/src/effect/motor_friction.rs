//! `motor-friction`: Coulomb and viscous friction at the motor, where the model has none.
//!
//! (EF-1) tau_fr = tau_c sign(omega) + D_m omega while sliding, up to tau_s while sticking (S3 eq. 3, 4).
//!
//! The two-mass joint has this friction by itself: there the effect adds no variable of its own.
//! What it gets wrong: see [`crate::friction`].

use super::*;

pub(crate) struct MotorFriction;

impl Effect for MotorFriction {
    const SPEC: Spec = Spec {
        id: "motor-friction",
        component: "motor-friction",
        summary: "Coulomb and viscous friction at the motor, with a static level",
        scope: Scope::Joint,
        plants: &[Plant::Joint, Plant::Arm],
        friction: true,
        ..Spec::NONE
    };
}
