//! `cable-stiffness`: a cable, harness or umbilical that pulls back.
//!
//! (EF-22) on the load torque -k (q_l - q_c); on the base force -k (r_0 - r_c) at its centre of mass and torque
//! -k_r (q_0 - q_c), with the rest position r_c and the rest angle q_c.
//!
//! What it gets wrong: no friction within the cable, no slack.

use super::*;

pub(crate) struct CableStiffness;

const BASE: usize = 1;

const fn rest(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    measure: &'static [(Measure, i32)],
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        description,
        role: ParameterRole::Shape,
        scale: EffectScale::of(0.5, measure),
        ..ParameterSpec::NONE
    }
}

impl Effect for CableStiffness {
    const SPEC: Spec = Spec {
        id: "cable-stiffness",
        component: "load",
        summary: "a cable, harness or umbilical that pulls back",
        noun: "a cable that pulls back",
        check: "Move slowly to several angles and let go: does it creep back? Loosen or re-route cables and hoses and record again.",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm],
        not_in_space: "a free base has no ground that a cable could be tied to: use base-drag, external-force:base or baseForce and baseTorque",
        passive: true,
        places: &[
            EffectPlace {
                name: "load",
                prefix: "",
                component: "load",
                plants: &[PlantKind::Joint],
                scope: Scope::Joint,
                unit: "",
                parameters: &[
                    ParameterSpec {
                        name: "cableStiffness",
                        unit: "N.m/rad",
                        description: "Torque on the load per angle, k (EF-22)",
                        min: 0.0,
                        joint_start: 30.0,
                        scale: EffectScale::of(0.15, &[(Measure::LoadTorque, 1), (Measure::LoadAngle, -1)]),
                        ..ParameterSpec::NONE
                    },
                    rest(
                        "cableAngle",
                        "rad",
                        "Load angle at which the cable does not pull, q_c (EF-22)",
                        &[(Measure::LoadAngle, 1)],
                    ),
                ],
            },
            EffectPlace {
                name: "base",
                prefix: "",
                component: "base",
                plants: &[PlantKind::Arm],
                scope: Scope::Once,
                unit: "",
                parameters: &[
                    ParameterSpec {
                        name: "cableStiffness",
                        unit: "N/m",
                        description: "Force on the base per displacement, k (EF-22)",
                        min: 0.0,
                        arm_start: 2.0,
                        scale: EffectScale::of(0.3, &[(Measure::Force, 1), (Measure::Position, -1)]),
                        ..ParameterSpec::NONE
                    },
                    ParameterSpec {
                        name: "cableRotationalStiffness",
                        unit: "N.m/rad",
                        description: "Torque on the base per angle, k_r (EF-22)",
                        min: 0.0,
                        arm_start: 0.5,
                        scale: EffectScale::of(0.3, &[(Measure::BaseTorque, 1), (Measure::BaseAngle, -1)]),
                        ..ParameterSpec::NONE
                    },
                    rest(
                        "cablePositionX",
                        "m",
                        "Inertial x of the base at which the cable does not pull (EF-22)",
                        &[(Measure::Position, 1)],
                    ),
                    rest(
                        "cablePositionY",
                        "m",
                        "The same along inertial y (EF-22)",
                        &[(Measure::Position, 1)],
                    ),
                    rest(
                        "cableAttitude",
                        "rad",
                        "Attitude of the base at which the cable does not turn it, q_c (EF-22)",
                        &[(Measure::BaseAngle, 1)],
                    ),
                ],
            },
        ],
        ..Spec::NONE
    };

    fn link_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
        if l.place() == BASE { T::zero() } else { -l.p(0) * (d.link_angle - l.p(1)) }
    }
    fn base<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        if l.place() != BASE {
            return BaseWrench::default();
        }
        let pull = |i: usize| -l.p(0) * (b.position[i] - l.p(2 + i));
        BaseWrench { force: [pull(0), pull(1)], torque: -l.p(1) * (b.attitude - l.p(4)) }
    }
    fn energy<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> [T; 2] {
        let half = |k: T, x: T| k * x * x * 0.5;
        let stored = if l.place() == BASE {
            half(l.p(0), d.base.position[0] - l.p(2))
                + half(l.p(0), d.base.position[1] - l.p(3))
                + half(l.p(1), d.base.attitude - l.p(4))
        } else {
            half(l.p(0), d.link_angle - l.p(1))
        };
        [T::zero(), stored]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::Dual;

    #[test]
    fn ef22_is_the_gradient_of_its_energy_in_both_places() {
        let p = [3.0, 0.2].map(Dual::<3>::constant);
        let d = DriveTrain { link_angle: Dual::variable(0.9, 0), ..DriveTrain::default() };
        let l = Local::new(&p, &[], &[], 0, 1);
        let torque = CableStiffness::link_torque(&l, &d).re;
        assert!(
            (torque + 2.1).abs() < 1e-15 && (CableStiffness::energy(&l, &d)[1].eps[0] + torque).abs() < 1e-15
        );

        let p = [3.0, 0.7, 0.1, -0.2, 0.3].map(Dual::<3>::constant);
        let base = BaseMotion {
            position: [Dual::variable(0.5, 0), Dual::variable(0.4, 1)],
            attitude: Dual::variable(-0.6, 2),
            ..BaseMotion::default()
        };
        let l = Local::new(&p, &[], &[], 0, 1).in_place(BASE);
        let (w, energy) = (
            CableStiffness::base(&l, &base),
            CableStiffness::energy(&l, &DriveTrain { base, ..DriveTrain::default() }),
        );
        let wrench = [w.force[0].re, w.force[1].re, w.torque.re];
        assert!((0..3).all(|i| (energy[1].eps[i] + wrench[i]).abs() < 1e-15));
        assert!((wrench[0] + 1.2).abs() < 1e-15 && (wrench[2] - 0.63).abs() < 1e-15);
    }
}
