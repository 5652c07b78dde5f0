//! Every refusal: the status, a message that names variable and remedy, nothing taken, the instance usable.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]
use crate::common::*;
use core::ptr::{null, null_mut};
use trueup_fmi::abi::fmi2::*;
use trueup_fmi::abi::fmi3::*;

/// The call was refused with Error and a message that holds all these words.
#[track_caller]
fn refused(journal: &Journal, status: i32, words: &[&str]) {
    assert_eq!(status, 3);
    told(journal, 3, words);
}
#[track_caller]
fn told(journal: &Journal, status: i32, words: &[&str]) {
    let (logged, text) = journal.last();
    assert_eq!(logged, status, "{text}");
    assert!(words.iter().all(|w| text.contains(w)), "{text:?} lacks one of {words:?}");
}

#[test]
fn values_of_fmi2() {
    let journal = Journal::default();
    let j = &journal;
    let c = new2(j, fmi2ModelExchange);
    unsafe {
        refused(j, set2(c, 99, 1.0).0, &["fmi2SetReal", "unknown value reference 99", "0 to 27"]);
        refused(j, set2(c, vr::RESTITUTION, 1.5).0, &["restitution", "1.5", "at most 1"]);
        refused(j, set2(c, vr::STIFFNESS + 1, 0.0).0, &["stiffness[2]", "above 0"]);
        refused(j, set2(c, vr::STIFFNESS + 1, -4.0).0, &["stiffness[2]", "-4", "above 0"]);
        refused(j, set2(c, vr::FORCE, f64::NAN).0, &["force", "NaN", "finite"]);
        refused(j, set2(c, vr::FORCE, f64::INFINITY).0, &["force", "inf", "finite"]);
        refused(j, set2(c, vr::LAW, 1.0).0, &["law", "fmi2SetInteger"]);
        refused(j, fmi2SetInteger(c, &vr::LAW, 1, &3).0, &["law", "1 = linear", "2 = cubic"]);
        refused(j, fmi2SetInteger(c, &vr::GRAVITY, 1, &3).0, &["gravity", "fmi2SetReal"]);
        refused(j, fmi2SetBoolean(c, &vr::ENABLE, 1, &7).0, &["enable", "7", "0 or 1"]);
        refused(j, set2(c, vr::HEIGHT, 1.0).0, &["height", "computed"]);
        refused(j, set2(c, vr::STATE, 1.0).0, &["state", "computed"]);
        refused(j, set2(c, vr::TIME, 1.0).0, &["time", "independent"]);
        refused(j, fmi2SetString(c, &vr::GRAVITY, 1, &null()).0, &["gravity", "fmi2SetReal"]);
        refused(j, fmi2SetReal(c, null(), 1, &1.0).0, &["vr is NULL"]);
        refused(j, fmi2SetReal(c, &vr::GRAVITY, 1, null()).0, &["value is NULL"]);
        // All or nothing: the second value is bad, so the first one is not taken.
        let refs = [vr::GRAVITY, vr::RESTITUTION];
        refused(j, fmi2SetReal(c, refs.as_ptr(), 2, [1.0, -1.0].as_ptr()).0, &["restitution", "at least 0"]);
        assert_eq!(fmi2EnterInitializationMode(c), fmi2OK);
        assert_eq!((get2(c, vr::GRAVITY), get2(c, vr::RESTITUTION)), (9.81, 0.7));
        assert_eq!(fmi2SetReal(c, null(), 0, null()), fmi2OK);
        refused(j, fmi2GetReal(c, null(), 1, &mut 0.0).0, &["NULL"]);
        refused(j, fmi2GetInteger(c, &vr::HEIGHT, 1, &mut 0).0, &["height", "fmi2GetReal"]);
        refused(j, fmi2GetReal(c, &28, 1, &mut 0.0).0, &["unknown value reference 28"]);
        fmi2FreeInstance(c);
    }
}

/// The format of FMI 2.0 is the message itself; what formats and "#r12#" are made of is doubled in it.
#[test]
fn messages_of_fmi2_can_be_read_without_formatting() {
    let journal = Journal::default();
    let c = new2(&journal, fmi2CoSimulation);
    unsafe {
        let category = c"50 %s #r1#".as_ptr();
        refused(&journal, fmi2SetDebugLogging(c, 1, 1, &category).0, &["50 %%s ##r1##", "logEvents"]);
        fmi2FreeInstance(c);
    }
}

#[test]
fn values_of_fmi3() {
    let journal = Journal::default();
    let j = &journal;
    let c = new3_me(j);
    unsafe {
        refused(j, set3(c, vr::STIFFNESS, &[1.0]).0, &["1 values", "2 elements"]);
        refused(j, set3(c, vr::STIFFNESS, &[1.0, 1.0, 1.0]).0, &["3 values", "2 elements"]);
        refused(j, set3(c, vr::STIFFNESS + 1, &[1.0]).0, &["inside the array `stiffness`", "by 3"]);
        refused(j, set3(c, vr::STIFFNESS, &[1.0, -1.0]).0, &["stiffness[2]", "above 0"]);
        refused(j, set3(c, vr::INDICATOR, &[1.0]).0, &["event indicators", "cannot be set"]);
        refused(j, set3(c, vr::INDICATOR + 1, &[1.0]).0, &["unknown value reference 29"]);
        refused(j, fmi3SetFloat32(c, &vr::GRAVITY, 1, &1.0, 1).0, &["gravity", "fmi3SetFloat64"]);
        refused(j, fmi3SetInt32(c, &vr::LAW, 1, &1, 1).0, &["law", "fmi3SetInt64"]);
        refused(j, fmi3GetUInt8(c, &vr::TRAP, 1, &mut 0, 1).0, &["trap", "fmi3GetInt32"]);
        refused(j, fmi3SetInt64(c, &vr::LAW, 1, &0, 1).0, &["law", "1 = linear"]);
        refused(j, fmi3GetFloat64(c, &vr::STIFFNESS, 1, &mut 0.0, 1).0, &["1 values", "2 elements"]);
        refused(j, fmi3GetFloat64(c, &vr::STIFFNESS, 1, null_mut(), 2).0, &["values is NULL"]);
        refused(j, fmi3GetClock(c, &vr::FORCE, 1, &mut { fmi3False }).0, &["no clocks"]);
        refused(
            j,
            fmi3GetBinary(c, &vr::FORCE, 1, null_mut(), null_mut(), 0).0,
            &["force", "fmi3GetFloat64"],
        );
        assert_eq!(get3::<2>(c, vr::STIFFNESS), [4.0, 0.1]);
        assert_eq!(fmi3SetInt64(c, &vr::LAW, 1, &2, 1), fmi3OK);
        let mut law = 0;
        assert_eq!(fmi3GetInt64(c, &vr::LAW, 1, &mut law, 1), fmi3OK);
        assert_eq!(law, 2);
        fmi3FreeInstance(c);
    }
}

#[test]
fn order_of_calls() {
    let journal = Journal::default();
    let j = &journal;
    let c = new2(j, fmi2ModelExchange);
    unsafe {
        refused(
            j,
            fmi2ExitInitializationMode(c).0,
            &["fmi2ExitInitializationMode", "instantiated", "initialization mode"],
        );
        refused(j, fmi2GetReal(c, &vr::HEIGHT, 1, &mut 0.0).0, &["not allowed", "instantiated"]);
        refused(j, fmi2DoStep(c, 0.0, 0.1, 1).0, &["Co-Simulation", "Model Exchange"]);
        refused(j, fmi2GetDerivatives(c, [0.0; 5].as_mut_ptr(), 5).0, &["instantiated"]);
        refused(j, fmi2Terminate(c).0, &["instantiated"]);
        init2(c, 1e-6);
        refused(j, fmi2EnterInitializationMode(c).0, &["event mode"]);
        refused(j, set2(c, vr::INITIAL_HEIGHT, 2.0).0, &["initialHeight", "fixed", "reset"]);
        assert_eq!(set2(c, vr::GRAVITY, 9.0), fmi2OK);
        refused(
            j,
            fmi2SetContinuousStates(c, [0.0; 5].as_ptr(), 5).0,
            &["event mode", "continuous-time mode"],
        );
        assert_eq!(fmi2EnterContinuousTimeMode(c), fmi2OK);
        refused(j, set2(c, vr::GRAVITY, 8.0).0, &["gravity", "event mode"]);
        refused(j, fmi2SetBoolean(c, &vr::ENABLE, 1, &0).0, &["enable", "event mode"]);
        refused(j, fmi2SetContinuousStates(c, [0.0; 4].as_ptr(), 4).0, &["4 values", "5 states"]);
        refused(j, fmi2GetEventIndicators(c, [0.0; 2].as_mut_ptr(), 2).0, &["1 event indicators"]);
        refused(j, fmi2NewDiscreteStates(c, &mut fmi2EventInfo::default()).0, &["continuous-time mode"]);
        refused(j, fmi2SetTime(c, f64::NAN).0, &["time", "finite"]);
        refused(j, fmi2SetTime(c, -1.0).0, &["before the start time"]);
        refused(j, fmi2CompletedIntegratorStep(c, 1, null_mut(), &mut 0).0, &["enterEventMode is NULL"]);
        // A solver's trial is discarded.
        let trial = [0.0, f64::NAN, 0.0, 0.0, 0.0];
        assert_eq!(fmi2SetContinuousStates(c, trial.as_ptr(), 5), fmi2Discard);
        told(j, 2, &["state[2]", "NaN", "smaller step"]);
        assert_eq!(fmi2EnterEventMode(c), fmi2OK);
        assert_eq!(fmi2SetInteger(c, &vr::TRAP, 1, &3), fmi2OK);
        assert_eq!(fmi2GetDerivatives(c, [0.0; 5].as_mut_ptr(), 5), fmi2Discard);
        told(j, 2, &["rate[1]", "NaN"]);
        assert_eq!(fmi2SetInteger(c, &vr::TRAP, 1, &0), fmi2OK);
        assert_eq!(fmi2GetDerivatives(c, [0.0; 5].as_mut_ptr(), 5), fmi2OK);
        assert_eq!(fmi2Terminate(c), fmi2OK);
        assert_eq!(get2(c, vr::GRAVITY), 9.0);
        refused(j, fmi2SetTime(c, 1.0).0, &["terminated"]);
        // Everything starts again after a reset.
        assert_eq!(fmi2Reset(c), fmi2OK);
        init2(c, 1e-6);
        assert_eq!((get2(c, vr::GRAVITY), get2(c, vr::RESTITUTION), get2(c, vr::HEIGHT)), (9.81, 0.7, 1.0));
        fmi2FreeInstance(c);
    }
}

#[test]
fn parameters_that_contradict_each_other() {
    let journal = Journal::default();
    let j = &journal;
    let c = simple3_cs(j);
    unsafe {
        assert_eq!(set3(c, vr::STIFFNESS, &[999.0, 2.0]), fmi3OK);
        assert_eq!(fmi3EnterInitializationMode(c, fmi3False, 0.0, 0.0, fmi3False, 0.0), fmi3OK);
        refused(j, fmi3ExitInitializationMode(c).0, &["stiffness[2]", "must not exceed 1000", "lower"]);
        assert_eq!(set3(c, vr::STIFFNESS, &[99.0, 2.0]), fmi3OK);
        assert_eq!(fmi3ExitInitializationMode(c), fmi3OK);
        assert_eq!(set3(c, vr::STIFFNESS, &[999.0, 2.0]), fmi3OK);
        refused(j, step3(c, 0.0, 0.1).0.0, &["fmi3DoStep", "stiffness[2]"]);
        assert_eq!(set3(c, vr::STIFFNESS, &[9.0, 2.0]), fmi3OK);
        assert_eq!(step3(c, 0.0, 0.1).0, fmi3OK);
        fmi3FreeInstance(c);
    }
}

#[test]
fn a_parameter_follows_another_one_until_it_is_set() {
    let journal = Journal::default();
    let c = new3_me(&journal);
    assert_eq!(set3(c, vr::INITIAL_HEIGHT, &[3.0]), fmi3OK);
    assert_eq!(get3::<1>(c, vr::INITIAL_SWING), [3.0]);
    assert_eq!(get3::<5>(c, vr::STATE)[..3], [3.0, 0.0, 3.0]);
    assert_eq!(set3(c, vr::INITIAL_SWING, &[5.0]), fmi3OK);
    assert_eq!(set3(c, vr::INITIAL_HEIGHT, &[4.0]), fmi3OK);
    init3(c, 1e-6);
    assert_eq!(get3::<5>(c, vr::STATE)[..3], [4.0, 0.0, 5.0]);
    assert_eq!(unsafe { fmi3Reset(c) }, fmi3OK);
    assert_eq!(get3::<1>(c, vr::INITIAL_SWING), [1.0]);
    unsafe { fmi3FreeInstance(c) };
}

#[test]
fn steps() {
    let journal = Journal::default();
    let j = &journal;
    let c = simple3_cs(j);
    unsafe {
        assert_eq!(fmi3EnterInitializationMode(c, fmi3True, 0.0, 0.0, fmi3False, 0.0), fmi3Error);
        told(j, 3, &["tolerance", "above 0"]);
        assert_eq!(fmi3EnterInitializationMode(c, fmi3False, 0.0, 1.0, fmi3True, 0.5), fmi3Error);
        told(j, 3, &["stopTime", "before"]);
        assert_eq!(fmi3EnterInitializationMode(c, fmi3False, 0.0, 1.0, fmi3True, 2.0), fmi3OK);
        assert_eq!(fmi3ExitInitializationMode(c), fmi3OK);
        refused(j, step3(c, 0.5, 0.1).0.0, &["currentCommunicationPoint = 0.5", "1.0"]);
        refused(j, step3(c, f64::NAN, 0.1).0.0, &["currentCommunicationPoint"]);
        for h in [0.0, -0.1, f64::NAN, f64::INFINITY] {
            refused(j, step3(c, 1.0, h).0.0, &["communicationStepSize", "greater than 0"]);
        }
        refused(j, step3(c, 1.0, 1.5).0.0, &["2.5", "stop time 2.0"]);
        refused(j, fmi3EnterEventMode(c).0, &["eventModeUsed"]);
        refused(j, fmi3EnterStepMode(c).0, &["step mode"]);
        refused(j, fmi3GetContinuousStates(c, [0.0; 5].as_mut_ptr(), 5).0, &["Model Exchange"]);
        let n = null_mut();
        refused(
            j,
            fmi3DoStep(c, 1.0, 0.1, fmi3True, n, n, n, null_mut()).0,
            &["eventHandlingNeeded is NULL"],
        );
        assert_eq!(step3(c, 1.0, 1.0), (fmi3OK, false, false, 2.0));
        refused(j, step3(c, 2.0, 0.1).0.0, &["stop time"]);
        fmi3FreeInstance(c);
        let c = new2(j, fmi2CoSimulation);
        refused(j, fmi2CancelStep(c).0, &["nothing to cancel"]);
        init2(c, 1e-6);
        for status in [
            fmi2GetStatus(c, fmi2DoStepStatus, &mut { fmi2OK }),
            fmi2GetIntegerStatus(c, fmi2PendingStatus, &mut 0),
            fmi2GetStringStatus(c, fmi2PendingStatus, &mut null()),
            fmi2GetRealStatus(c, fmi2StatusKind(77), &mut 0.0),
        ] {
            assert_eq!(status, fmi2Discard);
        }
        let mut ended = 7;
        assert_eq!(fmi2GetBooleanStatus(c, fmi2Terminated, &mut ended), fmi2OK);
        assert_eq!(ended, fmi2False);
        fmi2FreeInstance(c);
    }
}

#[test]
fn instantiation() {
    let journal = Journal::default();
    let j = &journal;
    let callbacks = callbacks2(j);
    unsafe {
        let make = |name, kind, guid| fmi2Instantiate(name, kind, guid, null(), &callbacks, 0, 1);
        let (name, guid) = (c"probe".as_ptr(), c"probe-1".as_ptr());
        assert!(make(name, fmi2CoSimulation, c"{other}".as_ptr()).is_null());
        told(j, 3, &["fmuGUID", "{other}", "probe-1", "different FMUs"]);
        assert!(make(name, fmi2CoSimulation, null()).is_null());
        told(j, 3, &["fmuGUID is NULL"]);
        assert!(make(name, fmi2Type(9), guid).is_null());
        told(j, 3, &["fmuType = 9"]);
        assert!(fmi2Instantiate(name, fmi2CoSimulation, guid, null(), null(), 0, 1).is_null());
        let log = Some(log3 as unsafe extern "C" fn(_, _, _, _));
        let (no, yes) = (fmi3False, fmi3True);
        assert!(
            fmi3InstantiateModelExchange(c"".as_ptr(), guid, null(), no, yes, j.environment(), log).is_null()
        );
        told(j, 3, &["instanceName"]);
        assert!(
            fmi3InstantiateScheduledExecution(
                name,
                guid,
                null(),
                no,
                yes,
                j.environment(),
                log,
                None,
                None,
                None
            )
            .is_null()
        );
        told(j, 3, &["Scheduled Execution"]);
        let required = [77u32];
        assert!(
            fmi3InstantiateCoSimulation(
                name,
                guid,
                null(),
                no,
                yes,
                no,
                no,
                required.as_ptr(),
                1,
                j.environment(),
                log,
                None
            )
            .is_null()
        );
        told(j, 3, &["unknown value reference 77"]);
        // Nothing is logged while logging is off; no callback at all is legal too.
        let c = fmi3InstantiateModelExchange(name, guid, null(), no, no, j.environment(), log);
        assert_eq!(fmi3Terminate(c), fmi3Error);
        assert!(j.take().is_empty());
        let categories = [c"logStatusError".as_ptr(), c"nonsense".as_ptr()];
        assert_eq!(fmi3SetDebugLogging(c, yes, 1, categories.as_ptr()), fmi3OK);
        refused(j, fmi3SetDebugLogging(c, yes, 2, categories.as_ptr()).0, &["nonsense", "logEvents"]);
        fmi3FreeInstance(c);
        let c = fmi3InstantiateModelExchange(name, guid, null(), no, yes, null_mut(), None);
        assert_eq!(fmi3Terminate(c), fmi3Error);
        fmi3FreeInstance(c);
    }
}

#[test]
fn pointers_that_are_no_instances() {
    unsafe {
        let foreign = [7u64; 16];
        let foreign = foreign.as_ptr().cast_mut().cast();
        let journal = Journal::default();
        let freed = new3_me(&journal);
        fmi3FreeInstance(freed);
        for c in [null_mut(), foreign, freed] {
            assert_eq!(fmi3GetFloat64(c, &vr::HEIGHT, 1, &mut 0.0, 1), fmi3Error);
            assert_eq!(fmi2GetReal(c, &vr::HEIGHT, 1, &mut 0.0), fmi2Error);
            assert_eq!(step3(c, 0.0, 1.0).0, fmi3Error);
            fmi3FreeInstance(c);
            fmi2FreeInstance(c);
        }
    }
}

#[test]
fn a_panic_is_fatal_and_stays_inside() {
    let journal = Journal::default();
    let j = &journal;
    let c = simple3_cs(j);
    unsafe {
        init3(c, 1e-6);
        assert_eq!(fmi3SetInt32(c, &vr::TRAP, 1, &1, 1), fmi3OK);
        assert_eq!(step3(c, 0.0, 0.1).0, fmi3Fatal);
        told(j, 4, &["fmi3DoStep", "the trap snapped", "free it"]);
        assert_eq!(fmi3GetFloat64(c, &vr::HEIGHT, 1, &mut 0.0, 1), fmi3Fatal);
        assert_eq!(fmi3Reset(c), fmi3Fatal);
        fmi3FreeInstance(c);
    }
}
