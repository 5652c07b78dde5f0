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
    /// Of each window: readings by a step of each value, and by a step of each first state.
    pub(super) fn new(windows: Vec<(Vec<Vec<f64>>, Vec<Vec<f64>>)>, values: &[f64], steps: &[f64]) -> Self {
        let one = |(by_value, by_state): (Vec<Vec<f64>>, Vec<Vec<f64>>)| {
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
