//! What a case shows before any fit: its recordings and their sensors, mistakes, and what can be determined.

mod timing;

use serde::Serialize;
use trueup_identification::identify::{ForeseenParameter, ForeseenParameters, foreseen};
use trueup_plant::{CoordinateKind, Plant};
use trueup_signals::{Channel, ChannelFigures, Finding, Interpolation, Loaded, Recording};

use crate::diagnose::input_scale::{self, InputGain};
use crate::engine::recordings::PreparedCase;
use crate::engine::search::CaseSearch;
use crate::engine::subject::DiagnosisSubject;
use crate::outcome::{NoticedMistake, OutcomeSeverity, SensorFindings};
use crate::picture::isolability;
use crate::thinned::thinned;
use timing::InputCentre;

/// Form and version of its JSON.
const SCHEMA: &str = "trueup.check/1";
/// s that the simulations for the expected errors may take.
const SECONDS: f64 = 1.0;
/// A declared noise that differs by more than this factor from the one that is found is reported.
const NOISE: f64 = 2.0;
/// A motion with fewer reversals in all recordings for fitting separates friction and play badly from other effects.
const REVERSALS: usize = 4;

/// A channel of a recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckedChannel {
    /// Its variable.
    pub name: String,
    /// Unit of the figures.
    pub unit: String,
    /// It drives the simulation.
    pub input: bool,
    /// Number of readings.
    pub readings: usize,
    /// Hz, by the median step; 0: one reading.
    pub rate: f64,
    /// Longest time from one reading to the next, s.
    pub longest_step: f64,
    /// Least and largest value.
    pub range: [f64; 2],
    /// How often the motion turns back.
    pub reversals: usize,
    /// Standard deviation of white noise as declared.
    pub noise_declared: Option<f64>,
    /// The same as the readings show it.
    pub noise: Option<f64>,
    /// Step of the readings as declared.
    pub resolution_declared: Option<f64>,
    /// The same as the readings show it.
    pub resolution: Option<f64>,
    /// How an input goes between its samples, as declared.
    pub interpolation: Option<&'static str>,
}

/// A recording.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckedRecording {
    /// As the case names it.
    pub name: String,
    /// `train`, `holdout`, `rest` or `repeats`.
    pub purpose: &'static str,
    /// First time, s.
    pub start: f64,
    /// Length, s.
    pub seconds: f64,
    /// Its channels.
    pub channels: Vec<CheckedChannel>,
}

/// A parameter that `identify` would estimate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CheckedParameter {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Its nominal value.
    pub value: f64,
    /// Expected standard error; `None`: these recordings do not give it.
    pub standard_error: Option<f64>,
}

/// All of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CaseCheck {
    /// Form and version.
    pub schema: &'static str,
    /// The model.
    pub model: String,
    /// What is wrong, the worst first.
    pub findings: Vec<NoticedMistake>,
    /// The recordings.
    pub recordings: Vec<CheckedRecording>,
    /// By how many times each recorded input the nominal model needs it, recording by recording.
    pub gains: Vec<InputGain>,
    /// Which components these sensors distinguish, by the structure of the equations.
    pub sensors: SensorFindings,
    /// Expected standard errors at the nominal values.
    pub parameters: Vec<CheckedParameter>,
    /// What these are of, or why there are none.
    pub parameters_note: String,
    /// Lines of TOML for `case.toml`: of each channel the header of its table, then its keys.
    pub proposals: Vec<String>,
}

impl CaseCheck {
    /// One of its findings is grave: a diagnosis concludes nothing from the case.
    pub fn is_grave(&self) -> bool {
        self.findings.iter().any(|f| f.severity == OutcomeSeverity::Grave)
    }
}

/// Checks a case that was taken in; `noticed` is what the intake found, errors among it.
pub fn check(loaded: &Loaded, noticed: &[Finding]) -> CaseCheck {
    let mut findings = NoticedMistake::of(noticed, &loaded.case.folder);
    let mut own = CaseCheck {
        schema: SCHEMA,
        model: loaded.case.model.clone(),
        findings: Vec::new(),
        recordings: Vec::new(),
        gains: Vec::new(),
        sensors: SensorFindings::default(),
        parameters: Vec::new(),
        parameters_note: String::new(),
        proposals: Vec::new(),
    };
    let subject = DiagnosisSubject::of(&loaded.case);
    let inputs = subject.as_ref().map(DiagnosisSubject::inputs).unwrap_or_default();
    own.recordings = recordings(loaded, &inputs);
    let mut proposed = sensors(&own.recordings);
    if let Ok(subject) = &subject {
        own.sensors = (&isolability(loaded, subject)).into();
        proposed.extend(interpolation(loaded, subject));
    }
    own.proposals = tables(&proposed);
    findings.extend(reversals(&own.recordings, &loaded.case.file));
    // Errors come first: figures of wrong readings would be wrong.
    if noticed.iter().any(Finding::is_error) {
        own.parameters_note = "not computed: the errors come first".into();
    } else {
        let (mistaken, gains) = scaled(loaded);
        findings.extend(mistaken);
        own.gains = gains;
        match foreseen(loaded, SECONDS) {
            Ok(found) => (own.parameters, own.parameters_note) = expected_errors(found),
            Err(e) => own.parameters_note = format!("not computed: {e}"),
        }
    }
    findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    own.findings = findings;
    own
}

fn recordings(loaded: &Loaded, inputs: &[String]) -> Vec<CheckedRecording> {
    let case = &loaded.case;
    let purpose = |name: &String| match () {
        () if case.train.contains(name) => "train",
        () if case.holdout.contains(name) => "holdout",
        () if case.rest.contains(name) => "rest",
        () => "repeats",
    };
    let of = |(name, run): (&String, &Recording)| CheckedRecording {
        name: name.clone(),
        purpose: purpose(name),
        start: run.start,
        seconds: run.duration(),
        channels: run.channels.iter().filter_map(|c| channel(c, inputs.contains(&c.name))).collect(),
    };
    loaded.recordings.iter().map(of).collect()
}

fn channel(c: &Channel, input: bool) -> Option<CheckedChannel> {
    let figures = ChannelFigures::of(c)?;
    let interpolation = match c.interpolation {
        Interpolation::Linear => "linear",
        Interpolation::Hold => "hold",
    };
    Some(CheckedChannel {
        name: c.name.clone(),
        unit: c.unit.clone(),
        input,
        readings: figures.readings,
        rate: figures.rate,
        longest_step: figures.longest_step,
        range: figures.range,
        reversals: figures.reversals,
        noise_declared: c.sensor.noise,
        noise: figures.noise,
        resolution_declared: c.sensor.resolution,
        resolution: figures.resolution,
        interpolation: input.then_some(interpolation),
    })
}

/// A key of a channel with its value, as a line under `[channels.NAME]`.
struct ProposedLine {
    channel: String,
    line: String,
}

/// The lines of each channel under its header.
fn tables(proposed: &[ProposedLine]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for (k, first) in proposed.iter().enumerate() {
        let same = |p: &&ProposedLine| p.channel == first.channel;
        if !proposed[..k].iter().any(|p| same(&p)) {
            lines.push(format!("[channels.\"{}\"]", first.channel));
            lines.extend(proposed.iter().filter(same).map(|p| p.line.clone()));
        }
    }
    lines
}

/// Of sensors whose readings show another noise or step than is declared.
fn sensors(recordings: &[CheckedRecording]) -> Vec<ProposedLine> {
    let mut names: Vec<&str> = Vec::new();
    let all = || recordings.iter().flat_map(|r| &r.channels);
    all().filter(|c| !c.input).for_each(|c| {
        if !names.contains(&c.name.as_str()) {
            names.push(&c.name);
        }
    });
    let mut lines = Vec::new();
    for name in names {
        let mut propose = |line| lines.push(ProposedLine { channel: name.to_owned(), line });
        let own = || all().filter(|c| c.name == name);
        let declared = own().find_map(|c| c.noise_declared);
        // The largest: no recording may be noisier than is declared.
        if let Some(found) = own().filter_map(|c| c.noise).reduce(f64::max)
            && declared.is_none_or(|d| found > NOISE * d || found < d / NOISE)
        {
            let than = declared.map_or("not declared".to_owned(), |d| format!("declared: {d:.3e}"));
            propose(format!("noise = {found:.3e}   # {than}"));
        }
        if let (Some(found), None) =
            (own().filter_map(|c| c.resolution).reduce(f64::min), own().find_map(|c| c.resolution_declared))
        {
            propose(format!("resolution = {found:.6e}   # not declared"));
        }
    }
    lines
}

/// Inputs that drive motors, each with the outputs that show the motor's position, and the position of what follows it.
fn driven_angles(plant: &dyn Plant) -> Vec<(String, Vec<String>)> {
    let (table, coordinates) = (plant.table(), plant.coordinates());
    let motors = (0..coordinates.len()).filter(|k| coordinates[*k].kind == CoordinateKind::Motor);
    let output = |k: usize| table.outputs[coordinates[k].position_output].name.clone();
    let behind = |motor: usize| {
        let follows = move |k: &usize| coordinates[*k].follows.is_some_and(|f| f.coordinate == motor);
        (0..coordinates.len()).filter(follows)
    };
    let of = |(input, motor): (&usize, usize)| {
        let angles = std::iter::once(motor).chain(behind(motor)).map(output).collect();
        (table.inputs[*input].name.clone(), angles)
    };
    table.driving.iter().zip(motors).map(of).collect()
}

/// The likelier of hold and linear, where a recording contradicts what is declared.
fn interpolation(loaded: &Loaded, subject: &DiagnosisSubject) -> Vec<ProposedLine> {
    let mut lines: Vec<ProposedLine> = Vec::new();
    let Ok(model) = subject.model::<&str>(&[]) else { return lines };
    let driven = driven_angles(model.plant());
    for run in loaded.train() {
        for input in &run.channels {
            let Some((_, angles)) = driven.iter().find(|d| d.0 == input.name) else { continue };
            let Some(centre) = angles.iter().find_map(|angle| InputCentre::of(run, &input.name, angle))
            else {
                continue;
            };
            if let Some(proposed) = centre.proposes(input.interpolation) {
                let word = if proposed == Interpolation::Hold { "hold" } else { "linear" };
                let begin = format!("interpolation = \"{word}\"");
                if !lines.iter().any(|l| l.channel == input.name && l.line.starts_with(&begin)) {
                    let line = format!(
                        "{begin}   # it acts {:.2} +- {:.2} of a step after its samples in {} (hold 0.5, linear 0)",
                        -centre.value, centre.deviation, run.name
                    );
                    lines.push(ProposedLine { channel: input.name.clone(), line });
                }
            }
        }
    }
    lines
}

/// An angle or a way that the model shows: velocities turn back where nothing does.
fn moves(c: &CheckedChannel) -> bool {
    !c.input && matches!(c.unit.as_str(), "rad" | "m")
}

/// Recordings for fitting that hardly turn back.
fn reversals(recordings: &[CheckedRecording], case: &std::path::Path) -> Option<NoticedMistake> {
    let train =
        || recordings.iter().filter(|r| r.purpose == "train").flat_map(|r| &r.channels).filter(|c| moves(c));
    let turns = |name: &str| train().filter(|c| c.name == name).map(|c| c.reversals).sum::<usize>();
    let most = train().map(|c| turns(&c.name)).max()?;
    (most < REVERSALS).then(|| NoticedMistake {
        severity: OutcomeSeverity::Warning,
        kind: "few-reversals".into(),
        file: case.file_name().unwrap_or_default().to_string_lossy().into_owned(),
        line: None,
        channel: None,
        text: format!(
            "in all of `train` the motion turns back {most} times: friction, play and hysteresis show where it does; record a motion that reverses"
        ),
    })
}

/// Inputs in another unit or of the opposite sign, recording by recording, and dead channels: what a diagnosis finds first; and
/// the gain of every input.
fn scaled(loaded: &Loaded) -> (Vec<NoticedMistake>, Vec<InputGain>) {
    let found = || {
        let subject = DiagnosisSubject::of(&loaded.case).ok()?;
        let (small, _) = thinned(loaded, subject.plant, &subject.inputs());
        let case = PreparedCase::new(&small).ok()?;
        let search = CaseSearch::new(&case, 1).ok()?;
        Some((input_scale::mistaken(&search), input_scale::gains(&search)))
    };
    found().unwrap_or_default()
}

fn expected_errors(found: ForeseenParameters) -> (Vec<CheckedParameter>, String) {
    let note = match found.left_out.is_empty() {
        true => format!("at the nominal values, of {}", found.recordings.join(", ")),
        false => format!(
            "at the nominal values, of {} alone: {} would take too long before a fit",
            found.recordings.join(", "),
            found.left_out.join(", ")
        ),
    };
    let one = |p: ForeseenParameter| CheckedParameter {
        name: p.name,
        unit: p.unit.to_owned(),
        value: p.value,
        standard_error: p.standard_error,
    };
    (found.parameters.into_iter().map(one).collect(), note)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[allow(clippy::unwrap_used)]
    fn proposals_are_toml_with_a_table_for_each_channel() {
        let of = |channel: &str, line: &str| ProposedLine { channel: channel.into(), line: line.into() };
        let lines = tables(&[
            of("jointAngle[1]", "noise = 1.000e-5   # not declared"),
            of("jointTorque[1]", "interpolation = \"hold\""),
            of("jointAngle[1]", "resolution = 2.000000e-5   # not declared"),
        ]);
        let text = format!("model = \"PlanarManipulator\"\ntrain = [\"a.csv\"]\n{}\n", lines.join("\n"));
        let (case, findings) =
            trueup_signals::Case::parse(std::path::Path::new("case.toml"), &text, &[]).unwrap();
        assert!(findings.is_empty(), "{findings:?}");
        let angle = &case.channels["jointAngle[1]"];
        assert_eq!((angle.noise, angle.resolution), (Some(1e-5), Some(2e-5)));
        assert_eq!(case.channels["jointTorque[1]"].interpolation, Some(Interpolation::Hold));
    }
}
