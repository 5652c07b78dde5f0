//! Problem 8: values that jump, by time and by state.

use trueup_testkit::{BlockVersion, problems};

use super::Bench;

fn at(run: &super::Run, time: f64) -> f64 {
    let i = run.results.time().iter().position(|t| *t >= time - 1e-9).unwrap();
    run.column("integrator.x4")[i]
}

#[test]
fn jumps_are_stepped_over() {
    let Some(bench) = Bench::new(problems::jumps(), BlockVersion::Two) else { return };
    let it = bench.well("algorithm = \"adaptive\"\nstop = 10\nstep = 0.1\ntolerance = 1e-3");
    let adapted = it.log.adapted.unwrap();
    eprintln!("{adapted:?}");
    assert!(adapted.jumps >= 6, "{adapted:?}");
    for (time, x4) in [(1.0, 0.0), (2.0, 2.5), (3.0, 2.5), (4.5, -2.5), (5.0, -2.5), (10.0, 2.5)] {
        let error = (at(&it, time) - x4).abs();
        assert!(error < 3e-3 * 2.5, "at {time} s: {error:e}");
    }
}

/// With fixed steps the error is that of the step within which a jump falls.
#[test]
fn fixed_steps_cross_jumps() {
    let Some(bench) = Bench::new(problems::jumps(), BlockVersion::Two) else { return };
    for algorithm in ["jacobi", "gauss-seidel"] {
        let it = bench.well(&format!("algorithm = \"{algorithm}\"\nstop = 10\nstep = 0.01"));
        for (time, x4) in [(1.0, 0.0), (2.0, 2.5), (4.5, -2.5), (10.0, 2.5)] {
            let error = (at(&it, time) - x4).abs();
            assert!(error <= 6.0 * 0.02, "{algorithm} at {time} s: {error:e}");
        }
    }
}
