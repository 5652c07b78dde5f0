//! The downhill simplex within bounds: J. A. Nelder, R. Mead, The Computer Journal 7, 1965; S0, section 4.

/// What a search ended with.
#[derive(Clone, Debug, PartialEq)]
pub struct Simplex {
    /// The best point.
    pub x: Vec<f64>,
    /// Its cost.
    pub cost: f64,
    /// Evaluations of the cost.
    pub evaluations: usize,
    /// The simplex has shrunk to the tolerance.
    pub converged: bool,
}

/// Minimizes `cost` from `start` with first steps `step`, within `lower` and `upper` (points beyond are moved onto the
/// bound). Ends when the simplex is smaller than `tolerance` times the first steps and its costs agree, restarting
/// once from there, because a simplex can collapse short of a minimum; or after `limit` evaluations. A cost that is not
/// finite counts as infinite.
pub fn nelder_mead(
    mut cost: impl FnMut(&[f64]) -> f64,
    start: &[f64],
    step: &[f64],
    lower: &[f64],
    upper: &[f64],
    tolerance: f64,
    limit: usize,
) -> Simplex {
    let mut evaluations = 0;
    let mut at = |x: &mut Vec<f64>| {
        for (i, x) in x.iter_mut().enumerate() {
            *x = x.clamp(lower[i], upper[i]);
        }
        evaluations += 1;
        let c = cost(x);
        if c.is_finite() { c } else { f64::INFINITY }
    };
    let mut best = (start.to_vec(), f64::INFINITY);
    best.1 = at(&mut best.0);
    let (mut used, mut converged) = (1, false);
    for _ in 0..2 {
        let mut simplex = vec![best.clone()];
        for i in 0..start.len() {
            let mut x = best.0.clone();
            // Away from a bound that is nearer than the step.
            x[i] += if x[i] + step[i] <= upper[i] { step[i] } else { -step[i] };
            let c = at(&mut x);
            used += 1;
            simplex.push((x, c));
        }
        converged = false;
        while used < limit {
            simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
            let (low, high) = (simplex[0].1, simplex[start.len()].1);
            let small = (0..start.len()).all(|i| {
                simplex.iter().all(|(x, _)| (x[i] - simplex[0].0[i]).abs() <= tolerance * step[i].abs())
            });
            if small && high - low <= tolerance * low.abs().max(f64::MIN_POSITIVE) {
                converged = true;
                break;
            }
            let worst = simplex.len() - 1;
            let center: Vec<f64> = (0..start.len())
                .map(|i| simplex[..worst].iter().map(|(x, _)| x[i]).sum::<f64>() / worst as f64)
                .collect();
            let mut towards = |factor: f64, from: &[f64]| {
                let mut x: Vec<f64> = center.iter().zip(from).map(|(c, f)| c + factor * (c - f)).collect();
                let c = at(&mut x);
                used += 1;
                (x, c)
            };
            let reflected = towards(1.0, &simplex[worst].0);
            if reflected.1 < low {
                let expanded = towards(2.0, &simplex[worst].0);
                simplex[worst] = if expanded.1 < reflected.1 { expanded } else { reflected };
            } else if reflected.1 < simplex[worst - 1].1 {
                simplex[worst] = reflected;
            } else {
                let contracted = if reflected.1 < high {
                    towards(0.5, &simplex[worst].0)
                } else {
                    towards(-0.5, &simplex[worst].0)
                };
                if contracted.1 < high.min(reflected.1) {
                    simplex[worst] = contracted;
                } else {
                    let lowest = simplex[0].0.clone();
                    for (x, c) in &mut simplex[1..] {
                        for (x, l) in x.iter_mut().zip(&lowest) {
                            *x = 0.5 * (*x + l);
                        }
                        *c = at(x);
                        used += 1;
                    }
                }
            }
        }
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        best = simplex.swap_remove(0);
    }
    Simplex { x: best.0, cost: best.1, evaluations, converged }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rosenbrock_and_a_bound() {
        let rosenbrock = |x: &[f64]| (1.0 - x[0]).powi(2) + 100.0 * (x[1] - x[0] * x[0]).powi(2);
        let far = [f64::NEG_INFINITY; 2];
        let found = nelder_mead(rosenbrock, &[-1.2, 1.0], &[0.5; 2], &far, &[f64::INFINITY; 2], 1e-9, 4000);
        assert!(found.converged);
        assert!(found.x.iter().all(|x| (x - 1.0).abs() < 1e-6), "{found:?}");
        // With x_0 at most 0.5 the minimum is on the bound, x_1 = x_0^2.
        let found = nelder_mead(rosenbrock, &[-1.2, 1.0], &[0.5; 2], &far, &[0.5, f64::INFINITY], 1e-9, 4000);
        assert_eq!(found.x[0], 0.5);
        assert!((found.x[1] - 0.25).abs() < 1e-6);
    }

    #[test]
    fn a_cost_that_is_no_number_is_left_alone() {
        let cost = |x: &[f64]| if x[0] < 0.0 { f64::NAN } else { (x[0] - 2.0).powi(2) };
        let found = nelder_mead(cost, &[1.0], &[-5.0], &[-10.0], &[10.0], 1e-9, 1000);
        assert!((found.x[0] - 2.0).abs() < 1e-6, "{found:?}");
    }
}
