//! Connections and files that drive inputs, element by element.

use std::collections::HashMap;

use trueup_fmi_description::description::DescriptionCausality;

use super::parts::{CheckedPart, CheckedParts};
use super::report::Report;
use super::types::{Typed, ValueConversion, hand_on};
use super::units::Conversion;
use super::{names, units};
use crate::plan::{ElementIndex, LinearLink};
use crate::system::{Connection, ConnectionHop, CosimSystem, SourceSpan, VariablePort};

/// Which element is driven from where: nothing has two sources.
#[derive(Default)]
pub(super) struct Drivers<'a>(HashMap<ElementIndex, &'a SourceSpan>);

impl<'a> Drivers<'a> {
    /// Claims an input; returns where it was claimed before.
    pub(super) fn claim(&mut self, to: ElementIndex, place: &'a SourceSpan) -> Result<(), &'a SourceSpan> {
        match self.0.insert(to, place) {
            Some(before) => Err(before),
            None => Ok(()),
        }
    }
}

type Maps = Vec<Vec<(i64, i64)>>;

pub(super) fn links<'a>(
    system: &'a CosimSystem,
    parts: &CheckedParts,
    drivers: &mut Drivers<'a>,
    report: &mut Report,
) -> (Vec<LinearLink>, Maps) {
    let (mut links, mut maps) = (Vec::new(), Vec::new());
    for c in &system.connections {
        let (from, to) = (parts.find(&c.from, &c.place, report), parts.find(&c.to, &c.place, report));
        let (from, to) = (
            from.and_then(|(i, part)| Some((i, part, end(part, &c.from, &c.place, report)?))),
            to.and_then(|(i, part)| Some((i, part, end(part, &c.to, &c.place, report)?))),
        );
        let (Some(from), Some(to)) = (from, to) else { continue };
        connect(c, from, to, (&mut links, &mut maps), drivers, report);
    }
    (links, maps)
}

/// The elements of a port.
pub(super) fn end(
    part: &CheckedPart,
    port: &VariablePort,
    place: &SourceSpan,
    report: &mut Report,
) -> Option<names::ResolvedName> {
    names::find(part.d(), &port.variable).map_err(|why| report.wrong(place, format!("`{port}`: {why}"))).ok()
}

/// Dimensions of length 1 do not matter.
fn squeezed(shape: &[usize]) -> Vec<usize> {
    shape.iter().copied().filter(|n| *n != 1).collect()
}

fn connect<'a>(
    c: &'a Connection,
    (i, source, from): (usize, &CheckedPart, names::ResolvedName),
    (j, target, to): (usize, &CheckedPart, names::ResolvedName),
    (links, maps): (&mut Vec<LinearLink>, &mut Maps),
    drivers: &mut Drivers<'a>,
    report: &mut Report,
) {
    let mut fine = true;
    let mut wrong = |message: String| {
        fine = false;
        report.wrong(&c.place, message);
    };
    let (Some(a), Some(b)) = (from.elements.first(), to.elements.first()) else {
        return wrong(format!("`{}` -> `{}`: there are no elements to hand on", c.from, c.to));
    };
    let a = Typed { d: source.d(), v: &source.d().variables[a.0] };
    let b = Typed { d: target.d(), v: &target.d().variables[b.0] };
    match (a.v.causality, b.v.causality) {
        (DescriptionCausality::Input, DescriptionCausality::Output) => {
            wrong(format!("`{}` is an input and `{}` an output; swap them", c.from, c.to));
        }
        (DescriptionCausality::Input, _) => {
            wrong(format!("`{}` is an input; only what an FMU computes can be handed on", c.from));
        }
        (DescriptionCausality::Independent, _) => {
            wrong(format!("`{}` is the time; it cannot be handed on", c.from))
        }
        (_, DescriptionCausality::Input) => {}
        (_, DescriptionCausality::Output) => {
            wrong(format!("`{}` is an output; only inputs can be driven", c.to))
        }
        (_, DescriptionCausality::Parameter | DescriptionCausality::StructuralParameter) => {
            wrong(format!("`{}` is a parameter; give it a start value instead of a connection", c.to));
        }
        _ => wrong(format!("`{}` is no input; only inputs can be driven", c.to)),
    }
    if squeezed(&from.shape) != squeezed(&to.shape) {
        let (from, to) = (names::size(&from.shape), names::size(&to.shape));
        wrong(format!(
            "`{}` has size {from}, `{}` has size {to}; connect elements, as in `name[1]`",
            c.from, c.to
        ));
    }
    let said = |why: String| format!("`{}` -> `{}`: {why}", c.from, c.to);
    let hand = match hand_on(a, b, !c.map.is_empty()) {
        Ok(hand) => hand,
        Err(why) => {
            wrong(said(why));
            ValueConversion::Plain
        }
    };
    let mut notes = Vec::new();
    match hand {
        ValueConversion::Plain => {}
        ValueConversion::Converted => {
            notes.push(said(format!("{} is handed on as {}, without loss", a.name(), b.name())));
        }
        ValueConversion::Item => notes.push(said(format!(
            "{} is handed on as the number of an item; a number that is none is not noticed here",
            a.name()
        ))),
    }
    let (mut factor, mut offset) = (1.0, 0.0);
    let mut unit = units::of(a.d, a.v);
    let own = units::of(b.d, b.v);
    let relative = b.d.attributes(b.v).relative_quantity;
    let last = ConnectionHop {
        unit: own.clone(),
        factor: c.factor,
        offset: c.offset,
        convert_units: c.convert_units,
    };
    for hop in c.through.iter().chain([&last]) {
        let converted = match (&unit, &hop.unit) {
            (Some(u), Some(v)) if hop.convert_units => units::conversion(u, v, relative),
            _ => Conversion::Same,
        };
        let (u, v) = (unit.as_ref().map_or("", |u| &u.name), hop.unit.as_ref().map_or("", |v| &v.name));
        match converted {
            Conversion::Same => {}
            Conversion::By(f, o) => {
                notes.push(said(format!("{u} converted to {v} (times {f:?}{})", plus(o))));
                (factor, offset) = (f * factor, f * offset + o);
            }
            Conversion::Angle(f, o) => {
                notes.push(said(format!("{u} is handed on as {v} (rad counts as 1)")));
                (factor, offset) = (f * factor, f * offset + o);
            }
            Conversion::Unknown => notes.push(said(format!(
                "the units {u} and {v} cannot be compared, since the FMUs do not define both; values are handed on as they are"
            ))),
            Conversion::Different => {
                let dimension = |unit: &Option<_>| unit.as_ref().map_or(String::new(), units::dimension);
                let (from, to) = (dimension(&unit), dimension(&hop.unit));
                wrong(said(format!(
                    "{u} ({from}) is not of the same quantity as {v} ({to}); if that is meant, switch the conversion off (TOML: convert-units = false, SSP: suppressUnitConversion=\"true\")"
                )));
            }
        }
        (factor, offset) = (hop.factor * factor, hop.factor * offset + hop.offset);
        unit = hop.unit.clone().or(unit);
    }
    if !factor.is_finite() || !offset.is_finite() {
        wrong(said("factor and offset must be finite".into()));
    }
    if (factor, offset) != (1.0, 0.0) && !b.v.kind.is_float() {
        wrong(said(format!("a factor or an offset needs an input that is a float, not {}", b.name())));
    }
    let map = (!c.map.is_empty()).then(|| {
        let mut map = Vec::new();
        for (x, y) in &c.map {
            match (a.number(x), b.number(y)) {
                (Some(x), _) if map.iter().any(|(known, _)| *known == x) => {
                    wrong(said(format!("the map has {x} twice")));
                }
                (Some(x), Some(y)) => map.push((x, y)),
                (None, _) => wrong(said(format!("the map: {x:?} is no value of {}", a.name()))),
                (_, None) => wrong(said(format!("the map: {y:?} is no value of {}", b.name()))),
            }
        }
        map
    });
    let elements: Vec<_> = from.elements.iter().zip(&to.elements).collect();
    for (_, to) in &elements {
        let element = ElementIndex { component: j, variable: to.0, element: to.1 };
        if let Err(before) = drivers.claim(element, &c.place) {
            let name =
                VariablePort { component: c.to.component.clone(), variable: names::element(b.d, to.0, to.1) };
            wrong(format!("`{name}` is driven twice, see {before}; remove one"));
        }
    }
    if !fine {
        return;
    }
    report.notes.append(&mut notes);
    let map = map.map(|map| {
        maps.push(map);
        maps.len() - 1
    });
    links.extend(elements.into_iter().map(|(from, to)| LinearLink {
        from: ElementIndex { component: i, variable: from.0, element: from.1 },
        to: ElementIndex { component: j, variable: to.0, element: to.1 },
        factor,
        offset,
        map,
    }));
}

fn plus(offset: f64) -> String {
    if offset == 0.0 { String::new() } else { format!(", plus {offset:?}") }
}
