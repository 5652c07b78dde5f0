//! `trueup diagnose`

use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::Path;
use std::time::Instant;

use indicatif::{ProgressBar, ProgressStyle};
use trueup_diagnosis::diagnose::{Augmented, Diagnosed, Options, began, diagnose, record};
use trueup_diagnosis::engine::subject::Subject;
use trueup_diagnosis::experiment;
use trueup_diagnosis::finite;
use trueup_diagnosis::outcome::{Diagnosis, Noticed, Verdict};
use trueup_diagnosis::picture::{Picture, isolability};
use trueup_fmi::configuration::Configuration;
use trueup_fmi_description::Version;
use trueup_fmi_description::pack::write_file;
use trueup_report::{Evidence, Map, Trace, diagnosis_page, number};
use trueup_signals::{Finding, Loaded};

use crate::args::Diagnose;
use crate::case::{Purpose, load};
use crate::catalog;
use crate::command::pack;
use crate::error::Error;
use crate::output::{can_be_made, folder, say};

pub(crate) fn run(args: &Diagnose) -> Result<(), Error> {
    let found = write(args)?;
    say(&if args.json { json(&found)? } else { text(&found) })
}

fn json(d: &Diagnosis) -> Result<String, Error> {
    Ok(serde_json::to_string_pretty(d).map_err(|e| Error::Failed(e.to_string()))? + "\n")
}

/// Diagnoses and writes all files.
pub(crate) fn write(args: &Diagnose) -> Result<Diagnosis, Error> {
    let begun = Instant::now();
    let (loaded, findings) = load(&args.case, Purpose::Diagnose)?;
    // What would be in the way of writing is said before the work, not after it.
    let library = (!args.verdict_only).then(|| pack::library(args.library.as_deref())).transpose()?;
    can_be_made(&args.output)?;
    let capped = !args.force && findings.iter().any(Finding::is_grave);
    let options = Options { seed: args.seed, capped, verdict_only: args.verdict_only, ..Options::default() };
    sensors(&loaded);
    let bar = std::io::stderr().is_terminal().then(bar);
    let mut tell = |part: f64, what: &str| match &bar {
        Some(bar) => {
            bar.set_position((1000.0 * part) as u64);
            bar.set_message(what.to_owned());
        }
        None => eprintln!("{:3.0} %  {what}", 100.0 * part),
    };
    let found = diagnose(&loaded, &options, &mut tell);
    if let Some(bar) = &bar {
        bar.finish_and_clear();
    }
    let mut found = found.map_err(|e| Error::at(&loaded.case.file, e))?;
    found.diagnosis.findings = Noticed::of(&findings, &loaded.case.folder);
    finite::check(&found.diagnosis)
        .map_err(|e| not_finite(&args.output, "diagnosis.json", &e.to_string()))?;
    // All or nothing: files are written when everything is ready.
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    if let (Some(augmented), Some(library)) = (&found.augmented, &library) {
        let ready = fmus(library, &loaded, augmented)?;
        found.diagnosis.augmented = Some(ready.iter().map(|f| f.0.clone()).collect());
        files = ready;
    }
    if !found.began.is_empty() && !args.verdict_only {
        let csv = began::csv(&found.began).map_err(|e| Error::at(Path::new(began::FILE), e))?;
        files.push((began::FILE.into(), csv));
    }
    if let Some(next) = &found.next {
        let csv = experiment::csv(&next.inputs).map_err(|e| Error::at(Path::new(experiment::FILE), e))?;
        files.push((experiment::FILE.into(), csv));
    }
    if let Some(picture) = &found.picture {
        let page = page(&loaded, &found, picture, args.seed);
        finite_words(&page).map_err(|e| not_finite(&args.output, "report.html", &e))?;
        files.push(("report.html".into(), page.into_bytes()));
    }
    let record = serde_json::to_vec(&found.record).map_err(|e| Error::Failed(e.to_string()))?;
    files.push((record::FILE.into(), record));
    files.push(("diagnosis.json".into(), json(&found.diagnosis)?.into_bytes()));
    folder(&args.output)?;
    for (name, bytes) in files {
        write_file(&args.output.join(name), &bytes).map_err(|e| Error::Failed(e.to_string()))?;
    }
    eprintln!("{} in {:.1} s", args.output.join("diagnosis.json").display(), begun.elapsed().as_secs_f64());
    Ok(found.diagnosis)
}

/// A figure that must not be written.
fn not_finite(folder: &Path, name: &str, what: &str) -> Error {
    Error::at(
        &folder.join(name),
        format!(
            "{what}: nothing is written; look at the findings above and at the sizes of readings and parameters, \
             and report the case if these are sensible"
        ),
    )
}

/// The first figure of a page's text that is not finite. Samples of its charts are `null` then.
fn finite_words(page: &str) -> Result<(), String> {
    // The scripts of the charts come last.
    let text = page.split("<!-- uPlot").next().unwrap_or(page);
    let cells = text.split('<').filter_map(|part| part.split_once('>').map(|p| p.1));
    let words = cells
        .flat_map(|cell| cell.split(|c: char| !(c.is_alphanumeric() || matches!(c, '-' | '_' | '.' | '/'))));
    match words.into_iter().find(|w| matches!(*w, "NaN" | "inf" | "-inf")) {
        Some(word) => Err(format!("a figure is {word}")),
        None => Ok(()),
    }
}

/// What these sensors can tell at all, said before anything is compared.
fn sensors(loaded: &Loaded) {
    let Ok(subject) = Subject::of(&loaded.case) else { return };
    let told = isolability(loaded, &subject);
    let of = |one: bool| {
        let classes = told.classes.iter().filter(|c| (c.len() == 1) == one);
        classes.map(|c| c.join(", ")).collect::<Vec<_>>()
    };
    let list = |what: &str, classes: &[String]| {
        if !classes.is_empty() {
            eprintln!("{what}: {}", classes.join(" | "));
        }
    };
    list("these sensors tell apart by the equations alone", &of(true));
    list("... by the form of an effect only", &of(false));
    list("... and in no balance at all", &told.hidden);
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}");
    ProgressBar::new(1000).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}

/// The model with what was claimed, for both versions of FMI.
fn fmus(library: &Path, loaded: &Loaded, augmented: &Augmented) -> Result<Vec<(String, Vec<u8>)>, Error> {
    let name = loaded.case.model.as_str();
    let model = catalog::models()
        .find(|m| m.name == name)
        .ok_or_else(|| Error::Failed(format!("there is no model `{name}`")))?;
    let library = std::fs::read(library).map_err(|e| Error::at(library, e))?;
    let flexible = augmented.flexible.clone();
    let effects = catalog::in_order(name, &augmented.effects).ok_or_else(|| {
        Error::Failed(format!("{name} cannot be packed with {}", augmented.effects.join(", ")))
    })?;
    let mut configuration = Configuration { joint_flexible: flexible, effects, ..Configuration::of(name) };
    let table = fmu_library::table(&configuration).map_err(Error::Failed)?;
    let known = |name: &str| {
        table.variables.iter().any(|v| v.name == name.split('[').next().unwrap_or(name) || v.name == name)
    };
    configuration.start =
        augmented.values.iter().filter(|(name, v)| known(name) && v.is_finite()).cloned().collect();
    let packed = pack::pack(model, &configuration, &Version::ALL, &library)?;
    let named = |(version, (_, bytes)): (&Version, (String, Vec<u8>))| {
        (format!("{name}.augmented.fmi{}.fmu", version.major()), bytes)
    };
    Ok(Version::ALL.iter().zip(packed).map(named).collect())
}

/// The page with what it was made from.
fn page(loaded: &Loaded, found: &Diagnosed, picture: &Picture, seed: u64) -> String {
    let case = loaded.case.folder.file_name().unwrap_or_default().to_string_lossy();
    let channels = loaded.recordings.values().flat_map(|r| &r.channels);
    let units: BTreeMap<&str, &str> = channels.map(|c| (c.name.as_str(), c.unit.as_str())).collect();
    let unit = |channel: &str| units.get(channel).copied().unwrap_or("");
    let traces = found.traces.iter().map(|t| Trace {
        recording: &t.recording,
        channel: &t.channel,
        unit: unit(&t.channel),
        time: &t.time,
        measured: &t.measured,
        before: &t.before,
        tuned: &t.tuned,
        after: &t.after,
        floor: t.floor,
    });
    let floors = picture.floors.iter().map(|f| {
        [
            f.channel.clone(),
            format!("{} {}", number(f.deviation), unit(&f.channel)),
            f.source.text().to_owned(),
        ]
    });
    let next = found.next.iter().flat_map(|n| &n.inputs);
    let next = next.map(|i| (i.name.as_str(), unit(&i.name), i.time.as_slice(), i.value.as_slice()));
    let evidence = Evidence {
        case: &case,
        traces: traces.collect(),
        floors: floors.collect(),
        next: next.collect(),
        maps: Map::of(picture),
        settings: vec![["seed".into(), seed.to_string()]],
        versions: vec![["trueup".into(), env!("CARGO_PKG_VERSION").into()]],
    };
    diagnosis_page(&found.diagnosis, &evidence)
}

/// The verdict for people.
pub(crate) fn text(d: &Diagnosis) -> String {
    let mut out = match d.verdict {
        Verdict::Unknown if d.capped => {
            "unknown: a grave finding (above) lets nothing be concluded; mend it, or go on with --force\n"
                .to_owned()
        }
        Verdict::NoGap => "no gap: nothing beyond the sensors' noise\n".to_owned(),
        Verdict::Parameters => "parameters: refitting what the model already has is enough\n".to_owned(),
        Verdict::Effects => "effects: something is missing from the model\n".to_owned(),
        Verdict::Ambiguous => "ambiguous: these recordings cannot tell the causes below apart\n".to_owned(),
        Verdict::Unknown => "unknown: something is there that no effect of the library explains\n".to_owned(),
    };
    for e in &d.effects {
        let joint =
            e.joint.filter(|_| d.model != "TwoMassJoint").map_or(String::new(), |j| format!(", joint {j}"));
        out += &format!("  {} ({}{joint}), probability {:.2}\n", e.id, e.component, e.probability);
        for (name, a) in &e.parameters {
            let end = |v: Option<f64>| v.map_or("open".to_owned(), |v| format!("{v:.4e}"));
            out += &format!(
                "    {name} = {:.4e} {} [{}, {}]\n",
                a.value,
                a.unit,
                end(a.ci95[0]),
                end(a.ci95[1])
            );
        }
    }
    if let Some(g) = &d.gap.overall {
        let closed = g.closed.map_or("-".to_owned(), |c| format!("{:.0} %", 100.0 * c));
        out += &format!(
            "gap on held-out recordings: {:.4} before, {:.4} tuned, {:.4} after, floor {:.4}; closed {closed}\n",
            g.before, g.tuned, g.after, g.floor
        );
    }
    if let Some(n) = &d.next_experiment {
        let chance = n.probability.map_or(String::new(), |p| format!("; it tells with probability {p:.2}"));
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
        out += &format!("where it may lie: {}\n", places.join(", "));
    }
    for note in &d.notes {
        out += &format!("note: {note}\n");
    }
    out
}
