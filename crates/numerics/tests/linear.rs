//! Factorisations against products.
#![allow(missing_docs, clippy::unwrap_used)]

use proptest::prelude::*;
use trueup_numerics::Dual;
use trueup_numerics::linear::{SingularMatrix, ldl_factor, ldl_solve, lu_factor, lu_solve};

fn times(a: &[f64], x: &[f64]) -> Vec<f64> {
    a.chunks(x.len()).map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum()).collect()
}
fn residual(a: &[f64], x: &[f64], b: &[f64]) -> f64 {
    times(a, x).iter().zip(b).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn lu_solves(n in 1..9usize, values in prop::collection::vec(-1.0..1.0f64, 90)) {
        let (a, b) = (&values[..n * n], &values[81..81 + n]);
        let (mut lu, mut pivots, mut x) = (a.to_vec(), vec![0; n], b.to_vec());
        lu_factor(&mut lu, n, &mut pivots).unwrap();
        lu_solve(&lu, n, &pivots, &mut x);
        let size = x.iter().fold(1.0f64, |s, v| s.max(v.abs()));
        prop_assert!(residual(a, &x, b) < 1e-13 * size);
    }

    #[test]
    fn ldl_solves(n in 1..9usize, values in prop::collection::vec(-1.0..1.0f64, 90)) {
        let (g, b) = (&values[..n * n], &values[81..81 + n]);
        let mut a = vec![0.0; n * n];
        for i in 0..n {
            for j in 0..n {
                a[i * n + j] = (0..n).map(|k| g[i * n + k] * g[j * n + k]).sum::<f64>() + f64::from(u8::from(i == j));
            }
        }
        // Room behind the matrix is left alone.
        let (mut ldl, mut x) = ([&a[..], &[7.0; 9]].concat(), b.to_vec());
        ldl_factor(&mut ldl, n).unwrap();
        ldl_solve(&ldl, n, &mut x);
        prop_assert!(residual(&a, &x, b) < 1e-13);
        prop_assert_eq!(&ldl[n * n..], &[7.0; 9]);
    }
}

#[test]
fn derivative_of_a_solution() {
    // d(A^-1 b) = -A^-1 dA A^-1 b; A = [[2 + e, 1], [1, 3]], b = [1, 0]: x = (3, -1) / (5 + 3 e).
    let c = |v| Dual::<1>::new(v, [0.0]);
    let a = [Dual::variable(2.0, 0), c(1.0), c(1.0), c(3.0)];
    for lu in [true, false] {
        let (mut m, mut x, mut pivots) = (a, [c(1.0), c(0.0)], [0; 2]);
        if lu {
            lu_factor(&mut m, 2, &mut pivots).unwrap();
            lu_solve(&m, 2, &pivots, &mut x);
        } else {
            ldl_factor(&mut m, 2).unwrap();
            ldl_solve(&m, 2, &mut x);
        }
        assert!((x[0].eps[0] + 9.0 / 25.0).abs() < 1e-15 && (x[1].eps[0] - 3.0 / 25.0).abs() < 1e-15);
    }
}

#[test]
fn singular_matrices_are_named() {
    let singular = lu_factor(&mut [1.0, 2.0, 2.0, 4.0], 2, &mut [0; 2]);
    assert_eq!(singular, Err(SingularMatrix { index: 1, pivot: 0.0 }));
    assert!(lu_factor(&mut [f64::NAN], 1, &mut [0]).is_err());
    assert_eq!(ldl_factor(&mut [1.0, 0.0, 2.0, 4.0], 2), Err(SingularMatrix { index: 1, pivot: 0.0 }));
    assert_eq!(ldl_factor(&mut [1.0, 0.0, 3.0, 4.0], 2), Err(SingularMatrix { index: 1, pivot: -5.0 }));
    assert!(ldl_factor(&mut [-1.0], 1).is_err());
}
