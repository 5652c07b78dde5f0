//! `nonlinear-stiffness`: a spring that hardens or softens.
//!
//! (EF-4) adds K_3 delta^3 to the spring torque, delta being the deflection of the spring (without play).
//!
//! What it gets wrong: a softening spring (K_3 < 0) turns over at delta^2 = K / (3 |K_3|); the cubic is meant
//! below that.

use super::*;

pub(crate) struct NonlinearStiffness;

impl Effect for NonlinearStiffness {
    const SPEC: Spec = Spec {
        id: "nonlinear-stiffness",
        component: "transmission",
        summary: "a spring that hardens (positive) or softens (negative) with the cube of its deflection",
        scope: Scope::Joint,
        plants: &[Plant::Joint, Plant::Arm],
        parameters: &[ParameterSpec {
            name: "cubicStiffness",
            unit: "N.m/rad3",
            description: "Torque per cube of the deflection, K_3 (EF-4)",
            joint_start: 1.0e-6,
            arm_start: 500.0,
            scale: Scale::of(0.3, &[(Measure::Torque, 1), (Measure::Deflection, -3)]),
            ..ParameterSpec::NONE
        }],
        compliant: true,
        passive: true,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &Drive<T>, s: &mut Spring<T>) {
        let square = s.deflection * s.deflection;
        s.extra += l.p(0) * square * s.deflection;
        s.extra_energy += l.p(0) * square * square * 0.25;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::Dual;

    #[test]
    fn ef4_torque_is_the_gradient_of_its_energy() {
        let epsilon = Dual::<1>::variable(0.3, 0);
        let d = Drive { epsilon, ..Drive::default() };
        let mut s = Spring::linear(Dual::constant(2.0), Dual::constant(0.0), &d);
        NonlinearStiffness::spring(&Local::new(&[Dual::constant(5.0)], &[], &[], 0, 1), &d, &mut s);
        assert!((s.energy().eps[0] - s.torque().re).abs() < 1e-15);
        assert!((s.torque().re - (2.0 * 0.3 + 5.0 * 0.027)).abs() < 1e-15);
    }
}
