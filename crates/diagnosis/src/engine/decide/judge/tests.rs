use super::*;
use crate::engine::made::{FreeRunGaps, fitted, found, free};

/// Readings of an octave: so few that balances leave much to free runs.
const FEW: f64 = 10.0;

/// What the balances of a set leave, in floors, and its free run, if it ran.
type Set = (&'static str, f64, Option<f64>);

/// Which set is chosen, where the tuned model leaves a gap of `tuned` floors.
fn chosen(tuned: f64, best: Option<usize>, sets: &[Set]) -> Option<usize> {
    chosen_of(FEW, tuned, best, sets)
}
/// The same where an octave has so many readings.
fn chosen_of(readings: f64, tuned: f64, best: Option<usize>, sets: &[Set]) -> Option<usize> {
    let found = found(sets.iter().map(|set| fitted(set.0, set.1, readings)).collect(), best, readings);
    let ran = FreeRunGaps { gaps: sets.iter().map(|set| set.2).collect(), ..FreeRunGaps::default() };
    Judge::new(&found, free(tuned), &ran, &Thresholds::default()).choose()
}

const ONE: &str = "backlash";
const OTHER: &str = "cable-stiffness";
const TWO: &str = "backlash motor-friction";

#[test]
fn one_fewer_is_chosen_where_it_does_as_well_and_balances_do_not_require_two() {
    let cases = [
        ("as well", [1.1, 1.0], [1.5, 1.45], 0),
        ("worse by more than a fifth", [1.1, 1.0], [1.7, 1.45], 1),
        ("as well, but the balances require both", [50.0, 1.0], [1.5, 1.45], 1),
        ("as well, and most of what the balances miss stays with both", [50.0, 30.0], [1.5, 1.45], 0),
    ];
    for (what, left, gaps, expected) in cases {
        let sets = [(ONE, left[0], Some(gaps[0])), (TWO, left[1], Some(gaps[1]))];
        assert_eq!(chosen(10.0, Some(1), &sets), Some(expected), "{what}");
    }
}

#[test]
fn balances_require_no_cause_that_takes_next_to_nothing_of_what_they_missed() {
    for (missed, gaps, expected) in [(1e3, [1.5, 1.45], 1), (1e5, [1.5, 1.45], 0), (1e5, [1.9, 1.45], 1)] {
        let sets = vec![fitted(ONE, 50.0, 1e4), fitted(TWO, 1.0, 1e4)];
        let mut found = found(sets, Some(1), 1e4);
        found.plain = fitted("", missed, 1e4);
        let ran = FreeRunGaps { gaps: gaps.map(Some).to_vec(), ..FreeRunGaps::default() };
        let chosen = Judge::new(&found, free(10.0), &ran, &Thresholds::default()).choose();
        assert_eq!(chosen, Some(expected), "{missed}, {gaps:?}");
    }
}

#[test]
fn as_few_are_chosen_as_do_as_well() {
    const THREE: &str = "backlash motor-friction cable-stiffness";
    let cases = [
        ("one does as well", [1.1, 1.05, 1.0], [1.5, 1.45, 1.45], 0),
        ("two do, one does not", [1.1, 1.05, 1.0], [1.7, 1.45, 1.45], 1),
        ("one does, but the balances require two", [50.0, 1.05, 1.0], [1.5, 1.45, 1.45], 1),
        ("one does, though these two do not", [1.1, 1.05, 1.0], [1.5, 1.9, 1.45], 0),
        ("neither does", [1.1, 1.05, 1.0], [1.9, 1.9, 1.45], 2),
        ("what balances miss of one is not plain", [1.2, 1.0, 1.0], [1.5, 1.45, 1.45], 0),
    ];
    for (what, left, gaps, expected) in cases {
        let sets = [ONE, TWO, THREE].iter().zip(left).zip(gaps).map(|((set, l), g)| (*set, l, Some(g)));
        assert_eq!(chosen_of(1e4, 10.0, Some(2), &sets.collect::<Vec<_>>()), Some(expected), "{what}");
    }
}

#[test]
fn one_more_is_chosen_where_it_does_far_better_and_its_own_falls_short() {
    let cases = [
        ("far better", 10.0, [Some(5.0), Some(2.0)], 1),
        ("its own comes near the floor", 8.0, [Some(1.9), Some(1.0)], 0),
        ("better, but not far", 10.0, [Some(5.0), Some(4.0)], 0),
        ("far better, but by less than a law's form", 40.0, [Some(5.0), Some(2.0)], 0),
        ("its own did not run", 10.0, [None, Some(5.0)], 1),
    ];
    for (what, tuned, gaps, expected) in cases {
        let sets = [(ONE, 10.0, gaps[0]), (TWO, 9.0, gaps[1])];
        assert_eq!(chosen(tuned, Some(0), &sets), Some(expected), "{what}");
    }
}

#[test]
fn another_effect_is_chosen_where_the_chosen_set_changes_nothing() {
    let cases = [
        ("it closes the gap", 500.0, [9.0, 2.0], 1),
        ("it leaves more than a quarter", 500.0, [9.0, 5.0], 0),
        ("the chosen set halves the gap", 500.0, [7.0, 2.0], 0),
        ("the balances are decisive", 5000.0, [9.0, 2.0], 0),
    ];
    for (what, left, gaps, expected) in cases {
        let sets = [(TWO, 100.0, Some(gaps[0])), (OTHER, left, Some(gaps[1]))];
        assert_eq!(chosen(10.0, Some(0), &sets), Some(expected), "{what}");
    }
}

#[test]
fn of_several_that_may_take_its_place_the_likeliest_does() {
    let names = [OTHER, "gravity-torque", "sensor-delay"];
    let cases = [
        ("the nearest free run of those that are alike", [(500.0, 3.0), (500.0, 2.0), (500.0, 2.5)], 2),
        ("balances count with free runs", [(1000.0, 2.0), (1000.0, 2.5), (400.0, 2.5)], 3),
        (
            "but not those of one that leaves more than a quarter",
            [(1000.0, 2.0), (1000.0, 2.5), (400.0, 5.0)],
            1,
        ),
    ];
    for (what, singles, expected) in cases {
        let mut sets = vec![(TWO, 100.0, Some(9.0))];
        sets.extend(names.iter().zip(singles).map(|(name, (left, gap))| (*name, left, Some(gap))));
        assert_eq!(chosen(10.0, Some(0), &sets), Some(expected), "{what}");
    }
}

#[test]
fn where_balances_chose_no_effect_one_has_to_halve_the_gap() {
    let none = [("motorInertia", 100.0, Some(1.0))];
    assert_eq!(chosen(10.0, Some(0), &none), None, "nothing has effects");
    assert_eq!(chosen(10.0, None, &[]), None, "nothing was fitted");
    assert_eq!(chosen(10.0, None, &[(ONE, 100.0, Some(6.0))]), Some(0), "more than half");
    assert_eq!(chosen(10.0, None, &[(ONE, 100.0, Some(8.0))]), None, "less than half");
    assert_eq!(chosen(10.0, None, &[(ONE, 100.0, None)]), None, "it did not run");
    // What may be the sensors' noise has to go nearly whole: 0.96 floors' power.
    assert_eq!(chosen(1.4, None, &[(ONE, 100.0, Some(1.1))]), Some(0), "0.21 left");
    assert_eq!(chosen(1.4, None, &[(ONE, 100.0, Some(1.2))]), None, "0.44 left");
}

#[test]
fn where_balances_chose_no_effect_two_are_chosen_if_one_falls_short_and_they_do_far_better() {
    let cases = [
        ("far better", Some(5.0), 1.1, Some(1)),
        ("one comes near the floor", Some(1.9), 1.0, Some(0)),
        ("better, but not far", Some(5.0), 4.0, Some(0)),
        ("one that does not halve the gap", Some(9.0), 1.1, Some(1)),
        ("neither halves it", Some(9.5), 8.0, None),
    ];
    for (what, one, two, expected) in cases {
        assert_eq!(chosen(10.0, None, &[(ONE, 100.0, one), (TWO, 100.0, Some(two))]), expected, "{what}");
    }
}

/// Odds of a set that leaves so much more by its balances, its free run as near.
fn odds(best: &str, other: &str, power: f64, apart: Option<f64>) -> f64 {
    odds_ran(best, (other, power, 2.0), apart, false)
}
/// The same of a set whose free run leaves `gap` floors, of one sensor or several.
fn odds_ran(best: &str, (other, power, gap): (&str, f64, f64), apart: Option<f64>, one_sensor: bool) -> f64 {
    let sets = vec![fitted(best, 1.0, 100.0), fitted(other, power, 100.0)];
    let (found, limits) = (found(sets, Some(0), 100.0), Thresholds::default());
    let ran = FreeRunGaps { gaps: vec![Some(2.0), Some(gap)], apart, one_sensor, left_out: None };
    let judge = Judge::new(&found, free(10.0), &ran, &limits);
    match &judge.rivals(Some(0), &found.best, 0, 2.0)[..] {
        [(1, odds)] => *odds,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_late_command_is_held_against_a_late_reading_by_size_alone() {
    // 5 % of 200 readings.
    let by_size = |power: f64| -0.5 * 10.0 * power.ln();
    assert!((odds("actuator-lag", "sensor-delay", 1.4, None) - by_size(1.4)).abs() < 1e-9);
    // Compared with the noise: 200 (1.4 - 1) / 2.
    assert!((odds("actuator-lag", "backlash", 1.4, None) + 40.0).abs() < 1e-9);
    // Nor do balances outweigh free runs that are alike.
    assert!(by_size(20.0) < -Thresholds::default().odds.outweighs);
    assert_eq!(odds("actuator-lag", "sensor-delay", 20.0, Some(0.5)), 0.0);
    assert!(odds("actuator-lag", "backlash", 20.0, Some(0.5)) < -12.0);
    // Two late readings are as other causes are.
    assert!((odds("sensor-delay:motorAngle", "sensor-delay:loadAngle", 1.4, None) + 40.0).abs() < 1e-9);
    // One sensor shows them alike, whatever their forms leave.
    let one_sensor =
        |other: &str, power: f64, gap: f64| odds_ran("actuator-lag", (other, power, gap), None, true);
    assert_eq!(one_sensor("sensor-delay", 20.0, 2.0), 0.0);
    assert!((one_sensor("backlash", 1.4, 2.0) + 40.0).abs() < 1e-9);
    // Nor whatever nearly nothing leaves: 3.8 and 8 floors' power of 99.
    assert_eq!(one_sensor("sensor-delay", 20.0, 2.2), 0.0);
    assert!(one_sensor("sensor-delay", 20.0, 3.0) < -3.0);
}

#[test]
fn free_runs_count_as_far_as_recordings_agree() {
    assert_eq!(agreed(3.0, &[3.0]), 3.0);
    assert_eq!(agreed(3.0, &[2.0, 2.0, 2.0]), 2.0);
    assert_eq!(agreed(-1.0, &[-2.0, -2.0]), -1.0);
    // One in which it is luck: mean 1, standard error 2.
    assert_eq!(agreed(2.5, &[3.0, -1.0]), 0.0);
    assert!((agreed(2.5, &[3.0, 1.0]) - 1.0).abs() < 1e-12);
}
