//! A simulation that does not match its recordings: refitted, diagnosed, and the seal of the cause opened.

use std::path::Path;

use trueup_fmi::configuration::Configuration;
use trueup_identification::identify::IdentifyMethod;
use trueup_report::{EvidenceTrace, Page, diagnosis_pictures, escape, sentence};
use trueup_trials::{Folders, TrialOrder, TrialPlant, TrialSplit, TruthKey, generate};

use crate::args::{Diagnose, Identify};
use crate::command::{diagnose, identify};
use crate::error::CliError;
use crate::voice;

/// One case of blind trials: which seed, and which of its cases. No scorecard has it.
const SEED: u64 = 100;
const INDEX: usize = 1;

fn failed(e: impl std::fmt::Display) -> CliError {
    CliError::Failed(e.to_string())
}

pub(super) fn tell(folder: &Path, page: &mut Page) -> Result<(), CliError> {
    voice::line(
        "[2/6] recordings of a joint that does something its model does not know; the cause is sealed",
    );
    let trial = folder.join("trial");
    let (shard, count) = ((INDEX + 1, INDEX + 1), INDEX + 1);
    let order = TrialOrder { plant: TrialPlant::Joint, split: TrialSplit::Single, count, seed: SEED, shard };
    let mut name = String::new();
    generate(Folders { directory: &trial, cache: None }, &order, |_, made| name = made.to_owned())
        .map_err(failed)?;
    let case = trial.join("cases").join(&name);

    voice::line("[3/6] trueup identify: the parameters that the model has, fitted to the recordings");
    let plot = Some(folder.join("identified.html"));
    let method = IdentifyMethod::OutputError;
    let settings = Identify { case: case.clone(), method, plot, fast: true, ..Identify::default() };
    identify::fitted(&settings)?;

    voice::line("[4/6] trueup diagnose: where the gap is, what causes it, how far it shrinks");
    let output = folder.join("diagnosis");
    let told = diagnose::write(&Diagnose {
        case,
        output,
        json: false,
        verdict_only: false,
        watch: false,
        all_readings: false,
        force: false,
        seed: 1,
        deadline: None,
        library: None,
    })?;
    let (found, traces) = (told.diagnosis, told.traces);
    crate::output::say(&diagnose::text(&found))?;

    // Only now.
    let seal = trial.join("keys").join(format!("{name}.toml"));
    let text = std::fs::read_to_string(&seal).map_err(|e| CliError::at(&seal, e))?;
    let key: TruthKey = toml::from_str(&text).map_err(|e| CliError::at(&seal, e))?;
    let truth = format!("{} ({})", key.effects.join(", "), key.components.join(", "));
    crate::output::say(&format!("the seal: {truth}\n"))?;

    page.section(
        "Diagnosis: a cause that was sealed",
        "A generator that shares nothing with Trueup's effects made recordings of a joint. The diagnosis saw the recordings and the \
         nominal model; the key was opened when it was done.",
    );
    page.html(&format!("<p class=\"verdict\">{}</p>", escape(&sentence(&found))));
    let said: Vec<String> = found.effects.iter().map(|e| format!("{} ({})", e.id, e.component)).collect();
    let none = || "-".to_owned();
    let said = if said.is_empty() { none() } else { said.join(", ") };
    let verdict = serde_json::to_value(found.verdict).map_err(failed)?;
    let rows = [
        ["verdict".to_owned(), verdict.as_str().unwrap_or_default().to_owned(), key.verdict.clone()],
        ["effect".to_owned(), said, truth],
    ];
    page.table(&["", "reported", "sealed"], &rows.map(|r| r.to_vec()));
    // The channel that shows it most.
    let most = found.location.channels.first().map(|c| c.name.as_str());
    let shown = traces.iter().find(|t| Some(t.channel.as_str()) == most).or(traces.first());
    let table = fmu_library::table(&Configuration::of(&found.model)).map_err(failed)?;
    let unit = |channel: &str| table.find(channel).map_or("", |v| v.unit);
    let shown = shown.map(|t| EvidenceTrace::of(t, unit(&t.channel)));
    diagnosis_pictures(page, &found, shown.as_ref());
    page.html(
        "<p><a href=\"diagnosis/report.html\">The whole diagnosis</a>; before it, \
         <a href=\"identified.html\">what fitting the model's own parameters gave</a>.</p>",
    );
    Ok(())
}
