//! A tree of systems becomes a flat one: connections are followed through the connectors of systems from each input
//! of a component back to the output that drives it, and parameters down to the variables that they set.

use std::collections::HashMap;

use trueup_fmi_description::description::DescriptionUnit;

use super::parameters::Transformation;
use super::read::{Connector, ConnectorKind, Root, SsdElement, SystemContent};
use crate::mistake::InputMistake;
use crate::system::ComponentNames;
use crate::system::{
    Connection, ConnectionHop, CosimSystem, InputFile, RunSettings, SourceSpan, StartValue, SystemComponent,
    VariablePort,
};

/// Connectors passed on one way; more is a circle.
const MAX_HOPS: usize = 1000;
/// Systems that a parameter is handed down through.
const MAX_DEPTH: usize = 64;

/// A connector of an element (its index in [`Flat::owners`]).
type ConnectorNode<'a> = (usize, &'a str);

/// An element with its place in the tree.
struct Owner<'a> {
    /// Index of the component; `None`: a connector only hands on.
    component: Option<usize>,
    connectors: &'a HashMap<String, Connector>,
}

/// A value comes to a connector.
struct Edge<'a> {
    from: ConnectorNode<'a>,
    transformation: &'a Transformation,
    suppress: bool,
    place: &'a SourceSpan,
}

#[derive(Default)]
struct Flat<'a> {
    owners: Vec<Owner<'a>>,
    components: Vec<SystemComponent>,
    /// What comes to a connector.
    incoming: HashMap<ConnectorNode<'a>, Vec<Edge<'a>>>,
    /// Inputs of components, in the order of the file.
    inputs: Vec<ConnectorNode<'a>>,
    /// What a system's connector hands on to, for parameters.
    outgoing: HashMap<ConnectorNode<'a>, Vec<(ConnectorNode<'a>, &'a Transformation)>>,
    /// Elements by the parent of their system and their name.
    children: HashMap<ConnectorNode<'a>, (usize, &'a SsdElement)>,
    /// Parameters that nothing here is named after.
    unmatched: Vec<String>,
    mistakes: Vec<InputMistake>,
}

pub(super) fn flatten(root: Root, mistakes: &mut Vec<InputMistake>) -> CosimSystem {
    let mut flat = Flat::default();
    let top = flat.element(&root.element, None, &[]);
    flat.parameters(top, &root.element);
    let connections = flat.connections();
    let mut connectors: Vec<_> =
        root.element.connectors.keys().map(|name| (name.clone(), flat.behind((top, name)))).collect();
    connectors.retain(|(_, ports)| !ports.is_empty());
    connectors.sort_by(|a, b| a.0.cmp(&b.0));
    mistakes.append(&mut flat.mistakes);
    let components = flat.components;
    let names = ComponentNames::of(&components);
    let inputs = root.own.inputs.map(|own| InputFile {
        file: own.file,
        columns: own.columns.into_iter().filter_map(|(name, to)| Some((name, names.port(&to)?))).collect(),
        place: own.place,
    });
    let run = RunSettings {
        start: root.start,
        stop: root.stop,
        step: root.own.step,
        tolerance: root.own.tolerance,
        algorithm: root.own.algorithm,
        event_rows: root.own.event_rows,
        place: root.place,
    };
    let mut notes = Vec::new();
    if !flat.unmatched.is_empty() {
        notes.push(format!("parameters that match nothing are left out: {}", flat.unmatched.join(", ")));
    }
    let record = root.own.record;
    CosimSystem { components, connections, run, record, inputs, connectors, notes, ..CosimSystem::default() }
}

impl<'a> Flat<'a> {
    /// Takes an element and all in it; returns its parent. `scope`: dictionaries that can be seen from here.
    fn element(&mut self, element: &'a SsdElement, name: Option<&str>, scope: &[(&'a str, usize)]) -> usize {
        let owner = self.owners.len();
        self.owners.push(Owner { component: None, connectors: &element.connectors });
        match &element.kind {
            ConnectorKind::Fmu { file, interface, step } => {
                self.owners[owner].component = Some(self.components.len());
                self.components.push(SystemComponent {
                    name: name.unwrap_or(&element.name).to_owned(),
                    fmu: file.clone(),
                    interface: *interface,
                    start: Vec::new(),
                    step: *step,
                    place: element.place.clone(),
                });
            }
            ConnectorKind::System(inner) => self.system(inner, owner, name, scope),
            ConnectorKind::Dictionary(_) => {}
        }
        owner
    }

    fn system(
        &mut self,
        inner: &'a SystemContent,
        owner: usize,
        name: Option<&str>,
        scope: &[(&'a str, usize)],
    ) {
        let mut scope = scope.to_vec();
        for dictionary in &inner.dictionaries {
            // Shared by all references: one parent of all its signals.
            scope.push((dictionary, self.owners.len()));
            self.owners.push(Owner { component: None, connectors: self.owners[owner].connectors });
        }
        for element in &inner.elements {
            let inside = match name {
                Some(outer) => format!("{outer}.{}", element.name),
                None => element.name.clone(),
            };
            let at = match &element.kind {
                ConnectorKind::Dictionary(wanted) => {
                    match scope.iter().rev().find(|(name, _)| name == wanted) {
                        Some((_, at)) => *at,
                        None => {
                            let message = format!("there is no signal dictionary `{wanted}`");
                            self.mistakes.push(InputMistake { place: element.place.clone(), message });
                            continue;
                        }
                    }
                }
                _ => self.element(element, Some(&inside), &scope),
            };
            self.children.insert((owner, &element.name), (at, element));
        }
        for wire in &inner.connections {
            let mut ends = Vec::new();
            for (element, connector) in &wire.ends {
                match element.as_deref().map(|e| (e, self.children.get(&(owner, e)))) {
                    None => ends.push((
                        (owner, connector.as_str()),
                        true,
                        find(self.owners[owner].connectors, connector),
                    )),
                    Some((_, Some((at, e)))) => {
                        ends.push(((*at, connector.as_str()), false, find(&e.connectors, connector)))
                    }
                    Some((unknown, None)) if inner.failed.contains(unknown) => {}
                    Some((unknown, None)) => {
                        let near = crate::mistake::suggestion(
                            unknown,
                            inner.elements.iter().map(|e| e.name.as_str()),
                        );
                        let message =
                            format!("the connection names the element `{unknown}`, which is not there{near}");
                        self.mistakes.push(InputMistake { place: wire.place.clone(), message });
                    }
                }
            }
            let [a, b] = ends[..] else { continue };
            let (from, to) = match (gives(a.1, a.2), gives(b.1, b.2)) {
                (Some(false), Some(true)) | (Some(false), None) | (None, Some(true)) => (b.0, a.0),
                (Some(true), Some(true)) | (Some(false), Some(false)) => {
                    let what = if gives(a.1, a.2) == Some(true) {
                        "give values, none takes them"
                    } else {
                        "take values, none gives them"
                    };
                    let message = format!(
                        "both ends of the connection, `{}` and `{}`, {what}",
                        wire.ends[0].1, wire.ends[1].1
                    );
                    self.mistakes.push(InputMistake { place: wire.place.clone(), message });
                    continue;
                }
                _ => (a.0, b.0),
            };
            let edge = Edge {
                from,
                transformation: &wire.transformation,
                suppress: wire.suppress,
                place: &wire.place,
            };
            let incoming = self.incoming.entry(to).or_default();
            if self.owners[to.0].component.is_some() {
                if incoming.is_empty() {
                    self.inputs.push(to);
                }
            } else if let Some(before) = incoming.first() {
                let message = format!("`{}` is driven twice, see {}; remove one", to.1, before.place);
                self.mistakes.push(InputMistake { place: wire.place.clone(), message });
                continue;
            }
            incoming.push(edge);
            self.outgoing.entry(from).or_default().push((to, &wire.transformation));
        }
    }

    /// From every input of a component back to an output.
    fn connections(&mut self) -> Vec<Connection> {
        let mut connections = Vec::new();
        for input in std::mem::take(&mut self.inputs) {
            for last in self.incoming.get(&input).map_or(&[][..], Vec::as_slice) {
                match self.trace(input, last) {
                    Ok(found) => connections.extend(found),
                    Err(mistake) => self.mistakes.push(mistake),
                }
            }
        }
        connections
    }

    /// `None`: nothing drives it.
    fn trace(&self, input: ConnectorNode<'a>, last: &Edge<'a>) -> Result<Option<Connection>, InputMistake> {
        let wrong = |message: String| InputMistake { place: last.place.clone(), message };
        // From the input back to the output; an index belongs to whichever array is found.
        let mut way = vec![(input, last)];
        let mut index = "";
        let mut node = last.from;
        while self.owners[node.0].component.is_none() {
            if way.len() > MAX_HOPS {
                return Err(wrong(format!("`{}` is driven by itself, through connectors alone", input.1)));
            }
            let next = self.incoming.get(&node).or_else(|| {
                let (array, at) = node.1.split_at(stem(node.1).len());
                (index.is_empty() && !at.is_empty()).then(|| index = at)?;
                self.incoming.get(&(node.0, array))
            });
            let Some(edge) = next.and_then(|edges| edges.first()) else { return Ok(None) };
            way.push((node, edge));
            node = edge.from;
        }
        let mut connection = Connection {
            from: self.port(node, index),
            to: self.port(input, ""),
            place: last.place.clone(),
            ..Connection::default()
        };
        if let Some(unit) = self.unit(node) {
            connection.through.push(ConnectionHop {
                unit: Some(unit),
                factor: 1.0,
                offset: 0.0,
                convert_units: true,
            });
        }
        for (to, edge) in way.iter().rev() {
            let (factor, offset) = edge.transformation.linear.unwrap_or((1.0, 0.0));
            let (unit, end) = (self.unit(*to), *to == input);
            if end && unit.is_none() {
                (connection.factor, connection.offset) = (factor, offset);
                connection.convert_units = !edge.suppress;
            } else if unit.is_some() || (factor, offset) != (1.0, 0.0) || edge.suppress {
                connection.through.push(ConnectionHop {
                    unit,
                    factor,
                    offset,
                    convert_units: !edge.suppress,
                });
            }
            if !edge.transformation.map.is_empty() {
                if !connection.map.is_empty() {
                    return Err(wrong(format!("`{}` is reached through two maps; write one", input.1)));
                }
                connection.map.clone_from(&edge.transformation.map);
            }
        }
        Ok(Some(connection))
    }

    fn port(&self, node: ConnectorNode, index: &str) -> VariablePort {
        let component = self.owners[node.0].component.and_then(|i| self.components.get(i));
        let component = component.map(|c| c.name.clone()).unwrap_or_default();
        VariablePort { component, variable: format!("{}{index}", node.1) }
    }

    fn unit(&self, node: ConnectorNode) -> Option<DescriptionUnit> {
        // A unit that the file does not define has no meaning: that of the FMU holds.
        let unit = find(self.owners[node.0].connectors, node.1)?.unit.clone()?;
        unit.base.is_some().then_some(unit)
    }

    /// Variables of components that a system's connector refers to, as they are: those that it drives, or the one
    /// that drives it.
    fn behind(&self, node: ConnectorNode<'a>) -> Vec<VariablePort> {
        let (mut ports, mut left, mut seen) = (Vec::new(), vec![node], 0);
        while let Some(node) = left.pop() {
            seen += 1;
            if seen > MAX_HOPS {
                break;
            }
            for (to, t) in self.outgoing.get(&node).map_or(&[][..], Vec::as_slice) {
                if **t != Transformation::default() {
                    return Vec::new();
                }
                if self.owners[to.0].component.is_some() {
                    ports.push(self.port(*to, ""))
                } else {
                    left.push(*to)
                }
            }
        }
        let mut from = node;
        while ports.is_empty() && seen < MAX_HOPS {
            seen += 1;
            let Some(edge) = self.incoming.get(&from).and_then(|e| e.first()) else { break };
            if *edge.transformation != Transformation::default() {
                break;
            }
            from = edge.from;
            if self.owners[from.0].component.is_some() {
                ports.push(self.port(from, ""));
            }
        }
        ports.reverse();
        ports
    }

    /// Parameters reach their variables: those of inner elements first, so that outer ones, coming later, count.
    fn parameters(&mut self, owner: usize, element: &'a SsdElement) {
        if let ConnectorKind::System(inner) = &element.kind {
            for child in &inner.elements {
                if let Some((at, _)) = self.children.get(&(owner, child.name.as_str())) {
                    self.parameters(*at, child);
                }
            }
        }
        for start in &element.parameters {
            if !self.apply(owner, element, &start.variable, start) {
                self.unmatched.push(start.variable.clone());
            }
        }
    }

    /// By its name in an element: of a variable, of a connector of the system, of something inside.
    fn apply(&mut self, owner: usize, element: &'a SsdElement, name: &'a str, start: &StartValue) -> bool {
        if let Some(i) = self.owners[owner].component {
            self.components[i].start.push(StartValue { variable: name.to_owned(), ..start.clone() });
            return true;
        }
        let mut matched = false;
        if find(&element.connectors, name).is_some() {
            matched = true;
            self.hand_down((owner, name), start, 0);
        }
        for (dot, _) in name.match_indices('.') {
            if let Some((at, child)) = self.children.get(&(owner, &name[..dot])).copied() {
                matched |= self.apply(at, child, &name[dot + 1..], start);
            }
        }
        matched
    }

    /// Through the connections of a system's connector.
    fn hand_down(&mut self, node: ConnectorNode<'a>, start: &StartValue, depth: usize) {
        for (to, t) in self.outgoing.get(&node).cloned().unwrap_or_default() {
            let (f, o) = t.linear.unwrap_or((1.0, 0.0));
            let (f0, o0) = start.linear.unwrap_or((1.0, 0.0));
            let linear = Some((f * f0, f * o0 + o)).filter(|l| *l != (1.0, 0.0));
            let values = start.values.iter().map(|v| t.replaced(v)).collect();
            let start = StartValue { variable: to.1.to_owned(), values, linear, ..start.clone() };
            match self.owners[to.0].component {
                Some(i) => self.components[i].start.push(start),
                None if depth < MAX_DEPTH => self.hand_down(to, &start, depth + 1),
                None => {}
            }
        }
    }
}

/// Kind of a connector: does it give values to a connection (seen from inside of the system that owns the connection)?
fn gives(own: bool, connector: Option<&Connector>) -> Option<bool> {
    let outward = match connector?.kind.as_str() {
        "output" | "calculatedParameter" | "constant" | "local" => true,
        "input" | "parameter" | "structuralParameter" => false,
        _ => return None,
    };
    // What comes into a system is given to what is inside.
    Some(outward != own)
}

/// By its name, or of an array by that of an element: some tools declare a connector `x[1]`, others `x` and give indices.
fn find<'a>(connectors: &'a HashMap<String, Connector>, name: &str) -> Option<&'a Connector> {
    connectors.get(name).or_else(|| connectors.get(stem(name)))
}

/// The name without its indices.
fn stem(name: &str) -> &str {
    name.strip_suffix(']').and_then(|n| n.rsplit_once('[')).map_or(name, |(stem, _)| stem)
}
