//! `kinematic-error`: a gear error that repeats with the angle of the wave generator.
//!
//! (EF-19) the deflection is epsilon - e(phi) with e = e_s sin(k phi) + e_c cos(k phi) + e_s2 sin(2 k phi) +
//! e_c2 cos(2 k phi), phi being the angle of the motor's shaft; (1 - de/dtheta) times the spring's torque acts on the motor,
//! as the work demands.
//!
//! What it gets wrong: one order and its double only; on a rigid joint it does nothing.

use super::*;

pub(crate) struct KinematicError;

impl Effect for KinematicError {
    const SPEC: Spec = Spec {
        id: "kinematic-error",
        component: "transmission",
        summary: "a gear error that repeats with the angle of the wave generator",
        noun: "a kinematic error of the gear",
        check: "Turn slowly through whole turns of the motor and plot load angle minus motor angle over the ratio: does it repeat once or twice a turn?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        compliant: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "kinematicErrorSine",
                unit: "rad",
                description: "Gear error that goes with the sine, on the drive's side, e_s (EF-19)",
                joint_start: 0.5,
                arm_start: 0.001,
                scale: EffectScale::of(0.05, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kinematicErrorCosine",
                unit: "rad",
                description: "Gear error that goes with the cosine, on the drive's side, e_c (EF-19)",
                scale: EffectScale::of(0.05, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kinematicErrorOrder",
                unit: "1",
                description: "Periods per turn of the motor's shaft, k (EF-19)",
                joint_start: 0.005,
                arm_start: 2.0,
                scale: EffectScale::plain(2.0),
                order: true,
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "kinematicErrorSine2",
                unit: "rad",
                description: "Gear error that goes with the sine of the double order, e_s2 (EF-19)",
                scale: EffectScale::of(0.02, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "kinematicErrorCosine2",
                unit: "rad",
                description: "Gear error that goes with the cosine of the double order, e_c2 (EF-19)",
                scale: EffectScale::of(0.02, &[(Measure::Deflection, 1)]),
                ..ParameterSpec::NONE
            },
        ],
        ..Spec::NONE
    };

    fn gear<T: Scalar>(l: &Local<T>, d: &mut DriveTrain<T>) {
        let k = d.shaft * l.p(2);
        let (sine, cosine) = (d.theta * k).sin_cos();
        let (sine2, cosine2) = (sine * cosine * 2.0, cosine * cosine * 2.0 - 1.0);
        let slope = k * (l.p(0) * cosine - l.p(1) * sine + (l.p(3) * cosine2 - l.p(4) * sine2) * 2.0);
        d.epsilon -= l.p(0) * sine + l.p(1) * cosine + l.p(3) * sine2 + l.p(4) * cosine2;
        d.epsilon_dot -= slope * d.omega;
        d.slope += slope;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::Dual;

    #[test]
    fn ef19_rate_and_slope_are_the_derivatives_of_the_error() {
        let p = [0.03, 0.02, 2.0, 0.01, -0.005].map(Dual::<1>::constant);
        let theta = Dual::variable(0.7, 0);
        let mut d = DriveTrain {
            theta,
            epsilon: theta,
            omega: Dual::constant(3.0),
            epsilon_dot: Dual::constant(3.0),
            shaft: Dual::constant(10.0),
            ..DriveTrain::default()
        };
        KinematicError::gear(&Local::new(&p, &[], &[], 0, 1), &mut d);
        let error =
            0.03 * f64::sin(14.0) + 0.02 * f64::cos(14.0) + 0.01 * f64::sin(28.0) - 0.005 * f64::cos(28.0);
        assert!((d.epsilon.re - (0.7 - error)).abs() < 1e-14);
        assert!((1.0 - d.slope.re - d.epsilon.eps[0]).abs() < 1e-14);
        assert!((d.epsilon_dot.re - 3.0 * d.epsilon.eps[0]).abs() < 1e-14);
    }
}
