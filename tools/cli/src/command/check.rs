//! `trueup check`

use trueup_diagnosis::check::{CaseCheck, CheckedChannel, CheckedParameter, CheckedRecording, check};
use trueup_diagnosis::diagnose::input_scale::InputGain;
use trueup_diagnosis::outcome::{NoticedMistake, OutcomeSeverity};
use trueup_identification::intake::{CaseIntake, Purpose};
use trueup_report::{Chart, Page, number};
use trueup_signals::{Finding, Loaded};

use crate::args::Check;
use crate::error::CliError;
use crate::output::{say, write};

pub(crate) fn run(args: &Check) -> Result<(), CliError> {
    let read = CaseIntake::read(&args.case, Purpose::Diagnose, &[]);
    let CaseIntake { loaded, findings, preset } = read.map_err(|e| CliError::Failed(e.to_string()))?;
    let checked = check(&loaded, &findings);
    if let Some(file) = &args.plot {
        write(file, page(&loaded, &checked).as_bytes())?;
    }
    let text = match args.json {
        true => serde_json::to_string_pretty(&checked).map_err(|e| CliError::Failed(e.to_string()))? + "\n",
        false => text(&checked, preset.as_deref()),
    };
    say(&text)?;
    if findings.iter().any(Finding::is_error) { Err(CliError::Said) } else { Ok(()) }
}

fn figure(x: Option<f64>) -> String {
    x.map_or_else(|| "-".to_owned(), number)
}

/// Columns of the table of channels.
const HEAD: [&str; 9] = [
    "recording",
    "channel",
    "unit",
    "rate Hz",
    "longest gap s",
    "range",
    "reversals",
    "noise found / declared",
    "step found / declared",
];

fn cells(recording: &str, c: &CheckedChannel) -> Vec<String> {
    vec![
        recording.to_owned(),
        c.name.clone(),
        c.unit.clone(),
        number(c.rate),
        number(c.longest_step),
        format!("{} .. {}", number(c.range[0]), number(c.range[1])),
        c.reversals.to_string(),
        format!("{} / {}", figure(c.noise), figure(c.noise_declared)),
        format!("{} / {}", figure(c.resolution), figure(c.resolution_declared)),
    ]
}

fn rows(checked: &CaseCheck) -> Vec<Vec<String>> {
    let of = |r: &CheckedRecording| {
        let name = format!("{} ({})", r.name, r.purpose);
        r.channels.iter().map(|c| cells(&name, c)).collect::<Vec<_>>()
    };
    checked.recordings.iter().flat_map(of).collect()
}

fn findings(checked: &CaseCheck) -> Vec<String> {
    let one = |f: &NoticedMistake| {
        let severity = format!("{:?}", f.severity).to_lowercase();
        let line = f.line.map_or_else(String::new, |l| format!(":{l}"));
        let channel = f.channel.as_ref().map_or_else(String::new, |c| format!(" {c}:"));
        format!("{severity}: {}{line}:{channel} {}", f.file, f.text)
    };
    checked.findings.iter().map(one).collect()
}

/// Components that the sensors distinguish, and those that they do not.
fn sensors(checked: &CaseCheck) -> Vec<String> {
    let of = |one: bool| {
        let classes = checked.sensors.classes.iter().filter(|c| (c.len() == 1) == one);
        classes.map(|c| c.join(", ")).collect::<Vec<_>>().join(" | ")
    };
    let lists = [
        ("these sensors distinguish by the equations alone", of(true)),
        ("... by the form of an effect only", of(false)),
        ("... and in no balance at all", checked.sensors.hidden.join(" | ")),
    ];
    lists.into_iter().filter(|(_, l)| !l.is_empty()).map(|(what, list)| format!("{what}: {list}")).collect()
}

fn parameters(checked: &CaseCheck) -> Vec<Vec<String>> {
    let one = |p: &CheckedParameter| {
        let share = match p.standard_error {
            Some(e) if p.value != 0.0 => format!("{} %", number(100.0 * e / p.value.abs())),
            Some(_) => "-".to_owned(),
            None => "not determined".to_owned(),
        };
        vec![p.name.clone(), number(p.value), p.unit.clone(), figure(p.standard_error), share]
    };
    checked.parameters.iter().map(one).collect()
}

/// Columns of the table of gains.
const GAINS: [&str; 4] = ["input", "recording", "gain", "standard deviation"];

fn gains(checked: &CaseCheck) -> Vec<Vec<String>> {
    let one = |g: &InputGain| {
        vec![g.input.clone(), g.recording.clone(), number(g.gain), number(g.standard_deviation)]
    };
    checked.gains.iter().map(one).collect()
}

/// What the table of gains means, and what limits it.
fn gains_note(preset: bool) -> &'static str {
    match preset {
        true => {
            "parameters of the preset (named above) may be off, and the gains contain that: compare recordings with each other"
        }
        false => "1: as recorded; wrong parameters and missing effects change it in all recordings alike",
    }
}

/// Columns of the widths that they need.
fn aligned(head: &[&str], rows: &[Vec<String>]) -> String {
    let width =
        |k: usize| rows.iter().map(|r| r[k].chars().count()).chain([head[k].len()]).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let line = |cells: Vec<&str>| {
        let padded: Vec<String> = cells.iter().zip(&widths).map(|(c, w)| format!("{c:<w$}")).collect();
        format!("  {}\n", padded.join("  ").trim_end())
    };
    let body = rows.iter().map(|r| line(r.iter().map(String::as_str).collect()));
    std::iter::once(line(head.to_vec())).chain(body).collect()
}

const PARAMETERS: [&str; 5] = ["parameter", "nominal", "unit", "expected error", "of the value"];

fn text(checked: &CaseCheck, preset: Option<&str>) -> String {
    let mut out = String::new();
    let count = |severity| checked.findings.iter().filter(|f| f.severity == severity).count();
    out += &format!(
        "{}: {} recordings; {} grave, {} warnings, {} notes\n",
        checked.model,
        checked.recordings.len(),
        count(OutcomeSeverity::Grave),
        count(OutcomeSeverity::Warning),
        count(OutcomeSeverity::Note)
    );
    // What was computed with a preset is to be read so.
    if let Some(preset) = preset {
        out +=
            &format!("{preset}: gains of inputs and expected errors below are computed with these values\n");
    }
    findings(checked).iter().for_each(|f| out += &format!("{f}\n"));
    out += &format!("\n{}", aligned(&HEAD, &rows(checked)));
    if !checked.gains.is_empty() {
        out += "\nGain of each input: by how many times the recorded one the nominal model needs it\n";
        out += &format!("{}  {}\n", aligned(&GAINS, &gains(checked)), gains_note(preset.is_some()));
    }
    out += "\nWhat these recordings would determine (standard errors by the sensitivities of the model, before any fit)\n";
    if !checked.parameters.is_empty() {
        out += &aligned(&PARAMETERS, &parameters(checked));
    }
    out += &format!("  {}\n", checked.parameters_note);
    sensors(checked).iter().for_each(|l| out += &format!("{l}\n"));
    if !checked.proposals.is_empty() {
        out += "\nFor case.toml, by what the readings show\n";
        checked.proposals.iter().for_each(|l| out += &format!("  {l}\n"));
    }
    out += match checked.is_grave() {
        true => "\nCorrect what is grave: until then a diagnosis concludes nothing.\n",
        false => "\nNothing grave: trueup diagnose can begin.\n",
    };
    out
}

fn page(loaded: &Loaded, checked: &CaseCheck) -> String {
    let mut page =
        Page::new(&format!("Check of {}", loaded.case.file.display()), "Recordings before any fit.");
    page.section("Findings", "");
    let found: Vec<Vec<String>> = findings(checked).into_iter().map(|f| vec![f]).collect();
    page.table(&["finding"], &found);
    page.section("Channels", "Noise by differences of neighbouring readings, steps by their values.");
    page.table(&HEAD, &rows(checked));
    if !checked.gains.is_empty() {
        page.section(
            "Gain of each input",
            "By how many times the recorded input the nominal model needs it.",
        );
        page.table(&GAINS, &gains(checked));
    }
    page.section("Expected errors", &checked.parameters_note);
    page.table(&PARAMETERS, &parameters(checked));
    sensors(checked).iter().for_each(|l| page.text(l));
    if !checked.proposals.is_empty() {
        page.section("For case.toml", "");
        page.table(&["line"], &checked.proposals.iter().map(|l| vec![l.clone()]).collect::<Vec<_>>());
    }
    for run in loaded.recordings.values() {
        page.section(&run.name, "");
        for c in &run.channels {
            page.chart(&Chart::over_time(&c.name, &c.unit).line(&c.name, &c.time, &c.values));
        }
    }
    page.finish()
}
