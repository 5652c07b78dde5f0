//! `trueup trial`: blind trials.

use std::path::Path;
use std::process::{Command, Stdio};

use trueup_trials::{Order, Plant, Ran, Split, write_card};

use crate::args::{TrialGenerate, TrialRun, TrialScore};
use crate::error::Error;
use crate::output::folder;

fn failed(e: impl std::fmt::Display) -> Error {
    Error::Failed(e.to_string())
}

pub(crate) fn generate(a: &TrialGenerate) -> Result<(), Error> {
    let (Some(plant), Some(split)) = (Plant::parse(&a.plant), Split::parse(&a.split)) else {
        return Err(Error::Usage("--plant and --split: see `trueup trial generate --help`".into()));
    };
    folder(&a.output)?;
    let order = Order { plant, split, count: a.count, seed: a.seed, shard: a.shard };
    trueup_trials::generate(&a.output, &order, |i, name| eprintln!("{}/{} {name}", i + 1, a.count))
        .map_err(failed)
}

/// Every diagnosis is a process of its own: it sees the case's folder and nothing else of the trial.
fn diagnose(program: &Path, case: &Path, out: &Path) -> Result<(), String> {
    let done = Command::new(program)
        .arg("diagnose")
        .arg(case)
        .arg("-o")
        .arg(out)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .output()
        .map_err(|e| format!("{}: {e}", program.display()))?;
    if done.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&done.stderr);
    Err(said.lines().last().unwrap_or("it ended without a word").to_owned())
}

pub(crate) fn run(a: &TrialRun) -> Result<(), Error> {
    let program = std::env::current_exe().map_err(failed)?;
    let mut failures = 0;
    let each = |name: &str, ran: &Ran| match ran {
        Ran::Done(seconds) => eprintln!("{name}: {seconds:.1} s"),
        Ran::Kept => {}
        Ran::Failed(why) => {
            failures += 1;
            eprintln!("{name}: {why}");
        }
    };
    trueup_trials::run(&a.directory, a.shard, |case, out| diagnose(&program, case, out), each)
        .map_err(failed)?;
    if failures > 0 {
        return Err(Error::Failed(format!(
            "{failures} diagnoses failed (results/*.error says why); run it again to try them again"
        )));
    }
    Ok(())
}

pub(crate) fn score(a: &TrialScore) -> Result<(), Error> {
    let cards = trueup_trials::score(&a.directory).map_err(failed)?;
    if cards.is_empty() {
        let why = "no case has a result yet; run `trueup trial run` first";
        return Err(Error::at(&a.directory, why));
    }
    write_card(&a.output, &cards, a.commit.as_deref()).map_err(failed)
}
