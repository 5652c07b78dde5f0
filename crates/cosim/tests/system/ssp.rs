//! SSP: what is read, and the message of every mistake.

use std::io::Write;

use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::{Algorithm, ComponentInterface, CosimSystem};
use trueup_cosim::{ValueBuffer, check};
use zip::write::SimpleFileOptions;

use crate::system::{Desk, said};

/// A description with this system; prefixes are none of the usual ones.
pub(crate) fn ssd(system: &str, rest: &str) -> String {
    format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<a:SystemStructureDescription version="1.0" name="s" xmlns:a="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:b="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:c="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
  xmlns:d="http://ssp-standard.org/SSP1/SystemStructureParameterMapping">
{system}
{rest}</a:SystemStructureDescription>"#
    )
}

/// A connector.
pub(crate) fn con(name: &str, kind: &str, unit: &str) -> String {
    let unit = if unit.is_empty() { String::new() } else { format!(" unit=\"{unit}\"") };
    format!(r#"<a:Connector name="{name}" kind="{kind}"><b:Real{unit}/></a:Connector>"#)
}

/// A component of `all.fmu`.
pub(crate) fn all(name: &str, more: &str) -> String {
    format!(r#"<a:Component name="{name}" source="all.fmu">{more}</a:Component>"#)
}

/// A connection; an element `""` is the system itself.
pub(crate) fn wire(from: (&str, &str), to: (&str, &str), more: &str) -> String {
    let element = |name: &str, value: &str| {
        if value.is_empty() { String::new() } else { format!(" {name}=\"{value}\"") }
    };
    let (attributes, inner) = more.split_once('|').unwrap_or(("", more));
    format!(
        r#"<a:Connection{} startConnector="{}"{} endConnector="{}" {attributes}>{inner}</a:Connection>"#,
        element("startElement", from.0),
        from.1,
        element("endElement", to.0),
        to.1
    )
}

pub(crate) fn system(elements: &str, connections: &str) -> String {
    format!(
        "<a:System name=\"root\"><a:Elements>{elements}</a:Elements>\n<a:Connections>{connections}</a:Connections></a:System>"
    )
}

/// A binding with these parameters: name and value of reals.
fn values(list: &[(&str, &str)], attributes: &str, mapping: &str) -> String {
    let parameters: String = list
        .iter()
        .map(|(name, value)| format!(r#"<c:Parameter name="{name}">{value}</c:Parameter>"#))
        .collect();
    format!(
        r#"<a:ParameterBindings><a:ParameterBinding{attributes}><a:ParameterValues><c:ParameterSet version="1.0" name="p"><c:Parameters>{parameters}</c:Parameters>
<c:Units><b:Unit name="deg"><b:BaseUnit rad="1" factor="0.017453292519943295"/></b:Unit></c:Units></c:ParameterSet></a:ParameterValues>{mapping}</a:ParameterBinding></a:ParameterBindings>"#
    )
}

pub(crate) fn plan(desk: &Desk, text: &str) -> MasterPlan {
    let system = CosimSystem::read(&desk.write("s.ssd", text)).map_err(|e| e.to_string()).unwrap();
    check(&system).map_err(|e| e.to_string()).unwrap()
}

fn mistakes(desk: &Desk, text: &str) -> Vec<String> {
    said(CosimSystem::read(&desk.write("s.ssd", text)).and_then(|s| check(&s)), desk.path())
}

/// What a plan does, as text.
pub(crate) fn shape(plan: &MasterPlan) -> String {
    let components: Vec<_> = plan
        .components
        .iter()
        .map(|c| (&c.name, c.interface, &c.structural, &c.start, c.every, &c.fmu.description().model_name))
        .collect();
    let inputs = plan.inputs.as_ref().map(|i| &i.columns);
    format!(
        "{components:#?}{:#?}{:#?}{:#?}{:?}{:?}{:?}{:?}{inputs:?}",
        plan.links, plan.recorded, plan.driven, plan.grid, plan.tolerance, plan.algorithm, plan.maps
    )
}

/// The archive of these entries.
pub(crate) fn archive(entries: &[(&str, Vec<u8>)]) -> Vec<u8> {
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    for (name, bytes) in entries {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The link to an input, by names.
pub(crate) fn link(plan: &MasterPlan, to: &str) -> (String, f64, f64) {
    let name = |e: trueup_cosim::plan::ElementIndex| {
        let c = &plan.components[e.component];
        format!("{}.{}", c.name, c.description().variables[e.variable].name)
    };
    let link = plan.links.iter().find(|l| name(l.to) == to).unwrap();
    (name(link.from), link.factor, link.offset)
}

fn start(plan: &MasterPlan, component: &str, variable: &str) -> Option<ValueBuffer> {
    let c = plan.components.iter().find(|c| c.name == component).unwrap();
    let reference = c.description().find(variable).unwrap().value_reference;
    c.start.iter().find(|b| b.references == [reference]).map(|b| b.values.clone())
}

#[test]
fn connections_are_converted_and_transformed() {
    let desk = Desk::new();
    let connections = [
        // Units first, then the transformation; a missing factor is 1.
        wire(("p", "angle"), ("q", "degrees"), r#"<b:LinearTransformation offset="5"/>"#),
        wire(
            ("p", "warm"),
            ("q", "celsius"),
            r#"suppressUnitConversion="true"|<b:LinearTransformation factor="2"/>"#,
        ),
        wire(
            ("p", "gear"),
            ("q", "mode"),
            r#"<b:EnumerationMappingTransformation><b:MapEntry source="park" target="off"/><b:MapEntry source="drive" target="on"/></b:EnumerationMappingTransformation>"#,
        ),
        wire(
            ("q", "flag"),
            ("p", "enable"),
            r#"<b:BooleanMappingTransformation><b:MapEntry source="true" target="false"/><b:MapEntry source="false" target="true"/></b:BooleanMappingTransformation>"#,
        ),
        // The kinds of the connectors say where values come from, not start and end.
        wire(("p", "u"), ("q", "x"), ""),
        wire(("q", "vector"), ("p", "force"), r#"startIndices="2" |"#),
    ];
    let connectors = format!(
        "<a:Connectors>{}{}{}</a:Connectors>",
        con("u", "input", ""),
        con("x", "output", ""),
        r#"<a:Connector name="vector" kind="output"><b:Real/><b:Dimension size="2"/></a:Connector>"#
    );
    let text = ssd(&system(&(all("p", &connectors) + &all("q", &connectors)), &connections.concat()), "");
    let plan = plan(&desk, &text);
    let (from, factor, offset) = link(&plan, "q.degrees");
    assert_eq!((from.as_str(), offset), ("p.angle", 5.0));
    assert!((factor * std::f64::consts::PI - 180.0).abs() < 1e-12);
    assert_eq!(link(&plan, "q.celsius"), ("p.warm".into(), 2.0, 0.0));
    assert_eq!(link(&plan, "p.u"), ("q.x".into(), 1.0, 0.0));
    assert_eq!(link(&plan, "p.force"), ("q.vector".into(), 1.0, 0.0));
    assert_eq!(plan.maps, [vec![(1, 1), (5, 2)], vec![(1, 0), (0, 1)]]);
}

#[test]
fn units_of_connectors_on_the_way_count() {
    let desk = Desk::new();
    let units = r#"<a:Units><b:Unit name="deg"><b:BaseUnit rad="1" factor="0.017453292519943295"/></b:Unit><b:Unit name="rad"><b:BaseUnit rad="1"/></b:Unit></a:Units>"#;
    // x has no unit in the FMU: the connector declares it in rad. Then deg, doubled, plus 1; `u` is in rad again.
    let inner = format!(
        "<a:System name=\"in\"><a:Connectors>{}</a:Connectors><a:Elements>{}</a:Elements><a:Connections>{}</a:Connections></a:System>",
        con("out", "output", "deg"),
        all("p", &format!("<a:Connectors>{}</a:Connectors>", con("x", "output", "rad"))),
        wire(("p", "x"), ("", "out"), r#"<b:LinearTransformation factor="2" offset="1"/>"#)
    );
    let q = all("q", &format!("<a:Connectors>{}</a:Connectors>", con("u", "input", "rad")));
    let text = ssd(&system(&(inner + &q), &wire(("in", "out"), ("q", "u"), "")), units);
    let (from, factor, offset) = link(&plan(&desk, &text), "q.u");
    assert_eq!(from, "in.p.x");
    assert!(
        (factor - 2.0).abs() < 1e-15 && (offset - std::f64::consts::PI / 180.0).abs() < 1e-15,
        "{factor} {offset}"
    );
}

#[test]
fn nested_systems_become_flat() {
    let desk = Desk::new();
    // A chain of two in a system, that one twice: once inline, once by its id; connectors on the way.
    let pair = |head: &str| {
        format!(
            "<a:System {head}><a:Connectors>{}{}{}</a:Connectors><a:Elements>{}{}</a:Elements><a:Connections>{}{}{}{}{}</a:Connections></a:System>",
            con("in", "input", ""),
            con("out", "output", ""),
            con("k", "parameter", ""),
            all("a", ""),
            all("b", ""),
            wire(("", "in"), ("a", "u"), r#"<b:LinearTransformation factor="3"/>"#),
            wire(("a", "x"), ("b", "u"), ""),
            wire(("b", "x"), ("", "out"), r#"<b:LinearTransformation factor="2"/>"#),
            wire(("", "k"), ("a", "gain"), ""),
            wire(("", "k"), ("b", "gain"), r#"<b:LinearTransformation factor="0.5" offset="1"/>"#),
        )
    };
    let elements = pair("name=\"one\" id=\"pair\"") + "<a:Component name=\"two\" source=\"#pair\"/>";
    let connections = wire(("one", "out"), ("two", "in"), r#"<b:LinearTransformation factor="5"/>"#)
        + &wire(("two", "out"), ("one", "in"), "");
    let bound = values(
        &[
            ("one.k", "<c:Real value=\"4\"/>"),
            ("two.b.gain", "<c:Real value=\"7\"/>"),
            ("three.x", "<c:Real value=\"7\"/>"),
        ],
        "",
        "",
    );
    let text = ssd(
        &system(&elements, &connections).replace(
            "<a:Elements><a:System name=\"one\"",
            &format!("{bound}<a:Elements><a:System name=\"one\""),
        ),
        "",
    );
    let plan = plan(&desk, &text);
    let names: Vec<_> = plan.components.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["one.a", "one.b", "two.a", "two.b"]);
    assert_eq!(plan.links.len(), 4);
    assert_eq!(link(&plan, "two.a.u"), ("one.b.x".into(), 30.0, 0.0));
    assert_eq!(link(&plan, "one.a.u"), ("two.b.x".into(), 6.0, 0.0));
    assert_eq!(start(&plan, "one.a", "gain"), Some(ValueBuffer::Float64(vec![4.0])));
    assert_eq!(start(&plan, "one.b", "gain"), Some(ValueBuffer::Float64(vec![3.0])));
    assert_eq!(start(&plan, "two.b", "gain"), Some(ValueBuffer::Float64(vec![7.0])));
    assert!(plan.notes.iter().any(|n| n.contains("match nothing are left out: three.x")), "{:?}", plan.notes);
}

#[test]
fn parameters_have_prefixes_mappings_units_and_an_order() {
    let desk = Desk::new();
    desk.write(
        "outer.ssv",
        r#"<v:ParameterSet version="1.0" name="o" xmlns:v="x" xmlns:c="y"><v:Parameters>
            <v:Parameter name="gain"><v:Real value="90" unit="deg"/></v:Parameter>
            <v:Parameter name="count"><v:Integer value="3"/></v:Parameter>
            <v:Parameter name="nothing"><v:Real value="3"/></v:Parameter>
            <v:Parameter name="matrix"><v:Real value="1 2 3 4 5 6"/><c:Dimension size="2"/><c:Dimension size="3"/></v:Parameter>
            </v:Parameters><v:Units><c:Unit name="deg"><c:BaseUnit rad="1" factor="0.017453292519943295"/></c:Unit></v:Units></v:ParameterSet>"#,
    );
    desk.write(
        "map.ssm",
        r#"<m:ParameterMapping version="1.0" xmlns:m="x"><m:MappingEntry source="p.gain" target="p.gain"><m:LinearTransformation factor="2"/></m:MappingEntry>
            <m:MappingEntry source="p.count" target="q.small"/><m:MappingEntry source="p.matrix" target="q.matrix"/></m:ParameterMapping>"#,
    );
    // The component's own value yields to that of the system; of two bindings the later one counts.
    let p = all(
        "p",
        &values(
            &[
                ("gain", "<c:Real value=\"1\"/>"),
                ("label", "<c:String value=\"a, b\"/>"),
                ("mode", "<c:Enumeration value=\"on\" name=\"M\"/>"),
            ],
            "",
            "",
        ),
    );
    let q =
        all("q", &values(&[("gain", "<c:Real value=\"1\"/>"), ("other", "<c:Real value=\"1\"/>")], "", ""));
    let outer = r#"<a:ParameterBindings><a:ParameterBinding source="outer.ssv" prefix="p."><a:ParameterMapping source="map.ssm"/></a:ParameterBinding></a:ParameterBindings>"#;
    let text = ssd(&system(&(p + &q), "").replace("<a:Elements>", &format!("{outer}<a:Elements>")), "");
    let plan = plan(&desk, &text);
    let Some(ValueBuffer::Float64(gain)) = start(&plan, "p", "gain") else { panic!() };
    assert!((gain[0] - std::f64::consts::PI).abs() < 1e-15, "{gain:?}");
    assert_eq!(start(&plan, "p", "label"), Some(ValueBuffer::String(vec!["a, b".into()])));
    assert_eq!(start(&plan, "p", "mode"), Some(ValueBuffer::Int64(vec![2])));
    assert_eq!(start(&plan, "q", "small"), Some(ValueBuffer::Int8(vec![3])));
    assert_eq!(start(&plan, "q", "matrix"), Some(ValueBuffer::Float64(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0])));
    assert!(
        plan.notes.iter().any(|n| n == "values that match no variable of `q` are left out: other"),
        "{:?}",
        plan.notes
    );
}

#[test]
fn packages_hold_fmus_and_other_packages() {
    let desk = Desk::new();
    let fmu = archive(&[(
        "modelDescription.xml",
        std::fs::read(desk.path().join("all.fmu/modelDescription.xml")).unwrap(),
    )]);
    let inner = ssd(
        &format!(
            "<a:System name=\"i\"><a:Connectors>{}</a:Connectors><a:Elements><a:Component name=\"c\" source=\"resources/a%20b.fmu\" implementation=\"CoSimulation\"/></a:Elements><a:Connections>{}</a:Connections></a:System>",
            con("o", "output", ""),
            wire(("c", "x"), ("", "o"), "")
        ),
        "",
    );
    let package = archive(&[
        ("SystemStructure.ssd", inner.clone().into_bytes()),
        ("./resources/a b.fmu", fmu.clone()),
        ("Variant.ssd", inner.replace("\"c\"", "\"v\"").into_bytes()),
    ]);
    let outer = ssd(
        &system(
            "<a:Component name=\"one\" type=\"application/x-ssp-package\" source=\"resources/in.ssp\"/><a:Component name=\"two\" type=\"application/x-ssp-package\" source=\"resources/in.ssp#Variant.ssd\"/><a:Component name=\"d\" source=\"resources/all.fmu\"/>",
            &(wire(("one", "o"), ("d", "u"), "") + &wire(("two", "o"), ("d", "force"), "")),
        ),
        "<a:DefaultExperiment startTime=\"1\" stopTime=\"3\"><a:Annotations><b:Annotation type=\"org.other\"><z:Strange xmlns:z=\"z\" step=\"x\"/></b:Annotation></a:Annotations></a:DefaultExperiment>",
    );
    let file = desk.write(
        "outer.ssp",
        archive(&[
            ("SystemStructure.ssd", outer.into_bytes()),
            ("resources/in.ssp", package),
            ("resources/all.fmu", fmu),
        ]),
    );
    let plan = check(&CosimSystem::read(&file).map_err(|e| e.to_string()).unwrap())
        .map_err(|e| e.to_string())
        .unwrap();
    let names: Vec<_> = plan.components.iter().map(|c| (c.name.as_str(), c.interface)).collect();
    assert_eq!(
        names,
        [
            ("one.c", ComponentInterface::CoSimulation),
            ("two.v", ComponentInterface::CoSimulation),
            ("d", ComponentInterface::CoSimulation)
        ]
    );
    assert_eq!((plan.grid.start, plan.grid.stop), (1.0, 3.0));
    assert_eq!([link(&plan, "d.u").0, link(&plan, "d.force").0], ["one.c.x", "two.v.x"]);
}

#[test]
fn signal_dictionaries_and_connectors_of_the_whole_system() {
    let desk = Desk::new();
    desk.write("in.csv", "time,reference\n0,1\n");
    let bus = r#"<a:SignalDictionaryReference name="bus1" dictionary="d"/><a:SignalDictionaryReference name="bus2" dictionary="d"/>"#;
    let connections = wire(("p", "x"), ("bus1", "s"), "")
        + &wire(("bus2", "s"), ("q", "u"), "")
        + &wire(("", "reference"), ("p", "u"), "");
    let head = format!("<a:Connectors>{}</a:Connectors><a:Elements>", con("reference", "input", ""));
    let text = ssd(
        &system(&(all("p", "") + &all("q", "") + bus), &connections).replace("<a:Elements>", &head).replace(
            "</a:Connections>",
            "</a:Connections><a:SignalDictionaries><a:SignalDictionary name=\"d\"/></a:SignalDictionaries>",
        ),
        "",
    );
    let mut system = CosimSystem::read(&desk.write("s.ssd", text)).map_err(|e| e.to_string()).unwrap();
    system.inputs =
        Some(trueup_cosim::system::InputFile { file: desk.path().join("in.csv"), ..Default::default() });
    let plan = check(&system).map_err(|e| e.to_string()).unwrap();
    assert_eq!(link(&plan, "q.u").0, "p.x");
    assert_eq!(plan.driven.len(), 1);
    assert_eq!(plan.components[plan.driven[0].to.component].name, "p");
}

#[test]
fn our_annotations_say_how_to_run() {
    let desk = Desk::new();
    let rest = r#"<a:Annotations><b:Annotation type="trueup"><t:Run xmlns:t="urn:trueup:system:1" step="0.25" tolerance="0.5" algorithm="adaptive"/></b:Annotation></a:Annotations>"#;
    let plan = plan(&desk, &ssd(&system(&all("p", ""), ""), rest));
    assert_eq!(
        (plan.grid.step, plan.tolerance, plan.algorithm),
        (0.25, Some(0.5), Some(Algorithm::Adaptive))
    );
}

#[test]
fn what_other_tools_write_against_the_standard_is_understood() {
    let desk = Desk::new();
    // A prefix that is declared nowhere, a unit that is defined nowhere, an empty name of the system itself, an
    // integer for an enumeration.
    desk.write(
        "p.ssv",
        "<?xml version=\"1.0\"?>\n<!-- <x> -->\n<v:ParameterSet version=\"1.0\" name=\"o\"><v:Parameters><v:Parameter name=\"gain\"><v:Real value=\"9\" unit=\"[rad]\"/></v:Parameter></v:Parameters></v:ParameterSet>",
    );
    let p = all("p", "<a:ParameterBindings><a:ParameterBinding source=\"p.ssv\"/></a:ParameterBindings>");
    let connections = r#"<a:Connection startElement="" startConnector="in" endElement="p" endConnector="u"/>"#
        .to_owned() + &wire(("p", "count"), ("q", "mode"), "");
    let text = ssd(&system(&(p + &all("q", "")), &connections), "");
    let plan = plan(&desk, &text);
    assert_eq!(start(&plan, "p", "gain"), Some(ValueBuffer::Float64(vec![9.0])));
    assert_eq!(plan.links.len(), 1);
    let notes = plan.notes.join("\n");
    assert!(notes.contains("handed on as the number of an item"), "{notes}");
}

#[test]
fn mistakes_have_their_line() {
    let desk = Desk::new();
    let two = all("p", "") + &all("q", "");
    for (text, said) in [
        (
            ssd(&system(&two, &wire(("p", "xx"), ("q", "u"), "")), ""),
            "6: `p.xx`: the FMU has no variable `xx`",
        ),
        (
            ssd(&system(&two, &wire(("r", "x"), ("q", "u"), "")), ""),
            "6: the connection names the element `r`, which is not there",
        ),
        (
            ssd(&system(&two, "<a:Connection startElement=\"p\" endElement=\"q\" endConnector=\"u\"/>"), ""),
            "6: `Connection` has no attribute `startConnector`",
        ),
        (
            ssd(&system(&two, &wire(("p", "x"), ("q", "u"), "suppressUnitConversion=\"maybe\"|")), ""),
            "6: suppressUnitConversion=\"maybe\" of `Connection` is neither true nor false",
        ),
        (
            ssd(&system(&two, &wire(("p", "x"), ("q", "u"), "<b:LinearTransformation factor=\"two\"/>")), ""),
            "6: factor=\"two\" of `LinearTransformation` is not understood",
        ),
        (
            ssd(&system(&two, &wire(("p", "angle"), ("q", "force"), "")), ""),
            "6: `p.angle` -> `q.force`: rad (rad) is not of the same quantity as N (kg.m.s-2); if that is meant, switch the conversion off",
        ),
        (
            ssd(&system(&two, &(wire(("p", "x"), ("q", "u"), "") + &wire(("p", "x"), ("q", "u"), ""))), ""),
            "6: `q.u` is driven twice",
        ),
        (
            ssd(&system("<a:Component name=\"p\" source=\"al.fmu\"/>", ""), ""),
            "5: there is no file al.fmu; did you mean `all.fmu`?",
        ),
        (
            ssd(&system("<a:Component name=\"p\"/>", ""), ""),
            "5: the component `p` has no source; it cannot be run",
        ),
        (ssd(&system("<a:Component source=\"all.fmu\"/>", ""), ""), "5: `Component` has no attribute `name`"),
        (
            ssd(
                &system("<a:Component name=\"p\" source=\"all.fmu\" implementation=\"ModelExchange\"/>", ""),
                "",
            ),
            "5: all.fmu does not offer model-exchange",
        ),
        (
            ssd(
                &system(
                    "<a:Component name=\"p\" source=\"all.fmu\" implementation=\"ScheduledExecution\"/>",
                    "",
                ),
                "",
            ),
            "5: the implementation ScheduledExecution cannot be run",
        ),
        (
            ssd(
                &system("<a:Component name=\"p\" type=\"text/x-modelica; path=A\" source=\"a.mo\"/>", ""),
                "",
            ),
            "5: the component `p` is text/x-modelica, which cannot be run",
        ),
        (
            ssd(&system("<a:Component name=\"p\" source=\"http://x/all.fmu\"/>", ""), ""),
            "5: http://x/all.fmu: only files can be read",
        ),
        (
            ssd(&system("<a:Component name=\"p\" source=\"#absent\"/>", ""), ""),
            "5: there is no system with the id \"absent\"",
        ),
        (
            ssd(&system(&all("p", &values(&[("gain", "<c:Real/>")], "", "")), ""), ""),
            "5: the parameter `gain` has no value",
        ),
        (
            ssd(&system(&all("p", &values(&[("gain", "<c:Real value=\"-1\"/>")], "", "")), ""), ""),
            "5: start of `p.gain`: -1.0 rad is below its minimum 0.0 rad",
        ),
        (
            ssd(
                &system(
                    &all(
                        "p",
                        "<a:ParameterBindings><a:ParameterBinding source=\"none.ssv\"/></a:ParameterBindings>",
                    ),
                    "",
                ),
                "",
            ),
            "5: none.ssv: there is no such file",
        ),
        (ssd(&system(&(all("p", "") + &all("p", "")), ""), ""), "5: the name `p` is taken"),
        (
            ssd(&system("<a:SignalDictionaryReference name=\"b\" dictionary=\"none\"/>", ""), ""),
            "5: there is no signal dictionary `none`",
        ),
        ("<x/>".into(), "1: the root element is `x`, not `SystemStructureDescription`"),
        ("<x>".into(), "1: not well-formed XML"),
        (ssd("", ""), "2: there is no `System`"),
    ] {
        let mistakes = mistakes(&desk, &text);
        assert!(mistakes.iter().any(|m| m.starts_with(said)), "{said}\n{mistakes:#?}\n{text}");
    }
}
