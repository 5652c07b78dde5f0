//! `nonlinear-stiffness`: a spring that hardens or softens.
//!
//! (EF-4) adds K_3 delta^3 + K_k sign(delta) max(|delta| - delta_k, 0) to the spring torque, delta being the deflection of
//! the spring (without play): hardening with the cube, and from a knee on.
//!
//! What it gets wrong: a softening spring (K_3 < 0) turns over at delta^2 = K / (3 |K_3|); the cubic is meant
//! below that. The knee is sharp.

use super::*;

pub(crate) struct NonlinearStiffness;

impl Effect for NonlinearStiffness {
    const SPEC: Spec = Spec {
        id: "nonlinear-stiffness",
        component: "transmission",
        summary: "a spring that hardens (positive) or softens (negative) with the cube of its deflection, or from a knee on",
        scope: Scope::Joint,
        plants: &[Plant::Joint, Plant::Arm],
        parameters: &[
            ParameterSpec {
                name: "cubicStiffness",
                unit: "N.m/rad3",
                description: "Torque per cube of the deflection, K_3 (EF-4)",
                joint_start: 1.0e-6,
                arm_start: 500.0,
                scale: Scale::of(0.3, &[(Measure::Torque, 1), (Measure::Deflection, -3)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kneeStiffness",
                unit: "N.m/rad",
                description: "What the stiffness is more beyond the knee, K_k (EF-4); 0: there is no knee",
                scale: Scale::of(0.5, &[(Measure::Torque, 1), (Measure::Deflection, -1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kneeDeflection",
                unit: "rad",
                description: "Deflection at the knee, delta_k (EF-4)",
                joint_start: 10.0,
                arm_start: 0.02,
                scale: Scale::of(0.5, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::SHAPE
            },
        ],
        compliant: true,
        passive: true,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &Drive<T>, s: &mut Spring<T>) {
        let square = s.deflection * s.deflection;
        let beyond = (s.deflection.abs() - l.p(2)).max(T::zero());
        s.extra += l.p(0) * square * s.deflection + l.p(1) * beyond * s.deflection.signum0();
        s.extra_energy += l.p(0) * square * square * 0.25 + l.p(1) * beyond * beyond * 0.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::Dual;

    #[test]
    fn ef4_torque_is_the_gradient_of_its_energy() {
        for (deflection, extra) in [(0.3, 5.0 * 0.027), (-0.5, -5.0 * 0.125 - 7.0 * 0.1)] {
            let epsilon = Dual::<1>::variable(deflection, 0);
            let d = Drive { epsilon, ..Drive::default() };
            let mut s = Spring::linear(Dual::constant(2.0), Dual::constant(0.0), &d);
            let p = [5.0, 7.0, 0.4].map(Dual::constant);
            NonlinearStiffness::spring(&Local::new(&p, &[], &[], 0, 1), &d, &mut s);
            assert!((s.energy().eps[0] - s.torque().re).abs() < 1e-15);
            assert!((s.torque().re - (2.0 * deflection + extra)).abs() < 1e-15);
        }
    }
}
