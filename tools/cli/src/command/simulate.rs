//! `trueup simulate`

use trueup_cosim::{Error as RunError, Inputs, Memory, Options, Results, simulate};
use trueup_fmi_import::Fmu;

use crate::args::Simulate;
use crate::error::Error;
use crate::progress::Progress;

pub(crate) fn run(args: &Simulate) -> Result<(), Error> {
    let extension = args.output.extension().unwrap_or_default().to_ascii_lowercase();
    if extension != "csv" && extension != "parquet" {
        let name = args.output.display();
        let mend = format!("let --output {name} end with .csv or .parquet");
        return Err(Error::Usage(format!("results are written as CSV or Parquet; {mend}")));
    }
    let mut set = Vec::new();
    for text in &args.set {
        let wrong = || Error::Usage(format!("--set {text}: write NAME=VALUE"));
        let (name, value) = text.split_once('=').ok_or_else(wrong)?;
        set.push((name.trim().to_owned(), value.trim().to_owned()));
    }
    let fmu = Fmu::open(&args.file).map_err(|e| Error::Failed(e.to_string()))?;
    let inputs =
        args.input.as_deref().map(Inputs::read).transpose().map_err(|e| Error::Failed(e.to_string()))?;
    let options = Options {
        interface: None,
        start: None,
        stop: args.stop,
        step: args.step,
        tolerance: args.tolerance,
        set,
        inputs,
        outputs: args.outputs.clone(),
    };
    let mut results = Results::create(&args.output).map_err(|e| Error::Failed(e.to_string()))?;
    let mut memory = args.plot.is_some().then(Memory::default);
    let experiment = fmu.description().experiment;
    let start = experiment.start_time.unwrap_or(0.0);
    let stop = args.stop.or(experiment.stop_time).unwrap_or(start + 1.0);
    let progress = Progress::new(start, stop, args.progress);
    let done = simulate(&fmu, &options, &mut ((&mut results, &mut memory), progress));
    match done {
        Ok(summary) => {
            results.finish().map_err(|e| Error::Failed(e.to_string()))?;
            let ended = if summary.terminated { ", where the FMU ended the run" } else { "" };
            let discarded = match summary.discarded {
                0 => String::new(),
                n => format!(" ({n} discarded)"),
            };
            if let (Some(file), Some(memory)) = (&args.plot, &memory) {
                let title = args.file.file_stem().unwrap_or_default().to_string_lossy();
                let html = crate::plot::page(&title, memory, "");
                trueup_fmi_description::pack::write_file(file, html.as_bytes())
                    .map_err(|e| Error::Failed(e.to_string()))?;
            }
            eprintln!(
                "{}: {} steps{discarded} to {:?} s{ended}",
                args.output.display(),
                summary.steps,
                summary.time
            );
            Ok(())
        }
        Err(e @ RunError::Setting(_)) => Err(Error::Usage(format!("{}:\n  {e}", args.file.display()))),
        // Nothing was computed.
        Err(e @ RunError::Fmu(_)) => Err(Error::Failed(e.to_string())),
        Err(e) => {
            let kept = match results.keep_incomplete() {
                Ok(None) => "nothing was computed before".to_owned(),
                Ok(Some(file)) => format!("what was computed before is kept in {}", file.display()),
                Err(e) => format!("what was computed before could not be kept: {e}"),
            };
            Err(Error::at(&args.file, format!("{e}\n{kept}")))
        }
    }
}
