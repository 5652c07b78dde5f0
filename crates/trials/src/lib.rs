//! Blind trials: recordings whose cause is sealed, and the scorecard of a diagnosis that has not seen it.
//!
//! The generator shares neither code nor formulas with the effect library: plants written from the papers, an
//! integrator and laws of its own. A diagnosis sees `cases/`; only [`score`](fn@score) opens `keys/`.

mod arm;
mod bench;
mod cache;
mod case;
mod draw;
mod error;
mod files;
mod held_arm;
mod joint;
mod judge;
mod lab;
mod motion;
mod sense;
mod slip;
mod tune;

use std::path::Path;

pub use bench::card::{ScoredEntry, bench_markdown, write_bench_card};
pub use bench::entry::write_entry;
pub use bench::make::{BenchOrder, make_bench};
pub use bench::scores::{CaseScore, score_entry};
pub use bench::submission::BenchEntry;
pub use bench::{BENCH_FORMAT, BenchNotice, BenchTier};
pub use cache::GENERATOR;
pub use case::{Moved, TrialPlant, TrialSplit, TruthKey};
pub use error::TrialError;
pub use judge::card::{markdown, write_card};
pub use judge::compare::{PairedComparison, PairedCounts, compare};
pub use judge::corpus::{CorpusEntry, fill as fill_corpus, read as read_corpus, write as write_corpus};
pub use judge::run::{CaseEnd, CaseFailure, JudgedRun, TimeTaken, run};
pub use judge::score::{Card, ScoreTarget, ScorecardLine, Share, score};
pub use judge::table::{Answers, CaseRow};
pub use lab::{LabLimits, LabNotice, LabRound, new_lab, run_lab};

use cache::CaseCache;
use case::TrialCase;

/// What to generate.
#[derive(Clone, Copy, Debug)]
pub struct TrialOrder {
    /// The plant.
    pub plant: TrialPlant,
    /// What the cases are about.
    pub split: TrialSplit,
    /// How many in all shards together.
    pub count: usize,
    /// Where all draws begin.
    pub seed: u64,
    /// (i, n): every n-th case, from the i-th (1-based) on.
    pub shard: (usize, usize),
}

/// Where cases go.
#[derive(Clone, Copy, Debug)]
pub struct Folders<'a> {
    /// For cases, keys and seals.
    pub directory: &'a Path,
    /// Keeps cases for the next time.
    pub cache: Option<&'a Path>,
}

/// Generates cases; one that is there already stays. `said` hears the name of each.
///
/// # Errors
/// A file that cannot be written; a case that no draw makes visible.
pub fn generate(
    to: Folders<'_>,
    order: &TrialOrder,
    mut said: impl FnMut(usize, &str),
) -> Result<(), TrialError> {
    let (i, n) = order.shard;
    for index in (0..order.count).filter(|k| k % n == i - 1) {
        let name = to.make(order.plant, order.split, order.seed, index)?;
        said(index, &name);
    }
    files::seal(to.directory)
}

/// Writes the noise-free runs of cases: true inputs, angles and rates as `DIRECTORY/<case>/<recording>.csv`.
///
/// # Errors
/// A plant that gives none (only [`TrialPlant::HeldArm`] does); a file that cannot be written; a case that no draw makes
/// visible.
pub fn generate_truth(directory: &Path, order: &TrialOrder) -> Result<(), TrialError> {
    let (i, n) = order.shard;
    for index in (0..order.count).filter(|k| k % n == i - 1) {
        let case = make(order.plant, order.split, order.seed, index)?;
        if case.truth.is_empty() {
            return Err(TrialError::Silent { plant: order.plant.name() });
        }
        let name = files::name_of(order.plant, order.split, order.seed, index);
        files::write_recordings(&directory.join(name), &case.truth)?;
    }
    Ok(())
}

fn make(plant: TrialPlant, split: TrialSplit, seed: u64, index: usize) -> Result<TrialCase, TrialError> {
    match plant {
        TrialPlant::Joint => joint::generate(split, seed, index),
        TrialPlant::Manipulator => arm::generate(split, seed, index),
        TrialPlant::HeldArm => held_arm::generate(split, seed, index),
    }
}

/// Generates the cases of a corpus, as [`generate`] does; `shard`: (i, n), every n-th case from the i-th (1-based) on.
///
/// # Errors
/// As [`generate`]; a case that this generator makes otherwise than when it entered the corpus.
pub fn generate_corpus(
    to: Folders<'_>,
    file: &Path,
    shard: (usize, usize),
    mut said: impl FnMut(usize, &str),
) -> Result<(), TrialError> {
    let all = read_corpus(file)?;
    let (i, n) = shard;
    files::folder(to.directory)?;
    judge::corpus::mark(to.directory, file)?;
    for (at, entry) in all.iter().enumerate().filter(|(k, _)| k % n == i - 1) {
        let name = to.make(entry.plant, entry.split, entry.seed, entry.index)?;
        let key = to.directory.join("keys").join(format!("{name}.toml"));
        let text = std::fs::read(&key).map_err(|e| TrialError::at(&key, e))?;
        if name != entry.case || files::hash(&text) != entry.seal {
            let why = format!(
                "{} is not the case that entered: the generator makes another one of seed {}, number {}; \
                 fill a corpus again from results of this program",
                entry.case, entry.seed, entry.index
            );
            return Err(TrialError::at(file, why));
        }
        said(at, &name);
    }
    files::seal(to.directory)
}

impl Folders<'_> {
    /// Makes a case, or takes one that was made before; gives its name.
    fn make(
        self,
        plant: TrialPlant,
        split: TrialSplit,
        seed: u64,
        index: usize,
    ) -> Result<String, TrialError> {
        let name = files::name_of(plant, split, seed, index);
        if self.directory.join("cases").join(&name).is_dir() {
            return Ok(name);
        }
        let cache = self.cache.map(CaseCache);
        if let Some(cache) = cache
            && cache.take(self.directory, &name)?
        {
            return Ok(name);
        }
        files::write(self.directory, make(plant, split, seed, index)?)?;
        cache.map_or(Ok(()), |cache| cache.keep(self.directory, &name))?;
        Ok(name)
    }
}
