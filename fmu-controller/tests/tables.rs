//! The variable tables against the models that they describe.

use fmu_controller::variables::{joint_controller, manipulator_controller};
use trueup_fmi::table::{BoundaryType, Causality, Depends, ModelTable, Storage};
use trueup_models::controller::{JointController, ManipulatorController, parameter};
use trueup_numerics::hybrid::{Hybrid, ModelSizes};

/// Every place of every storage class is named exactly once, with unit, bounds and references that resolve.
fn fits(table: &ModelTable, sizes: ModelSizes) {
    let class = |pick: fn(Storage) -> Option<usize>| -> Vec<usize> {
        let of = |v: &trueup_fmi::table::TableVariable| pick(v.storage).map(|i| i..i + v.len());
        let mut all: Vec<usize> = table.variables.iter().filter_map(of).flatten().collect();
        all.sort_unstable();
        all
    };
    let whole = |n: usize| (0..n).collect::<Vec<_>>();
    assert_eq!(
        class(|s| if let Storage::Parameter(i) = s { Some(i) } else { None }),
        whole(sizes.parameters)
    );
    assert_eq!(class(|s| if let Storage::Input(i) = s { Some(i) } else { None }), whole(sizes.inputs));
    assert_eq!(class(|s| if let Storage::Output(i) = s { Some(i) } else { None }), whole(sizes.outputs));
    assert_eq!(class(|s| if let Storage::State(i) = s { Some(i) } else { None }), whole(sizes.states));
    assert_eq!(class(|s| if let Storage::Rate(i) = s { Some(i) } else { None }), whole(sizes.states));
    assert_eq!(table.indicators, sizes.indicators);

    for v in &table.variables {
        assert!(
            v.unit.is_empty() || trueup_fmi::units::find(v.unit).is_some(),
            "{}: unit {}",
            v.name,
            v.unit
        );
        assert!(!v.unit.is_empty() || v.kind != BoundaryType::Real, "{} has no unit", v.name);
        if matches!(v.causality, Causality::Input | Causality::Parameter) {
            assert_eq!(v.start.len(), v.len(), "{}", v.name);
        }
        if let (Some(min), Causality::Parameter) = (v.min, v.causality) {
            assert!(v.start.iter().all(|s| *s > min || (*s == min && !v.exclusive)), "{}", v.name);
        }
        if let Depends::On(names) = &v.depends {
            assert!(names.iter().all(|n| table.find(n).is_some()), "{}", v.name);
        }
        assert!(v.derivative_of.as_ref().is_none_or(|s| table.find(s).is_some()), "{}", v.name);
    }
    for (_, variable) in table.terminals.iter().flat_map(|t| &t.members) {
        assert!(table.find(variable).is_some(), "terminal member {variable}");
    }
}

fn names(table: &ModelTable, causality: Causality) -> Vec<&str> {
    table.variables.iter().filter(|v| v.causality == causality).map(|v| v.name.as_str()).collect()
}

#[test]
fn the_joint_controller_fits_its_table() {
    let table = joint_controller();
    fits(&table, JointController.sizes());
    for strategy in 1..=6 {
        let mut p = table.parameter_starts();
        p[parameter::COUNT + 1] = f64::from(strategy);
        assert_eq!(JointController.check(&p), Ok(()), "the defaults serve every strategy");
    }
    assert_eq!(
        names(&table, Causality::Input),
        [
            "positionReference",
            "velocityFeedforward",
            "motorAngle",
            "motorVelocity",
            "loadAngle",
            "loadVelocity"
        ]
    );
    assert_eq!(names(&table, Causality::Output), ["motorCurrent", "waveFrequencyUsed", "adaptationActive"]);
    assert_eq!(
        names(&table, Causality::Parameter),
        [
            "positionGain",
            "velocityGain",
            "velocityIntegralTime",
            "gearRatio",
            "torqueConstant",
            "currentLimit",
            "waveFrequency",
            "washoutFrequency",
            "samplePeriod",
            "strategy",
            "adaptation",
            "adaptationRate",
            "waveFrequencyMin",
            "waveFrequencyMax",
            "waveFrequencyRatio",
            "excitationThreshold",
            "scheduleAngle",
            "scheduleFrequency"
        ]
    );
}

#[test]
fn the_manipulator_controller_fits_its_table() {
    for n in [1, 3, 5] {
        let (table, model) = (manipulator_controller(n), ManipulatorController { joints: n });
        fits(&table, model.sizes());
        assert_eq!(model.check(&table.parameter_starts()), Ok(()));
        assert_eq!(
            names(&table, Causality::Output),
            ["jointTorque", "waveFrequencyUsed", "adaptationActive"]
        );
        assert_eq!(names(&table, Causality::Input).last(), Some(&"torqueFeedforward"));
        assert_eq!(table.find("scheduleJoint").is_some(), n > 1);
        assert_eq!(table.find("scheduleFrequency").map(|v| v.dimensions.clone()), Some(vec![n, 9]));
        for name in
            ["torqueLimit", "jointAngle", "jointVelocity", "jointTorque", "adaptation", "adaptationActive"]
        {
            assert_eq!(table.find(name).map(|v| v.dimensions.clone()), Some(vec![n]), "{name}");
        }
    }
}
