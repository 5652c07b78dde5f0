//! What the master costs: `speed SYSTEM.toml STEP STEPS [ALGORITHM]` prints ns per FMU and step of the fastest fiftieth
//! of a run with logging off; `speed SYSTEM.toml STEP STEPS ALGORITHM RESULTS` ns per step of a whole run that logs all
//! outputs at every step, the file finished. tests/masters/compare.py compares it with other masters and a plain C loop.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use trueup_cosim::system::{Algorithm, CosimSystem, RecordedVariable};
use trueup_cosim::{CosimError, Master, ResultColumn, ResultRow, ResultSink, Results, check};

/// Looks at the clock now and then.
struct Clock {
    chunk: u64,
    last: Option<Instant>,
    best: f64,
}

impl ResultSink for Clock {
    fn begin(&mut self, _: &[ResultColumn]) -> Result<(), CosimError> {
        Ok(())
    }
    fn row(&mut self, row: ResultRow<'_>) -> Result<(), CosimError> {
        if row.point.is_some_and(|p| p % self.chunk == 0) {
            let now = Instant::now();
            if let Some(last) = self.last.replace(now) {
                self.best = self.best.min(now.duration_since(last).as_secs_f64() / self.chunk as f64);
            }
        }
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [file, step, steps, ..] = &arguments[..] else {
        return Err("speed SYSTEM.toml STEP STEPS [ALGORITHM [RESULTS]]".into());
    };
    let (step, steps): (f64, u64) = (step.parse()?, steps.parse()?);
    let mut system = CosimSystem::read(file.as_ref())?;
    system.run.step = Some(step);
    system.run.stop = Some(step * steps as f64);
    system.run.algorithm = Some(match arguments.get(3).map(String::as_str) {
        Some("extrapolate") => Algorithm::Extrapolate,
        Some("gauss-seidel") => Algorithm::GaussSeidel,
        Some("iterative") => Algorithm::Iterative,
        _ => Algorithm::Jacobi,
    });
    if let Some(file) = arguments.get(4) {
        let mut master = Master::new(check(&system)?)?;
        let mut results = Results::create(file.as_ref())?;
        let begin = Instant::now();
        master.run(&mut results)?;
        results.finish()?;
        println!("{:.3}", begin.elapsed().as_secs_f64() / steps as f64 * 1e9);
        return Ok(());
    }
    let chunk = (steps / 50).max(1);
    let name = format!("{}.x1", system.components[0].name);
    system.record =
        vec![RecordedVariable { name, every: u32::try_from(chunk)?, ..RecordedVariable::default() }];
    let fmus = system.components.len() as f64;
    let mut clock = Clock { chunk, last: None, best: f64::INFINITY };
    Master::new(check(&system)?)?.run(&mut clock)?;
    println!("{:.3}", clock.best / fmus * 1e9);
    Ok(())
}
