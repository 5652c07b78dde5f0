//! The reader: what is written comes back, other tools' ways are understood, errors have a place.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;
use trueup_fmi_description::FmiVersion;
use trueup_fmi_description::description::*;
use trueup_fmi_description::read::read;
use trueup_fmi_description::write::model_description;

fn written(version: FmiVersion) -> Description {
    read(model_description(&common::table(), version, "t").unwrap().as_bytes()).unwrap()
}

#[test]
fn what_is_written_comes_back() {
    for version in FmiVersion::ALL {
        let d = written(version);
        let table = common::table();
        assert_eq!(
            (d.version, d.token.as_str(), d.description.as_str()),
            (version, "t", "Two masses & a <spring>")
        );
        let elements: usize = d.variables.iter().map(|v| d.elements(v).unwrap()).sum();
        let expected: usize = table.variables.iter().map(|v| v.len()).sum();
        assert_eq!(elements, expected + if version == FmiVersion::V3 { table.indicators } else { 0 });
        assert_eq!(d.event_indicators(), 2);
        assert_eq!(d.experiment.stop_time, Some(2.0));
        assert_eq!(d.types[0].items[0].description, "a < b");
        let mass = d.find(if version == FmiVersion::V2 { "mass[2]" } else { "mass" }).unwrap();
        assert_eq!(mass.start.as_ref().unwrap().as_f64().unwrap().last(), Some(&2e-7));
        assert_eq!(d.attributes(mass).min, Some(0.0));
        assert_eq!(d.unit("rad").unwrap().base.unwrap().exponents, [0, 0, 0, 0, 0, 0, 0, 1]);
        for (_, interface) in d.interfaces() {
            assert!(interface.can_serialize_fmu_state);
        }
        // der(x) -> x, through the reference of the version
        let rate = d.resolve(d.structure.derivatives[0].reference).unwrap();
        let state = d.resolve(d.variables[rate].derivative.unwrap()).unwrap();
        assert!(d.variables[rate].name.starts_with("der(x") && d.variables[state].name.starts_with('x'));
    }
}

#[test]
fn depends_on_nothing_is_not_depends_on_everything() {
    for version in FmiVersion::ALL {
        let d = written(version);
        let of = |name: &str| {
            let u = d.structure.outputs.iter();
            u.clone().find(|u| d.variables[d.resolve(u.reference).unwrap()].name == name).unwrap()
        };
        assert_eq!(of("angle").dependencies, Some(Vec::new()));
        assert_eq!(of("touching").dependencies, None);
    }
}

#[test]
fn encodings() {
    let text = |encoding: &str| {
        format!(
            "<?xml version=\"1.0\" encoding='{encoding}'?>\n<fmiModelDescription fmiVersion=\"2.0\" \
             modelName=\"Größe\" guid=\"g\"/>"
        )
    };
    let name = |bytes: &[u8]| read(bytes).unwrap().model_name;
    assert_eq!(name(text("UTF-8").as_bytes()), "Größe");
    assert_eq!(name(&[b"\xef\xbb\xbf", text("utf-8").as_bytes()].concat()), "Größe");
    let latin: Vec<u8> = text("ISO-8859-1").chars().map(|c| c as u8).collect();
    assert_eq!(name(&latin), "Größe");
    let utf16: Vec<u8> = text("UTF-16").encode_utf16().flat_map(u16::to_le_bytes).collect();
    assert_eq!(name(&[b"\xff\xfe", utf16.as_slice()].concat()), "Größe");
    let undeclared: Vec<u8> = text("UTF-8").chars().map(|c| c as u8).collect();
    let error = read(&undeclared).unwrap_err();
    assert_eq!((error.line, error.column), (2, 52), "{error}");
    assert!(read(text("EBCDIC").as_bytes()).unwrap_err().message.contains("ebcdic"));
}

/// Everything of FMI 3.0 that our own FMUs do not have.
#[test]
fn all_types_of_fmi_3() {
    let xml = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0.1" modelName="m" instantiationToken="t" unknown="1" xmlns:x="urn:x">
  <CoSimulation modelIdentifier="m" hasEventMode="1" fixedInternalStepSize="0.1"/>
  <TypeDefinitions>
    <Float32Type name="F" unit="m" min="-1"/><BinaryType name="B" mimeType="a/b"/>
    <ClockType name="C" intervalVariability="constant" intervalDecimal="0.5"/>
  </TypeDefinitions>
  <ModelVariables>
    <UInt64 name="n" valueReference="1" causality="structuralParameter" start="3"/>
    <Float32 name="f" valueReference="2" declaredType="F" max="2" causality="input" start="1 2 3">
      <Annotations><Annotation type="x"><x:any/></Annotation></Annotations>
      <Dimension valueReference="1"/><Alias name="g" displayUnit="mm"/>
    </Float32>
    <UInt64 name="u" valueReference="3" causality="parameter" start="18446744073709551615"/>
    <Int64 name="i" valueReference="4" causality="parameter" start="-9223372036854775808"/>
    <String name="s" valueReference="5" causality="parameter"><Dimension start="2"/><Start value="a b"/><Start value=""/></String>
    <Binary name="b" valueReference="6" causality="input" declaredType="B"><Start value="0aFF"/></Binary>
    <Clock name="c" valueReference="7" declaredType="C" causality="input" intervalVariability="constant"/>
    <Boolean name="z" valueReference="8" causality="input" clocks="7" previous="9" start="1 false"><Dimension start="2"/></Boolean>
    <Int8 name="w" valueReference="9" variability="discrete"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="9" dependencies="" dependenciesKind=""/></ModelStructure>
</fmiModelDescription>"#;
    let d = read(xml.as_bytes()).unwrap();
    assert_eq!(d.variables.len(), 9);
    let f = d.find("g").unwrap();
    assert_eq!(
        (d.elements(f), f.name.as_str(), f.variability),
        (Some(3), "f", DescriptionVariability::Continuous)
    );
    let a = d.attributes(f);
    assert_eq!((a.unit.as_deref(), a.min, a.max), (Some("m"), Some(-1.0), Some(2.0)));
    assert_eq!(d.find("u").unwrap().start, Some(StartValues::Unsigned(vec![u64::MAX])));
    assert_eq!(d.find("i").unwrap().start, Some(StartValues::Signed(vec![i64::MIN])));
    assert_eq!(d.find("s").unwrap().start, Some(StartValues::Text(vec!["a b".to_owned(), String::new()])));
    assert_eq!(d.find("b").unwrap().start, Some(StartValues::Binary(vec![vec![10, 255]])));
    assert_eq!(d.find("z").unwrap().start, Some(StartValues::Boolean(vec![true, false])));
    assert_eq!((d.find("z").unwrap().clocks.as_slice(), d.find("z").unwrap().previous), (&[7][..], Some(9)));
    assert_eq!(d.find("n").unwrap().variability, DescriptionVariability::Fixed);
    assert_eq!(d.find("w").unwrap().variability, DescriptionVariability::Discrete);
    assert_eq!(d.attributes(d.find("c").unwrap()).clock.unwrap().interval_variability, "constant");
    assert!(d.co_simulation.as_ref().unwrap().has_event_mode && d.model_exchange.is_none());
    assert_eq!(d.structure.outputs[0].dependencies, Some(vec![]));
}

#[test]
fn errors_have_a_place() {
    let of = |xml: &str| read(xml.as_bytes()).unwrap_err();
    let e = of("<fmiModelDescription fmiVersion=\"2.0\">\n<ModelVariables>\n </fmiModelDescription>");
    assert_eq!(e.line, 3);
    let e = of("<fmiModelDescription fmiVersion=\"1.0\"/>");
    assert!(e.message.contains("1.0"));
    let e = of(
        "<fmiModelDescription fmiVersion=\"3.0\"><ModelVariables>\n  <Float64 name=\"a\" valueReference=\"x\"/></ModelVariables></fmiModelDescription>",
    );
    assert_eq!((e.line, e.column), (2, 21));
    assert!(e.message.contains("valueReference=\"x\"") && e.message.contains("(a)"), "{e}");
    let e = of(
        "<fmiModelDescription fmiVersion=\"2.0\"><ModelVariables>\n<ScalarVariable name=\"a\" valueReference=\"1\"><Real start=\"1,5\"/></ScalarVariable></ModelVariables></fmiModelDescription>",
    );
    assert!(e.message.contains("start=\"1,5\"") && e.message.contains("(a)"), "{e}");
    assert!(of("<other/>").message.contains("other"));
    assert!(of("").line == 1);
    // entities cannot be used to blow it up
    assert!(read(b"<!DOCTYPE a [<!ENTITY b \"c\">]><a>&b;</a>").is_err());
}
