//! `stribeck-friction`: sliding friction falls from the break-away level to the Coulomb level as the motor
//! gathers speed.
//!
//! (EF-2) tau_fr = tau_c + (tau_s - tau_c) exp(-|omega| / omega_s) + D_m |omega|, against the motion.
//!
//! Without it the level drops from tau_s to tau_c at once (S3 eq. 3, 4).
//! What it gets wrong: no memory; the level follows the speed without lag.

use super::*;

pub(crate) struct StribeckFriction;

impl Effect for StribeckFriction {
    const SPEC: Spec = Spec {
        id: "stribeck-friction",
        component: "motor-friction",
        summary: "sliding friction falls from the break-away level to the Coulomb level with speed",
        noun: "break-away (Stribeck) friction",
        check: "Raise the current slowly until the motor breaks loose, then lower it until it stops: are the two currents different?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        borrows: &[Borrowed {
            joint_name: "staticFriction",
            arm_name: "staticFriction",
            unit: "N.m",
            neutral: Neutral::Of("coulombFriction"),
            scale: EffectScale::of(0.2, &[(Measure::Torque, 1)]),
            known: false,
        }],
        parameters: &[ParameterSpec {
            name: "stribeckVelocity",
            unit: "rad/s",
            description: "Motor speed at which the excess of break-away over Coulomb friction has fallen to 1/e, omega_s (EF-2)",
            joint_start: 20.0,
            arm_start: 0.05,
            scale: EffectScale::of(0.05, &[(Measure::Speed, 1)]),
            ..ParameterSpec::SHAPE
        }],
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, direction: f64, levels: &mut Levels<T>) {
        // At rest the sliding level is the Coulomb level: what came before has no speed-dependent part there.
        let speed = d.omega * direction;
        let coulomb = levels.coulomb;
        levels.sliding += (levels.breakaway - coulomb) * (-speed / l.p(0)).exp();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef2_joins_breakaway_and_coulomb_level() {
        let (p, x, m) = ([20.0], [], []);
        let l = Local::<f64>::new(&p, &x, &m, 0, 1);
        let at = |omega: f64| {
            let mut levels = paper(1.0, 4.0, 0.0, omega);
            StribeckFriction::friction(&l, &DriveTrain { omega, ..DriveTrain::default() }, 1.0, &mut levels);
            levels.braking()
        };
        assert_eq!(at(0.0), 4.0);
        assert!((at(20.0) - (1.0 + 3.0 * (-1.0f64).exp())).abs() < 1e-15);
        assert!((at(2000.0) - 1.0).abs() < 1e-15);
    }
}
