//! From names to numbers: a [`System`] and its FMUs become a [`Plan`], or a list of all mistakes.

mod driven;
mod experiment;
mod files;
mod links;
pub mod names;
mod record;
mod start;
mod types;
pub(crate) mod units;

use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use trueup_fmi_description::description::Description;
use trueup_fmi_import::Fmu;

pub use files::Files;

use crate::error::Error;
use crate::inputs::Inputs;
use crate::mistake::{Mistake, suggestion};
use crate::plan::{Plan, Planned};
use crate::system::{Component, InputFile, Interface, Place, Port, Run, System};

/// Loads the FMUs of a system (each file once) and checks all of it before anything runs.
///
/// # Errors
/// [`Error::System`] with every mistake: what it is, where it was written, and the mend.
pub fn check(system: &System) -> Result<Plan, Error> {
    check_with(system, &mut Files::default())
}

/// The same for one of several systems of the same files, which are read once and taken to stay as they are.
///
/// # Errors
/// Those of [`check`].
pub fn check_with(system: &System, files: &mut Files) -> Result<Plan, Error> {
    let mut report = Report { mistakes: Vec::new(), notes: system.notes.clone() };
    let parts = Parts::of(system, files, &mut report);
    let mut inputs =
        system.inputs.as_ref().and_then(|wanted| read_inputs(system, wanted, files, &mut report));
    let (grid, every) = experiment::grid(system, &parts, inputs.as_ref(), &mut report);
    let mut components = Vec::new();
    for ((part, component), every) in parts.list.iter().zip(&system.components).zip(every) {
        let Some(part) = part else { continue };
        components.push(Planned {
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
        return Err(Error::System(mistakes));
    };
    let Run { tolerance, algorithm, event_rows, .. } = system.run;
    Ok(Plan {
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
    system: &System,
    wanted: &InputFile,
    files: &mut Files,
    report: &mut Report,
) -> Option<Inputs> {
    let read = files.inputs(&wanted.file, &system.file, system.run.start);
    let inputs = read.map_err(|why| report.wrong_of(&wanted.file, &wanted.place, why)).ok()?;
    report.notes.extend(inputs.notes.iter().cloned());
    Some(inputs)
}

/// What is to be told.
#[derive(Default)]
struct Report {
    mistakes: Vec<Mistake>,
    notes: Vec<String>,
}

impl Report {
    fn wrong(&mut self, place: &Place, message: impl Into<String>) {
        self.mistakes.push(Mistake { place: place.clone(), message: message.into() });
    }
    /// About a component's FMU.
    fn wrong_fmu(&mut self, component: &Component, message: impl Into<String>) {
        self.wrong_of(&component.fmu, &component.place, message);
    }
    /// About a file: the message names it, the place does not name it again where that file is all there is.
    fn wrong_of(&mut self, file: &Path, place: &Place, message: impl Into<String>) {
        let alone = place.line == 0 && place.file == file;
        self.wrong(&if alone { Place::default() } else { place.clone() }, message);
    }
    fn note(&mut self, message: impl Into<String>) {
        self.notes.push(message.into());
    }
}

/// A component with its FMU.
struct Part {
    fmu: Arc<Fmu>,
    interface: Interface,
    starts: start::Starts,
}

impl Part {
    fn d(&self) -> &Description {
        self.starts.resized.as_deref().unwrap_or_else(|| self.fmu.description())
    }
}

/// The components; what could not be loaded is said once and left out.
struct Parts<'a> {
    list: Vec<Option<Part>>,
    by_name: HashMap<&'a str, usize>,
}

impl<'a> Parts<'a> {
    fn of(system: &'a System, files: &mut Files, report: &mut Report) -> Self {
        let mut by_name = HashMap::new();
        let mut list = Vec::with_capacity(system.components.len());
        for (i, component) in system.components.iter().enumerate() {
            if let Some(first) = by_name.insert(component.name.as_str(), i) {
                let first = &system.components[first].place;
                report.wrong(
                    &component.place,
                    format!("the name `{}` is taken, see {first}; choose another one", component.name),
                );
            }
            list.push(part(component, files, report));
        }
        if !system.own_processes {
            only_once(system, &list, report);
        }
        Self { list, by_name }
    }

    /// The component of a port; `None` if it is not known (which is said here) or not loaded (which was said before).
    fn find(&self, port: &Port, place: &Place, report: &mut Report) -> Option<(usize, &Part)> {
        let Some(i) = self.by_name.get(port.component.as_str()) else {
            let near = suggestion(&port.component, self.by_name.keys().copied());
            report.wrong(place, format!("`{port}`: there is no component `{}`{near}", port.component));
            return None;
        };
        self.list[*i].as_ref().map(|part| (*i, part))
    }
}

fn part(component: &Component, files: &mut Files, report: &mut Report) -> Option<Part> {
    let fmu = files.fmu(&component.fmu).map_err(|why| report.wrong_fmu(component, why)).ok()?;
    let d = fmu.description();
    let offered = |interface| match interface {
        Interface::CoSimulation => d.co_simulation.is_some(),
        Interface::ModelExchange => d.model_exchange.is_some(),
    };
    let both = [Interface::CoSimulation, Interface::ModelExchange];
    let file = component.fmu.display();
    let interface = match component.interface {
        Some(wanted) if !offered(wanted) => {
            let others: Vec<_> = both.into_iter().filter(|i| offered(*i)).map(|i| i.to_string()).collect();
            let others = if others.is_empty() {
                "neither that nor another one that can be run".into()
            } else {
                others.join(", ")
            };
            report.wrong_fmu(component, format!("{file} does not offer {wanted}; it offers {others}"));
            return None;
        }
        wanted => wanted.or_else(|| both.into_iter().find(|i| offered(*i))),
    };
    let Some(interface) = interface else {
        report.wrong_fmu(component, format!("{file} offers neither Co-Simulation nor Model Exchange"));
        return None;
    };
    let starts = start::starts(component, d, report);
    Some(Part { fmu, interface, starts })
}

/// Some FMUs allow one instance per process.
fn only_once(system: &System, list: &[Option<Part>], report: &mut Report) {
    let mut used: HashMap<*const Fmu, usize> = HashMap::new();
    for (part, component) in list.iter().zip(&system.components) {
        let Some(part) = part else { continue };
        let offered = match part.interface {
            Interface::CoSimulation => &part.d().co_simulation,
            Interface::ModelExchange => &part.d().model_exchange,
        };
        let count = used.entry(Arc::as_ptr(&part.fmu)).or_default();
        *count += 1;
        if *count > 1 && offered.as_ref().is_some_and(|i| i.can_be_instantiated_only_once_per_process) {
            report.wrong_fmu(
                component,
                format!("{} can be instantiated only once per process; give each component a process of its own (--isolate)", component.fmu.display()),
            );
        }
    }
}
