//! From names to numbers: a [`CosimSystem`] and its FMUs become a [`MasterPlan`], or a list of all mistakes.

mod driven;
mod experiment;
mod files;
mod links;
pub mod names;
mod parts;
mod record;
mod report;
mod start;
mod types;
pub(crate) mod units;

use std::sync::Arc;

pub use files::Files;

use crate::error::CosimError;
use crate::inputs::InputFileTable;
use crate::plan::{MasterPlan, PlannedComponent};
use crate::system::{CosimSystem, InputFile, RunSettings};
use parts::CheckedParts;
use report::Report;

/// Loads the FMUs of a system (each file once) and checks all of it before anything runs.
///
/// # Errors
/// [`CosimError::System`] with every mistake: description, place and remedy.
pub fn check(system: &CosimSystem) -> Result<MasterPlan, CosimError> {
    check_with(system, &mut Files::default())
}

/// The same for one of several systems of the same files, which are read once and taken to stay as they are.
///
/// # Errors
/// Those of [`check`].
pub fn check_with(system: &CosimSystem, files: &mut Files) -> Result<MasterPlan, CosimError> {
    let mut report = Report { mistakes: Vec::new(), notes: system.notes.clone() };
    let parts = CheckedParts::of(system, files, &mut report);
    let mut inputs =
        system.inputs.as_ref().and_then(|wanted| read_inputs(system, wanted, files, &mut report));
    let (grid, every) = experiment::grid(system, &parts, inputs.as_ref(), &mut report);
    let mut components = Vec::new();
    for ((part, component), every) in parts.list.iter().zip(&system.components).zip(every) {
        let Some(part) = part else { continue };
        components.push(PlannedComponent {
            name: component.name.clone(),
            fmu: Arc::clone(&part.fmu),
            interface: part.interface,
            structural: part.starts.structural.clone(),
            resized: part.starts.resized.clone(),
            start: part.starts.start.clone(),
            every,
        });
    }
    let mut driver = links::Drivers::default();
    let (links, maps) = links::links(system, &parts, &mut driver, &mut report);
    let driven = driven::driven(system, &parts, inputs.as_mut(), &mut driver, &mut report);
    if let (Some(inputs), Some(grid)) = (&inputs, &grid) {
        driven::span(inputs, grid, &mut report);
    }
    let recorded = record::recorded(system, &parts, &mut report);
    let Report { mut mistakes, notes } = report;
    let (Some(grid), []) = (grid, &mistakes[..]) else {
        mistakes.sort_by(|a, b| (&a.place.file, a.place.line).cmp(&(&b.place.file, b.place.line)));
        mistakes.dedup();
        return Err(CosimError::System(mistakes));
    };
    let RunSettings { tolerance, algorithm, event_rows, .. } = system.run;
    Ok(MasterPlan {
        components,
        links,
        driven,
        inputs,
        recorded,
        grid,
        tolerance,
        algorithm,
        event_rows,
        maps,
        notes,
    })
}

fn read_inputs(
    system: &CosimSystem,
    wanted: &InputFile,
    files: &mut Files,
    report: &mut Report,
) -> Option<InputFileTable> {
    let read = files.inputs(&wanted.file, &system.file, system.run.start);
    let inputs = read.map_err(|why| report.wrong_of(&wanted.file, &wanted.place, why)).ok()?;
    report.notes.extend(inputs.notes.iter().cloned());
    Some(inputs)
}
