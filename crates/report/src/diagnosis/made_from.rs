//! What a page shows of the case that it was made from.

use std::collections::BTreeMap;

use trueup_diagnosis::diagnose::Diagnosed;
use trueup_diagnosis::picture::Picture;
use trueup_identification::intake::left_out;
use trueup_identification::model::SimulatedPlant;
use trueup_signals::{Case, Interpolation, Loaded, Recording, VariableRole, base_name};

use super::evidence::{Evidence, EvidenceMap, EvidenceTrace, IntakeEvidence, RecordingEvidence};
use super::replay;
use crate::number::number;

/// How a diagnosis was run, for its page.
#[derive(Clone, Debug, Default)]
pub struct DiagnosisRun<'a> {
    /// For everything that was drawn.
    pub seed: u64,
    /// The command; empty: there was none.
    pub command: String,
    /// FMUs that are written as well.
    pub fmus: &'a [String],
}

/// The page of a diagnosis; `beside`: files that are written with it.
pub(super) fn page(
    loaded: &Loaded,
    found: &Diagnosed,
    picture: &Picture,
    beside: Vec<String>,
    run: &DiagnosisRun<'_>,
) -> String {
    let case = loaded.case.name();
    let channels = loaded.recordings.values().flat_map(|r| &r.channels);
    let units: BTreeMap<&str, &str> = channels.map(|c| (c.name.as_str(), c.unit.as_str())).collect();
    let unit = |channel: &str| units.get(channel).copied().unwrap_or("");
    let traces = found.traces.iter().map(|t| EvidenceTrace::of(t, unit(&t.channel)));
    let twists = found.twists.iter().map(|t| EvidenceTrace::of(t, "rad"));
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
        scene: super::motion::scene(loaded, found),
        case: &case,
        traces: traces.collect(),
        twists: twists.collect(),
        replay: replay::options(loaded, found),
        floors: floors.collect(),
        next: next.collect(),
        maps: EvidenceMap::of(picture),
        intake: intake(loaded, &run.command),
        files: beside,
        settings: vec![["seed".into(), run.seed.to_string()]],
        versions: vec![["trueup".into(), env!("CARGO_PKG_VERSION").into()]],
    };
    super::diagnosis_page(&found.diagnosis, &evidence)
}

fn intake(loaded: &Loaded, command: &str) -> IntakeEvidence {
    let case = &loaded.case;
    let recorded = |name: &str| Some(card(case, name, loaded.recordings.get(name)?));
    let recordings = case.recordings().into_iter().filter_map(recorded).collect();
    let model = SimulatedPlant::of_case(case, &[]).ok();
    let assumptions = model.as_ref().map_or_else(Vec::new, |m| assumptions(loaded, m));
    let channels = channels(loaded, model.as_ref());
    IntakeEvidence { recordings, channels, assumptions, command: command.to_owned() }
}

fn card(case: &Case, name: &str, r: &Recording) -> RecordingEvidence {
    let holds = |list: &[String]| list.iter().any(|n| n == name);
    let roles = [
        (holds(&case.train), "fitting"),
        (holds(&case.holdout), "the figures (held out)"),
        (holds(&case.rest), "noise, at rest"),
        (case.repeats.iter().any(|group| holds(group)), "noise, repeated"),
    ];
    let role: Vec<&str> = roles.iter().filter(|r| r.0).map(|r| r.1).collect();
    let longest = r.channels.iter().max_by_key(|c| c.time.len());
    let (duration, rate) = longest.map_or_else(Default::default, |c| (length(&c.time), rate(&c.time)));
    let channels = r.channels.len();
    RecordingEvidence { name: name.to_owned(), role: role.join(", "), duration, rate, channels }
}

fn length(t: &[f64]) -> String {
    let (first, last) = (t.first().copied().unwrap_or(0.0), t.last().copied().unwrap_or(0.0));
    format!("{} s", number(last - first))
}

/// `4000 at 200 Hz`; of uneven steps what most of them have.
fn rate(t: &[f64]) -> String {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    let (Some(least), Some(most)) = (steps.first(), steps.last()) else { return t.len().to_string() };
    let middle = steps[steps.len() / 2];
    let uneven = if most - least > 0.01 * middle { ", uneven" } else { "" };
    format!("{} at {} Hz{uneven}", t.len(), number(1.0 / middle))
}

/// Channels of all recordings, each once.
fn channels(loaded: &Loaded, model: Option<&SimulatedPlant>) -> Vec<[String; 4]> {
    let variables = model.map(SimulatedPlant::variables).unwrap_or_default();
    let mut all: BTreeMap<&str, [String; 4]> = BTreeMap::new();
    for c in loaded.recordings.values().flat_map(|r| &r.channels) {
        let role =
            variables.iter().find(|v| v.name == c.name || base_name(&v.name) == c.name).map(|v| v.role);
        let what = match role {
            Some(VariableRole::Input) => "input: drives the simulation",
            Some(VariableRole::Output) => "output: is compared",
            _ => "not used",
        };
        let s = &c.sensor;
        let of = |name: &str, value: Option<f64>, unit: &str| {
            value.filter(|v| *v != 0.0).map(|v| format!("{name} {} {unit}", number(v)).trim_end().to_owned())
        };
        let known = [
            of("noise", s.noise, &c.unit),
            of("resolution", s.resolution, &c.unit),
            of("delay", Some(s.delay), "s"),
            s.offset.map(|_| "offset estimated".to_owned()),
            s.gain.map(|_| "gain estimated".to_owned()),
        ];
        let known: Vec<String> = known.into_iter().flatten().collect();
        let known = if known.is_empty() { "nothing declared".to_owned() } else { known.join(", ") };
        all.insert(&c.name, [c.name.clone(), c.unit.clone(), what.to_owned(), known]);
    }
    all.into_values().collect()
}

/// What the case does not give, and what was assumed instead.
fn assumptions(loaded: &Loaded, model: &SimulatedPlant) -> Vec<String> {
    let case = &loaded.case;
    let variables = model.variables();
    let left_out = left_out(model, case);
    let mut all = Vec::new();
    if !left_out.is_empty() {
        all.push(format!(
            "Not in [parameters], so as the model has them by default: {}.",
            left_out.join(", ")
        ));
    }
    let is_parameter = |name: &str| model.parameters().iter().any(|q| base_name(&q.name) == base_name(name));
    let known: Vec<&str> = case
        .parameters
        .keys()
        .map(String::as_str)
        .filter(|p| case.doubt(p).is_none() && is_parameter(p))
        .collect();
    if !known.is_empty() {
        all.push(format!(
            "Without an entry in [uncertain], so assumed known and refitted with a narrow prior: {}.",
            known.join(", ")
        ));
    }
    let drives = loaded.recordings.values().flat_map(|r| &r.channels);
    let mut drives: Vec<_> = drives
        .filter(|c| variables.iter().any(|v| v.role == VariableRole::Input && v.name == c.name))
        .map(|c| (c.name.as_str(), c.interpolation))
        .collect();
    drives.sort_by_key(|d| d.0);
    drives.dedup_by_key(|d| d.0);
    let of = |wanted: Interpolation| {
        let names = drives.iter().filter(|d| d.1 == wanted).map(|d| d.0);
        names.collect::<Vec<_>>().join(", ")
    };
    for (names, how) in [
        (of(Interpolation::Linear), "Straight lines between samples of"),
        (of(Interpolation::Hold), "Held until the next sample:"),
    ] {
        if !names.is_empty() {
            all.push(format!("{how} {names}."));
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_of_most_steps_and_say_where_they_differ() {
        assert_eq!(rate(&[0.0, 0.5, 1.0]), "3 at 2 Hz");
        assert_eq!(rate(&[0.0, 0.5, 1.0, 2.0]), "4 at 2 Hz, uneven");
        assert_eq!(rate(&[0.0]), "1");
    }
}
