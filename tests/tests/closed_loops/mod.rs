//! Closed loops of our FMUs, coupled by the master, against the same equations in one solver: the error falls with the
//! communication step as the theory of each algorithm predicts.
//!
//! Runs on the FMUs in the folder that `TRUEUP_FMUS` names; `./test` packs them there.
//! `cargo bench -p trueup-acceptance --bench accuracy` makes the page and the tables of docs/master-accuracy.md.
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod loops;
mod monolith;

use loops::{Case, LOOPS, errors, exact, folder, order, run, system};
use trueup_cosim::system::{Algorithm, CosimSystem};
use trueup_cosim::{Master, SeriesMemory, check};

/// Steps of 8 : 4 : 2 : 1.
fn halved(longest: f64) -> [f64; 4] {
    [1.0, 0.5, 0.25, 0.125].map(|part| part * longest)
}

#[test]
fn the_error_of_a_joint_falls_with_the_order_of_the_algorithm() {
    orders("joint", 3, 3);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn the_error_of_an_arm_falls_with_the_order_of_the_algorithm() {
    orders("joint", 3, 4);
    orders("arm", 3, 4);
}

#[test]
#[ignore = "long, and the bits are those of FMI 3.0: ./test --full runs it"]
fn the_error_of_fmi_2_falls_with_the_order_of_the_algorithm() {
    orders("joint", 2, 4);
    orders("arm", 2, 4);
}

/// Of so many steps, the longest ones.
fn orders(name: &str, version: u32, steps: usize) {
    let Some(folder) = folder() else { return };
    // Order of each, and how far the slope over these steps may be from it: they are not infinitely small.
    let orders = [
        (Algorithm::Jacobi, 1.0, 0.15),
        // The second FMU is given lines between known values, so it is of second order, too.
        (Algorithm::GaussSeidel, 2.0, 0.15),
        (Algorithm::Extrapolate, 2.0, 0.15),
        (Algorithm::Iterative, 2.0, 0.15),
    ];
    let case = LOOPS.iter().find(|case| case.name == name).unwrap();
    let (steps, exact) = (&halved(case.longest)[..steps], exact(case));
    for (algorithm, expected, margin) in orders {
        let errors = errors(case, &exact, &folder, ("toml", version), algorithm, steps);
        let found = order(steps, &errors);
        let all = format!("{name}, {algorithm}, FMI {version}: order {found:.3}, {errors:?}");
        println!("{all}");
        assert!((found - expected).abs() < margin, "{all}");
    }
}

#[test]
fn toml_and_ssp_are_the_same_system_and_both_versions_of_fmi_agree() {
    let Some(folder) = folder() else { return };
    for case in LOOPS {
        let result = |file: &str, version| {
            let mut system = system(case, &folder, file, version);
            system.run.step = Some(case.longest);
            system.run.algorithm = Some(Algorithm::Jacobi);
            run(&system, case)
        };
        let toml = result("toml", 3);
        assert_eq!(toml, result("ssd", 3), "{}: SSP", case.name);
        assert_eq!(toml, result("toml", 2), "{}: FMI 2.0", case.name);
    }
}

#[test]
#[ignore = "of the reference alone, which the orders would show to be wrong: ./test --full runs it"]
fn the_monolithic_solution_is_converged() {
    for Case { monolith, reference, stop, .. } in LOOPS {
        let [few, many] = [20, 400].map(|n| (0..=n).map(|k| stop * k as f64 / n as f64).collect::<Vec<_>>());
        // The solver stops at each requested time, so these are two runs of different steps.
        let (a, b) = (monolith(*reference, &few), monolith(*reference, &many));
        let far = a.iter().zip(b.iter().step_by(20)).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(far < 1e-11 * reference, "{far:e}");
        assert!((a[0], a[20]) != (0.0, 0.0));
    }
}

/// At its limit the current hides the states of the controller: no output shows how wrong they are until the limit is left.
#[test]
fn the_adaptive_algorithm_keeps_its_tolerance_behind_a_limit() {
    keeps_its_tolerance_behind_a_limit(3);
}

#[test]
#[ignore = "long: ./test --full runs it"]
fn the_adaptive_algorithm_keeps_its_tolerance_behind_a_limit_in_fmi_2() {
    keeps_its_tolerance_behind_a_limit(2);
}

fn keeps_its_tolerance_behind_a_limit(version: u32) {
    let Some(folder) = folder() else { return };
    let (reference, column) = (0.1, "plant.loadAngle");
    let mut estimates = Vec::new();
    for tolerance in [1e-4, 1e-6] {
        let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/01-joint/joint.toml");
        let mut system = CosimSystem::read(file.as_ref()).unwrap();
        for (component, model) in system.components.iter_mut().zip(["TwoMassJoint", "JointController"]) {
            component.fmu = folder.join(format!("{model}.fmi{version}.fmu"));
        }
        system.run.algorithm = Some(Algorithm::Adaptive);
        system.run.tolerance = Some(tolerance);
        let mut memory = SeriesMemory::default();
        let mut master = Master::new(check(&system).unwrap()).unwrap();
        let log = master.run(&mut memory).unwrap_or_else(|e| panic!("{e}")).clone();
        let exact = monolith::limited_joint(reference, memory.time());
        let found = memory.column(column).unwrap();
        let errors: Vec<_> = found.iter().zip(&exact).map(|(a, b)| (a - b).abs() / reference).collect();
        let (last, largest) = (errors[errors.len() - 1], errors.iter().fold(0.0, |m: f64, e| m.max(*e)));
        let told = log.adapted.unwrap();
        let all = format!(
            "FMI {version}, {tolerance:e}: {last:.2e} at the end, {largest:.2e} over the run, {:.2e} estimated over all values; {} steps taken",
            told.error, told.taken
        );
        println!("{all}");
        assert!(last <= 3.0 * tolerance && largest <= 3.0 * tolerance, "{all}");
        // The loop amplifies what is wrong when the limit is left; the log reports it.
        let said = log.notes.iter().any(|n| n.contains("above the tolerance"));
        assert_eq!(said, told.error > 2.0 * tolerance, "{all}: {:?}", log.notes);
        estimates.push(told.error);
    }
    // And what it advises helps.
    assert!(estimates[1] < 0.1 * estimates[0], "{estimates:?}");
}
