//! `trueup diagnose`

use std::path::Path;
use std::time::Instant;

use trueup_diagnosis::diagnose::foreign::diagnose_foreign;
use trueup_diagnosis::diagnose::{AugmentedModel, DiagnoseOptions, Diagnosed, diagnose};
use trueup_diagnosis::engine::subject::DiagnosisSubject;
use trueup_diagnosis::inputs;
use trueup_diagnosis::outcome::{ClaimedAmount, Diagnosis, NO_HOLDOUT, OutcomeSeverity, Verdict};
use trueup_diagnosis::picture::isolability;
use trueup_diagnosis::shipped;
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::pack::write_file;
use trueup_fmi_description::template::Template;
use trueup_identification::intake::Purpose;
use trueup_report::{DiagnosisRun, command_line, diagnosis_files, number};
use trueup_signals::{Finding, Loaded};

use crate::args::Diagnose;
use crate::case::{foreign, load};
use crate::command::pack::ReadyModel;
use crate::error::CliError;
use crate::output::{can_be_made, folder, say};
use crate::stages::Stages;
use crate::templates;
use crate::voice;

/// What is done before the recordings are known.
pub(super) const READING: &str = "reading the case";

pub(crate) fn run(args: &Diagnose) -> Result<(), CliError> {
    let (found, written) = found(args)?;
    // The result is printed even where it could not be written.
    say(&if args.json { json(&found.diagnosis)? } else { text(&found.diagnosis) })?;
    written
}

fn json(d: &Diagnosis) -> Result<String, CliError> {
    Ok(serde_json::to_string_pretty(d).map_err(|e| CliError::Failed(e.to_string()))? + "\n")
}

/// Diagnoses and writes all files.
pub(crate) fn write(args: &Diagnose) -> Result<Diagnosed, CliError> {
    let (found, written) = found(args)?;
    written.map(|()| found)
}

/// Diagnoses; what became of writing the files.
fn found(args: &Diagnose) -> Result<(Diagnosed, Result<(), CliError>), CliError> {
    let begun = Instant::now();
    // A process may divide before, not after.
    let foreign = foreign::foreign(&args.case, args.deadline)?;
    let stages = Stages::watched(READING, args.deadline);
    let (loaded, findings) = match &foreign {
        Some((case, findings)) => (case.loaded.clone(), findings.clone()),
        None => load(&args.case, Purpose::Diagnose, &[])?,
    };
    // What would prevent writing is reported before the work, not after it.
    let library = args.library.as_deref();
    let templates =
        (!args.verdict_only && foreign.is_none()).then(|| templates::read(&[], library)).transpose()?;
    can_be_made(&args.output)?;
    let capped = !args.force && findings.iter().any(Finding::is_grave);
    let options = DiagnoseOptions {
        seed: args.seed,
        capped,
        force: args.force,
        watch: args.watch,
        all_readings: args.all_readings,
        verdict_only: args.verdict_only,
    };
    sensors(&loaded);
    let progress = &mut |part: f64, what: &str| stages.tell(part, what);
    let found = match foreign {
        Some((case, _)) => diagnose_foreign(case, &options, progress),
        None => diagnose(&loaded, &options, progress),
    };
    let mut found = found.map_err(|e| CliError::at(&loaded.case.file, e))?;
    if let Some(why) = &found.diagnosis.not_compared {
        voice::line(&format!("causes were not compared: {why}"));
    }
    // Those of the case were reported when it was read.
    let grave = found.diagnosis.findings.iter().filter(|f| f.severity == OutcomeSeverity::Grave);
    grave.for_each(|f| voice::line(&format!("grave: {}: {}", f.file, f.text)));
    let inputs = inputs::read(&loaded.case).map_err(|e| CliError::Failed(e.to_string()))?;
    found
        .complete(&findings, &loaded.case.folder, Some(inputs))
        .map_err(|e| not_finite(&args.output, "diagnosis.json", &e.to_string()))?;
    // All or nothing: files are written when everything is ready.
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    if let (Some(augmented), Some(templates)) = (&found.augmented, &templates) {
        files = fmus(templates, &found.diagnosis, augmented)?;
        found.diagnosis.augmented = Some(files.iter().map(|f| f.0.clone()).collect());
    }
    let names: Vec<String> = files.iter().map(|f| f.0.clone()).collect();
    let arguments = std::iter::once("trueup".to_owned()).chain(std::env::args().skip(1));
    let run = DiagnosisRun { seed: args.seed, command: command_line(arguments), fmus: &names };
    let others = diagnosis_files(&loaded, &found, &run);
    files.extend(others.map_err(|e| not_finite(&args.output, e.file, &e.what))?);
    // Files are written to the end.
    drop(stages);
    let written = store(&args.output, &files);
    if written.is_ok() {
        voice::line(&format!(
            "{} in {:.1} s",
            args.output.join("diagnosis.json").display(),
            begun.elapsed().as_secs_f64()
        ));
    }
    Ok((found, written))
}

fn store(output: &Path, files: &[(String, Vec<u8>)]) -> Result<(), CliError> {
    folder(output)?;
    for (name, bytes) in files {
        write_file(&output.join(name), bytes).map_err(|e| CliError::Failed(e.to_string()))?;
    }
    Ok(())
}

/// A figure that must not be written.
fn not_finite(folder: &Path, name: &str, what: &str) -> CliError {
    CliError::at(
        &folder.join(name),
        format!(
            "{what}: nothing is written; look at the findings above and at the sizes of readings and parameters, \
             and report the case if these are sensible"
        ),
    )
}

/// What these sensors can distinguish, printed before anything is compared.
fn sensors(loaded: &Loaded) {
    let Ok(subject) = DiagnosisSubject::of(&loaded.case) else { return };
    let told = isolability(loaded, &subject);
    let of = |one: bool| {
        let classes = told.classes.iter().filter(|c| (c.len() == 1) == one);
        classes.map(|c| c.join(", ")).collect::<Vec<_>>()
    };
    let list = |what: &str, classes: &[String]| {
        if !classes.is_empty() {
            voice::line(&format!("{what}: {}", classes.join(" | ")));
        }
    };
    list("these sensors distinguish by the equations alone", &of(true));
    list("... by the form of an effect only", &of(false));
    list("... and in no balance at all", &told.hidden);
}

/// The model with what was claimed, for both versions of FMI.
fn fmus(
    templates: &[Template],
    diagnosis: &Diagnosis,
    augmented: &AugmentedModel,
) -> Result<Vec<(String, Vec<u8>)>, CliError> {
    let Some(packed) = &diagnosis.pack else { return Ok(Vec::new()) };
    let ready = ReadyModel::of(packed, &[])?;
    shipped::check(diagnosis, augmented, ready.start()).map_err(|e| {
        CliError::Failed(format!(
            "{e}: nothing is written, for the files would contradict each other; report the case"
        ))
    })?;
    ready.fmus(&FmiVersion::ALL, templates)
}

/// A parameter of the model: found, the user's value, the change.
fn yours(name: &str, a: &ClaimedAmount) -> String {
    let mut line = format!("{name} = {} {}", number(a.value), a.unit);
    let Some(nominal) = a.nominal else { return line };
    line += &format!(", yours {}", number(nominal));
    if nominal != 0.0 {
        line += &format!(": {:+.1} %", 100.0 * (a.value - nominal) / nominal.abs());
    }
    if let Some(deviation) = a.nominal_deviation.filter(|d| *d > 0.0) {
        line += &format!(", {:+.1} of your standard deviations", (a.value - nominal) / deviation);
    }
    line
}

/// The verdict for people.
pub(crate) fn text(d: &Diagnosis) -> String {
    let mut out = match d.verdict {
        Verdict::Unknown if d.capped => {
            "unknown: a grave finding (above) permits no conclusion; correct it, or continue with --force\n"
                .to_owned()
        }
        Verdict::Unknown if d.not_compared.is_some() => {
            "unknown: causes were not compared (above)\n".to_owned()
        }
        Verdict::NoGap => "no gap: nothing beyond the sensors' noise\n".to_owned(),
        Verdict::Parameters => "parameters: refitting what the model already has is enough\n".to_owned(),
        Verdict::Effects => "effects: something is missing from the model\n".to_owned(),
        Verdict::Ambiguous => "ambiguous: these recordings cannot distinguish the causes below\n".to_owned(),
        Verdict::Unknown => "unknown: something is there that no effect of the library explains\n".to_owned(),
    };
    for e in &d.effects {
        let joint =
            e.joint.filter(|_| d.model != "TwoMassJoint").map_or(String::new(), |j| format!(", joint {j}"));
        out += &format!("  {} ({}{joint}), probability {:.2}\n", e.id, e.component, e.probability);
        for (name, a) in &e.parameters {
            let end = |v: Option<f64>| v.map_or("open".to_owned(), number);
            let interval = match &a.reason {
                Some(reason) => format!("({reason})"),
                None => format!("[{}, {}]", end(a.ci95[0]), end(a.ci95[1])),
            };
            out += &format!("    {name} = {} {} {interval}\n", number(a.value), a.unit);
        }
    }
    let (near, moved): (Vec<_>, Vec<_>) = d.parameters.iter().partition(|(_, a)| a.hardly_moved());
    moved.iter().for_each(|(name, a)| out += &format!("  {}\n", yours(name, a)));
    if !near.is_empty() {
        out += &format!(
            "  {} more parameters moved by less than half a standard deviation of yours, or by 1 % where it has none\n",
            near.len()
        );
    }
    if let Some(g) = &d.gap.overall {
        let closed = match g.closed {
            Some(c) => format!("closed {:.0} %", 100.0 * c.clamp(0.0, 1.0)),
            None if g.before > 1.0 => "what is closed is no figure, the nominal run drifts away".to_owned(),
            None => "nothing to close".to_owned(),
        };
        out += &format!(
            "gap on {}: {:.4} before, {:.4} tuned, {:.4} after, floor {:.4}; {closed}\n",
            if d.notes.iter().any(|n| n == NO_HOLDOUT) {
                "the recordings that were fitted"
            } else {
                "held-out recordings"
            },
            g.before,
            g.tuned,
            g.after,
            g.floor
        );
    }
    if let Some(w) = d.gap.overall.as_ref().and_then(|g| g.window.as_ref()) {
        let closed =
            w.closed.map_or(String::new(), |c| format!("; closed {:.0} %", 100.0 * c.clamp(0.0, 1.0)));
        out += &format!(
            "the same over windows of {} s: {} before, {} tuned, {} after, floor {}{closed}\n",
            number(w.seconds),
            number(w.before),
            number(w.tuned),
            number(w.after),
            number(w.floor)
        );
    }
    if let Some(n) = &d.next_experiment {
        let chance = n.probability.map_or(String::new(), |p| format!("; it decides with probability {p:.2}"));
        out += &format!("next experiment: {} ({}){chance}\n", n.why, n.input);
    }
    if !d.location.components.is_empty() && d.verdict == Verdict::Unknown {
        let places: Vec<String> = d
            .location
            .components
            .iter()
            .take(3)
            .map(|c| format!("{} {:.0} %", c.id, 100.0 * c.share))
            .collect();
        out += &format!("possible places: {}\n", places.join(", "));
    }
    for w in d.watch.iter().flatten() {
        let joint = w.joint.map_or_else(String::new, |j| format!(" of joint {j}"));
        let like = w.like.as_ref().map_or_else(String::new, |l| {
            format!(", as {} {} more of {} would do", number(l.value), l.unit, l.input)
        });
        out += &format!(
            "{} parts from the model from {:.4} s to {:.4} s ({}{joint}{like})\n",
            w.recording, w.start, w.end, w.component
        );
    }
    if d.watch.as_ref().is_some_and(Vec::is_empty) {
        out += "what is held out parts from the model nowhere by more than what is healthy does\n";
    }
    for f in &d.findings {
        let severity = if f.severity == OutcomeSeverity::Note { "note" } else { "warning" };
        let channel = f.channel.as_ref().map_or_else(String::new, |c| format!(" {c}:"));
        out += &format!("{severity}: {}:{channel} {}\n", f.file, f.text);
    }
    for note in &d.notes {
        out += &format!("note: {note}\n");
    }
    out
}
