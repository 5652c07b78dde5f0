//! A reduced set of coordinates of a link, as tools for structures export it, made its mass-normalised modes: a generalised
//! symmetric eigenproblem. Models know modes alone.

use super::wrong::RobotFileError;
use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen};
use schemars::JsonSchema;
use serde::Deserialize;
use toml::Spanned;
use trueup_models::space::MAX_MODES_OF_LINK;
use trueup_models::space::table::{ModeReach, TabledMode};

/// Coordinates x of a link, clamped at its root: M_ff dd(x) + D d(x) + K_ff x = forces. Rows of the coupling matrices are of the coordinates.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub(super) struct Reduced {
    #[schemars(with = "Vec<Vec<f64>>")]
    mass_matrix: Spanned<Vec<Vec<f64>>>,
    #[schemars(with = "Vec<Vec<f64>>")]
    stiffness_matrix: Spanned<Vec<Vec<f64>>>,
    #[schemars(with = "Option<Vec<Vec<f64>>>")]
    damping_matrix: Option<Spanned<Vec<Vec<f64>>>>,
    /// D = a M + b K: a in 1/s, b in s.
    #[schemars(with = "Option<[f64; 2]>")]
    rayleigh: Option<Spanned<[f64; 2]>>,
    /// Momentum and angular momentum about the root per unit of rate.
    #[schemars(with = "Vec<[f64; 6]>")]
    participation: Spanned<Vec<[f64; 6]>>,
    #[schemars(with = "Vec<[f64; 3]>")]
    end_shift: Spanned<Vec<[f64; 3]>>,
    #[schemars(with = "Vec<[f64; 3]>")]
    end_turn: Spanned<Vec<[f64; 3]>>,
}

/// How modes are damped.
pub(super) enum Damping {
    None,
    /// Each by this ratio.
    Ratio(f64),
    /// D = a M + b K.
    Rayleigh(f64, f64),
    Matrix(DMatrix<f64>),
}

/// How far rounding in a file may take a matrix off symmetry, relative to its diagonal.
const ROUNDING: f64 = 1e-6;
/// Least eigenvalue of a matrix whose diagonal is 1 that does not count as 0.
const SINGULAR: f64 = 1e-12;
/// Damping between two modes relative to that of both that is left out: it changes theirs by the square of this.
const COUPLED: f64 = 1e-3;

type MatrixRows = Spanned<Vec<Vec<f64>>>;

impl Reduced {
    /// The modes by ascending frequency, damped as the set gives, else so; the set begins at this byte.
    pub(super) fn modes(
        self,
        otherwise: Damping,
        begin: usize,
    ) -> Result<Vec<(TabledMode, ModeReach)>, RobotFileError> {
        let n = self.mass_matrix.get_ref().len();
        if n == 0 || n > MAX_MODES_OF_LINK {
            let why = format!("mass-matrix has {n} rows: 1 to {MAX_MODES_OF_LINK} can be had");
            return Err(RobotFileError::at(self.mass_matrix.span().start, why));
        }
        let mass = positive(
            &self.mass_matrix,
            "mass-matrix",
            n,
            "every coordinate must move mass: leave out those that do not",
        )?;
        let stiffness = positive(
            &self.stiffness_matrix,
            "stiffness-matrix",
            n,
            "the link must be clamped at its root: leave out rigid motions",
        )?;
        sized(&self.participation, "participation", n)?;
        sized(&self.end_shift, "end-shift", n)?;
        sized(&self.end_turn, "end-turn", n)?;
        let damping = match (&self.damping_matrix, &self.rayleigh, otherwise) {
            (None, None, otherwise) => otherwise,
            (Some(matrix), None, Damping::None) => Damping::Matrix(symmetric(matrix, "damping-matrix", n)?),
            (None, Some(rayleigh), Damping::None) => {
                let [a, b] = *rayleigh.get_ref();
                if !(a >= 0.0 && b >= 0.0 && a.is_finite() && b.is_finite()) {
                    let why = format!(
                        "rayleigh = [{a}, {b}]: give two numbers of 0 or above, of the mass matrix (1/s) and of the stiffness matrix (s)"
                    );
                    return Err(RobotFileError::at(rayleigh.span().start, why));
                }
                Damping::Rayleigh(a, b)
            }
            _ => {
                let why =
                    "damping is given more than once; leave one of damping-ratio, damping-matrix, rayleigh";
                return Err(RobotFileError::at(begin, why.into()));
            }
        };
        let (frequencies, shapes) =
            diagonal(mass, &stiffness).map_err(|why| RobotFileError::at(begin, why))?;
        let ratios = self.ratios(damping, &frequencies, &shapes)?;
        let row = |j: usize| {
            let shape = shapes.column(j);
            let mode = TabledMode {
                frequency: frequencies[j],
                damping_ratio: ratios[j],
                participation: sum(self.participation.get_ref(), shape.iter()),
            };
            let reach = ModeReach {
                shift: sum(self.end_shift.get_ref(), shape.iter()),
                turn: sum(self.end_turn.get_ref(), shape.iter()),
            };
            (mode, reach)
        };
        Ok((0..n).map(row).collect())
    }

    /// Damping ratio of each mode.
    fn ratios(
        &self,
        damping: Damping,
        frequencies: &DVector<f64>,
        shapes: &DMatrix<f64>,
    ) -> Result<Vec<f64>, RobotFileError> {
        let matrix = match damping {
            Damping::None => return Ok(vec![0.0; frequencies.len()]),
            Damping::Ratio(ratio) => return Ok(vec![ratio; frequencies.len()]),
            Damping::Rayleigh(a, b) => {
                return Ok(frequencies.iter().map(|w| 0.5 * (a / w + b * w)).collect());
            }
            Damping::Matrix(matrix) => shapes.transpose() * matrix * shapes,
        };
        let begin = self.damping_matrix.as_ref().map_or(0, |m| m.span().start);
        let n = frequencies.len();
        if let Some(j) = (0..n).find(|j| matrix[(*j, *j)] < 0.0) {
            let why = format!(
                "damping-matrix drives mode {} instead of braking it; give a positive semidefinite matrix",
                j + 1
            );
            return Err(RobotFileError::at(begin, why));
        }
        for j in 0..n {
            for k in 0..j {
                let both = (matrix[(j, j)] * matrix[(k, k)]).sqrt();
                if matrix[(j, k)].abs() > COUPLED * both {
                    let why = format!(
                        "damping-matrix couples modes {} and {} ({:.3e} where their own damping is {both:.3e}), and modes here are damped each by itself; give rayleigh = [a, b], or a damping-ratio of the link",
                        k + 1,
                        j + 1,
                        matrix[(j, k)]
                    );
                    return Err(RobotFileError::at(begin, why));
                }
            }
        }
        Ok((0..n).map(|j| 0.5 * matrix[(j, j)] / frequencies[j]).collect())
    }
}

/// Frequencies (rad/s, ascending) and mass-normalised shapes of K s = omega^2 M s.
fn diagonal(mass: DMatrix<f64>, stiffness: &DMatrix<f64>) -> Result<(DVector<f64>, DMatrix<f64>), String> {
    let none = || "its matrices have no modes; are numbers far too large or too small?".to_owned();
    let lower = Cholesky::new(mass).ok_or_else(none)?.l();
    let inverse = lower.try_inverse().ok_or_else(none)?;
    let found = SymmetricEigen::new(&inverse * stiffness * inverse.transpose());
    let mut order: Vec<usize> = (0..found.eigenvalues.len()).collect();
    order.sort_by(|a, b| found.eigenvalues[*a].total_cmp(&found.eigenvalues[*b]));
    let shapes = inverse.transpose() * found.eigenvectors.select_columns(&order);
    let frequencies = DVector::from_iterator(order.len(), order.iter().map(|k| found.eigenvalues[*k].sqrt()));
    Ok((frequencies, shapes))
}

/// Of rows of the coordinates those of a shape.
fn sum<'a, const N: usize>(rows: &[[f64; N]], shape: impl Iterator<Item = &'a f64>) -> [f64; N] {
    let mut all = [0.0; N];
    for (row, share) in rows.iter().zip(shape) {
        all.iter_mut().zip(row).for_each(|(all, v)| *all += share * v);
    }
    all
}

fn sized<const N: usize>(rows: &Spanned<Vec<[f64; N]>>, key: &str, n: usize) -> Result<(), RobotFileError> {
    let (given, begin) = (rows.get_ref().len(), rows.span().start);
    if given != n {
        let why = format!("{key} has {given} rows, mass-matrix {n}; give one of {N} numbers per coordinate");
        return Err(RobotFileError::at(begin, why));
    }
    if rows.get_ref().as_flattened().iter().any(|v| !v.is_finite()) {
        return Err(RobotFileError::at(
            begin,
            format!("{key} has numbers that are not finite; give finite ones"),
        ));
    }
    Ok(())
}

/// A matrix of `n` rows, symmetric within rounding.
fn symmetric(rows: &MatrixRows, key: &str, n: usize) -> Result<DMatrix<f64>, RobotFileError> {
    let wrong = |why: String| Err(RobotFileError::at(rows.span().start, why));
    let rows = rows.get_ref();
    if rows.len() != n || rows.iter().any(|r| r.len() != n) {
        let widths: Vec<String> = rows.iter().map(|r| r.len().to_string()).collect();
        return wrong(format!(
            "{key} has rows of {} numbers; give {n} rows of {n}, one per coordinate",
            widths.join(", ")
        ));
    }
    let m = DMatrix::from_fn(n, n, |i, j| rows[i][j]);
    if m.iter().any(|v| !v.is_finite()) {
        return wrong(format!("{key} has numbers that are not finite; give finite ones"));
    }
    for i in 0..n {
        for j in 0..i {
            let size = (m[(i, i)] * m[(j, j)]).abs().sqrt();
            if (m[(i, j)] - m[(j, i)]).abs() > ROUNDING * size {
                return wrong(format!(
                    "{key}[{},{}] = {} but {key}[{},{}] = {}: it is symmetric; give both the same value",
                    j + 1,
                    i + 1,
                    m[(j, i)],
                    i + 1,
                    j + 1,
                    m[(i, j)]
                ));
            }
        }
    }
    Ok((&m + m.transpose()) * 0.5)
}

/// The same, and positive definite; else this is the remedy.
fn positive(rows: &MatrixRows, key: &str, n: usize, mend: &str) -> Result<DMatrix<f64>, RobotFileError> {
    let m = symmetric(rows, key, n)?;
    let wrong = |why: String| {
        RobotFileError::at(rows.span().start, format!("{key} is not positive definite: {why}; {mend}"))
    };
    if let Some(k) = (0..n).find(|k| m[(*k, *k)] <= 0.0) {
        return Err(wrong(format!("{key}[{0},{0}] = {1}", k + 1, m[(k, k)])));
    }
    // Coordinates have units of their own.
    let scaled = DMatrix::from_fn(n, n, |i, j| m[(i, j)] / (m[(i, i)] * m[(j, j)]).sqrt());
    let least = SymmetricEigen::new(scaled);
    let at = least.eigenvalues.imin();
    let value = least.eigenvalues[at];
    if value <= SINGULAR {
        let most = least.eigenvectors.column(at).iamax() + 1;
        return Err(wrong(format!(
            "scaled to a diagonal of 1 its least eigenvalue is {value:.1e}, mostly of coordinate {most}"
        )));
    }
    Ok(m)
}
