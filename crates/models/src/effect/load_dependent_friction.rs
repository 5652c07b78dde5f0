//! `load-dependent-friction`: friction that grows with the torque carried.
//!
//! (EF-14) adds mu |tau| to the dry friction, sliding and sticking, tau being the torque of the transmission; of a rigid
//! joint that of the motor.
//!
//! What it gets wrong: on a rigid joint the torque that accelerates the motor itself counts as carried.

use super::*;

pub(crate) struct LoadDependentFriction;

impl Effect for LoadDependentFriction {
    const SPEC: Spec = Spec {
        id: "load-dependent-friction",
        component: "motor-friction",
        summary: "friction that grows with the torque carried",
        noun: "friction that grows with the load",
        check: "Run at one slow speed with and without an extra load: does the friction current grow?",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm, PlantKind::Space],
        friction: true,
        under_load: true,
        passive: true,
        parameters: &[ParameterSpec {
            name: "loadFrictionCoefficient",
            unit: "1",
            description: "Friction torque per torque carried, mu (EF-14)",
            min: 0.0,
            max: 1.0,
            joint_start: 0.2,
            arm_start: 0.1,
            scale: EffectScale::plain(0.1),
            ..ParameterSpec::NONE
        }],
        ..Spec::NONE
    };

    fn friction<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>, _direction: f64, levels: &mut Levels<T>) {
        let more = l.p(0) * d.carried.abs();
        levels.breakaway += more;
        levels.coulomb += more;
        levels.sliding += more;
    }
    fn dry(l: &Local<f64>) -> bool {
        l.p(0) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::paper;

    #[test]
    fn ef14_grows_with_the_load_in_both_directions() {
        for carried in [-3.0, 3.0] {
            let mut levels = paper(1.0, 2.0, 0.0, 0.0);
            let d = DriveTrain { carried, ..DriveTrain::default() };
            LoadDependentFriction::friction(&Local::new(&[0.1], &[], &[], 0, 1), &d, 1.0, &mut levels);
            assert!((levels.breakaway - 2.3).abs() < 1e-15 && (levels.braking() - 1.3).abs() < 1e-15);
        }
    }
}
