//! Small dense systems on flat row-major slices; the caller gives all memory.

use crate::Scalar;

/// A matrix that cannot be factored (for [`ldl_factor`]: one that is not positive definite).
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("singular matrix: pivot {pivot:e} in row {index}")]
pub struct SingularMatrix {
    /// Row of the pivot, from 0.
    pub index: usize,
    /// Its value.
    pub pivot: f64,
}

/// P A = L U with partial pivoting, in place; `pivots[k]` is the row swapped with row k.
///
/// # Errors
/// A pivot that is zero or not finite.
pub fn lu_factor<T: Scalar>(a: &mut [T], n: usize, pivots: &mut [usize]) -> Result<(), SingularMatrix> {
    for k in 0..n {
        let size = |i: usize| a[i * n + k].value().abs();
        let row = (k + 1..n).fold(k, |best, i| if size(i) > size(best) { i } else { best });
        let pivot = a[row * n + k];
        if pivot.value() == 0.0 || !pivot.value().is_finite() {
            return Err(SingularMatrix { index: k, pivot: pivot.value() });
        }
        pivots[k] = row;
        if row != k {
            for j in 0..n {
                a.swap(k * n + j, row * n + j);
            }
        }
        for i in k + 1..n {
            let l = a[i * n + k] / pivot;
            a[i * n + k] = l;
            for j in k + 1..n {
                a[i * n + j] -= l * a[k * n + j];
            }
        }
    }
    Ok(())
}

/// Solves A x = b with the factors of [`lu_factor`]; `b` becomes x.
pub fn lu_solve<T: Scalar>(lu: &[T], n: usize, pivots: &[usize], b: &mut [T]) {
    for k in 0..n {
        b.swap(k, pivots[k]);
    }
    for i in 1..n {
        for j in 0..i {
            b[i] -= lu[i * n + j] * b[j];
        }
    }
    for i in (0..n).rev() {
        for j in i + 1..n {
            b[i] -= lu[i * n + j] * b[j];
        }
        b[i] /= lu[i * n + i];
    }
}

/// A = L D L^T of a symmetric positive definite matrix, in place: reads the lower triangle and the diagonal, writes L below the
/// diagonal, D on it, D L^T above it. What the inner loops run over is contiguous.
///
/// # Errors
/// A pivot that is not positive beyond rounding, relative to the diagonal element it came from.
pub fn ldl_factor<T: Scalar>(a: &mut [T], n: usize) -> Result<(), SingularMatrix> {
    let a = &mut a[..n * n];
    for j in 0..n {
        let diagonal = a[j * n + j].value();
        for k in 0..j {
            let l = a[j * n + k];
            a[j * n + j] -= l * l * a[k * n + k];
        }
        let d = a[j * n + j];
        // Written such that NaN fails too.
        if !(d.value() > n as f64 * f64::EPSILON * diagonal && d.value().is_finite()) {
            return Err(SingularMatrix { index: j, pivot: d.value() });
        }
        let (above, below) = a.split_at_mut((j + 1) * n);
        let row = &mut above[j * n..][j + 1..];
        for (i, lower) in below.chunks_exact_mut(n).enumerate() {
            row[i] = lower[j];
            lower[j] /= d;
            let l = lower[j];
            lower[j + 1..].iter_mut().zip(&row[..i]).for_each(|(to, u)| *to -= l * *u);
        }
    }
    Ok(())
}

/// Solves A x = b with the factors of [`ldl_factor`]; `b` becomes x.
pub fn ldl_solve<T: Scalar>(ldl: &[T], n: usize, b: &mut [T]) {
    for j in 0..n {
        let row = &ldl[j * n..][..n];
        b[j] /= row[j];
        let y = b[j];
        b[j + 1..n].iter_mut().zip(&row[j + 1..]).for_each(|(b, u)| *b -= *u * y);
    }
    for j in (1..n).rev() {
        let x = b[j];
        b[..j].iter_mut().zip(&ldl[j * n..][..j]).for_each(|(b, l)| *b -= *l * x);
    }
}
