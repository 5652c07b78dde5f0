//! Files that drive inputs: which column drives what, and what of the file nothing uses.

use trueup_fmi_description::description::{
    DescriptionCausality, DescriptionVariability, DescriptionVariable,
};
use trueup_numerics::ShortNumber;

use super::links::{Drivers, end};
use super::names;
use super::parts::CheckedParts;
use super::report::Report;
use crate::grid::CommunicationGrid;
use crate::inputs::{InputFileTable, InputSignal};
use crate::mistake::suggestion;
use crate::plan::{DrivenInput, ElementIndex};
use crate::system::ComponentNames;
use crate::system::{CosimSystem, InputFile, VariablePort};

/// A variable that may change while its FMU runs, without being an input.
fn is_tunable(v: &DescriptionVariable) -> bool {
    v.causality == DescriptionCausality::Parameter && v.variability == DescriptionVariability::Tunable
}

/// What drives nothing, and why.
fn refusal(v: &DescriptionVariable) -> Option<&'static str> {
    match (v.causality, v.variability) {
        (DescriptionCausality::Input, _) => None,
        _ if is_tunable(v) => None,
        (DescriptionCausality::Output, _) => Some("an output"),
        (DescriptionCausality::Parameter | DescriptionCausality::StructuralParameter, _) => {
            Some("a parameter that is fixed during a run: give it a start value")
        }
        (DescriptionCausality::Independent, _) => Some("the time"),
        _ => Some("computed by the FMU"),
    }
}

/// The elements that columns drive; the columns become what they are to them. Recordings hold outputs in addition to inputs: without a list
/// of columns those are named and left alone.
pub(super) fn driven<'a>(
    system: &'a CosimSystem,
    parts: &CheckedParts,
    inputs: Option<&mut InputFileTable>,
    drivers: &mut Drivers<'a>,
    report: &mut Report,
) -> Vec<DrivenInput> {
    let (Some(wanted), Some(inputs)) = (&system.inputs, inputs) else { return Vec::new() };
    let mut all = Driving {
        wanted,
        parts,
        drivers,
        report,
        driven: Vec::new(),
        signals: Vec::new(),
        unused: Vec::new(),
    };
    let find = |name: &str| inputs.columns.iter().find(|c| c.name == name);
    for (name, port) in &wanted.columns {
        match find(name) {
            Some(column) => all.drive(column, port, true),
            None => {
                let near = suggestion(name, inputs.columns.iter().map(|c| c.name.as_str()));
                let message = format!("{} has no column `{name}`{near}", wanted.file.display());
                all.report.wrong(&wanted.place, message);
            }
        }
    }
    let known = ComponentNames::of(&system.components);
    for column in &inputs.columns {
        let name = &column.name;
        if !wanted.columns.is_empty() {
            if !wanted.columns.iter().any(|(given, _)| given == name) {
                all.unused.push(format!("`{name}` (not among [inputs] columns)"));
            }
            continue;
        }
        let own = system.connectors.iter().find(|(own, _)| own == name);
        if let Some((_, ports)) = own {
            ports.iter().for_each(|port| all.drive(column, port, false));
            continue;
        }
        match known.port(name) {
            Some(port) => all.drive(column, &port, false),
            None => all.report.wrong(
                &wanted.place,
                format!("column `{name}` names no input; call it component.input, or define what it drives under [inputs] columns"),
            ),
        }
    }
    let Driving { driven, signals, unused, report, .. } = all;
    if !unused.is_empty() {
        report.note(format!(
            "columns of {} that drive nothing: {}",
            wanted.file.display(),
            unused.join(", ")
        ));
    }
    inputs.columns = signals;
    driven
}

struct Driving<'a, 'b, 'c> {
    wanted: &'a InputFile,
    parts: &'b CheckedParts<'b>,
    drivers: &'b mut Drivers<'a>,
    report: &'c mut Report,
    driven: Vec<DrivenInput>,
    /// What the columns are to the elements that they drive.
    signals: Vec<InputSignal>,
    unused: Vec<String>,
}

impl Driving<'_, '_, '_> {
    fn drive(&mut self, column: &InputSignal, port: &VariablePort, asked: bool) {
        let place = &self.wanted.place;
        let name = &column.name;
        let Some((i, part)) = self.parts.find(port, place, self.report) else { return };
        let Some(found) = end(part, port, place, self.report) else { return };
        let wrong = |report: &mut Report, why: String| report.wrong(place, format!("column `{name}`: {why}"));
        let [(variable, element)] = found.elements[..] else {
            let size = names::size(&found.shape);
            return wrong(
                self.report,
                format!(
                    "`{port}` is an array of size {size}; give one column per element, as in `{port}[1]`, or all of its values in each cell, with blanks between"
                ),
            );
        };
        let v = &part.d().variables[variable];
        match refusal(v) {
            Some(why) if asked => return wrong(self.report, format!("`{port}` is no input, but {why}")),
            Some(why) => return self.unused.push(format!("`{name}` ({why})")),
            None => {}
        }
        let to = ElementIndex { component: i, variable, element };
        if let Err(before) = self.drivers.claim(to, place) {
            return wrong(
                self.report,
                format!(
                    "`{port}` is driven twice, see {before}; name the columns that are meant under [inputs] columns"
                ),
            );
        }
        let continuous = v.kind.is_float() && v.variability == DescriptionVariability::Continuous;
        match column.drives(part.d(), v, continuous, &mut self.report.notes) {
            Ok((signal, linear)) => {
                let known = self.signals.iter().position(|other| *other == signal);
                let column = known.unwrap_or(self.signals.len());
                self.driven.push(DrivenInput { to, column, linear });
                self.signals.extend(known.is_none().then_some(signal));
            }
            Err(why) => wrong(self.report, why),
        }
    }
}

/// What of the file is outside the run's time.
pub(super) fn span(inputs: &InputFileTable, grid: &CommunicationGrid, report: &mut Report) {
    let times = || inputs.columns.iter().flat_map(|c| c.times.iter().copied());
    let Some(first) = times().min_by(f64::total_cmp) else { return };
    let last = times().max_by(f64::total_cmp).unwrap_or(first);
    let near = 1e-6 * grid.step;
    let file = inputs.file.display();
    let (start, stop) = (ShortNumber(grid.start), ShortNumber(grid.stop));
    let mend = "if its times are in another unit, declare it in a file next to it: [columns] time = { variable = \"time\", unit = \"ms\" }";
    if first > grid.stop + near || last < grid.start - near && first != last {
        report.note(format!(
            "{file} goes from {} s to {} s, and no row of it is within the run from {start} s to {stop} s; {mend}",
            ShortNumber(first),
            ShortNumber(last)
        ));
    } else if last > grid.stop + near {
        let last = ShortNumber(last);
        report.note(format!(
            "{file} goes on to {last} s, the run ends at {stop} s: what comes later is not used; {mend}"
        ));
    } else if last < grid.stop - near && first != last {
        let last = ShortNumber(last);
        report.note(format!(
            "{file} ends at {last} s, the run at {stop} s: the last values are held from there on"
        ));
    }
}
