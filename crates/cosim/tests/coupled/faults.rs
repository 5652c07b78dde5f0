//! Every fault of an FMU within the process, in a coupled run, by version of FMI and algorithm: the message to the user, and
//! what is kept. What breaks the process itself (a crash, `exit`, a hang) is not caught: docs/faults.md.

use trueup_cosim::{CosimError, Master, Results, check, system::CosimSystem};
use trueup_fmi_import::FmiStatus;
use trueup_testkit::{BlockVersion, problems};

use super::{Bench, Run};

// As in tests/kit/c/block.h.
const WARNING: u32 = 1;
const DISCARD: u32 = 2;
const ERROR: u32 = 3;
const FATAL: u32 = 4;
const NOT_A_NUMBER: u32 = 5;
const INFINITE: u32 = 6;
const FINE_STEPS: u32 = 7;
const TERMINATE: u32 = 8;
const HALFWAY: u32 = 9;
const GET_FAILS: u32 = 10;
const SET_FAILS: u32 = 11;
const SAVE_FAILS: u32 = 12;
const RESTORE_FAILS: u32 = 13;
const ENTER_FAILS: u32 = 14;
const EXIT_FAILS: u32 = 15;
const TERMINATE_FAILS: u32 = 16;

const ALGORITHMS: [&str; 5] = ["jacobi", "gauss-seidel", "extrapolate", "iterative", "adaptive"];

fn faulty(bench: &Bench, algorithm: &str, fault: u32, time: f64) -> Run {
    let run = format!("algorithm = \"{algorithm}\"\nstop = 1\nstep = 0.01\ntolerance = 1e-4");
    bench.run_from(&run, &[("right", &format!("fault = {fault}, faultTime = {time:?}"))])
}

/// The error, after looking at what every error must say and what must be left.
#[track_caller]
fn failed(it: &Run, what: &str, call: &str, time: f64) -> String {
    let said = it.outcome.as_ref().err().unwrap_or_else(|| panic!("{what}: ended well")).to_string();
    let words = ["right", call, "fault "];
    assert!(words.iter().all(|w| said.contains(w)), "{what}: {said}");
    let at: f64 = said.split("t = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    // A return to an earlier time is reported with that time.
    let earliest = if call.contains("SetFMU") { time - 0.1 } else { time - 1e-9 };
    assert!((earliest..time + 0.05).contains(&at), "{what}: {said}");
    // Rows up to the fault are kept, and none after it.
    let kept = it.results.time();
    assert!(kept.iter().all(|t| *t <= at + 1e-9), "{what}: rows beyond {at}");
    assert!(time == 0.0 || kept.last().is_some_and(|t| *t > time - 0.1), "{what}: {:?}", kept.last());
    assert!(it.results.series().iter().flatten().all(|x| x.is_finite()), "{what}");
    said
}

fn everywhere(mut test: impl FnMut(&Bench, &str, BlockVersion)) {
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::two_mass(), version) else { return };
        ALGORITHMS.iter().for_each(|algorithm| test(&bench, algorithm, version));
    }
}

fn function(version: BlockVersion, two: &'static str, three: &'static str) -> &'static str {
    if version == BlockVersion::Two { two } else { three }
}

#[test]
fn error_and_fatal_end_the_run() {
    everywhere(|bench, algorithm, version| {
        for (fault, status) in [(ERROR, FmiStatus::Error), (FATAL, FmiStatus::Fatal)] {
            let it = faulty(bench, algorithm, fault, 0.5);
            let what = format!("{version:?} {algorithm} {status:?}");
            let said = failed(&it, &what, function(version, "fmi2DoStep", "fmi3DoStep"), 0.5);
            assert!(said.contains(&format!("{status:?}")), "{what}: {said}");
            let Some(CosimError::Call { source, .. }) = it.outcome.err() else { panic!("{what}: {said}") };
            assert_eq!(source.status(), Some(status), "{what}");
        }
    });
}

#[test]
fn a_warning_does_not() {
    everywhere(|bench, algorithm, version| {
        let [it, healthy] = [WARNING, 0].map(|fault| faulty(bench, algorithm, fault, 0.5));
        assert!(it.outcome.is_ok(), "{version:?} {algorithm}: {:?}", it.outcome);
        assert_eq!(it.results, healthy.results, "{version:?} {algorithm}");
    });
}

#[test]
fn discard_shrinks_the_step_and_ends_the_run_when_nothing_helps() {
    everywhere(|bench, algorithm, version| {
        let what = format!("{version:?} {algorithm}");
        let said = failed(&faulty(bench, algorithm, DISCARD, 0.5), &what, "doStep", 0.5);
        assert!(said.contains("Discard"), "{what}: {said}");
    });
}

#[test]
fn shorter_steps_are_found() {
    everywhere(|bench, algorithm, version| {
        let expected = bench.problem().exact(1.0, &["left.x1", "right.x2"]).unwrap();
        let error = |it: &Run| it.error(&[("left.x1", expected[0]), ("right.x2", expected[1])]);
        let healthy = error(&faulty(bench, algorithm, 0, 0.5));
        for fault in [FINE_STEPS, HALFWAY] {
            let it = faulty(bench, algorithm, fault, 0.5);
            let what = format!("{version:?} {algorithm} {fault}");
            assert!(it.outcome.is_ok(), "{what}: {:?}", it.outcome);
            assert!(version == BlockVersion::Three || it.log.discarded > 0, "{what}: nothing was discarded");
            // Nothing is lost by it but rounding, and what the parts of a step make of held inputs.
            let found = error(&it);
            assert!(found < 1.1 * healthy + 1e-9, "{what}: {found:e}, undisturbed {healthy:e}");
        }
    });
}

#[test]
fn values_that_are_not_finite_end_the_run_with_the_variable() {
    everywhere(|bench, algorithm, version| {
        for (fault, value) in [(NOT_A_NUMBER, "NaN"), (INFINITE, "-inf")] {
            let it = faulty(bench, algorithm, fault, 0.5);
            let what = format!("{version:?} {algorithm} {value}");
            let Some(CosimError::NotFinite { time, instance, variable, .. }) = it.outcome.as_ref().err()
            else {
                panic!("{what}: {:?}", it.outcome)
            };
            assert_eq!((instance.as_str(), variable.as_str()), ("right", "F"), "{what}");
            assert!((0.5 - 1e-9..0.55).contains(time), "{what}: {time}");
            let said = it.outcome.unwrap_err().to_string();
            assert!(said.contains(&format!("is {value}")), "{said}");
            assert!(it.results.series().iter().flatten().all(|x| x.is_finite()), "{what}");
            assert!(it.results.time().len() > 2, "{what}");
        }
    });
}

#[test]
fn an_fmu_may_end_the_run() {
    everywhere(|bench, algorithm, version| {
        let it = faulty(bench, algorithm, TERMINATE, 0.5);
        let what = format!("{version:?} {algorithm}");
        assert!(it.outcome.is_ok(), "{what}: {:?}", it.outcome);
        assert_eq!(it.log.terminated_by.as_deref(), Some("right"), "{what}");
        assert!((0.5 - 1e-9..0.55).contains(&it.log.time), "{what}: {}", it.log.time);
    });
}

#[test]
fn getting_and_setting_may_fail() {
    everywhere(|bench, algorithm, version| {
        let names = [("fmi2GetReal", "fmi3GetFloat64"), ("fmi2SetReal", "fmi3SetFloat64")];
        for (fault, (two, three)) in [GET_FAILS, SET_FAILS].into_iter().zip(names) {
            let it = faulty(bench, algorithm, fault, 0.5);
            let what = format!("{version:?} {algorithm} {fault}");
            failed(&it, &what, function(version, two, three), 0.5);
        }
    });
}

#[test]
fn states_may_fail_to_be_saved_and_restored() {
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::two_mass(), version) else { return };
        for algorithm in ["iterative", "adaptive"] {
            let names = [("fmi2GetFMUstate", "fmi3GetFMUState"), ("fmi2SetFMUstate", "fmi3SetFMUState")];
            for (fault, (two, three)) in [SAVE_FAILS, RESTORE_FAILS].into_iter().zip(names) {
                let it = faulty(&bench, algorithm, fault, 0.5);
                let what = format!("{version:?} {algorithm} {fault}");
                failed(&it, &what, function(version, two, three), 0.5);
            }
        }
    }
}

#[test]
fn initialization_may_fail() {
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::two_mass(), version) else { return };
        for (fault, call) in
            [(ENTER_FAILS, "EnterInitializationMode"), (EXIT_FAILS, "ExitInitializationMode")]
        {
            let it = faulty(&bench, "jacobi", fault, 0.0);
            failed(&it, &format!("{version:?} {fault}"), call, 0.0);
            assert!(it.results.time().is_empty());
        }
    }
}

/// The results are whole; the error at the end is reported all the same.
#[test]
fn terminate_may_fail() {
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::two_mass(), version) else { return };
        let it = faulty(&bench, "jacobi", TERMINATE_FAILS, 0.0);
        let said = it.outcome.as_ref().err().map(ToString::to_string).unwrap_or_default();
        assert!(["right", "Terminate", "t = 1 s"].iter().all(|w| said.contains(w)), "{version:?}: {said}");
        assert_eq!(it.results.time().len(), 101);
    }
}

#[test]
fn an_fmu_may_refuse_to_be_instantiated() {
    for version in BlockVersion::ALL {
        let mut problem = problems::two_mass();
        problem.blocks[1].name = "refuses".into();
        problem.connections.iter_mut().for_each(|(a, b)| {
            [a, b].into_iter().for_each(|x| *x = x.replace("right.", "refuses."));
        });
        let Some(bench) = Bench::new(problem, version) else { return };
        let file = bench.folder.path().join("system.toml");
        std::fs::write(&file, bench.toml("stop = 1", &[])).unwrap();
        let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
        let said = Master::new(plan).err().unwrap().to_string();
        assert!(said.contains("refuses") && said.contains("no instance"), "{said}");
    }
}

/// What was computed is in a file whose name shows that it is not whole.
#[test]
fn results_are_kept_and_marked() {
    let Some(bench) = Bench::new(problems::two_mass(), BlockVersion::Two) else { return };
    for (name, algorithm) in [("run.csv", "extrapolate"), ("run.parquet", "adaptive")] {
        let file = bench.folder.path().join("system.toml");
        let run = format!("algorithm = \"{algorithm}\"\nstop = 1\nstep = 0.01");
        std::fs::write(&file, bench.toml(&run, &[("right", "fault = 3, faultTime = 0.5")])).unwrap();
        let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
        let target = bench.folder.path().join(name);
        let mut results = Results::create(&target).unwrap();
        assert!(Master::new(plan).unwrap().run(&mut results).is_err());
        let kept = results.keep_partial().unwrap().unwrap();
        assert!(kept.to_string_lossy().contains("partial") && kept.is_file() && !target.exists(), "{kept:?}");
    }
}
