//! Our descriptions have no finding; each deliberate break gives its finding.
#![allow(missing_docs, clippy::unwrap_used, clippy::panic)]

use crate::common;
use trueup_fmi_description::check::{self, DescriptionSeverity};
use trueup_fmi_description::read::read;
use trueup_fmi_description::{FmiVersion, write::model_description};

fn written(version: FmiVersion) -> String {
    model_description(&common::table(), version, "t").unwrap()
}

fn findings(xml: &str) -> Vec<String> {
    match read(xml.as_bytes()) {
        Ok(d) => check::description(&d).iter().map(ToString::to_string).collect(),
        Err(e) => vec![format!("error: {e}")],
    }
}

/// What is replaced by what, and words of the finding. `fmpy`: does FMPy 0.3.32 object, too?
struct Break {
    version: FmiVersion,
    from: &'static str,
    to: &'static str,
    said: &'static str,
    fmpy: bool,
}

const fn v2(from: &'static str, to: &'static str, said: &'static str, fmpy: bool) -> Break {
    Break { version: FmiVersion::V2, from, to, said, fmpy }
}

const fn v3(from: &'static str, to: &'static str, said: &'static str, fmpy: bool) -> Break {
    Break { version: FmiVersion::V3, from, to, said, fmpy }
}

#[rustfmt::skip]
const BREAKS: &[Break] = &[
    // head
    v2(r#"fmiVersion="2.0""#, r#"fmiVersion="2.1""#, r#"write "2.0""#, true),
    v3(r#"fmiVersion="3.0""#, r#"fmiVersion="3.x""#, r#"write "3.0""#, true),
    v2(r#"fmiVersion="2.0""#, r#"fmiVersion="1.0""#, "only FMI 2.0 and 3.0", true),
    v2(r#"guid="t""#, r#"guid="""#, "guid is missing or empty", false),
    v3(r#"instantiationToken="t""#, "", "instantiationToken is missing", true),
    v3(r#"modelIdentifier="Sample""#, r#"modelIdentifier="my model""#, "not a name in C", false),
    v2(r#"canGetAndSetFMUstate="true" "#, "", "set canGetAndSetFMUState too", false),
    v2(r#"</fmiModelDescription>"#, "", "not well-formed", true),
    v2(r#"tolerance="1e-6""#, r#"tolerance="-1""#, "tolerance=\"-1\" must be greater than 0", false),
    v3(r#"stopTime="2.0""#, r#"stopTime="-2""#, "is not after", false),
    // definitions
    v2(r#"<Unit name="m/s">"#, r#"<Unit name="m">"#, "unit `m` is defined twice", true),
    v3(r#"name="hard" value="2""#, r#"name="hard" value="1""#, "gives the number 1 to two items", false),
    v3(r#"<EnumerationType name="Law""#, r#"<EnumerationType name="Lax""#, "the type `Law` is not defined", true),
    v2(r#"declaredType="Law""#, "", "no declaredType", true),
    v3(r#"<Boolean name="enable""#, r#"<Boolean declaredType="Law" name="enable""#, "is of type Boolean but its declared type `Law` is Enumeration", false),
    v2(r#"unit="kg""#, r#"unit="kgs""#, "the unit `kgs` is not defined", true),
    v3(r#"displayUnit="deg""#, r#"displayUnit="grad""#, "the display unit `grad` is not defined", true),
    // names and value references
    v2(r#"name="mass[2]""#, r#"name="mass[1]""#, "the name `mass[1]` is taken already", true),
    v3(r#"name="mass""#, r#"name="the mass""#, "no name of the structured naming convention", true),
    v3(r#"name="mass" valueReference="10""#, r#"name="mass" valueReference="1""#, "has the value reference 1 of `force`", true),
    v2(r#"name="mass[2]" valueReference="11""#, r#"name="mass[2]" valueReference="10""#, "can both be set from outside", false),
    // variables
    v2(r#"causality="parameter" variability="fixed""#, r#"causality="parameter" variability="continuous""#, "does not go with variability=\"continuous\"", true),
    v3(r#"causality="output" variability="continuous""#, r#"causality="output" variability="fixed""#, "causality=\"output\" does not go with", true),
    v2(r#"causality="input" variability="continuous""#, r#"causality="input" variability="continuous" initial="exact""#, "an input has no `initial`", false),
    v3(r#"causality="independent""#, r#"causality="independent" initial="exact""#, "the independent variable has no `initial`", true),
    v3(r#"causality="parameter" variability="fixed" initial="exact""#, r#"causality="parameter" variability="fixed" initial="calculated""#, "can only be \"exact\" here", true),
    v2(r#"<ScalarVariable name="enable" valueReference="3" description="on" causality="input" variability="discrete">"#, r#"<ScalarVariable name="enable" valueReference="3" description="on" causality="input">"#, "cannot be continuous", true),
    v2(r#" start="1.5""#, "", "has no start value but needs one", true),
    v3(r#"start="0.0 1.5""#, "", "has no start value but needs one", true),
    v3(r#"start="1.0 2e-7""#, r#"start="1 2 3""#, "3 start values for 2 elements", false),
    v2(r#"unit="rad" displayUnit="deg"/>"#, r#"unit="rad" start="0"/>"#, "must not have a start value", true),
    v3(r#"start="1.0 2e-7""#, r#"start="1.0 -2e-7""#, "is outside min 0", false),
    v2(r#"min="0.0""#, r#"min="1" max="0.5""#, "min 1 is greater than max 0.5", false),
    v2(r#"nominal="0.1""#, r#"nominal="0""#, "nominal 0 must be greater than 0", false),
    v3(r#"declaredType="Law" start="2""#, r#"declaredType="Law" start="3""#, "start value 3 is no item of `Law`", false),
    v3(r#"<Dimension start="2"/>"#, r#"<Dimension start="0"/>"#, "dimension of length 0", false),
    v3(r#"<Float64 name="time" valueReference="0" description="time" causality="independent" variability="continuous" quantity="Time" unit="s"/>"#, "", "no independent variable", true),
    v2(r#"derivative="20""#, r#"derivative="99""#, "derivative=\"99\" leads to no variable", true),
    v3(r#"<Boolean name="enable""#, r#"<Boolean intermediateUpdate="true" name="enable""#, "is not continuous and cannot have intermediateUpdate", false),
    v2(r#"unit="kg" min="0.0" nominal="1.0" start="1.0"/>"#, r#"unit="kg" start="1.0" reinit="true"/>"#, "is no continuous state", false),
    // structure
    v2(r#"<Unknown index="5" dependencies="20"/>"#, "", "output `position[1]` is missing in ModelStructure, Outputs", true),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="99"/>"#, "99 leads to no variable", true),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="5" dependencies="77"/>"#, "the dependency 77 leads to no variable", true),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="5" dependencies="20" dependenciesKind="fixed fixed"/>"#, "1 dependencies but 2 kinds", true),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="5" dependencies="20" dependenciesKind="linear"/>"#, "\"linear\" is not one of", true),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="5" dependencies="7"/>"#, "depends on the output `acceleration[1]`", false),
    v2(r#"<Unknown index="5" dependencies="20"/>"#, r#"<Unknown index="5"/><Unknown index="5"/>"#, "listed twice", false),
    v3(r#"<ContinuousStateDerivative valueReference="23"/>"#, r#"<ContinuousStateDerivative valueReference="21"/>"#, "has no `derivative`", true),
    v3(r#"<InitialUnknown valueReference="19"/>"#, "", "missing in ModelStructure, InitialUnknowns", true),
    v3(r#"<InitialUnknown valueReference="19"/>"#, r#"<InitialUnknown valueReference="19"/><InitialUnknown valueReference="27"/>"#, "event indicator `eventIndicator1` must not be listed", true),
    v3(r#"<EventIndicator valueReference="27"/>"#, r#"<EventIndicator valueReference="9"/>"#, "must be a continuous Float64", false),
    v2("<InitialUnknowns>", r#"<InitialUnknowns><Unknown index="28"/>"#, "28 leads to no variable", true),
    // values that cannot be read
    v2(r#"start="1.5""#, r#"start="1,5""#, "start=\"1,5\" of `Real` (force[2]) is not understood", true),
    v3(r#"causality="output""#, r#"causality="outputs""#, "causality=\"outputs\"", true),
];

fn broken(b: &Break) -> String {
    let xml = written(b.version);
    assert!(xml.contains(b.from), "{} is not in:\n{xml}", b.from);
    xml.replacen(b.from, b.to, 1)
}

#[test]
fn our_own_descriptions_have_no_finding() {
    for version in FmiVersion::ALL {
        assert_eq!(findings(&written(version)), [""; 0]);
    }
}

#[test]
fn every_break_is_found() {
    let silent = |b: &&Break| !findings(&broken(b)).iter().any(|f| f.contains(b.said));
    let missed = BREAKS.iter().filter(silent);
    let missed: Vec<_> =
        missed.map(|b| format!("{} -> {}: {:#?}", b.from, b.to, findings(&broken(b)))).collect();
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn a_finding_names_the_line() {
    let xml = written(FmiVersion::V2);
    let line = xml.lines().position(|l| l.contains("unit=\"kg\"")).unwrap();
    let found = findings(&xml.replacen("unit=\"kg\"", "unit=\"kgs\"", 1));
    // the line of the ScalarVariable around it, counted from 1
    assert!(
        found[0].starts_with(&format!("error: modelDescription.xml, line {line}: variable `mass[1]`")),
        "{found:?}"
    );
}

#[test]
fn aliases_of_fmi_2_may_share_a_value_reference() {
    let xml = written(FmiVersion::V2).replacen(
        r#"name="position[2]" valueReference="5""#,
        r#"name="position[2]" valueReference="4""#,
        1,
    );
    assert_eq!(findings(&xml), [""; 0]);
}

#[test]
fn severity_separates_what_is_forbidden_from_what_surprises() {
    let b = BREAKS.iter().find(|b| b.said.starts_with("depends on the output")).unwrap();
    let d = read(broken(b).as_bytes()).unwrap();
    assert!(check::description(&d).iter().all(|f| f.severity == DescriptionSeverity::Warning));
}

/// Writes the breaks for a comparison with other tools' verdicts into the folder that TRUEUP_DUMP names: folder per
/// break, `expected.txt` with FMPy's.
#[test]
fn dump() {
    let Some(folder) = std::env::var_os("TRUEUP_DUMP").map(std::path::PathBuf::from) else { return };
    for (i, b) in BREAKS.iter().enumerate() {
        let dir = folder.join(format!("breaks/{i:02}"));
        std::fs::create_dir_all(&dir).unwrap();
        std::fs::write(dir.join("modelDescription.xml"), broken(b)).unwrap();
        std::fs::write(dir.join("expected.txt"), format!("{}\n{}", b.fmpy, b.said)).unwrap();
    }
}
