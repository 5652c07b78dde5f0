//! A refit by slopes that are known: least squares of values that all windows share and of first states of each.

use nalgebra::{DMatrix, DVector};

use crate::tune::{DOUBT, FIRST};

/// Slopes of one window, eliminated of its first states.
struct WindowSlopes {
    /// Readings by values, by first states.
    values: DMatrix<f64>,
    states: DMatrix<f64>,
    /// First states that fit best to readings: (S'S + prior)^-1 S'.
    fit: DMatrix<f64>,
}

/// Readings of a window by a step of each value, and by a step of each first state.
type SlopesOfWindow = (Vec<Vec<f64>>, Vec<Vec<f64>>);

/// The slopes of all windows.
pub(super) struct LinearRefit {
    windows: Vec<WindowSlopes>,
    /// Prior standard deviation of each value in its steps.
    doubts: Vec<f64>,
}

fn columns(list: &[Vec<f64>], rows: usize) -> DMatrix<f64> {
    DMatrix::from_fn(rows, list.len(), |r, c| list[c][r])
}

impl LinearRefit {
    pub(super) fn new(windows: Vec<SlopesOfWindow>, values: &[f64], steps: &[f64]) -> Self {
        let one = |(by_value, by_state): SlopesOfWindow| {
            let rows = by_state.first().map_or(0, Vec::len);
            let (values, states) = (columns(&by_value, rows), columns(&by_state, rows));
            let mut normal = states.tr_mul(&states);
            (0..normal.nrows()).for_each(|i| normal[(i, i)] += FIRST.powi(-2));
            let fit = normal
                .cholesky()
                .map_or_else(|| DMatrix::zeros(states.ncols(), rows), |l| l.solve(&states.transpose()));
            WindowSlopes { values, states, fit }
        };
        let doubts = values.iter().zip(steps).map(|(v, s)| (DOUBT * v / s).abs()).collect();
        Self { windows: windows.into_iter().map(one).collect(), doubts }
    }

    /// What a refit leaves of these deviations, window by window.
    pub(super) fn left(&self, off: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let p = self.doubts.len();
        let (mut normal, mut right) = (DMatrix::zeros(p, p), DVector::zeros(p));
        let without = |w: &WindowSlopes, y: DMatrix<f64>| -> DMatrix<f64> { &y - &w.states * (&w.fit * &y) };
        for (w, y) in self.windows.iter().zip(off) {
            let freed = without(w, w.values.clone());
            normal += w.values.tr_mul(&freed);
            right += freed.tr_mul(&DVector::from_column_slice(y));
        }
        (0..p).for_each(|i| normal[(i, i)] += self.doubts[i].powi(-2));
        let found = normal.cholesky().map_or_else(|| DVector::zeros(p), |l| l.solve(&right));
        let rest = |(w, y): (&WindowSlopes, &Vec<f64>)| {
            let y = DVector::from_column_slice(y) - &w.values * &found;
            without(w, DMatrix::from_column_slice(y.len(), 1, y.as_slice())).as_slice().to_vec()
        };
        self.windows.iter().zip(off).map(rest).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::SeededDraw;

    /// Against the same least squares with all unknowns at once.
    #[test]
    fn it_leaves_what_one_fit_of_all_leaves() {
        let mut d = SeededDraw::new("linear refit", 1, 0, 0);
        let (rows, p, k, count) = (12, 3, 2, 4);
        let mut list =
            |n: usize| -> Vec<Vec<f64>> { (0..n).map(|_| (0..rows).map(|_| d.normal()).collect()).collect() };
        let windows: Vec<_> = (0..count).map(|_| (list(p), list(k))).collect();
        let off = list(count);
        let (values, steps) = ([2.0, -1.0, 0.5], [0.1, 0.2, 0.05]);
        let left = LinearRefit::new(windows.clone(), &values, &steps).left(&off);
        let all = p + count * k;
        let mut whole = DMatrix::zeros(count * rows + all, all);
        let mut right = DVector::zeros(count * rows + all);
        for w in 0..count {
            for r in 0..rows {
                right[w * rows + r] = off[w][r];
                (0..p).for_each(|i| whole[(w * rows + r, i)] = windows[w].0[i][r]);
                (0..k).for_each(|i| whole[(w * rows + r, p + w * k + i)] = windows[w].1[i][r]);
            }
        }
        for i in 0..all {
            let doubt = if i < p { (DOUBT * values[i] / steps[i]).abs() } else { FIRST };
            whole[(count * rows + i, i)] = 1.0 / doubt;
        }
        let found = whole.clone().svd(true, true).solve(&right, 1e-15).unwrap();
        let rest = right - whole * found;
        for w in 0..count {
            for r in 0..rows {
                assert!((left[w][r] - rest[w * rows + r]).abs() < 1e-12);
            }
        }
    }
}
