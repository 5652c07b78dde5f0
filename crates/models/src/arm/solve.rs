//! Symmetric matrices of fixed capacity and the solution of M a = b in some of its rows.

use super::MAX_DOFS;
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// Rows of usual arms.
const USUAL_ROWS: usize = 9;

/// A symmetric matrix; the lower triangle, row by row.
#[derive(Clone, Copy, Debug)]
pub struct Symmetric<T> {
    lower: [T; MAX_DOFS * (MAX_DOFS + 1) / 2],
}

#[inline]
fn place(i: usize, j: usize) -> usize {
    let (i, j) = (i.max(j), i.min(j));
    i * (i + 1) / 2 + j
}

impl<T: Scalar> Symmetric<T> {
    /// All 0.
    pub fn zero() -> Self {
        Self { lower: [T::zero(); MAX_DOFS * (MAX_DOFS + 1) / 2] }
    }
    /// Element (i, j).
    #[inline]
    pub fn at(&self, i: usize, j: usize) -> T {
        self.lower[place(i, j)]
    }
    /// Adds to element (i, j) and (j, i).
    #[inline]
    pub fn add(&mut self, i: usize, j: usize, value: T) {
        self.lower[place(i, j)] += value;
    }
    /// (M v)_i over the elements of `v`.
    pub fn row_times(&self, i: usize, v: &[T]) -> T {
        v.iter().enumerate().fold(T::zero(), |sum, (j, v)| sum + self.at(i, j) * *v)
    }

    /// Solves M\[free, free\] a = b in the rows `free` (at most [`MAX_DOFS`]); `b` becomes a there and stays as
    /// it is elsewhere.
    ///
    /// # Errors
    /// The first row that shows M not to be positive definite; the solution is NaN then.
    pub fn solve(&self, free: &[usize], b: &mut [T]) -> Result<(), usize> {
        // Clearing the largest matrix costs more than the solution of a usual one.
        if free.len() <= USUAL_ROWS {
            self.solve_in(&mut [T::zero(); USUAL_ROWS * USUAL_ROWS], free, b)
        } else {
            self.solve_in(&mut [T::zero(); MAX_DOFS * MAX_DOFS], free, b)
        }
    }
    fn solve_in(&self, factors: &mut [T], free: &[usize], b: &mut [T]) -> Result<(), usize> {
        let n = free.len();
        let mut rhs = [T::zero(); MAX_DOFS];
        for (i, row) in free.iter().enumerate() {
            rhs[i] = b[*row];
            for (j, column) in free[..=i].iter().enumerate() {
                factors[i * n + j] = self.at(*row, *column);
            }
        }
        let definite = ldl_factor(&mut factors[..n * n], n);
        if definite.is_ok() {
            ldl_solve(&factors[..n * n], n, &mut rhs[..n]);
        } else {
            rhs = [T::constant(f64::NAN); MAX_DOFS];
        }
        free.iter().zip(rhs).for_each(|(row, a)| b[*row] = a);
        definite.map_err(|e| free[e.index])
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
            m.solve(free, &mut x).unwrap();
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
    fn a_singular_matrix_names_its_row() {
        let mut m = Symmetric::zero();
        (1..3).for_each(|i| (1..=i).for_each(|j| m.add(i, j, 1.0)));
        let mut b = [1.0; 3];
        assert_eq!(m.solve(&[1, 2], &mut b), Err(2));
        assert!(b[1].is_nan() && b[0] == 1.0);
    }
}
