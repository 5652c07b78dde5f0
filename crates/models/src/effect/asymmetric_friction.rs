//! `asymmetric-friction`: friction that differs between the two directions.
//!
//! (EF-13) tau_c +- A_c and tau_s +- A_c, D_m +- A_v: + forward, - backward; no level falls below 0.
//!
//! What it gets wrong: nothing that a constant torque would not do too as long as the motor slides; the two part at rest.

use super::*;

pub(crate) struct AsymmetricFriction;

impl Effect for AsymmetricFriction {
    const SPEC: Spec = Spec {
        id: "asymmetric-friction",
        component: "motor-friction",
        summary: "friction that differs between the two directions",
        noun: "friction that differs between the two directions",
        check: "Run at one slow speed forwards and backwards: does it take a different current?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "coulombAsymmetry",
                unit: "N.m",
                description: "Half the difference of the dry friction, forward less backward, A_c (EF-13)",
                joint_start: 2.0e-5,
                arm_start: 0.002,
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "viscousAsymmetry",
                unit: "N.m.s/rad",
                description: "Half the difference of the viscous friction, forward less backward, A_v (EF-13)",
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1), (Measure::Speed, -1)]),
                ..ParameterSpec::NONE
            },
        ],
        affine: true,
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, direction: f64, levels: &mut Levels<T>) {
        let shifted = |level: T| (level + l.p(0) * direction).max(T::zero());
        levels.breakaway = shifted(levels.breakaway);
        levels.coulomb = shifted(levels.coulomb);
        levels.sliding = shifted(levels.sliding);
        let viscous = levels.viscous + l.p(1) * d.omega;
        // Against the motion whatever the parameters are: `omega * direction` is the speed.
        levels.viscous = if d.omega.value() * direction > 0.0 { viscous.max(T::zero()) } else { viscous };
    }
    fn dry(l: &Local<f64>) -> bool {
        l.p(0) != 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef13_differs_by_twice_the_asymmetry() {
        let braking = |omega: f64, p: [f64; 2]| {
            let mut levels = paper(1.0, 2.0, 0.1, omega.abs());
            let d = DriveTrain { omega, ..DriveTrain::default() };
            AsymmetricFriction::friction(&Local::new(&p, &[], &[], 0, 1), &d, omega.signum(), &mut levels);
            (levels.braking(), levels.breakaway)
        };
        let (forward, backward) = (braking(5.0, [0.3, 0.02]), braking(-5.0, [0.3, 0.02]));
        assert!((forward.0 - (1.3 + 0.12 * 5.0)).abs() < 1e-15 && (forward.1 - 2.3).abs() < 1e-15);
        assert!((backward.0 - (0.7 + 0.08 * 5.0)).abs() < 1e-15 && (backward.1 - 1.7).abs() < 1e-15);
        assert_eq!(braking(-5.0, [9.0, 9.0]).0, 0.0);
    }
}
