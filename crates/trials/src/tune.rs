//! What a refit of parameters alone would leave: damped Gauss-Newton with differences, for the size of an effect.

use nalgebra::{DMatrix, DVector};

/// Parameters and first state of a response.
pub(crate) type TuningPoint = (Vec<f64>, Vec<f64>);

/// Responses of a simulation without effects.
pub(crate) trait TuningBench {
    /// Responses of run `run` at each point, every channel divided by its scale.
    fn responses(&self, run: usize, points: &[TuningPoint]) -> Vec<Vec<f64>>;
}

/// A fit.
#[derive(Clone, Debug)]
pub(crate) struct TunedGains {
    pub(crate) residual: Vec<Vec<f64>>,
}

fn sum_of_squares(r: &[Vec<f64>]) -> f64 {
    r.iter().flatten().map(|e| e * e).sum()
}

/// How far off a parameter may be, as a share, for as much as the information of one reading: what nothing shows stays where
/// it is, so that it does not keep the rest from being fitted.
pub(crate) const DOUBT: f64 = 0.3;
/// The same of a first state, in its steps.
pub(crate) const FIRST: f64 = 500.0;
/// Steps at the most: joints that nothing measures bend the way to the best far.
const ROUNDS: usize = 30;
/// What the first step is damped by, and the most that is tried, in standard deviations.
const FREELY: f64 = 1.0;
const MOST: f64 = 1e9;
/// A step that leaves more than this share is the last, as is one that leaves so small a share of what noise does.
const ENOUGH: f64 = 0.98;
const NOTHING: f64 = 0.02;

/// Fits `start` (the parameters) and `initial` (the first states of each run), whose differences take these steps, to
/// `measured`.
pub(crate) fn tune(
    bench: &dyn TuningBench,
    measured: &[Vec<f64>],
    start: &[f64],
    value_steps: &[f64],
    initial: &[Vec<f64>],
    initial_steps: &[f64],
) -> TunedGains {
    let (runs, p, k) = (measured.len(), start.len(), initial_steps.len());
    // All of them are counted in steps from where they start.
    let values = |x: &[f64]| -> Vec<f64> { (0..p).map(|i| start[i] + x[i] * value_steps[i]).collect() };
    let first = |r: usize, x: &[f64]| -> Vec<f64> {
        (0..k).map(|i| initial[r][i] + x[p + r * k + i] * initial_steps[i]).collect()
    };
    let point = |r: usize, x: &[f64]| (values(x), first(r, x));
    let responses =
        |x: &[f64]| -> Vec<Vec<f64>> { (0..runs).flat_map(|r| bench.responses(r, &[point(r, x)])).collect() };
    let residuals = |y: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let of = |(m, y): (&f64, &f64)| if m.is_finite() { m - y } else { 0.0 };
        measured.iter().zip(y).map(|(m, y)| m.iter().zip(y).map(of).collect()).collect()
    };
    let columns = p + runs * k;
    let doubt = |i: usize| match i {
        i if i >= p => FIRST,
        i if start[i] == 0.0 || value_steps[i] == 0.0 => f64::INFINITY,
        i => (DOUBT * start[i] / value_steps[i]).abs(),
    };
    let doubts: Vec<f64> = (0..columns).map(doubt).collect();
    let cost = |residual: &[Vec<f64>], x: &[f64]| {
        sum_of_squares(residual) + x.iter().zip(&doubts).map(|(x, doubt)| (x / doubt).powi(2)).sum::<f64>()
    };
    let mut x = vec![0.0; columns];
    let mut nominal = responses(&x);
    let mut best = residuals(&nominal);
    let readings = best.iter().map(Vec::len).sum::<usize>() as f64;
    let mut damping = FREELY;
    for _ in 0..ROUNDS {
        let mut normal = DMatrix::<f64>::zeros(columns, columns);
        let mut right = DVector::<f64>::zeros(columns);
        for r in 0..runs {
            let own: Vec<usize> = (0..p).chain(p + r * k..p + (r + 1) * k).collect();
            let moved = |i: &usize| {
                let mut moved = x.clone();
                moved[*i] += 1.0;
                point(r, &moved)
            };
            let moved = bench.responses(r, &own.iter().map(moved).collect::<Vec<_>>());
            let slope = |moved: &Vec<f64>| -> Vec<f64> {
                let pairs = moved.iter().zip(&nominal[r]).zip(&measured[r]);
                pairs.map(|((a, b), m)| if m.is_finite() { a - b } else { 0.0 }).collect()
            };
            let slopes: Vec<Vec<f64>> = moved.iter().map(slope).collect();
            for (at, (i, a)) in own.iter().zip(&slopes).enumerate() {
                right[*i] += a.iter().zip(&best[r]).map(|(a, b)| a * b).sum::<f64>();
                // Below the diagonal: more of it is not read.
                for (j, b) in own.iter().zip(&slopes).take(at + 1) {
                    normal[(*i, *j)] += a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        for (i, doubt) in doubts.iter().enumerate() {
            normal[(i, i)] += doubt.powi(-2);
            right[i] -= x[i] * doubt.powi(-2);
        }
        let old = cost(&best, &x);
        let step = |damping: f64| {
            let mut m = normal.clone();
            (0..columns).for_each(|i| m[(i, i)] += damping * doubts[i].powi(-2) + 1e-300);
            let step = m.cholesky()?.solve(&right);
            let moved: Vec<f64> = x.iter().zip(step.iter()).map(|(x, step)| x + step).collect();
            // A parameter that changes its sign or doubles is no refit.
            let far = |(m, s): (&f64, &f64)| *s != 0.0 && !(0.3..3.0).contains(&(m / s));
            if values(&moved).iter().zip(start).any(far) {
                return None;
            }
            let shown = responses(&moved);
            let after = residuals(&shown);
            let new = cost(&after, &moved);
            (new < old).then_some((new, moved, shown, after))
        };
        let mut found = None;
        while found.is_none() && damping <= MOST {
            found = step(damping);
            damping *= if found.is_some() { 0.03 } else { 10.0 };
        }
        let Some((new, moved, shown, after)) = found else { break };
        (x, nominal, best) = (moved, shown, after);
        if new > ENOUGH * old || new < NOTHING * readings {
            break;
        }
    }
    TunedGains { residual: best }
}
