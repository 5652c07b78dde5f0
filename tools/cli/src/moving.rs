//! The moving pictures of a run: which components are plants of this project, and their scenes.

use fmu_plant::{Contact, PlantModelTable};
use trueup_cosim::plan::{MasterPlan, PlannedComponent};
use trueup_cosim::{SeriesMemory, ValueBuffer};
use trueup_fmi::configuration::Configuration;
use trueup_fmi_export::FmuModel;
use trueup_models::joint::parameter;
use trueup_report::Page;
use trueup_scene::{
    HAND, MissingColumn, MotionRecord, Scene, arm_capture_scene, body_scene, capture_scene, hand_reach,
    joint_scene, planar_scene, robot_scene, space_capture_scene,
};

/// A component that has a picture.
pub(crate) struct PlantInRun {
    /// Name of the component; empty if it is the only one.
    name: String,
    plant: PlantModelTable,
    /// As at the start of the run.
    parameters: Vec<f64>,
}

/// The plants among the components of a plan.
pub(crate) fn plants(plan: &MasterPlan) -> Vec<PlantInRun> {
    plan.components.iter().filter_map(plant).collect()
}

/// A component by the configuration that is packed into every FMU of this project; `None`: it is no plant of it.
fn plant(component: &PlannedComponent) -> Option<PlantInRun> {
    let file = component.fmu.directory().join("resources/configuration.txt");
    let configuration = Configuration::from_text(&std::fs::read_to_string(file).ok()?).ok()?;
    let (name, model) = (component.name.clone(), configuration.model.as_str());
    let plant = PlantModelTable::build(&configuration).ok().filter(|_| !model.is_empty())?;
    let mut table = plant.table();
    table.apply(&configuration.start).ok()?;
    let description = component.description();
    for block in &component.start {
        let ValueBuffer::Float64(values) = &block.values else { continue };
        let mut values = values.iter();
        for reference in &block.references {
            let variable = description.variables.iter().find(|v| v.value_reference == *reference)?;
            for i in 0..description.elements(variable)? {
                let element = table.find(&variable.name).map(|v| v.element_name(i));
                let element = element.unwrap_or_else(|| variable.name.clone());
                // Start values of what the table has not (inputs of an effect) move no body.
                let _ = table.set_start(&element, *values.next()?);
            }
        }
    }
    Some(PlantInRun { name, parameters: table.parameter_starts(), plant })
}

impl PlantInRun {
    /// Its scene; `None`: it has no body of its own.
    fn scene(&self, record: &MotionRecord<'_>) -> Option<Result<Scene, MissingColumn>> {
        let p = &self.parameters;
        Some(match &self.plant {
            PlantModelTable::Joint(..) => joint_scene(p[parameter::GEAR_RATIO], record),
            PlantModelTable::TwoStageJoint(joint, _) => joint_scene(joint.equivalent(p).ratio, record),
            PlantModelTable::Arm(arm) => planar_scene(arm, p, record),
            PlantModelTable::InverseDynamics(inverse) => planar_scene(inverse.arm(), p, record),
            PlantModelTable::Space(robot, _) => robot_scene(robot, p, record),
            PlantModelTable::FlexibleArm { arm, .. } => robot_scene(arm.bodies(), p, record),
            PlantModelTable::Contact(Contact::Body(body)) => body_scene(body, p, record),
            PlantModelTable::Contact(Contact::Scene(capture)) => capture_scene(capture, p, record),
            PlantModelTable::Contact(Contact::ArmScene(capture)) => arm_capture_scene(capture, p, record),
            PlantModelTable::Contact(Contact::SpaceScene(capture, _)) => {
                space_capture_scene(capture, p, record)
            }
            PlantModelTable::Contact(Contact::Gripper(_)) | PlantModelTable::SpaceController(..) => {
                return None;
            }
        })
    }

    /// Of a capture what happens at the hand, which is small.
    fn close_up(&self, scene: &Scene) -> Option<Scene> {
        let PlantModelTable::Contact(contact) = &self.plant else { return None };
        let structure = match contact {
            Contact::Scene(capture) => capture.structure(),
            Contact::ArmScene(capture) => capture.structure(),
            Contact::Body(_) | Contact::Gripper(_) | Contact::SpaceScene(..) => return None,
        };
        scene.close_up(HAND, 1.3 * hand_reach(structure, &self.parameters))
    }

    /// Joints turn about axes of their own; all others share the inertial axes.
    fn is_joint(&self) -> bool {
        matches!(self.plant, PlantModelTable::Joint(..) | PlantModelTable::TwoStageJoint(..))
    }
}

/// The scenes of a run by their titles, and reasons where one cannot be drawn.
fn scenes(plants: &[PlantInRun], results: &SeriesMemory) -> (Vec<(String, Scene)>, Vec<String>) {
    let mut together = Scene::default();
    let (mut names, mut apart, mut reasons) = (Vec::new(), Vec::new(), Vec::new());
    for plant in plants {
        let prefix = if plant.name.is_empty() { String::new() } else { format!("{}.", plant.name) };
        let columns = |name: &str| results.column(&format!("{prefix}{name}"));
        match plant.scene(&MotionRecord::new(results.time(), &columns)) {
            None => {}
            Some(Err(missing)) => {
                reasons.push(format!("{}{missing}; leave --outputs out", prefix.replace('.', ": ")));
            }
            Some(Ok(scene)) if plant.is_joint() => apart.push((plant.name.clone(), scene)),
            Some(Ok(mut scene)) => {
                if let Some(close) = plant.close_up(&scene) {
                    let title = if prefix.is_empty() { String::new() } else { format!("{}: ", plant.name) };
                    apart.push((title + "the hand, seen from itself", close));
                }
                names.push(plant.name.as_str());
                scene.parts.iter_mut().for_each(|part| part.name.insert_str(0, &prefix));
                together.join(scene);
            }
        }
    }
    let all = [(names.join(", "), together)].into_iter().chain(apart);
    (all.filter(|(_, scene)| !scene.parts.is_empty()).collect(), reasons)
}

/// Puts the scenes of a run onto its page, in a section of their own.
pub(crate) fn section(page: &mut Page, plants: &[PlantInRun], results: &SeriesMemory) {
    let found = scenes(plants, results);
    if found.0.is_empty() && found.1.is_empty() {
        return;
    }
    page.section("Motion", "The button plays, the slider scrubs; a picture in space turns by dragging.");
    put(page, &found);
}

/// Puts the scenes of a run into the section that is open.
pub(crate) fn onto(page: &mut Page, plants: &[PlantInRun], results: &SeriesMemory) {
    put(page, &scenes(plants, results));
}

fn put(page: &mut Page, (scenes, reasons): &(Vec<(String, Scene)>, Vec<String>)) {
    scenes.iter().for_each(|(title, scene)| page.scene(title, scene));
    reasons.iter().for_each(|reason| page.text(reason));
}
