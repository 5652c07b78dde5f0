//! A system as `.ssp`: description, FMUs, inputs. What SSP has words for is written in them, so that other tools
//! read it; the rest in annotations of our own.

use std::collections::{BTreeMap, HashMap, HashSet};
use std::io::Write;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use trueup_fmi_description::description::{
    Description, DescriptionCausality, DescriptionVariable, Item, VariableType,
};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::annotation::{NAMESPACE, TYPE};
use super::emit::{SspXml, packed, percent};
use super::planned_values::{item, set};
use crate::check::names;
use crate::error::CosimError;
use crate::plan::{ElementIndex, LinearLink, MasterPlan, PlannedComponent};
use crate::store::Store;
use crate::system::{ComponentInterface, Connection, CosimSystem, StartValue, SystemComponent, VariablePort};

/// Packs a checked system with its FMUs. Version 1.0 of SSP, or 2.0 where it has arrays.
///
/// # Errors
/// [`CosimError::Results`] if a file cannot be read or written; the archive bears its name only when it is whole.
pub fn write(system: &CosimSystem, plan: &MasterPlan, file: &Path) -> Result<(), CosimError> {
    let fail = |source: std::io::Error| CosimError::Results { file: file.into(), source };
    let mut writer = SsdWriter::new(system, plan);
    let description = writer.description();
    let mut store = Store::default();
    let mut part = trueup_fmi_description::whole::part(file).map_err(fail)?;
    let mut pack = |out: &mut NamedTempFile| -> std::io::Result<()> {
        let mut zip = ZipWriter::new(out);
        let options = SimpleFileOptions::default();
        zip.start_file("SystemStructure.ssd", options)?;
        zip.write_all(description.as_bytes())?;
        for (source, name) in &writer.resources {
            let disk = store
                .on_disk(source)
                .map_err(|why| std::io::Error::other(format!("{}: {why}", source.display())))?;
            // An FMU is compressed already.
            zip.start_file(
                format!("resources/{name}"),
                options.compression_method(CompressionMethod::Stored),
            )?;
            if disk.is_dir() {
                zip.write_all(&packed(&disk)?)?;
            } else {
                std::io::copy(&mut std::fs::File::open(&disk)?, &mut zip)?;
            }
        }
        zip.finish()?;
        Ok(())
    };
    pack(&mut part).map_err(fail)?;
    #[cfg(unix)] // only its creator can read a temporary file, all can read a result
    {
        use std::os::unix::fs::PermissionsExt;
        part.as_file().set_permissions(std::fs::Permissions::from_mode(0o644)).map_err(fail)?;
    }
    part.persist(file).map(|_| ()).map_err(|e| fail(e.error))
}

struct SsdWriter<'a> {
    system: &'a CosimSystem,
    plan: &'a MasterPlan,
    xml: SspXml,
    /// Files with their names under `resources/`.
    resources: Vec<(PathBuf, String)>,
    /// Enumerations with their items, and the names that they go by here.
    enumerations: Vec<(String, Vec<Item>)>,
    /// Something that version 1.0 has no words for.
    newer: bool,
}

impl<'a> SsdWriter<'a> {
    fn new(system: &'a CosimSystem, plan: &'a MasterPlan) -> Self {
        Self {
            system,
            plan,
            xml: SspXml::default(),
            resources: Vec::new(),
            enumerations: Vec::new(),
            newer: false,
        }
    }

    /// Name under `resources/`; files of the same name get a number.
    fn resource(&mut self, file: &Path) -> String {
        if let Some((_, name)) = self.resources.iter().find(|(known, _)| known == file) {
            return name.clone();
        }
        let plain = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (stem, extension) = plain.rsplit_once('.').unwrap_or((&plain, "fmu"));
        let taken = |name: &str| self.resources.iter().any(|(_, n)| n == name);
        let name = std::iter::once(plain.clone())
            .chain((2..).map(|i| format!("{stem}-{i}.{extension}")))
            .find(|name| !taken(name))
            .unwrap_or_default();
        self.resources.push((file.to_owned(), name.clone()));
        name
    }

    fn description(&mut self) -> String {
        let stem = self.system.file.file_stem().unwrap_or("system".as_ref()).to_string_lossy().into_owned();
        let wires = self.wires();
        self.xml.open("ssd:System", &[("name", &stem)]);
        self.xml.open("ssd:Elements", &[]);
        for (i, component) in self.system.components.iter().enumerate() {
            self.component(i, component, &wires);
        }
        self.xml.close();
        if !wires.is_empty() {
            self.xml.open("ssd:Connections", &[]);
            wires.iter().for_each(|wire| self.connection(wire));
            self.xml.close();
        }
        self.xml.close();
        self.enumerations();
        self.experiment();
        let version = if self.newer { "2.0" } else { "1.0" };
        let mut head = SspXml::default();
        let spaces = ["Description", "Common", "ParameterValues"]
            .map(|n| format!("http://ssp-standard.org/SSP1/SystemStructure{n}"));
        head.open(
            "ssd:SystemStructureDescription",
            &[
                ("xmlns:ssd", &spaces[0]),
                ("xmlns:ssc", &spaces[1]),
                ("xmlns:ssv", &spaces[2]),
                ("xmlns:trueup", NAMESPACE),
                ("version", version),
                ("name", &stem),
                ("generationTool", concat!("Trueup ", env!("CARGO_PKG_VERSION"))),
            ],
        );
        let body = self.xml.text.replace("@version@", version);
        format!(
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}{body}</ssd:SystemStructureDescription>\n",
            head.text
        )
    }

    /// Connections as SSP can say them: variables by their names, elements of arrays by their indices.
    fn wires(&self) -> Vec<WrittenConnection<'a>> {
        let by_name: HashMap<&str, usize> =
            self.system.components.iter().enumerate().map(|(i, c)| (c.name.as_str(), i)).collect();
        let links: HashMap<ElementIndex, &LinearLink> = self.plan.links.iter().map(|l| (l.to, l)).collect();
        let mut wires = Vec::new();
        for connection in &self.system.connections {
            let end = |port: &VariablePort| {
                let i = *by_name.get(port.component.as_str())?;
                let d = self.plan.components.get(i)?.description();
                Some((i, names::find(d, &port.variable).ok()?, d.position(&port.variable)))
            };
            let (Some((i, from, a)), Some((j, to, b))) = (end(&connection.from), end(&connection.to)) else {
                continue;
            };
            let first = to.elements.first().map(|(variable, element)| ElementIndex {
                component: j,
                variable: *variable,
                element: *element,
            });
            let link = first.and_then(|first| links.get(&first).copied());
            let wire = |from: ConnectorPart, to: ConnectorPart| WrittenConnection {
                connection,
                link,
                ends: [(i, from), (j, to)],
            };
            match (a, b) {
                (Some(a), Some(b)) => wires.push(wire(
                    ConnectorPart { variable: a, element: None },
                    ConnectorPart { variable: b, element: None },
                )),
                _ => wires.extend(
                    from.elements
                        .iter()
                        .zip(&to.elements)
                        .map(|(f, t)| wire(self.part(i, *f), self.part(j, *t))),
                ),
            }
        }
        wires
    }

    /// An element of an array by its index; a scalar as it is.
    fn part(&self, component: usize, (variable, element): (usize, usize)) -> ConnectorPart {
        let array = self.plan.components[component]
            .description()
            .variables
            .get(variable)
            .is_some_and(|v| !v.dimensions.is_empty());
        ConnectorPart { variable, element: array.then_some(element) }
    }

    fn component(&mut self, i: usize, component: &SystemComponent, wires: &[WrittenConnection]) {
        let Some(planned) = self.plan.components.get(i) else { return };
        let source = format!("resources/{}", percent(&self.resource(&component.fmu)));
        let mut attributes =
            vec![("name", called(planned)), ("type", "application/x-fmu-sharedlibrary"), ("source", &source)];
        match component.interface {
            Some(ComponentInterface::CoSimulation) => attributes.push(("implementation", "CoSimulation")),
            Some(ComponentInterface::ModelExchange) => attributes.push(("implementation", "ModelExchange")),
            None => {}
        }
        self.xml.open("ssd:Component", &attributes);
        let used: BTreeMap<usize, ()> = wires
            .iter()
            .flat_map(|w| &w.ends)
            .filter(|(c, _)| *c == i)
            .map(|(_, part)| (part.variable, ()))
            .collect();
        if !used.is_empty() {
            self.xml.open("ssd:Connectors", &[]);
            used.into_keys().for_each(|variable| self.connector(planned.description(), variable));
            self.xml.close();
        }
        if !component.start.is_empty() {
            self.parameters(component, planned);
        }
        if let Some(step) = component.step {
            self.xml.open("ssd:Annotations", &[]);
            self.xml.open("ssc:Annotation", &[("type", TYPE)]);
            self.xml.empty("trueup:Component", &[("step", &format!("{step:?}"))]);
            (0..2).for_each(|_| self.xml.close());
        }
        self.xml.close();
    }

    fn connector(&mut self, d: &Description, variable: usize) {
        let v = &d.variables[variable];
        let kind = match v.causality {
            DescriptionCausality::Input => "input",
            DescriptionCausality::Parameter => "parameter",
            DescriptionCausality::CalculatedParameter => "calculatedParameter",
            DescriptionCausality::StructuralParameter => "structuralParameter",
            DescriptionCausality::Local => "local",
            DescriptionCausality::Output | DescriptionCausality::Independent => "output",
        };
        self.xml.open("ssd:Connector", &[("name", &v.name), ("kind", kind)]);
        match v.kind {
            VariableType::Enumeration => {
                let name = self.enumeration(d, v);
                self.xml.empty("ssc:Enumeration", &[("name", &name)]);
            }
            kind => {
                let word = self.word(kind);
                self.xml.empty(&format!("ssc:{word}"), &[]);
            }
        }
        self.dimensions(d, v);
        self.xml.close();
    }

    /// Types as SSP 1.0 calls them, where it can hold them.
    fn word(&mut self, kind: VariableType) -> &'static str {
        let newer = match kind {
            VariableType::UInt32 => "UInt32",
            VariableType::Int64 => "Int64",
            VariableType::UInt64 => "UInt64",
            VariableType::Float32 | VariableType::Float64 => return "Real",
            VariableType::Boolean => return "Boolean",
            VariableType::String => return "String",
            VariableType::Enumeration => return "Enumeration",
            VariableType::Binary | VariableType::Clock => return "Binary",
            _ => return "Integer",
        };
        self.newer = true;
        newer
    }

    fn dimensions(&mut self, d: &Description, v: &DescriptionVariable) {
        self.newer |= !v.dimensions.is_empty();
        for length in names::find(d, &v.name).map(|f| f.shape).unwrap_or_default() {
            self.xml.empty("ssc:Dimension", &[("size", &length.to_string())]);
        }
    }

    /// The name of an enumeration in this file: its own, with a number if two FMUs mean different things by it.
    fn enumeration(&mut self, d: &Description, v: &DescriptionVariable) -> String {
        let own = v.declared_type.as_deref().unwrap_or("Enumeration");
        let items = d.declared_type(own).map(|t| t.items.clone()).unwrap_or_default();
        let names = std::iter::once(own.to_owned()).chain((2..).map(|i| format!("{own}-{i}")));
        for name in names {
            match self.enumerations.iter().find(|(known, _)| *known == name) {
                Some((_, known)) if *known == items => return name,
                Some(_) => {}
                None => {
                    self.enumerations.push((name.clone(), items));
                    return name;
                }
            }
        }
        own.to_owned()
    }

    fn enumerations(&mut self) {
        let list: Vec<_> = self.enumerations.iter().filter(|(_, items)| !items.is_empty()).cloned().collect();
        if list.is_empty() {
            return;
        }
        self.xml.open("ssd:Enumerations", &[]);
        for (name, items) in list {
            self.xml.open("ssc:Enumeration", &[("name", &name)]);
            for item in items {
                self.xml.empty("ssc:Item", &[("name", &item.name), ("value", &item.value.to_string())]);
            }
            self.xml.close();
        }
        self.xml.close();
    }

    fn parameters(&mut self, component: &SystemComponent, planned: &PlannedComponent) {
        self.xml.open("ssd:ParameterBindings", &[]);
        self.xml.open("ssd:ParameterBinding", &[]);
        self.xml.open("ssd:ParameterValues", &[]);
        self.xml.open("ssv:ParameterSet", &[("version", "@version@"), ("name", "start")]);
        self.xml.open("ssv:Parameters", &[]);
        let mut done = HashSet::new();
        for start in &component.start {
            self.start(start, planned, &mut done);
        }
        (0..5).for_each(|_| self.xml.close());
    }

    /// A start value as it was written, where that is what every tool understands; else as it is set.
    fn start(&mut self, start: &StartValue, planned: &PlannedComponent, done: &mut HashSet<usize>) {
        let d = planned.description();
        let Ok(found) = names::find(d, &start.variable) else { return };
        let written =
            start.unit.is_none() && start.linear.is_none() && start.values.len() == found.elements.len();
        let whole = d.position(&start.variable).is_some();
        let mut from = 0;
        for variable in unique(found.elements.iter().map(|(v, _)| *v)) {
            let v = &d.variables[variable];
            let count = found.elements.iter().filter(|(x, _)| *x == variable).count();
            let as_written = written && (whole || v.dimensions.is_empty());
            let values = match as_written {
                true => start.values[from..from + count].to_vec(),
                false if !done.insert(variable) => continue,
                false => set(planned, d, v),
            };
            from += count;
            let values: Vec<String> = values.into_iter().map(|text| item(d, v, text)).collect();
            self.xml.open("ssv:Parameter", &[("name", &v.name)]);
            let kind = format!("ssv:{}", self.word(v.kind));
            match &values[..] {
                [single] => self.xml.empty(&kind, &[("value", single)]),
                several if matches!(v.kind, VariableType::String | VariableType::Enumeration) => {
                    self.xml.open(&kind, &[]);
                    several.iter().for_each(|text| self.xml.empty("ssv:Value", &[("value", text)]));
                    self.xml.close();
                }
                several => self.xml.empty(&kind, &[("value", &several.join(" "))]),
            }
            self.dimensions(d, v);
            self.xml.close();
        }
    }

    fn connection(&mut self, wire: &WrittenConnection) {
        let mut attributes = Vec::new();
        let names =
            ["startElement", "startConnector", "startIndices", "endElement", "endConnector", "endIndices"];
        for ((i, part), names) in wire.ends.iter().zip(names.chunks(3)) {
            let planned = &self.plan.components[*i];
            let d = planned.description();
            attributes.push((names[0], called(planned).to_owned()));
            attributes.push((names[1], d.variables[part.variable].name.clone()));
            if let Some(element) = part.element {
                let name = names::element(d, part.variable, element);
                let indices = name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).map_or("", |(_, i)| i);
                attributes.push((names[2], indices.replace(',', " ")));
                self.newer = true;
            }
        }
        let c = wire.connection;
        // Units on the way are put into the factor.
        let (linear, suppress) = match wire.link {
            Some(link) if !c.through.is_empty() => ((link.factor, link.offset), true),
            _ => ((c.factor, c.offset), !c.convert_units),
        };
        if suppress {
            attributes.push(("suppressUnitConversion", "true".into()));
        }
        let attributes: Vec<(&str, &str)> = attributes.iter().map(|(k, v)| (*k, v.as_str())).collect();
        if linear == (1.0, 0.0) && c.map.is_empty() {
            return self.xml.empty("ssd:Connection", &attributes);
        }
        self.xml.open("ssd:Connection", &attributes);
        if linear != (1.0, 0.0) {
            let (factor, offset) = (format!("{:?}", linear.0), format!("{:?}", linear.1));
            self.xml.empty("ssc:LinearTransformation", &[("factor", &factor), ("offset", &offset)]);
        }
        if !c.map.is_empty() {
            let all = |test: fn(&str) -> bool| c.map.iter().all(|(a, b)| test(a) && test(b));
            let kind = if all(|t| matches!(t, "true" | "false")) {
                "Boolean"
            } else if all(|t| t.parse::<i64>().is_ok()) {
                "Integer"
            } else {
                "Enumeration"
            };
            self.xml.open(&format!("ssc:{kind}MappingTransformation"), &[]);
            for (from, to) in &c.map {
                self.xml.empty("ssc:MapEntry", &[("source", from), ("target", to)]);
            }
            self.xml.close();
        }
        self.xml.close();
    }

    fn experiment(&mut self) {
        let run = &self.system.run;
        let number = |x: Option<f64>| x.map(|x| format!("{x:?}"));
        let times = [("startTime", number(run.start)), ("stopTime", number(run.stop))];
        let times: Vec<_> = times.iter().filter_map(|(k, v)| Some((*k, v.as_deref()?))).collect();
        if !times.is_empty() {
            self.xml.empty("ssd:DefaultExperiment", &times);
        }
        let algorithm = run.algorithm.map(|a| a.to_string());
        let settings = [
            ("step", number(run.step)),
            ("tolerance", number(run.tolerance)),
            ("algorithm", algorithm),
            ("eventRows", run.event_rows.map(|rows| rows.to_string())),
        ];
        let settings: Vec<_> = settings.iter().filter_map(|(k, v)| Some((*k, v.as_deref()?))).collect();
        let inputs =
            self.system.inputs.as_ref().map(|inputs| {
                (format!("resources/{}", percent(&self.resource(&inputs.file))), &inputs.columns)
            });
        if settings.is_empty() && self.system.record.is_empty() && inputs.is_none() {
            return;
        }
        self.xml.open("ssd:Annotations", &[]);
        self.xml.open("ssc:Annotation", &[("type", TYPE)]);
        if !settings.is_empty() {
            self.xml.empty("trueup:Run", &settings);
        }
        for record in &self.system.record {
            let every = record.every.to_string();
            let mut attributes = vec![("variable", record.name.as_str())];
            attributes.extend(record.column.as_deref().map(|c| ("as", c)));
            attributes.extend((record.every > 0).then_some(("every", every.as_str())));
            self.xml.empty("trueup:Record", &attributes);
        }
        if let Some((file, columns)) = inputs {
            self.xml.open("trueup:Inputs", &[("file", &file)]);
            for (name, port) in columns {
                self.xml.empty("trueup:Column", &[("name", name), ("to", &port.to_string())]);
            }
            self.xml.close();
        }
        self.xml.close();
        self.xml.close();
    }
}

/// One connection of the description.
struct WrittenConnection<'a> {
    connection: &'a Connection,
    link: Option<&'a LinearLink>,
    ends: [(usize, ConnectorPart); 2],
}

/// A variable, or an element of it.
#[derive(Clone, Copy)]
struct ConnectorPart {
    variable: usize,
    element: Option<usize>,
}

/// A component without a name goes by that of its model.
fn called(planned: &PlannedComponent) -> &str {
    if planned.name.is_empty() { &planned.description().model_name } else { &planned.name }
}

fn unique(list: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut seen = HashSet::new();
    list.filter(|x| seen.insert(*x)).collect()
}
