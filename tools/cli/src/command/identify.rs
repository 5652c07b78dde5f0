//! `trueup identify`

mod design;
mod page;
pub(crate) mod statics;
mod table;

use trueup_fmi_import::{ProcessSurroundings, UnpackedFmu, UsedInterface};
use trueup_identification::fmu::FmuSubject;
use trueup_identification::identify::{
    Identified, IdentifyError, IdentifyMethod, IdentifySettings, identify, identify_fmu, json,
};
use trueup_identification::intake::Purpose;

use super::diagnose::READING;
use crate::args::Identify;
use crate::case::{load, load_for};
use crate::error::CliError;
use crate::output::{can_be_written, say, write};
use crate::stages::Stages;
use trueup_signals::did_you_mean;

pub(crate) fn run(args: &Identify) -> Result<(), CliError> {
    let found = fitted(args)?;
    if !args.json {
        return say(&table::text(&found));
    }
    let mut all = json(&found);
    if let Some(d) = &found.design {
        all["design"] = design::json(d);
    }
    say(&format!("{all:#}\n"))
}

/// Fits, and writes the page if one is requested; prints nothing.
pub(crate) fn fitted(args: &Identify) -> Result<Identified, CliError> {
    args.plot.iter().try_for_each(|file| can_be_written(file))?;
    let model =
        args.fmu.as_ref().map(FmuSubject::open).transpose().map_err(|e| CliError::Failed(e.to_string()))?;
    if let Some(model) = &model {
        isolated(args, model.fmu())?;
    }
    // A process may divide before, not after. Each call of an FMU has the deadline for itself.
    let stages = Stages::watched(READING, args.deadline.filter(|_| model.is_none()));
    let progress = |what: &str| stages.name(what);
    let design = args.design.as_ref().map(|d| &d.0);
    let settings = IdentifySettings { method: args.method, profile: !args.fast, design, progress: &progress };
    let (loaded, found) = match args.fmu.as_ref().zip(model) {
        Some((file, model)) => {
            let surroundings = ProcessSurroundings::now();
            let (loaded, _) = load_for(&args.case, &model)?;
            let found = identify_fmu(&loaded, model, &settings);
            if let Some(what) = surroundings.restored() {
                let mend = "that is undone; give the FMU a process of its own";
                return Err(CliError::at(file, format!("the FMU {what}: {mend}")));
            }
            (loaded, found)
        }
        None => {
            let purpose = match args.method {
                IdentifyMethod::BreakAway => Purpose::BreakAway,
                _ => Purpose::Identify,
            };
            let (loaded, _) = load(&args.case, purpose, &args.with)?;
            let found = identify(&loaded, &settings);
            (loaded, found)
        }
    };
    let found = found.map_err(|e| match &e {
        IdentifyError::NoDesign { name, known } => {
            let otherwise =
                "name where a run begins, as initialSpringOffset, or a parameter that is not fitted";
            let mend = did_you_mean(name, known.iter().map(String::as_str), otherwise);
            CliError::Usage(format!("{e}; {mend}"))
        }
        _ => CliError::at(&loaded.case.file, e),
    })?;
    drop(stages);
    if let Some(file) = &args.plot {
        write(file, page::page(&loaded.case, &found).as_bytes())?;
    }
    Ok(found)
}

/// An FMU that is not ours gets processes of its own, where there are any.
fn isolated(args: &Identify, fmu: &UnpackedFmu) -> Result<(), CliError> {
    let wanted = args.isolate || args.deadline.is_some();
    let ours = fmu.is_ours(UsedInterface::ModelExchange);
    if args.in_process && !ours {
        return crate::isolate::keep(&fmu.file().display().to_string());
    }
    if args.in_process || !wanted && ours {
        return Ok(());
    }
    match crate::isolate::isolation(args.deadline) {
        Ok(isolation) => fmu.isolate(&isolation),
        Err(e) if wanted => return Err(CliError::Failed(format!("--isolate, --deadline: {e}"))),
        Err(_) => {} // as --in-process
    }
    Ok(())
}
