//! Rates of joints for a task, by a damped inverse (CTS-5, CTS-6).

use super::super::measures::{NOTHING, orthogonal_rows};
use super::super::{MAX_BODIES, MAX_TIPS};
use trueup_numerics::Scalar;
use trueup_numerics::linear::{ldl_factor, ldl_solve};

/// Most components of a task.
pub(super) const MAX_ROWS: usize = 6 * MAX_TIPS;

/// Rows of a task by joints that may move for it.
#[derive(Clone, Debug)]
pub(super) struct TaskJacobian<T> {
    /// Row by row.
    pub(super) element: [[T; MAX_BODIES]; MAX_ROWS],
    pub(super) rows: usize,
    pub(super) columns: usize,
}

impl<T: Scalar> TaskJacobian<T> {
    pub(super) fn new() -> Self {
        Self { element: [[T::zero(); MAX_BODIES]; MAX_ROWS], rows: 0, columns: 0 }
    }

    /// Element by its place on the short and on the long side.
    fn at(&self, short: usize, long: usize) -> T {
        if self.wide() { self.element[short][long] } else { self.element[long][short] }
    }
    fn wide(&self) -> bool {
        self.rows <= self.columns
    }
    /// Lengths of the short and of the long side.
    fn sides(&self) -> (usize, usize) {
        if self.wide() { (self.rows, self.columns) } else { (self.columns, self.rows) }
    }

    /// The smallest singular value: directions from the values, its derivative is u . dJ w; 0 where nothing is controlled.
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    pub(super) fn smallest_singular_value(&self) -> T {
        let (short, long) = self.sides();
        let mut a = [[0.0; MAX_ROWS]; MAX_BODIES];
        let mut w = [[0.0; MAX_BODIES]; MAX_BODIES];
        for s in 0..short {
            (0..long).for_each(|l| a[s][l] = self.at(s, l).value());
            w[s][s] = 1.0;
        }
        orthogonal_rows(&mut a[..short], &mut w[..short]);
        let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let lengths = a[..short].iter().map(|v| length(v));
        let most = lengths.clone().fold(0.0, f64::max);
        let Some((k, least)) = lengths.enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else {
            return T::zero();
        };
        let mut value = T::zero();
        if least > NOTHING * most {
            for l in 0..long {
                (0..short).for_each(|s| value += self.at(s, l) * (w[k][s] * a[k][l] / least));
            }
        }
        value
    }

    /// Least squares with damping `square` = lambda^2: the smallest rates where rows are fewer than joints, the smallest
    /// error where they are more. `task` has as many values as there are rows, `rates` as there are columns.
    #[inline(never)] // arrays for the largest robot do not add up on the stack
    pub(super) fn solve(&self, square: T, task: &[T], rates: &mut [T]) {
        let (short, long) = self.sides();
        let mut gram = [T::zero(); MAX_BODIES * MAX_BODIES];
        for i in 0..short {
            for j in 0..=i {
                let mut sum = (0..long).fold(T::zero(), |sum, l| sum + self.at(i, l) * self.at(j, l));
                if i == j {
                    sum += square; // (CTS-6)
                }
                gram[i * short + j] = sum;
                gram[j * short + i] = sum;
            }
        }
        rates.fill(T::zero());
        let mut y = [T::zero(); MAX_BODIES];
        let y = &mut y[..short];
        if self.wide() {
            y.copy_from_slice(&task[..short]);
        } else {
            for (j, y) in y.iter_mut().enumerate() {
                *y = (0..self.rows).fold(T::zero(), |sum, i| sum + self.element[i][j] * task[i]);
            }
        }
        // Only values that are not finite, or a damping lost in rounding, give no factors: then nothing moves.
        if ldl_factor(&mut gram, short).is_err() {
            return;
        }
        ldl_solve(&gram, short, y);
        if self.wide() {
            for (j, rate) in rates.iter_mut().enumerate() {
                *rate = (0..short).fold(T::zero(), |sum, i| sum + self.element[i][j] * y[i]); // (CTS-5)
            }
        } else {
            rates.copy_from_slice(y);
        }
    }
}

/// lambda: 0 from `threshold` on, `most` at a singular value of 0, smooth in between.
pub(super) fn damping<T: Scalar>(smallest: T, threshold: T, most: T) -> T {
    if smallest.value() >= threshold.value() {
        return T::zero();
    }
    let share = smallest / threshold;
    most * (-(share * share) + 1.0) // (CTS-6)
}
