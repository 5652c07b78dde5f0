//! Problems with known solutions, algorithm by algorithm; more of them in ../coupling.rs.

use trueup_testkit::{BlockVersion, problems};

use super::Bench;

const TWO_MASS: [(&str, f64); 2] = [("left.x1", 0.0510408140565515), ("right.x2", 0.0316413383731971)];

fn run(algorithm: &str, stop: f64, step: f64) -> String {
    format!("algorithm = \"{algorithm}\"\nstop = {stop:?}\nstep = {step:?}")
}

#[test]
fn two_masses_of_both_versions() {
    let versions = vec![BlockVersion::Two, BlockVersion::Three];
    let Some(bench) = Bench::mixed(problems::two_mass(), versions) else { return };
    let error = bench.well(&run("extrapolate", 10.0, 0.01)).error(&TWO_MASS);
    assert!(error <= 5.3e-5, "{error:e}");
}

/// Explicit coupling with held inputs blows up with steps at which repeated steps stay stable.
#[test]
fn stiff_two_masses() {
    let expected = [("left.x1", 0.195842316627185), ("right.x2", 0.187218336940235)];
    let Some(bench) = Bench::new(problems::stiff_two_mass(), BlockVersion::Two) else { return };
    let explicit = bench.run(&run("jacobi", 1.0, 5e-4));
    assert!(explicit.outcome.is_err() || explicit.error(&expected) > 1e6, "not stiff");
    let repeated = bench.well(&run("iterative", 1.0, 5e-4));
    assert!(repeated.column("left.x1").iter().all(|x| x.abs() < 3.0), "not stable");
    let [error, half] = [5e-5, 2.5e-5].map(|h| bench.well(&run("iterative", 1.0, h)).error(&expected));
    assert!(error < 1e-3 && error / half > 3.5, "{error:e} {half:e}");
}

/// At the same number of steps the error of held inputs is cut by more than 98 %, as by the best published corrections.
#[test]
fn quarter_car() {
    let expected = [("chassis.z", 0.0652894398482172), ("wheel.z", 0.0966065051298327)];
    let Some(bench) = Bench::new(problems::quarter_car(), BlockVersion::Two) else { return };
    let error = |algorithm| bench.well(&run(algorithm, 1.0, 1e-3)).error(&expected);
    let [held, lines, repeated] = ["jacobi", "extrapolate", "iterative"].map(error);
    assert!(lines < 0.02 * held && repeated < 0.02 * held, "{held:e} {lines:e} {repeated:e}");
}

/// The reference was computed with DOP853 at tolerances of 1e-13.
#[test]
fn lotka_volterra() {
    let expected = [("prey.x", 25.6817462942265), ("predator.y", 15.3126238285098)];
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::lotka_volterra(), version) else { return };
        let error = |algorithm, h| bench.well(&run(algorithm, 100.0, h)).error(&expected);
        let coarse = error("iterative", 0.1);
        let fine = error("iterative", 0.05);
        let extrapolated = error("extrapolate", 0.05);
        eprintln!(
            "Lotka-Volterra, {version:?}, iterative: {coarse:.2e} at h = 0.1, {fine:.2e} at 0.05; extrapolate {extrapolated:.2e}"
        );
        assert!(fine < 6e-3 && coarse / fine > 3.8, "{coarse:e} {fine:e}");
        assert!(extrapolated < 2e-2, "{extrapolated:e}");
    }
}

#[test]
fn an_unstable_loop_blows_up() {
    let Some(bench) = Bench::new(problems::feedthrough_loop(1.1), BlockVersion::Two) else { return };
    for algorithm in ["jacobi", "extrapolate"] {
        let it = bench.run(&run(algorithm, 0.3, 5e-4));
        let blown = it.column("first.x").iter().any(|x| x.abs() > 100.0);
        assert!(blown, "{algorithm}: {:?}", it.outcome.err());
    }
}

/// Held inputs leave the figures of Kyllingstad (arXiv 2512.13845): nothing with one step, an offset when it changes.
/// Lines leave none.
#[test]
fn drift() {
    let Some(bench) = Bench::new(problems::drift(), BlockVersion::Two) else { return };
    let apart = |algorithm: &str, h| {
        let it = bench.well(&run(algorithm, 20.0, h));
        it.last("spring.x") - it.last("mass.x")
    };
    for (h, expected) in [(0.1, -2.9e-6), (0.01, -2.7e-7)] {
        let drift = apart("jacobi", h);
        assert!((drift - expected).abs() < 0.02 * f64::abs(expected), "{h}: {drift:e}");
    }
}
