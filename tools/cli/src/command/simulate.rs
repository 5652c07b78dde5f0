//! `trueup simulate`

mod settings;
mod summary;

use std::path::PathBuf;

use trueup_cosim::plan::MasterPlan;
use trueup_cosim::{CosimError as RunError, Master, Results, SeriesMemory, check, write_ssp};

use crate::args::Simulate;
use crate::error::CliError;
use crate::output::{can_be_written, say};
use crate::progress::Progress;
use crate::voice;

pub(crate) fn run(args: &Simulate) -> Result<(), CliError> {
    let extension = args.output.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "csv" && extension != "parquet" {
        let name = args.output.display();
        let mend = format!("let --output {name} end with .csv or .parquet");
        return Err(CliError::Usage(format!("results are written as CSV or Parquet; {mend}")));
    }
    let mut system = settings::system(args).map_err(mistakes)?;
    system.own_processes = args.isolate || args.deadline.is_some();
    let plan = check(&system).map_err(mistakes)?;
    plan.notes.iter().for_each(|note| voice::note(note));
    if args.check {
        return say(&summary::of(&plan));
    }
    if let Some(file) = &args.save_ssp {
        write_ssp(&system, &plan, file).map_err(|e| CliError::Failed(e.to_string()))?;
        voice::line(&format!("{}: {} components", file.display(), plan.components.len()));
        return Ok(());
    }
    crate::isolate::components(&plan.components, args.isolate, args.deadline)?;
    simulated(args, plan)
}

/// Wrong usage where the command line is wrong, else a file is.
fn mistakes(e: RunError) -> CliError {
    match &e {
        RunError::System(list) if settings::is_usage(list) => CliError::Usage(e.to_string()),
        _ => CliError::Failed(e.to_string()),
    }
}

fn simulated(args: &Simulate, plan: MasterPlan) -> Result<(), CliError> {
    let failed = |e: RunError| CliError::Failed(e.to_string());
    // Wherever an FMU leads the process meanwhile.
    let whole = |file: &Option<PathBuf>| file.as_ref().and_then(|f| std::path::absolute(f).ok());
    let (log_file, plot_file) = (whole(&args.log), whole(&args.plot));
    [&args.log, &args.plot].into_iter().flatten().try_for_each(|file| can_be_written(file))?;
    let (start, stop, before) = (plan.grid.start, plan.grid.stop, plan.notes.len());
    let mut results = Results::create(&args.output).map_err(failed)?;
    let mut memory = args.plot.is_some().then(SeriesMemory::default);
    let plants = if memory.is_some() { crate::moving::plants(&plan) } else { Vec::new() };
    let master = Master::new(plan).map_err(|e| match e {
        // The FMUs cannot follow the algorithm that the command line requests.
        RunError::Setting(_) if args.algorithm.is_some() => CliError::Usage(format!("--algorithm: {e}")),
        RunError::Setting(_) => CliError::at(&args.file, e),
        _ => failed(e),
    });
    let mut master = match master {
        Ok(master) => master,
        Err(e) => {
            results.give_back().map_err(failed)?;
            return Err(e);
        }
    };
    let progress = Progress::new(start, stop, args.progress);
    let clock = std::time::Instant::now();
    let done = master.run(&mut ((&mut results, &mut memory), progress));
    let log = master.log();
    if let Some(file) = &log_file {
        let ended = done.as_ref().err().map_or_else(|| "ended well".into(), |e| format!("failed: {e}"));
        let spent = clock.elapsed().as_secs_f64();
        let notes: String = log.notes.iter().map(|note| format!("note: {note}\n")).collect();
        let (of, told) = (args.file.display(), summary::log(log));
        let text = format!("{of}: {ended}\n{told}computed in {spent:.3} s\n{notes}");
        trueup_fmi_description::pack::write_file(file, text.as_bytes())
            .map_err(|e| CliError::Failed(e.to_string()))?;
    }
    for note in log.notes.iter().skip(before) {
        voice::note(note);
    }
    // What an FMU leaves behind acts here at the latest, before results have their name.
    drop(master);
    match done {
        Ok(log) => {
            let summary = summary::log(&log);
            let text = format!("{}: {} rows\n{}", args.output.display(), results.rows(), summary.trim_end());
            results.finish().map_err(failed)?;
            if let (Some(file), Some(memory)) = (&plot_file, &memory) {
                let title = args.file.file_stem().unwrap_or_default().to_string_lossy();
                let html = crate::plot::page(&title, memory, &plants, &summary::log(&log));
                trueup_fmi_description::pack::write_file(file, html.as_bytes())
                    .map_err(|e| CliError::Failed(e.to_string()))?;
            }
            voice::line(&text);
            Ok(())
        }
        Err(e) => {
            let before = results.previous().map(|file| {
                format!("\n{} of an earlier run is kept as {}", args.output.display(), file.display())
            });
            let kept = match results.keep_partial() {
                Ok(None) => "nothing was computed before".to_owned(),
                Ok(Some(file)) => format!("what was computed before is kept in {}", file.display()),
                Err(e) => format!("what was computed before could not be kept: {e}"),
            };
            Err(CliError::at(&args.file, format!("{e}\n{kept}{}", before.unwrap_or_default())))
        }
    }
}
