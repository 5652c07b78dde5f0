//! Recordings of a case against each other.

use crate::case::Loaded;
use crate::finding::{Finding, FindingKind};
use crate::names::short;
use crate::noise;
use crate::recording::{Channel, Recording};
use crate::variable::{SignalVariable, VariableRole, role};

pub(super) fn check(loaded: &Loaded, known: &[SignalVariable], findings: &mut Vec<Finding>) {
    let case = &loaded.case;
    // The same run under two names.
    let runs: Vec<_> = loaded.recordings.values().collect();
    for (i, a) in runs.iter().enumerate() {
        for b in &runs[..i] {
            let same = !a.channels.is_empty() && a.channels == b.channels;
            if !same {
                continue;
            }
            let apart = case.holdout.contains(&a.name) != case.holdout.contains(&b.name);
            let what = format!("it holds the same samples as {}", b.name);
            findings.push(if apart {
                let mend = "hold out a run of its own: figures on what was fitted are no test";
                Finding::error(FindingKind::HoldoutInTrain, &a.file, what, mend)
            } else {
                Finding::warning(
                    FindingKind::SameRecording,
                    &a.file,
                    what,
                    "name it once: it would count twice",
                )
            });
        }
    }
    for group in loaded.repeats() {
        if let Some((first, others)) = group.split_first() {
            others.iter().for_each(|run| findings.extend(repeats(first, run, known)));
            findings.extend(first.channels.iter().filter_map(|c| drifts(loaded, c, known)));
        }
    }
    for run in loaded.rest() {
        findings.extend(run.channels.iter().filter_map(|c| moving(run, c)));
    }
    findings.extend(excitation(loaded, known));
    findings.extend(still(loaded, known));
    let noisy = !case.repeats.is_empty() || !case.rest.is_empty();
    if let (false, Some(run)) = (noisy, loaded.train().first()) {
        for c in &run.channels {
            let compared = known.is_empty() || role(known, &c.name) == Some(VariableRole::Output);
            if compared && c.sensor.deviation().is_none() {
                let mend = format!(
                    "declare `noise` or `resolution` under [channels.\"{}\"], or `repeats` or `rest` recordings",
                    c.name
                );
                let what = "the noise of this sensor is not given: there is no noise floor to compare with";
                findings
                    .push(Finding::warning(FindingKind::NoNoise, &case.file, what, mend).channel(&c.name));
            }
        }
    }
}

/// Two runs of the same command have the same inputs.
fn repeats(a: &Recording, b: &Recording, known: &[SignalVariable]) -> Option<Finding> {
    let mend = "take it out of `repeats`: what differs would count as noise";
    if (a.duration() - b.duration()).abs() > 0.02 * a.duration() {
        let what = format!("it lasts {} s, {} that it repeats {} s", b.duration(), a.name, a.duration());
        return Some(Finding::warning(FindingKind::RepeatDiffers, &b.file, what, mend));
    }
    let inputs = a.channels.iter().filter(|c| role(known, &c.name) == Some(VariableRole::Input));
    inputs.filter_map(|c| Some((c, b.channel(&c.name)?))).find_map(|(c, d)| {
        let shifted: Vec<f64> = c.time.iter().map(|t| t - a.start + b.start).collect();
        let other = d.sample(&shifted);
        let rms = |x: &mut dyn Iterator<Item = f64>| (x.map(|x| x * x).sum::<f64>() / c.len() as f64).sqrt();
        let apart = rms(&mut c.values.iter().zip(&other).map(|(x, y)| x - y));
        let size = rms(&mut c.values.iter().copied());
        (apart > 0.3 * size).then(|| {
            let what =
                format!("its input differs from that of {} by {:.0} % (RMS)", a.name, 100.0 * apart / size);
            Finding::warning(FindingKind::RepeatDiffers, &b.file, what, mend).channel(&c.name)
        })
    })
}

/// The difference between repeats of one command in addition to their noise, where it exceeds the noise.
fn drifts(loaded: &Loaded, c: &Channel, known: &[SignalVariable]) -> Option<Finding> {
    let floor =
        noise::floor(loaded, &c.name).filter(|_| role(known, &c.name) == Some(VariableRole::Output))?;
    (floor.drift > floor.deviation).then(|| {
        let what = format!(
            "between its repeats it changes by {} (RMS) as smoothly as a motion does, with a noise of {}: this is no noise and none \
             of it counts as noise",
            short(floor.drift),
            short(floor.deviation)
        );
        let mend = "if their inputs are alike, look for what warms up, wears or slips from run to run";
        Finding::note(FindingKind::RepeatDiffers, &loaded.case.file, what, mend).channel(&c.name)
    })
}

/// At rest nothing goes anywhere: halves of the recording have one mean.
fn moving(run: &Recording, c: &Channel) -> Option<Finding> {
    let n = c.len() / 2;
    if n < 10 {
        return None;
    }
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let change = mean(&c.values[n..]) - mean(&c.values[..n]);
    // Noise by first differences: a motion adds little to it.
    let noise = (c.values.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum::<f64>() / (4 * n) as f64).sqrt();
    let least = noise.max(c.sensor.deviation().unwrap_or(0.0)).max(c.sensor.resolution.unwrap_or(0.0));
    (change.abs() > 5.0 * least && change != 0.0).then(|| {
        let what = format!("the mean moves by {} although the recording is declared at rest", short(change));
        Finding::warning(FindingKind::NotAtRest, &run.file, what, "take it out of `rest`").channel(&c.name)
    })
}

/// No output of any recording that is to be fitted leaves its first value.
fn still(loaded: &Loaded, known: &[SignalVariable]) -> Option<Finding> {
    let train = loaded.train();
    let moves = |c: &Channel| c.range().is_some_and(|(low, high)| low < high);
    let all = train.iter().flat_map(|r| &r.channels);
    let mut outputs = all.filter(|c| role(known, &c.name) == Some(VariableRole::Output)).peekable();
    outputs.peek()?;
    (!outputs.any(moves)).then(|| {
        let what = "no output moves in any recording of `train`: nothing can be fitted or compared";
        let mend = "record a motion, with the motors driven, and name it in `train`";
        Finding::error(FindingKind::LittleExcitation, &loaded.case.file, what, mend)
    })
}

/// A motion below so many times the error of its sensor, root mean square, contains little on any parameter.
const STILL: f64 = 3.0;

/// Outputs that hardly leave the noise in any recording that is to be fitted.
fn excitation(loaded: &Loaded, known: &[SignalVariable]) -> Vec<Finding> {
    let train = loaded.train();
    let Some(first) = train.first() else { return Vec::new() };
    let outputs = first.channels.iter().filter(|c| role(known, &c.name) == Some(VariableRole::Output));
    outputs
        .filter_map(|c| {
            let error = c.sensor.deviation().filter(|e| *e > 0.0)?;
            let moves = |c: &Channel| {
                let n = c.len().max(1) as f64;
                let mean = c.values.iter().sum::<f64>() / n;
                (c.values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt()
            };
            let most = train.iter().filter_map(|r| r.channel(&c.name)).map(moves).fold(0.0, f64::max);
            // Constant channels were reported already.
            (most > 0.0 && most < STILL * error).then(|| {
                let what = format!(
                    "it moves by {} (RMS) at most in all of `train`, a reading errs by {}: too little to estimate parameters",
                    short(most),
                    short(error)
                );
                let mend = "record larger or longer motions, or correct `noise` and `resolution`";
                Finding::warning(FindingKind::LittleExcitation, &loaded.case.file, what, mend).channel(&c.name)
            })
        })
        .collect()
}
