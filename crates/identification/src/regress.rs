//! The paper's least squares (S3 eq. 6-8) on a two-mass joint, as printed and as it has to be.
//!
//! K_t I - J_motor dd(q_m) = K_eq (q_m - n q_l) + D_eq (d(q_m) - n d(q_l)) + tau_c s + D_m d(q_m)
//!
//! | method | current against second difference | s | samples | filter |
//! |---|---|---|---|---|
//! | literal | as sampled: half a sample late | 1 | all | none |
//! | aligned | averaged as the second difference averages | sign(d(q_m)) | moving | none |
//! | filtered | as aligned | sign | moving throughout the filter's window | one zero-phase filter over all columns |
//! | instruments | as filtered | sign | as filtered | the same; columns of a simulated model as instruments |
//!
//! What they get wrong: the columns carry the noise of differentiated encoders (errors in variables: K and D come out too
//! small or absurd); J_motor, K_t and n are taken as exact. Output error is the method to use; these are its starts,
//! and a warning.

use nalgebra::{DMatrix, DVector};

use crate::run::{IdentificationRun, InputInterpolation, OutputChannel};

/// What the regression takes as known.
#[derive(Clone, Copy, Debug)]
pub struct KnownParameters {
    /// J_motor, kg.m2.
    pub motor_inertia: f64,
    /// K_t, N.m/A.
    pub torque_constant: f64,
    /// n_eq.
    pub gear_ratio: f64,
}

/// Which regression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Regression {
    /// Eq. (8) as printed.
    Literal,
    /// Aligned, sign column, moving samples.
    Aligned,
    /// The same, all columns through a Gaussian low-pass with this -3 dB frequency, Hz.
    Filtered(f64),
}

/// Estimates K_eq, D_eq, tau_c, D_m with the standard errors that independent residuals would have.
#[derive(Clone, Debug)]
pub struct Regressed {
    /// K_eq N.m/rad, D_eq N.m.s/rad, tau_c N.m, D_m N.m.s/rad.
    pub values: [f64; 4],
    /// Their standard errors.
    pub standard_errors: [f64; 4],
    /// Samples used.
    pub samples: usize,
}

/// A regression that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegressError {
    /// A recording lacks a signal.
    #[error("{run} has no {what}, which least squares needs; use --method output-error")]
    Missing {
        /// Recording.
        run: String,
        /// Channel.
        what: &'static str,
    },
    /// Nothing moves long enough.
    #[error(
        "only {samples} samples in which the motor moves throughout: too few for four unknowns; record longer motion"
    )]
    TooFew {
        /// How many.
        samples: usize,
    },
    /// The columns do not determine the unknowns.
    #[error(
        "the columns of the regression are dependent: the recordings do not excite stiffness, damping and friction separately"
    )]
    Singular,
}

/// Rows of the regression: y and the four columns.
struct RegressionRows {
    y: Vec<f64>,
    x: [Vec<f64>; 4],
}

/// Motor and load angle and current of a run on one even grid.
struct Signals {
    h: f64,
    q_m: Vec<f64>,
    q_l: Vec<f64>,
    current: Vec<f64>,
    between: InputInterpolation,
}

/// Index of the model's output and input in a [`IdentificationRun`].
fn channel<'a>(run: &'a IdentificationRun, name: &'static str) -> Result<&'a OutputChannel, RegressError> {
    let found = run.channels.iter().find(|c| c.name == name && c.t.len() > 4);
    found.ok_or_else(|| RegressError::Missing { run: run.name.clone(), what: name })
}

fn interpolate(t: &[f64], y: &[f64], at: f64, between: InputInterpolation) -> f64 {
    let k = t.partition_point(|v| *v <= at + 1e-9 * (t[1] - t[0]));
    match (k, between) {
        (0, _) => y[0],
        (k, InputInterpolation::Linear) if k < t.len() => {
            y[k - 1] + (y[k] - y[k - 1]) * ((at - t[k - 1]) / (t[k] - t[k - 1])).clamp(0.0, 1.0)
        }
        (k, _) => y[k - 1],
    }
}

impl Signals {
    fn new(run: &IdentificationRun) -> Result<Self, RegressError> {
        let (m, l) = (channel(run, "motorAngle")?, channel(run, "loadAngle")?);
        let missing = || RegressError::Missing { run: run.name.clone(), what: "motorCurrent" };
        let drive = run.drives.iter().find(|d| d.input == 0 && d.t.len() > 1).ok_or_else(missing)?;
        let mut steps: Vec<f64> = m.t.windows(2).map(|w| w[1] - w[0]).collect();
        steps.sort_by(f64::total_cmp);
        let h = steps[steps.len() / 2];
        let (begin, end) = (m.t[0] - m.delay, m.t[m.t.len() - 1] - m.delay);
        let at: Vec<f64> = (0..=((end - begin) / h).round() as usize).map(|k| begin + k as f64 * h).collect();
        let sampled = |c: &OutputChannel| {
            at.iter()
                .map(|t| interpolate(&c.t, &c.y, t + c.delay, InputInterpolation::Linear))
                .collect::<Vec<f64>>()
        };
        let current = at.iter().map(|t| interpolate(&drive.t, &drive.u, *t, drive.between)).collect();
        Ok(Self { h, q_m: sampled(m), q_l: sampled(l), current, between: drive.between })
    }

    /// y and columns at the inner samples, and where the motor moves.
    fn rows(&self, known: &KnownParameters, method: Regression) -> (RegressionRows, Vec<bool>) {
        let (h, len) = (self.h, self.q_m.len());
        let inner = 1..len - 1;
        let rate = |q: &[f64], k: usize| (q[k + 1] - q[k - 1]) / (2.0 * h);
        let literal = method == Regression::Literal;
        // The second difference averages the acceleration over two steps with a triangle; so must its reference.
        let current = |k: usize| match self.between {
            _ if literal => self.current[k],
            InputInterpolation::Hold => 0.5 * (self.current[k - 1] + self.current[k]),
            InputInterpolation::Linear => {
                (self.current[k - 1] + 4.0 * self.current[k] + self.current[k + 1]) / 6.0
            }
        };
        let twist = |k: usize| self.q_m[k] - known.gear_ratio * self.q_l[k];
        let averaged = |k: usize| {
            if literal { twist(k) } else { (twist(k - 1) + 10.0 * twist(k) + twist(k + 1)) / 12.0 }
        };
        // Speed without the encoder's counts: over some 30 ms.
        let w = ((0.015 / h).round() as usize).max(1);
        let speed: Vec<f64> = (0..len)
            .map(|k| {
                let (a, b) = (k.saturating_sub(w), (k + w).min(len - 1));
                (self.q_m[b] - self.q_m[a]) / ((b - a) as f64 * h)
            })
            .collect();
        let fastest = speed.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let moving = |k: usize| speed[k].abs() > 0.03 * fastest;
        let acceleration = |k: usize| (self.q_m[k + 1] - 2.0 * self.q_m[k] + self.q_m[k - 1]) / (h * h);
        let column = |f: &dyn Fn(usize) -> f64| inner.clone().map(f).collect::<Vec<f64>>();
        let rows = RegressionRows {
            y: column(&|k| known.torque_constant * current(k) - known.motor_inertia * acceleration(k)),
            x: [
                column(&averaged),
                column(&|k| rate(&self.q_m, k) - known.gear_ratio * rate(&self.q_l, k)),
                column(&|k| if literal { 1.0 } else { speed[k].signum() }),
                column(&|k| rate(&self.q_m, k)),
            ],
        };
        let mask = inner.clone().map(|k| literal || (moving(k - 1) && moving(k) && moving(k + 1))).collect();
        (rows, mask)
    }
}

/// One zero-phase filter over all columns; where its window meets a sample that does not count, neither does it.
fn filtered(rows: &RegressionRows, mask: &[bool], h: f64, cutoff: f64) -> (RegressionRows, Vec<bool>) {
    let sigma = 2f64.ln().sqrt() / (2.0 * std::f64::consts::PI * cutoff) / h;
    let half = (4.0 * sigma).ceil() as usize;
    let kernel: Vec<f64> =
        (0..=2 * half).map(|i| (-0.5 * ((i as f64 - half as f64) / sigma).powi(2)).exp()).collect();
    let sum: f64 = kernel.iter().sum();
    let smooth = |v: &[f64]| -> Vec<f64> {
        v.windows(kernel.len())
            .map(|w| w.iter().zip(&kernel).map(|(v, k)| v * k).sum::<f64>() / sum)
            .collect()
    };
    let mask = mask.windows(kernel.len()).map(|w| w.iter().all(|m| *m)).collect();
    (RegressionRows { y: smooth(&rows.y), x: std::array::from_fn(|c| smooth(&rows.x[c])) }, mask)
}

fn prepared(
    run: &IdentificationRun,
    known: &KnownParameters,
    method: Regression,
) -> Result<(RegressionRows, Vec<bool>), RegressError> {
    let signals = Signals::new(run)?;
    let (rows, mask) = signals.rows(known, method);
    Ok(match method {
        Regression::Filtered(cutoff) => filtered(&rows, &mask, signals.h, cutoff),
        _ => (rows, mask),
    })
}

/// Solves sum z (y - x' mu) = 0 over all runs; `simulated` are the same runs with the readings of a model, for the
/// instruments z; without them z = x.
///
/// # Errors
/// See [`RegressError`].
pub fn regress(
    runs: &[IdentificationRun],
    simulated: Option<&[IdentificationRun]>,
    known: &KnownParameters,
    method: Regression,
) -> Result<Regressed, RegressError> {
    let (mut y, mut x, mut z) = (Vec::new(), Vec::new(), Vec::new());
    for (i, run) in runs.iter().enumerate() {
        let (rows, mask) = prepared(run, known, method)?;
        let instruments = simulated.map(|s| prepared(&s[i], known, method)).transpose()?;
        for k in (0..rows.y.len()).filter(|&k| mask[k]) {
            y.push(rows.y[k]);
            x.extend(rows.x.iter().map(|c| c[k]));
            if let Some((s, _)) = &instruments {
                z.extend(s.x.iter().map(|c| c.get(k).copied().unwrap_or(0.0)));
            }
        }
    }
    let samples = y.len();
    if samples < 20 {
        return Err(RegressError::TooFew { samples });
    }
    let y = DVector::from_vec(y);
    let x = DMatrix::from_row_slice(samples, 4, &x);
    let z = if simulated.is_some() { DMatrix::from_row_slice(samples, 4, &z) } else { x.clone() };
    // Columns of one size, or the matrix could not be inverted.
    let size = |m: &DMatrix<f64>| -> [f64; 4] { std::array::from_fn(|c| m.column(c).norm().max(1e-300)) };
    let (sx, sz) = (size(&x), size(&z));
    let cross = z.tr_mul(&x);
    let scaled = DMatrix::from_fn(4, 4, |i, j| cross[(i, j)] / (sz[i] * sx[j]));
    let right = z.tr_mul(&y);
    let right = DVector::from_fn(4, |i, _| right[i] / sz[i]);
    let inverse =
        scaled.try_inverse().filter(|m| m.iter().all(|v| v.is_finite())).ok_or(RegressError::Singular)?;
    let mu = &inverse * right;
    let values: [f64; 4] = std::array::from_fn(|c| mu[c] / sx[c]);
    let residual = &y - &x * DVector::from_row_slice(&values);
    let variance = residual.norm_squared() / (samples as f64 - 4.0);
    let zz = z.tr_mul(&z);
    let zz = DMatrix::from_fn(4, 4, |i, j| zz[(i, j)] / (sz[i] * sz[j]));
    let covariance = &inverse * zz * inverse.transpose() * variance;
    let standard_errors = std::array::from_fn(|c| covariance[(c, c)].max(0.0).sqrt() / sx[c]);
    Ok(Regressed { values, standard_errors, samples })
}
