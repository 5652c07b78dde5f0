//! How the plant of a case is built: what the case declares of its structure, and its robot.

use std::sync::Arc;

use trueup_models::arm::{BASE, BASE_CHOICE};
use trueup_models::plants::{self, PlantStructure, StructureError};
use trueup_models::space::design::RobotDesign;
use trueup_signals::{Case, ParameterValue};

/// The structure that a case declares, with its known effects and these.
///
/// # Errors
/// A `jointFlexible` that is no truth value, a `base` that is neither free nor fixed, a robot's file that cannot be used.
pub fn case_structure(case: &Case, effects: &[&str]) -> Result<PlantStructure, StructureError> {
    let wrong = |name: &str, what: String| Err(StructureError::Parameter { name: name.to_owned(), what });
    let robot = match case.robot_file() {
        Some(_) if !plants::is_robot(&case.model) => {
            let what = format!(
                "{} is no robot that a file describes; take the line out, or write model = \"{}\"",
                case.model,
                plants::ROBOT
            );
            return wrong("robot", what);
        }
        Some(file) => match trueup_robot::read(&file, false) {
            Ok(read) => Some(Arc::new(read.design)),
            Err(e) => return wrong("robot", e.0),
        },
        None if plants::is_robot(&case.model) => {
            let what = "it is missing; write robot = \"arm.urdf\" with the file of your robot (TOML, URDF or MJCF), or name a preset (`trueup fmu list`)";
            return wrong("robot", what.into());
        }
        None => None,
    };
    let declared = case.elements("jointFlexible");
    let flexible: Option<Vec<bool>> = declared.iter().map(|v| v.boolean()).collect();
    let Some(mut flexible) = flexible else {
        return wrong(
            "jointFlexible",
            "it is true or false; write jointFlexible = true, for an arm one per joint".into(),
        );
    };
    if flexible.is_empty() {
        let of_robot = |r: &Arc<RobotDesign>| r.links.iter().map(|l| l.motor.flexible).collect();
        flexible = robot.as_ref().map_or_else(|| plants::usual_flexible(&case.model).to_vec(), of_robot);
    }
    let fixed_base = match case.parameters.get(BASE_CHOICE) {
        None => false,
        Some(ParameterValue::Text(item)) if BASE.items.iter().any(|i| i.0 == item) => {
            *item != BASE.items[0].0
        }
        Some(other) => {
            return wrong(BASE_CHOICE, format!("{other} is none of free, fixed; name one of them"));
        }
    };
    let mut all: Vec<String> = Vec::new();
    for id in case.known_effects().into_iter().chain(effects.iter().copied()) {
        if !all.iter().any(|known| known == id) {
            all.push(id.to_owned());
        }
    }
    Ok(PlantStructure {
        model: case.model.clone(),
        robot,
        flexible,
        fixed_base,
        effects: all,
        led: Vec::new(),
        payload: case.payload.and_then(|link| link.checked_sub(1)),
    })
}
