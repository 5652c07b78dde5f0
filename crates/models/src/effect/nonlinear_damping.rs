//! `nonlinear-damping`: damping that is not proportional to the deformation rate.
//!
//! (EF-18) adds tau_n (|r| / r_n)^p against the rate r of the deformation, straight below r_n / 100.
//!
//! What it gets wrong: damping that grows with the deflection.

use super::*;
use crate::effect::power::odd_power;

pub(crate) struct NonlinearDamping;

impl Effect for NonlinearDamping {
    const SPEC: Spec = Spec {
        id: "nonlinear-damping",
        component: "transmission",
        summary: "damping that is not proportional to the deformation rate",
        noun: "damping that is not proportional to the deformation rate",
        check: "Let the joint ring down from a large and from a small amplitude: does the decrement differ?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        compliant: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "dampingTorque",
                unit: "N.m",
                description: "Torque at the reference rate, tau_n (EF-18)",
                min: 0.0,
                joint_start: 2.0e-5,
                arm_start: 0.02,
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "dampingExponent",
                unit: "1",
                description: "Exponent of the rate, p (EF-18); 1 is linear damping",
                min: 0.3,
                above_min: false,
                max: 4.0,
                joint_start: 2.0,
                arm_start: 2.0,
                scale: EffectScale::plain(2.0),
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "dampingReferenceRate",
                unit: "rad/s",
                description: "Rate of the deformation at which the torque is tau_n, r_n (EF-18)",
                joint_start: 100.0,
                arm_start: 0.05,
                role: ParameterRole::Reference,
                scale: EffectScale::of(1.0, &[(Measure::DeflectionRate, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, s: &mut Spring<T>) {
        s.extra += l.p(0) * odd_power(s.rate / l.p(2), l.p(1));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef18_is_the_power_of_the_rate_and_takes_energy_out() {
        for rate in [-6.0f64, 6.0] {
            let mut s = Spring { rate, ..Spring::default() };
            NonlinearDamping::spring(
                &Local::new(&[0.5, 2.0, 3.0], &[], &[], 0, 1),
                &DriveTrain::default(),
                &mut s,
            );
            assert!((s.torque() - 2.0 * rate.signum()).abs() < 1e-4 && s.torque() * rate > 0.0);
        }
    }
}
