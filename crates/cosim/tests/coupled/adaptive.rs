//! Steps chosen by the error of the run.

use trueup_testkit::{BlockFmu, BlockVersion, ShotProblem, problems};

use super::{Bench, Run};

fn run(tolerance: f64, stop: f64, step: f64) -> String {
    format!("algorithm = \"adaptive\"\nstop = {stop:?}\nstep = {step:?}\ntolerance = {tolerance:?}")
}

/// Largest error over the run of the outputs of a linear problem, each relative to its largest magnitude or 1.
fn worst(it: &Run, problem: &ShotProblem, outputs: &[&str]) -> f64 {
    let mut scale = vec![1.0_f64; outputs.len()];
    let mut worst = 0.0_f64;
    for (row, time) in it.results.time().iter().enumerate() {
        let exact = problem.exact(*time, outputs).unwrap();
        for ((name, exact), scale) in outputs.iter().zip(exact).zip(&mut scale) {
            *scale = scale.max(exact.abs());
            worst = worst.max((it.column(name)[row] - exact).abs() / *scale);
        }
    }
    worst
}

const OUTPUTS: [&str; 5] = ["left.x1", "left.v1", "right.F", "right.x2", "right.v2"];

/// Both ways: not missed by more, and not undercut by more, than a factor of 3.
#[test]
fn tolerances_are_met_within_a_factor_of_3() {
    let Some(bench) = Bench::new(problems::two_mass(), BlockVersion::Two) else { return };
    let mut errors = Vec::new();
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8] {
        let it = bench.well(&run(tolerance, 10.0, 0.01));
        let error = worst(&it, bench.problem(), &OUTPUTS);
        let adapted = it.log.adapted.unwrap();
        eprintln!(
            "{tolerance:e}: error {error:.2e}, {:.2e} at the end, estimated {:.2e}; {} steps accepted, {} taken, {} pairs rejected",
            it.error(&[("left.x1", 0.0510408140565515), ("right.x2", 0.0316413383731971)]),
            adapted.error,
            adapted.accepted,
            adapted.taken,
            adapted.rejected
        );
        assert!((tolerance / 3.0..=3.0 * tolerance).contains(&error), "{tolerance:e}: {error:e}");
        // The error in the log is the true one, to a factor of 3 (a root mean square against a maximum).
        assert!((error / 3.0..=3.0 * error).contains(&adapted.error), "{tolerance:e}: {error:e} {adapted:?}");
        errors.push((adapted.accepted as f64, error));
    }
    let [(few, large), .., (many, small)] = errors[..] else { unreachable!() };
    let order = (large / small).ln() / (many / few).ln();
    eprintln!("order {order:.2}");
    assert!((order - 4.0).abs() < 0.5, "order {order}");
}

/// 1e-4 at the end took other masters 3,000 to 300,000 steps of each FMU.
#[test]
fn four_digits_take_fewer_than_1500_steps() {
    let expected = [("left.x1", 0.0510408140565515), ("right.x2", 0.0316413383731971)];
    for version in BlockVersion::ALL {
        let Some(bench) = Bench::new(problems::two_mass(), version) else { return };
        let it = bench.well(&run(1e-4, 10.0, 0.01));
        let (error, taken) = (it.error(&expected), it.log.adapted.unwrap().taken);
        // An FMU of FMI 3.0 takes each step in two parts.
        let taken = if version == BlockVersion::Two { taken } else { 2 * taken };
        assert!(error <= 1e-4 && taken < 1500, "{version:?}: {error:e} with {taken} steps");
    }
}

/// FMUs that hold their inputs take two steps for one, and are coupled with the same order.
#[test]
fn held_inputs_serve_too() {
    let problem = problems::two_mass().map(|b| BlockFmu { degree: 0, ..b });
    let Some(bench) = Bench::new(problem, BlockVersion::Two) else { return };
    let it = bench.well(&run(1e-4, 10.0, 0.01));
    let taken = it.log.adapted.unwrap().taken;
    assert!(2 * taken < 1500, "{taken}");
    let error = worst(&it, bench.problem(), &OUTPUTS);
    assert!((1e-4 / 3.0..=3e-4).contains(&error), "{error:e}");
}

#[test]
fn stiff_and_looped_problems() {
    let Some(bench) = Bench::new(problems::stiff_two_mass(), BlockVersion::Two) else { return };
    let error =
        worst(&bench.well(&run(1e-4, 1.0, 1e-3)), bench.problem(), &["left.x1", "right.F", "right.x2"]);
    assert!(error <= 3e-4, "{error:e}");
    let Some(bench) = Bench::new(problems::feedthrough_loop(-0.9), BlockVersion::Two) else { return };
    let error = worst(&bench.well(&run(1e-5, 1.0, 1e-3)), bench.problem(), &["first.y", "second.y"]);
    assert!(error <= 3e-5, "{error:e}");
    let Some(bench) = Bench::new(problems::lotka_volterra(), BlockVersion::Three) else { return };
    let it = bench.well(&run(1e-6, 100.0, 0.1));
    let expected = [("prey.x", 25.6817462942265), ("predator.y", 15.3126238285098)];
    // Errors grow by themselves along these orbits, beyond the requested tolerance. The log reports it, and how far.
    let largest = |name: &str| it.column(name).iter().fold(1.0_f64, |m, x| m.max(x.abs()));
    let relative = |(name, x): &(&str, f64)| (it.last(name) - x).abs() / largest(name);
    let error = expected.iter().map(relative).fold(0.0, f64::max);
    let told = it.log.adapted.unwrap().error;
    assert!((told / 3.0..=1.5 * told).contains(&error) && error < 1e-5, "{error:e}, reported {told:e}");
    assert!(it.log.notes.iter().any(|n| n.contains("tolerance")), "{:?}", it.log.notes);
}

/// Steps that change leave no offset between two halves that integrate the same velocity.
#[test]
fn steps_that_change_leave_no_offset() {
    let Some(bench) = Bench::new(problems::drift(), BlockVersion::Two) else { return };
    for tolerance in [1e-3, 1e-5] {
        let it = bench.well(&run(tolerance, 20.0, 0.1));
        let (shortest, longest) = it.log.adapted.unwrap().steps;
        assert!(longest > 3.0 * shortest, "the steps did not change: {shortest} {longest}");
        let apart = it.last("spring.x") - it.last("mass.x");
        assert!(apart.abs() <= tolerance, "{tolerance:e}: {apart:e}");
    }
}

#[test]
fn an_fmu_that_cannot_go_back_is_refused_by_name() {
    let mut problem = problems::two_mass();
    problem.blocks[1].rollback = false;
    let Some(bench) = Bench::new(problem, BlockVersion::Two) else { return };
    let text = bench.toml(&run(1e-4, 10.0, 0.01), &[]);
    let file = bench.folder.path().join("refused.toml");
    std::fs::write(&file, text).unwrap();
    let plan = trueup_cosim::check(&trueup_cosim::system::CosimSystem::read(&file).unwrap()).unwrap();
    let said = trueup_cosim::Master::new(plan).err().unwrap().to_string();
    assert!(said.contains("right") && said.contains("extrapolate") && !said.contains("left"), "{said}");
}
