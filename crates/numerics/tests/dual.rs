//! Duals against `f64` (values, bit by bit), the crate num-dual and central differences (derivatives).
#![allow(missing_docs)]

use num_dual::{Dual64, DualNum};
use proptest::prelude::*;
use trueup_numerics::{Dual, Scalar};

/// One expression that uses every function, for `a`, `b` > 0.
fn ours<T: Scalar>(a: T, b: T) -> [T; 12] {
    let (s, c) = (a * b).sin_cos();
    [
        s * c + a / b,
        (a - b).exp(),
        (a + b).ln(),
        (a * a + b).sqrt(),
        (a - b).tanh(),
        (a - b).powi(3),
        a.powf(b),
        (a - b).atan2(a + b),
        (a - b).abs() * 2.0 - 1.0,
        a.max(b) + a.min(b) / 3.0,
        -(a.sin() / b.cos()),
        b.powi(-2) + 4.0,
    ]
}
fn theirs(a: Dual64, b: Dual64) -> [Dual64; 12] {
    let (s, c) = (a * b).sin_cos();
    let larger = if b.re > a.re { (b, a) } else { (a, b) };
    let d = a - b;
    [
        s * c + a / b,
        d.exp(),
        (a + b).ln(),
        (a * a + b).sqrt(),
        d.tanh(),
        d.powi(3),
        (b * a.ln()).exp(),
        d.atan2(a + b),
        if d.re < 0.0 { -d } else { d } * 2.0 - 1.0,
        larger.0 + larger.1 / 3.0,
        -(a.sin() / b.cos()),
        b.powi(-2) + 4.0,
    ]
}

proptest! {
    #[test]
    fn values_equal_f64_bit_by_bit(a in 0.01..10.0f64, b in 0.01..10.0f64) {
        let dual = ours(Dual::<2>::variable(a, 0), Dual::variable(b, 1));
        for (k, (d, v)) in dual.iter().zip(ours(a, b)).enumerate() {
            prop_assert_eq!(d.re.to_bits(), v.to_bits(), "expression {}", k);
        }
    }

    #[test]
    fn derivatives_equal_num_dual(a in 0.01..10.0f64, b in 0.01..10.0f64) {
        let dual = ours(Dual::<2>::variable(a, 0), Dual::variable(b, 1));
        let (fixed, moving) = (Dual64::from, |v| Dual64::new(v, 1.0));
        let along = [theirs(moving(a), fixed(b)), theirs(fixed(a), moving(b))];
        for k in 0..dual.len() {
            for j in 0..2 {
                let (d, n) = (dual[k].eps[j], along[j][k].eps);
                prop_assert!((d - n).abs() <= 1e-13 * (1.0 + n.abs()), "expression {}, direction {}: {} / {}", k, j, d, n);
            }
        }
    }

    #[test]
    fn derivatives_equal_central_differences(a in 0.1..1.3f64, b in 0.1..1.3f64) {
        prop_assume!((a - b).abs() > 1e-3); // abs, max and min have a kink there
        let (h, dual) = (1e-5, ours(Dual::<2>::variable(a, 0), Dual::variable(b, 1)));
        let steps = [[ours(a + h, b), ours(a - h, b)], [ours(a, b + h), ours(a, b - h)]];
        for k in 0..dual.len() {
            for j in 0..2 {
                let (d, n) = (dual[k].eps[j], (steps[j][0][k] - steps[j][1][k]) / (2.0 * h));
                // Truncation of b^-2 at b = 0.1: h^2 / 6 * 24 b^-5.
                prop_assert!((d - n).abs() <= 1e-6 * (1.0 + n.abs()) + 4e-5, "expression {}, direction {}: {} / {}", k, j, d, n);
            }
        }
    }
}

#[test]
fn corners_have_neither_nan_nor_infinity() {
    let zero = Dual::<1>::variable(0.0, 0);
    let exponent = |n| Dual::constant(n);
    for d in [
        zero.sqrt(),
        zero.powf(exponent(0.5)),
        zero.powf(exponent(1.0)),
        zero.powf(exponent(2.0)),
        zero.atan2(zero),
        zero.powi(0),
        Dual::<1>::variable(1e4, 0).tanh(),
        Dual::<1>::constant(0.0).ln() * 0.0 + 1.0,
    ] {
        assert!(d.eps[0].is_finite(), "{d:?}");
    }
    assert_eq!(zero.powf(exponent(1.0)).eps[0], 1.0);
}
