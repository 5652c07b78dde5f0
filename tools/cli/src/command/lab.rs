//! `trueup lab`: a sealed rig that runs what is proposed.

use std::path::{Path, PathBuf};

use serde::Deserialize;
use trueup_trials::{TrialSplit, new_lab, run_lab};

use crate::args::{LabCommand, LabNew, LabRun};
use crate::error::CliError;
use crate::output::{folder, say};

/// Where a proposal comes from.
const PROPOSED: &str = "`trueup diagnose` writes next-experiment.csv; a proposal.toml names it as `input`";

fn failed(e: impl std::fmt::Display) -> CliError {
    CliError::Failed(e.to_string())
}

pub(crate) fn run(command: &LabCommand) -> Result<(), CliError> {
    match command {
        LabCommand::New(a) => new(a),
        LabCommand::Run(a) => experiment(a),
    }
}

fn new(a: &LabNew) -> Result<(), CliError> {
    folder(&a.output)?;
    let made = new_lab(&a.output, a.split.as_deref().and_then(TrialSplit::parse), a.seed).map_err(failed)?;
    let limits = made.limits;
    say(&format!(
        "{}: diagnose it with `trueup diagnose`\n\
         experiments: at most {} s, {} A either way, load between {} and {} rad (limits.toml)\nseal of its key: {}\n",
        a.output.join("case").display(),
        limits.seconds,
        limits.motor_current,
        limits.load_angle[0],
        limits.load_angle[1],
        made.seal
    ))
}

/// A proposal's file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Proposal {
    rig: Option<PathBuf>,
    input: PathBuf,
}

fn experiment(a: &LabRun) -> Result<(), CliError> {
    let mut proposal = Proposal { rig: None, input: a.proposal.clone() };
    if a.proposal.extension().is_some_and(|e| e == "toml") {
        let text = crate::input::text(&a.proposal, PROPOSED)?;
        proposal = toml::from_str(&text).map_err(|e| CliError::at(&a.proposal, e))?;
        let beside = a.proposal.parent().unwrap_or(Path::new(""));
        proposal.input = beside.join(&proposal.input);
        proposal.rig = proposal.rig.map(|rig| beside.join(rig));
    }
    let rig = a.rig.clone().or(proposal.rig).ok_or_else(|| {
        CliError::at(
            &a.proposal,
            "it names no rig; write `rig = \"DIR\"` in a proposal.toml, or give --rig DIR",
        )
    })?;
    let round = run_lab(&rig, &proposal.input).map_err(failed)?;
    let end =
        if round.tripped { ", where the load left its range and the drive was switched off" } else { "" };
    say(&format!(
        "{}: round {}, {:.2} s{end}\n",
        rig.join("case").join(&round.file).display(),
        round.number,
        round.seconds
    ))
}
