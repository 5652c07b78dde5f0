//! TwoMassJoint and PlanarManipulator as FMUs: binding only.

mod arm;
mod builder;
mod experiment;
mod joint;
mod model;

pub use experiment::schedule;
pub use model::{Plant, TEST_BED};

/// The models of this library.
pub const MODELS: &[&str] = &["TwoMassJoint", "PlanarManipulator"];

#[cfg(test)]
mod tests {
    use super::*;
    use trueup_numerics::hybrid::Hybrid;
    #[test]
    fn the_table_covers_every_value_of_the_model() {
        let all = [
            "motor-friction",
            "stribeck-friction",
            "backlash",
            "transmission-hysteresis",
            "flexible-link",
            "gravity-torque",
        ];
        for (flexible, effects) in [(true, &[][..]), (false, &[][..]), (true, &all[..])] {
            let model = TwoMassJoint::new(flexible, effects).unwrap();
            let t = joint::table(&model, None);
            use trueup_fmi::table::Storage as S;
            let count = |pick: fn(S) -> Option<usize>| {
                t.variables.iter().filter(|v| pick(v.storage).is_some()).map(|v| v.len()).sum::<usize>()
            };
            let s = model.sizes();
            assert_eq!(count(|s| if let S::Parameter(i) = s { Some(i) } else { None }), s.parameters);
            assert_eq!(count(|s| if let S::State(i) = s { Some(i) } else { None }), s.states);
            assert_eq!(count(|s| if let S::Rate(i) = s { Some(i) } else { None }), s.states);
            assert_eq!(count(|s| if let S::Output(i) = s { Some(i) } else { None }), s.outputs);
            assert_eq!(count(|s| if let S::Input(i) = s { Some(i) } else { None }), s.inputs);
        }
    }
}
