//! `current-saturation`: the amplifier delivers less than commanded above a limit.
//!
//! (EF-10) torque T / (1 + (|T| / L)^p)^(1/p): T itself far below the limit L, L far above it; p is how sharp the knee
//! is (from 8 on nearly a corner, 2 to 3 like tanh).
//!
//! What it gets wrong: a limit that sinks with the speed.

use super::*;

pub(crate) struct CurrentSaturation;

impl Effect for CurrentSaturation {
    const SPEC: Spec = Spec {
        id: "current-saturation",
        component: "actuator",
        summary: "the amplifier delivers less than commanded above a limit",
        noun: "saturation of the amplifier",
        check: "Command more and more current and measure the current itself: where does it stop to follow? Check limits in the drive's settings.",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        parameters: &[
            ParameterSpec {
                name: "saturationTorque",
                unit: "N.m",
                description: "Torque of the motor at the amplifier's limit, L (EF-10)",
                min: 0.0,
                above_min: true,
                joint_start: 2.5e-4,
                arm_start: 0.15,
                neutral: f64::INFINITY,
                scale: EffectScale::of(0.7, &[(Measure::Torque, 1)]),
                log: true,
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "saturationSharpness",
                unit: "1",
                description: "Exponent of the knee, p (EF-10)",
                min: 2.0,
                above_min: false,
                max: 60.0,
                joint_start: 8.0,
                arm_start: 8.0,
                scale: EffectScale::plain(8.0),
                ..ParameterSpec::SHAPE
            },
        ],
        on_command: true,
        ..Spec::NONE
    };

    fn actuator<T: Scalar>(l: &Local<T>, _d: &DriveTrain<T>, torque: T) -> T {
        let (limit, p) = (l.p(0), l.p(1));
        let share = torque.abs() / limit;
        let knee = |small: T| (small.powf(p) + 1.0).powf(-T::one() / p);
        // Above the limit by the inverse, so that a large power does not overflow.
        if share.value() <= 1.0 {
            torque * knee(share)
        } else {
            limit * torque.signum0() * knee(T::one() / share)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef10_passes_small_torques_and_limits_large_ones() {
        let at = |torque: f64, p: f64| {
            CurrentSaturation::actuator(
                &Local::new(&[2.0, p], &[], &[], 0, 1),
                &DriveTrain::default(),
                torque,
            )
        };
        assert!((at(0.2, 8.0) - 0.2).abs() < 1e-8 && (at(-1e6, 60.0) + 2.0).abs() < 1e-15);
        // p = 2 is T / sqrt(1 + (T/L)^2).
        for torque in [-5.0f64, 0.5, 1.9, 2.1] {
            assert!((at(torque, 2.0) - torque / (1.0 + torque * torque / 4.0).sqrt()).abs() < 1e-15);
        }
    }
}
