//! `sensor-drift`: an offset that moves.
//!
//! (EF-32) reading y = y_true + r T (1 - exp(-s/T)), s = max(t - t_0, 0): from t_0 on it moves with the rate r and settles
//! with the time T; a long T is a steady drift r s, a short one a jump by r T.
//!
//! What it gets wrong: offsets that wander to and fro.

use super::*;

pub(crate) struct SensorDrift;

impl Effect for SensorDrift {
    const SPEC: Spec = Spec {
        id: "sensor-drift",
        component: "sensor:motorAngle",
        summary: "an offset that moves",
        noun: "a drifting reading",
        check: "Leave the rig at rest for the length of a run: does this reading move?",
        scope: Scope::Channel,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        places: channel::ALL,
        parameters: &[
            ParameterSpec {
                name: "driftRate",
                unit: "*/s",
                description: "Rate of the offset where it begins to move, r (EF-32)",
                joint_start: 0.01,
                arm_start: 0.001,
                scale: EffectScale::of(0.03, &[(Measure::Reading, 1), (Measure::Duration, -1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "driftTime",
                unit: "s",
                description: "Time in which the offset settles, T (EF-32)",
                joint_start: 10.0,
                arm_start: 10.0,
                scale: EffectScale::of(1.0, &[(Measure::Duration, 1)]),
                search: SearchRange::from(&[0.5, 3.0]),
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "driftStart",
                unit: "s",
                description: "When the offset begins to move, t_0 (EF-32)",
                min: 0.0,
                role: ParameterRole::Shape,
                scale: EffectScale::of(0.3, &[(Measure::Duration, 1)]),
                search: SearchRange::from(&[0.0, 1.0]),
                ..ParameterSpec::NONE
            },
        ],
        ..Spec::NONE
    };

    fn sensor<T: Scalar>(l: &Local<T>, t: T, reading: T) -> T {
        reading + l.p(0) * settling((t - l.p(2)).max(T::zero()), l.p(1))
    }
}

/// T (1 - exp(-t/T)): grows like t and settles at T, s.
pub(super) fn settling<T: Scalar>(t: T, time: T) -> T {
    let x = t / time;
    // Digits would be lost in 1 - exp of nearly nothing.
    if x.value() < 1e-4 { t * (-x * 0.5 + 1.0 + x * x / 6.0) } else { time * (-(-x).exp() + 1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef32_begins_with_its_rate_and_settles() {
        let drifted =
            |t: f64, p: [f64; 3]| SensorDrift::sensor(&Local::new(&p, &[], &[], 0, 1), t, 1.0) - 1.0;
        let at = |t: f64, time: f64| drifted(t, [0.3, time, 0.0]);
        assert!((at(1e-3, 2.0) / 3e-4 - 1.0).abs() < 1e-3 && (at(100.0, 2.0) - 0.6).abs() < 1e-14);
        assert!((at(5.0, 1e6) - 1.5).abs() < 1e-5);
        // Later by what it begins later; a short time makes a jump of it.
        assert_eq!([drifted(1.9, [0.3, 2.0, 2.0]), drifted(3.0, [0.3, 2.0, 2.0])], [0.0, at(1.0, 2.0)]);
        assert!((drifted(2.01, [300.0, 1e-3, 2.0]) - 0.3).abs() < 1e-4);
        // Where the series takes over nothing jumps.
        assert!((settling(0.9999e-4, 1.0) / settling(1.0001e-4, 1.0) - 0.9998).abs() < 1e-7);
    }
}
