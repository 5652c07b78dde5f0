//! What may be wrong with recordings that could be read, reported before anything is fitted.
//!
//! Nothing here changes a value. Thresholds are wide: a healthy recording has no finding.

mod case;
mod channel;
mod relation;

pub use relation::Relation;

use crate::case::Loaded;
use crate::finding::{Finding, FindingKind, Severity};
use crate::names::short;
use crate::recording::{Channel, Recording};
use crate::variable::{SignalVariable, VariableRole, role};

/// Looks at one recording. `relations` name the channels that must agree; the caller has the model.
pub fn recording(run: &Recording, known: &[SignalVariable], relations: &[Relation]) -> Vec<Finding> {
    let mut findings = Vec::new();
    roles(run, known, &mut findings);
    clock(run, &mut findings);
    for channel in &run.channels {
        let delay = channel.sensor.delay;
        if delay != 0.0 && delay.abs() >= run.duration() {
            let what = format!("its delay is {delay} s, the recording lasts {} s", short(run.duration()));
            let finding = Finding::error(FindingKind::BadValue, &run.file, what, "correct `delay`, in s");
            findings.push(finding.channel(&channel.name));
        }
        channel::check(run, channel, known, &mut findings);
    }
    for (i, a) in run.channels.iter().enumerate() {
        let twin = |b: &&Channel| a.values == b.values && a.range().is_some_and(|(low, high)| low < high);
        if let Some(b) = run.channels[..i].iter().find(twin) {
            let what = format!("its samples are those of `{}`", b.name);
            let mend = "one of them was written under a wrong name: export it again, or leave it out";
            let finding = Finding::warning(FindingKind::DuplicateChannel, &run.file, what, mend);
            findings.push(finding.channel(&a.name));
        }
    }
    for relation in relations {
        findings.extend(relation.check(run));
    }
    findings
}

/// Looks at a case: each recording, and what they are to each other.
pub fn case(loaded: &Loaded, known: &[SignalVariable], relations: &[Relation]) -> Vec<Finding> {
    let mut findings: Vec<_> =
        loaded.recordings.values().flat_map(|run| recording(run, known, relations)).collect();
    for relation in relations {
        relation.of_all(loaded, &mut findings);
    }
    case::check(loaded, known, &mut findings);
    findings
}

/// Inputs drive, outputs are compared: both must be there.
fn roles(run: &Recording, known: &[SignalVariable], findings: &mut Vec<Finding>) {
    if known.is_empty() {
        return;
    }
    let names = |wanted| known.iter().filter(move |v| v.role == wanted).map(|v| format!("`{}`", v.name));
    let has = |wanted| run.channels.iter().any(|c| role(known, &c.name) == Some(wanted));
    if !has(VariableRole::Output) {
        let all: Vec<_> = names(VariableRole::Output).take(12).collect();
        let mend = format!("record one of {}", all.join(", "));
        let what = "there is no output of the model to compare with";
        findings.push(Finding::error(FindingKind::NoOutput, &run.file, what, mend));
    }
    let missing = |which: &dyn Fn(&SignalVariable) -> bool| {
        let of = known
            .iter()
            .filter(|v| v.role == VariableRole::Input && which(v) && run.channel(&v.name).is_none());
        of.map(|v| format!("`{}`", v.name)).collect::<Vec<_>>().join(", ")
    };
    if names(VariableRole::Input).next().is_some() && !has(VariableRole::Input) {
        let mend = format!("record {}, or map the column in the sidecar", missing(&|_| true));
        let what = "there is no input of the model: nothing drives the simulation";
        findings.push(Finding::error(FindingKind::NoInput, &run.file, what, mend));
    } else {
        // What the surroundings do is 0 where it is not recorded, or an effect that is to be found. A drive is neither: all that
        // it does would be attributed to something else.
        for (severity, drives) in [(Severity::Grave, true), (Severity::Note, false)] {
            let missing = missing(&|v| v.drives == drives);
            if !missing.is_empty() {
                let what = format!("{missing} not recorded: the simulation takes 0");
                let finding =
                    Finding::note(FindingKind::MissingInput, &run.file, what, "record it if it was not 0");
                findings.push(Finding { severity, ..finding });
            }
        }
    }
    // An input goes on with its last value where it ends early.
    for channel in run.channels.iter().filter(|c| role(known, &c.name) == Some(VariableRole::Input)) {
        let (Some(first), Some(last)) = (channel.time.first(), channel.time.last()) else { continue };
        let gap = (first - run.start).max(run.end - last);
        if gap > 0.01 * run.duration() && gap > 5.0 * channel.median_step().unwrap_or(0.0) {
            let what = format!(
                "samples reach from {first} s to {last} s, the recording from {} s to {} s",
                run.start, run.end
            );
            let mend = "cut the recording to where the input is known";
            findings.push(
                Finding::warning(FindingKind::InputShort, &run.file, what, mend).channel(&channel.name),
            );
        }
    }
}

/// A time that is hardly in s.
fn clock(run: &Recording, findings: &mut Vec<Finding>) {
    let rows = run.channels.iter().map(Channel::len).max().unwrap_or(0);
    if rows < 20 {
        let mend = "record at least some hundred samples over the motion of interest";
        let what = format!("{rows} sample{} are too few to fit or compare", if rows == 1 { "" } else { "s" });
        let finding = Finding::warning(FindingKind::TooShort, &run.file, what, mend);
        // A parabola goes through three: nothing is left to compare.
        let severity = if rows < 3 { Severity::Error } else { Severity::Warning };
        findings.push(Finding { severity, ..finding });
        return;
    }
    let step = run.duration() / (rows - 1) as f64;
    let (wrong, unit) = match step {
        s if s >= 1000.0 => (true, "us"),
        s if s >= 1.0 => (true, "ms"),
        s if s < 1e-6 => (true, "min or h"),
        _ => (false, ""),
    };
    if wrong {
        let what = format!(
            "a sample every {} s over {} s: the time is hardly in s",
            short(step),
            short(run.duration())
        );
        let mend = format!(
            "if it is in {unit}, write under [columns] of case.toml: time = {{ variable = \"time\", unit = \"{}\" }}",
            unit.split(' ').next().unwrap_or("")
        );
        let finding = Finding::warning(FindingKind::TimeUnit, &run.file, what, mend);
        findings.push(Finding { severity: Severity::Grave, ..finding });
    }
}
