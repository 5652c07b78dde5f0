//! Fits a case by the library alone.
#![allow(missing_docs, clippy::print_stdout, clippy::unwrap_used)]
use trueup_identification::fit::{FitOptions, fit_carried, free_run};
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::recorded::{nuisance, runs};
use trueup_identification::unknown::FitUnknown;
use trueup_signals::Case;

fn main() {
    let folder = std::env::args().nth(1).unwrap();
    let (loaded, findings) =
        Case::load(folder.as_ref(), |c| Ok(SimulatedPlant::of_case(c, &[]).unwrap().variables())).unwrap();
    findings.iter().for_each(|f| println!("{f}"));
    let model = SimulatedPlant::of_case(&loaded.case, &[]).unwrap();
    let nominal = model.set(&model.defaults(), &loaded.case.parameters).unwrap();
    let (train, holdout) = runs(&model, &loaded).unwrap();
    let before = std::time::Instant::now();
    let mut unknowns: Vec<FitUnknown> = model
        .usual()
        .iter()
        .map(|n| FitUnknown::positive(n, model.parameter(n).unwrap(), nominal[model.parameter(n).unwrap()]))
        .collect();
    unknowns.extend(nuisance(&model, &nominal, &train));
    let mut problem = OutputError::new(&model, &nominal, &train, unknowns);
    let f = fit_carried(&mut problem, &FitOptions::default()).unwrap();
    println!("{:?} {} iterations, cost {}, {:?}", f.stop, f.iterations, f.cost, before.elapsed());
    for (k, u) in problem.unknowns().iter().enumerate() {
        println!(
            "{:24} {:?} {:12.6e} start {:12.6e} +- {:.2e}",
            u.name,
            u.run,
            f.values[k],
            u.start,
            f.information.covariance[(k, k)].sqrt()
        );
    }
    f.comparisons.iter().for_each(|c| {
        println!("{} {} nrmse {:?} above floor {}", c.run, c.channel, c.nrmse(), c.above_floor())
    });
    for p in [&nominal, &f.parameters] {
        let free = free_run(&model, p, &holdout).unwrap();
        free.iter().for_each(|c| {
            println!("holdout {} {} nrmse {:?} above floor {}", c.run, c.channel, c.nrmse(), c.above_floor())
        });
    }
}
