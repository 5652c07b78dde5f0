//! When: from where to where, in which steps.

use trueup_numerics::ShortNumber;

use super::parts::CheckedParts;
use super::report::Report;
use crate::grid::CommunicationGrid;
use crate::inputs::InputFileTable;
use crate::step_rule::{internal_step, refusal};
use crate::system::{ComponentInterface, CosimSystem, SourceSpan};

/// Two times are the same within this part of a step.
const ROUNDING: f64 = 1e-9;

/// The communication points, and how many of their steps each component takes at once.
pub(super) fn grid(
    system: &CosimSystem,
    parts: &CheckedParts,
    inputs: Option<&InputFileTable>,
    report: &mut Report,
) -> (Option<CommunicationGrid>, Vec<u32>) {
    let loaded = || parts.list.iter().zip(&system.components).filter_map(|(p, c)| p.as_ref().map(|p| (p, c)));
    let said = || loaded().map(|(p, c)| (p.d().experiment, c));
    let run = &system.run;
    let whole = SourceSpan { file: system.file.clone(), line: 0 };
    let place = if run.place.file.as_os_str().is_empty() { &whole } else { &run.place };
    let default = |what: &str, name: &str, value: f64, report: &mut Report| {
        let of = if name.is_empty() { String::new() } else { format!(" of `{name}`") };
        report.note(format!("{what} {} s: from the default experiment{of}", ShortNumber(value)));
        value
    };
    let start = run.start.unwrap_or_else(|| {
        match said().find_map(|(e, c)| e.start_time.filter(|t| *t != 0.0).map(|t| (t, c))) {
            Some((t, c)) => default("start", &c.name, t, report),
            None => 0.0,
        }
    });
    let latest = said().filter_map(|(e, c)| e.stop_time.map(|t| (t, c))).max_by(|a, b| a.0.total_cmp(&b.0));
    let end = inputs.map(|i| i.end);
    let stop = run.stop.unwrap_or_else(|| match (latest, end) {
        (Some((t, c)), _) => default("stop", &c.name, t, report),
        (None, Some(t)) => {
            report.note(format!("stop {} s: the end of the inputs", ShortNumber(t)));
            t
        }
        (None, None) => {
            report.note(format!("stop {} s: no stop time is given", ShortNumber(start + 1.0)));
            start + 1.0
        }
    });
    let step = run.step.unwrap_or_else(|| step(system, parts, start, stop, report));
    let mut every = vec![1; parts.list.len()];
    if let Some(tolerance) = run.tolerance.filter(|t| !(*t > 0.0 && *t < 1.0)) {
        report.wrong(
            place,
            format!("the tolerance {tolerance:?} is none; write a number between 0 and 1, as in 1e-6"),
        );
    }
    let Some(grid) =
        CommunicationGrid::new(start, stop, step).filter(|_| stop > start || run.stop == Some(start))
    else {
        report.wrong(place, CommunicationGrid::refusal(start, stop, step));
        return (None, every);
    };
    for (at, (part, component)) in parts.list.iter().zip(&system.components).enumerate() {
        let Some(part) = part else { continue };
        if let Some(own) = component.step {
            let n = (own / step).round();
            if !(n >= 1.0 && n <= f64::from(u32::MAX) && (own / step - n).abs() <= ROUNDING * n) {
                report.wrong(&component.place, format!(
                    "the step {own:?} s of `{}` is no whole multiple of the communication step {step:?} s",
                    component.name
                ));
                continue;
            }
            every[at] = n as u32;
        }
        let stepped = part.interface == ComponentInterface::CoSimulation;
        let offered = part.d().co_simulation.as_ref().filter(|_| stepped);
        if let Some(why) = offered.and_then(|i| refusal(i, step * f64::from(every[at]), stop - start)) {
            let name = if component.name.is_empty() {
                "the FMU".to_owned()
            } else {
                format!("the FMU of `{}`", component.name)
            };
            report.wrong(&component.place, format!("{name} {why}"));
        }
    }
    (Some(grid), every)
}

/// The smallest that anybody names; else a 500th of the run.
fn step(system: &CosimSystem, parts: &CheckedParts, start: f64, stop: f64, report: &mut Report) -> f64 {
    let loaded = parts.list.iter().zip(&system.components).filter_map(|(p, c)| p.as_ref().map(|p| (p, c)));
    let wanted = loaded.filter_map(|(part, c)| {
        let stepped = part.interface == ComponentInterface::CoSimulation;
        let fixed = part.d().co_simulation.as_ref().filter(|_| stepped).and_then(internal_step);
        let default = part.d().experiment.step_size.filter(|h| *h > 0.0);
        let h = c.step.or(match (default, fixed) {
            (Some(d), Some(h)) => Some(h * (d / h).round().max(1.0)),
            (default, fixed) => {
                default.or_else(|| fixed.map(|h| h * ((stop - start) / 500.0 / h).round().max(1.0)))
            }
        })?;
        Some((h, c))
    });
    match wanted.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((h, c)) => {
            let of = if c.name.is_empty() { "of the FMU".to_owned() } else { format!("of `{}`", c.name) };
            report.note(format!("communication step {} s: that {of}, the smallest", ShortNumber(h)));
            h
        }
        None => {
            let h = (stop - start).max(f64::MIN_POSITIVE) / 500.0;
            report.note(format!(
                "communication step {} s: a 500th of the run, since no FMU names one",
                ShortNumber(h)
            ));
            h
        }
    }
}
