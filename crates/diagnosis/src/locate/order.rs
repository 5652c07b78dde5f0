//! How often per turn.

use std::f64::consts::TAU;

/// A wave of the residual along an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualOrder {
    /// Periods per turn.
    pub order: f64,
    /// Of a cos(order angle) + b sin(order angle), in the residual's unit.
    pub cosine: f64,
    /// See `cosine`.
    pub sine: f64,
    /// Share of the residual's variance that this order alone explains.
    pub share: f64,
}

impl ResidualOrder {
    /// Half the distance from crest to trough.
    pub fn amplitude(&self) -> f64 {
        self.cosine.hypot(self.sine)
    }
}

/// Orders looked at at most; half and whole ones are always among them.
const MOST: usize = 400;

/// The spectrum of a residual along an angle in rad, up to `highest` periods per turn: each order fitted by least squares
/// with a constant, so that the motion may reverse and be uneven. Empty for less than two turns in all, for then orders
/// cannot be distinguished from a trend.
///
/// Order by order; the caller looks for the largest share. Neighbours closer than one over the turns travelled are one
/// peak.
pub fn orders(angle: &[f64], value: &[f64], highest: f64) -> Vec<ResidualOrder> {
    let n = angle.len().min(value.len());
    let (angle, value) = (&angle[..n], &value[..n]);
    let range = angle.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), a| (l.min(*a), h.max(*a)));
    let turns = (range.1 - range.0) / TAU;
    if n < 16 || !turns.is_finite() || turns < 2.0 || highest.is_nan() || highest <= 0.0 {
        return Vec::new();
    }
    let fine = (2.0 * turns).ceil().max(2.0);
    let step = if highest * fine <= MOST as f64 { 1.0 / fine } else { (highest / MOST as f64).max(1e-3) };
    let mut list: Vec<f64> = (1..=(highest / step).floor() as usize).map(|k| k as f64 * step).collect();
    list.extend((1..=(2.0 * highest).floor() as usize).map(|k| 0.5 * k as f64));
    list.retain(|o| *o * turns >= 1.0);
    list.sort_by(f64::total_cmp);
    list.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
    let mean = value.iter().sum::<f64>() / n as f64;
    let variance = value.iter().map(|v| (v - mean).powi(2)).sum::<f64>();
    if variance <= 0.0 {
        return Vec::new();
    }
    list.into_iter().filter_map(|order| fit(angle, value, order, mean, variance)).collect()
}

fn fit(angle: &[f64], value: &[f64], order: f64, mean: f64, variance: f64) -> Option<ResidualOrder> {
    let n = angle.len() as f64;
    let [mut c, mut s, mut cc, mut ss, mut cs, mut rc, mut rs] = [0.0; 7];
    for (a, v) in angle.iter().zip(value) {
        let (sin, cos) = (order * a).sin_cos();
        let v = v - mean;
        c += cos;
        s += sin;
        cc += cos * cos;
        ss += sin * sin;
        cs += cos * sin;
        rc += v * cos;
        rs += v * sin;
    }
    // The constant eliminated: the sum of v is 0.
    let (cc, ss, cs) = (cc - c * c / n, ss - s * s / n, cs - c * s / n);
    let determinant = cc * ss - cs * cs;
    if determinant <= 1e-9 * n * n {
        return None;
    }
    let (cosine, sine) = ((rc * ss - rs * cs) / determinant, (rs * cc - rc * cs) / determinant);
    Some(ResidualOrder { order, cosine, sine, share: ((cosine * rc + sine * rs) / variance).clamp(0.0, 1.0) })
}
