//! Reads modelDescription.xml of any tool.
//!
//! Tolerant where tools differ: unknown elements and attributes are skipped, a byte order mark, ISO-8859-1 and
//! UTF-16 are understood. Strict where a value cannot be understood: an error with line and column.

mod common;
mod encoding;
mod error;
mod fmi2;
mod fmi3;
mod node;

use std::collections::HashMap;

use roxmltree::Document;

use crate::FmiVersion;
use crate::description::{DefaultExperiment, Description, DescriptionVariable};
pub use encoding::decode;
pub use error::ReadError;
use node::{DescriptionNode, LineStarts};

/// Reads the bytes of a modelDescription.xml.
///
/// # Errors
/// [`ReadError`] where it is not XML, not FMI 2.0 or 3.0, or an attribute is missing or not understood.
pub fn read(bytes: &[u8]) -> Result<Description, ReadError> {
    let text = encoding::decode(bytes)?;
    let document = Document::parse(&text).map_err(|e| ReadError {
        line: e.pos().row,
        column: e.pos().col,
        message: format!("not well-formed XML: {e}"),
    })?;
    let lines = LineStarts::of(&text);
    let root = DescriptionNode::new(document.root_element(), &lines);
    if root.name() != "fmiModelDescription" {
        return Err(root.error(format!("the root element is `{}`, not `fmiModelDescription`", root.name())));
    }
    let fmi_version = root.required("fmiVersion")?;
    let version = match fmi_version.split('.').next() {
        Some("2") => FmiVersion::V2,
        Some("3") => FmiVersion::V3,
        _ => {
            return Err(
                root.error(format!("fmiVersion \"{fmi_version}\": only FMI 2.0 and 3.0 are understood"))
            );
        }
    };
    let interface = |name: &str| {
        root.child(name)
            .map(|n| if version == FmiVersion::V2 { fmi2::interface(&n) } else { fmi3::interface(&n) })
    };
    let (variables, structure, units, types) = match version {
        FmiVersion::V2 => {
            (fmi2::variables(&root)?, fmi2::structure(&root)?, node::units(&root)?, fmi2::types(&root)?)
        }
        FmiVersion::V3 => {
            (fmi3::variables(&root)?, fmi3::structure(&root)?, node::units(&root)?, fmi3::types(&root)?)
        }
    };
    let categories = root.children_of("LogCategories").map(|n| (n.text("name"), n.text("description")));
    let mut description = Description {
        version,
        fmi_version,
        model_name: root.text("modelName"),
        token: root.text(if version == FmiVersion::V2 { "guid" } else { "instantiationToken" }),
        description: root.text("description"),
        author: root.text("author"),
        model_version: root.text("version"),
        copyright: root.text("copyright"),
        license: root.text("license"),
        generation_tool: root.text("generationTool"),
        generation_date_and_time: root.text("generationDateAndTime"),
        structured_names: root.text("variableNamingConvention") == "structured",
        number_of_event_indicators: root.value("numberOfEventIndicators")?,
        model_exchange: interface("ModelExchange").transpose()?,
        co_simulation: interface("CoSimulation").transpose()?,
        scheduled_execution: interface("ScheduledExecution")
            .transpose()?
            .filter(|_| version == FmiVersion::V3),
        units,
        types,
        log_categories: categories.collect(),
        experiment: experiment(&root)?,
        by_name: names(&variables),
        by_reference: variables.iter().enumerate().rev().map(|(at, v)| (v.value_reference, at)).collect(),
        variables,
        structure,
    };
    if version == FmiVersion::V3 {
        description.number_of_event_indicators = None;
    }
    Ok(description)
}

fn names(variables: &[DescriptionVariable]) -> HashMap<String, usize> {
    let own = variables.iter().enumerate().map(|(at, v)| (v.name.clone(), at));
    let aliases =
        variables.iter().enumerate().flat_map(|(at, v)| v.aliases.iter().map(move |a| (a.name.clone(), at)));
    aliases.chain(own).collect()
}

fn experiment(root: &DescriptionNode) -> Result<DefaultExperiment, ReadError> {
    let Some(n) = root.child("DefaultExperiment") else { return Ok(DefaultExperiment::default()) };
    Ok(DefaultExperiment {
        start_time: n.value("startTime")?,
        stop_time: n.value("stopTime")?,
        tolerance: n.value("tolerance")?,
        step_size: n.value("stepSize")?,
    })
}
