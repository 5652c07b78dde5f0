//! `torque-ripple`: torque that repeats with the motor's position (cogging, commutation).
//!
//! (EF-12) adds T_s sin(k phi) + T_c cos(k phi) + T_s2 sin(2 k phi) + T_c2 cos(2 k phi) to the motor's torque, phi being
//! the angle of the motor's shaft (on the arm: gearRatio times the motor's angle).
//!
//! What it gets wrong: it does not grow with the current, as the ripple of a commutation does; one order and its double
//! only.

use super::*;

pub(crate) struct TorqueRipple;

impl Effect for TorqueRipple {
    const SPEC: Spec = Spec {
        id: "torque-ripple",
        component: "actuator",
        summary: "torque that repeats with motor position (cogging, commutation)",
        noun: "a torque ripple of the motor",
        check: "Run slowly at constant speed and plot current over motor angle: does it repeat with the poles or slots?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "rippleSine",
                unit: "N.m",
                description: "Torque that goes with the sine of the shaft's angle, T_s (EF-12)",
                joint_start: 2.0e-5,
                // A tenth of the smallest torque of the default experiment. Five times as much holds joints near its
                // crests, where they balance: a disturbance of the start grows 1e7 times.
                arm_start: 0.002,
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "rippleCosine",
                unit: "N.m",
                description: "Torque that goes with the cosine of the shaft's angle, T_c (EF-12)",
                scale: EffectScale::of(0.1, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "rippleOrder",
                unit: "1",
                description: "Periods per turn of the shaft, k (EF-12)",
                joint_start: 4.0,
                arm_start: 4.0,
                scale: EffectScale::plain(4.0),
                order: true,
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "rippleSine2",
                unit: "N.m",
                description: "Torque that goes with the sine of the double order, T_s2 (EF-12)",
                scale: EffectScale::of(0.04, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "rippleCosine2",
                unit: "N.m",
                description: "Torque that goes with the cosine of the double order, T_c2 (EF-12)",
                scale: EffectScale::of(0.04, &[(Measure::Torque, 1)]),
                ..ParameterSpec::NONE
            },
        ],
        ..Spec::NONE
    };

    fn actuator<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, torque: T) -> T {
        let (sine, cosine) = (d.theta * d.shaft * l.p(2)).sin_cos();
        let (sine2, cosine2) = (sine * cosine * 2.0, cosine * cosine * 2.0 - 1.0);
        torque + (l.p(0) * sine + l.p(1) * cosine + l.p(3) * sine2 + l.p(4) * cosine2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef12_does_no_work_over_a_turn() {
        let l = Local::new(&[0.3, -0.2, 3.0, 0.1, 0.05], &[], &[], 0, 1);
        let at = |theta: f64| {
            TorqueRipple::actuator(&l, &DriveTrain { theta, shaft: 10.0, ..DriveTrain::default() }, 1.0) - 1.0
        };
        // Over one period: the mean is 0, the mean square half the sum of the squares of both amplitudes.
        let period = 2.0 * core::f64::consts::PI / 30.0;
        let n = 12;
        let mean = |f: &dyn Fn(f64) -> f64| {
            (0..n).map(|i| f(period * f64::from(i) / f64::from(n))).sum::<f64>() / f64::from(n)
        };
        assert!(mean(&at).abs() < 1e-15);
        assert!((mean(&|x| at(x).powi(2)) - 0.5 * (0.09 + 0.04 + 0.01 + 0.0025)).abs() < 1e-15);
        assert!((at(0.0) + 0.15).abs() < 1e-15 && (at(0.25 * period) - 0.25).abs() < 1e-15);
    }
}
