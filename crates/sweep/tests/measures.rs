//! Numbers of a run, against those of known courses.

use trueup_cosim::{ColumnKind, ResultColumn, ResultRow, ResultSink, RowValues};
use trueup_sweep::{Measures, Output, SweepFile};

fn outputs(text: &str) -> Vec<Output> {
    let text = format!(
        "system = \"a.fmu\"\ndesign = \"list\"\n[factors]\na = {{ values = [1] }}\n[outputs]\n{text}"
    );
    SweepFile::parse(&text, "s.toml".as_ref()).unwrap().outputs
}

/// What is kept of `x` with these rows.
fn kept(text: &str, rows: &[(f64, f64)]) -> Vec<Option<f64>> {
    let outputs = outputs(text);
    let columns =
        [ResultColumn::new("other", ColumnKind::Real, ""), ResultColumn::new("x", ColumnKind::Real, "m")];
    let (mut values, mut measures) = (RowValues::of(&columns), Measures::new(&outputs));
    measures.begin(&columns).unwrap();
    for (time, x) in rows {
        values.reals = vec![-7.0, *x];
        measures.row(ResultRow { time: *time, point: None, values: &values }).unwrap();
    }
    measures.values()
}

const ALL: &str = "final = { variable = \"x\" }\nmin = { variable = \"x\", take = \"min\" }\n\
    max = { variable = \"x\", take = \"max\" }\nmean = { variable = \"x\", take = \"mean\" }\n\
    rms = { variable = \"x\", take = \"rms\" }\nabove = { variable = \"x\", take = \"time\", above = 1 }\n\
    below = { variable = \"x\", take = \"time\", below = -2.5 }\n";

#[test]
fn of_lines_and_a_jump() {
    // From 0 to 4 in 2 s, a jump to -1, which holds for 2 s.
    let rows = [(1.0, 0.0), (3.0, 4.0), (3.0, -1.0), (5.0, -1.0)];
    let rms = ((2.0 * 16.0 / 3.0 + 2.0) / 4.0_f64).sqrt();
    let expected = [Some(-1.0), Some(-1.0), Some(4.0), Some(0.5), Some(rms), Some(1.5), None];
    for (found, exact) in kept(ALL, &rows).into_iter().zip(expected) {
        match (found, exact) {
            (Some(a), Some(b)) => assert!((a - b).abs() < 1e-15, "{a} {b}"),
            other => assert_eq!(other.0, other.1),
        }
    }
}

#[test]
fn a_level_is_passed_at_once_where_the_run_begins_beyond_it_and_at_the_jump_that_passes_it() {
    let above = "when = { variable = \"x\", take = \"time\", above = 1 }";
    assert_eq!(kept(above, &[(0.5, 1.5), (1.0, 0.0)]), [Some(0.5)]);
    assert_eq!(kept(above, &[(0.0, 1.0), (1.0, 1.0)]), [None]);
    assert_eq!(kept(above, &[(0.0, 0.0), (2.0, 0.5), (2.0, 3.0), (3.0, 9.0)]), [Some(2.0)]);
}

#[test]
fn what_has_settled_stays_there_to_the_end() {
    let below = "when = { variable = \"x\", take = \"settled\", below = 1 }";
    // Below from 1.5 s on, not from 0.5 s; a level that is only reached is not passed.
    assert_eq!(kept(below, &[(0.0, 2.0), (1.0, 0.0), (1.25, 4.0), (2.0, 0.0), (3.0, 0.5)]), [Some(1.8125)]);
    assert_eq!(kept(below, &[(0.0, 0.5), (1.0, 0.9)]), [Some(0.0)]);
    assert_eq!(kept(below, &[(0.0, 0.5), (1.0, 1.0)]), [None]);
    let above = "when = { variable = \"x\", take = \"settled\", above = -1 }";
    assert_eq!(kept(above, &[(0.0, -3.0), (2.0, 1.0), (2.0, -2.0), (3.0, 0.0)]), [Some(2.5)]);
}

#[test]
fn rows_however_uneven_give_the_mean_over_time() {
    let rows: Vec<(f64, f64)> = (0..=1000).map(|k| (f64::from(k) / 1000.0).powi(3)).map(|t| (t, t)).collect();
    let found = kept(
        "mean = { variable = \"x\", take = \"mean\" }\nrms = { variable = \"x\", take = \"rms\" }",
        &rows,
    );
    assert!(
        (found[0].unwrap() - 0.5).abs() < 1e-14 && (found[1].unwrap() - (1.0_f64 / 3.0).sqrt()).abs() < 1e-14
    );
}

#[test]
fn nothing_computed_is_nothing_kept() {
    assert_eq!(kept(ALL, &[]), [None; 7]);
}
