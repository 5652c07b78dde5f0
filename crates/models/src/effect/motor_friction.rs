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
        noun: "Coulomb and viscous friction at the motor",
        check: "Raise the current slowly from 0: at which one does the motor start, and which one keeps it at a slow steady speed?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        // Nothing that sticks is rigid: a free run of dry friction without any give parts from the arm at every stop.
        along: Some("presliding-friction"),
        borrows: &[
            Borrowed {
                joint_name: "coulombFriction",
                arm_name: "coulombFriction",
                unit: "N.m",
                neutral: Neutral::Value(0.0),
                scale: EffectScale::of(0.2, &[(Measure::Torque, 1)]),
                known: false,
            },
            Borrowed {
                joint_name: "viscousFriction",
                arm_name: "viscousFriction",
                unit: "N.m.s/rad",
                neutral: Neutral::Value(0.0),
                scale: EffectScale::of(0.2, &[(Measure::Torque, 1), (Measure::Speed, -1)]),
                known: false,
            },
        ],
        affine: true,
        ..Spec::NONE
    };
}

#[cfg(test)]
mod tests {
    use crate::arm::{PlanarManipulator, input, output, parameter};
    use crate::presets::cbk_pan;
    use trueup_numerics::hybrid::{At, Hybrid};

    /// Friction torque of joint 1 of one link on the test-bed's satellite, and whether it sticks.
    fn friction(velocity: f64, torque: f64) -> (f64, bool) {
        let arm = PlanarManipulator::new(&[false], &["motor-friction"]).unwrap();
        let mut p = cbk_pan(&[false]);
        p[parameter::initial_joint_velocity(1)] = velocity;
        p.extend([0.1, 0.3, 0.02]);
        let s = arm.sizes();
        let (mut x, mut u) = (vec![0.0; s.states], vec![0.0; s.inputs]);
        let (mut modes, mut y) = (vec![0; s.modes], vec![0.0; s.outputs]);
        u[input::joint_torque(1)] = torque;
        arm.start(&p, &mut x);
        arm.start_modes(At { t: 0.0, x: &x, u: &u, p: &p, modes: &[] }, &mut modes);
        arm.outputs(At { t: 0.0, x: &x, u: &u, p: &p, modes: &modes }, &mut y);
        (y[output::friction_torque(1)], y[output::sticking(1)] == 1.0)
    }

    #[test]
    fn ef1_brakes_while_sliding_and_balances_while_sticking() {
        let is = |(tau, sticks): (f64, bool), expected: (f64, bool)| {
            assert!(
                (tau - expected.0).abs() < 1e-15 && sticks == expected.1,
                "{tau} {sticks}, not {expected:?}"
            );
        };
        is(friction(2.0, 0.0), (0.1 + 0.02 * 2.0, false));
        is(friction(-2.0, 0.0), (-0.1 - 0.02 * 2.0, false));
        is(friction(0.0, 0.29), (0.29, true));
        is(friction(0.0, -0.29), (-0.29, true));
        is(friction(0.0, 0.31), (0.1, false));
    }
}
