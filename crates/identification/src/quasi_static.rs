//! What slow and static tests give (S3 sections 4.2, 4.3 and 5): break-away, Young's modulus, and how much each spring
//! has to do with the first mode.

use nalgebra::{DMatrix, DVector, Dyn, SymmetricEigen};
use trueup_models::arm::ArmScalar;
use trueup_signals::element_name;

use crate::model::SimulatedPlant;

/// A quasi-static test without information.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StaticError {
    /// Series of different lengths, or too short.
    #[error("{0}")]
    Shape(String),
    /// The motor never moves.
    #[error(
        "the motor moves by {moved} rad at most, less than {threshold} rad: it never breaks away; raise the current further"
    )]
    NeverMoves {
        /// Largest motion, rad.
        moved: f64,
        /// What counts as motion, rad.
        threshold: f64,
    },
    /// A matrix that is none of a conservative system.
    #[error(
        "{0} is not positive definite: the system has a motion without inertia, or without a spring; hold it first"
    )]
    NotPositive(&'static str),
    /// A deflection that cannot be.
    #[error("a deflection of {0} m under a load of {1} N: both must be finite, not 0 and of one sign")]
    Deflection(f64, f64),
}

/// One break-away.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breakaway {
    /// When the motor begins to move, s.
    pub time: f64,
    /// Current then, I_s, A.
    pub current: f64,
    /// tau_s = K_t |I_s|, N.m.
    pub static_friction: f64,
    /// How late it may have been seen, N.m: what the ramp adds within one sample and while the first count passes.
    pub late: f64,
}

/// Where a slow ramp of the current breaks the motor away: the first motion by more than `threshold` (rad; two counts of
/// the encoder at least) from its position. `external` is the torque, motor side, that the motor holds in addition, N.m.
///
/// The last instant before that motion at which the motor had not yet left its count is taken, so
/// that the estimate is late by one sample at most, never by the acceleration.
///
/// # Errors
/// [`StaticError::Shape`], [`StaticError::NeverMoves`].
pub fn breakaway(
    time: &[f64],
    current: &[f64],
    motor_angle: &[f64],
    torque_constant: f64,
    external: f64,
    threshold: f64,
) -> Result<Breakaway, StaticError> {
    let n = time.len();
    if n < 10 || current.len() != n || motor_angle.len() != n {
        let text = format!(
            "{n} times, {} currents and {} angles: give one of each per sample, at least 10",
            current.len(),
            motor_angle.len()
        );
        return Err(StaticError::Shape(text));
    }
    let rest = motor_angle[0];
    let far = |q: &f64| (q - rest).abs() > threshold;
    let Some(seen) = motor_angle.iter().position(far) else {
        let moved = motor_angle.iter().fold(0.0, |m: f64, q| m.max((q - rest).abs()));
        return Err(StaticError::NeverMoves { moved, threshold });
    };
    // Half the threshold is noise or one count: the motion began after the last sample within it.
    let begun = motor_angle[..seen].iter().rposition(|q| (q - rest).abs() <= 0.5 * threshold).unwrap_or(0);
    let next = (begun + 1).min(n - 1);
    let applied = |k: usize| torque_constant * current[k] + external;
    Ok(Breakaway {
        time: time[begun],
        current: current[begun],
        static_friction: applied(begun).abs(),
        late: (applied(next) - applied(begun)).abs(),
    })
}

/// Mean of several break-aways with the standard error of the mean; a single one has none.
pub fn static_friction(all: &[Breakaway]) -> (f64, Option<f64>) {
    let n = all.len() as f64;
    let mean = all.iter().map(|b| b.static_friction).sum::<f64>() / n;
    let square = all.iter().map(|b| (b.static_friction - mean).powi(2)).sum::<f64>();
    (mean, (all.len() > 1).then(|| (square / (n - 1.0) / n).sqrt()))
}

/// E = F L^3 / (3 J d) of a cantilever with a load at its end (S3 eq. 9): N, m, m4, m give Pa. With the standard error
/// that an uncertain deflection brings (`deflection_error` in m).
///
/// # Errors
/// [`StaticError::Deflection`].
pub fn youngs_modulus(
    load: f64,
    length: f64,
    area_moment: f64,
    deflection: f64,
    deflection_error: f64,
) -> Result<(f64, f64), StaticError> {
    if !(load / deflection > 0.0 && (load / deflection).is_finite()) {
        return Err(StaticError::Deflection(deflection, load));
    }
    let modulus = load * length.powi(3) / (3.0 * area_moment * deflection);
    Ok((modulus, modulus * (deflection_error / deflection).abs()))
}

/// The first mode of M q'' + sum_i k_i S_i q = 0, and what each spring has to do with it.
#[derive(Clone, Debug, PartialEq)]
pub struct FirstMode {
    /// Angular frequency, rad/s.
    pub frequency: f64,
    /// Share of each spring in the mode's elastic energy, d ln(omega^2)/d ln(k_i). They add up to 1.
    pub shares: Vec<f64>,
    /// Relative rise of the frequency when each spring alone is stiffened by the requested share.
    pub rises: Vec<f64>,
}

impl FirstMode {
    /// Rayleigh's bound: omega^2 is concave and homogeneous of degree 1 in the stiffnesses, so that the relative rises
    /// of omega^2 from stiffening each spring by `by` cannot add up to more than `by`, in any linear conservative system.
    pub fn within_rayleigh(rises: &[f64], by: f64) -> bool {
        rises.iter().map(|r| (1.0 + r).powi(2) - 1.0).sum::<f64>() <= by * (1.0 + 1e-9)
    }
}

/// The first mode of a free-floating arm at its initial configuration, motors and rigid joints held, the base following
/// without momentum: names of its springs, and what each has to do with the mode.
///
/// # Errors
/// [`StaticError::Shape`] if it has no flexible joint; as [`first_mode`].
pub fn first_mode_of(
    model: &SimulatedPlant,
    values: &[f64],
    by: f64,
) -> Result<(Vec<String>, FirstMode), StaticError> {
    let flexible: Vec<usize> =
        (0..model.structure().flexible.len()).filter(|j| model.structure().flexible[*j]).collect();
    let (Some(arm), false) = (model.arm(), flexible.is_empty()) else {
        return Err(StaticError::Shape("a first mode needs an arm with a flexible joint".into()));
    };
    let mut x = vec![0.0; model.sizes().states];
    model.plant().start(values, &mut x);
    let mass = f64::mass_matrix(arm, &x, values);
    let (base, joints): (Vec<usize>, Vec<usize>) =
        ((0..3).collect(), flexible.iter().map(|j| 3 + j).collect());
    let block = |rows: &[usize], columns: &[usize]| {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| mass.at(rows[i], columns[j]))
    };
    let inverse =
        block(&base, &base).cholesky().ok_or(StaticError::NotPositive("the mass matrix"))?.inverse();
    let across = block(&base, &joints);
    let reduced = block(&joints, &joints) - across.transpose() * inverse * &across;
    let names: Vec<String> = flexible.iter().map(|j| element_name("jointStiffness", &[j + 1])).collect();
    let springs: Vec<DMatrix<f64>> = (names.iter().enumerate())
        .map(|(i, name)| {
            let mut k = DMatrix::zeros(joints.len(), joints.len());
            k[(i, i)] = model.parameter(name).map_or(0.0, |at| values[at]);
            k
        })
        .collect();
    Ok((names, first_mode(&reduced, &springs, by)?))
}

/// First mode with the springs' shapes `springs` (k_i S_i, positive semidefinite), and its sensitivity to stiffening each
/// of them by the share `by` (0.2 for 20 %).
///
/// # Errors
/// [`StaticError::NotPositive`], [`StaticError::Shape`].
pub fn first_mode(mass: &DMatrix<f64>, springs: &[DMatrix<f64>], by: f64) -> Result<FirstMode, StaticError> {
    let n = mass.nrows();
    if springs.is_empty() || springs.iter().any(|k| k.shape() != (n, n)) || !mass.is_square() {
        return Err(StaticError::Shape("mass and springs must be square matrices of one size".into()));
    }
    let root = mass.clone().cholesky().ok_or(StaticError::NotPositive("the mass matrix"))?.l();
    let inverse = root.clone().try_inverse().ok_or(StaticError::NotPositive("the mass matrix"))?;
    let lowest = |k: &DMatrix<f64>| -> Option<(f64, DVector<f64>)> {
        let e: SymmetricEigen<f64, Dyn> = (&inverse * k * inverse.transpose()).symmetric_eigen();
        let (at, value) = e.eigenvalues.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1))?;
        (*value > 0.0).then(|| (*value, inverse.transpose() * e.eigenvectors.column(at)))
    };
    let total: DMatrix<f64> = springs.iter().sum();
    let (square, shape) = lowest(&total).ok_or(StaticError::NotPositive("the stiffness matrix"))?;
    let energy = |k: &DMatrix<f64>| shape.dot(&(k * &shape));
    let all = energy(&total);
    let rise =
        |k: &DMatrix<f64>| lowest(&(&total + k * by)).map_or(f64::NAN, |(s, _)| (s / square).sqrt() - 1.0);
    Ok(FirstMode {
        frequency: square.sqrt(),
        shares: springs.iter().map(|k| energy(k) / all).collect(),
        rises: springs.iter().map(rise).collect(),
    })
}
