//! `base-thrust`: a steady force or torque on the base (leak, air jet, umbilical).
//!
//! (EF-23) force R(q_0) (F_x, F_y) at the base's centre of mass and torque T: steady in the satellite's axes; in space
//! R (F_x, F_y, F_z) and R (T_x, T_y, T_z).
//!
//! What it gets wrong: a jet that weakens as the tank empties.

use super::*;
use crate::space::vector::times;

pub(crate) struct BaseThrust;

const fn part(
    name: &'static str,
    unit: &'static str,
    description: &'static str,
    start: f64,
    measure: &'static [(Measure, i32)],
) -> ParameterSpec {
    ParameterSpec {
        name,
        unit,
        description,
        arm_start: start,
        scale: EffectScale::of(0.2, measure),
        ..ParameterSpec::NONE
    }
}

const fn force(name: &'static str, description: &'static str, start: f64) -> ParameterSpec {
    part(name, "N", description, start, &[(Measure::Force, 1)])
}
const fn torque(name: &'static str, description: &'static str, start: f64) -> ParameterSpec {
    part(name, "N.m", description, start, &[(Measure::BaseTorque, 1)])
}

impl Effect for BaseThrust {
    const SPEC: Spec = Spec {
        id: "base-thrust",
        component: "base",
        summary: "a steady force or torque on the base (leak, air jet, umbilical)",
        noun: "a steady force or torque on the base",
        check: "Leave the base floating at rest: does it start to move by itself? Look for leaks, air jets and a pulling umbilical.",
        scope: Scope::Once,
        plants: &[PlantKind::Arm, PlantKind::Space],
        parameters: &[
            force("thrustForceX", "Force along the satellite's x axis, F_x (EF-23)", 0.05),
            force("thrustForceY", "Force along the satellite's y axis, F_y (EF-23)", 0.0),
            torque("thrustTorque", "Torque on the satellite, T (EF-23)", 0.01),
        ],
        space_parameters: &[
            force("thrustForceX", "Force along the base's x axis, F_x (EF-23)", 0.05),
            force("thrustForceY", "Force along the base's y axis, F_y (EF-23)", 0.0),
            force("thrustForceZ", "Force along the base's z axis, F_z (EF-23)", 0.0),
            torque("thrustTorqueX", "Torque about the base's x axis, T_x (EF-23)", 0.0),
            torque("thrustTorqueY", "Torque about the base's y axis, T_y (EF-23)", 0.0),
            torque("thrustTorqueZ", "Torque about the base's z axis, T_z (EF-23)", 0.01),
        ],
        ..Spec::NONE
    };

    fn space_base<T: Scalar>(l: &Local<T>, b: &FlyerBase<T>) -> SpatialWrench<T> {
        let out = |begin: usize| times(&b.rotation, [l.p(begin), l.p(begin + 1), l.p(begin + 2)]);
        SpatialWrench { force: out(0), torque: out(3) } // (EF-23)
    }
    fn base<T: Scalar>(l: &Local<T>, b: &BaseMotion<T>) -> BaseWrench<T> {
        let (sine, cosine) = b.attitude.sin_cos();
        BaseWrench {
            force: [cosine * l.p(0) - sine * l.p(1), sine * l.p(0) + cosine * l.p(1)],
            torque: l.p(2),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef23_turns_with_the_satellite() {
        let b = BaseMotion { attitude: core::f64::consts::FRAC_PI_2, ..BaseMotion::default() };
        let w = BaseThrust::base(&Local::new(&[0.3, 0.1, -0.2], &[], &[], 0, 1), &b);
        assert!((w.force[0] + 0.1).abs() < 1e-15 && (w.force[1] - 0.3).abs() < 1e-15 && w.torque == -0.2);
    }
}
