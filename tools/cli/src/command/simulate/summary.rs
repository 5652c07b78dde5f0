//! In words: what would be run, what was run.

use std::cmp::Reverse;
use std::collections::HashSet;
use std::fmt::Write;

use trueup_cosim::exchange::LoopLog;
use trueup_cosim::plan::MasterPlan;
use trueup_cosim::{FmuCalls, RunLog};
use trueup_fmi_description::description::DescriptionCausality;
use trueup_numerics::ShortNumber;

/// Algebraic loops that are reported one by one.
const LOOPS: usize = 3;

/// Before: what would be run.
pub(super) fn of(plan: &MasterPlan) -> String {
    let (mut out, driven) = (String::new(), driven(plan));
    let width = plan.components.iter().map(|c| c.name.len()).max().unwrap_or(0);
    for (i, c) in plan.components.iter().enumerate() {
        let d = c.description();
        let every = if c.every > 1 { format!(", every {} steps", c.every) } else { String::new() };
        let starts = match c.start.len() + c.structural.len() {
            0 => String::new(),
            1 => ", 1 start value".into(),
            n => format!(", {n} start values"),
        };
        let (name, model, version) = (&c.name, &d.model_name, d.version.as_str());
        let gap = if width == 0 { "" } else { "  " };
        let _ = writeln!(out, "{name:width$}{gap}{model} (FMI {version}), {}{every}{starts}", c.interface);
        let inputs =
            d.variables.iter().enumerate().filter(|(_, v)| v.causality == DescriptionCausality::Input);
        let free: Vec<_> =
            inputs.filter(|(k, _)| !driven.contains(&(i, *k))).map(|(_, v)| v.name.as_str()).collect();
        if !free.is_empty() {
            let _ =
                writeln!(out, "{:width$}{gap}  inputs that keep their start values: {}", "", free.join(", "));
        }
    }
    let g = &plan.grid;
    let (links, from_file, columns) = (plan.links.len(), plan.driven.len(), plan.recorded.len());
    let _ = writeln!(out, "{links} values handed on, {from_file} driven by a file, {columns} recorded");
    let _ = writeln!(
        out,
        "from {} s to {} s in {} steps of {} s",
        ShortNumber(g.start),
        ShortNumber(g.stop),
        g.steps,
        ShortNumber(g.step)
    );
    match plan.algorithm {
        Some(algorithm) => drop(writeln!(out, "algorithm: {algorithm}")),
        None => out.push_str("algorithm: the master chooses\n"),
    }
    out
}

/// Inputs that something drives, by component and variable.
fn driven(plan: &MasterPlan) -> HashSet<(usize, usize)> {
    let to = plan.links.iter().map(|l| l.to).chain(plan.driven.iter().map(|d| d.to));
    to.map(|e| (e.component, e.variable)).collect()
}

/// Afterwards: how it was run, and what that took.
pub(super) fn log(log: &RunLog) -> String {
    let mut out = String::new();
    let ended = match &log.terminated_by {
        Some(name) if name.is_empty() => ", where the FMU ended the run".to_owned(),
        Some(name) => format!(", where `{name}` ended the run"),
        None => String::new(),
    };
    let counts = [
        (log.rejected, "rejected"),
        (log.discarded, "discarded by an FMU"),
        (log.iterations, "repeated"),
        (log.events, "events"),
    ];
    let counts = counts.iter().filter(|(n, _)| *n > 0).map(|(n, what)| format!(", {n} {what}"));
    let counts: String = counts.collect();
    let _ = writeln!(out, "{} steps{counts}, to {} s{ended}", log.steps, ShortNumber(log.time));
    let _ = writeln!(out, "algorithm {}: {}", log.algorithm, log.reason);
    calls(&mut out, &log.calls);
    if let Some(adapted) = &log.adapted {
        let (least, most) = adapted.steps;
        let _ = writeln!(
            out,
            "error of the run about {:.1e} (relative); steps of {least:.1e} to {most:.1e} s, {} taken by each FMU, {} jumps",
            adapted.error, adapted.taken, adapted.jumps
        );
    }
    for (when, all) in [("at the start", &log.initial_loops), ("while stepping", &log.loops)] {
        loops(&mut out, when, all);
    }
    out
}

/// What each FMU was given, those that were given the same on one line.
fn calls(out: &mut String, all: &[FmuCalls]) {
    let mut lines: Vec<(String, Vec<String>)> = Vec::new();
    for FmuCalls { component, calls, inputs } in all {
        let how = if inputs.is_empty() { String::new() } else { format!("; {inputs}") };
        let text = format!("{calls}{how}");
        let name = if component.is_empty() { "the FMU".to_owned() } else { format!("`{component}`") };
        match lines.iter_mut().find(|(known, _)| *known == text) {
            Some((_, names)) => names.push(name),
            None => lines.push((text, vec![name])),
        }
    }
    for (text, names) in lines {
        let _ = writeln!(out, "{}: {text}", few(&names));
    }
}

/// Those that were solved most often represent all.
fn loops(out: &mut String, when: &str, all: &[LoopLog]) {
    let mut all: Vec<&LoopLog> = all.iter().collect();
    all.sort_by_key(|l| Reverse(l.solved));
    let (shown, rest) = all.split_at(if all.len() > LOOPS + 1 { LOOPS } else { all.len() });
    for l in shown {
        let (names, solved, residual) = (few(&l.variables), l.solved, l.residual);
        let _ = writeln!(
            out,
            "algebraic loop {when}: {names}; solved {solved} times, largest residual {residual:.1e}"
        );
    }
    if !rest.is_empty() {
        let residual = rest.iter().fold(0.0, |m: f64, l| m.max(l.residual));
        let _ = writeln!(out, "... and {} more {when}, largest residual {residual:.1e}", rest.len());
    }
}

/// The first ones of a long list.
fn few(names: &[String]) -> String {
    const FEW: usize = 6;
    match names.len() {
        n if n > FEW + 1 => format!("{} and {} more", names[..FEW].join(", "), n - FEW),
        _ => names.join(", "),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_hundred_loops_are_four_lines() {
        let of = |n: u64| -> String {
            let one =
                |k| LoopLog { variables: vec![format!("a{k}.u")], solved: k, evaluations: k, residual: 1e-9 };
            let (all, mut out) = ((0..n).map(one).collect::<Vec<_>>(), String::new());
            loops(&mut out, "at the start", &all);
            out
        };
        assert_eq!(of(500).lines().count(), 4);
        assert!(of(500).starts_with("algebraic loop at the start: a499.u; solved 499 times"));
        assert!(of(500).ends_with("... and 497 more at the start, largest residual 1.0e-9\n"), "{}", of(500));
        assert_eq!((of(4).lines().count(), of(0).as_str()), (4, ""));
    }
}
