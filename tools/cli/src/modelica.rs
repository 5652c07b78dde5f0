//! The equations as Modelica, which go into the FMUs as one file.

macro_rules! files {
    ($($path:literal)*) => {
        &[$(($path, include_str!(concat!("../../../modelica/Trueup/", $path)))),*]
    };
}

/// All files of the package by their paths in it.
#[rustfmt::skip]
const FILES: &[(&str, &str)] = files! {
    "Arm/Base.mo" "Arm/MotorCoupling.mo" "Arm/package.mo" "Control/Adaptation.mo" "Control/Estimate.mo"
    "Control/Interface.mo" "Control/Law.mo" "Control/Period.mo" "Control/SampledEstimate.mo"
    "Control/SampledSplit.mo" "Control/Schedule.mo" "Control/Split.mo" "Control/Strategy.mo"
    "Control/Waves.mo" "Control/package.mo" "Effects/Actuator/Ideal.mo" "Effects/Actuator/Interface.mo"
    "Effects/Actuator/Lag.mo" "Effects/Actuator/Push.mo" "Effects/Actuator/Ripple.mo"
    "Effects/Actuator/Saturation.mo" "Effects/Actuator/package.mo" "Effects/Base/Appendage.mo"
    "Effects/Base/Cable.mo" "Effects/Base/Drag.mo" "Effects/Base/Free.mo" "Effects/Base/Interface.mo"
    "Effects/Base/Push.mo" "Effects/Base/TableTilt.mo" "Effects/Base/Thrust.mo" "Effects/Base/Wrench.mo"
    "Effects/Base/package.mo" "Effects/Gear/Exact.mo" "Effects/Gear/Interface.mo"
    "Effects/Gear/KinematicError.mo" "Effects/Gear/package.mo" "Effects/Load/BearingFriction.mo"
    "Effects/Load/Cable.mo" "Effects/Load/FlexibleLink.mo" "Effects/Load/Free.mo" "Effects/Load/Gravity.mo"
    "Effects/Load/Interface.mo" "Effects/Load/Push.mo" "Effects/Load/package.mo"
    "Effects/MotorFriction/Asymmetric.mo" "Effects/MotorFriction/Drift.mo"
    "Effects/MotorFriction/Interface.mo" "Effects/MotorFriction/LoadDependent.mo"
    "Effects/MotorFriction/NonlinearViscous.mo" "Effects/MotorFriction/Paper.mo"
    "Effects/MotorFriction/Presliding.mo" "Effects/MotorFriction/Stribeck.mo"
    "Effects/MotorFriction/package.mo" "Effects/Parts/Memory.mo" "Effects/Parts/Pulse.mo"
    "Effects/Parts/package.mo" "Effects/Sensor/Delay.mo" "Effects/Sensor/Drift.mo"
    "Effects/Sensor/Eccentricity.mo" "Effects/Sensor/Interface.mo" "Effects/Sensor/package.mo"
    "Effects/Spring/Backlash.mo" "Effects/Spring/Hysteresis.mo" "Effects/Spring/Interface.mo"
    "Effects/Spring/Linear.mo" "Effects/Spring/NonlinearDamping.mo" "Effects/Spring/NonlinearStiffness.mo"
    "Effects/Spring/package.mo" "Effects/Tip/Free.mo" "Effects/Tip/Interface.mo" "Effects/Tip/Push.mo"
    "Effects/Tip/package.mo" "Effects/package.mo" "Friction/Modes.mo" "Friction/package.mo"
    "Joint/Gearbox.mo" "Joint/Interface.mo" "Joint/package.mo" "JointController.mo"
    "JointControllerSampled.mo" "PlanarManipulator.mo" "TwoMassJoint.mo" "TwoMassJointRigid.mo" "package.mo"
};

/// What of the package an FMU needs: begins of paths; `None`: there is no Modelica of it.
fn needs(model: &str) -> Option<&'static [&'static str]> {
    Some(match model {
        "TwoMassJoint" => &[
            "TwoMassJoint",
            "Joint/",
            "Friction/",
            "Effects/Actuator/",
            "Effects/Gear/",
            "Effects/Load/",
            "Effects/MotorFriction/",
            "Effects/Parts/",
            "Effects/Sensor/",
            "Effects/Spring/",
        ],
        "PlanarManipulator" => &[
            "PlanarManipulator",
            "Arm/",
            "Effects/Base/",
            "Effects/Parts/",
            "Effects/Sensor/",
            "Effects/Tip/",
        ],
        // One law, for each joint.
        "JointController" | "ManipulatorController" => &["JointController", "Control/"],
        _ => return None,
    })
}

/// The package `Trueup` with what this FMU needs of it.
pub(crate) fn of(model: &str) -> Option<String> {
    let needs = needs(model)?;
    let kept = |path: &str| needs.iter().any(|begin| path.starts_with(begin));
    Some(format!(
        "within;\n{}",
        package("", &|path| FILES.iter().any(|(p, _)| p.starts_with(path) && kept(p)))
    ))
}

/// The package in the folder `folder` (with its slash) and what of it `kept` names, nested.
fn package(folder: &str, kept: &dyn Fn(&str) -> bool) -> String {
    let text = |path: &str| {
        let found = FILES.iter().find(|(p, _)| *p == path).map(|(_, text)| *text);
        let lines = found.unwrap_or_default().split_once('\n');
        lines.map(|(_within, class)| class.to_owned()).unwrap_or_default()
    };
    let mut parts: Vec<&str> = FILES.iter().filter_map(|(p, _)| p.strip_prefix(folder)).collect();
    parts.iter_mut().for_each(|p| *p = p.split_inclusive('/').next().unwrap_or(p));
    parts.dedup();
    let own = text(&format!("{folder}package.mo"));
    let (head, rest) = own.split_once('\n').unwrap_or((&own, ""));
    let mut nested = format!("{head}\n");
    for part in parts.into_iter().filter(|p| *p != "package.mo") {
        let path = format!("{folder}{part}");
        if kept(&path) {
            nested += &if part.ends_with('/') { package(&path, kept) } else { text(&path) };
        }
    }
    nested + rest
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn paths(folder: &Path, below: &str, found: &mut Vec<String>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let entry = entry.unwrap();
            let name = format!("{below}{}", entry.file_name().to_str().unwrap());
            if entry.file_type().unwrap().is_dir() {
                paths(&entry.path(), &format!("{name}/"), found);
            } else if name.ends_with(".mo") {
                found.push(name);
            }
        }
    }

    #[test]
    fn every_file_of_the_package_is_here() {
        let mut found = Vec::new();
        paths(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../modelica/Trueup")), "", &mut found);
        found.sort();
        assert_eq!(found, FILES.iter().map(|(path, _)| *path).collect::<Vec<_>>());
    }

    #[test]
    fn a_model_has_what_it_needs_and_no_more() {
        let joint = of("TwoMassJoint").unwrap();
        for class in
            ["package Trueup ", "model TwoMassJoint ", "package Effects ", "block Gravity ", "end Trueup;"]
        {
            assert_eq!(joint.matches(class).count(), 1, "{class}");
        }
        assert!(joint.starts_with("within;\n") && !joint.contains("\nwithin"));
        assert!(!joint.contains("package Control") && !joint.contains("package Base"));
        assert!(of("JointController").unwrap().contains("block SampledSplit"));
        assert_eq!(of("GripperContact"), None);
    }
}
