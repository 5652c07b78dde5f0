//! Small systems of equations by L D L'.

/// Solves `m` x = `b` in place for the first `n` unknowns; `m` symmetric, read on and below its diagonal, overwritten.
/// `false`: it is not positive definite.
#[inline]
pub(super) fn solve<const N: usize>(m: &mut [[f64; N]; N], n: usize, b: &mut [f64; N]) -> bool {
    for j in 0..n {
        let mut scaled = [0.0; N];
        let mut d = m[j][j];
        for k in 0..j {
            scaled[k] = m[j][k] * m[k][k];
            d -= m[j][k] * scaled[k];
        }
        if d.is_nan() || d <= 0.0 {
            return false;
        }
        m[j][j] = d;
        for i in j + 1..n {
            let mut x = m[i][j];
            for k in 0..j {
                x -= m[i][k] * scaled[k];
            }
            m[i][j] = x / d;
        }
    }
    for i in 0..n {
        for k in 0..i {
            b[i] -= m[i][k] * b[k];
        }
    }
    for i in 0..n {
        b[i] /= m[i][i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            b[i] -= m[k][i] * b[k];
        }
    }
    true
}
