//! Against the Fault Diagnosis Toolbox's results for a flexible joint (redundancy, number of minimal over-determined sets,
//! classes), sensor set by sensor set.

use trueup_diagnosis::locate::isolability::EquationStructure;

const CURRENT: &str = "motorCurrent";

#[test]
fn a_flexible_joint_by_its_sensors() {
    let table: [(&[&str], usize, usize); 5] = [
        (&[CURRENT, "motorAngle"], 1, 1),
        (&[CURRENT, "loadAngle"], 1, 1),
        (&[CURRENT, "motorAngle", "transmissionTorque"], 2, 5),
        (&[CURRENT, "motorAngle", "loadAngle"], 2, 7),
        (&[CURRENT, "motorAngle", "loadAngle", "transmissionTorque"], 3, 18),
    ];
    for (channels, redundancy, sets) in table {
        let s = EquationStructure::joint(true, channels);
        let found = s.isolability();
        println!("{channels:?}: {} / {} {found:?}", found.redundancy, s.minimal_sets());
        assert_eq!((found.redundancy, s.minimal_sets()), (redundancy, sets), "{channels:?}");
        assert_eq!(found.hidden, [""; 0]);
    }
}

#[test]
fn with_one_encoder_nothing_and_with_two_all_but_the_motor_side() {
    let one = EquationStructure::joint(true, &[CURRENT, "motorAngle"]).isolability();
    assert_eq!(one.classes.len(), 1, "{one:?}");
    let two = EquationStructure::joint(true, &[CURRENT, "motorAngle", "loadAngle"]).isolability();
    assert_eq!(two.classes.len(), 5, "{two:?}");
    assert_eq!(two.classes[0], ["actuator", "motor-friction", "sensor:motorCurrent"]);
    for alone in ["transmission", "load", "sensor:motorAngle", "sensor:loadAngle"] {
        assert!(two.isolable(alone), "{alone}");
    }
    let torque = EquationStructure::joint(true, &[CURRENT, "motorAngle", "transmissionTorque"]).isolability();
    assert_eq!(torque.classes[0], ["actuator", "motor-friction", "sensor:motorCurrent"]);
    assert!(torque.classes.contains(&vec!["transmission".into(), "load".into()]), "{torque:?}");
    // Nothing measured: nothing shows.
    let none = EquationStructure::joint(true, &[]).isolability();
    assert!(none.classes.is_empty() && none.redundancy == 0);
}

#[test]
fn a_manipulator_distinguishes_inside_from_outside_if_its_base_is_measured() {
    let arm = |base: bool, motors: bool| {
        let mut channels: Vec<String> =
            (1..=3).flat_map(|i| [format!("jointTorque[{i}]"), format!("jointAngle[{i}]")]).collect();
        if base {
            channels.extend(["basePosition[1]", "basePosition[2]", "baseAttitude"].map(String::from));
        }
        if motors {
            channels.push("motorAngle[1]".into());
        }
        let channels: Vec<&str> = channels.iter().map(String::as_str).collect();
        EquationStructure::arm(&[true, false, false], &channels).isolability()
    };
    let full = arm(true, true);
    println!("{full:?}");
    let class = |found: &trueup_diagnosis::locate::isolability::Isolability, name: &str| {
        found.classes.iter().find(|c| c.iter().any(|n| n == name)).cloned()
    };
    assert!(!class(&full, "base").unwrap().contains(&"motor-friction[2]".to_owned()));
    assert!(full.isolable("transmission[1]"), "{full:?}");
    assert!(class(&full, "actuator[1]").unwrap().contains(&"motor-friction[1]".to_owned()));
    // Without its motor's encoder the spring of joint 1 and the motor behind it are one.
    assert!(!arm(true, false).isolable("transmission[1]"));
    // Without the base nothing shows whether momentum stays.
    assert!(arm(false, true).redundancy < full.redundancy);
}
