//! Parameters of a case against the model's variables.

use std::path::Path;

use crate::common::{CASE, HEALTHY, found, with_links};
use trueup_signals::{Case, Finding, SignalsError};

/// What is in `[parameters]` and `[uncertain]` has the shape, the type and the range of its variable.
#[test]
fn parameters_of_a_wrong_type_or_shape_are_refused() {
    let value = |text: &str| format!("{CASE}[parameters]\n{text}\n");
    let doubt = |text: &str| {
        format!("{CASE}[parameters]\nstiffness = 1.0\nlinkMass = [1.0, 2.0]\n[uncertain]\n{text}\n")
    };
    let broken: &[(String, &[&str])] = &[
        (value("stiffness = [0.083]"), &["case.toml:4", "`stiffness` is a list", "write stiffness = 0.083"]),
        (value("stiffness = []"), &["`stiffness` is a list", "write stiffness = 1.0"]),
        (
            value("stiffness = true"),
            &["case.toml:4", "`stiffness` is a truth value, true, where a number is required"],
        ),
        (value("stiffness = \"much\""), &["`stiffness` is a text, much, where a number", "without quotes"]),
        (value("stiffness = { value = 1 }"), &["case.toml:4", "`stiffness` is a table"]),
        (value("stiffness = 2024-01-01"), &["`stiffness` is a datetime"]),
        (value("stiffness = nan"), &["`stiffness`", "finite"]),
        (value("stiffness = 1e200"), &["`stiffness` is 1e200: no quantity is as large"]),
        (
            value("jointFlexible = 1"),
            &["`jointFlexible` is a number, 1, where true or false", "jointFlexible = true"],
        ),
        (value("jointFlexible = [true]"), &["`jointFlexible` is a list", "write jointFlexible = true"]),
        (value("motorCoupling = 2"), &["`motorCoupling` is a number, 2, where the name of a choice"]),
        (
            value("linkMass = 1.5"),
            &["`linkMass` is one value, the model has 2 elements", "linkMass = [1.5, 1.5]"],
        ),
        (value("linkMass = [1.0]"), &["`linkMass` is a list of another shape", "linkMass[1] to linkMass[2]"]),
        (value("linkMass = [[1.0, 2.0]]"), &["`linkMass` is a list of another shape"]),
        (value("linkMass = [1.0, true]"), &["`linkMass[2]` is a truth value"]),
        (value("center = [1.0, 2.0, 3.0, 4.0]"), &["another shape", "center = [[1, 1], [1, 1]]"]),
        (value("\"linkMass[3]\" = 1.0"), &["no parameter `linkMass[3]`"]),
        (
            value("baseMass = 0"),
            &["case.toml:4", "`baseMass` is 0: it has to be above 0", "give the baseMass"],
        ),
        (value("baseMass = -2"), &["`baseMass` is -2: it has to be above 0"]),
        (value("baseInertia = -2"), &["`baseInertia` is -2 kg.m2, it cannot be below 0"]),
        (doubt("stiffness = true"), &["the uncertainty of `stiffness` is true", "0.1 for 10 %"]),
        (doubt("stiffness = [0.1]"), &["`stiffness` is a list", "write stiffness = 0.1"]),
        (doubt("linkMass = [0.1]"), &["case.toml:7", "`linkMass` is a list of another shape"]),
        (doubt("linkMass = \"0.1\""), &["the uncertainty of `linkMass`"]),
    ];
    for (case, parts) in broken {
        let files = [("case.toml", case.as_bytes()), ("run.csv", HEALTHY.as_bytes())];
        let findings = found(&files, &with_links(), &[]);
        let hit = |f: &Finding| f.is_error() && parts.iter().all(|p| f.to_string().contains(p));
        assert!(findings.iter().any(hit), "{case}\n{parts:?} not in\n{findings:#?}");
    }
    let right = format!(
        "{CASE}[parameters]\nstiffness = 1\nlinkMass = [1, 2.5]\ncenter = [[0.1, 0], [0.2, 0.0]]\njointFlexible = false\n\
         motorCoupling = \"paper\"\n[uncertain]\nlinkMass = 0.1\n\"linkMass[2]\" = 0\ncenter = [[0.02, 0], [0.02, 0]]\n"
    );
    let (case, findings) = Case::parse(Path::new("case.toml"), &right, &with_links()).unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    // An uncertainty of 0 next to others means that a value is known.
    assert_eq!([case.doubt("linkMass[1]"), case.doubt("linkMass[2]")], [Some(0.1), None]);
    assert_eq!([case.doubt("center[1,1]"), case.doubt("center[1,2]")], [Some(0.02), None]);
}

/// Values and standard deviations of known effects are those of parameters; at which joint, too.
#[test]
fn known_effects_are_read_as_parameters() {
    let read = |text: &str| Case::parse(Path::new("case.toml"), &format!("{CASE}{text}"), &[]);
    let (case, findings) = read(
        "[parameters]\nstiffness = 1.0\n[uncertain]\ngravityAngle = 0.02\n[effects]\n\
         gravity-torque = { gravityTorque = 110.0, gravityAngle = 1.5, doubt = 0.1 }\n\
         cable-stiffness = [{ cableStiffness = 2.0, joint = 1 }, { cableStiffness = 1.0, joint = 3, doubt = 0 }]\n\
         asymmetric-friction = { asymmetry = [0.1, 0.2] }\n[fit]\neffects = [\"backlash\"]\n",
    )
    .unwrap();
    assert!(findings.is_empty(), "{findings:?}");
    assert_eq!(case.known_effects(), ["asymmetric-friction", "cable-stiffness", "gravity-torque"]);
    assert_eq!(case.effects.iter().map(|e| e.joint).collect::<Vec<_>>(), [None, Some(1), Some(3), None]);
    assert_eq!((case.number("gravityTorque"), case.number("cableStiffness[3]")), (Some(110.0), Some(1.0)));
    assert_eq!(case.number("asymmetry[2]"), Some(0.2));
    // An entry of [uncertain] for one of them has precedence over the `doubt` of all.
    let doubts = ["gravityTorque", "gravityAngle", "cableStiffness[1]", "cableStiffness[3]"];
    assert_eq!(doubts.map(|n| case.doubt(n)), [Some(0.1), Some(0.02), None, None]);
    assert_eq!(case.with, ["backlash"]);
    for (text, parts) in [
        ("backlash = 0.1", ["`effects.backlash` is a table", "[effects.backlash]"]),
        ("backlash = { backlashWidth = 0.1, joint = 0 }", ["`joint` of effects.backlash is 0", "joint = 1"]),
        (
            "backlash = { backlashWidth = 0.1, joint = 1.5 }",
            ["`joint` of effects.backlash is 1.5", "joint = 1"],
        ),
        (
            "backlash = { backlashWidth = 0.1, doubt = -1 }",
            ["`doubt` of effects.backlash is -1", "0.1 for 10 %"],
        ),
        (
            "backlash = { stiffness = 2.0 }",
            ["`stiffness` has a value in [parameters] and in", "give it once"],
        ),
        (
            "backlash = [{ a = 0.1, joint = 1 }, { a = 0.2, joint = 1 }]",
            ["named twice", "once for each joint"],
        ),
    ] {
        let Err(SignalsError::Wrong(said)) =
            read(&format!("[parameters]\nstiffness = 1.0\n[effects]\n{text}\n"))
        else {
            panic!("{text}")
        };
        let hit = |f: &Finding| f.is_error() && parts.iter().all(|p| f.to_string().contains(p));
        assert!(said.iter().any(hit), "{text}: {said:?}");
    }
}
