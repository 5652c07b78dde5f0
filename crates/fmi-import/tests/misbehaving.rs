//! An FMU with bad habits, compiled here from `misbehaving.c`.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]
#![cfg(target_os = "linux")]

use std::path::Path;
use std::process::Command;
use std::sync::{Arc, Mutex};

use trueup_fmi_import::{
    ExperimentSetup, FmiStatus, ImportError, InstanceOptions, UnpackedFmu, UsedInterface, fmi2::Fmi2Instance,
};

const DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="misbehaving" guid="{GUID}">
  <CoSimulation modelIdentifier="misbehaving"/>
  <ModelVariables><ScalarVariable name="s" valueReference="0" causality="local" variability="discrete"><String/></ScalarVariable></ModelVariables>
  <ModelStructure/>
</fmiModelDescription>"#;

/// The unpacked FMU in a folder with a name that a URI must escape, or `None`, with a message.
pub(crate) fn fmu(guid: &str) -> Option<(tempfile::TempDir, Arc<UnpackedFmu>)> {
    let folder = tempfile::Builder::new().prefix("an fmu% ").tempdir().unwrap();
    let binaries = folder.path().join("binaries").join(match std::env::consts::ARCH {
        "x86_64" => "linux64".into(),
        other => format!("{other}-linux"),
    });
    std::fs::create_dir_all(&binaries).unwrap();
    std::fs::write(folder.path().join("modelDescription.xml"), DESCRIPTION.replace("GUID", guid)).unwrap();
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/misbehaving.c");
    let library = binaries.join("misbehaving.so");
    let built = Command::new("cc").args(["-shared", "-fPIC", "-o"]).arg(&library).arg(source).status();
    if !built.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: no C compiler (cc)");
        return None;
    }
    let fmu = UnpackedFmu::open(folder.path()).unwrap();
    Some((folder, fmu))
}

type Heard = Arc<Mutex<Vec<String>>>;

pub(crate) fn started(fmu: &Arc<UnpackedFmu>, name: &str) -> (Fmi2Instance, Heard) {
    let heard = Heard::default();
    let ear = Arc::clone(&heard);
    let listener = Box::new(move |m: &trueup_fmi_import::Message| ear.lock().unwrap().push(m.text.clone()));
    let options = InstanceOptions { listener: Some(listener), ..InstanceOptions::named(name) };
    let mut instance = Fmi2Instance::new(fmu, UsedInterface::CoSimulation, options).unwrap();
    instance.enter_initialization_mode(ExperimentSetup::default()).unwrap(); // a warning
    instance.exit_initialization_mode().unwrap();
    (instance, heard)
}

#[test]
fn states_are_freed_before_the_end_and_the_instance_last() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    states(&fmu);
}

pub(crate) fn states(fmu: &Arc<UnpackedFmu>) {
    let (mut instance, heard) = started(fmu, "terminated");
    let (id, _forgotten) = (instance.save().unwrap(), instance.save().unwrap());
    instance.save_over(&id).unwrap();
    instance.terminate().unwrap();
    drop(instance);
    let expected = ["initialization", "state freed", "state freed", "terminated", "instance freed"];
    assert_eq!(*heard.lock().unwrap(), expected);

    let (mut instance, heard) = started(fmu, "dropped");
    let id = instance.save().unwrap();
    instance.free(id).unwrap();
    let _forgotten = instance.save().unwrap();
    drop(instance);
    assert_eq!(*heard.lock().unwrap(), ["initialization", "state freed", "state freed", "instance freed"]);
}

#[test]
fn every_status_of_a_step_is_met() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    statuses(&fmu);
}

pub(crate) fn statuses(fmu: &Arc<UnpackedFmu>) {
    let (mut it, heard) = started(fmu, "statuses");
    assert!(!it.do_step(0.0, 1.0, true).unwrap().early);
    let step = it.do_step(0.0, 2.0, true).unwrap();
    assert!(step.discarded && !step.terminate && step.time == 0.25, "{step:?}");
    assert_eq!(it.do_step(0.0, 3.0, true).unwrap_err().status(), Some(FmiStatus::Error));
    assert_eq!(it.do_step(0.0, 5.0, true).unwrap().time, 5.0, "a pending step is waited for");
    assert_eq!(it.do_step(0.0, 77.0, true).unwrap_err().status(), Some(FmiStatus::Unknown(77)));
    assert_eq!(it.do_step(0.0, 4.0, true).unwrap_err().status(), Some(FmiStatus::Fatal));
    assert!(matches!(it.do_step(0.0, 1.0, true), Err(ImportError::Lost { function: "fmi2DoStep", .. })));
    assert!(matches!(it.terminate(), Err(ImportError::Lost { .. })));
    drop(it);
    assert_eq!(*heard.lock().unwrap(), ["initialization"], "a lost instance is not called, not even freed");
}

#[test]
fn missing_functions_and_odd_values_are_met() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    odd(&fmu);
}

pub(crate) fn odd(fmu: &Arc<UnpackedFmu>) {
    let (mut it, _) = started(fmu, "odd");
    let error = it.reset().unwrap_err();
    assert!(matches!(error, ImportError::NotSupported { function: "fmi2Reset", .. }), "{error}");
    let error = it.get_real(&[1, 2], &mut [0.0]).unwrap_err();
    assert!(matches!(error, ImportError::Length { expected: 2, got: 1, .. }), "{error}");
    assert_eq!(it.get_string(&[0, 1]).unwrap(), ["", ""]);
    let mut values = [false];
    it.get_boolean(&[0], &mut values).unwrap();
    assert_eq!(values, [true]);
}

#[test]
fn no_instance_is_an_error_with_the_reason() {
    let Some((_folder, fmu)) = fmu("another") else { return };
    refused(&fmu);
}

pub(crate) fn refused(fmu: &Arc<UnpackedFmu>) {
    let error =
        Fmi2Instance::new(fmu, UsedInterface::CoSimulation, InstanceOptions::named("x")).err().unwrap();
    assert!(error.to_string().contains("guid {another} is not mine"), "{error}");
    let error =
        Fmi2Instance::new(fmu, UsedInterface::ModelExchange, InstanceOptions::default()).err().unwrap();
    assert!(error.to_string().contains("does not offer Model Exchange"), "{error}");
}

#[test]
fn what_is_no_fmu_is_refused_with_its_name() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [("text.fmu", "no zip"), ("empty.fmu", "")] {
        let file = folder.path().join(name);
        std::fs::write(&file, content).unwrap();
        let error = UnpackedFmu::open(&file).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
    }
    assert!(UnpackedFmu::open(folder.path().join("absent.fmu")).is_err());
    assert!(UnpackedFmu::open(folder.path()).unwrap_err().to_string().contains("modelDescription.xml"));
}
