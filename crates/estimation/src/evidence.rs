//! Evidence of a set of columns: what is unknown and enters linearly, with normal priors, integrated out in closed form.

use nalgebra::{Cholesky, DMatrix, DVector};

/// A normal prior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Mean.
    pub mean: f64,
    /// Standard deviation, above 0.
    pub deviation: f64,
}

/// Products of the columns with each other and with the innovations, over all recordings.
#[derive(Clone, Debug)]
pub struct Gram {
    products: DMatrix<f64>,
    with_data: DVector<f64>,
    data: f64,
    log_determinant: f64,
    readings: usize,
}

/// Products of further columns with those of a [`Gram`], with each other and with the innovations.
#[derive(Clone, Debug)]
pub struct Further {
    with_first: DMatrix<f64>,
    products: DMatrix<f64>,
    with_data: DVector<f64>,
}

impl Further {
    /// So many columns beside so many first ones, of no recording yet.
    pub fn new(first: usize, columns: usize) -> Self {
        Self {
            with_first: DMatrix::zeros(first, columns),
            products: DMatrix::zeros(columns, columns),
            with_data: DVector::zeros(columns),
        }
    }
    /// Adds a recording: its innovations, the first columns, and these.
    pub fn add(&mut self, whitened: &[f64], first: &[Vec<f64>], columns: &[Vec<f64>]) {
        for (i, a) in columns.iter().enumerate() {
            first.iter().enumerate().for_each(|(k, f)| self.with_first[(k, i)] += dot(a, f));
        }
        add(&mut self.products, &mut self.with_data, whitened, columns);
    }
}

/// Adds the products of columns with each other and with the innovations.
fn add(products: &mut DMatrix<f64>, with_data: &mut DVector<f64>, whitened: &[f64], columns: &[Vec<f64>]) {
    for (i, a) in columns.iter().enumerate() {
        with_data[i] += dot(a, whitened);
        for (j, b) in columns.iter().enumerate().take(i + 1) {
            let product = dot(a, b);
            products[(i, j)] += product;
            if i != j {
                products[(j, i)] += product;
            }
        }
    }
}

/// Sums by eights, so that they are taken side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a8, b8) = (a.as_chunks::<8>(), b.as_chunks::<8>());
    for (a, b) in a8.0.iter().zip(b8.0) {
        (0..8).for_each(|i| sums[i] += a[i] * b[i]);
    }
    sums.iter().sum::<f64>() + a8.1.iter().zip(b8.1).map(|(a, b)| a * b).sum::<f64>()
}

/// What recordings say of a set of columns.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Amplitudes, in the order of the set.
    pub mean: DVector<f64>,
    /// Their covariance.
    pub covariance: DMatrix<f64>,
    /// ln p(y | the set), amplitudes integrated out.
    pub log_evidence: f64,
}

impl Gram {
    /// Of no recording yet.
    pub fn new(columns: usize) -> Self {
        Self {
            products: DMatrix::zeros(columns, columns),
            with_data: DVector::zeros(columns),
            data: 0.0,
            log_determinant: 0.0,
            readings: 0,
        }
    }
    /// Adds a recording: its innovations, its columns, and the log determinant of its filter.
    pub fn add(&mut self, whitened: &[f64], columns: &[Vec<f64>], log_determinant: f64) {
        add(&mut self.products, &mut self.with_data, whitened, columns);
        self.data += dot(whitened, whitened);
        self.log_determinant += log_determinant;
        self.readings += whitened.len();
    }
    /// With further columns behind its own.
    pub fn with(&self, further: &Further) -> Self {
        let (m, n) = further.with_first.shape();
        let mut products = DMatrix::zeros(m + n, m + n);
        products.view_mut((0, 0), (m, m)).copy_from(&self.products);
        products.view_mut((0, m), (m, n)).copy_from(&further.with_first);
        products.view_mut((m, 0), (n, m)).copy_from(&further.with_first.transpose());
        products.view_mut((m, m), (n, n)).copy_from(&further.products);
        let data = self.with_data.iter().chain(&further.with_data);
        let with_data = DVector::from_iterator(m + n, data.copied());
        Self { products, with_data, ..*self }
    }
    /// How many innovations there are.
    pub fn readings(&self) -> f64 {
        self.readings as f64
    }
    /// ln p(y) without any column.
    pub fn log_likelihood(&self) -> f64 {
        -0.5 * (self.log_determinant + self.data)
    }
    /// Of a set of columns, each with its prior; `None` where the numbers are not finite.
    pub fn posterior(&self, set: &[(usize, Prior)]) -> Option<Posterior> {
        let n = set.len();
        let precision = |k: usize| set[k].1.deviation.powi(-2);
        let a = DMatrix::from_fn(n, n, |i, j| {
            self.products[(set[i].0, set[j].0)] + if i == j { precision(i) } else { 0.0 }
        });
        let b = DVector::from_fn(n, |i, _| precision(i) * set[i].1.mean - self.with_data[set[i].0]);
        let factor = Cholesky::new(a)?;
        let mean = factor.solve(&b);
        let prior: f64 = (0..n).map(|k| precision(k) * set[k].1.mean.powi(2)).sum();
        let occam: f64 = (0..n).map(|k| 2.0 * factor.l_dirty()[(k, k)].ln() - precision(k).ln()).sum();
        let log_evidence = self.log_likelihood() - 0.5 * (prior - b.dot(&mean) + occam); // (EST-5)
        log_evidence.is_finite().then(|| Posterior { mean, covariance: factor.inverse(), log_evidence })
    }
}
