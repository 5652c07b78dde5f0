//! Hands every case to a diagnosis, and goes on where it was left.

use std::fs;
use std::path::Path;
use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::error::TrialError;
use crate::files;

/// What a diagnosis took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TimeTaken {
    /// Wall time, s.
    pub seconds: f64,
    /// Processor time, s; unknown of results of older programs.
    #[serde(default)]
    pub processor_seconds: Option<f64>,
}

/// Why there is no diagnosis.
#[derive(Clone, Debug, PartialEq)]
pub enum CaseFailure {
    /// The result instead.
    Said(String),
    /// It was stopped after so many seconds of processor time: a miss, tried again only with more.
    Stopped(f64),
}

/// How a case came out.
#[derive(Clone, Debug, PartialEq)]
pub enum CaseEnd {
    /// Diagnosed now.
    Done(TimeTaken),
    /// It was there already.
    Kept,
    /// No diagnosis.
    Failed(CaseFailure),
}

/// Which cases, and where their results go.
#[derive(Clone, Copy, Debug)]
pub struct JudgedRun<'a> {
    /// Folder with `cases`.
    pub trials: &'a Path,
    /// Folder for results.
    pub results: &'a Path,
    /// (i, n): every n-th case, from the i-th (1-based) on.
    pub shard: (usize, usize),
    /// Processor time after which a case is stopped, s.
    pub limit: Option<f64>,
}

/// A case that was stopped: `<name>.stopped`.
#[derive(Serialize, Deserialize)]
struct StoppedCase {
    processor_seconds: f64,
}

/// After how many seconds of processor time a case was stopped, if it was.
pub(crate) fn stopped(results: &Path, name: &str) -> Option<f64> {
    let text = fs::read_to_string(results.join(format!("{name}.stopped"))).ok()?;
    toml::from_str::<StoppedCase>(&text).ok().map(|s| s.processor_seconds)
}

/// Diagnoses the cases that have no result yet: `diagnose` gets the case's folder and an empty folder for what it writes,
/// which takes its final name when it is whole. `said` hears of each.
///
/// # Errors
/// A file that cannot be written. A diagnosis that fails is kept as `<name>.error`, and tried again next time.
pub fn run(
    run: &JudgedRun<'_>,
    mut diagnose: impl FnMut(&Path, &Path) -> Result<TimeTaken, CaseFailure>,
    mut said: impl FnMut(&str, &CaseEnd),
) -> Result<(), TrialError> {
    let JudgedRun { trials, results, shard, limit } = *run;
    files::folder(results)?;
    for (i, name) in files::cases(trials)?.iter().enumerate() {
        if i % shard.1 != shard.0 - 1 {
            continue;
        }
        let last = results.join(name);
        let spent = stopped(results, name).is_some_and(|at| limit.is_some_and(|limit| limit <= at));
        if last.join("diagnosis.json").is_file() || spent {
            said(name, &CaseEnd::Kept);
            continue;
        }
        let part = files::fresh(results, name)?;
        let begun = Instant::now();
        let told = diagnose(&trials.join("cases").join(name), &part).and_then(|took| {
            let there = part.join("diagnosis.json").is_file();
            if there { Ok(took) } else { Err(CaseFailure::Said("it wrote no diagnosis.json".into())) }
        });
        let notes = ["error", "stopped"].map(|ending| results.join(format!("{name}.{ending}")));
        for note in notes.iter().filter(|n| n.exists()) {
            fs::remove_file(note).map_err(|e| TrialError::at(note, e))?;
        }
        let ran = match told {
            Ok(mut took) => {
                took.seconds = begun.elapsed().as_secs_f64();
                let path = part.join("trial.toml");
                files::whole(&path, &toml::to_string(&took).map_err(|e| TrialError::at(&path, e))?)?;
                files::settle(&part, &last)?;
                CaseEnd::Done(took)
            }
            Err(failure) => {
                fs::remove_dir_all(&part).map_err(|e| TrialError::at(&part, e))?;
                match &failure {
                    CaseFailure::Said(why) => files::whole(&notes[0], why)?,
                    CaseFailure::Stopped(at) => {
                        let stopped = StoppedCase { processor_seconds: *at };
                        files::whole(
                            &notes[1],
                            &toml::to_string(&stopped).map_err(|e| TrialError::at(&notes[1], e))?,
                        )?;
                    }
                }
                CaseEnd::Failed(failure)
            }
        };
        said(name, &ran);
    }
    Ok(())
}
