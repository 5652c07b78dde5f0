//! Small systems of equations by Cholesky's factors, in the arrays of a plant.

use super::state::COORDINATES;

pub(super) type TrialVector = [f64; COORDINATES];
/// Column by column; only what is on and below the diagonal is read.
pub(super) type TrialMatrix = [TrialVector; COORDINATES];

/// Replaces `m` = L L' by L, for the first `n` coordinates; `false`: it is not positive definite.
#[inline]
pub(super) fn factor(m: &mut TrialMatrix, n: usize) -> bool {
    for j in 0..n {
        let (done, rest) = m.split_at_mut(j);
        let column = &mut rest[0];
        for other in done {
            let factor = -other[j];
            for (a, b) in column[j..n].iter_mut().zip(&other[j..n]) {
                *a += factor * b;
            }
        }
        if column[j].is_nan() || column[j] <= 0.0 {
            return false;
        }
        let root = column[j].sqrt();
        column[j] = root;
        column[j + 1..n].iter_mut().for_each(|a| *a /= root);
    }
    true
}

/// Replaces `b` by x of L L' x = `b`.
#[inline]
pub(super) fn solve(l: &TrialMatrix, n: usize, b: &mut TrialVector) {
    for i in 0..n {
        let x = b[i] / l[i][i];
        b[i] = x;
        for (b, l) in b[i + 1..n].iter_mut().zip(&l[i][i + 1..n]) {
            *b -= x * l;
        }
    }
    for i in (0..n).rev() {
        let part = |k: usize| l[i][k] * b[k];
        let sum = if i == 0 {
            // The first row's sum is that of nalgebra, in two halves: sealed cases were made so.
            (1..=4).map(|k| part(k) + if k + 4 < n { part(k + 4) } else { 0.0 }).sum::<f64>()
        } else {
            (i + 1..n).map(part).sum::<f64>()
        };
        b[i] = (b[i] - sum) / l[i][i];
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{SMatrix, SVector};
    use rand::{Rng, SeedableRng};

    use super::*;

    /// Random systems: the digits are those of the library that made the cases of today's keys.
    #[test]
    fn its_digits_are_those_of_nalgebra() {
        for seed in 0..200 {
            let d = &mut rand_chacha::ChaCha8Rng::seed_from_u64(seed);
            let n = d.random_range(6..=COORDINATES);
            let root = SMatrix::<f64, COORDINATES, COORDINATES>::from_fn(|i, j| {
                if i < n && j < n { d.random_range(-1.0..1.0) } else { 0.0 }
            });
            let mut m = root * root.transpose();
            (0..COORDINATES).for_each(|i| m[(i, i)] += if i < n { 0.1 } else { 1.0 });
            let f = SVector::from_fn(|i, _| if i < n { d.random_range(-1.0..1.0) } else { 0.0 });
            let expected = m.cholesky().map(|l| l.solve(&f));
            let (mut l, mut x) = (m.data.0, f.data.0[0]);
            assert!(factor(&mut l, n));
            solve(&l, n, &mut x);
            assert_eq!(Some(x), expected.map(|x: SVector<f64, COORDINATES>| x.data.0[0]), "seed {seed}");
        }
        for bad in [0.0, -1.0, f64::NAN] {
            assert!(!factor(&mut [[bad; COORDINATES]; COORDINATES], 6));
        }
    }
}
