//! Symmetric matrices of fixed capacity and the solution of M a = b by L D L^T.

use super::MAX_DOFS;
use trueup_numerics::Scalar;

const PACKED: usize = MAX_DOFS * (MAX_DOFS + 1) / 2;

/// A symmetric matrix; the lower triangle, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Symmetric<T> {
    lower: [T; PACKED],
}

/// The element (i, j), j <= i.
fn place(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

impl<T: Scalar> Symmetric<T> {
    /// All 0.
    pub fn zero() -> Self {
        Self { lower: [T::zero(); PACKED] }
    }
    /// Element (i, j).
    pub fn at(&self, i: usize, j: usize) -> T {
        self.lower[place(i.max(j), i.min(j))]
    }
    /// Adds to element (i, j) and (j, i).
    pub fn add(&mut self, i: usize, j: usize, value: T) {
        self.lower[place(i.max(j), i.min(j))] += value;
    }
    /// (M v)_i over the elements of `v`.
    pub fn row_times(&self, i: usize, v: &[T]) -> T {
        v.iter().enumerate().fold(T::zero(), |sum, (j, v)| sum + self.at(i, j) * *v)
    }
}

/// The factors of the rows and columns `free` of a matrix.
#[derive(Clone, Copy, Debug)]
pub struct Factors<'a, T> {
    free: &'a [usize],
    lower: [T; PACKED],
    pivot: [T; MAX_DOFS],
    first_bad: Option<usize>,
}

impl<'a, T: Scalar> Factors<'a, T> {
    /// Factors M\[free, free\]; `free` ascending, at most [`MAX_DOFS`] entries.
    pub fn new(m: &Symmetric<T>, free: &'a [usize]) -> Self {
        let mut f = Self { free, lower: [T::zero(); PACKED], pivot: [T::zero(); MAX_DOFS], first_bad: None };
        for (i, row) in free.iter().enumerate() {
            let begin = place(i, 0);
            let mut pivot = m.at(*row, *row);
            let least = pivot.value() * 1e-13;
            // w_ij = l_ij d_j first, then l_ij.
            for (j, column) in free[..i].iter().enumerate() {
                let other = place(j, 0);
                let mut w = m.at(*row, *column);
                for k in 0..j {
                    w -= f.lower[begin + k] * f.lower[other + k];
                }
                f.lower[begin + j] = w;
            }
            for j in 0..i {
                let w = f.lower[begin + j];
                let l = w / f.pivot[j];
                pivot -= w * l;
                f.lower[begin + j] = l;
            }
            if pivot.value().is_nan() || pivot.value() <= least.max(0.0) {
                f.first_bad = f.first_bad.or(Some(*row));
            }
            f.pivot[i] = pivot;
        }
        f
    }
    /// The first row whose pivot is not positive beyond rounding; none: the matrix is positive definite.
    pub fn not_definite_at(&self) -> Option<usize> {
        self.first_bad
    }
    /// b becomes the solution in the free rows; the others are left alone.
    pub fn solve(&self, b: &mut [T]) {
        let free = self.free;
        for i in 0..free.len() {
            let mut s = b[free[i]];
            for j in 0..i {
                s -= self.lower[place(i, j)] * b[free[j]];
            }
            b[free[i]] = s;
        }
        for i in (0..free.len()).rev() {
            let mut s = b[free[i]] / self.pivot[i];
            for k in i + 1..free.len() {
                s -= self.lower[place(k, i)] * b[free[k]];
            }
            b[free[i]] = s;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_free_part_is_solved_and_the_rest_left_alone() {
        let a = [[4.0, 1.0, -2.0], [1.0, 3.0, 0.5], [-2.0, 0.5, 5.0]];
        let mut m = Symmetric::zero();
        (0..3).for_each(|i| (0..=i).for_each(|j| m.add(i, j, a[i][j])));
        for free in [&[0, 1, 2][..], &[0, 2], &[1]] {
            let mut x = [1.0, -2.0, 3.0];
            let b = x;
            let f = Factors::new(&m, free);
            assert_eq!(f.not_definite_at(), None);
            f.solve(&mut x);
            for i in 0..3 {
                if free.contains(&i) {
                    let product: f64 = free.iter().map(|j| a[i][*j] * x[*j]).sum();
                    assert!((product - b[i]).abs() < 1e-14);
                } else {
                    assert_eq!(x[i], b[i]);
                }
            }
        }
    }

    #[test]
    fn a_singular_matrix_is_not_called_definite() {
        let mut m = Symmetric::zero();
        (0..2).for_each(|i| (0..=i).for_each(|j| m.add(i, j, 1.0)));
        assert_eq!(Factors::new(&m, &[0, 1]).not_definite_at(), Some(1));
    }
}
