//! `nonlinear-stiffness`: a spring that hardens or softens.
//!
//! (EF-4) adds K_3 delta^3 + K_k sign(delta) max(|delta| - delta_k, 0) to the spring torque, delta being the deflection of
//! the spring (without play): hardening with the cube, and from a knee on.
//!
//! What it gets wrong: a softening spring (K_3 < 0) turns over at delta^2 = K / (3 |K_3|); the cubic is meant
//! below that, and an estimator keeps to what pulls back up to four typical deflections: a free run goes further than what
//! started the fit, and would never return. The knee is sharp.

use super::*;

pub(crate) struct NonlinearStiffness;

/// Typical deflections up to which the spring pulls back, whatever is estimated.
const FURTHEST: f64 = 4.0;
/// Half of what softens may be the cube's: a typical torque over a typical deflection is K, and K = 3 |K_3| delta^2 where it
/// turns over.
const CUBE: EffectScale =
    EffectScale::of(0.5 / (3.0 * FURTHEST * FURTHEST), &[(Measure::Torque, 1), (Measure::Deflection, -3)]);
/// The other half the knee's.
const KNEE: EffectScale = EffectScale::of(0.5, &[(Measure::Torque, 1), (Measure::Deflection, -1)]);

impl Effect for NonlinearStiffness {
    const SPEC: Spec = Spec {
        id: "nonlinear-stiffness",
        component: "transmission",
        summary: "a spring that hardens (positive) or softens (negative) with the cube of its deflection, or from a knee on",
        noun: "a spring that hardens or softens",
        check: "Block the load and raise the motor torque in steps both ways: does the twist stay proportional?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "cubicStiffness",
                unit: "N.m/rad3",
                description: "Torque per cube of the deflection, K_3 (EF-4)",
                joint_start: 1.0e-6,
                arm_start: 500.0,
                scale: EffectScale::of(0.3, &[(Measure::Torque, 1), (Measure::Deflection, -3)]),
                below: Some(CUBE),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kneeStiffness",
                unit: "N.m/rad",
                description: "What the stiffness is more beyond the knee, K_k (EF-4); 0: there is no knee",
                scale: EffectScale::of(0.5, &[(Measure::Torque, 1), (Measure::Deflection, -1)]),
                below: Some(KNEE),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kneeDeflection",
                unit: "rad",
                description: "Deflection at the knee, delta_k (EF-4)",
                joint_start: 10.0,
                arm_start: 0.02,
                scale: EffectScale::of(0.5, &[(Measure::Deflection, 1)]),
                search: SearchRange::from(&[0.25, 0.7, 1.5, 3.0]),
                ..ParameterSpec::SHAPE
            },
        ],
        compliant: true,
        passive: true,
        ..Spec::NONE
    };

    fn spring<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, s: &mut Spring<T>) {
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
            let d = DriveTrain { epsilon, ..DriveTrain::default() };
            let mut s = Spring::linear(Dual::constant(2.0), Dual::constant(0.0), &d);
            let p = [5.0, 7.0, 0.4].map(Dual::constant);
            NonlinearStiffness::spring(&Local::new(&p, &[], &[], 0, 1), &d, &mut s);
            assert!((s.energy().eps[0] - s.torque().re).abs() < 1e-15);
            assert!((s.torque().re - (2.0 * deflection + extra)).abs() < 1e-15);
        }
    }

    #[test]
    fn a_spring_that_softens_pulls_back_as_far_as_it_may_go() {
        let (stiffness, deflection) = (0.4, 0.05);
        let size = |m| match m {
            Measure::Torque => stiffness * deflection,
            Measure::Deflection => deflection,
            _ => f64::NAN,
        };
        let [cube, knee] =
            [0, 1].map(|k| -NonlinearStiffness::SPEC.parameters[k].below.map_or(0.0, |b| b.value(size)));
        assert!(cube < 0.0 && knee < 0.0, "softening is allowed");
        for share in [0.1, 0.5, 0.999] {
            let at = Dual::<1>::variable(share * 4.0 * deflection, 0);
            let d = DriveTrain { epsilon: at, ..DriveTrain::default() };
            let mut s = Spring::linear(Dual::constant(stiffness), Dual::constant(0.0), &d);
            let p = [cube, knee, 0.0].map(Dual::constant);
            NonlinearStiffness::spring(&Local::new(&p, &[], &[], 0, 1), &d, &mut s);
            assert!(s.torque().eps[0] > 0.0, "at {}: {}", at.re, s.torque().eps[0]);
        }
    }
}
