//! Systems: an FMU of two masses' worth of variables, without a library.

use std::path::{Path, PathBuf};

use tempfile::TempDir;
use trueup_cosim::check;
use trueup_cosim::system::CosimSystem;
use trueup_scaling::{GivenExponent, ScalingLaw, system};

/// Its own values: mass 4 kg, spring 8 N/m, motor 2 N/A, offset 1 m, gravity a constant.
const PLANT: &str = r#"<?xml version="1.0"?>
<fmiModelDescription fmiVersion="3.0" modelName="plant" instantiationToken="t">
  <CoSimulation modelIdentifier="plant" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="kg"><BaseUnit kg="1"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
    <Unit name="N/m"><BaseUnit kg="1" s="-2"/></Unit>
    <Unit name="N/A"><BaseUnit kg="1" m="1" s="-2" A="-1"/></Unit>
    <Unit name="A"><BaseUnit A="1"/></Unit>
    <Unit name="m"><BaseUnit m="1"/></Unit>
    <Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit>
  </UnitDefinitions>
  <DefaultExperiment stopTime="4" stepSize="0.01"/>
  <ModelVariables>
    <Float64 name="time" valueReference="0" causality="independent" variability="continuous"/>
    <Float64 name="mass" valueReference="1" causality="parameter" variability="fixed" unit="kg" start="4"/>
    <Float64 name="stiffness" valueReference="2" causality="parameter" variability="fixed" unit="N/m" start="8"/>
    <Float64 name="motor" valueReference="3" causality="parameter" variability="fixed" unit="N/A" start="2"/>
    <Float64 name="current" valueReference="4" causality="input" unit="A" start="0"/>
    <Float64 name="force" valueReference="5" causality="input" unit="N" start="0"/>
    <Float64 name="place" valueReference="6" causality="output" initial="exact" unit="m" start="1"/>
    <Float64 name="reaction" valueReference="7" causality="output" unit="N"/>
    <Float64 name="lengths" valueReference="8" causality="parameter" variability="fixed" unit="m" start="1 2 3"><Dimension start="3"/></Float64>
    <Float64 name="gravity" valueReference="9" causality="local" variability="constant" unit="m/s2" start="9.81"/>
    <Int32 name="count" valueReference="10" causality="parameter" variability="fixed" start="7"/>
    <Float64 name="odd" valueReference="11" causality="parameter" variability="fixed" start="0"/>
  </ModelVariables>
  <ModelStructure><Output valueReference="6"/><Output valueReference="7"/></ModelStructure>
</fmiModelDescription>"#;

const SYSTEM: &str = r#"# two of a kind
connections = [
    "a.reaction -> b.force", # by contact
    { from = "b.reaction", to = "a.force", offset = 3.0 },
]

[run]
stop = 2 # s

[components.a]
fmu = "plant"
start = { mass = 10, "lengths[2]" = 5.0, count = 3 }

[components.b]
fmu = "plant"

[components.b.start]
stiffness = { value = 16, unit = "N/m" } # hard
"#;

fn desk() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("plant")).unwrap();
    std::fs::write(folder.path().join("plant/modelDescription.xml"), PLANT).unwrap();
    let file = folder.path().join("s.toml");
    std::fs::write(&file, SYSTEM).unwrap();
    (folder, file)
}

fn law(back: bool, given: &[(&str, f64)]) -> ScalingLaw {
    let given =
        given.iter().map(|(name, exponent)| GivenExponent { name: (*name).into(), exponent: *exponent });
    ScalingLaw { lambda: 0.5, back, given: given.collect() }
}

fn emitted(file: &Path, law: &ScalingLaw, to: &Path) -> Result<String, String> {
    let read = CosimSystem::read(file).map_err(|e| e.to_string())?;
    let scaled = system::scale(&read, law).map_err(|e| e.to_string())?;
    let single = file.is_dir();
    let text = if single { String::new() } else { std::fs::read_to_string(file).unwrap() };
    system::toml(&scaled, &text, file, to, None).map_err(|e| e.to_string())
}

/// By hand: kg 1/8, N/m 1/2, N/A (A = 0) 1/4, m 1/2, N 1/4, s 1/2.
#[test]
fn what_is_said_changes_in_place_and_what_is_not_is_added() {
    let (_folder, file) = desk();
    let text = emitted(&file, &law(false, &[("A", 0.0)]), &file).unwrap();
    let by_hand = r#"# two of a kind
connections = [
    "a.reaction -> b.force", # by contact
    { from = "b.reaction", to = "a.force", offset = 0.75 },
]

[run]
stop = 1.0 # s
step = 0.005

[components.a]
fmu = "plant"

[components.a.start]
mass = 1.25
"lengths[2]" = 2.5
count = 3
stiffness = 4.0
motor = 0.5
place = 0.5
"lengths[1]" = 0.5
"lengths[3]" = 1.5

[components.b]
fmu = "plant"

[components.b.start]
stiffness = { value = 8.0, unit = "N/m" } # hard
mass = 0.5
motor = 0.5
place = 0.5
lengths = [0.5, 1.0, 1.5]
"#;
    let tidy = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ").replace(" ,", ",");
    assert_eq!(tidy(&text), tidy(by_hand), "{text}");
}

/// Scaled and scaled back, the system is the first one with its FMUs' values written out.
#[test]
fn back_undoes_it() {
    let (_folder, file) = desk();
    let there = emitted(&file, &law(false, &[("A", 0.0)]), &file).unwrap();
    std::fs::write(&file, there).unwrap();
    let back = emitted(&file, &law(true, &[("A", 0.0)]), &file).unwrap();
    std::fs::write(&file, back).unwrap();
    let system = CosimSystem::read(&file).unwrap();
    let value = |component: usize, name: &str| {
        let start = system.components[component].start.iter().find(|s| s.variable == name).unwrap();
        start.values.iter().map(|t| t.parse().unwrap()).collect::<Vec<f64>>()
    };
    assert_eq!(
        (value(0, "mass"), value(0, "stiffness"), value(0, "motor")),
        (vec![10.0], vec![8.0], vec![2.0])
    );
    assert_eq!((value(1, "stiffness"), value(1, "lengths")), (vec![16.0], vec![1.0, 2.0, 3.0]));
    assert_eq!((value(0, "lengths[2]"), value(0, "count")), (vec![5.0], vec![3.0]));
    assert_eq!(
        (system.run.stop, system.run.step, system.connections[1].offset),
        (Some(2.0), Some(0.01), 3.0)
    );
    check(&system).unwrap();
}

#[test]
fn an_fmu_becomes_a_system_with_its_values_wherever_that_lies() {
    let (folder, _) = desk();
    let below = folder.path().join("below");
    std::fs::create_dir(&below).unwrap();
    let to = below.join("bench.toml");
    let text = emitted(&folder.path().join("plant"), &law(false, &[("A", 0.0)]), &to).unwrap();
    assert!(
        text.contains("fmu = \"../plant\"") && text.contains("stop = 2.0") && text.contains("mass = 0.5\n"),
        "{text}"
    );
    std::fs::write(&to, text).unwrap();
    let plan = check(&CosimSystem::read(&to).unwrap()).unwrap();
    assert_eq!((plan.grid.stop, plan.grid.step), (2.0, 0.005));
}

#[test]
fn a_constant_that_should_scale_is_told() {
    let (_folder, file) = desk();
    let scaled = system::scale(&CosimSystem::read(&file).unwrap(), &law(false, &[("A", 0.0)])).unwrap();
    assert_eq!(scaled.notes.len(), 2);
    assert!(
        scaled.notes[0].starts_with("`a.gravity` (m/s2) is a constant of its FMU: it stays"),
        "{:?}",
        scaled.notes
    );
}

#[test]
fn all_that_has_no_law_is_named_with_line_variable_and_mend() {
    let (folder, file) = desk();
    let why = emitted(&file, &law(false, &[]), &file).unwrap_err();
    let lines: Vec<&str> = why.lines().collect();
    assert_eq!(lines.len(), 2, "{why}");
    assert!(lines[0].ends_with("s.toml:10: `a.motor` in N/A: the scale of A is not defined; give an exponent with --exponent A=W, or of this one alone with --exponent a.motor=W; the value is the FMU's own"), "{why}");
    assert!(lines[1].contains("s.toml:14: `b.motor`"), "{why}");
    // Given for the one, the other is still refused.
    let why = emitted(&file, &law(false, &[("a.motor", 2.0)]), &file).unwrap_err();
    assert_eq!(why.lines().count(), 1, "{why}");
    // A current that is 0 is 0 at any size; one that is given is not.
    std::fs::write(&file, SYSTEM.replace("mass = 10,", "mass = 10, current = 1,")).unwrap();
    let why = emitted(&file, &law(false, &[("a.motor", 2.0), ("b.motor", 2.0)]), &file).unwrap_err();
    assert!(why.contains("s.toml:12: `a.current` in A: the scale of A is not defined"), "{why}");
    // Two units on one connection.
    std::fs::write(
        &file,
        SYSTEM.replace(
            "\"a.reaction -> b.force\"",
            "{ from = \"a.place\", to = \"b.force\", convert-units = false }",
        ),
    )
    .unwrap();
    let text = emitted(&file, &law(false, &[("A", 0.0)]), &file).unwrap();
    assert!(text.contains("to = \"b.force\", convert-units = false , factor = 0.5 }"), "{text}");
    drop(folder);
}
