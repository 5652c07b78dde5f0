//! TwoMassJoint, PlanarManipulator and SpatialFreeFlyer as FMUs: binding only.

mod arm;
mod builder;
mod experiment;
mod joint;
mod model;
mod space;

pub use experiment::schedule;
pub use model::{Plant, TEST_BED};
pub use space::of_design;

/// The models of this library.
pub const MODELS: &[&str] = &["TwoMassJoint", "PlanarManipulator", "SpatialFreeFlyer"];

#[cfg(test)]
mod tests {
    use crate::Plant;
    use trueup_fmi::configuration::Configuration;
    use trueup_fmi::table::Storage as S;
    use trueup_fmi_export::FmuModel;
    use trueup_models::effect::Choice;
    use trueup_numerics::hybrid::Hybrid;

    #[test]
    fn the_tables_cover_every_value_of_the_models() {
        let all = |plant| Choice::all(plant).map(|c| c.id()).collect::<Vec<_>>();
        let (joint, arm) = (all(trueup_models::effect::Plant::Joint), all(trueup_models::effect::Plant::Arm));
        let cases = [
            ("TwoMassJoint", vec![], vec![]),
            ("TwoMassJoint", vec![false], joint.clone()),
            ("TwoMassJoint", vec![true], joint),
            ("PlanarManipulator", vec![], vec![]),
            ("PlanarManipulator", vec![false], arm.clone()),
            ("PlanarManipulator", vec![true, false, true, true, false], arm),
            ("SpatialFreeFlyer", vec![], vec![]),
            ("SpatialFreeFlyer", vec![true, false, true, false, false, true], vec![]),
        ];
        for (model, joint_flexible, effects) in cases {
            let c = Configuration { joint_flexible, effects, ..Configuration::of(model) };
            let m = Plant::build(&c).unwrap();
            let t = m.table();
            let count = |pick: fn(S) -> bool| {
                t.variables.iter().filter(|v| pick(v.storage)).map(|v| v.len()).sum::<usize>()
            };
            let s = m.sizes();
            assert_eq!(count(|s| matches!(s, S::Parameter(_))), s.parameters, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::State(_))), s.states, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Rate(_))), s.states, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Output(_))), s.outputs, "{c:?}");
            assert_eq!(count(|s| matches!(s, S::Input(_))), s.inputs, "{c:?}");
            assert_eq!(t.parameter_starts().len(), s.parameters, "{c:?}");
            m.check(&t.parameter_starts()).unwrap();
        }
    }
}
