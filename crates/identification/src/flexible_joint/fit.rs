//! The four unknowns from one run: S0 eq. 24 by the downhill simplex as printed, or by Gauss-Newton with exact
//! derivatives.

use nalgebra::{Matrix4, Vector4};

use super::replay::{FlexibleJoint, MotorDrive, RunError};
use crate::nelder_mead::nelder_mead;

/// The unknowns in their order, with their units.
pub const NAMES: [(&str, &str); 4] = [
    ("motorInertia", "kg.m2"),
    ("jointStiffness", "N.m/rad"),
    ("jointDamping", "N.m.s/rad"),
    ("initialSpringOffset", "rad"),
];

/// Lower and upper bounds of the paper.
const LOWER: [f64; 4] = [0.001, 0.01, 0.0, -0.1];
const UPPER: [f64; 4] = [100.0, 100.0, 10.0, 0.1];
/// Where the search begins: I_m, k, b, lambda.
const START: [f64; 4] = [1.0, 10.0, 1.0, 0.0];

/// Further starts of k for [`JointSearchMethod::Gradient`].
const STIFFNESSES: [f64; 3] = [3.0, 10.0, 30.0];

/// How to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointSearchMethod {
    /// The downhill simplex over ln I_m, ln k, b, lambda.
    NelderMead,
    /// Gauss-Newton with Levenberg's damping over the same, derivatives from the variational equations.
    Gradient,
}

/// One unknown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointEstimate {
    /// Its value.
    pub value: f64,
    /// Standard error from the curvature and the residual; `None` where the data do not give it.
    pub standard_error: Option<f64>,
    /// It is on this bound.
    pub bound: Option<f64>,
}

/// What a fit found.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFit {
    /// I_m, k, b, lambda.
    pub estimates: [JointEstimate; 4],
    /// Root mean square of the residual in rad.
    pub rms: f64,
    /// Simulations of the run.
    pub evaluations: usize,
    /// The search ended by its own criterion.
    pub converged: bool,
}

/// From (ln I_m, ln k, b, lambda) to the unknowns.
fn unknowns(z: &[f64]) -> [f64; 4] {
    [z[0].exp(), z[1].exp(), z[2], z[3]]
}
fn coordinates(v: [f64; 4]) -> [f64; 4] {
    [v[0].ln(), v[1].ln(), v[2], v[3]]
}

/// Residuals, and their derivatives to the coordinates.
fn residuals(run: &FlexibleJoint, z: &[f64]) -> Result<Vec<(f64, Vector4<f64>)>, RunError> {
    let v = unknowns(z);
    let scale = [v[0], v[1], 1.0, 1.0];
    let angles = run.angle(v)?;
    let seen = &run.run().angle;
    Ok(angles
        .iter()
        .zip(seen)
        .map(|(a, s)| (a.re - s, Vector4::from_fn(|k, _| a.eps[k] * scale[k])))
        .collect())
}

fn cost(residuals: &[(f64, Vector4<f64>)]) -> f64 {
    residuals.iter().map(|(r, _)| r * r).sum()
}

/// Identifies one run.
///
/// # Errors
/// [`RunError::Drive`] where even the start cannot be simulated.
pub fn fit(run: &FlexibleJoint, method: JointSearchMethod) -> Result<JointFit, RunError> {
    let (lower, upper) = (coordinates([LOWER[0], LOWER[1], LOWER[2], LOWER[3]]), coordinates(UPPER));
    let start = coordinates(START);
    residuals(run, &start)?;
    let (z, evaluations, converged) = match method {
        JointSearchMethod::NelderMead => {
            let price = |z: &[f64]| residuals(run, z).map_or(f64::INFINITY, |r| cost(&r));
            let found = nelder_mead(price, &start, &[0.5, 0.5, 0.5, 0.02], &lower, &upper, 1e-5, 2000);
            ([found.x[0], found.x[1], found.x[2], found.x[3]], found.evaluations, found.converged)
        }
        // The period may be read off wrongly where the oscillation is small: softer and stiffer starts too.
        JointSearchMethod::Gradient => {
            let offset = run.first_offset().clamp(LOWER[3], UPPER[3]);
            let mut best: Option<([f64; 4], usize, bool, f64)> = None;
            for stiffness in STIFFNESSES {
                let begin = coordinates([START[0], stiffness, START[2], offset]);
                // Where a torque moves the motor, first its inertia, which the slow motion shows.
                let (z, first) = if matches!(run.run().motor, MotorDrive::Torque(_)) {
                    let (z, first, ..) = gauss_newton(run, begin, lower, upper, [false, true, true, true])?;
                    (z, first)
                } else {
                    (begin, 0)
                };
                let (z, used, converged, cost) = gauss_newton(run, z, lower, upper, [false; 4])?;
                let used = first + used + best.map_or(0, |b| b.1);
                best = match best {
                    Some(b) if b.3 <= cost => Some((b.0, used, b.2, b.3)),
                    _ => Some((z, used, converged, cost)),
                };
            }
            best.map_or((start, 0, false), |b| (b.0, b.1, b.2))
        }
    };
    let last = residuals(run, &z)?;
    let free = last.len().saturating_sub(4).max(1) as f64;
    let variance = cost(&last) / free;
    let on = |k: usize| [lower[k], upper[k]].into_iter().find(|b| (z[k] - b).abs() < 1e-9);
    // What is on a bound is held there.
    let held = |k: usize| on(k).is_some();
    let mut normal = Matrix4::zeros();
    for (_, d) in &last {
        normal += d * d.transpose();
    }
    for k in (0..4).filter(|k| held(*k)) {
        normal.row_mut(k).fill(0.0);
        normal.column_mut(k).fill(0.0);
        normal[(k, k)] = 1.0;
    }
    let inverse = normal.try_inverse();
    let v = unknowns(&z);
    let scale = [v[0], v[1], 1.0, 1.0];
    let estimates = std::array::from_fn(|k| JointEstimate {
        value: v[k],
        standard_error: inverse
            .filter(|_| !held(k))
            .map(|i| (i[(k, k)] * variance).sqrt() * scale[k])
            .filter(|s| s.is_finite()),
        bound: on(k).map(|b| if k < 2 { b.exp() } else { b }),
    });
    Ok(JointFit {
        estimates,
        rms: (cost(&last) / last.len() as f64).sqrt(),
        evaluations: evaluations + 2,
        converged,
    })
}

/// Levenberg-Marquardt within bounds: what presses against a bound is held for the step, as `held` is throughout.
fn gauss_newton(
    run: &FlexibleJoint,
    start: [f64; 4],
    lower: [f64; 4],
    upper: [f64; 4],
    held: [bool; 4],
) -> Result<([f64; 4], usize, bool, f64), RunError> {
    let (mut z, mut damping, mut evaluations) = (start, 1e-3, 1);
    let mut here = residuals(run, &z)?;
    for _ in 0..100 {
        let (mut normal, mut gradient) = (Matrix4::zeros(), Vector4::zeros());
        for (r, d) in &here {
            normal += d * d.transpose();
            gradient += d * *r;
        }
        let presses: [bool; 4] = std::array::from_fn(|k| {
            held[k] || (z[k] <= lower[k] && gradient[k] > 0.0) || (z[k] >= upper[k] && gradient[k] < 0.0)
        });
        let mut damped = normal;
        for k in 0..4 {
            damped[(k, k)] += damping * normal[(k, k)].max(1e-12);
        }
        for k in (0..4).filter(|k| presses[*k]) {
            damped.row_mut(k).fill(0.0);
            damped.column_mut(k).fill(0.0);
            damped[(k, k)] = 1.0;
            gradient[k] = 0.0;
        }
        let Some(step) = damped.cholesky().map(|c| c.solve(&gradient)) else {
            damping *= 10.0;
            continue;
        };
        // What the integration's own error moves is no progress.
        if step.dot(&gradient) < 1e-7 * cost(&here) {
            return Ok((z, evaluations, true, cost(&here)));
        }
        // In logarithms no further than a factor of e at once, each for itself: one that the data hardly show must
        // not hold up the others.
        let next: [f64; 4] = std::array::from_fn(|k| {
            let change = if k < 2 { step[k].clamp(-1.0, 1.0) } else { step[k] };
            (z[k] - change).clamp(lower[k], upper[k])
        });
        let moved = (0..4).map(|k| (next[k] - z[k]).abs() / (1e-3 + z[k].abs())).fold(0.0, f64::max);
        evaluations += 1;
        match residuals(run, &next) {
            Ok(there) if cost(&there) <= cost(&here) => {
                (z, here) = (next, there);
                damping = (damping * 0.2).max(1e-12);
            }
            _ => {
                damping *= 4.0;
                if moved < 1e-10 || damping > 1e12 {
                    return Ok((z, evaluations, true, cost(&here)));
                }
            }
        }
    }
    Ok((z, evaluations, false, cost(&here)))
}
