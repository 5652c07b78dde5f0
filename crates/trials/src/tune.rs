//! What a refit of parameters alone would leave: damped Gauss-Newton with differences, for the size of an effect.

use nalgebra::{DMatrix, DVector};

/// Responses of a simulation that knows no effect.
pub(crate) trait Bench {
    /// Response of run `run`, every channel divided by its scale.
    fn response(&self, run: usize, values: &[f64], initial: &[f64]) -> Vec<f64>;
}

/// A fit.
#[derive(Clone, Debug)]
pub(crate) struct Tuned {
    pub(crate) residual: Vec<Vec<f64>>,
}

fn sum_of_squares(r: &[Vec<f64>]) -> f64 {
    r.iter().flatten().map(|e| e * e).sum()
}

/// How far off a parameter may be, as a share, for as much as one reading tells: what nothing shows stays where it is, so that
/// it does not keep the rest from being fitted.
const DOUBT: f64 = 0.3;
/// Steps at the most.
const ROUNDS: usize = 8;
/// Damping of a step, shares of the diagonal: the first that helps.
const DAMPINGS: [f64; 4] = [1e-9, 1e-4, 1e-1, 10.0];

/// Fits `values` (steps of differences relative to `value_steps`) and the initial states to `measured`.
pub(crate) fn tune(
    bench: &dyn Bench,
    measured: &[Vec<f64>],
    start: &[f64],
    value_steps: &[f64],
    initial: &[Vec<f64>],
    initial_steps: &[f64],
) -> Tuned {
    let (runs, p, k) = (measured.len(), start.len(), initial_steps.len());
    let residuals = |values: &[f64], initial: &[Vec<f64>]| -> Vec<Vec<f64>> {
        (0..runs)
            .map(|r| {
                let y = bench.response(r, values, &initial[r]);
                measured[r].iter().zip(&y).map(|(m, y)| if m.is_finite() { m - y } else { 0.0 }).collect()
            })
            .collect()
    };
    // How far off, in doubts.
    let doubts = |by: f64, i: usize| if start[i] == 0.0 { 0.0 } else { by / (DOUBT * start[i]) };
    let cost = |residual: &[Vec<f64>], values: &[f64]| {
        let off = (0..p).map(|i| doubts(values[i] - start[i], i).powi(2));
        sum_of_squares(residual) + off.sum::<f64>()
    };
    let (mut values, mut initial) = (start.to_vec(), initial.to_vec());
    let mut best = residuals(&values, &initial);
    for _ in 0..ROUNDS {
        let columns = p + runs * k;
        let mut normal = DMatrix::<f64>::zeros(columns, columns);
        let mut right = DVector::<f64>::zeros(columns);
        for r in 0..runs {
            let nominal = bench.response(r, &values, &initial[r]);
            let mut slopes: Vec<(usize, Vec<f64>)> = Vec::new();
            let mut add = |column: usize, moved: Vec<f64>| {
                let s = moved.iter().zip(&nominal).zip(&measured[r]);
                slopes.push((column, s.map(|((a, b), m)| if m.is_finite() { a - b } else { 0.0 }).collect()));
            };
            for i in 0..p {
                let mut moved = values.clone();
                moved[i] += value_steps[i];
                add(i, bench.response(r, &moved, &initial[r]));
            }
            for i in 0..k {
                let mut moved = initial[r].clone();
                moved[i] += initial_steps[i];
                add(p + r * k + i, bench.response(r, &values, &moved));
            }
            for (i, a) in &slopes {
                right[*i] += a.iter().zip(&best[r]).map(|(a, b)| a * b).sum::<f64>();
                for (j, b) in &slopes {
                    normal[(*i, *j)] += a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        for i in 0..p {
            let step = doubts(value_steps[i], i);
            normal[(i, i)] += step * step;
            right[i] -= step * doubts(values[i] - start[i], i);
        }
        let mut improved = false;
        for damping in DAMPINGS {
            let mut m = normal.clone();
            for i in 0..columns {
                m[(i, i)] += damping * normal[(i, i)] + 1e-300;
            }
            let Some(step) = m.cholesky().map(|c| c.solve(&right)) else { continue };
            let moved: Vec<f64> = (0..p).map(|i| values[i] + step[i] * value_steps[i]).collect();
            // A parameter that changes its sign or doubles is no refit.
            if moved.iter().zip(start).any(|(m, s)| *s != 0.0 && !(0.3..3.0).contains(&(m / s))) {
                continue;
            }
            let from: Vec<Vec<f64>> = (0..runs)
                .map(|r| (0..k).map(|i| initial[r][i] + step[p + r * k + i] * initial_steps[i]).collect())
                .collect();
            let after = residuals(&moved, &from);
            let (new, old) = (cost(&after, &moved), cost(&best, &values));
            if new < old {
                improved = true;
                let small = new > 0.98 * old;
                (values, initial, best) = (moved, from, after);
                if small {
                    return Tuned { residual: best };
                }
                break;
            }
        }
        if !improved {
            break;
        }
    }
    Tuned { residual: best }
}
