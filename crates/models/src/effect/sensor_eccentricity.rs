//! `sensor-eccentricity`: an encoder's disc that does not run true.
//!
//! (EF-31) reading y = q + a_s sin(k q) + a_c cos(k q), q being the angle that it measures.
//!
//! What it gets wrong: one order only; the reading follows the true angle where it should follow the disc's.

use super::*;

pub(crate) struct SensorEccentricity;

impl Effect for SensorEccentricity {
    const SPEC: Spec = Spec {
        id: "sensor-eccentricity",
        component: "sensor:motorAngle",
        summary: "a reading error that repeats with the angle",
        noun: "an eccentric encoder",
        check: "Turn slowly through whole turns and compare with a second sensor: does the difference repeat once a turn? Check how the disc is mounted.",
        scope: Scope::Channel,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        places: channel::ENCODERS,
        parameters: &[
            ParameterSpec {
                name: "eccentricitySine",
                unit: "*",
                description: "Reading error that goes with the sine of the angle, a_s (EF-31)",
                joint_start: 0.01,
                arm_start: 0.001,
                scale: EffectScale::of(0.01, &[(Measure::Reading, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "eccentricityCosine",
                unit: "*",
                description: "Reading error that goes with the cosine of the angle, a_c (EF-31)",
                scale: EffectScale::of(0.01, &[(Measure::Reading, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "eccentricityOrder",
                unit: "1",
                description: "Periods per turn, k (EF-31)",
                // A disc that does not run true has a period of one turn.
                min: 1.0,
                above_min: false,
                joint_start: 1.0,
                arm_start: 1.0,
                order: true,
                ..ParameterSpec::SHAPE
            },
        ],
        ..Spec::NONE
    };

    fn sensor<T: Scalar>(l: &Local<T>, _t: T, reading: T) -> T {
        let (sine, cosine) = (reading * l.p(2)).sin_cos();
        reading + l.p(0) * sine + l.p(1) * cosine
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef31_is_in_phase_with_the_turns() {
        let l = Local::new(&[0.02, 0.01, 2.0], &[], &[], 0, 1);
        let error = |q: f64| SensorEccentricity::sensor(&l, 0.0, q) - q;
        let quarter = core::f64::consts::FRAC_PI_4;
        assert!((error(0.0) - 0.01).abs() < 1e-15 && (error(quarter) - 0.02).abs() < 1e-15);
        assert!((error(5.0 * quarter) - 0.02).abs() < 1e-14 && (error(2.0 * quarter) + 0.01).abs() < 1e-15);
    }
}
