//! The engine about a trajectory: any sizes against dense algebra, its gauge by duals, a fit that returns.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use trueup_estimation::innovations::column::{ColumnPart, FilterColumn};
use trueup_estimation::innovations::evidence::{AmplitudePriors, log_evidence};
use trueup_estimation::innovations::filter::data_innovations;
use trueup_estimation::innovations::filter_data::{DataColumn, FilterGains, FilterInput};
use trueup_estimation::innovations::gram::PackedColumns;
use trueup_estimation::innovations::linear::{PlantStep, ReadingRows, StepOrder};
use trueup_estimation::innovations::smoother::smooth_with_powers;
use trueup_estimation::innovations::trajectory::frame::TrajectoryFrame;
use trueup_estimation::innovations::trajectory::plant::{TrajectoryPlant, TrajectoryPoint};
use trueup_models::plants::{PlantStructure, build};
use trueup_numerics::hybrid::At;
use trueup_plant::{InverseMass, Plant, force_of_changes, tangent};
use trueup_signals::{Case, Loaded};

const NODES: usize = 12;
/// Coordinates and channels: sizes that no kernel was made for.
const FORCES: usize = 3;
const CHANNELS: usize = 2;
const PLAIN: usize = 2 * FORCES;
const SIZE: usize = PLAIN + FORCES + CHANNELS;

/// A linear system with steps of its own, everything about it drawn.
struct OwnSteps {
    steps: Vec<PlantStep>,
    noise: Vec<Vec<f64>>,
    rows: ReadingRows,
    variance: Vec<f64>,
    first: Vec<f64>,
    counted: Vec<bool>,
    data: DataColumn,
}

impl OwnSteps {
    fn new(seed: u64) -> Self {
        let rng = &mut StdRng::seed_from_u64(seed);
        let mut draw =
            |n: usize, by: f64| -> Vec<f64> { (0..n).map(|_| by * rng.random_range(-1.0..1.0)).collect() };
        let (mut steps, mut noise) = (Vec::new(), Vec::new());
        for _ in 0..NODES - 1 {
            let b = draw(PLAIN * FORCES, 1.0);
            let (mut a, mut by_force, mut q) =
                (vec![0.0; SIZE * SIZE], vec![0.0; SIZE * FORCES], vec![0.0; SIZE * SIZE]);
            for i in 0..PLAIN {
                a[SIZE * i..][..PLAIN].copy_from_slice(&draw(PLAIN, 0.4));
                a[SIZE * i + PLAIN..][..FORCES].copy_from_slice(&b[FORCES * i..][..FORCES]);
                by_force[FORCES * i..][..FORCES].copy_from_slice(&b[FORCES * i..][..FORCES]);
                for j in 0..PLAIN {
                    let product = |k: usize| b[FORCES * i + k] * b[FORCES * j + k];
                    q[SIZE * i + j] = 0.02 * (0..FORCES).map(product).sum::<f64>();
                }
            }
            for k in PLAIN..SIZE {
                a[(SIZE + 1) * k] = 0.6 + draw(1, 0.3)[0];
                q[(SIZE + 1) * k] = 1.0 - a[(SIZE + 1) * k].powi(2);
            }
            steps.push(PlantStep { stuck: Vec::new(), a, b: by_force, defect: draw(PLAIN, 1.0) });
            noise.push(q);
        }
        let all = NODES * CHANNELS;
        let mut h = vec![0.0; all * SIZE];
        for (k, row) in h.chunks_mut(SIZE).enumerate() {
            row[..PLAIN].copy_from_slice(&draw(PLAIN, 1.0));
            row[PLAIN + FORCES + k % CHANNELS] = 1.0;
        }
        let there = draw(all, 1.0);
        let mut first = vec![0.0; SIZE * SIZE];
        (0..SIZE).for_each(|k| first[(SIZE + 1) * k] = 1.0 + draw(1, 0.5)[0]);
        let forces = (0..FORCES).map(|_| draw(NODES, 1.0)).collect();
        Self {
            steps,
            noise,
            rows: ReadingRows { h, direct: vec![0.0; all * FORCES] },
            variance: there.iter().map(|x| if *x < -0.6 { 0.0 } else { 0.2 + x.abs() }).collect(),
            first,
            counted: vec![true; all],
            data: DataColumn { forces, readings: draw(all, 3.0), first: draw(SIZE, 1.0) },
        }
    }

    fn gains(&self) -> FilterGains<'_> {
        let input = FilterInput {
            steps: &self.steps,
            noise: self.noise.clone(),
            order: StepOrder::Own(NODES),
            unknown: &[],
            unknown_on: (0, 0),
            rows: &self.rows,
            variance: self.variance.clone(),
            counted: &self.counted,
            first: self.first.clone(),
            forces: FORCES,
            channels: CHANNELS,
            errors: CHANNELS,
        };
        FilterGains::new(input, true)
    }

    /// Mean of all states from a first one, with forces and defects.
    fn mean(&self, first: &[f64], forces: &[Vec<f64>], defects: f64) -> DVector<f64> {
        let mut mean = DVector::zeros(SIZE * NODES);
        mean.rows_mut(0, SIZE).copy_from_slice(first);
        for t in 1..NODES {
            let s = &self.steps[t - 1];
            let push = DVector::from_iterator(FORCES, forces.iter().map(|f| f[t - 1]));
            let mut next = DMatrix::from_row_slice(SIZE, SIZE, &s.a) * mean.rows(SIZE * (t - 1), SIZE)
                + DMatrix::from_row_slice(SIZE, FORCES, &s.b) * push;
            (0..PLAIN).for_each(|i| next[i] += defects * s.defect[i]);
            mean.rows_mut(SIZE * t, SIZE).copy_from(&next);
        }
        mean
    }

    /// Covariance of all states.
    fn covariance(&self) -> DMatrix<f64> {
        let square = |v: &[f64]| DMatrix::from_row_slice(SIZE, SIZE, v);
        let mut all = DMatrix::zeros(SIZE * NODES, SIZE * NODES);
        all.view_mut((0, 0), (SIZE, SIZE)).copy_from(&square(&self.first));
        for t in 1..NODES {
            let (i, j) = (SIZE * t, SIZE * (t - 1));
            let a = square(&self.steps[t - 1].a);
            let cross = &a * all.view((j, 0), (SIZE, i));
            all.view_mut((i, 0), (SIZE, i)).copy_from(&cross);
            all.view_mut((0, i), (i, SIZE)).copy_from(&cross.transpose());
            let own = &a * all.view((j, j), (SIZE, SIZE)) * a.transpose() + square(&self.noise[t - 1]);
            all.view_mut((i, i), (SIZE, SIZE)).copy_from(&own);
        }
        all
    }
}

fn close(a: f64, b: f64, size: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (size.abs() + 1.0)
}

/// Checks EST-3, EST-4, EST-6, EST-15.
#[test]
fn any_sizes_are_those_of_the_whole_normal_distribution() {
    for seed in 0..12 {
        let s = OwnSteps::new(seed);
        let there: Vec<usize> = (0..NODES * CHANNELS).filter(|k| s.variance[*k] > 0.0).collect();
        let rows = DMatrix::from_fn(there.len(), SIZE * NODES, |i, j| {
            let t = there[i] / CHANNELS;
            if j / SIZE == t { s.rows.h[SIZE * there[i] + j % SIZE] } else { 0.0 }
        });
        let noise = DMatrix::from_diagonal(&DVector::from_iterator(
            there.len(),
            there.iter().map(|k| s.variance[*k]),
        ));
        let (mean, covariance) = (s.mean(&s.data.first, &s.data.forces, 1.0), s.covariance());
        let values = DVector::from_iterator(there.len(), there.iter().map(|k| s.data.readings[*k]));
        let factor = Cholesky::new(&rows * &covariance * rows.transpose() + noise).unwrap();
        let off = values - &rows * &mean;
        let weighted = factor.solve(&off);
        let gains = s.gains();
        // Squares and determinant.
        let e = data_innovations(&gains, &s.data);
        let squares: f64 = e.iter().map(|e| e * e).sum();
        assert!(close(squares, off.dot(&weighted), squares, 1e-9), "seed {seed}: {squares}");
        let log: f64 = there.iter().map(|k| gains.variance[*k].ln()).sum();
        let determinant = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        assert!(close(log, determinant, log, 1e-9), "seed {seed}: {log}, dense {determinant}");
        // Smoothed states and scores.
        let smoothed = smooth_with_powers(&gains, &s.data);
        let states = &mean + &covariance * rows.transpose() * &weighted;
        for (k, (a, b)) in smoothed.states.iter().zip(states.iter()).enumerate() {
            assert!(close(*a, *b, *b, 1e-9), "seed {seed}, state {k}: {a}, dense {b}");
        }
        let nothing = vec![vec![0.0; NODES]; FORCES];
        for t in 0..NODES {
            for k in 0..FORCES {
                let mut push = nothing.clone();
                push[k][t] = 1.0;
                let want = (&rows * s.mean(&[0.0; SIZE], &push, 0.0)).dot(&weighted);
                let got = smoothed.scores[(FORCES + CHANNELS) * t + k];
                assert!(close(got, want, want, 1e-9), "seed {seed}, score {t} {k}: {got}, dense {want}");
            }
        }
        for (i, k) in there.iter().enumerate() {
            let got = smoothed.scores[(FORCES + CHANNELS) * (k / CHANNELS) + FORCES + k % CHANNELS];
            assert!(close(got, weighted[i], weighted[i], 1e-9), "seed {seed}, score of reading {k}: {got}");
        }
        powers(&s, &gains, &smoothed.powers, seed);
        columns(&s, &gains, &rows, &factor, &weighted, &there, seed);
    }
}

/// A latent's score at a node is that of a step of it there: the innovations that such a step causes, against those of the data.
fn powers(s: &OwnSteps, gains: &FilterGains<'_>, got: &[[f64; 2]], seed: u64) {
    let data = data_innovations(gains, &s.data);
    for (k, got) in (PLAIN..SIZE).zip(got) {
        let mut want = [0.0; 2];
        for from in 1..NODES {
            let mut z = DVector::zeros(SIZE);
            z[k] = 1.0;
            let (mut along, mut square) = (0.0, 0.0);
            for t in from..NODES {
                if t > from {
                    z = DMatrix::from_row_slice(SIZE, SIZE, &s.steps[t - 1].a) * z;
                }
                for at in (CHANNELS * t..CHANNELS * (t + 1)).filter(|at| s.variance[*at] > 0.0) {
                    let e: f64 =
                        s.rows.h[SIZE * at..SIZE * (at + 1)].iter().zip(z.iter()).map(|(h, z)| h * z).sum();
                    (0..SIZE).for_each(|i| z[i] -= gains.gain[SIZE * at + i] * e);
                    let whitened = e / gains.variance[at].sqrt();
                    along += whitened * data[at];
                    square += whitened * whitened;
                }
            }
            let new = 1.0 - s.steps[from - 1].a[(SIZE + 1) * k].powi(2);
            want[0] += new * along * along;
            want[1] += new * square;
        }
        for (got, want) in got.iter().zip(want) {
            assert!(
                close(*got, want, want, 1e-9),
                "seed {seed}, power of latent {k}: {got}, by steps {want}"
            );
        }
    }
}

/// Columns in single precision, and the evidence of their set.
fn columns(
    s: &OwnSteps,
    gains: &FilterGains<'_>,
    rows: &DMatrix<f64>,
    factor: &Cholesky<f64, nalgebra::Dyn>,
    weighted: &DVector<f64>,
    there: &[usize],
    seed: u64,
) {
    let rng = &mut StdRng::seed_from_u64(seed + 100);
    let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
    let force: FilterColumn = vec![ColumnPart::force(1, draw(NODES))];
    let error: FilterColumn = vec![ColumnPart::reading(0, draw(NODES))];
    let mut push = vec![vec![0.0; NODES]; FORCES];
    push[1] = force[0].forces[0].values.to_vec();
    let by_force = rows * s.mean(&[0.0; SIZE], &push, 0.0);
    let by_error = DVector::from_iterator(
        there.len(),
        there.iter().map(|k| if k % CHANNELS == 0 { error[0].readings[0].values[k / CHANNELS] } else { 0.0 }),
    );
    let packed = PackedColumns::new(vec![s.data.clone()], &[force, error], CHANNELS);
    let mut gram = packed.nothing();
    packed.pass_base(0, std::slice::from_ref(gains), std::slice::from_mut(&mut gram), |_, _| ());
    let gram = gram.mirrored();
    let dense = DMatrix::from_columns(&[by_force, by_error]);
    let solved = factor.solve(&dense);
    for i in 0..2 {
        let want = dense.column(i).dot(weighted);
        assert!(close(gram.product(i + 1, 0), want, want, 1e-5), "seed {seed}, column {i}: {want}");
        for j in 0..2 {
            let want = dense.column(i).dot(&solved.column(j));
            assert!(
                close(gram.product(i + 1, j + 1), want, want, 1e-5),
                "seed {seed}, columns {i} {j}: {want}"
            );
        }
    }
    let priors = AmplitudePriors { mean: vec![0.3, 0.0], deviation: vec![2.0, 0.7], parameters: 0 };
    assert!(log_evidence(&gram, &priors).log.is_finite());
}

/// An arm as it was built and as it is: structure, its parameters as lines of a case.
fn arm(flexible: &[bool], fixed: bool, rng: &mut StdRng) -> (Arc<dyn Plant>, Vec<f64>, String) {
    let plant = build(&PlantStructure {
        model: "PlanarManipulator".into(),
        flexible: flexible.to_vec(),
        fixed_base: fixed,
        ..PlantStructure::default()
    })
    .unwrap();
    let mut theta: Vec<f64> = plant.table().parameters.iter().map(|q| q.start).collect();
    let mut lines =
        format!("jointFlexible = {flexible:?}\nbase = \"{}\"\n", if fixed { "fixed" } else { "free" });
    for (q, v) in plant.table().parameters.iter().zip(&mut theta) {
        if q.name == "gravity[2]" && fixed {
            *v = -9.81;
        } else if q.items.is_empty() && !q.is_initial() && !q.name.starts_with("gearRatio") {
            *v *= rng.random_range(0.8..1.3);
        }
        if q.items.is_empty() {
            lines += &format!("\"{}\" = {v:e}\n", q.name);
        }
    }
    (plant, theta, lines)
}

/// Recordings of an arm that waves of torque move, at 100 Hz with held inputs: its coordinates and `more` outputs; `truth`: its
/// parameters.
fn recorded(plant: &TrajectoryPlant, truth: &[f64], lines: &str, more: &[&str], rng: &mut StdRng) -> Loaded {
    let table = plant.plant().table();
    let n = plant.coordinates();
    let hanging = plant.needed(truth, &plant.first(), &vec![0.0; n]).unwrap();
    let mut tables = BTreeMap::new();
    for name in ["a.csv", "b.csv"] {
        let sizes = [0.4, 0.1, 0.05, 0.02];
        let waves: Vec<[f64; 3]> = (0..plant.drives.len())
            .map(|j| [sizes[j.min(3)], rng.random_range(3.0..8.0), rng.random_range(0.0..6.0)])
            .collect();
        let mut x = plant.first();
        let mut columns: Vec<(String, Vec<f64>)> = vec![("time".into(), Vec::new())];
        columns.extend(table.driving.iter().map(|k| (table.inputs[*k].name.clone(), Vec::new())));
        let own = plant.plant().coordinates().iter().map(|c| c.position_output);
        let angles: Vec<usize> = own.chain(more.iter().map(|name| table.output(name).unwrap())).collect();
        columns.extend(angles.iter().map(|k| (table.outputs[*k].name.clone(), Vec::new())));
        for k in 0..150 {
            let t = f64::from(k) * 0.01;
            let torque: Vec<f64> = waves
                .iter()
                .zip(&plant.joints)
                .map(|([size, w, phase], joint)| hanging[*joint] + size * (w * t + phase).sin())
                .collect();
            let shown = plant
                .outputs(TrajectoryPoint { theta: truth, state: &x, torque: &torque, time: t }, &angles)
                .0;
            let noise: Vec<f64> =
                shown.iter().map(|q| q + 1e-4 * Distribution::<f64>::sample(&StandardNormal, rng)).collect();
            let row = std::iter::once(t).chain(torque.iter().copied()).chain(noise);
            columns.iter_mut().zip(row).for_each(|(c, v)| c.1.push(v));
            for _ in 0..20 {
                let rates = |x: &[f64]| -> Vec<f64> {
                    let point = TrajectoryPoint { theta: truth, state: x, torque: &torque, time: t };
                    x[n..].iter().copied().chain(plant.accelerations(point, &vec![0.0; n])).collect()
                };
                let ahead =
                    |by: f64, k: &[f64]| -> Vec<f64> { x.iter().zip(k).map(|(x, k)| x + by * k).collect() };
                let middle = rates(&ahead(2.5e-4, &rates(&x)));
                x = ahead(5e-4, &middle);
            }
        }
        tables.insert(name.to_owned(), columns);
    }
    let noises: String = plant
        .plant()
        .coordinates()
        .iter()
        .map(|c| format!("[channels.\"{}\"]\nnoise = 1e-4\n", table.outputs[c.position_output].name))
        .chain(
            table
                .driving
                .iter()
                .map(|k| format!("[channels.\"{}\"]\ninterpolation = \"hold\"\n", table.inputs[*k].name)),
        )
        .collect();
    let text = format!(
        "model = \"PlanarManipulator\"\ntrain = [\"a.csv\", \"b.csv\"]\n[parameters]\n{lines}\n{noises}"
    );
    Case::of_tables(&text, &tables, |_| Ok(Vec::new())).unwrap().0
}

/// Structures of arms: on a base that floats or is held under gravity, springs in all joints, some or none.
const ARMS: [(&[bool], bool); 4] =
    [(&[true, false, false], false), (&[false, false], true), (&[true, true], true), (&[false, true], false)];

/// The inverse mass of a state serves other forces and torques there: with it, tangent and forces of parameters have the same bits as
/// each by itself.
#[test]
fn a_shared_inverse_mass_changes_no_bit() {
    for (seed, (flexible, fixed)) in ARMS.iter().enumerate() {
        let rng = &mut StdRng::seed_from_u64(seed as u64);
        let (plant, theta, _) = arm(flexible, *fixed, rng);
        let sizes = plant.sizes();
        let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
        let (n, coordinates) = (plant.coordinates().len(), plant.coordinates());
        let (x, u, other, force) = (draw(sizes.states), draw(sizes.inputs), draw(sizes.inputs), draw(n));
        let at = At { t: 0.0, x: &x, u: &u, p: &theta, modes: &[] };
        let places: Vec<usize> =
            coordinates.iter().filter_map(|c| c.position).chain(coordinates.iter().map(|c| c.rate)).collect();
        let (inverse, by_state) = InverseMass::with_tangent(&*plant, at, &force, &places).unwrap();
        let whole = tangent(&*plant, at, &force, &[]).unwrap();
        for (i, c) in coordinates.iter().enumerate() {
            assert_eq!(inverse.by_force[n * i..n * (i + 1)], whole.by_force[n * c.rate..n * (c.rate + 1)]);
            for (k, place) in places.iter().enumerate() {
                assert_eq!(
                    by_state[2 * n * i + k],
                    whole.by_state[sizes.states * c.rate + place],
                    "seed {seed}"
                );
            }
        }
        let elsewhere = At { u: &other, ..at };
        let changes: Vec<(usize, f64)> = (0..theta.len()).map(|k| (k, 1.0)).collect();
        let own = inverse.force_of_changes(&*plant, elsewhere, &force, &changes);
        let alone = force_of_changes(&*plant, elsewhere, &force, &changes).unwrap();
        assert_eq!(own, alone, "seed {seed}");
        assert_eq!(InverseMass::of(&*plant, elsewhere).unwrap(), inverse, "seed {seed}");
    }
}

/// Checks EST-11: masses, inertias, springs, field, torques and own forces scaled together change no motion.
#[test]
fn columns_along_the_trajectory_of_an_arm_sum_to_the_torques() {
    for (seed, (flexible, fixed)) in ARMS.iter().enumerate() {
        let rng = &mut StdRng::seed_from_u64(seed as u64);
        let (plant, theta, lines) = arm(flexible, *fixed, rng);
        let plant = TrajectoryPlant::new(plant, &theta).unwrap();
        let loaded = recorded(&plant, &theta, &lines, &[], rng);
        let mut frame = TrajectoryFrame::new(&loaded, plant, &theta, &[]).unwrap();
        let n = frame.coordinates();
        for run in &mut frame.runs {
            let own = (0..run.own.len()).map(|_| rng.random_range(-0.1..0.1)).collect();
            run.put(run.states.clone(), run.forces.clone(), own);
        }
        frame.linearise(&[]).unwrap();
        let columns = frame.parameter_columns();
        assert!(frame.unknown.iter().filter(|u| u.logarithm).count() > 3);
        for (k, run) in frame.runs.iter().enumerate() {
            let mut sum = run.own.clone();
            let mut size = 0.0f64;
            for (u, column) in frame.unknown.iter().zip(columns.iter()).filter(|(u, _)| u.logarithm) {
                assert!(u.deviation > 0.0);
                for s in &column[k].forces {
                    size = s.values.iter().fold(size, |m, v| m.max(v.abs()));
                    s.values.iter().enumerate().for_each(|(t, v)| sum[n * t + s.on] += v);
                }
            }
            for t in 0..run.nodes.len() {
                for (j, on) in frame.plant.drives.iter().enumerate() {
                    let ends = [0, run.nodes.parts - 1].map(|part| run.nodes.torque(t, part)[j]);
                    sum[n * t + on] += 0.5 * (ends[0] + ends[1]);
                }
            }
            let worst = sum.iter().fold(0.0f64, |m, s| m.max(s.abs()));
            assert!(worst < 1e-12 * size, "seed {seed}, recording {k}: {worst:.1e} of {size}");
        }
    }
}

/// From seven tenths of masses, inertias and springs, 3.6 to 36 standard deviations of their priors away, a fit comes back: to the
/// evidence that a fit from the truth has, each parameter within a standard deviation.
#[test]
fn a_fit_of_an_arm_returns_in_what_the_data_know() {
    for (seed, (flexible, fixed)) in ARMS.iter().enumerate().take(2) {
        let rng = &mut StdRng::seed_from_u64(50 + seed as u64);
        let (plant, truth, lines) = arm(flexible, *fixed, rng);
        let plant = TrajectoryPlant::new(plant, &truth).unwrap();
        let doubts = "[uncertain]\nlinkMass = 0.1\nlinkInertia = 0.1\nmotorInertia = 0.1\n";
        let loaded = recorded(&plant, &truth, &format!("{lines}\n{doubts}"), &[], rng);
        let started = TrajectoryFrame::new(&loaded, plant, &truth, &[]).unwrap();
        let fit_from = |factor: f64| {
            let mut frame = started.clone();
            for u in started.unknown.iter().filter(|u| u.logarithm) {
                frame.theta[u.index] *= factor;
            }
            frame.linearise(&[]).unwrap();
            frame.start().unwrap();
            let q = frame.intensities.clone();
            frame.fit(&|_| Vec::new(), None, &q, 8, false).unwrap()
        };
        let (fit, from_truth) = (fit_from(0.7), fit_from(1.0));
        println!("seed {seed}: {:.2}, from the truth {:.2}", fit.evidence, from_truth.evidence);
        assert!(fit.evidence > from_truth.evidence - 1.0, "seed {seed}");
        for u in started.unknown.iter() {
            let off = u.mean_at(&fit.theta) / u.deviation;
            assert!(off.abs() < 1.0, "seed {seed}, parameter {}: off by {off} standard deviations", u.index);
        }
    }
}

/// A tip is read whatever the first pose is: straight arms at rest have outputs that no coordinate moves there.
/// Checks EST-13.
#[test]
fn every_output_of_a_tip_is_read() {
    let more = ["tipPosition[1]", "tipPosition[2]", "tipAttitude", "tipVelocity[1]", "jointVelocity[2]"];
    for (seed, (flexible, fixed)) in ARMS.iter().enumerate() {
        let rng = &mut StdRng::seed_from_u64(seed as u64 + 7);
        let (plant, theta, lines) = arm(flexible, *fixed, rng);
        let plant = TrajectoryPlant::new(plant, &theta).unwrap();
        let loaded = recorded(&plant, &theta, &lines, &more, rng);
        let frame = TrajectoryFrame::new(&loaded, plant, &theta, &[]).unwrap();
        assert_eq!(frame.channels(), frame.coordinates() + more.len());
    }
}
