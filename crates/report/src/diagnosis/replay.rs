//! The first recording of a page as inputs of a simulation: under the model's names, in its units, whatever its file has.

use trueup_diagnosis::diagnose::Diagnosed;
use trueup_identification::model::SimulatedPlant;
use trueup_signals::{Channel, Loaded, Recording, VariableRole};

/// Name of the file next to the page.
pub(super) const FILE: &str = "replay.csv";

/// The inputs as a file; `None`: nothing was compared, or no input was recorded.
pub(super) fn csv(loaded: &Loaded, found: &Diagnosed) -> Option<Result<Vec<u8>, std::io::Error>> {
    let inputs = Recording { channels: inputs(loaded, found)?, ..Recording::default() };
    let mut out = Vec::new();
    Some(inputs.to_csv(&mut out).map(|()| out))
}

/// Options of `trueup simulate` that play it with the augmented model: times and first states.
pub(super) fn options(loaded: &Loaded, found: &Diagnosed) -> Option<Vec<String>> {
    let inputs = inputs(loaded, found)?;
    let recording = &found.traces.first()?.recording;
    let own = found.traces.iter().filter(|t| t.recording == *recording);
    let [first, last] = [f64::min, f64::max]
        .map(|of| own.clone().filter_map(ends).reduce(|a, b| [of(a[0], b[0]), of(a[1], b[1])]));
    let drives = inputs.iter().filter_map(|c| Some([*c.time.first()?, *c.time.last()?]));
    // No input goes on beyond its last sample, none begins before its first one.
    let start: f64 = drives.clone().fold(first?[0], |t, d| t.max(d[0]));
    let stop: f64 = drives.fold(last?[1], |t, d| t.min(d[1]));
    let mut all = vec!["--input".to_owned(), FILE.to_owned()];
    if start != 0.0 {
        all.push(format!("--start={start}"));
    }
    all.extend(["--stop".to_owned(), format!("{}", (1e3 * stop).floor() / 1e3)]);
    for (name, value) in found.began.iter().filter(|b| b.recording == *recording).flat_map(|b| &b.states) {
        all.extend(["--set".to_owned(), format!("{name}={value:?}")]);
    }
    Some(all)
}

fn ends(trace: &trueup_diagnosis::diagnose::ChannelTrace) -> Option<[f64; 2]> {
    Some([*trace.time.first()?, *trace.time.last()?])
}

/// The recorded inputs of the first recording that is shown.
fn inputs(loaded: &Loaded, found: &Diagnosed) -> Option<Vec<Channel>> {
    let recording = loaded.recordings.get(&found.traces.first()?.recording)?;
    let variables = SimulatedPlant::of_case(&loaded.case, &[]).ok()?.variables();
    let input = |c: &&Channel| variables.iter().any(|v| v.role == VariableRole::Input && v.name == c.name);
    let as_applied = |c: &Channel| {
        let mut own = Channel::new(&c.name, &c.unit, c.time.clone(), c.believed());
        own.interpolation = c.interpolation;
        own
    };
    let inputs: Vec<Channel> = recording.channels.iter().filter(input).map(as_applied).collect();
    (!inputs.is_empty()).then_some(inputs)
}
