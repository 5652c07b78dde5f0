//! TwoMassJoint and PlanarManipulator as FMUs: binding only.

mod builder;
mod joint;

use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_models::joint::TwoMassJoint;

/// The models of this library.
pub const MODELS: &[&str] = &["TwoMassJoint", "PlanarManipulator"];

/// The variable table of a configuration, its start values applied.
///
/// # Errors
/// The model, an effect or a structure that cannot be had, with the mend.
pub fn table(configuration: &Configuration) -> Result<ModelTable, String> {
    let flexible = configuration.joint_flexible.first().copied().unwrap_or(true);
    let model = TwoMassJoint::new(flexible, &configuration.effects).map_err(|e| e.to_string())?;
    let gear_ratio =
        configuration.start.iter().find(|(name, _)| name == "gearRatio").map(|(_, value)| *value);
    let mut table = joint::table(&model, gear_ratio);
    table.apply(&configuration.start)?;
    Ok(table)
}

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
