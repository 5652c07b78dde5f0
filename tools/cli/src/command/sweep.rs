//! `trueup sweep`

mod common;
mod map;

use std::path::Path;
use std::time::Instant;

use trueup_cosim::{Master, Results, check};
use trueup_sweep::{Runner, Shard, merge, script};

use crate::args::{Merge, SweepCommand, SweepFollowUp};
use crate::error::CliError;
use crate::output::{say, write};
use crate::stages::Stages;
use crate::voice;
use common::{TELL, beside, damaged, failed};

/// Tasks of an array that clusters allow where it was not changed.
const TASKS: u64 = 1000;
pub(crate) fn run(args: &SweepCommand) -> Result<(), CliError> {
    match &args.after {
        Some(SweepFollowUp::Merge(args)) => return merged(args),
        Some(SweepFollowUp::Map(args)) => return map::map(args),
        None => {}
    }
    let Some(file) = &args.file else { return Err(CliError::Usage("name the sweep's file".into())) };
    let own_processes = args.isolate || args.deadline.is_some();
    let mut runner = Runner::open_with(file, own_processes).map_err(failed)?;
    runner.plan().notes.iter().for_each(|note| voice::note(note));
    if let Some(tasks) = args.slurm {
        return slurm(file, tasks.map_or(TASKS, u64::from).min(runner.design().runs()));
    }
    crate::isolate::components(&runner.plan().components, args.isolate, args.deadline)?;
    match args.run {
        Some(run) => one(args, &mut runner, run),
        None => share(args, &mut runner),
    }
}

fn share(args: &SweepCommand, runner: &mut Runner) -> Result<(), CliError> {
    let (index, of) = args.shard.unwrap_or((1, 1));
    let (index, of) = (index as u64, of as u64);
    let mut stages: Option<Stages> = None;
    let mut told = Instant::now();
    let tally = runner.shard(Shard { index, of }, |step| {
        if told.elapsed() >= TELL {
            told = Instant::now();
            let what = format!("{} of {} runs", step.done, step.of);
            stages.get_or_insert_with(Stages::new).tell(step.done as f64 / step.of as f64, &what);
        }
    });
    drop(stages);
    let tally = tally.map_err(failed)?;
    damaged(&tally.damage, "what was in it is run again");
    let (file, folder) = (runner.sweep().file.display(), runner.sweep().folder());
    let before = if tally.kept > 0 { format!(", {} were done before", tally.kept) } else { String::new() };
    let failures = match tally.failed {
        0 => String::new(),
        n => format!("; {n} of them failed, the table gives the reasons"),
    };
    let (all, folder) = (tally.ran + tally.kept, folder.display());
    say(&format!(
        "{folder}: {all} runs{before}{failures}\n`trueup sweep merge {file}` makes one table of them\n"
    ))
}

fn slurm(file: &Path, tasks: u64) -> Result<(), CliError> {
    let to = file.with_extension("slurm.sh");
    write(&to, script(file, tasks).as_bytes())?;
    say(&format!("{}: {tasks} tasks; hand it in with sbatch from its folder\n", to.display()))
}

/// One run once more, with all that the system records.
fn one(args: &SweepCommand, runner: &mut Runner, run: u64) -> Result<(), CliError> {
    let system = runner.system(run).map_err(failed)?;
    let file = &runner.sweep().file;
    let to = args.output.clone().unwrap_or_else(|| beside(file, &format!("-run-{run}.csv")));
    let record = runner.run(run);
    let mut lines = String::new();
    for (at, factor) in runner.sweep().factors.iter().enumerate() {
        lines += &format!("{} = {}\n", factor.name, runner.design().value(at, run).text());
    }
    let values = record.result.as_ref().map(Vec::as_slice).unwrap_or_default();
    for (output, value) in runner.sweep().outputs.iter().zip(values) {
        lines += &format!("{} = {}\n", output.name, value.map_or("none".into(), |x| format!("{x:?}")));
    }
    say(&lines)?;
    let failed = |e: trueup_cosim::CosimError| CliError::Failed(e.to_string());
    let plan = check(&system).map_err(failed)?;
    crate::isolate::components(&plan.components, args.isolate, args.deadline)?;
    let mut results = Results::create(&to).map_err(failed)?;
    let mut master = match Master::new(plan) {
        Ok(master) => master,
        Err(e) => {
            results.give_back().map_err(failed)?;
            return Err(CliError::Failed(e.to_string()));
        }
    };
    match master.run(&mut results) {
        Ok(_) => {
            let rows = results.rows();
            results.finish().map_err(failed)?;
            voice::line(&format!("{}: {rows} rows", to.display()));
            Ok(())
        }
        Err(e) => {
            let kept = match results.keep_partial().map_err(failed)? {
                None => "nothing was computed before".to_owned(),
                Some(file) => format!("what was computed before is kept in {}", file.display()),
            };
            Err(CliError::Failed(format!("run {run}: {e}\n{kept}")))
        }
    }
}

fn merged(args: &Merge) -> Result<(), CliError> {
    let to = args.output.clone().unwrap_or_else(|| beside(&args.file, ".parquet"));
    if to.extension().is_none_or(|e| !e.eq_ignore_ascii_case("parquet")) {
        let name = to.display();
        return Err(CliError::Usage(format!(
            "the table is written as Parquet; let --output {name} end with .parquet"
        )));
    }
    let runner = Runner::open(&args.file).map_err(failed)?;
    let merged = merge(&runner, &to).map_err(failed)?;
    damaged(&merged.damage, "its run is there from another line");
    let failures = match merged.failed {
        0 => String::new(),
        n => format!(", {n} of them failed (column `reason`)"),
    };
    say(&format!("{}: {} runs{failures}\n", to.display(), merged.runs))
}
