//! System structure descriptions become a tree of elements; whatever else they refer to is read with them.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use roxmltree::Document;
use trueup_fmi_description::description::DescriptionUnit;

use super::annotation;
use super::files::{SspReader, described, system_by_id};
use super::parameters::{self, Transformation};
use super::size::{MAX_DEPTH, too_deep};
use super::xml::{SspNode, SspText};
use crate::mistake::InputMistake;
use crate::system::{ComponentInterface, SourceSpan, StartValue};

/// A component, a system, or a reference to a signal dictionary.
#[derive(Debug)]
pub(super) struct SsdElement {
    pub(super) name: String,
    pub(super) kind: ConnectorKind,
    pub(super) connectors: HashMap<String, Connector>,
    /// In the order of their application.
    pub(super) parameters: Vec<StartValue>,
    pub(super) place: SourceSpan,
}

#[derive(Debug)]
pub(super) enum ConnectorKind {
    Fmu { file: PathBuf, interface: Option<ComponentInterface>, step: Option<f64> },
    System(SystemContent),
    Dictionary(String),
}

/// What is in a system.
#[derive(Debug, Default)]
pub(super) struct SystemContent {
    pub(super) elements: Vec<SsdElement>,
    pub(super) connections: Vec<SsdConnection>,
    pub(super) dictionaries: HashSet<String>,
    /// Names of elements that could not be read, which has been reported.
    pub(super) failed: HashSet<String>,
}

#[derive(Debug)]
pub(super) struct Connector {
    /// `input`, `output`, ...
    pub(super) kind: String,
    pub(super) unit: Option<DescriptionUnit>,
}

/// A connection as written.
#[derive(Debug)]
pub(super) struct SsdConnection {
    /// Element (`None`: the system itself) and connector.
    pub(super) ends: [(Option<String>, String); 2],
    pub(super) transformation: Transformation,
    pub(super) suppress: bool,
    pub(super) place: SourceSpan,
}

/// A whole description.
pub(super) struct Root {
    pub(super) element: SsdElement,
    pub(super) start: Option<f64>,
    pub(super) stop: Option<f64>,
    pub(super) place: SourceSpan,
    pub(super) own: annotation::OwnAnnotation,
}

/// The file that is being read.
struct FileContext<'d> {
    file: &'d Path,
    document: &'d Document<'d>,
    source: &'d SspText<'d>,
    units: HashMap<String, DescriptionUnit>,
    depth: usize,
}

impl SspReader {
    /// Reads a `.ssd`; mistakes are collected, `None` where nothing can be made of it.
    pub(super) fn description(&mut self, file: &Path, depth: usize, at: &SourceSpan) -> Option<Root> {
        self.with(file, at, |reader, root, document| {
            if root.name() != "SystemStructureDescription" {
                return Err(root.wrong(format!(
                    "the root element is `{}`, not `SystemStructureDescription`",
                    root.name()
                )));
            }
            if let Some(version) =
                root.attribute("version").filter(|v| !v.starts_with("1.") && !v.starts_with("2."))
            {
                reader
                    .notes
                    .push(format!("{}: version {version} is read as far as it is like 2.0", root.place()));
            }
            let system = root.child("System").ok_or_else(|| root.wrong("there is no `System`"))?;
            if depth == 0 && !reader.is_buildable(system, document, file) {
                return Ok(None);
            }
            let units = parameters::units(root)?;
            let context = FileContext { file, document, source: root.source, units, depth };
            let element = reader.system(system, &context);
            let experiment = root.child("DefaultExperiment");
            let time = |name| experiment.map_or(Ok(None), |e| e.number(name));
            Ok(Some(Root {
                element: element?,
                start: time("startTime")?,
                stop: time("stopTime")?,
                place: experiment.unwrap_or(root).place(),
                own: annotation::read(root, |text| reader.locate(text, file))?,
            }))
        })
        .flatten()
    }

    /// Reports a mistake and goes on.
    fn keep<T>(&mut self, result: Result<T, InputMistake>) -> Option<T> {
        result.map_err(|mistake| self.mistakes.push(mistake)).ok()
    }

    fn system(&mut self, node: SspNode, context: &FileContext) -> Result<SsdElement, InputMistake> {
        let mut inner = SystemContent::default();
        for child in node.list("Elements") {
            let element = match child.name() {
                "Component" => self.component(child, context),
                "System" => {
                    let deeper =
                        FileContext { depth: context.depth + 1, units: context.units.clone(), ..*context };
                    within(child, deeper.depth).and_then(|()| self.system(child, &deeper)).map(Some)
                }
                "SignalDictionaryReference" => child.required("dictionary").and_then(|dictionary| {
                    self.element(child, ConnectorKind::Dictionary(dictionary.to_owned()), context).map(Some)
                }),
                _ => Ok(None),
            };
            match self.keep(element) {
                Some(Some(element)) => inner.elements.push(element),
                _ => inner.failed.extend(child.attribute("name").map(str::to_owned)),
            }
        }
        for child in node.list("Connections").filter(|n| n.name() == "Connection") {
            let wire = wire(child);
            inner.connections.extend(self.keep(wire));
        }
        let dictionaries = node.list("SignalDictionaries").filter(|n| n.name() == "SignalDictionary");
        inner.dictionaries = dictionaries.filter_map(|n| n.attribute("name").map(str::to_owned)).collect();
        self.element(node, ConnectorKind::System(inner), context)
    }

    /// What all kinds of elements have in common.
    fn element(
        &mut self,
        node: SspNode,
        kind: ConnectorKind,
        context: &FileContext,
    ) -> Result<SsdElement, InputMistake> {
        let name = node.required("name")?.to_owned();
        let mut connectors = HashMap::new();
        for c in node.list("Connectors").filter(|n| n.name() == "Connector") {
            let Some(name) = self.keep(c.required("name")) else { continue };
            let typed = c.children().find(|n| n.attribute("unit").is_some());
            let unit = typed.and_then(|t| parameters::unit(t, &context.units));
            let kind = c.attribute("kind").unwrap_or_default().to_owned();
            if connectors.insert(name.to_owned(), Connector { kind, unit }).is_some() {
                self.mistakes.push(c.wrong(format!("there are two connectors `{name}`")));
            }
        }
        let parameters = self.bindings(node, context);
        Ok(SsdElement { name, kind, connectors, parameters, place: node.place() })
    }

    fn component(
        &mut self,
        node: SspNode,
        context: &FileContext,
    ) -> Result<Option<SsdElement>, InputMistake> {
        let name = node.attribute("name").unwrap_or_default();
        let Some(source) = node.attribute("source") else {
            return Err(node.wrong(format!("the component `{name}` has no source; it cannot be run")));
        };
        let interface = match node.attribute("implementation").unwrap_or("any") {
            "any" | "" => None,
            "CoSimulation" => Some(ComponentInterface::CoSimulation),
            "ModelExchange" => Some(ComponentInterface::ModelExchange),
            other => {
                return Err(node.wrong(format!(
                    "the implementation {other} cannot be run; use CoSimulation or ModelExchange"
                )));
            }
        };
        let step = annotation::step(node)?;
        let (path, fragment) = source.split_once('#').unwrap_or((source, ""));
        if path.is_empty() && !fragment.is_empty() {
            // A system of this very file, by its id.
            let Some(system) = system_by_id(context.document, fragment) else {
                return Err(node.wrong(format!("there is no system with the id \"{fragment}\"")));
            };
            let deeper = FileContext { depth: context.depth + 1, units: context.units.clone(), ..*context };
            within(node, deeper.depth)?;
            let inner = self.system(SspNode { node: system, source: context.source }, &deeper)?;
            return self.replaced(node, inner, context).map(Some);
        }
        let file = self.locate(path, context.file).map_err(|why| node.wrong(why))?;
        let inner = described(node, &file, fragment).map_err(|other| {
            node.wrong(format!("the component `{name}` is {other}, which cannot be run; export it as an FMU"))
        })?;
        match inner {
            None => self.element(node, ConnectorKind::Fmu { file, interface, step }, context).map(Some),
            Some(description) => {
                within(node, context.depth + 1)?;
                let Some(root) = self.description(&description, context.depth + 1, &node.place()) else {
                    return Ok(None);
                };
                self.replaced(node, root.element, context).map(Some)
            }
        }
    }

    /// A component that refers to a system: its own name and connectors, its parameters after those of the system.
    fn replaced(
        &mut self,
        node: SspNode,
        system: SsdElement,
        context: &FileContext,
    ) -> Result<SsdElement, InputMistake> {
        let own = self.element(node, ConnectorKind::Dictionary(String::new()), context)?;
        let mut parameters = system.parameters;
        parameters.extend(own.parameters);
        let mut connectors = system.connectors;
        for (name, connector) in own.connectors {
            connectors.entry(name).or_insert(connector);
        }
        Ok(SsdElement { name: own.name, kind: system.kind, connectors, parameters, place: own.place })
    }

    fn bindings(&mut self, node: SspNode, context: &FileContext) -> Vec<StartValue> {
        let mut parameters = Vec::new();
        for binding in node.list("ParameterBindings").filter(|n| n.name() == "ParameterBinding") {
            parameters.extend(self.binding(binding, node, context).unwrap_or_default());
        }
        parameters
    }

    fn binding(
        &mut self,
        binding: SspNode,
        owner: SspNode,
        context: &FileContext,
    ) -> Option<Vec<StartValue>> {
        let wanted = "application/x-ssp-parameter-set";
        if let Some(other) = binding.attribute("type").filter(|t| *t != wanted) {
            self.mistakes.push(
                binding.wrong(format!("parameters of the type {other} cannot be read; export them as .ssv")),
            );
            return None;
        }
        let mut starts = match binding.attribute("source").filter(|s| !s.is_empty()) {
            Some(_) => {
                let file = self.reference(binding, owner, context)?;
                self.with(&file, &binding.place(), |_, root, _| parameters::set(root))?
            }
            None => {
                let set = binding.list("ParameterValues").find(|n| n.name() == "ParameterSet");
                let set = set.map(parameters::set);
                set.and_then(|set| self.keep(set)).unwrap_or_default()
            }
        };
        if let Some(prefix) = binding.attribute("prefix") {
            starts.iter_mut().for_each(|s| s.variable.insert_str(0, prefix));
        }
        let Some(mapping) = binding.child("ParameterMapping") else { return Some(starts) };
        let (mapped, notes) = match mapping.attribute("source").filter(|s| !s.is_empty()) {
            Some(_) => {
                let file = self.reference(mapping, owner, context)?;
                self.with(&file, &mapping.place(), |_, root, _| parameters::mapped(root, &starts))
            }
            None => {
                // Some tools leave out the inner element of the same name.
                let root = mapping.child("ParameterMapping").unwrap_or(mapping);
                let mapped = parameters::mapped(root, &starts);
                self.keep(mapped)
            }
        }?;
        self.notes.extend(notes);
        Some(mapped)
    }

    /// The file that `source` names, next to the description or inside the component.
    fn reference(&mut self, node: SspNode, owner: SspNode, context: &FileContext) -> Option<PathBuf> {
        let source = node.attribute("source").unwrap_or_default();
        let base = match node.attribute("sourceBase") {
            Some("component") => {
                self.locate(owner.attribute("source").unwrap_or_default(), context.file).map(|f| f.join("x"))
            }
            _ => Ok(context.file.to_owned()),
        };
        let file = base.and_then(|base| self.locate(source, &base));
        self.keep(file.map_err(|why| node.wrong(why)))
    }
}

fn within(node: SspNode, depth: usize) -> Result<(), InputMistake> {
    if depth > MAX_DEPTH { Err(too_deep(node)) } else { Ok(()) }
}

fn wire(node: SspNode) -> Result<SsdConnection, InputMistake> {
    let end = |element: &str, connector: &str, indices: &str| -> Result<_, InputMistake> {
        let mut name = node.required(connector)?.to_owned();
        if let Some(at) = node.attribute(indices).filter(|i| !i.trim().is_empty()) {
            let at: Vec<&str> = at.split([' ', ',', '\t', '\n']).filter(|i| !i.is_empty()).collect();
            name = format!("{name}[{}]", at.join(","));
        }
        // Some tools write an empty name for the system itself.
        Ok((node.attribute(element).filter(|e| !e.is_empty()).map(str::to_owned), name))
    };
    Ok(SsdConnection {
        ends: [
            end("startElement", "startConnector", "startIndices")?,
            end("endElement", "endConnector", "endIndices")?,
        ],
        transformation: parameters::transformation(node)?,
        suppress: node.flag("suppressUnitConversion")?,
        place: node.place(),
    })
}
