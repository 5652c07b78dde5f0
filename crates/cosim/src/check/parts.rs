//! The components of a system with their FMUs.

use std::collections::HashMap;
use std::sync::Arc;

use trueup_fmi_description::description::Description;
use trueup_fmi_import::UnpackedFmu;

use super::files::Files;
use super::report::Report;
use super::start::{Starts, starts};
use crate::mistake::suggestion;
use crate::place::SourceSpan;
use crate::system::{ComponentInterface, CosimSystem, SystemComponent, VariablePort};

/// A component with its FMU.
pub(super) struct CheckedPart {
    pub(super) fmu: Arc<UnpackedFmu>,
    pub(super) interface: ComponentInterface,
    pub(super) starts: Starts,
}

impl CheckedPart {
    pub(super) fn d(&self) -> &Description {
        self.starts.resized.as_deref().unwrap_or_else(|| self.fmu.description())
    }
}

/// The components; what could not be loaded is reported once and left out.
pub(super) struct CheckedParts<'a> {
    pub(super) list: Vec<Option<CheckedPart>>,
    pub(super) by_name: HashMap<&'a str, usize>,
}

impl<'a> CheckedParts<'a> {
    pub(super) fn of(system: &'a CosimSystem, files: &mut Files, report: &mut Report) -> Self {
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

    /// The component of a port; `None` if it is not known (which is reported here) or not loaded (which was reported before).
    pub(super) fn find(
        &self,
        port: &VariablePort,
        place: &SourceSpan,
        report: &mut Report,
    ) -> Option<(usize, &CheckedPart)> {
        let Some(i) = self.by_name.get(port.component.as_str()) else {
            let near = suggestion(&port.component, self.by_name.keys().copied());
            report.wrong(place, format!("`{port}`: there is no component `{}`{near}", port.component));
            return None;
        };
        self.list[*i].as_ref().map(|part| (*i, part))
    }
}

fn part(component: &SystemComponent, files: &mut Files, report: &mut Report) -> Option<CheckedPart> {
    let fmu = files.fmu(&component.fmu).map_err(|why| report.wrong_fmu(component, why)).ok()?;
    let d = fmu.description();
    let offered = |interface| match interface {
        ComponentInterface::CoSimulation => d.co_simulation.is_some(),
        ComponentInterface::ModelExchange => d.model_exchange.is_some(),
    };
    let both = [ComponentInterface::CoSimulation, ComponentInterface::ModelExchange];
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
    let starts = starts(component, d, report);
    Some(CheckedPart { fmu, interface, starts })
}

/// Some FMUs allow one instance per process.
fn only_once(system: &CosimSystem, list: &[Option<CheckedPart>], report: &mut Report) {
    let mut used: HashMap<*const UnpackedFmu, usize> = HashMap::new();
    for (part, component) in list.iter().zip(&system.components) {
        let Some(part) = part else { continue };
        let offered = match part.interface {
            ComponentInterface::CoSimulation => &part.d().co_simulation,
            ComponentInterface::ModelExchange => &part.d().model_exchange,
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
