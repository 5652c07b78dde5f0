//! Messages of a run when an FMU fails. `fault` of `hybrid.c` defines how.

use super::*;

fn fault(desk: &Path, fault: u32, step: f64) -> (Result<RunLog, CosimError>, SeriesMemory) {
    let toml = format!(
        "record = [\"it.*\"]\n[run]\nstop = 2.5\nstep = {step}\n[components.it]\nfmu = \"trouble.fmu\"\nstart = {{ fault = {fault} }}\n"
    );
    run(desk, &toml)
}

/// The message contains all of this, and the results before the fault are there.
#[track_caller]
fn says((result, memory): (Result<RunLog, CosimError>, SeriesMemory), at: f64, parts: &[&str]) {
    let error = result.unwrap_err().to_string();
    for part in parts {
        assert!(error.contains(part), "{part:?} is not in {error:?}");
    }
    let last = *memory.time().last().unwrap();
    assert!(last <= at + 1e-9 && last >= at - 0.26, "results end at {last} s");
}

#[test]
fn a_refused_derivative_makes_steps_shorter() {
    // x' = -sqrt(x), x(0) = 1: x = (1 - t/2)^2, until it stops at 1e-3; below 0 the FMU refuses.
    let Some(desk) = made() else { return };
    for step in [2.5, 0.1] {
        let (result, memory) = fault(desk.path(), 0, step);
        result.unwrap();
        let x = memory.column("it.x").unwrap();
        let exact = |t: f64| if t < 2.0 - 2.0 * 1e-3f64.sqrt() { (1.0 - 0.5 * t).powi(2) } else { 1e-3 };
        let errors = memory.time().iter().zip(x).map(|(t, x)| x - exact(*t));
        let [median, _, worst] = quantiles(errors);
        assert!(worst < 1e-8, "step {step} s: median {median:e}, worst {worst:e}");
    }
}

#[test]
fn a_derivative_that_is_refused_however_short_the_step_ends_the_run() {
    let Some(desk) = made() else { return };
    says(
        fault(desk.path(), 6, 0.25),
        0.5,
        &["\"it\"", "fmi2GetDerivatives", "Discard", "however short the step"],
    );
}

#[test]
fn a_derivative_that_is_not_finite_is_named() {
    let Some(desk) = made() else { return };
    says(fault(desk.path(), 1, 0.25), 0.5, &["t = 0.5", "der(x) of instance \"it\" is NaN"]);
}

#[test]
fn an_error_names_fmu_call_time_and_last_messages() {
    let Some(desk) = made() else { return };
    says(
        fault(desk.path(), 5, 0.25),
        0.5,
        &["fmi2GetDerivatives", "\"it\"", "Error", "no derivative beyond 0.5 s"],
    );
}

#[test]
fn events_without_end_name_fmu_and_indicator() {
    let Some(desk) = made() else { return };
    says(fault(desk.path(), 2, 0.25), 1.0, &["events do not end", "event indicator 1", "\"it\""]);
}

#[test]
fn time_events_that_never_move_on_are_found() {
    let Some(desk) = made() else { return };
    says(fault(desk.path(), 4, 0.25), 0.0, &["events do not end", "time event", "\"it\""]);
}

#[test]
fn an_event_iteration_without_end_names_the_fmu() {
    let Some(desk) = made() else { return };
    says(fault(desk.path(), 3, 0.25), 0.5, &["event iteration of instance \"it\" does not end"]);
}
