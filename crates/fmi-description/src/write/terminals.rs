//! terminalsAndIcons.xml (FMI 3.0): which variables of plant and controller belong to one plug.

use trueup_fmi::table::ModelTable;

use super::error::WriteError;
use super::xml::DescriptionXml;

/// terminalsAndIcons.xml.
///
/// The matching rule is `bus`: members of equal name are wired, others are left alone, because a plant has
/// sensors that a controller does not read.
///
/// # Errors
/// [`WriteError::Name`] where a member names no variable.
pub fn terminals_and_icons(table: &ModelTable) -> Result<String, WriteError> {
    let mut x = DescriptionXml::new()?;
    x.open("fmiTerminalsAndIcons", &[("fmiVersion", "3.0")])?;
    x.group("GraphicalRepresentation")?;
    let corners = [("x1", "-100"), ("y1", "-100"), ("x2", "100"), ("y2", "100")];
    x.element("CoordinateSystem", &[&corners[..], &[("suggestedScalingFactorTo_mm", "0.1")]].concat())?;
    x.element("Icon", &corners)?;
    x.close()?;
    if !table.terminals.is_empty() {
        x.group("Terminals")?;
        for t in &table.terminals {
            let attributes =
                [("name", t.name.as_str()), ("matchingRule", "bus"), ("description", t.description.as_str())];
            x.open("Terminal", &attributes)?;
            for (member, variable) in &t.members {
                if table.find(variable).is_none() {
                    let role = "member of a terminal";
                    return Err(WriteError::Name { variable: t.name.clone(), other: variable.clone(), role });
                }
                let attributes =
                    [("variableName", variable.as_str()), ("memberName", member), ("variableKind", "signal")];
                x.element("TerminalMemberVariable", &attributes)?;
            }
            x.close()?;
        }
        x.close()?;
    }
    x.finish()
}
