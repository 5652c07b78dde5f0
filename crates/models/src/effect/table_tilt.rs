//! `table-tilt`: a table that is not level.
//!
//! (EF-8) every body of mass m is pulled by m (a_x, a_y), with a = g sin(tilt) in the table's plane.

use super::*;

pub(crate) struct TableTilt;

impl Effect for TableTilt {
    const SPEC: Spec = Spec {
        id: "table-tilt",
        component: "base",
        summary: "a table that is not level: a uniform pull on all bodies",
        noun: "a tilted table",
        check: "Leave the base floating at rest at several places: does it slide the same way? Check with a level.",
        scope: Scope::Once,
        plants: &[PlantKind::Arm],
        not_in_space: "there is no table: give `gravity` of a base that is held",
        parameters: &[
            ParameterSpec {
                name: "tiltAccelerationX",
                unit: "m/s2",
                description: "Gravity in the table's plane along inertial x, a_x (EF-8); 1 mrad of tilt makes 0.0098",
                arm_start: 0.002,
                scale: EffectScale::plain(0.005),
                ..ParameterSpec::NONE
            },
            ParameterSpec {
                name: "tiltAccelerationY",
                unit: "m/s2",
                description: "The same along inertial y, a_y (EF-8)",
                arm_start: 0.0,
                scale: EffectScale::plain(0.005),
                ..ParameterSpec::NONE
            },
        ],
        passive: true,
        field: true,
        affine: true,
        ..Spec::NONE
    };

    fn field<T: Scalar>(l: &Local<T>) -> [T; 2] {
        [l.p(0), l.p(1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ef8_is_uniform() {
        assert_eq!(TableTilt::field(&Local::new(&[0.1, -0.2], &[], &[], 0, 1)), [0.1, -0.2]);
    }
}
