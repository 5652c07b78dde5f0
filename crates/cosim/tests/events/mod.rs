//! An event in one FMU ends the step of all: FMUs that stop where a closed form has it, compiled here from `stops.c`.
#![cfg(target_os = "linux")]

use std::fmt::Write as _;

use crate::compiled::compiled;
use trueup_cosim::system::CosimSystem;
use trueup_cosim::{Master, RunLog, SeriesMemory, check};
use trueup_fmi_description::FmiVersion;

/// What an FMU offers in addition to event mode.
#[derive(Clone, Copy)]
struct Offers {
    states: bool,
    any_step: bool,
    /// For Co-Simulation alone an FMU need not list event indicators, so that it is expected to stop.
    stops: bool,
}

const ALL: Offers = Offers { states: true, any_step: true, stops: true };

fn description(name: &str, offers: Offers) -> String {
    let Offers { states, any_step, stops } = offers;
    let variable = |reference: usize, name: &str, causality: &str, start: &str| {
        let variability = if causality == "parameter" { "fixed" } else { "continuous" };
        format!(
            "<Float64 name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\" variability=\"{variability}\" {start}/>"
        )
    };
    let exchange = if stops { "" } else { "<ModelExchange modelIdentifier=\"stops\"/>" };
    let mut variables = variable(0, "x", "output", "") + &variable(1, "count", "output", "");
    variables += &variable(2, "u", "input", "start=\"0\"");
    for (at, (name, start)) in
        [("rate", "1"), ("level", "1e9"), ("spacing", "1e9"), ("ahead", "0")].iter().enumerate()
    {
        variables += &variable(3 + at, name, "parameter", &format!("start=\"{start}\""));
    }
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="{name}" instantiationToken="t">{exchange}
<CoSimulation modelIdentifier="stops" hasEventMode="true" canHandleVariableCommunicationStepSize="{any_step}" canGetAndSetFMUState="{states}"/>
<ModelVariables>{variables}</ModelVariables><ModelStructure><Output valueReference="0"/><Output valueReference="1"/></ModelStructure>
</fmiModelDescription>"#
    )
}

/// Unpacked FMUs in a folder, by name; `None`, with a message, without a C compiler.
fn fmus(all: &[(&str, Offers)]) -> Option<tempfile::TempDir> {
    let folder = tempfile::tempdir().unwrap();
    for (name, offers) in all {
        let binaries = folder.path().join(name).join("binaries").join(FmiVersion::V3.platform());
        std::fs::create_dir_all(&binaries).unwrap();
        std::fs::write(folder.path().join(name).join("modelDescription.xml"), description(name, *offers))
            .unwrap();
        compiled("events/stops.c", &["-w"], &binaries.join("stops.so"))?;
    }
    Some(folder)
}

/// Runs FMUs of these names with start values, connected so, for 1 s with steps of 0.1 s; a row at both sides of events too.
fn run(
    folder: &tempfile::TempDir,
    algorithm: &str,
    connections: &[&str],
    starts: &[(&str, &str)],
) -> (SeriesMemory, RunLog) {
    run_with(folder, algorithm, "event-rows = true", connections, starts)
}

fn run_with(
    folder: &tempfile::TempDir,
    algorithm: &str,
    more: &str,
    connections: &[&str],
    starts: &[(&str, &str)],
) -> (SeriesMemory, RunLog) {
    let mut text = format!(
        "connections = {connections:?}\n[run]\nstop = 1.0\nstep = 0.1\nalgorithm = \"{algorithm}\"\n{more}\n"
    );
    for (name, start) in starts {
        let _ = writeln!(text, "[components.{name}]\nfmu = \"{name}\"\nstart = {{ {start} }}");
    }
    let file = folder.path().join("system.toml");
    std::fs::write(&file, text).unwrap();
    let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
    let mut results = SeriesMemory::default();
    let mut master = Master::new(plan).unwrap();
    if let Err(error) = master.run(&mut results) {
        panic!("{algorithm}: {error}");
    }
    (results, master.log().clone())
}

fn last(results: &SeriesMemory, name: &str) -> f64 {
    *results.column(name).unwrap().last().unwrap()
}

/// Times that have more than one row, and the value in each of these.
fn jumps(results: &SeriesMemory, name: &str) -> Vec<(f64, f64, f64)> {
    let (time, x) = (results.time(), results.column(name).unwrap());
    (1..time.len()).filter(|i| time[*i] == time[i - 1]).map(|i| (time[i], x[i - 1], x[i])).collect()
}

const SMALL: f64 = 1e-12;

/// The follower's rate is 1 + count, held: exact only if the follower stops where the count changes.
#[test]
fn the_other_sees_the_event_when_it_happens() {
    let Some(folder) = fmus(&[("stops", ALL), ("follows", Offers { stops: false, ..ALL })]) else { return };
    for algorithm in ["jacobi", "extrapolate", "gauss-seidel"] {
        let starts = [("follows", ""), ("stops", "rate = 3, level = 1, spacing = 1")];
        let (results, log) = run(&folder, algorithm, &["stops.count -> follows.u"], &starts);
        let at = jumps(&results, "stops.count");
        assert_eq!(at.len(), 2, "{algorithm}: {at:?}"); // and the third at the end itself
        for ((time, before, after), k) in at.iter().zip([1.0, 2.0]) {
            assert!((time - k / 3.0).abs() < SMALL, "{algorithm}: {time}");
            assert_eq!((*before, *after), (k - 1.0, k));
        }
        assert!((last(&results, "follows.x") - (1.0 + 2.0 / 3.0 + 1.0 / 3.0)).abs() < SMALL, "{algorithm}");
        assert_eq!((log.steps, log.events), (12, 3), "{algorithm}");
        let off = |notes: &[String]| notes.iter().any(|n| n.contains("learn") || n.contains("go back"));
        assert!(!off(&log.notes), "{:?}", log.notes);
    }
}

/// Unless they are requested there are no rows between the communication points.
#[test]
fn rows_stay_at_the_points() {
    let Some(folder) = fmus(&[("stops", ALL), ("follows", Offers { stops: false, ..ALL })]) else { return };
    let starts = [("follows", ""), ("stops", "rate = 3, level = 1, spacing = 1")];
    let connections = ["stops.count -> follows.u"];
    let (whole, _) = run(&folder, "extrapolate", &connections, &starts);
    let (points, _) = run_with(&folder, "extrapolate", "", &connections, &starts);
    assert_eq!((points.time().len(), whole.time().len()), (11, 15));
    for name in ["stops.count", "follows.x"] {
        let (all, some) = (whole.column(name).unwrap(), points.column(name).unwrap());
        let at = |time: &f64| whole.time().iter().position(|t| t == time).unwrap();
        assert!(points.time().iter().zip(some).all(|(time, x)| all[at(time)] == *x), "{name}");
    }
}

/// Two stop in the same step, the one that steps first later than the other.
#[test]
fn who_is_ahead_goes_back() {
    let (late, soon) = ("level = 0.27", "level = 0.23");
    let all = [("first", ALL), ("second", ALL), ("follows", Offers { stops: false, ..ALL })];
    let Some(folder) = fmus(&all) else { return };
    for (algorithm, starts) in ["jacobi", "gauss-seidel", "extrapolate"].into_iter().flat_map(|a| {
        let orders = [[("first", late), ("second", soon)], [("first", soon), ("second", late)]];
        orders.map(|[a, b]| [a, b, ("follows", "")]).map(|starts| (a, starts))
    }) {
        let connections = ["second.count -> first.u", "first.count -> follows.u"];
        let (results, _) = run(&folder, algorithm, &connections, &starts);
        // After the second one has stopped, the first goes twice as fast.
        let (second, first) = if starts[1].1 == soon { (0.23, 0.25) } else { (0.27, 0.23) };
        let times: Vec<f64> = jumps(&results, "first.x").iter().map(|(time, ..)| *time).collect();
        let mut expected = [first, second];
        expected.sort_by(f64::total_cmp);
        assert_eq!(times.len(), 2, "{algorithm}: {times:?}");
        assert!(times.iter().zip(expected).all(|(t, e)| (t - e).abs() < SMALL), "{algorithm}: {times:?}");
        assert!((last(&results, "first.x") - (1.0 + (1.0 - second))).abs() < SMALL, "{algorithm}");
        assert!((last(&results, "follows.x") - (1.0 + (1.0 - first))).abs() < SMALL, "{algorithm}");
    }
}

/// Units that cannot go back go first; if another stops behind one, that is reported, and by how much.
#[test]
fn who_cannot_go_back_is_named() {
    let all = [("rigid", Offers { states: false, ..ALL }), ("stops", ALL)];
    let Some(folder) = fmus(&all) else { return };
    let starts = [("stops", "level = 0.23"), ("rigid", "")];
    let (results, log) = run(&folder, "jacobi", &["stops.count -> rigid.u"], &starts);
    let note = log.notes.iter().find(|n| n.contains("rigid"));
    let note = note.unwrap_or_else(|| panic!("{:?}", log.notes));
    assert!(
        note.contains("canGetAndSetFMUState") && note.contains("0.07 s") && note.contains("1 times"),
        "{note}"
    );
    // It learns of the event where it is already.
    assert!((last(&results, "rigid.x") - (0.3 + 2.0 * 0.7)).abs() < SMALL);
    assert!(jumps(&results, "stops.count").iter().all(|(time, ..)| (time - 0.23).abs() < SMALL));
}

#[test]
fn equal_steps_are_kept_and_said() {
    let all = [("equal", Offers { any_step: false, ..ALL }), ("stops", ALL)];
    let Some(folder) = fmus(&all) else { return };
    let starts = [("stops", "level = 0.23"), ("equal", "")];
    let (results, log) = run(&folder, "jacobi", &["stops.count -> equal.u"], &starts);
    assert!(
        log.notes.iter().any(|n| n.contains("next communication point") && n.contains("equal")),
        "{:?}",
        log.notes
    );
    assert_eq!((results.time().len(), log.events), (11, 0));
    assert!((last(&results, "equal.x") - (0.3 + 2.0 * 0.7)).abs() < SMALL);
}

/// An input that comes to a level, x + u >= level with u = t^2 handed on: followed on lines, held in parts, and yet located.
#[test]
fn an_event_of_a_moving_input_is_located() {
    let Some(folder) = fmus(&[("stops", ALL), ("drives", Offers { stops: false, ..ALL })]) else { return };
    for algorithm in ["extrapolate", "gauss-seidel", "jacobi"] {
        let starts = [("stops", "rate = 1e-9, ahead = 1, level = 0.733"), ("drives", "rate = 2")];
        let (results, _) = run(&folder, algorithm, &["drives.x -> stops.u"], &starts);
        let at = jumps(&results, "stops.count");
        let when = 0.733 / (2.0 + 1e-9);
        let (time, ..) = at
            .iter()
            .find(|(_, before, after)| before != after)
            .unwrap_or_else(|| panic!("{algorithm}: {at:?}"));
        match algorithm {
            // Held inputs show it at the next point.
            "jacobi" => assert!((0.0..0.1).contains(&(time - when)), "{time}"),
            _ => assert!((time - when).abs() < 1e-9, "{algorithm}: {time}, and it is at {when}"),
        }
    }
}
