//! Closed loops of our FMUs, coupled by the master, against the same equations in one solver: the error falls with the
//! communication step as the theory of each algorithm says.
//!
//! Runs on the FMUs in the folder that `TRUEUP_FMUS` names; `./test` packs them there.
//! `cargo bench -p trueup-acceptance --bench accuracy` makes the page and the tables of docs/master-accuracy.md.
#![allow(clippy::expect_used, clippy::panic, clippy::unwrap_used)]

mod loops;
mod monolith;

use loops::{Case, LOOPS, errors, folder, order, run, system};
use trueup_cosim::system::Algorithm;

/// Steps of 8 : 4 : 2 : 1.
fn halved(longest: f64) -> [f64; 4] {
    [1.0, 0.5, 0.25, 0.125].map(|part| part * longest)
}

#[test]
fn the_error_falls_with_the_order_of_the_algorithm() {
    let Some(folder) = folder() else { return };
    // Order of each, and how far the slope over these steps may lie from it: they are not infinitely small.
    let orders = [
        (Algorithm::Jacobi, 1.0, 0.15),
        // The second FMU is given lines between known values, so it is of second order, too.
        (Algorithm::GaussSeidel, 2.0, 0.15),
        (Algorithm::Extrapolate, 2.0, 0.15),
        (Algorithm::Iterative, 2.0, 0.15),
    ];
    for case in LOOPS {
        let steps = halved(case.longest);
        for (algorithm, expected, margin) in orders {
            for version in [2, 3] {
                let errors = errors(case, &folder, "toml", version, algorithm, &steps);
                let found = order(&steps, &errors);
                let all = format!("{}, {algorithm}, FMI {version}: order {found:.3}, {errors:?}", case.name);
                println!("{all}");
                assert!((found - expected).abs() < margin, "{all}");
            }
        }
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
fn the_monolithic_solution_is_converged() {
    for Case { monolith, reference, stop, .. } in LOOPS {
        let [few, many] = [20, 400].map(|n| (0..=n).map(|k| stop * k as f64 / n as f64).collect::<Vec<_>>());
        // The solver stops at each time asked for, so these are two runs of different steps.
        let (a, b) = (monolith(*reference, &few), monolith(*reference, &many));
        let far = a.iter().zip(b.iter().step_by(20)).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
        assert!(far < 1e-11 * reference, "{far:e}");
        assert!((a[0], a[20]) != (0.0, 0.0));
    }
}
