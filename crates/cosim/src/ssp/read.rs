//! System structure descriptions become a tree of elements; whatever else they refer to is read with them.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use roxmltree::Document;
use trueup_fmi_description::description::Unit;
use trueup_fmi_description::read::decode;

use super::annotation;
use super::parameters::{self, Transformation};
use super::xml::{Node, Source};
use crate::mistake::Mistake;
use crate::store::{Store, inside};
use crate::system::{Interface, Place, Start};

/// Descriptions inside descriptions.
const MAX_DEPTH: usize = 32;
/// Elements of a system, nested ones counted as often as they are used.
const MAX_ELEMENTS: usize = 200_000;

/// A component, a system, or a reference to a signal dictionary.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) connectors: HashMap<String, Connector>,
    /// In the order of their application.
    pub(super) parameters: Vec<Start>,
    pub(super) place: Place,
}

#[derive(Debug)]
pub(super) enum Kind {
    Fmu { file: PathBuf, interface: Option<Interface>, step: Option<f64> },
    System(Inner),
    Dictionary(String),
}

/// What is in a system.
#[derive(Debug, Default)]
pub(super) struct Inner {
    pub(super) elements: Vec<Element>,
    pub(super) connections: Vec<Wire>,
    pub(super) dictionaries: HashSet<String>,
    /// Names of elements that could not be read, which has been said.
    pub(super) failed: HashSet<String>,
}

#[derive(Debug)]
pub(super) struct Connector {
    /// `input`, `output`, ...
    pub(super) kind: String,
    pub(super) unit: Option<Unit>,
}

/// A connection as written.
#[derive(Debug)]
pub(super) struct Wire {
    /// Element (`None`: the system itself) and connector.
    pub(super) ends: [(Option<String>, String); 2],
    pub(super) transformation: Transformation,
    pub(super) suppress: bool,
    pub(super) place: Place,
}

/// A whole description.
pub(super) struct Root {
    pub(super) element: Element,
    pub(super) start: Option<f64>,
    pub(super) stop: Option<f64>,
    pub(super) place: Place,
    pub(super) own: annotation::Own,
}

pub(super) struct Reader {
    pub(super) store: Store,
    pub(super) mistakes: Vec<Mistake>,
    pub(super) notes: Vec<String>,
    elements: usize,
}

/// The file that is being read.
struct Context<'d> {
    file: &'d Path,
    document: &'d Document<'d>,
    source: &'d Source<'d>,
    units: HashMap<String, Unit>,
    depth: usize,
}

impl Reader {
    pub(super) fn new() -> Self {
        Self { store: Store::default(), mistakes: Vec::new(), notes: Vec::new(), elements: 0 }
    }

    /// Reads a `.ssd`; mistakes are collected, `None` where nothing can be made of it.
    pub(super) fn description(&mut self, file: &Path, depth: usize, at: &Place) -> Option<Root> {
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
            let units = parameters::units(root)?;
            let context = Context { file, document, source: root.source, units, depth };
            let element = reader.system(system, &context);
            let experiment = root.child("DefaultExperiment");
            let time = |name| experiment.map_or(Ok(None), |e| e.number(name));
            Ok(Root {
                element: element?,
                start: time("startTime")?,
                stop: time("stopTime")?,
                place: experiment.unwrap_or(root).place(),
                own: annotation::read(root, |text| reader.locate(text, file))?,
            })
        })
    }

    /// Parses a file and hands its root on.
    fn with<T>(
        &mut self,
        file: &Path,
        at: &Place,
        work: impl for<'d> FnOnce(&mut Self, Node<'d>, &'d Document<'d>) -> Result<T, Mistake>,
    ) -> Option<T> {
        let fail = |place: Place, message: String| Mistake { place, message };
        let bytes = match self.store.read(file) {
            Ok(bytes) => bytes,
            Err(why) => {
                self.mistakes.push(fail(at.clone(), format!("{}: {why}", file.display())));
                return None;
            }
        };
        let in_file = |line| Place { file: file.into(), line };
        let text = match decode(&bytes) {
            Ok(text) => text,
            Err(e) => {
                self.mistakes.push(fail(in_file(e.line), e.message));
                return None;
            }
        };
        if let Some(why) = nested_too_deeply(&text) {
            self.mistakes.push(fail(in_file(why), "elements are nested too deeply".into()));
            return None;
        }
        let text = declared(text);
        let document = match Document::parse(&text) {
            Ok(document) => document,
            Err(e) => {
                self.mistakes.push(fail(in_file(e.pos().row), format!("not well-formed XML: {e}")));
                return None;
            }
        };
        let source = Source::new(file, &text);
        let root = Node { node: document.root_element(), source: &source };
        let done = work(self, root, &document);
        done.map_err(|mistake| self.mistakes.push(mistake)).ok()
    }

    /// Reports a mistake and goes on.
    fn keep<T>(&mut self, result: Result<T, Mistake>) -> Option<T> {
        result.map_err(|mistake| self.mistakes.push(mistake)).ok()
    }

    fn system(&mut self, node: Node, context: &Context) -> Result<Element, Mistake> {
        let mut inner = Inner::default();
        for child in node.list("Elements") {
            let element = match child.name() {
                "Component" => self.component(child, context),
                "System" => {
                    let deeper =
                        Context { depth: context.depth + 1, units: context.units.clone(), ..*context };
                    self.count(child, deeper.depth).and_then(|()| self.system(child, &deeper)).map(Some)
                }
                "SignalDictionaryReference" => child.required("dictionary").and_then(|dictionary| {
                    self.element(child, Kind::Dictionary(dictionary.to_owned()), context).map(Some)
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
        self.element(node, Kind::System(inner), context)
    }

    fn count(&mut self, node: Node, depth: usize) -> Result<(), Mistake> {
        self.elements += 1;
        if depth > MAX_DEPTH {
            return Err(node
                .wrong(format!("systems are nested more than {MAX_DEPTH} deep; does one contain itself?")));
        }
        if self.elements > MAX_ELEMENTS {
            return Err(node.wrong(format!("there are more than {MAX_ELEMENTS} elements")));
        }
        Ok(())
    }

    /// What all kinds of elements have in common.
    fn element(&mut self, node: Node, kind: Kind, context: &Context) -> Result<Element, Mistake> {
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
        Ok(Element { name, kind, connectors, parameters, place: node.place() })
    }

    fn component(&mut self, node: Node, context: &Context) -> Result<Option<Element>, Mistake> {
        self.count(node, context.depth)?;
        let name = node.attribute("name").unwrap_or_default();
        let Some(source) = node.attribute("source") else {
            return Err(node.wrong(format!("the component `{name}` has no source; it cannot be run")));
        };
        let kind = node.attribute("type").unwrap_or("application/x-fmu-sharedlibrary");
        let interface = match node.attribute("implementation").unwrap_or("any") {
            "any" | "" => None,
            "CoSimulation" => Some(Interface::CoSimulation),
            "ModelExchange" => Some(Interface::ModelExchange),
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
            let id = |n: &roxmltree::Node| n.is_element() && n.attribute("id") == Some(fragment);
            let Some(system) =
                context.document.descendants().find(id).filter(|n| n.tag_name().name() == "System")
            else {
                return Err(node.wrong(format!("there is no system with the id \"{fragment}\"")));
            };
            let deeper = Context { depth: context.depth + 1, units: context.units.clone(), ..*context };
            self.count(node, deeper.depth)?;
            let inner = self.system(Node { node: system, source: context.source }, &deeper)?;
            return self.replaced(node, inner, context).map(Some);
        }
        let file = self.locate(path, context.file).map_err(|why| node.wrong(why))?;
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default();
        let inner = match (kind.split(';').next().unwrap_or(kind).trim(), extension.as_str()) {
            ("application/x-ssp-package", _) | ("application/x-fmu-sharedlibrary", "ssp") => {
                Some(file.join(if fragment.is_empty() { "SystemStructure.ssd" } else { fragment }))
            }
            ("application/x-ssp-definition", _) | ("application/x-fmu-sharedlibrary", "ssd") => {
                Some(file.clone())
            }
            ("application/x-fmu-sharedlibrary", _) => None,
            (other, _) => {
                return Err(node.wrong(format!(
                    "the component `{name}` is {other}, which cannot be run; export it as an FMU"
                )));
            }
        };
        match inner {
            None => self.element(node, Kind::Fmu { file, interface, step }, context).map(Some),
            Some(description) => {
                self.count(node, context.depth + 1)?;
                let Some(root) = self.description(&description, context.depth + 1, &node.place()) else {
                    return Ok(None);
                };
                self.replaced(node, root.element, context).map(Some)
            }
        }
    }

    /// A component that stands for a system: its own name and connectors, its parameters after those of the system.
    fn replaced(&mut self, node: Node, system: Element, context: &Context) -> Result<Element, Mistake> {
        let own = self.element(node, Kind::Dictionary(String::new()), context)?;
        let mut parameters = system.parameters;
        parameters.extend(own.parameters);
        let mut connectors = system.connectors;
        for (name, connector) in own.connectors {
            connectors.entry(name).or_insert(connector);
        }
        Ok(Element { name: own.name, kind: system.kind, connectors, parameters, place: own.place })
    }

    fn bindings(&mut self, node: Node, context: &Context) -> Vec<Start> {
        let mut parameters = Vec::new();
        for binding in node.list("ParameterBindings").filter(|n| n.name() == "ParameterBinding") {
            parameters.extend(self.binding(binding, node, context).unwrap_or_default());
        }
        parameters
    }

    fn binding(&mut self, binding: Node, owner: Node, context: &Context) -> Option<Vec<Start>> {
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
        match mapping.attribute("source").filter(|s| !s.is_empty()) {
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
        }
    }

    /// The file that `source` names, beside the description or inside the component.
    fn reference(&mut self, node: Node, owner: Node, context: &Context) -> Option<PathBuf> {
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

    /// The file that a URI means, seen from a file. What lies in an archive stays in it.
    fn locate(&mut self, uri: &str, from: &Path) -> Result<PathBuf, String> {
        let text = match uri.split_once(':') {
            Some(("file", rest)) => rest.trim_start_matches("//"),
            Some((scheme, _)) if scheme.len() > 1 && scheme.chars().all(|c| c.is_ascii_alphanumeric()) => {
                return Err(format!("{uri}: only files can be read, nothing over {scheme}"));
            }
            _ => uri,
        };
        let text = percent(text).ok_or_else(|| format!("{uri} is no valid URI"))?;
        let folder = from.parent().unwrap_or(Path::new(""));
        let path = folder.join(text.replace('\\', "/"));
        let archive = from.ancestors().skip(1).find(|p| {
            p.is_file() || p.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp")) && !p.is_dir()
        });
        match archive {
            Some(archive) => {
                inside(archive, &path).ok_or_else(|| format!("{uri} leads out of {}", archive.display()))
            }
            None => Ok(path),
        }
    }
}

fn wire(node: Node) -> Result<Wire, Mistake> {
    let end = |element: &str, connector: &str, indices: &str| -> Result<_, Mistake> {
        let mut name = node.required(connector)?.to_owned();
        if let Some(at) = node.attribute(indices).filter(|i| !i.trim().is_empty()) {
            let at: Vec<&str> = at.split([' ', ',', '\t', '\n']).filter(|i| !i.is_empty()).collect();
            name = format!("{name}[{}]", at.join(","));
        }
        // Some tools write an empty name for the system itself.
        Ok((node.attribute(element).filter(|e| !e.is_empty()).map(str::to_owned), name))
    };
    Ok(Wire {
        ends: [
            end("startElement", "startConnector", "startIndices")?,
            end("endElement", "endConnector", "endIndices")?,
        ],
        transformation: parameters::transformation(node)?,
        suppress: node.flag("suppressUnitConversion")?,
        place: node.place(),
    })
}

/// Prefixes that a file uses without saying what they stand for, which other tools do not notice, are declared in its
/// root element.
fn declared(mut text: Cow<str>) -> Cow<str> {
    for _ in 0..8 {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = Document::parse(&text) else { break };
        let Some(root) = root_name(&text) else { break };
        let name = text[root..].find(|c: char| c.is_whitespace() || c == '>' || c == '/');
        let Some(name) = name else { break };
        text.to_mut().insert_str(root + name, &format!(" xmlns:{prefix}=\"urn:undeclared:{prefix}\""));
    }
    text
}

/// Where the name of the root element begins, behind comments and instructions.
fn root_name(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        let open = at + text[at..].find('<')?;
        let rest = &text[open..];
        let end = match rest.get(..4) {
            Some("<!--") => "-->",
            Some(other) if other.starts_with("<?") => "?>",
            _ => return Some(open + 1),
        };
        at = open + rest.find(end)?;
    }
}

/// `%20` and so on.
fn percent(text: &str) -> Option<String> {
    let (mut bytes, mut rest) = (Vec::new(), text.as_bytes());
    while let Some((first, tail)) = rest.split_first() {
        match first {
            b'%' => {
                let hex = tail.get(..2).and_then(|h| std::str::from_utf8(h).ok())?;
                bytes.push(u8::from_str_radix(hex, 16).ok()?);
                rest = &tail[2..];
            }
            other => {
                bytes.push(*other);
                rest = tail;
            }
        }
    }
    String::from_utf8(bytes).ok().filter(|t| !t.contains('\0'))
}

/// The line where a hostile file nests deeper than any stack allows; a count of tags, not a parse.
fn nested_too_deeply(text: &str) -> Option<u32> {
    let (mut depth, mut line) = (0_i64, 1);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            b'\n' => line += 1,
            b'<' => match text.as_bytes().get(at + 1) {
                Some(b'/') => depth -= 1,
                Some(b'?' | b'!') | None => {}
                Some(_) => depth += 1,
            },
            b'>' if at > 0 && text.as_bytes()[at - 1] == b'/' => depth -= 1,
            _ => {}
        }
        if depth > 1000 {
            return Some(line);
        }
    }
    None
}
