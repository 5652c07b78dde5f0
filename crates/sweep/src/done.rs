//! All runs of a sweep from its logs, however they were shared out or interrupted.

use crate::error::SweepError;
use crate::log::{LogDamage, RunRecord, read};
use crate::runner::{Runner, logs};

/// Runs that are named where some are missing.
const NAMED: usize = 5;

/// All runs of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedSweep {
    /// In their order.
    pub records: Vec<RunRecord>,
    /// Lines of logs that were left out because they are damaged.
    pub damage: Vec<LogDamage>,
}

/// Reads all logs of a sweep.
///
/// # Errors
/// [`SweepError::File`]: a run is in no log, two logs differ about one, a log cannot be read.
pub fn done(runner: &Runner) -> Result<FinishedSweep, SweepError> {
    let folder = runner.sweep().folder();
    let mend = format!("`trueup sweep {}` goes on with them", runner.sweep().file.display());
    if !folder.is_dir() {
        return Err(SweepError::at(&folder, format!("no run is done yet; {mend}")));
    }
    let runs = runner.design().runs();
    let mut records: Vec<Option<RunRecord>> = vec![None; runs as usize];
    let mut damage = Vec::new();
    for log in logs(&folder)? {
        let found = read(&log, runner.print())?;
        damage.extend(found.damage);
        for record in found.records {
            let run = record.run;
            let slot = usize::try_from(run).ok().and_then(|run| records.get_mut(run.checked_sub(1)?));
            let Some(slot) = slot else { return Err(SweepError::at(&log, SweepError::NoRun { run, runs })) };
            match slot {
                // Two shares that overlap in time may both have done it.
                Some(before) if *before != record => {
                    let why = format!("run {run} gave something else in another log of the folder");
                    return Err(SweepError::at(&log, format!("{why}; an FMU does not repeat itself")));
                }
                _ => *slot = Some(record),
            }
        }
    }
    let missing = records.iter().filter(|r| r.is_none()).count();
    if missing > 0 {
        let first = records.iter().enumerate().filter(|(_, r)| r.is_none()).take(NAMED);
        let first: Vec<String> = first.map(|(at, _)| (at + 1).to_string()).collect();
        let more = if missing > NAMED { ", ..." } else { "" };
        let which = format!("{missing} of {runs} runs are not done ({}{more})", first.join(", "));
        return Err(SweepError::at(&folder, format!("{which}; {mend}")));
    }
    Ok(FinishedSweep { records: records.into_iter().flatten().collect(), damage })
}
