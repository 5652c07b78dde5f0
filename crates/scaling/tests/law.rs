//! The law, against the paper's tables.

use proptest::prelude::*;
use trueup_scaling::{GivenExponent, Lawless, ScalingLaw, UnitDimension};

fn law(lambda: f64, back: bool, given: &[(&str, f64)]) -> ScalingLaw {
    let given =
        given.iter().map(|(name, exponent)| GivenExponent { name: (*name).into(), exponent: *exponent });
    ScalingLaw { lambda, back, given: given.collect() }
}

/// Paper 002, Table 1: the twelve exponents of golden fact C43. Checks CON-7.
#[test]
fn units_give_the_twelve_exponents_of_table_1() {
    for (unit, printed) in [
        ("m", 1.0),
        ("s", 1.0),
        ("Hz", -1.0),
        ("N", 2.0),
        ("kg", 3.0),
        ("N/m", 1.0),
        ("kg.m2", 5.0),
        ("m/s", 0.0),
        ("m/s2", -1.0),
        ("J", 3.0),
        ("W", 2.0),
        ("N.s/m", 2.0),
    ] {
        assert_eq!(law(0.3, false, &[]).exponent("x", UnitDimension::named(unit)), Ok(printed), "{unit}");
    }
}

/// Of turning: energy by angle, and the stiffness and damping of joints.
#[test]
fn an_angle_is_a_number() {
    for (unit, w) in
        [("rad", 0.0), ("rad/s", -1.0), ("N.m", 3.0), ("N.m/rad", 3.0), ("N.m.s/rad", 4.0), ("1", 0.0)]
    {
        assert_eq!(law(0.3, false, &[]).exponent("x", UnitDimension::named(unit)), Ok(w), "{unit}");
    }
}

/// Paper 002, Tables 2 and 7 (lambda = 0.3), to the digits printed: property, unit, full size, scaled. Checks CON-7.
#[test]
fn tables_2_and_7_come_out() {
    for (unit, full, printed, digits) in [
        ("kg", 7900.0, 213.3, 1),
        ("kg.m2", 129_112.2, 313.7, 1),
        ("kg", 1500.0, 40.5, 1),
        ("kg.m2", 762.0, 1.85, 2),
        ("m", 4.2, 1.26, 2),
        ("cm", 7.0, 2.1, 1),
        ("s", 5.0, 1.5, 1),
        ("kg", 1720.0, 46.4, 1),
        ("m", 5.0, 1.5, 1),
        ("m", 1.3, 0.39, 2),
        ("kg", 58.7, 1.6, 1),
        ("N/m", 20_000.0, 6000.0, 0),
        ("N.s/m", 900.0, 81.0, 0),
        ("m/s", 0.005, 0.005, 3),
    ] {
        let scaled = law(0.3, false, &[]).of("x", UnitDimension::named(unit)).unwrap().apply(full);
        let rounded = format!("{scaled:.digits$}");
        assert_eq!(rounded.parse::<f64>().unwrap(), printed, "{full} {unit}: {scaled}");
    }
    // What the print has otherwise: 0.63 m for the arm and 10 s for the run.
    let scaled =
        |unit: &str, x: f64| law(0.3, false, &[]).of("x", UnitDimension::named(unit)).unwrap().apply(x);
    assert_eq!((scaled("m", 2.12), scaled("s", 30.0), scaled("m", 10.0)), (0.636, 9.0, 3.0));
}

#[test]
fn what_has_no_law_is_refused_unless_an_exponent_is_given() {
    let of = |given: &[(&str, f64)], name: &str, unit: &str| {
        law(0.3, false, given).exponent(name, UnitDimension::named(unit))
    };
    assert_eq!(of(&[], "k", "N.m/A"), Err(Lawless { base: "A" }));
    assert_eq!(of(&[], "t", "K"), Err(Lawless { base: "K" }));
    assert_eq!(of(&[], "u", "V"), Err(Lawless { base: "A" }));
    assert_eq!(of(&[], "x", "furlong"), Err(Lawless { base: "" }));
    assert_eq!(of(&[("A", 1.5)], "k", "N.m/A"), Ok(1.5));
    assert_eq!(of(&[("A", 1.5), ("k", 2.0)], "k[2]", "N.m/A"), Ok(2.0));
    assert_eq!(of(&[("x", -1.0)], "x", "furlong"), Ok(-1.0));
    assert!(Lawless { base: "A" }.to_string().contains("--exponent A=W"));
}

/// 20 degC are 293.15 K; half of that is -126.575 degC. A difference of 20 degC is halved.
#[test]
fn a_temperature_scales_from_its_zero() {
    let by = law(0.5, false, &[("K", 1.0)]).of("t", UnitDimension::named("degC")).unwrap();
    assert!((by.apply(20.0) + 126.575).abs() < 1e-12, "{}", by.apply(20.0));
}

#[test]
fn decimal_numbers_stay_short() {
    for (lambda, unit, x, text) in
        [(0.3, "kg", 7900.0, "213.3"), (0.1, "kg.m2", 4.2e-4, "4.2e-9"), (0.25, "s", 1.0, "0.25")]
    {
        let scaled = law(lambda, false, &[]).of("x", UnitDimension::named(unit)).unwrap().apply(x);
        assert_eq!(format!("{scaled:?}"), text);
    }
}

proptest! {
    /// To and fro is the same to round-off, and either way is lambda^w to round-off.
    #[test]
    fn back_undoes_it(x in prop::num::f64::NORMAL, lambda in 0.01_f64..100.0, w in -6_i32..=6) {
        let x = x % 1e100;
        let of = |back| law(lambda, back, &[("x", f64::from(w))]).of("x", None).unwrap();
        let there = of(false).apply(x);
        prop_assume!(x.abs() > 1e-100 && x.abs() < 1e100);
        prop_assert!((of(true).apply(there) / x - 1.0).abs() < 1e-15, "{}", of(true).apply(there) / x - 1.0);
        prop_assert!((there / (x * lambda.powi(w)) - 1.0).abs() < 1e-14);
    }
}
