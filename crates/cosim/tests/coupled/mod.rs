//! Coupled FMUs with known solutions, run by every algorithm; and coupled FMUs that fail. The FMUs are compiled here from
//! C (trueup-testkit).
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stderr)]
#![cfg(target_os = "linux")]

mod accuracy;
mod adaptive;
mod faults;
mod jumps;

use std::fmt::Write as _;

use tempfile::TempDir;
use trueup_cosim::system::CosimSystem;
use trueup_cosim::{CosimError, Master, RunLog, SeriesMemory, check};
use trueup_testkit::{BlockVersion, ShotProblem};

/// FMUs of a problem in a folder.
pub(crate) struct Bench {
    folder: TempDir,
    problem: ShotProblem,
    versions: Vec<BlockVersion>,
}

/// What a run gave.
pub(crate) struct Run {
    pub(crate) results: SeriesMemory,
    pub(crate) log: RunLog,
    pub(crate) outcome: Result<(), CosimError>,
}

impl Bench {
    /// All FMUs of one version of FMI; `None`, with a message, without a C compiler.
    pub(crate) fn new(problem: ShotProblem, version: BlockVersion) -> Option<Self> {
        let versions = vec![version; problem.blocks.len()];
        Self::mixed(problem, versions)
    }

    pub(crate) fn mixed(problem: ShotProblem, versions: Vec<BlockVersion>) -> Option<Self> {
        if !trueup_testkit::compiler() {
            eprintln!("SKIPPED: no C compiler (cc)");
            return None;
        }
        let folder = tempfile::tempdir().unwrap();
        for (block, version) in problem.blocks.iter().zip(&versions) {
            block.build(*version, folder.path()).unwrap();
        }
        Some(Self { folder, problem, versions })
    }

    pub(crate) fn problem(&self) -> &ShotProblem {
        &self.problem
    }

    /// The system as TOML; `run` are lines of `[run]`, `start` of `[components.<name>.start]`.
    fn toml(&self, run: &str, start: &[(&str, &str)]) -> String {
        let mut text = String::from("connections = [\n");
        for (from, to) in &self.problem.connections {
            let _ = writeln!(text, "  \"{from} -> {to}\",");
        }
        let _ = writeln!(text, "]\n[run]\n{run}");
        for (block, version) in self.problem.blocks.iter().zip(&self.versions) {
            let name = &block.name;
            let _ = writeln!(text, "[components.{name}]\nfmu = \"{name}.{}.fmu\"", version.tag());
            for (_, line) in start.iter().filter(|(n, _)| n == name) {
                let _ = writeln!(text, "start = {{ {line} }}");
            }
        }
        text
    }

    pub(crate) fn run(&self, run: &str) -> Run {
        self.run_from(run, &[])
    }

    pub(crate) fn run_from(&self, run: &str, start: &[(&str, &str)]) -> Run {
        let file = self.folder.path().join("system.toml");
        std::fs::write(&file, self.toml(run, start)).unwrap();
        let plan = check(&CosimSystem::read(&file).unwrap()).unwrap();
        let mut results = SeriesMemory::default();
        let mut master = Master::new(plan).unwrap();
        let outcome = master.run(&mut results).map(drop);
        Run { results, log: master.log().clone(), outcome }
    }

    /// A run that must end well.
    pub(crate) fn well(&self, run: &str) -> Run {
        let run = self.run(run);
        if let Err(e) = &run.outcome {
            panic!("{e}");
        }
        run
    }
}

impl Run {
    /// Last value of a column.
    pub(crate) fn last(&self, name: &str) -> f64 {
        *self.column(name).last().unwrap()
    }

    pub(crate) fn column(&self, name: &str) -> &[f64] {
        self.results.column(name).unwrap_or_else(|| panic!("no column {name}"))
    }

    /// Largest error at the end of these columns.
    pub(crate) fn error(&self, expected: &[(&str, f64)]) -> f64 {
        expected.iter().map(|(name, x)| (self.last(name) - x).abs()).fold(0.0, f64::max)
    }
}
