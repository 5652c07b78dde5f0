//! FMUs in processes of their own behave as within the process, until they end it.
#![cfg(target_os = "linux")]

use std::sync::Arc;
use std::time::Duration;

use trueup_fmi_import::{ImportError, Isolation, UnpackedFmu, isolation};

use super::misbehaving;

/// This test binary serves the FMU when it is started to run this one test.
const HOST: [&str; 4] = ["isolated::serves", "--exact", "--nocapture", "--quiet"];

/// Does nothing but in the process of an FMU, whose standard input is a memory to share.
#[test]
fn serves() {
    match isolation::serve() {
        Ok(_) => std::process::exit(0),
        Err(why) => assert!(why.contains("no memory of an FMU"), "{why}"),
    }
}

fn fmu(guid: &str) -> Option<(tempfile::TempDir, Arc<UnpackedFmu>)> {
    let (folder, fmu) = misbehaving::fmu(guid)?;
    fmu.isolate(&Isolation::new(HOST, Some(Duration::from_secs(60))).unwrap());
    assert!(fmu.is_isolated());
    Some((folder, fmu))
}

#[test]
fn states_are_freed_before_the_end_and_the_instance_last() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    misbehaving::states(&fmu);
}

#[test]
fn every_status_of_a_step_is_met() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    misbehaving::statuses(&fmu);
}

#[test]
fn missing_functions_and_odd_values_are_met() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    misbehaving::odd(&fmu);
}

#[test]
fn no_instance_is_an_error_with_the_reason() {
    let Some((_folder, fmu)) = fmu("another") else { return };
    misbehaving::refused(&fmu);
}

/// Many messages within one call: more than there is room for at a time.
#[test]
fn no_message_is_lost() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    let (mut it, heard) = misbehaving::started(&fmu, "talks");
    it.do_step(0.0, 6.0, true).unwrap();
    let heard = heard.lock().unwrap();
    assert_eq!(heard.len(), 1 + 5000);
    assert!(
        heard[1].starts_with("message 0 ") && heard[5000].starts_with("message 4999 "),
        "{}",
        heard[5000]
    );
}

#[test]
fn after_its_end_nothing_is_called_and_everything_is_freed() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    let (mut it, heard) = misbehaving::started(&fmu, "ends");
    let _state = it.save().unwrap();
    let error = it.do_step(0.0, 7.0, true).unwrap_err();
    let ImportError::Ended { function, instance, how, log, .. } = &error else { panic!("{error}") };
    assert_eq!((*function, instance.as_str(), how.as_str()), ("fmi2DoStep", "ends", "called exit(3)"));
    assert!(log.last().is_some_and(|last| last.contains("last words")), "{log:?}");
    assert!(matches!(it.do_step(0.0, 1.0, true), Err(ImportError::Lost { .. })));
    assert!(matches!(it.terminate(), Err(ImportError::Lost { .. })));
    drop(it);
    assert_eq!(*heard.lock().unwrap(), ["initialization", "last words"]);
}

/// A call that sets goes with the next one; the error is that of the call that failed.
#[test]
fn a_set_that_fails_is_named_with_the_next_call() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    let (mut it, _) = misbehaving::started(&fmu, "sets");
    it.set_real(&[1], &[1.0]).unwrap();
    it.do_step(0.0, 1.0, true).unwrap();
    it.set_real(&[99], &[1.0]).unwrap();
    let error = it.do_step(0.0, 1.0, true).unwrap_err();
    assert!(error.to_string().contains("fmi2SetReal of instance \"sets\" returned Error"), "{error}");
    // The step was not made, and the next one is.
    it.do_step(0.0, 1.0, true).unwrap();
}

#[test]
fn large_arrays_go_through() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    let (mut it, _) = misbehaving::started(&fmu, "large");
    let references: Vec<u32> = (0..100_000).map(|i| i % 7).collect();
    let mut values = vec![0.0; references.len()];
    it.get_real(&references, &mut values).unwrap();
    assert!(values.iter().zip(&references).all(|(value, r)| *value == f64::from(*r) / 3.0));
}

/// What was read after a step comes with the next one: the same values as before, also when something else is requested.
#[test]
fn what_is_read_after_steps_is_right_whatever_is_asked() {
    let Some((_folder, fmu)) = fmu("it") else { return };
    let (mut it, _) = misbehaving::started(&fmu, "asked");
    let ask = |it: &mut trueup_fmi_import::fmi2::Fmi2Instance, references: &[u32]| {
        let mut values = vec![f64::NAN; references.len()];
        it.get_real(references, &mut values).unwrap();
        let expected: Vec<_> = references.iter().map(|r| f64::from(*r) / 3.0).collect();
        assert_eq!(values, expected);
    };
    let asked: [&[&[u32]]; 8] = [
        &[&[1], &[2, 3]],
        &[&[1], &[2, 3]],
        &[&[2, 3], &[1]],
        &[&[2, 3]],
        &[],
        &[&[2, 3], &[4], &[1]],
        &[&[4]],
        &[&[1], &[1]],
    ];
    for questions in asked {
        it.do_step(0.0, 1.0, true).unwrap();
        questions.iter().for_each(|references| ask(&mut it, references));
        it.set_real(&[1], &[2.0]).unwrap();
        questions.iter().for_each(|references| ask(&mut it, references));
        let mut flags = [false];
        it.get_boolean(&[0], &mut flags).unwrap();
        assert_eq!(flags, [true]);
    }
}
