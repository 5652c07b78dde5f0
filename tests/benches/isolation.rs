//! What it costs to give an FMU a process of its own: the same runs with and without, one after the other, several times.
//!
//!     cargo bench -p trueup-acceptance --bench isolation
//!
//! Prints the least and the median of each in microseconds, and their ratio; *round trip*: one call that waits for the other
//! process, *step*: a communication step with all its calls and a recorded row.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use trueup_cosim::system::CosimSystem;
use trueup_cosim::{Master, SeriesMemory, check};
use trueup_fmi_import::{
    ExperimentSetup, InstanceOptions, Isolation, UnpackedFmu, UsedInterface, fmi2, isolation,
};
use trueup_testkit::{BlockFmu, BlockVersion, problems};

const HOST: &str = "host-of-an-fmu";
const ROUNDS: usize = 7;
const CALLS: usize = 100_000;

fn main() {
    if std::env::args().any(|argument| argument == HOST) {
        isolation::serve().unwrap();
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    println!(
        "| work | within: least | median | isolated: least | median | ratio of least | of median |\n|---|---|---|---|---|---|---|"
    );
    for version in BlockVersion::ALL {
        let problem = problems::two_mass().map(BlockFmu::plain);
        let files: Vec<_> = problem.blocks.iter().map(|b| b.build(version, folder.path()).unwrap()).collect();
        let name = if version == BlockVersion::Two { "FMI 2.0" } else { "FMI 3.0" };
        let one = |file: &Path| format!("[components.it]\nfmu = '{}'\n", file.display());
        row(&format!("{name}, one plain FMU: step"), |isolated| {
            run(folder.path(), &one(&files[1]), isolated)
        });
        let links: Vec<_> = problem.connections.iter().map(|(a, b)| format!("'{a} -> {b}'")).collect();
        let mut both = format!("connections = [{}]\n", links.join(", "));
        for (block, file) in problem.blocks.iter().zip(&files) {
            both.push_str(&format!("[components.{}]\nfmu = '{}'\n", block.name, file.display()));
        }
        row(&format!("{name}, two coupled FMUs: step"), |isolated| run(folder.path(), &both, isolated));
        if version == BlockVersion::Two {
            row("FMI 2.0: round trip", |isolated| round_trips(&files[1], isolated));
        }
    }
}

fn isolate(fmu: &UnpackedFmu) {
    fmu.isolate(&Isolation::new([HOST], None).unwrap());
}

/// Seconds of a run over `CALLS` steps.
fn run(folder: &Path, components: &str, isolated: bool) -> f64 {
    let file = folder.join("s.toml");
    // Connections are before the first table.
    let at = components.find("[components").unwrap();
    let (links, rest) = components.split_at(at);
    let stop = 1e-3 * CALLS as f64;
    std::fs::write(
        &file,
        format!("{links}[run]\nstop = {stop:?}\nstep = 0.001\nalgorithm = 'jacobi'\n{rest}"),
    )
    .unwrap();
    let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
    if isolated {
        plan.components.iter().for_each(|component| isolate(&component.fmu));
    }
    let mut master = Master::new(plan).unwrap();
    let mut rows = SeriesMemory::default();
    let begun = Instant::now();
    master.run(&mut rows).unwrap();
    let spent = begun.elapsed().as_secs_f64();
    assert_eq!(rows.time().len(), CALLS + 1);
    spent
}

/// Seconds of `CALLS` calls.
fn round_trips(file: &Path, isolated: bool) -> f64 {
    let fmu: Arc<UnpackedFmu> = UnpackedFmu::open(file).unwrap();
    if isolated {
        isolate(&fmu);
    }
    let mut it =
        fmi2::Fmi2Instance::new(&fmu, UsedInterface::CoSimulation, InstanceOptions::default()).unwrap();
    it.enter_initialization_mode(ExperimentSetup::default()).unwrap();
    it.exit_initialization_mode().unwrap();
    let mut value = [0.0];
    let begun = Instant::now();
    for _ in 0..CALLS {
        it.get_real(&[0], &mut value).unwrap();
    }
    begun.elapsed().as_secs_f64()
}

fn row(what: &str, seconds: impl Fn(bool) -> f64) {
    let mut all = [Vec::new(), Vec::new()];
    for _ in 0..ROUNDS {
        for (isolated, list) in all.iter_mut().enumerate() {
            list.push(1e6 * seconds(isolated == 1) / CALLS as f64);
        }
    }
    let [within, isolated] = all.map(|mut list| {
        list.sort_by(f64::total_cmp);
        (list[0], list[ROUNDS / 2])
    });
    println!(
        "| {what} | {:.3} | {:.3} | {:.3} | {:.3} | {:.1} | {:.1} |",
        within.0,
        within.1,
        isolated.0,
        isolated.1,
        isolated.0 / within.0,
        isolated.1 / within.1
    );
}
