//! Every identification method on synthetic recordings of DELIAN's joints: bias, spread, coverage of the intervals.
//!
//! ```text
//! cargo run --release -p trueup-identification --example benchmark -- run [--seeds 30] [--shard i/n] [-o results.csv]
//! cargo run --release -p trueup-identification --example benchmark -- table results.csv...
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::expect_used, missing_docs)]

mod synthetic;
mod table;

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Parser, Subcommand};
use synthetic::{Cell, Data, simulate};
use trueup_identification::covariance::Information;
use trueup_identification::estimate::{EstimateSettings, estimate};
use trueup_identification::lsq::{LeastSquares, Loss};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::regress::{KnownParameters, Regression, regress};
use trueup_identification::run::IdentificationRun;
use trueup_identification::unknown::{FitTarget, FitUnknown};
use trueup_models::joint::{input, output, parameter as p};

pub(crate) const FITTED: [(&str, usize); 4] = [
    ("stiffness", p::STIFFNESS),
    ("damping", p::DAMPING),
    ("coulombFriction", p::COULOMB_FRICTION),
    ("viscousFriction", p::VISCOUS_FRICTION),
];
pub(crate) const METHODS: [&str; 5] = ["ls-literal", "ls", "filtered", "iv", "output-error"];

#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make recordings, identify, write one line per cell, seed, method and parameter
    Run {
        #[arg(long, default_value_t = 30)]
        seeds: u64,
        /// Which share of the seeds
        #[arg(long, default_value = "0/1")]
        shard: String,
        /// Only this cell, by number
        #[arg(long)]
        cell: Option<usize>,
        /// Intervals by profile likelihood instead of standard errors
        #[arg(long)]
        profile: bool,
        #[arg(short, long, default_value = "results.csv")]
        output: PathBuf,
    },
    /// Draw the table of the results
    Table { files: Vec<PathBuf> },
}

/// Every combination of case, joint, rate and counts that is requested.
pub(crate) fn cells() -> Vec<Cell> {
    let mut all = Vec::new();
    for case in ['A', 'B', 'C'] {
        for joint in [1, 2] {
            for (rate, counts) in [(100.0, 16.0), (100.0, 500.0), (1000.0, 16.0), (1000.0, 500.0)] {
                all.push(Cell { case, joint, rate, counts });
            }
        }
    }
    all
}

fn main() {
    match Args::parse().command {
        Command::Table { files } => table::print(&files),
        Command::Run { seeds, shard, cell, profile, output } => {
            let (i, n) = shard.split_once('/').expect("--shard i/n");
            let (i, n): (u64, u64) = (i.parse().expect("a number"), n.parse().expect("a number"));
            let mut text = String::new();
            for (c, cell) in cells().iter().enumerate().filter(|(c, _)| cell.is_none_or(|only| only == *c)) {
                let begin = std::time::Instant::now();
                for seed in (0..seeds).filter(|s| s % n == i) {
                    one(&mut text, c, cell, seed, profile);
                }
                eprintln!("{cell:?}: {:.1} s", begin.elapsed().as_secs_f64());
                std::fs::write(&output, &text).expect("the results can be written");
            }
        }
    }
}

fn one(text: &mut String, c: usize, cell: &Cell, seed: u64, profile: bool) {
    let data = cell.data(seed);
    let q = &data.truth;
    let known = KnownParameters {
        motor_inertia: q[p::MOTOR_INERTIA],
        torque_constant: q[p::TORQUE_CONSTANT],
        gear_ratio: q[p::GEAR_RATIO],
    };
    let mut line = |method: &str, k: usize, value: f64, ci: Option<[f64; 2]>, [bound, se]: [f64; 2]| {
        let truth = q[FITTED[k].1];
        let covered = ci.map_or(-1, |[a, b]| i32::from(a <= truth && truth <= b));
        let error = value / truth - 1.0;
        let _ = writeln!(text, "{c},{seed},{method},{k},{error},{covered},{bound},{}", se / truth);
    };
    let mut found = [f64::NAN; 4];
    for (method, kind) in [
        ("ls-literal", Regression::Literal),
        ("ls", Regression::Aligned),
        ("filtered", Regression::Filtered(8.0)),
    ] {
        if let Ok(r) = regress(&data.measured, None, &known, kind) {
            (0..4).for_each(|k| line(method, k, r.values[k], None, [f64::NAN; 2]));
            found = r.values;
        }
    }
    let model = synthetic::joint();
    let sane = |v: [f64; 4]| -> [f64; 4] {
        std::array::from_fn(|k| {
            let guess = 1.5 * q[FITTED[k].1];
            if v[k] > 0.1 * guess && v[k] < 10.0 * guess { v[k] } else { guess }
        })
    };
    for _ in 0..3 {
        let mut guess = *q;
        sane(found).iter().zip(FITTED).for_each(|(v, (_, i))| guess[i] = *v);
        guess[p::LOAD_INERTIA] *= 1.2;
        let mut simulated: Vec<IdentificationRun> = data.commanded.clone();
        if !simulated.iter_mut().all(|run| simulate(&model, run, &guess)) {
            break;
        }
        if let Ok(r) = regress(&data.measured, Some(&simulated), &known, Regression::Filtered(8.0)) {
            found = r.values;
        }
    }
    (0..4).for_each(|k| line("iv", k, found[k], None, [f64::NAN; 2]));
    let (problem, truth) = output_error(&model, cell, &data, 1.5);
    let bound = problem.evaluate(&truth, true).ok().and_then(|e| e.jacobian).map(|j| Information::new(&j));
    let mut from_iv = problem.start();
    sane(found).iter().enumerate().for_each(|(k, v)| from_iv[k] = v.ln());
    let settings = EstimateSettings {
        starts: vec![problem.start(), from_iv],
        loss: Loss::Squares,
        profile: if profile { vec![0, 1, 2, 3] } else { Vec::new() },
        first_iterations: 30,
    };
    match estimate(&problem, &settings) {
        Ok(e) => {
            for k in 0..4 {
                let u = &e.unknowns[k];
                let ends = [u.ci95[0].unwrap_or(0.0), u.ci95[1].unwrap_or(f64::INFINITY)];
                let bound = bound.as_ref().map_or(f64::NAN, |b| b.covariance[(k, k)].sqrt());
                line("output-error", k, u.value, Some(ends), [bound, u.standard_error.unwrap_or(f64::NAN)]);
            }
        }
        Err(e) => eprintln!("{cell:?} seed {seed}: {e}"),
    }
}

/// The problem that output error solves, started `wrong` times off, and its true coordinates.
fn output_error<'a>(
    model: &'a SimulatedPlant,
    cell: &Cell,
    data: &'a Data,
    wrong: f64,
) -> (OutputError<'a>, Vec<f64>) {
    let q = &data.truth;
    let mut unknowns: Vec<FitUnknown> =
        FITTED.iter().map(|(name, i)| FitUnknown::positive(name, *i, wrong * q[*i])).collect();
    let mut truth: Vec<f64> = FITTED.iter().map(|(_, i)| q[*i].ln()).collect();
    unknowns.push(FitUnknown::positive("loadInertia", p::LOAD_INERTIA, 1.2 * q[p::LOAD_INERTIA]));
    truth.push(q[p::LOAD_INERTIA].ln());
    unknowns.push(FitUnknown::free(
        "loadAngle.offset",
        FitTarget::Offset(output::LOAD_ANGLE),
        None,
        synthetic::AMR,
    ));
    truth.push(data.load_offset / synthetic::AMR);
    let count = 2.0 * std::f64::consts::PI / cell.counts;
    for (run, shift) in data.motor_offsets.iter().enumerate() {
        let mut u =
            FitUnknown::free("motorAngle.offset", FitTarget::Offset(output::MOTOR_ANGLE), Some(run), count);
        // Anywhere within one count.
        u.prior = Some((0.0, 1.0 / 12f64.sqrt()));
        unknowns.push(u);
        truth.push(shift / count);
    }
    if cell.case == 'C' {
        let gain = FitUnknown { start: 1.1, ..FitUnknown::positive("externalTorque.gain", 0, 1.0) };
        unknowns.push(FitUnknown { target: FitTarget::InputGain(input::EXTERNAL_TORQUE), ..gain });
        truth.push(0.0);
    }
    (OutputError::new(model, q, &data.commanded, unknowns), truth)
}
