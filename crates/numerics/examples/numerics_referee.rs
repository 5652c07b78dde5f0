//! Trajectories of small models as CSV (`model,solver,tolerance,t,x...`), to be compared with another solver.
#![allow(clippy::print_stdout)]

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Bell, Block, Robertson, VanDerPol};
use trueup_numerics::driver::{DriveError, DriverOptions, Solver, simulate};
use trueup_numerics::hybrid::Hybrid;

fn print<M: Hybrid>(
    name: &str,
    model: &M,
    p: &[f64],
    nominal: &[f64],
    solver: Solver,
    tolerances: &[f64],
    times: &[f64],
) -> Result<(), DriveError> {
    for &tolerance in tolerances {
        let options = DriverOptions { solver, tolerance, ..DriverOptions::default() };
        let run = simulate(model, p, nominal, options, &|_, _| {}, times)?;
        for (t, x) in run.t.iter().zip(&run.x) {
            let x: Vec<String> = x.iter().map(f64::to_string).collect();
            println!("{name},{solver:?},{tolerance},{t},{}", x.join(","));
        }
        for (t, modes) in &run.events {
            println!("{name} event,{solver:?},{tolerance},{t},{}", modes[0]);
        }
    }
    Ok(())
}

fn main() -> Result<(), DriveError> {
    let even = |end: f64, n: u32| (0..=n).map(|k| end * f64::from(k) / f64::from(n)).collect::<Vec<_>>();
    let decades: Vec<f64> = [0.0].into_iter().chain((-5..=8).map(|k| 4.0 * 10f64.powi(k))).collect();
    let (loose, tight) = ([1e-6, 1e-9], [1e-6, 1e-9, 1e-12]);
    print("bell", &Bell, &[], &[], Solver::Explicit, &tight, &even(10.0, 50))?;
    print("van der pol", &VanDerPol, &[], &[], Solver::Stiff, &loose, &even(2.0, 20))?;
    print("robertson", &Robertson, &[], &[1e-3, 1e-9, 1.0], Solver::Stiff, &loose, &decades)?;
    print("stick-slip", &Block, &Block::P, &[0.1, 0.5], Solver::Explicit, &tight, &even(20.0, 50))?;
    print("stick-slip", &Block, &Block::P, &[0.1, 0.5], Solver::Stiff, &loose, &even(20.0, 50))
}
