//! `trueup init`

use std::collections::BTreeMap;
use std::io::{BufRead, IsTerminal, Write};
use std::path::{Path, PathBuf};

use trueup_identification::draft::draft_model;
use trueup_models::plants;
use trueup_signals::draft::{DraftLogs, DraftModel};
use trueup_signals::{RECORDING_ENDS, did_you_mean, names_recording};

use crate::args::Init;
use crate::error::CliError;
use crate::output::{say, write};
use crate::voice;

pub(crate) fn run(args: &Init) -> Result<(), CliError> {
    let failed = |e: trueup_signals::SignalsError| CliError::Failed(e.to_string());
    let mut files = Vec::new();
    for log in &args.logs {
        files.extend(logs(log)?);
    }
    files.sort();
    files.dedup();
    let logs = DraftLogs::look(&files, args.time.as_deref(), args.rate).map_err(failed)?;
    let file = logs.folder().join("case.toml");
    if file.exists() && !args.print {
        let why = "it is there already and stays as it is; move it away, or see a draft with --print";
        return Err(CliError::at(&file, why));
    }
    let terminal = std::io::stdin().is_terminal() && std::io::stderr().is_terminal();
    let model = model(args, &logs, terminal)?;
    let mut named = BTreeMap::new();
    if terminal {
        for variable in logs.missing(&model, &named) {
            let column = ask(&format!(
                "Which column is {variable}, which drives the model (of {}; none: Enter)?",
                logs.columns().join(", ")
            ))?;
            if logs.columns().contains(&column.as_str()) {
                named.insert(column, variable.to_owned());
            }
        }
    }
    let draft = logs.draft(&model, &named).map_err(failed)?;
    if args.print {
        return say(&draft.text);
    }
    write(&draft.file, draft.text.as_bytes())?;
    draft.summary.iter().for_each(|line| voice::line(line));
    let guesses = match draft.guesses {
        0 => "nothing in it is guessed".to_owned(),
        1 => "one guess in it is marked GUESS".to_owned(),
        n => format!("{n} guesses in it are marked GUESS"),
    };
    say(&format!(
        "{}: recordings: {}; model: {}; {guesses}. Next: trueup check {}\n",
        draft.file.display(),
        logs.recordings(),
        model.name,
        draft.file.display()
    ))
}

/// A log, or those of a folder.
fn logs(path: &Path) -> Result<Vec<PathBuf>, CliError> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    // A LeRobot data set has its readings in data/.
    let lerobot = path.join("meta").join("info.json").is_file();
    let inside = if lerobot { path.join("data") } else { path.to_owned() };
    let mut found = Vec::new();
    let mut folders = vec![inside.clone()];
    while let Some(folder) = folders.pop() {
        let list = match std::fs::read_dir(&folder) {
            Ok(list) => list,
            Err(_) if lerobot => break,
            Err(e) => return Err(CliError::at(&folder, e)),
        };
        for entry in list {
            let file = entry.map_err(|e| CliError::at(&folder, e))?.path();
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let is_log =
                if lerobot { name.to_lowercase().ends_with(".parquet") } else { names_recording(&name) };
            if file.is_dir() && lerobot {
                folders.push(file);
            } else if is_log {
                found.push(file);
            }
        }
    }
    if found.is_empty() {
        let why = match lerobot {
            true => "this is a LeRobot data set without readings: there is no .parquet file under data/; download it whole".to_owned(),
            false => format!("there is no log in this folder ({})", RECORDING_ENDS.join(", ")),
        };
        return Err(CliError::at(path, why));
    }
    Ok(found)
}

fn model(args: &Init, logs: &DraftLogs, terminal: bool) -> Result<DraftModel, CliError> {
    let joints = logs.joints();
    let guess = if joints > 1 { "PlanarManipulator" } else { "TwoMassJoint" };
    let mut guessed = args.model.is_none();
    let mut name = args.model.clone().unwrap_or_else(|| guess.to_owned());
    if guessed && terminal {
        let answer = ask(&format!("Model, one of {} [{guess}]:", plants::NAMES.join(", ")))?;
        if !answer.is_empty() {
            (name, guessed) = (answer, false);
        }
    }
    if !plants::NAMES.contains(&name.as_str()) {
        let other = format!("name one of {}", plants::NAMES.join(", "));
        let mend = did_you_mean(&name, plants::NAMES, &other);
        return Err(CliError::Usage(format!("there is no model `{name}` for a case; {mend}")));
    }
    let several = (joints > 1).then_some(joints);
    let model = draft_model(&name, several).map_err(|e| CliError::Failed(e.to_string()))?;
    Ok(DraftModel { guessed, ..model })
}

fn ask(question: &str) -> Result<String, CliError> {
    let mut answer = String::new();
    let mut err = std::io::stderr();
    let asked = write!(err, "{question} ").and_then(|()| err.flush());
    let read = asked.and_then(|()| std::io::stdin().lock().read_line(&mut answer));
    read.map_err(|e| CliError::Failed(format!("the terminal: {e}")))?;
    Ok(answer.trim().to_owned())
}
