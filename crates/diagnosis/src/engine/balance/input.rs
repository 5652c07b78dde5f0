//! Inputs on the grid of a recording.

use trueup_identification::run::{InputDrive, InputInterpolation};

/// Means of an input over the grid's steps.
pub(super) fn averaged(d: &InputDrive, t: &[f64], h: f64) -> Vec<f64> {
    let mut at = 0;
    let mut value = |t: f64| {
        while at + 1 < d.t.len() && d.t[at + 1] <= t {
            at += 1;
        }
        while at > 0 && d.t[at] > t {
            at -= 1;
        }
        match (d.between, d.t.get(at + 1)) {
            (InputInterpolation::Linear, Some(next)) if t > d.t[at] => {
                let w = (t - d.t[at]) / (next - d.t[at]);
                d.u[at] * (1.0 - w) + d.u[at + 1] * w
            }
            _ => d.u[at],
        }
    };
    if d.t.is_empty() {
        return vec![0.0; t.len()];
    }
    t.iter()
        .map(|t| [-0.375, -0.125, 0.125, 0.375].map(|s| value(t + s * h)).iter().sum::<f64>() / 4.0)
        .collect()
}

/// First-order lag of a series, T in samples: exact on straight lines between samples.
pub(super) fn lag(u: &mut [f64], samples: f64) {
    if samples <= 1e-9 || u.is_empty() {
        return;
    }
    let decay = (-1.0 / samples).exp();
    let mut x = u[0];
    let mut before = u[0];
    for v in u.iter_mut() {
        let slope = *v - before;
        x = *v - slope * samples + (x - before + slope * samples) * decay;
        before = *v;
        *v = x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_is_exact_on_ramps() {
        // T dx/dt = u - x with u = t from rest: x = t - T + T e^(-t/T).
        let mut u: Vec<f64> = (0..200).map(f64::from).collect();
        lag(&mut u, 12.5);
        for (k, x) in u.iter().enumerate() {
            let t = k as f64;
            assert!((x - (t - 12.5 + 12.5 * (-t / 12.5).exp())).abs() < 1e-9);
        }
    }
}
