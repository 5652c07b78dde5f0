//! The exact solutions against figures that were computed elsewhere.

#![allow(clippy::unwrap_used)]

use trueup_testkit::problems;

#[test]
fn the_linear_problems_have_their_published_values() {
    for (problem, outputs, expected, tolerance) in [
        (problems::two_mass(), ["left.x1", "right.x2"], [0.0510408140565515, 0.0316413383731971], 1e-14),
        (problems::stiff_two_mass(), ["left.x1", "right.x2"], [0.195842316627185, 0.187218336940235], 1e-11),
        (problems::quarter_car(), ["chassis.z", "wheel.z"], [0.0652894398482172, 0.0966065051298327], 1e-14),
        (
            problems::feedthrough_loop(-0.9),
            ["first.x", "second.x"],
            [0.0859764036735325, 0.00839266482037434],
            1e-14,
        ),
    ] {
        let values = problem.exact(problem.stop, &outputs).unwrap();
        for (value, expected) in values.iter().zip(expected) {
            assert!((value - expected).abs() < tolerance, "{outputs:?}: {values:?}, not {expected:?}");
        }
    }
    let halves = problems::drift().exact(20.0, &["spring.x", "mass.x"]).unwrap();
    assert!((halves[0] - halves[1]).abs() < 1e-14, "{halves:?}");
    let unstable = problems::feedthrough_loop(1.1).exact(0.02, &["first.x", "second.x"]).unwrap();
    assert!(unstable.iter().all(|x| x.abs() > 100.0), "{unstable:?}");
}
