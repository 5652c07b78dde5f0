//! `trueup bench`: the sealed benchmark.

use std::path::Path;

use serde::Serialize;
use trueup_trials::{
    BENCH_FORMAT, BenchEntry, BenchNotice, BenchOrder, BenchTier, JudgedRun, ScoredEntry, make_bench,
    score_entry, write_bench_card, write_entry,
};

use super::trial;
use crate::args::{BenchCommand, BenchMake, BenchRun, BenchScore, BenchSubmit};
use crate::error::CliError;
use crate::output::{folder, folder_of, say, write};
use crate::voice;

fn failed(e: impl std::fmt::Display) -> CliError {
    CliError::Failed(e.to_string())
}

pub(crate) fn run(command: &BenchCommand) -> Result<(), CliError> {
    match command {
        BenchCommand::Make(a) => make(a),
        BenchCommand::Run(a) => enter(a),
        BenchCommand::Submit(a) => submit(a),
        BenchCommand::Score(a) => score(a),
    }
}

fn make(a: &BenchMake) -> Result<(), CliError> {
    folder(&a.output)?;
    a.cache.iter().try_for_each(|cache| folder_of("--cache", cache))?;
    let tiers: Vec<BenchTier> =
        BenchTier::ALL.into_iter().filter(|t| a.tier.iter().any(|name| name == t.name())).collect();
    let cases = a.count as usize;
    let all = cases * tiers.len();
    let order = BenchOrder { tiers, cases, seed: a.seed };
    let made = make_bench(&a.output, a.cache.as_deref(), &order, |k, name| {
        voice::line(&format!("{k}/{all} {name}"));
    });
    let notice = made.map_err(failed)?;
    say(&format!(
        "{}: for entrants, {all} cases\n{}: keys and whole recordings, to be published when the entries are in\n\
         publish now: seals {}\n",
        a.output.join("public").display(),
        a.output.join("sealed").display(),
        notice.seals
    ))
}

fn enter(a: &BenchRun) -> Result<(), CliError> {
    BenchNotice::read(&a.public).map_err(failed)?;
    let results = a.results.clone().unwrap_or_else(|| a.output.with_extension("results"));
    let run = JudgedRun { trials: &a.public, results: &results, shard: a.shard, limit: Some(a.limit) };
    let failures = trial::diagnose(&run, a.program.as_deref(), true)?;
    if failures > 0 {
        voice::line(&format!(
            "{failures} diagnoses failed: they are answered `unknown` (*.error gives the reasons)"
        ));
    }
    if a.shard.1 > 1 {
        voice::line("the entry is written by a run without --shard, when all shares are done");
        return Ok(());
    }
    let entry = write_entry(&a.public, &results, &a.output).map_err(failed)?;
    say(&format!("{}: {}\n", a.output.display(), counted(&entry)))
}

fn counted(entry: &BenchEntry) -> String {
    let parts: Vec<String> = entry.counts().iter().map(|(what, n)| format!("{n} with {what}")).collect();
    format!("cases: {}", parts.join(", "))
}

fn submit(a: &BenchSubmit) -> Result<(), CliError> {
    /// That an entry was complete before the keys were out.
    #[derive(Serialize)]
    struct Receipt<'a> {
        format: &'a str,
        seals: &'a str,
        entry: &'a str,
        sha256: &'a str,
    }
    let notice = BenchNotice::read(&a.public).map_err(failed)?;
    let entry = BenchEntry::read(&a.public, &a.entry).map_err(failed)?;
    let name = stem(&a.entry);
    let receipt = Receipt { format: BENCH_FORMAT, seals: &notice.seals, entry: &name, sha256: &entry.hash };
    write(&a.output, toml::to_string(&receipt).map_err(failed)?.as_bytes())?;
    say(&format!("{}\nsha256 {}\n{}\n", counted(&entry), entry.hash, a.output.display()))
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

fn score(a: &BenchScore) -> Result<(), CliError> {
    let mut entries = Vec::new();
    for file in &a.entries {
        let cases = score_entry(&a.directory, file).map_err(failed)?;
        entries.push(ScoredEntry { name: stem(file), cases });
    }
    write_bench_card(&a.output, &entries).map_err(failed)?;
    say(&format!("{}\n{}\n", a.output.display(), a.output.with_extension("csv").display()))
}
