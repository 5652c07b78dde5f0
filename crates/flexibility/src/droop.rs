//! How the weight of an arm lets velocity waves droop, and above which wave frequency they run away.
//!
//! At rest `VWBC` is off by omega_n / K_p times the twist delta (CTL-5). Move the motors by d: joints follow by M d, M = (K^-1)_jj k, with
//! K the stiffness with the motors held, weight counted, its inverse taken at the joints, and k their springs. The twist
//! changes by (1 - M) d. Where the weight pulls further the further the arm goes, M is above 1: the twist falls as the angle rises, by
//! lambda = 1 - 1/mu of it, mu the largest eigenvalue of M. What holds the arm is K_p - omega_n lambda.

use super::equilibrium::{Equilibrium, EquilibriumError};
use nalgebra::DMatrix;

/// Less than this is rounding.
const ROUNDING: f64 = 1e-9;

/// lambda, 1, of an arm at rest: the twist that is lost per angle of the joints, in the direction in which it is most; 0 where the
/// weight brings the arm back in all of them. With one omega_n and one K_p for all joints `VWBC` runs away above omega_n = K_p / lambda (CTL-16).
/// Sampled with the period T_s, omega_n / (1 + omega_n T_s / 2) is what counts.
///
/// # Errors
/// [`EquilibriumError::Unstable`], [`EquilibriumError::Rigid`]: no joint has a spring.
pub fn droop(rest: &Equilibrium) -> Result<f64, EquilibriumError> {
    let n = rest.joints.len();
    if n == 0 {
        return Err(EquilibriumError::Rigid);
    }
    let compliance = rest.stiffness.clone().cholesky().ok_or(EquilibriumError::Unstable)?.inverse();
    let root = |j: usize| rest.springs[j].sqrt();
    let follows = DMatrix::from_fn(n, n, |i, j| root(i) * compliance[(i, j)] * root(j));
    let lost = 1.0 - 1.0 / follows.symmetric_eigenvalues().max(); // (CTL-16)
    Ok(if lost > ROUNDING { lost } else { 0.0 })
}
