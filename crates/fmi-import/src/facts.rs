//! What calling an FMU needs to know of its modelDescription.xml.

use std::collections::HashMap;
use std::path::Path;

use crate::error::Error;

/// How many elements an array has along one dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Always so many.
    Fixed(u64),
    /// As many as the structural parameter with this value reference says.
    Parameter(u32),
}

/// A variable, as far as it matters here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Value reference.
    pub value_reference: u32,
    /// Type: the element's name in the description (`Real`, `Float64`, ...).
    pub kind: String,
    /// Causality (`input`, `output`, ...).
    pub causality: String,
    /// Dimensions; none for a scalar.
    pub dimensions: Vec<Dimension>,
}

/// Facts of the description.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Major version of FMI: 2 or 3.
    pub version: u32,
    /// GUID (2.0) or instantiation token (3.0).
    pub token: String,
    /// Model identifier for Model Exchange, if offered.
    pub model_exchange: Option<String>,
    /// Model identifier for Co-Simulation, if offered.
    pub co_simulation: Option<String>,
    /// Continuous states of FMI 2.0.
    pub states: usize,
    /// Event indicators of FMI 2.0.
    pub event_indicators: usize,
    /// Default experiment: start, stop, step in s.
    pub experiment: (Option<f64>, Option<f64>, Option<f64>),
    /// Tolerance of the default experiment.
    pub tolerance: Option<f64>,
    /// The variables.
    pub variables: Vec<Variable>,
}

impl Facts {
    /// Variables by causality.
    pub fn of<'a>(&'a self, causality: &'a str) -> impl Iterator<Item = &'a Variable> {
        self.variables.iter().filter(move |variable| variable.causality == causality)
    }

    /// A variable by name.
    pub fn find(&self, name: &str) -> Option<&Variable> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Reads them.
    ///
    /// # Errors
    /// [`Error::File`] for what is no description of FMI 2.0 or 3.0.
    pub fn read(file: &Path, xml: &str) -> Result<Self, Error> {
        let fail = |reason: String| Error::File { file: file.into(), reason };
        let document =
            roxmltree::Document::parse(xml).map_err(|e| fail(format!("modelDescription.xml: {e}")))?;
        let root = document.root_element();
        let version = match root.attribute("fmiVersion").unwrap_or("") {
            v if v.starts_with("2.") => 2,
            v if v.starts_with("3.") => 3,
            v => return Err(fail(format!("fmiVersion \"{v}\" is not supported; 2.0 and 3.0 are"))),
        };
        let child = |name: &str| root.children().find(|node| node.has_tag_name(name));
        let identifier = |name| child(name).and_then(|n| n.attribute("modelIdentifier")).map(str::to_owned);
        let experiment = |name| {
            child("DefaultExperiment").and_then(|n| n.attribute(name)).and_then(|t| t.trim().parse().ok())
        };
        let mut facts = Self {
            version,
            token: root
                .attribute(if version == 2 { "guid" } else { "instantiationToken" })
                .unwrap_or("")
                .into(),
            model_exchange: identifier("ModelExchange"),
            co_simulation: identifier("CoSimulation"),
            event_indicators: root
                .attribute("numberOfEventIndicators")
                .and_then(|n| n.trim().parse().ok())
                .unwrap_or(0),
            experiment: (experiment("startTime"), experiment("stopTime"), experiment("stepSize")),
            tolerance: experiment("tolerance"),
            ..Self::default()
        };
        facts.states = child("ModelStructure")
            .and_then(|n| n.children().find(|node| node.has_tag_name("Derivatives")))
            .map_or(0, |n| n.children().filter(|node| node.has_tag_name("Unknown")).count());
        for node in child("ModelVariables").into_iter().flat_map(|n| n.children()).filter(|n| n.is_element())
        {
            let kind = if version == 3 {
                node.tag_name().name()
            } else {
                let types = ["Real", "Integer", "Boolean", "String", "Enumeration"];
                let kind = node.children().map(|n| n.tag_name().name()).find(|name| types.contains(name));
                kind.unwrap_or("")
            };
            let Some(value_reference) = node.attribute("valueReference").and_then(|v| v.trim().parse().ok())
            else {
                return Err(fail(format!(
                    "modelDescription.xml: variable \"{}\" has no valueReference",
                    node.attribute("name").unwrap_or("")
                )));
            };
            let dimensions = node.children().filter(|n| n.has_tag_name("Dimension")).map(|n| {
                let parse = |name| n.attribute(name).and_then(|v| v.trim().parse::<u64>().ok());
                match parse("start") {
                    Some(count) => Dimension::Fixed(count),
                    None => Dimension::Parameter(
                        parse("valueReference").and_then(|v| u32::try_from(v).ok()).unwrap_or(u32::MAX),
                    ),
                }
            });
            facts.variables.push(Variable {
                name: node.attribute("name").unwrap_or("").into(),
                value_reference,
                kind: kind.into(),
                causality: node.attribute("causality").unwrap_or("local").into(),
                dimensions: dimensions.collect(),
            });
        }
        Ok(facts)
    }

    /// Dimensions of every array, by value reference.
    pub(crate) fn arrays(&self) -> HashMap<u32, Vec<Dimension>> {
        let arrays = self.variables.iter().filter(|variable| !variable.dimensions.is_empty());
        arrays.map(|variable| (variable.value_reference, variable.dimensions.clone())).collect()
    }
}
