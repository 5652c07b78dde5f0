//! `gravity-torque`: an unbalanced load, or a joint axis that is not vertical.
//!
//! (EF-7) tau = -tau_g sin(q_l - q_g) on the load: it hangs at rest at q_g. On the arm, whose base has to be fixed, q_l is
//! the attitude phi_j of link j against the inertial frame: what turns the link carries it, the joints 1 .. j.
//!
//! What it gets wrong: tau_g of a link and of those beyond it are figures of their own, not those of one mass in one field.

use super::*;

pub(crate) struct GravityTorque;

impl Effect for GravityTorque {
    const SPEC: Spec = Spec {
        id: "gravity-torque",
        component: "load",
        summary: "an unbalanced load, or a joint axis that is not vertical",
        noun: "a gravity torque on the load",
        check: "Hold the load still at several angles: does the holding current change with the angle? Check the balance and that the axis is upright.",
        scope: Scope::Joint,
        plants: &[PlantKind::Joint, PlantKind::Arm],
        not_in_space: "no joint has an attitude in a plane to hang at: give `gravity` of a base that is held",
        parameters: &[
            ParameterSpec {
                name: "gravityTorque",
                unit: "N.m",
                description: "Largest gravity torque on the load, tau_g (EF-7)",
                min: 0.0,
                joint_start: 5.0,
                arm_start: 0.5,
                scale: EffectScale::of(0.2, &[(Measure::LoadTorque, 1)]),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "gravityAngle",
                unit: "rad",
                description: "Load angle (of an arm: attitude of the link) at which it hangs at rest, q_g (EF-7)",
                joint_start: -core::f64::consts::FRAC_PI_2,
                arm_start: -core::f64::consts::FRAC_PI_2,
                role: ParameterRole::Shape,
                ..ParameterSpec::NONE
            },
        ],
        passive: true,
        fixed_base: true,
        ..Spec::NONE
    };

    fn link_torque<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> T {
        -l.p(0) * (d.link_angle - l.p(1)).sin()
    }
    fn energy<T: Scalar>(l: &Local<T>, d: &DriveTrain<T>) -> [T; 2] {
        [T::zero(), -l.p(0) * (d.link_angle - l.p(1)).cos()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::Dual;

    #[test]
    fn ef7_is_the_gradient_of_its_energy_and_pulls_towards_rest() {
        let p = [Dual::<1>::constant(3.0), Dual::constant(0.2)];
        let d = DriveTrain { link_angle: Dual::variable(0.9, 0), ..DriveTrain::default() };
        let l = Local::new(&p, &[], &[], 0, 1);
        let torque = GravityTorque::link_torque(&l, &d).re;
        assert!((GravityTorque::energy(&l, &d)[1].eps[0] + torque).abs() < 1e-15);
        assert!(torque < 0.0);
    }
}
