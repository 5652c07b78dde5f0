//! Coupled FMUs against exact solutions: how large the error of each algorithm is, and loops.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]
#![cfg(target_os = "linux")]

use std::path::Path;

use trueup_cosim::system::{
    Algorithm, Connection, CosimSystem, RecordedVariable, RunSettings, StartValue, SystemComponent,
    VariablePort,
};
use trueup_cosim::{CosimError, Master, RunLog, SeriesMemory, check};
use trueup_testkit::{BlockFmu, BlockVersion, ShotProblem, compiler, problems};

fn port(text: &str) -> VariablePort {
    let (component, variable) = text.split_once('.').unwrap();
    VariablePort { component: component.into(), variable: variable.into() }
}

/// The problem as a system; its FMUs are made in `folder`.
fn system(
    problem: &ShotProblem,
    version: BlockVersion,
    folder: &Path,
    algorithm: Algorithm,
    step: f64,
) -> CosimSystem {
    let component = |block: &BlockFmu| SystemComponent {
        name: block.name.clone(),
        fmu: block.build(version, folder).unwrap(),
        ..SystemComponent::default()
    };
    let connection = |(from, to): &(String, String)| Connection {
        from: port(from),
        to: port(to),
        ..Connection::default()
    };
    CosimSystem {
        components: problem.blocks.iter().map(component).collect(),
        connections: problem.connections.iter().map(connection).collect(),
        run: RunSettings {
            start: Some(0.0),
            stop: Some(problem.stop),
            step: Some(step),
            algorithm: Some(algorithm),
            ..RunSettings::default()
        },
        ..CosimSystem::default()
    }
}

fn run(system: &CosimSystem) -> Result<(RunLog, SeriesMemory), CosimError> {
    let mut memory = SeriesMemory::default();
    let log = Master::new(check(system)?)?.run(&mut memory)?;
    Ok((log, memory))
}

/// Largest error of these outputs at the end of the run.
fn error(problem: &ShotProblem, memory: &SeriesMemory, outputs: &[&str]) -> f64 {
    let exact = problem.exact(*memory.time().last().unwrap(), outputs).unwrap();
    let last = |name: &&str| *memory.column(name).unwrap().last().unwrap();
    outputs.iter().map(last).zip(exact).map(|(x, e)| (x - e).abs()).fold(0.0, f64::max)
}

/// Error of the problem with this algorithm and step.
fn measured(
    problem: &ShotProblem,
    version: BlockVersion,
    algorithm: Algorithm,
    step: f64,
    outputs: &[&str],
) -> f64 {
    let folder = tempfile::tempdir().unwrap();
    let (_, memory) = run(&system(problem, version, folder.path(), algorithm, step)).unwrap();
    error(problem, &memory, outputs)
}

fn skip() -> bool {
    if !compiler() {
        eprintln!("SKIPPED: no C compiler (cc)");
    }
    !compiler()
}

const MASSES: [&str; 2] = ["left.x1", "right.x2"];

#[test]
fn errors_at_a_fixed_step_are_those_of_the_theory() {
    if skip() {
        return;
    }
    for version in BlockVersion::ALL {
        for (algorithm, bound, order) in [
            (Algorithm::Jacobi, 3.3e-3, 1),
            (Algorithm::Extrapolate, 5.3e-5, 2),
            (Algorithm::Iterative, 1.3e-5, 2),
            (Algorithm::GaussSeidel, 1.2e-4, 2),
        ] {
            let [coarse, fine] =
                [0.01, 0.001].map(|h| measured(&problems::two_mass(), version, algorithm, h, &MASSES));
            println!("{version:?} {algorithm} {coarse:e} {fine:e}");
            assert!(coarse <= bound, "{version:?} {algorithm}: {coarse:e}");
            let rate = (coarse / fine).log10();
            assert!((rate - f64::from(order)).abs() < 0.15, "{version:?} {algorithm}: order {rate}");
        }
    }
}

#[test]
fn fmus_that_offer_nothing_are_of_second_order_too() {
    if skip() {
        return;
    }
    let plain = problems::two_mass().map(BlockFmu::plain);
    for version in BlockVersion::ALL {
        for algorithm in [Algorithm::Extrapolate, Algorithm::GaussSeidel] {
            let [coarse, fine] = [0.01, 0.001].map(|h| measured(&plain, version, algorithm, h, &MASSES));
            println!("plain {version:?} {algorithm} {coarse:e} {fine:e}");
            assert!(coarse < 1.2e-4 && (coarse / fine).log10() > 1.85, "{algorithm}: {coarse:e}, {fine:e}");
        }
    }
}

#[test]
fn stiff_coupling_is_stable_when_iterated() {
    if skip() {
        return;
    }
    let problem = problems::stiff_two_mass();
    // The fast mode has a period of 4.4 ms.
    let explicit = measured(&problem, BlockVersion::Two, Algorithm::Jacobi, 1e-3, &MASSES);
    let iterated = measured(&problem, BlockVersion::Two, Algorithm::Iterative, 1e-3, &MASSES);
    println!("stiff {explicit:e} {iterated:e}");
    assert!(explicit > 1e3, "{explicit:e}");
    assert!(iterated < 0.5, "{iterated:e}");
    let fine = measured(&problem, BlockVersion::Two, Algorithm::Iterative, 1e-4, &MASSES);
    println!("stiff fine {fine:e}");
    assert!(fine < 3e-3, "{fine:e}");
}

#[test]
fn a_loop_of_feedthrough_is_solved_at_every_point() {
    if skip() {
        return;
    }
    let problem = problems::feedthrough_loop(-0.9);
    let states = ["first.x", "second.x"];
    for directional in [true, false] {
        for version in BlockVersion::ALL {
            let problem = problem.clone().map(|b| BlockFmu { directional, ..b });
            let error = measured(&problem, version, Algorithm::Iterative, 5e-4, &states);
            println!("loop {version:?} {error:e}");
            assert!(error < 1e-3, "{error:e}");
        }
    }
    // With a gain of 1.1 the loop itself is unstable.
    let folder = tempfile::tempdir().unwrap();
    let unstable = ShotProblem { stop: 0.02, ..problems::feedthrough_loop(1.1) };
    let system = system(&unstable, BlockVersion::Two, folder.path(), Algorithm::Iterative, 1e-5);
    let (log, memory) = run(&system).unwrap();
    assert!(memory.column("first.x").unwrap().last().unwrap().abs() > 100.0);
    assert!(log.loops[0].residual < 1e-9, "{:?}", log.loops);
}

#[test]
fn a_nonlinear_loop_is_solved_from_zero_or_named() {
    if skip() {
        return;
    }
    for version in BlockVersion::ALL {
        for (lower, x1, x2) in
            [(false, 4.55717497580269, 0.0928624959671143), (true, -4.97384164246935, -1.49564027374489)]
        {
            let folder = tempfile::tempdir().unwrap();
            let problem = problems::equation_pair(lower);
            let (log, memory) =
                run(&system(&problem, version, folder.path(), Algorithm::Jacobi, 0.1)).unwrap();
            for (name, exact) in [("first.x1", x1), ("second.x2", x2)] {
                let found = memory.column(name).unwrap();
                let error = found.iter().map(|x| (x - exact).abs()).fold(0.0, f64::max);
                eprintln!("equation pair, {version:?}: {name} = {exact}, off by {error:.1e}");
                assert!(found.iter().all(|x| (x - exact).abs() < 1e-9), "{name}: {found:?}");
            }
            assert_eq!(log.initial_loops[0].variables, ["second.x1", "first.x2"]);
        }
    }
    // x1 = x1 + 1 has no solution.
    let folder = tempfile::tempdir().unwrap();
    let mut problem = problems::equation_pair(false);
    for (block, output) in problem.blocks.iter_mut().zip(["u(0) + 1", "u(0)"]) {
        block.dynamics = trueup_testkit::Dynamics::Equations {
            flow: vec![],
            outputs: vec![output.into()],
            feedthrough: vec![vec![Some("1".into())]],
        };
    }
    let failed =
        run(&system(&problem, BlockVersion::Two, folder.path(), Algorithm::Jacobi, 0.1)).unwrap_err();
    let CosimError::Loop { variables, .. } = &failed else { panic!("{failed}") };
    assert_eq!(variables.len(), 2);
    let said = failed.to_string();
    assert!(["first.x2 = ", "second.x1 = ", "t = 0 s"].iter().all(|w| said.contains(w)), "{said}");
}

#[test]
fn halves_that_integrate_the_same_velocity_do_not_drift_apart() {
    if skip() {
        return;
    }
    let problem = problems::drift();
    for algorithm in [Algorithm::Extrapolate, Algorithm::Iterative] {
        let folder = tempfile::tempdir().unwrap();
        let (_, memory) = run(&system(&problem, BlockVersion::Two, folder.path(), algorithm, 0.1)).unwrap();
        let last = |name: &str| *memory.column(name).unwrap().last().unwrap();
        let apart = last("spring.x") - last("mass.x");
        println!("drift {algorithm} {apart:e}");
        assert!(apart.abs() < 1e-3, "{algorithm}: {apart:e}");
    }
}

#[test]
fn a_slow_component_never_shows_the_future() {
    if skip() {
        return;
    }
    let problem = problems::two_mass();
    let folder = tempfile::tempdir().unwrap();
    let mut slow = system(&problem, BlockVersion::Two, folder.path(), Algorithm::Jacobi, 0.01);
    slow.components[0].step = Some(0.1);
    let (_, memory) = run(&slow).unwrap();
    let x1 = memory.column("left.x1").unwrap();
    for (i, t) in memory.time().iter().enumerate() {
        assert_eq!(x1[i], x1[i / 10 * 10], "at {t}");
    }
    // After the first 0.1 s the force was constant: x1 at 0.1 s is the answer to F(0) alone.
    assert_eq!(x1[9], 0.0);
    let f0 = memory.column("right.F").unwrap()[0];
    assert!((x1[10] - f0 * 0.005).abs() < 0.02 * f0 * 0.005, "{} {f0}", x1[10]);
    // These FMUs are exact for inputs on lines, so that the fast one may take one step or ten on the same line.
    slow.run.algorithm = Some(Algorithm::Extrapolate);
    let two_rates = error(&problem, &run(&slow).unwrap().1, &MASSES);
    let one_rate = measured(&problem, BlockVersion::Two, Algorithm::Extrapolate, 0.1, &MASSES);
    assert!((two_rates - one_rate).abs() < 1e-9 && one_rate < 5e-3, "{two_rates:e}, {one_rate:e}");
}

#[test]
fn the_choice_is_explained() {
    if skip() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let mut loose = system(&problems::two_mass(), BlockVersion::Two, folder.path(), Algorithm::Jacobi, 0.1);
    loose.run.algorithm = None;
    let (log, _) = run(&loose).unwrap();
    assert_eq!(log.algorithm, Algorithm::Extrapolate);
    assert!(log.reason.contains("circle"), "{}", log.reason);
    loose.connections.pop();
    let (log, _) = run(&loose).unwrap();
    assert_eq!(log.algorithm, Algorithm::GaussSeidel);
    let plain = problems::two_mass().map(BlockFmu::plain);
    let rigid = system(&plain, BlockVersion::Three, folder.path(), Algorithm::Iterative, 0.1);
    let said = run(&rigid).err().unwrap().to_string();
    assert!(said.contains("`left`, `right`") && said.contains("extrapolate"), "{said}");
}

fn faulty(system: &CosimSystem, component: usize, fault: &str) -> CosimSystem {
    let start = |name: &str, value: &str| StartValue {
        variable: name.into(),
        values: vec![value.into()],
        ..StartValue::default()
    };
    let mut faulty = system.clone();
    faulty.components[component].start = vec![start("fault", fault), start("faultTime", "0.5")];
    faulty
}

#[test]
fn faults_in_a_coupled_run_name_fmu_and_time() {
    if skip() {
        return;
    }
    let problem = problems::two_mass();
    let runs = BlockVersion::ALL.map(|v| [Algorithm::Extrapolate, Algorithm::Jacobi].map(|a| (v, a)));
    for (version, algorithm) in runs.into_iter().flatten() {
        let folder = tempfile::tempdir().unwrap();
        let plain = if algorithm == Algorithm::Jacobi {
            problem.clone().map(BlockFmu::plain)
        } else {
            problem.clone()
        };
        let healthy = system(&plain, version, folder.path(), algorithm, 0.01);
        let exact = error(&problem, &run(&healthy).unwrap().1, &MASSES);
        for (fault, said, what) in [
            ("3", "Error", "DoStep"),
            ("4", "Fatal", "DoStep"),
            ("2", "Discard", "DoStep"),
            ("5", "NaN", "right"),
            ("6", "-inf", "right"),
            ("10", "Error", "fmiGet"),
            ("11", "Error", "fmiSet"),
        ] {
            let mut memory = SeriesMemory::default();
            let plan = check(&faulty(&healthy, 1, fault)).unwrap();
            let text = Master::new(plan).unwrap().run(&mut memory).unwrap_err().to_string();
            let what = what.replace("fmi", version.tag());
            let words = [said, "right", "t = 0.5 s", &what];
            assert!(words.iter().all(|w| text.to_lowercase().contains(&w.to_lowercase())), "{text}");
            assert!(memory.time().len() >= 50, "{}", memory.time().len());
        }
        // A warning, fine steps, half steps: the run goes on and stays as exact.
        for fault in ["1", "7", "9"] {
            let (log, memory) = run(&faulty(&healthy, 1, fault)).unwrap();
            let error = error(&problem, &memory, &MASSES);
            println!("fault {fault}: {error:e}, {} discarded", log.discarded);
            assert!(error <= 1.05 * exact, "{fault}: {error:e}");
            // An FMU of FMI 3.0 may return early instead, or be called with short steps from the beginning.
            if fault != "9" || version == BlockVersion::Two {
                assert_eq!(log.discarded > 0, fault != "1", "{fault}");
            }
        }
    }
}

/// The shortest way (straight.rs) is taken by systems of FMUs that step at all points and hand doubles on without loops. One
/// more FMU, coupled to nothing, that steps at every second point sends the others the general way; where that would make
/// other slopes of lines, a loop of two FMUs next to them does.
#[test]
fn the_short_way_gives_the_same_bits_as_the_general_one() {
    if skip() {
        return;
    }
    const NAMES: [&str; 5] = ["left.x1", "left.v1", "right.F", "right.x2", "right.v2"];
    for version in BlockVersion::ALL {
        let faults = ["0", "1", "7", "9", "8"];
        let algorithms = [Algorithm::Jacobi, Algorithm::Extrapolate];
        for (fault, algorithm) in faults.into_iter().flat_map(|f| algorithms.map(|a| (f, a))) {
            let folder = tempfile::tempdir().unwrap();
            let plain = problems::two_mass().map(BlockFmu::plain);
            let mut short = system(&plain, version, folder.path(), algorithm, 0.01);
            // Neither a multiple of the step nor a row at each point.
            short.run.stop = Some(0.987);
            let recorded =
                NAMES.map(|n| RecordedVariable { name: n.into(), every: 3, ..RecordedVariable::default() });
            short.record = recorded.into();
            // What is converted on the way, too.
            short.connections[0].factor = 0.9;
            short.connections[0].offset = 0.1;
            let short = faulty(&short, 1, fault);
            let mut general = short.clone();
            if algorithm == Algorithm::Jacobi {
                let idle =
                    SystemComponent { name: "idle".into(), step: Some(0.02), ..short.components[0].clone() };
                general.components.push(idle);
            } else {
                let pair = problems::equation_pair(false).map(BlockFmu::plain);
                let beside = system(&pair, version, folder.path(), algorithm, 0.01);
                general.components.extend(beside.components);
                general.connections.extend(beside.connections);
            }
            let [(a, short), (b, general)] = [short, general].map(|s| run(&s).unwrap());
            for name in NAMES {
                let bits = |m: &SeriesMemory| {
                    m.column(name).unwrap().iter().map(|x| x.to_bits()).collect::<Vec<_>>()
                };
                assert_eq!(bits(&short), bits(&general), "{version:?} {algorithm:?} {fault} {name}");
            }
            assert_eq!((a.steps, a.time, a.terminated_by), (b.steps, b.time, b.terminated_by));
            assert_eq!(short.time(), general.time());
        }
    }
}
