//! `friction-drift`: friction that changes over the run (warming up).
//!
//! (EF-16) all motor friction times 1 + r T (1 - exp(-(t + t_0)/T)), never below 0: it begins to change with the relative
//! rate r and settles with the time T; a run finds it changing for the time t_0 already.
//!
//! What it gets wrong: it goes by the time, not by the temperature that the work of friction makes.

use super::sensor_drift::settling;
use super::*;

pub(crate) struct FrictionDrift;

impl Effect for FrictionDrift {
    const SPEC: Spec = Spec {
        id: "friction-drift",
        component: "motor-friction",
        summary: "friction that changes over the run (warming up)",
        noun: "friction that changes over the run",
        check: "Repeat one run cold and after an hour of work: does the current at the same speed change?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        passive: true,
        parameters: &[
            ParameterSpec {
                name: "frictionDriftRate",
                unit: "1/s",
                description: "Relative rate of all friction at the start, r (EF-16)",
                joint_start: -0.2,
                arm_start: -0.05,
                scale: EffectScale::of(0.3, &[(Measure::Duration, -1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "frictionDriftTime",
                unit: "s",
                description: "Time in which friction settles, T (EF-16)",
                joint_start: 2.0,
                arm_start: 10.0,
                scale: EffectScale::of(1.0, &[(Measure::Duration, 1)]),
                search: SearchRange::from(&[0.5, 3.0]),
                ..ParameterSpec::SHAPE
            },
            ParameterSpec {
                name: "initialFrictionDriftTime",
                unit: "s",
                description: "How long friction has been changing when a run begins, t_0 (EF-16)",
                min: 0.0,
                role: ParameterRole::Initial,
                scale: EffectScale::of(1.0, &[(Measure::Duration, 1)]),
                ..ParameterSpec::NONE
            },
        ],
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _direction: f64, levels: &mut Levels<T>) {
        let factor = (l.p(0) * settling(l.p(2) + d.t, l.p(1)) + 1.0).max(T::zero());
        levels.breakaway *= factor;
        levels.coulomb *= factor;
        levels.sliding *= factor;
        levels.viscous *= factor;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef16_scales_all_friction_alike() {
        let at = |t: f64, rate: f64| {
            let mut levels = paper(1.0, 3.0, 0.5, 2.0);
            let d = DriveTrain { t, ..DriveTrain::default() };
            FrictionDrift::friction(&Local::new(&[rate, 4.0, 0.0], &[], &[], 0, 1), &d, 1.0, &mut levels);
            [levels.breakaway, levels.braking()]
        };
        assert_eq!(at(0.0, -0.1), [3.0, 2.0]);
        let factor = 1.0 - 0.4 * (1.0 - (-0.5f64).exp());
        assert!(
            (at(2.0, -0.1)[0] - 3.0 * factor).abs() < 1e-14
                && (at(2.0, -0.1)[1] - 2.0 * factor).abs() < 1e-14
        );
        assert_eq!(at(1e3, -0.5), [0.0, 0.0]);
        let later = |t: f64, before: f64| {
            let mut levels = paper(1.0, 3.0, 0.5, 2.0);
            let d = DriveTrain { t, ..DriveTrain::default() };
            FrictionDrift::friction(&Local::new(&[-0.1, 4.0, before], &[], &[], 0, 1), &d, 1.0, &mut levels);
            [levels.breakaway, levels.braking()]
        };
        assert_eq!(later(0.5, 1.5), at(2.0, -0.1), "a run goes on where another ended");
    }
}
