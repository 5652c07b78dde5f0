//! Filter, smoother and evidence against the whole joint normal distribution, written down as one matrix.

use nalgebra::{Cholesky, DMatrix, DVector, SMatrix, SVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use trueup_estimation::evidence::{Gram, Prior};
use trueup_estimation::filter::{Filter, log_likelihood};
use trueup_estimation::smoother::smooth;
use trueup_estimation::system::{Latent, Reading, Step, System};

const N: usize = 4;
const P: usize = 2;
const NODES: usize = 9;

fn vector(rng: &mut StdRng) -> SVector<f64, N> {
    SVector::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

fn covariance(rng: &mut StdRng) -> SMatrix<f64, N, N> {
    let a = SMatrix::<f64, N, N>::from_fn(|_, _| rng.random_range(-1.0..1.0));
    a * a.transpose() + SMatrix::identity() * 0.1
}

/// Two readings at a node, one, or none.
fn random(seed: u64) -> System<N, P> {
    let rng = &mut StdRng::seed_from_u64(seed);
    let step = |rng: &mut StdRng| Step {
        transition: SMatrix::from_fn(|_, _| rng.random_range(-0.7..0.7)),
        push: vector(rng),
        noise: covariance(rng) * 0.3,
        forces: SMatrix::from_fn(|_, _| rng.random_range(-1.0..1.0)),
    };
    let reading = |rng: &mut StdRng| Reading {
        row: vector(rng),
        value: rng.random_range(-2.0..2.0),
        variance: rng.random_range(0.1..0.5),
    };
    System {
        start: vector(rng),
        start_covariance: covariance(rng),
        steps: (1..NODES).map(|_| step(rng)).collect(),
        nodes: (0..NODES).map(|k| (0..[2, 1, 0][k % 3]).map(|_| reading(rng)).collect()).collect(),
    }
}

/// Everything about a system at once: means and covariances of all states, one below the other, and of all readings.
struct Dense {
    states: DVector<f64>,
    covariance: DMatrix<f64>,
    rows: DMatrix<f64>,
    values: DVector<f64>,
    noise: DMatrix<f64>,
    /// From forces in all steps to all states.
    forces: DMatrix<f64>,
}

impl Dense {
    fn new(s: &System<N, P>) -> Self {
        let all = N * NODES;
        let mut states = DVector::zeros(all);
        let mut covariance = DMatrix::zeros(all, all);
        let mut forces = DMatrix::zeros(all, P * (NODES - 1));
        states.rows_mut(0, N).copy_from(&s.start);
        covariance.view_mut((0, 0), (N, N)).copy_from(&s.start_covariance);
        for (k, step) in s.steps.iter().enumerate() {
            let (at, to) = (N * k, N * (k + 1));
            let a = DMatrix::from_fn(N, N, |i, j| step.transition[(i, j)]);
            let mean = &a * states.rows(at, N) + DVector::from_fn(N, |i, _| step.push[i]);
            states.rows_mut(to, N).copy_from(&mean);
            let cross = &a * covariance.view((at, 0), (N, to));
            covariance.view_mut((to, 0), (N, to)).copy_from(&cross);
            covariance.view_mut((0, to), (to, N)).copy_from(&cross.transpose());
            let own = &a * covariance.view((at, at), (N, N)) * a.transpose()
                + DMatrix::from_fn(N, N, |i, j| step.noise[(i, j)]);
            covariance.view_mut((to, to), (N, N)).copy_from(&own);
            let moved = &a * forces.rows(at, N);
            forces.rows_mut(to, N).copy_from(&moved);
            forces.view_mut((to, P * k), (N, P)).copy_from(&step.forces);
        }
        let count = s.readings();
        let (mut rows, mut values) = (DMatrix::zeros(count, all), DVector::zeros(count));
        let mut noise = DMatrix::zeros(count, count);
        let mut at = 0;
        for (k, readings) in s.nodes.iter().enumerate() {
            for r in readings {
                (0..N).for_each(|i| rows[(at, N * k + i)] = r.row[i]);
                values[at] = r.value;
                noise[(at, at)] = r.variance;
                at += 1;
            }
        }
        Self { states, covariance, rows, values, noise, forces }
    }
    fn innovation(&self) -> DVector<f64> {
        &self.values - &self.rows * &self.states
    }
    fn spread(&self) -> DMatrix<f64> {
        &self.rows * &self.covariance * self.rows.transpose() + &self.noise
    }
}

fn log_normal(off: &DVector<f64>, covariance: &DMatrix<f64>) -> f64 {
    let factor = Cholesky::new(covariance.clone()).unwrap();
    let log_det: f64 = (0..off.len()).map(|k| 2.0 * factor.l()[(k, k)].ln()).sum();
    -0.5 * (off.len() as f64 * std::f64::consts::TAU.ln() + log_det + off.dot(&factor.solve(off)))
}

/// Checks EST-1 and EST-3.
#[test]
fn innovations_have_the_likelihood_of_the_whole_distribution() {
    for seed in 0..20 {
        let system = random(seed);
        let (filter, dense) = (Filter::new(&system), Dense::new(&system));
        let pass = filter.data(&system, false);
        let found = log_likelihood(filter.log_determinant, &pass.whitened);
        let wanted = log_normal(&dense.innovation(), &dense.spread());
        assert!((found - wanted).abs() < 1e-9 * wanted.abs(), "{found} {wanted}");
    }
}

/// Checks EST-6; the scores are derivatives of the likelihood, with the variance that they have.
#[test]
fn smoothed_states_and_scores_are_those_of_the_whole_distribution() {
    for seed in 20..40 {
        let system = random(seed);
        let (filter, dense) = (Filter::new(&system), Dense::new(&system));
        let smoothed = smooth(&system, &filter, &filter.data(&system, true), true);
        let inverse = dense.spread().try_inverse().unwrap();
        let cross = &dense.covariance * dense.rows.transpose();
        let mean = &dense.states + &cross * &inverse * dense.innovation();
        let left = &dense.covariance - &cross * &inverse * cross.transpose();
        let seen = (&dense.rows * &dense.forces).transpose();
        let (score, variance) = (&seen * &inverse * dense.innovation(), &seen * &inverse * seen.transpose());
        for k in 0..NODES {
            for i in 0..N {
                assert!((smoothed.states[k][i] - mean[N * k + i]).abs() < 1e-9);
                for j in 0..N {
                    assert!((smoothed.covariances[k][(i, j)] - left[(N * k + i, N * k + j)]).abs() < 1e-9);
                }
            }
            for p in (0..P).filter(|_| k + 1 < NODES) {
                let at = P * k + p;
                assert!((smoothed.scores[k][p] - score[at]).abs() < 1e-9, "{k} {p}");
                assert!((smoothed.score_variances[k][p] - variance[(at, at)]).abs() < 1e-9, "{k} {p}");
            }
        }
    }
}

/// Checks EST-4 and EST-5: amplitudes integrated out are a covariance more.
#[test]
fn evidence_of_columns_is_that_of_the_whole_distribution() {
    for seed in 40..60 {
        let system = random(seed);
        let (filter, dense) = (Filter::new(&system), Dense::new(&system));
        let rng = &mut StdRng::seed_from_u64(1000 + seed);
        let columns: Vec<(Vec<[f64; P]>, Vec<f64>)> = (0..3)
            .map(|_| {
                let forces =
                    (1..NODES).map(|_| core::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect();
                (forces, (0..system.readings()).map(|_| rng.random_range(-1.0..1.0)).collect())
            })
            .collect();
        let passed =
            filter.columns(&system, &columns.iter().map(|(f, e)| (&f[..], &e[..])).collect::<Vec<_>>());
        let mut gram = Gram::new(3);
        gram.add(&filter.data(&system, false).whitened, &passed, filter.log_determinant);
        let set = [(2, Prior { mean: 0.3, deviation: 0.8 }), (0, Prior { mean: -1.0, deviation: 2.0 })];
        let found = gram.posterior(&set).unwrap();
        let (mut off, mut spread) = (dense.innovation(), dense.spread());
        for (k, prior) in set {
            let forces =
                DVector::from_iterator(P * (NODES - 1), columns[k].0.iter().flat_map(|f| [f[0], f[1]]));
            let shows = &dense.rows * &dense.forces * forces + DVector::from_column_slice(&columns[k].1);
            off -= &shows * prior.mean;
            spread += &shows * shows.transpose() * prior.deviation.powi(2);
        }
        let wanted = log_normal(&off, &spread);
        assert!((found.log_evidence - wanted).abs() < 1e-9 * wanted.abs(), "{} {wanted}", found.log_evidence);
        assert!((found.mean.len(), found.covariance.nrows()) == (2, 2));
    }
}

/// Checks EST-7: the derivative of the likelihood by how much a latent force is driven.
#[test]
fn the_score_of_an_intensity_is_the_derivative_of_the_likelihood() {
    for seed in 60..70 {
        let system = random(seed);
        let likelihood = |place: usize, by: f64| {
            let mut other = system.clone();
            let at = N - P + place;
            other.steps.iter_mut().for_each(|s| s.noise[(at, at)] += by);
            let filter = Filter::new(&other);
            log_likelihood(filter.log_determinant, &filter.data(&other, false).whitened)
        };
        let filter = Filter::new(&system);
        let all = smooth(&system, &filter, &filter.data(&system, true), true);
        for place in 0..P {
            let score = 0.5 * (all.latent_score[place] - all.latent_information[place]);
            let difference = (likelihood(place, 1e-5) - likelihood(place, -1e-5)) / 2e-5;
            assert!((score - difference).abs() < 1e-6 * score.abs().max(1.0), "{score} {difference}");
        }
    }
}

/// Checks EST-2: the variance stays what it is, the correlation falls by e in its time.
#[test]
fn a_latent_force_is_stationary() {
    let latent = Latent { deviation: 0.7, time: 0.1 };
    let (rho, noise) = latent.over(0.1);
    assert!((rho - (-1.0f64).exp()).abs() < 1e-15);
    assert!((rho * rho * 0.49 + noise - 0.49).abs() < 1e-15);
    // Two halves of a step are one.
    let (half, less) = latent.over(0.05);
    assert!((half * half - rho).abs() < 1e-15 && (half * half * less + less - noise).abs() < 1e-15);
}
