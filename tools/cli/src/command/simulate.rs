//! `trueup simulate`

use trueup_cosim::{Error as RunError, Inputs, Options, Results, simulate};
use trueup_fmi_import::Fmu;

use crate::args::Simulate;
use crate::error::Error;

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
        start: None,
        stop: args.stop,
        step: args.step,
        tolerance: args.tolerance,
        set,
        inputs,
        outputs: args.outputs.clone(),
    };
    let mut results = Results::create(&args.output).map_err(|e| Error::Failed(e.to_string()))?;
    match simulate(&fmu, &options, &mut results) {
        Ok(summary) => {
            results.finish().map_err(|e| Error::Failed(e.to_string()))?;
            let ended = if summary.terminated { ", where the FMU ended the run" } else { "" };
            let discarded = match summary.discarded {
                0 => String::new(),
                n => format!(" ({n} discarded)"),
            };
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
