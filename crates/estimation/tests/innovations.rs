//! The innovations engine against dense algebra, its gauge, and a fit that returns.

use std::collections::BTreeMap;
use std::rc::Rc;

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use trueup_estimation::innovations::bank::{BANK, gains_of_bank};
use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::filter_data::{DataColumn, FilterGains, FilterInput};
use trueup_estimation::innovations::frame::InnovationsFrame;
use trueup_estimation::innovations::gram::{GroupSums, PackedColumns};
use trueup_estimation::innovations::intake::NodeIntake;
use trueup_estimation::innovations::linear::{Feedback, LinearPoint, PlantStep, ReadingRows, StepOrder};
use trueup_estimation::innovations::plant::ForcedPlant;
use trueup_estimation::innovations::rig::root_mean_square;
use trueup_estimation::innovations::smoother::smooth_recording;
use trueup_estimation::innovations::two_mass::{LoadTip, TwoMassPlant, parameter};
use trueup_signals::{Case, Loaded};

const NODES: usize = 24;
const CHANNELS: usize = 2;
const DT: f64 = 4e-3;

/// A linear system along a recording, everything about it drawn.
struct Drawn {
    steps: Vec<PlantStep>,
    noise: Vec<Vec<f64>>,
    mode: Vec<u8>,
    unknown: Vec<f64>,
    rows: ReadingRows,
    variance: Vec<f64>,
    first: Vec<f64>,
    data: DataColumn,
}

impl Drawn {
    fn new(seed: u64, tip: bool) -> Self {
        let rng = &mut StdRng::seed_from_u64(seed);
        let mut plant = TwoMassPlant::of(&Case::default(), 1.0);
        if tip {
            plant = plant.with_tip(LoadTip { share: 0.2, frequency: 9.0, damping: 0.05 });
        }
        let theta: Vec<f64> =
            plant.parameters().iter().map(|p| p.value * rng.random_range(0.5..2.0)).collect();
        let states = plant.states();
        let feedback = Feedback((0..2 * states).map(|_| 1e-6 * rng.random_range(-1.0..1.0)).collect());
        let point = LinearPoint { plant: &plant, theta: &theta, feedback: &feedback };
        let size = point.size();
        let modes = [vec![false, false], vec![true, false]];
        let steps: Vec<PlantStep> = modes.iter().map(|m| PlantStep::new(&point, m, DT)).collect();
        let unit = plant.usual_force();
        let noise =
            |s: &PlantStep| s.noise(&plant, DT, &[0.1 * unit, 0.03 * unit], &[unit, 0.5 * unit], 0.02);
        let noise = steps.iter().map(noise).collect();
        let mode: Vec<u8> = (0..NODES).map(|_| u8::from(rng.random_bool(0.3))).collect();
        let unknown = (0..NODES).map(|_| if rng.random_bool(0.2) { unit * unit } else { 0.0 }).collect();
        let moment = |rng: &mut StdRng| {
            let x: f64 = DT * rng.random_range(-0.5..0.5);
            [x, 0.5 * x * x, x.powi(3) / 6.0]
        };
        let moments: Vec<[f64; 3]> = (0..NODES * CHANNELS).map(|_| moment(rng)).collect();
        let shown = [0, 2].map(|k| (0..states).map(|i| f64::from(u8::from(i == k))).collect());
        let rows = ReadingRows::new(&point, &shown, &modes, &mode, &moments);
        let variance = (0..NODES * CHANNELS)
            .map(|_| if rng.random_bool(0.8) { rng.random_range(0.5..2.0) } else { 0.0 });
        let variance = variance.collect();
        let mut first = vec![0.0; size * size];
        (0..size).for_each(|i| first[(size + 1) * i] = rng.random_range(0.1..1.0));
        (size - 2..size).for_each(|i| first[(size + 1) * i] = unit * unit);
        let mut draw =
            |n: usize, by: f64| -> Vec<f64> { (0..n).map(|_| by * rng.random_range(-1.0..1.0)).collect() };
        let forces = vec![draw(NODES, unit), draw(NODES, unit)];
        let data = DataColumn { forces, readings: draw(NODES * CHANNELS, 3.0), first: draw(size, 1.0) };
        Self { steps, noise, mode, unknown, rows, variance, first, data }
    }
    fn size(&self) -> usize {
        self.data.first.len()
    }
    fn gains<'a>(&'a self, counted: &'a [bool]) -> FilterGains<'a> {
        let input = FilterInput {
            steps: &self.steps,
            noise: self.noise.clone(),
            order: StepOrder::ByMode(&self.mode),
            unknown: &self.unknown,
            unknown_on: (0, 0),
            rows: &self.rows,
            variance: self.variance.clone(),
            counted,
            first: self.first.clone(),
            forces: 2,
            channels: CHANNELS,
            errors: 0,
        };
        FilterGains::new(input, true)
    }
}

/// The same as one normal distribution of all readings.
struct Whole {
    /// Mean of all states, covariance, and how they follow from the forces in all steps.
    mean: DVector<f64>,
    covariance: DMatrix<f64>,
    by_force: DMatrix<f64>,
    /// Rows of the readings that are there, how these follow from forces directly, their values.
    rows: DMatrix<f64>,
    direct: DMatrix<f64>,
    values: DVector<f64>,
    noise: DMatrix<f64>,
    at: Vec<usize>,
}

impl Whole {
    fn new(d: &Drawn) -> Self {
        let (n, all) = (d.size(), d.size() * NODES);
        let square = |v: &[f64]| DMatrix::from_row_slice(n, n, v);
        let mut covariance = DMatrix::zeros(all, all);
        covariance.view_mut((0, 0), (n, n)).copy_from(&square(&d.first));
        let mut mean = DVector::zeros(all);
        mean.rows_mut(0, n).copy_from_slice(&d.data.first);
        let mut by_force = DMatrix::zeros(all, 2 * NODES);
        for t in 1..NODES {
            let mode = usize::from(d.mode[t - 1]);
            let (a, b) = (square(&d.steps[mode].a), DMatrix::from_row_slice(n, 2, &d.steps[mode].b));
            let mut q = square(&d.noise[mode]);
            let x = d.unknown[t - 1];
            let on = b.column(0).into_owned();
            q += x * &on * on.transpose();
            q[(0, 0)] += 0.1 * x * on[0] * on[0];
            let push = DVector::from_vec(vec![d.data.forces[0][t - 1], d.data.forces[1][t - 1]]);
            let next = &a * mean.rows(n * (t - 1), n) + &b * push;
            mean.rows_mut(n * t, n).copy_from(&next);
            let before = by_force.rows(n * (t - 1), n).into_owned();
            by_force.rows_mut(n * t, n).copy_from(&(&a * before));
            for k in 0..2 {
                let column = b.column(k).into_owned();
                by_force.view_mut((n * t, 2 * (t - 1) + k), (n, 1)).copy_from(&column);
            }
            let cross = &a * covariance.view((n * (t - 1), 0), (n, n * t));
            covariance.view_mut((n * t, 0), (n, n * t)).copy_from(&cross);
            covariance.view_mut((0, n * t), (n * t, n)).copy_from(&cross.transpose());
            let own = &a * covariance.view((n * (t - 1), n * (t - 1)), (n, n)) * a.transpose() + q;
            covariance.view_mut((n * t, n * t), (n, n)).copy_from(&own);
        }
        let at: Vec<usize> = (0..NODES * CHANNELS).filter(|k| d.variance[*k] > 0.0).collect();
        let (mut rows, mut direct) = (DMatrix::zeros(at.len(), all), DMatrix::zeros(at.len(), 2 * NODES));
        for (i, k) in at.iter().enumerate() {
            let t = k / CHANNELS;
            (0..n).for_each(|j| rows[(i, n * t + j)] = d.rows.h[n * k + j]);
            for j in 0..2 {
                let half = 0.5 * d.rows.direct[2 * k + j];
                direct[(i, 2 * t + j)] += half;
                if t > 0 {
                    direct[(i, 2 * (t - 1) + j)] += half;
                }
            }
        }
        let noise =
            DMatrix::from_diagonal(&DVector::from_iterator(at.len(), at.iter().map(|k| d.variance[*k])));
        let values = DVector::from_iterator(at.len(), at.iter().map(|k| d.data.readings[*k]));
        Self { mean, covariance, by_force, rows, direct, values, noise, at }
    }
}

fn close(a: f64, b: f64, size: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * size.max(1e-300)
}

/// Checks EST-1, EST-2, EST-3, EST-4, EST-5 and EST-6.
#[test]
fn filter_smoother_scores_and_columns_are_those_of_the_whole_normal_distribution() {
    for seed in 0..6 {
        let d = Drawn::new(seed, seed % 2 == 1);
        let counted = vec![true; NODES * CHANNELS];
        let gains = d.gains(&counted);
        let w = Whole::new(&d);
        let n = d.size();
        let forces = DVector::from_iterator(2 * NODES, (0..2 * NODES).map(|k| d.data.forces[k % 2][k / 2]));
        let error = &w.values - &w.rows * &w.mean - &w.direct * forces;
        let factor = Cholesky::new(&w.rows * &w.covariance * w.rows.transpose() + &w.noise).unwrap();
        let weighted = factor.solve(&error);
        // Likelihood.
        let packed = PackedColumns::new(vec![d.data.clone()], &[], CHANNELS);
        let mut grams = vec![packed.nothing()];
        let mut e = Vec::new();
        packed.pass_base(0, std::slice::from_ref(&gains), &mut grams, |_, x| e = x.to_vec());
        let gram = grams.remove(0);
        let want = error.dot(&weighted) + factor.determinant().ln();
        assert!(close(gram.product(0, 0) + gram.log_variance, want, want.abs(), 1e-9), "seed {seed}");
        // Smoothed states.
        let smoothed = smooth_recording(&gains, &d.data);
        let states = &w.mean + &w.covariance * w.rows.transpose() * &weighted;
        for i in 0..n {
            let size = (0..NODES).map(|t| states[n * t + i].abs()).fold(0.0, f64::max);
            for t in 0..NODES {
                let (a, b) = (smoothed.states[n * t + i], states[n * t + i]);
                assert!(close(a, b, size, 1e-9), "seed {seed}: state {i} of node {t}: {a} {b}");
            }
        }
        // Scores: by the forces, and by the readings.
        let response = &w.rows * &w.by_force + &w.direct;
        let scores = response.transpose() * &weighted;
        let size = scores.amax();
        for (k, want) in scores.iter().enumerate() {
            let got = smoothed.scores[(2 + CHANNELS) * (k / 2) + k % 2];
            assert!(close(got, *want, size, 1e-9), "seed {seed}: score {k}: {got} {want}");
        }
        for (i, k) in w.at.iter().enumerate() {
            let got = smoothed.scores[(2 + CHANNELS) * (k / CHANNELS) + 2 + k % CHANNELS];
            assert!(close(got, weighted[i], weighted.amax(), 1e-9), "seed {seed}: score of reading {k}");
        }
        // A column, in single precision: a force on the load with a reading error in addition.
        let rng = &mut StdRng::seed_from_u64(seed + 100);
        let series: Vec<f64> = (0..NODES).map(|_| rng.random_range(-1.0..1.0)).collect();
        let unit = d.data.forces[0].iter().fold(0.0f64, |m, f| m.max(f.abs()));
        let mut part = ColumnPart::force(1, series.iter().map(|s| s * unit).collect());
        part.readings.extend(ColumnPart::reading(0, series.clone()).readings);
        let column: FilterColumn = vec![part];
        let mut pushed = DVector::zeros(2 * NODES);
        (0..NODES).for_each(|t| pushed[2 * t + 1] = series[t] * unit);
        let mut shown = &response * pushed;
        for (i, k) in w.at.iter().enumerate().filter(|(_, k)| *k % CHANNELS == 0) {
            shown[i] += series[k / CHANNELS];
        }
        let group = [column];
        let own = shown.dot(&factor.solve(&shown));
        // Its amplitude integrated out is a covariance more.
        let (mean, deviation) = (0.3, 2.0);
        let priors = AmplitudePriors { mean: vec![mean], deviation: vec![deviation], parameters: 0 };
        let with = PackedColumns::new(vec![d.data.clone()], &group, CHANNELS);
        let mut gram = [with.nothing()];
        with.pass_base(0, std::slice::from_ref(&gains), &mut gram, |_, _| ());
        let [gram] = gram;
        let found = log_evidence(&gram.mirrored(), &priors).log;
        let more = &w.rows * &w.covariance * w.rows.transpose()
            + &w.noise
            + deviation.powi(2) * &shown * shown.transpose();
        let (factor_of_more, off) = (Cholesky::new(more).unwrap(), &error - mean * &shown);
        let want = -0.5 * (off.dot(&factor_of_more.solve(&off)) + factor_of_more.determinant().ln());
        assert!(close(found, want, want.abs() + own, 1e-5), "seed {seed}: evidence {found} {want}");
        let mut sums = GroupSums::new(&packed, &[&group[..]]);
        sums.pass(0, &gains, &e);
        let got = sums.done().remove(0);
        assert!(close(got.own[0], own, own, 1e-5), "seed {seed}: {} {own}", got.own[0]);
        let with = shown.dot(&weighted);
        let size = (own * error.dot(&weighted)).sqrt();
        assert!(close(got.base[0], with, size, 1e-5), "seed {seed}: {} {with}", got.base[0]);
    }
}

#[test]
fn gains_of_several_intensities_are_those_of_each() {
    for seed in 0..4 {
        let d = Drawn::new(seed, seed % 2 == 1);
        let counted = vec![true; NODES * CHANNELS];
        let one = d.gains(&counted).input;
        // One more than are filtered side by side, and the rest.
        let inputs: Vec<_> = (0..BANK + 3)
            .map(|k| {
                let mut input = one.clone();
                let factor = 4f64.powi(k as i32 - 4);
                input.noise.iter_mut().flatten().for_each(|q| *q *= factor);
                input.variance.iter_mut().for_each(|r| *r *= 1.0 + k as f64);
                input
            })
            .collect();
        let packed = PackedColumns::new(vec![d.data.clone()], &[], CHANNELS);
        let bank = gains_of_bank(inputs.clone());
        let mut together = vec![packed.nothing(); bank.len()];
        packed.pass_base(0, &bank, &mut together, |_, _| ());
        for (k, (input, (got, gram))) in inputs.into_iter().zip(bank.iter().zip(together)).enumerate() {
            let want = FilterGains::new(input, false);
            let size = want.gain.iter().fold(0.0f64, |m, g| m.max(g.abs()));
            for (a, b) in got.gain.iter().zip(want.gain.iter()) {
                assert!(close(*a, *b, size, 1e-11), "seed {seed}, intensity {k}: gain {a}, alone {b}");
            }
            for (a, b) in got.variance.iter().zip(want.variance.iter()) {
                assert!(close(*a, *b, *b, 1e-11), "seed {seed}, intensity {k}: variance {a}, alone {b}");
            }
            let mut alone = vec![packed.nothing()];
            packed.pass_base(0, &[want], &mut alone, |_, _| ());
            let (a, b) = (gram.product(0, 0), alone[0].product(0, 0));
            assert!(close(a, b, b, 1e-10), "seed {seed}, intensity {k}: squares {a}, alone {b}");
        }
    }
}

/// A joint that was simulated in small steps with a drive that excites it, and read at 200 Hz.
fn recorded(seed: u64, truth: &[f64; 7], gear_ratio: f64) -> Loaded {
    let rng = &mut StdRng::seed_from_u64(seed);
    let mut tables = BTreeMap::new();
    let [load, stiffness, damping, dry, viscous, torque, motor] = *truth;
    let load = load / gear_ratio.powi(2);
    for name in ["a.csv", "b.csv"] {
        let waves: Vec<[f64; 3]> = (0..6)
            .map(|k| [0.4 + 1.3 * f64::from(k), rng.random_range(0.5..1.0), rng.random_range(0.0..6.0)])
            .collect();
        let (mut columns, mut x) = (vec![Vec::new(); 4], [0.0f64; 4]);
        for k in 0..300 {
            let t = f64::from(k) * 5e-3;
            let current: f64 = waves.iter().map(|w| 0.35 * w[1] * (w[0] * 6.28 * t + w[2]).sin()).sum();
            let mut noise = || -> f64 { StandardNormal.sample(rng) };
            let values = [t, current, x[0] + 1e-4 * noise(), (x[2] + 1e-4 * noise()) / gear_ratio];
            columns.iter_mut().zip(values).for_each(|(c, v)| c.push(v));
            for _ in 0..5000 {
                let spring = stiffness * (x[0] - x[2]) + damping * (x[1] - x[3]);
                let pushed = torque * current - spring - viscous * x[1];
                // Dry friction takes from the speed what it can, as far as rest. Speeds first: stable without a smaller step.
                let free = x[1] + 1e-6 * pushed / motor;
                x[1] = free.signum() * (free.abs() - 1e-6 * dry / motor).max(0.0);
                x[3] += 1e-6 * spring / load;
                (x[0], x[2]) = (x[0] + 1e-6 * x[1], x[2] + 1e-6 * x[3]);
            }
        }
        let names = ["time", "motorCurrent", "motorAngle", "loadAngle"];
        let columns: Vec<(String, Vec<f64>)> = names.iter().map(|n| (*n).to_owned()).zip(columns).collect();
        tables.insert(name.to_owned(), columns);
    }
    let names = [
        "loadInertia",
        "stiffness",
        "damping",
        "coulombFriction",
        "viscousFriction",
        "torqueConstant",
        "motorInertia",
    ];
    let values: Vec<String> = names.iter().zip(truth).map(|(n, v)| format!("{n} = {v:e}")).collect();
    let text = format!(
        "model = \"TwoMassJoint\"\ntrain = [\"a.csv\", \"b.csv\"]\n[parameters]\ngearRatio = {gear_ratio:?}\n{}\n\
         [channels.motorCurrent]\ninterpolation = \"hold\"\n[channels.motorAngle]\nnoise = 1e-4\n[channels.loadAngle]\nnoise = {:e}\n",
        values.join("\n"),
        1e-4 / gear_ratio
    );
    Case::of_tables(&text, &tables, |_| Ok(Vec::new())).unwrap().0
}

const TRUTH: [f64; 7] = [0.3, 0.07, 6e-5, 5e-3, 6e-5, 0.055, 2.5e-5];

/// Checks EST-11.
#[test]
fn columns_of_the_parameters_sum_to_zero_along_a_trajectory() {
    let loaded = recorded(1, &TRUTH, 120.0);
    let plant = TwoMassPlant::of(&loaded.case, root_mean_square(&loaded, "motorCurrent"));
    let intake = Rc::new(NodeIntake::new(&loaded, &plant).unwrap());
    let mut frame = InnovationsFrame::new(&intake, Rc::new(plant), None);
    frame.smooth(&[0.02, 0.02], None);
    let (columns, priors) = frame.nuisances();
    for (k, run) in frame.runs.iter().enumerate() {
        for on in 0..2 {
            let (mut sum, mut size) = (vec![0.0; run.nodes], 0.0f64);
            for column in &columns[..priors.parameters] {
                for s in column[k].forces.iter().filter(|s| s.on == on) {
                    size += s.values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                    sum.iter_mut().zip(s.values.iter()).for_each(|(x, v)| *x += s.weight * v);
                }
            }
            assert!(sum.iter().all(|s| s.abs() < 1e-12 * size), "recording {k}, coordinate {on}");
        }
    }
}

/// Upper 1e-4 point of chi-square with 28 degrees of freedom: 7 parameters of 4 cases.
const CHI_SQUARE: f64 = 64.66;

/// What the data know are ratios; the prior standard deviations determine the common factor. Errors are compared with the standard errors of
/// the last Gram matrix: their sum of squares is chi-square, or less, as the truth is where the prior has it.
#[test]
fn a_fit_from_seven_tenths_of_all_values_returns_in_what_the_data_know() {
    let (mut sum, mut told) = (0.0, Vec::new());
    for seed in 0..4 {
        let loaded = recorded(seed, &TRUTH, 120.0);
        let plant = TwoMassPlant::of(&loaded.case, root_mean_square(&loaded, "motorCurrent"));
        let intake = Rc::new(NodeIntake::new(&loaded, &plant).unwrap());
        let mut settled = InnovationsFrame::new(&intake, Rc::new(plant.clone()), None);
        settled.settle(false);
        let plant = plant.believed(&TRUTH, &[0.1; parameter::COUNT]);
        let mut frame = InnovationsFrame { plant: Rc::new(plant), ..settled };
        // All of them together, or each by itself.
        let rng = &mut StdRng::seed_from_u64(seed + 1000);
        let mut factor = || if seed % 2 == 0 { 0.7 } else { rng.random_range(0.7..1.3) };
        frame.start = TRUTH.iter().map(|v| factor() * v).collect();
        let fit = frame.fit(&|_| Vec::new(), &frame.q.clone(), 10, true);
        frame.theta.clone_from(&fit.theta);
        frame.smooth(&fit.q, None);
        let (packed, priors) = frame.packed(&[]);
        let gram = frame.pass_base(&packed, &fit.q).gram;
        let m = priors.mean.len();
        let weight = |i: usize, j: usize| if i == j { priors.deviation[i].powi(-2) } else { 0.0 };
        let precision = DMatrix::from_fn(m, m, |i, j| gram.product(i + 1, j + 1) + weight(i, j));
        let covariance = precision.try_inverse().unwrap();
        let of_parameters = covariance.view((0, 0), (parameter::COUNT, parameter::COUNT)).into_owned();
        let off = DVector::from_fn(parameter::COUNT, |k, _| (fit.theta[k] / TRUTH[k]).ln());
        let squares = off.dot(&(of_parameters.clone().try_inverse().unwrap() * &off));
        // A ratio is known far better than it was wrong at the start.
        let ratio =
            |k: usize, j: usize| of_parameters[(k, k)] + of_parameters[(j, j)] - 2.0 * of_parameters[(k, j)];
        let known = ratio(parameter::STIFFNESS, parameter::LOAD_INERTIA).sqrt();
        assert!(known < 0.03, "seed {seed}: {known}");
        told.push(format!("seed {seed}: {squares:.1}, {:?}", off.as_slice()));
        sum += squares;
    }
    println!("{}", told.join("\n"));
    assert!(sum < CHI_SQUARE, "{sum:.1} of 28 is expected: {told:#?}");
}
