//! A system that is written as SSP comes back as it was.

use std::path::{Path, PathBuf};

use trueup_cosim::system::{CosimSystem, SourceSpan};
use trueup_cosim::{check, write_ssp};

use crate::system::Desk;
use crate::system::ssp::shape;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Folder, name and number of links of each example.
const LOOPS: [(&str, &str, usize); 2] = [("01-joint", "joint", 5), ("02-arm", "arm", 15)];

/// The examples with our models next to them (descriptions only).
fn examples() -> Desk {
    let desk = Desk::new();
    for (folder, name) in LOOPS.iter().map(|(folder, name, _)| (format!("examples/{folder}"), name)) {
        std::fs::create_dir_all(desk.path().join(&folder)).unwrap();
        for file in [format!("{folder}/{name}.toml"), format!("{folder}/{name}.ssd")] {
            std::fs::copy(root().join(&file), desk.path().join(&file)).unwrap();
        }
    }
    for model in ["TwoMassJoint", "PlanarManipulator", "JointController", "ManipulatorController"] {
        let text =
            std::fs::read_to_string(root().join(format!("modelDescription/{model}/fmi3.xml"))).unwrap();
        desk.fmu(&format!("out/{model}.fmi3"), &text);
    }
    desk
}

#[test]
fn the_closed_loops_are_the_same_as_toml_as_ssd_and_packed() {
    let desk = examples();
    for (folder, name, links) in LOOPS {
        let read = |file: PathBuf| CosimSystem::read(&file).map_err(|e| e.to_string()).unwrap();
        let file = |extension: &str| desk.path().join(format!("examples/{folder}/{name}.{extension}"));
        let toml = read(file("toml"));
        let plan = check(&toml).map_err(|e| e.to_string()).unwrap();
        assert_eq!(plan.links.len(), links);
        assert!(plan.notes.is_empty(), "{:?}", plan.notes);
        let from_ssd = check(&read(file("ssd"))).map_err(|e| e.to_string()).unwrap();
        assert_eq!(shape(&from_ssd), shape(&plan), "{name}.ssd");
        write_ssp(&toml, &plan, &file("ssp")).unwrap();
        let from_ssp = check(&read(file("ssp"))).map_err(|e| e.to_string()).unwrap();
        assert_eq!(shape(&from_ssp), shape(&plan), "{name}.ssp");
    }
}

/// The system without the places and with FMUs by their file names only.
fn bare(mut system: CosimSystem) -> CosimSystem {
    system.file = PathBuf::new();
    for c in &mut system.components {
        c.place = SourceSpan::default();
        c.fmu = c.fmu.file_name().unwrap().into();
        for s in &mut c.start {
            (s.place, s.optional) = (SourceSpan::default(), false);
        }
    }
    system.connections.iter_mut().for_each(|c| c.place = SourceSpan::default());
    system.record.iter_mut().for_each(|r| r.place = SourceSpan::default());
    system.run.place = SourceSpan::default();
    if let Some(inputs) = &mut system.inputs {
        (inputs.place, inputs.file) = (SourceSpan::default(), inputs.file.file_name().unwrap().into());
    }
    system
}

#[test]
fn a_system_comes_back_as_it_was_written() {
    let desk = Desk::new();
    desk.write("my drive & more.csv", "time,load\n0,1\n1,2\n");
    let toml = r#"
connections = [
    "a.angle -> b.degrees",
    "a.vector -> b.target",
    "a.vector[2] -> b.u",
    "b.count -> a.wide",
    { from = "b.x", to = "a.u", factor = 2, offset = -1 },
    { from = "b.gear", to = "a.mode", map = { park = "off", drive = "on" } },
    { from = "b.count", to = "c.mode", map = { 0 = "1", 1 = "2" } },
    { from = "b.flag", to = "a.enable", map = { true = "false", false = "true" } },
    { from = "b.angle", to = "a.force", convert-units = false },
]
record = ["a.vector", { variable = "b.angle", as = "<angle>", every = 10 }]
inputs = { file = "my drive & more.csv", columns = { load = "c.u" } }
[run]
start = 0.5
stop = 2
step = 0.005
tolerance = 1e-4
algorithm = "gauss-seidel"
event-rows = false
[components.a]
fmu = "all.fmu"
interface = "co-simulation"
step = 0.01
start = { gain = 1.5, matrix = [1, 2, 3, 4, 5, 6], mode = "on", label = "a, \"b\" <c>\n", enable = true, small = -3 }
[components.b]
fmu = "all.fmu"
[components.c]
fmu = "all.fmu"
"#;
    let system = desk.system(toml).map_err(|e| e.to_string()).unwrap();
    let plan = check(&system).map_err(|e| e.to_string()).unwrap();
    let file = desk.path().join("packed.ssp");
    write_ssp(&system, &plan, &file).unwrap();
    let back = CosimSystem::read(&file).map_err(|e| e.to_string()).unwrap();
    let again = check(&back).map_err(|e| e.to_string()).unwrap();
    assert_eq!(shape(&again), shape(&plan));
    let (mut back, mut system) = (bare(back), bare(system));
    // The text of a number may differ (2.0 for 2), the entries of a table may be in another order.
    system.connections.iter_mut().chain(&mut back.connections).for_each(|c| c.map.sort());
    assert_eq!(back, system);
}

#[test]
fn what_ssp_cannot_say_is_written_so_that_the_plan_stays() {
    let desk = Desk::new();
    let toml = r#"
connections = ["old.v -> all.target", "old.v[1] -> all.force"]
[components.all]
fmu = "all.fmu"
start = { "matrix[2,1]" = 7, gain = { value = 90, unit = "deg" }, n = 2 }
[components.old]
fmu = "old.fmu"
start = { w = [1, 2], m = [3, 4] }
"#;
    let system = desk.system(toml).map_err(|e| e.to_string()).unwrap();
    let plan = check(&system).map_err(|e| e.to_string()).unwrap();
    let file = desk.path().join("packed.ssp");
    write_ssp(&system, &plan, &file).unwrap();
    let again = check(&CosimSystem::read(&file).map_err(|e| e.to_string()).unwrap())
        .map_err(|e| e.to_string())
        .unwrap();
    assert_eq!(shape(&again), shape(&plan));
}
