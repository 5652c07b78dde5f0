//! A case whose model is an FMU with its `ports.toml`.

use std::path::Path;
use std::sync::Arc;

use trueup_diagnosis::diagnose::foreign::{ChannelVariable, ForeignCase, JointRoles, NamedStart};

use trueup_fmi_import::{HybridFmu, UnpackedFmu, UsedInterface};
use trueup_identification::fmu::FmuSubject;
use trueup_identification::intake::weight_in_a_diagnosis;
use trueup_ports::check::{self, PortCheck};
use trueup_ports::insert::{self, EffectInsertion};
use trueup_ports::plant::{self, CoordinateKind, Plant, PlantOfPorts};
use trueup_ports::roles::{PortPlace, PortRole};
use trueup_ports::{Experiment, FmuPorts, FmuQuantities};
use trueup_signals::{Case, Finding, Loaded};

use super::{load_for, tell};
use crate::command::ports::given;
use crate::error::CliError;

/// Channels of the engine, by roles.
const CHANNELS: [(&str, &[PortRole]); 6] = [
    ("motorCurrent", &[PortRole::Torque, PortRole::Current]),
    ("externalTorque", &[PortRole::ExternalTorque]),
    ("motorAngle", &[PortRole::MotorAngle]),
    ("motorVelocity", &[PortRole::MotorVelocity]),
    ("loadAngle", &[PortRole::LinkAngle]),
    ("loadVelocity", &[PortRole::LinkVelocity]),
];
/// Effects of a reading.
const SENSOR_EFFECTS: [&str; 3] = ["sensor-delay", "sensor-drift", "sensor-eccentricity"];

/// The case, if its model is an FMU, with what the intake noticed; `deadline`: of each call of one that is not ours, s.
pub(crate) fn foreign(
    path: &Path,
    deadline: Option<f64>,
) -> Result<Option<(ForeignCase, Vec<Finding>)>, CliError> {
    // What is wrong in the file is reported when all of it is read.
    let Ok((case, _)) = Case::read(path, &[]) else { return Ok(None) };
    let Some(file) = case.fmu() else { return Ok(None) };
    let missing = || {
        CliError::at(
            &case.file,
            format!(
                "its model is an FMU: say what its variables mean, ports = \"ports.toml\"; `trueup ports {}` drafts one",
                file.display()
            ),
        )
    };
    let ports_file = case.folder.join(case.ports.as_ref().ok_or_else(missing)?);
    let subject = FmuSubject::open(&file).map_err(|e| CliError::Failed(e.to_string()))?;
    let fmu = Arc::clone(subject.fmu());
    isolated(&fmu, deadline)?;
    let all = FmuQuantities::of(fmu.description()).map_err(|e| CliError::at(&file, e))?;
    let ports = given(&ports_file, &file, &all)?;
    let failed = |e: trueup_ports::PortsError| CliError::Failed(e.to_string());
    let found = Experiment::run(&fmu, &all, UsedInterface::ModelExchange).map_err(failed)?;
    let checks = check::checks(&ports, &all, &found);
    let effects = insert::insertions(&ports, &found, &checks);
    let made = plant::plant(&fmu, &ports, &all, &found).map_err(failed)?;
    let (loaded, findings) = load_for(path, &subject)?;
    if let Some(weight) = weight_in_a_diagnosis(&loaded.case) {
        tell(&[weight]);
        return Err(CliError::Said);
    }
    let joints: Vec<PortPlace> =
        ports.places().into_iter().filter(|p| matches!(p, PortPlace::Joint(_))).collect();
    let joint = joints.first().cloned();
    let channels = joint.as_ref().map_or_else(Vec::new, |place| channels(&ports, place));
    let roles = match &joints[..] {
        [place] => match other_input(&loaded, &made, &ports, place) {
            Some(name) => Err(format!(
                "causes are compared with a drive and an external torque alone, and the recordings have `{name}`; leave its column out if it changes nothing"
            )),
            None => roles(&made, &ports, place, &checks),
        },
        _ => Err(format!(
            "{}: causes are compared for one joint; this has {}",
            ports_file.display(),
            joints.len()
        )),
    };
    let (refused, unreached) = refused(&ports, &channels, &effects);
    let starts = starts(&made);
    let plant: Arc<dyn Plant> = Arc::new(made.plant);
    let case = ForeignCase { loaded, plant, subject, starts, channels, roles, refused, unreached, failure };
    Ok(Some((case, findings)))
}

fn failure(plant: &dyn Plant) -> Option<String> {
    plant.as_any().downcast_ref::<HybridFmu>()?.failure()
}

/// An input of the FMU that was recorded and is neither the drive nor the external torque.
fn other_input(loaded: &Loaded, made: &PlantOfPorts, ports: &FmuPorts, place: &PortPlace) -> Option<String> {
    let drive = ports.drive(place).map(|v| &v.variable);
    let external = ports.variable(place, PortRole::ExternalTorque).map(|v| &v.variable);
    let own = |name: &String| [drive, external].into_iter().flatten().any(|v| v == name);
    let mut names = loaded.recordings.values().flat_map(|r| &r.channels).map(|c| &c.name);
    names.find(|name| made.plant.table().input(name).is_some() && !own(name)).cloned()
}

/// One that is not ours has a process of its own where there are any.
fn isolated(fmu: &UnpackedFmu, deadline: Option<f64>) -> Result<(), CliError> {
    if fmu.is_ours(UsedInterface::ModelExchange) {
        return Ok(());
    }
    match crate::isolate::isolation(deadline) {
        Ok(isolation) => fmu.isolate(&isolation),
        Err(_) => return crate::isolate::keep(&fmu.file().display().to_string()),
    }
    #[cfg(target_os = "linux")]
    let _ = trueup_fmi_import::keeper::adopt(); // else what an FMU that crashed has started lives on
    Ok(())
}

fn starts(made: &PlantOfPorts) -> Vec<NamedStart> {
    let table = made.plant.table();
    let named = |s: &plant::MotionStart| NamedStart {
        position: [&table.parameters[s.initial_position].name, &table.outputs[s.position_output].name]
            .map(Clone::clone),
        rate: [&table.parameters[s.initial_rate].name, &table.outputs[s.rate_output].name].map(Clone::clone),
    };
    made.starts.iter().map(named).collect()
}

fn channels(ports: &FmuPorts, place: &PortPlace) -> Vec<ChannelVariable> {
    let one = |(channel, roles): &(&'static str, &[PortRole])| {
        let found = roles.iter().find_map(|role| ports.variable(place, *role))?;
        Some((*channel, found.variable.clone()))
    };
    CHANNELS.iter().filter_map(one).collect()
}

fn roles(
    made: &PlantOfPorts,
    ports: &FmuPorts,
    place: &PortPlace,
    checks: &[PortCheck],
) -> Result<JointRoles, String> {
    if let Some(wrong) = check::contradicted(checks, place).next() {
        return Err(format!("[{}] of its ports is contradicted: {}", place.table(), wrong.text));
    }
    let table = made.plant.table();
    let coordinates = made.plant.coordinates();
    let drive = ports.drive(place).and_then(|v| table.input(&v.variable));
    let moves = coordinates.first().is_some_and(|c| c.kind == CoordinateKind::Motor);
    let (Some(drive), true) = (drive, moves) else {
        return Err(format!("no force can act on its motor: {}", made.unreached.join("; ")));
    };
    let external = ports.variable(place, PortRole::ExternalTorque).and_then(|v| table.input(&v.variable));
    let ratio = made.gear_ratio;
    let gear_ratio = ports.figure(place, "gearRatio").map_or(1.0, |f| f.value);
    Ok(JointRoles { drive, external, gear_ratio, ratio })
}

/// Effects that cannot be inserted, for the engine and for people.
fn refused(
    ports: &FmuPorts,
    channels: &[ChannelVariable],
    effects: &[EffectInsertion],
) -> (Vec<String>, Vec<String>) {
    let (mut refused, mut unreached) = (Vec::new(), Vec::new());
    let own = effects.iter().filter(|e| e.port.starts_with("joint"));
    for e in own.filter(|e| e.id != "position-servo") {
        if let Some(why) = &e.obstacle {
            refused.push(e.id.clone());
            unreached.push(format!("{} at {}: {why}", e.id, e.port));
        }
    }
    for (channel, variable) in channels.iter().filter(|c| c.0 == "motorAngle" || c.0 == "loadAngle") {
        let sensor = ports.sensors.iter().find(|s| s.variable == *variable);
        let angle = sensor.is_some_and(|s| s.kind == "encoder");
        for id in SENSOR_EFFECTS {
            if sensor.is_none() || id == "sensor-eccentricity" && !angle {
                refused.push(format!("{id}:sensor:{channel}"));
                let what = if sensor.is_none() { "it is not under [sensors]" } else { "it is no encoder" };
                unreached.push(format!("{id} at {variable}: {what} of the ports"));
            }
        }
    }
    (refused, unreached)
}
