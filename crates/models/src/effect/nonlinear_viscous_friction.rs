//! `nonlinear-viscous-friction`: speed-dependent friction that is not proportional to speed.
//!
//! (EF-15) adds tau_d (|omega| / omega_d)^p against the motion, straight below omega_d / 100.
//!
//! What it gets wrong: friction that falls with speed beyond the Stribeck range.

use super::*;
use crate::effect::power::odd_power;

pub(crate) struct NonlinearViscousFriction;

impl Effect for NonlinearViscousFriction {
    const SPEC: Spec = Spec {
        id: "nonlinear-viscous-friction",
        component: "motor-friction",
        summary: "speed-dependent friction that is not proportional to speed",
        noun: "friction that is not proportional to speed",
        check: "Run at several steady speeds and plot current over speed: is it a straight line?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "dragTorque",
                unit: "N.m",
                description: "Friction torque at the reference speed, tau_d (EF-15)",
                min: 0.0,
                joint_start: 5.0e-5,
                arm_start: 0.005,
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "dragExponent",
                unit: "1",
                description: "Exponent of the speed, p (EF-15); 1 is viscous friction",
                min: 0.3,
                above_min: false,
                max: 4.0,
                joint_start: 2.0,
                arm_start: 2.0,
                scale: EffectScale::plain(2.0),
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "dragReferenceSpeed",
                unit: "rad/s",
                description: "Speed at which the friction is tau_d, omega_d (EF-15)",
                joint_start: 1000.0,
                arm_start: 0.1,
                role: ParameterRole::Reference,
                scale: EffectScale::of(1.0, &[(Measure::Speed, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, direction: f64, levels: &mut Levels<T>) {
        levels.viscous += l.p(0) * odd_power(d.omega * direction / l.p(2), l.p(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef15_grows_with_the_power_of_the_speed() {
        for (omega, exponent, expected) in [(20.0, 2.0, 0.5 * 4.0), (-30.0, 1.0, 1.5), (40.0, 0.5, 1.0)] {
            let d = DriveTrain { omega, ..DriveTrain::default() };
            let mut levels = paper(0.0, 0.0, 0.0, 0.0);
            let p = [0.5, exponent, 10.0];
            NonlinearViscousFriction::friction(
                &Local::new(&p, &[], &[], 0, 1),
                &d,
                f64::signum(omega),
                &mut levels,
            );
            assert!((levels.braking() / expected - 1.0).abs() < 1e-4, "{omega}: {}", levels.braking());
        }
    }
}
