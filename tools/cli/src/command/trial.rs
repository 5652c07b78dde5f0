//! `trueup trial`: blind trials.

mod child;

use std::path::Path;

use trueup_trials::{
    Answers, CaseEnd, CaseFailure, CaseRow, Folders, JudgedRun, TrialOrder, TrialPlant, TrialSplit,
    write_card,
};

use crate::args::{TrialCompare, TrialCorpus, TrialGenerate, TrialRun, TrialScore};
use crate::error::CliError;
use crate::output::{folder, folder_of, say};
use crate::voice;

fn failed(e: impl std::fmt::Display) -> CliError {
    CliError::Failed(e.to_string())
}

pub(crate) fn generate(a: &TrialGenerate) -> Result<(), CliError> {
    if let Some(file) = a.corpus.as_ref().filter(|file| !file.is_file()) {
        return Err(CliError::at(file, "there is no such corpus; `trueup trial corpus` writes one"));
    }
    if let Some(file) = &a.corpus
        && trueup_trials::read_corpus(file).map_err(failed)?.is_empty()
    {
        return Err(CliError::at(file, "there is no case in it; `trueup trial corpus` fills it"));
    }
    folder(&a.output)?;
    a.cache.iter().try_for_each(|cache| folder_of("--cache", cache))?;
    let to = Folders { directory: &a.output, cache: a.cache.as_deref() };
    if let Some(file) = &a.corpus {
        return trueup_trials::generate_corpus(to, file, a.shard, |i, name| {
            voice::line(&format!("{} {name}", i + 1))
        })
        .map_err(failed);
    }
    let plant = a.plant.as_deref().and_then(TrialPlant::parse);
    let split = a.split.as_deref().and_then(TrialSplit::parse);
    let (Some(plant), Some(split)) = (plant, split) else {
        return Err(CliError::Usage("--plant and --split: see `trueup trial generate --help`".into()));
    };
    let order = TrialOrder { plant, split, count: a.count, seed: a.seed, shard: a.shard };
    trueup_trials::generate(to, &order, |i, name| voice::line(&format!("{}/{} {name}", i + 1, a.count)))
        .map_err(failed)?;
    a.truth.iter().try_for_each(|into| {
        folder_of("--truth", into)?;
        trueup_trials::generate_truth(into, &order).map_err(failed)
    })
}

pub(crate) fn run(a: &TrialRun) -> Result<(), CliError> {
    let results = a.results.clone().unwrap_or_else(|| a.directory.join("results"));
    let run = JudgedRun { trials: &a.directory, results: &results, shard: a.shard, limit: Some(a.limit) };
    let failures = diagnose(&run, a.program.as_deref(), a.verdict_only)?;
    // Keys are opened once every diagnosis has spoken; a folder of cases alone has none.
    if a.directory.join("keys").is_dir() {
        let answers = Answers { trials: a.directory.clone(), results };
        say(&summary(&answers.tabulate().map_err(failed)?, &answers.results))?;
    }
    if failures > 0 {
        return Err(again(failures));
    }
    Ok(())
}

/// Why a run is not complete.
pub(super) fn again(failures: usize) -> CliError {
    CliError::Failed(format!(
        "{failures} diagnoses failed (*.error next to the results gives the reasons); run it again to try them again"
    ))
}

/// Hands the cases that have no result yet to a program, this one when none is named. Gives how many failed.
pub(super) fn diagnose(
    run: &JudgedRun<'_>,
    program: Option<&Path>,
    verdict_only: bool,
) -> Result<usize, CliError> {
    let program = match program {
        // As a path: a bare name would be looked for in PATH.
        Some(file) => std::path::absolute(file).map_err(failed)?,
        None => std::env::current_exe().map_err(failed)?,
    };
    if !program.is_file() {
        return Err(CliError::at(
            &program,
            "there is no such program; name a build of trueup with --program",
        ));
    }
    if !run.trials.join("cases").is_dir() {
        return Err(CliError::at(run.trials, "it has no folder `cases`; `trueup trial generate` makes one"));
    }
    folder_of("--results", run.results)?;
    let child = child::Child::new(&program, verdict_only, run.limit.unwrap_or(f64::INFINITY))?;
    let mut failures = 0;
    let each = |name: &str, ran: &CaseEnd| match ran {
        CaseEnd::Done(took) => {
            let processor =
                took.processor_seconds.map_or(String::new(), |s| format!(", {s:.1} s of processor time"));
            voice::line(&format!("{name}: {:.1} s{processor}", took.seconds));
        }
        CaseEnd::Kept => {}
        CaseEnd::Failed(CaseFailure::Stopped(at)) => {
            voice::line(&format!("{name}: stopped after {at:.0} s of processor time, a miss (--limit)"));
        }
        CaseEnd::Failed(CaseFailure::Said(why)) => {
            failures += 1;
            voice::line(&format!("{name}: {why}"));
        }
    };
    trueup_trials::run(run, |case, out| child.diagnose(case, out), each).map_err(failed)?;
    Ok(failures)
}

/// Cases, right ones and processor time, plant by plant.
fn summary(rows: &[CaseRow], results: &Path) -> String {
    let mut text = String::new();
    for plant in TrialPlant::ALL {
        let mine: Vec<&CaseRow> = rows.iter().filter(|r| r.plant == plant).collect();
        if mine.is_empty() {
            continue;
        }
        let right = mine.iter().filter(|r| r.right).count();
        let mut seconds: Vec<f64> = mine.iter().filter_map(|r| r.processor_seconds).collect();
        seconds.sort_by(f64::total_cmp);
        let time = seconds.get(seconds.len() / 2).map_or(String::new(), |middle| {
            format!("; processor time {:.0} s, median {middle:.1} s", seconds.iter().sum::<f64>())
        });
        text += &format!("{}: {right} of {} cases right{time}\n", plant.name(), mine.len());
    }
    text + &format!("{}\n", results.join("table.csv").display())
}

pub(crate) fn score(a: &TrialScore) -> Result<(), CliError> {
    let cards = trueup_trials::score(&Answers::find(&a.directory).map_err(failed)?).map_err(failed)?;
    if cards.is_empty() {
        let why = "no case has a result yet; run `trueup trial run` first";
        return Err(CliError::at(&a.directory, why));
    }
    write_card(&a.output, &cards, a.commit.as_deref()).map_err(failed)
}

pub(crate) fn compare(a: &TrialCompare) -> Result<(), CliError> {
    let [a, b] = [&a.a, &a.b].map(|folder| Answers::find(folder).map_err(failed));
    let (a, b) = (a?, b?);
    let found = trueup_trials::compare(&a, &b).map_err(failed)?;
    if found.pairs.is_empty() {
        return Err(CliError::at(
            &b.results,
            format!("it has no case in common with {}", a.results.display()),
        ));
    }
    say(&found.text())
}

pub(crate) fn corpus(a: &TrialCorpus) -> Result<(), CliError> {
    let mut corpus = trueup_trials::read_corpus(&a.file).map_err(failed)?;
    let before = corpus.len();
    let plant = a.plant.as_deref().and_then(TrialPlant::parse);
    for folder in &a.from {
        let mut rows = Answers::find(folder).and_then(|answers| answers.rows()).map_err(failed)?;
        rows.retain(|r| plant.is_none_or(|plant| r.plant == plant));
        trueup_trials::fill_corpus(&mut corpus, &rows, a.right, &a.commit);
    }
    trueup_trials::write_corpus(&a.file, &corpus).map_err(failed)?;
    let mut text = String::new();
    for plant in TrialPlant::ALL {
        let [right, wrong] =
            [true, false].map(|right| corpus.iter().filter(|e| e.plant == plant && e.right == right).count());
        if right + wrong > 0 {
            text += &format!("{}: {right} right, {wrong} wrong when they entered\n", plant.name());
        }
    }
    say(&format!("{text}{} entered\n{}\n", corpus.len() - before, a.file.display()))
}
