//! The list of runs.

use std::collections::BTreeSet;

use trueup_sweep::{FactorValue, MOST_SOBOL, SweepDesign, SweepFile};

fn design(text: &str) -> SweepDesign {
    let outputs = "\n[outputs]\ny = {}\n";
    SweepDesign::of(
        &SweepFile::parse(&format!("system = \"a.fmu\"\n{text}{outputs}"), "s.toml".as_ref()).unwrap(),
    )
}

fn texts(design: &SweepDesign, factors: usize) -> Vec<Vec<String>> {
    let of = |run| (0..factors).map(|f| design.value(f, run).text()).collect();
    (1..=design.runs()).map(of).collect()
}

fn numbers(design: &SweepDesign, factor: usize) -> Vec<f64> {
    let number = |run| match design.value(factor, run) {
        FactorValue::Number(x) => x,
        other => panic!("{other:?}"),
    };
    (1..=design.runs()).map(number).collect()
}

#[test]
fn a_grid_has_all_combinations_and_the_last_factor_changes_fastest() {
    let d = design("design = \"grid\"\n[factors]\nb = { values = [2, 1.5] }\na = { values = [\"x\", true] }");
    assert_eq!(texts(&d, 2), [["2", "x"], ["2", "true"], ["1.5", "x"], ["1.5", "true"]]);
}

#[test]
fn a_range_ends_where_it_says_in_equal_differences_or_ratios() {
    let d = design(
        "design = \"grid\"\n[factors]\na = { from = -1, to = 0.1, points = 12 }\nb = { from = 1e-5, to = 1e-1, points = 5, spacing = \"log\" }",
    );
    let (a, b) = (numbers(&d, 0), numbers(&d, 1));
    assert_eq!((d.runs(), a[0], a[59], b[0], b[59]), (60, -1.0, 0.1, 1e-5, 1e-1));
    for (at, exact) in [1e-5, 1e-4, 1e-3, 1e-2, 1e-1].into_iter().enumerate() {
        assert!((b[at] / exact - 1.0).abs() < 1e-14, "{}", b[at]);
        assert!((a[5 * at] - (-1.0 + 0.1 * at as f64)).abs() < 1e-15, "{}", a[5 * at]);
    }
}

#[test]
fn a_list_goes_on_in_step() {
    let d = design("design = \"list\"\n[factors]\na = { values = [1, 2] }\nb = { values = [0.5, -3] }");
    assert_eq!(texts(&d, 2), [["1", "0.5"], ["2", "-3"]]);
}

/// Whatever the seed: each of n layers of each factor has one run.
#[test]
fn a_latin_hypercube_uses_each_layer_once() {
    let of = |seed: u64, more: &str| {
        design(&format!(
            "design = \"latin-hypercube\"\nruns = 97\nseed = {seed}\n[factors]\na = {{ from = 0, to = 97 }}\nb = {{ from = 0, to = 97 }}\n{more}"
        ))
    };
    for seed in 0..20 {
        let d = of(seed, "");
        for factor in 0..2 {
            let layers: BTreeSet<u64> = numbers(&d, factor).iter().map(|x| x.floor() as u64).collect();
            assert_eq!(layers, (0..97).collect(), "seed {seed}");
        }
        assert_ne!(numbers(&d, 0), numbers(&d, 1));
        // Another factor changes nothing of those before it.
        assert_eq!(numbers(&d, 1), numbers(&of(seed, "c = { values = [1, 2, 3] }"), 1));
    }
    assert_ne!(numbers(&of(1, ""), 0), numbers(&of(2, ""), 0));
}

fn sobol(runs: u64, seed: &str, factors: usize) -> SweepDesign {
    let factors: String = (0..factors).map(|f| format!("f{f} = {{ from = 0, to = 1 }}\n")).collect();
    design(&format!("design = \"sobol\"\nruns = {runs}\n{seed}\n[factors]\n{factors}"))
}

/// The ten points in three dimensions that Joe and Kuo print with their program.
#[test]
fn the_sobol_sequence_is_that_of_joe_and_kuo() {
    let printed = [
        [0.0, 0.0, 0.0],
        [0.5, 0.5, 0.5],
        [0.75, 0.25, 0.25],
        [0.25, 0.75, 0.75],
        [0.375, 0.375, 0.625],
        [0.875, 0.875, 0.125],
        [0.625, 0.125, 0.875],
        [0.125, 0.625, 0.375],
        [0.1875, 0.3125, 0.9375],
        [0.6875, 0.8125, 0.4375],
    ];
    let d = sobol(10, "", 3);
    for (at, point) in printed.iter().enumerate() {
        for (factor, x) in point.iter().enumerate() {
            assert_eq!(numbers(&d, factor)[at], *x, "point {at}, dimension {factor}");
        }
    }
}

/// The first 2^k points have one in each of 2^k layers of every dimension, shifted or not.
#[test]
fn all_dimensions_of_the_sobol_sequence_are_even() {
    for seed in ["", "seed = 5"] {
        let d = sobol(1024, seed, MOST_SOBOL);
        for factor in 0..MOST_SOBOL {
            let layers: BTreeSet<u64> =
                numbers(&d, factor).iter().map(|x| (x * 1024.0).floor() as u64).collect();
            assert_eq!(layers.len(), 1024, "dimension {factor}");
        }
    }
    assert_ne!(numbers(&sobol(4, "seed = 5", 1), 0), numbers(&sobol(4, "", 1), 0));
}

#[test]
fn what_is_drawn_falls_on_all_values_of_a_list_alike() {
    let d = design("design = \"sobol\"\nruns = 64\n[factors]\na = { values = [\"p\", \"q\", \"r\", \"s\"] }");
    for word in ["p", "q", "r", "s"] {
        assert_eq!(texts(&d, 1).iter().filter(|t| t[0] == word).count(), 16);
    }
}
