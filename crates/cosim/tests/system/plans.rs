//! What a right system becomes.

use trueup_cosim::ValueBuffer;
use trueup_cosim::check;
use trueup_cosim::plan::{ElementIndex, MasterPlan};
use trueup_cosim::system::{Algorithm, ComponentInterface, CosimSystem};

use crate::system::Desk;

fn element(component: usize, variable: usize, element: usize) -> ElementIndex {
    ElementIndex { component, variable, element }
}

/// Position of a variable in `all.fmu`.
fn at(plan: &MasterPlan, component: usize, name: &str) -> usize {
    plan.components[component].description().position(name).unwrap()
}

#[test]
fn everything_a_system_can_say() {
    let desk = Desk::new();
    desk.write("drive.csv", "time,load\n0,1\n1,2\n");
    let plan = desk
        .plan(
            r#"
connections = [
    "left.angle -> right.degrees",
    "left.vector -> right.target",
    "left.vector[2] -> right.u",
    "left.der(x) -> right.odd",
    "right.flag -> left.enable",
    { from = "right.count", to = "left.wide" },
    { from = "right.x", to = "left.u", factor = 2, offset = -1 },
    { from = "right.warm", to = "left.celsius" },
    { from = "right.gear", to = "left.mode", map = { park = "off", drive = "on" } },
    { from = "right.angle", to = "left.force", convert-units = false },
    { from = "right.rate", to = "left.speed" },
    "old.v -> left.target",
]
record = ["left.vector", { variable = "right.angle", as = "angle", every = 10 }, { variable = "right.vector[2]", as = "second" }]
inputs = { file = "drive.csv", columns = { load = ["old.w[1]", "old.w[2]"] } }
[run]
stop = 2
step = 0.005
tolerance = 1e-4
algorithm = "gauss-seidel"
[components.left]
fmu = "all.fmu"
step = 0.01
start = { gain = { value = 90, unit = "deg" }, "matrix[2,1]" = 7, mode = "on", label = "a, b" }
[components.right]
fmu = "all.fmu"
start.matrix = [[1, 2, 3], [4, 5, 6]]
[components.old]
fmu = "old.fmu"
start = { m = [1.5, 2.5] }
"#,
        )
        .map_err(|e| e.to_string())
        .unwrap();
    let names: Vec<&str> = plan.components.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["left", "right", "old"]);
    assert_eq!(plan.components.iter().map(|c| c.every).collect::<Vec<_>>(), [2, 1, 1]);
    assert_eq!(plan.components[2].interface, ComponentInterface::ModelExchange);
    assert!(
        std::sync::Arc::ptr_eq(&plan.components[0].fmu, &plan.components[1].fmu),
        "an FMU is opened once"
    );
    assert_eq!((plan.grid.stop, plan.grid.step, plan.grid.steps), (2.0, 0.005, 400));
    assert_eq!((plan.tolerance, plan.algorithm), (Some(1e-4), Some(Algorithm::GaussSeidel)));

    let link = |from: &str, to: &str| {
        let same = |port: &str, e: ElementIndex| {
            let (c, v) = port.split_once('.').unwrap();
            names[e.component] == c
                && plan.components[e.component].description().variables[e.variable].name == v
        };
        plan.links.iter().filter(|l| same(from, l.from) && same(to, l.to)).copied().collect::<Vec<_>>()
    };
    let degrees = link("left.angle", "right.degrees")[0];
    assert!((degrees.factor * std::f64::consts::PI - 180.0).abs() < 1e-12 && degrees.offset == 0.0);
    let vector: Vec<_> =
        link("left.vector", "right.target").iter().map(|l| (l.from.element, l.to.element)).collect();
    assert_eq!(vector, [(0, 0), (1, 1)]);
    assert_eq!(link("left.vector", "right.u")[0].from.element, 1);
    let scaled = link("right.x", "left.u")[0];
    assert_eq!((scaled.factor, scaled.offset), (2.0, -1.0));
    let celsius = link("right.warm", "left.celsius")[0];
    assert_eq!((celsius.factor, celsius.offset), (1.0, -273.15));
    let gear = link("right.gear", "left.mode")[0];
    let mut map = plan.maps[gear.map.unwrap()].clone();
    map.sort_unstable();
    assert_eq!((map, plan.maps.len()), (vec![(1, 1), (5, 2)], 1));
    let forced = link("right.angle", "left.force")[0];
    assert_eq!((forced.factor, forced.offset, forced.map), (1.0, 0.0, None));
    // An array of FMI 2.0 is one variable per element.
    assert_eq!([link("old.v[1]", "left.target").len(), link("old.v[2]", "left.target").len()], [1, 1]);
    assert_eq!(link("old.v[2]", "left.target")[0].to.element, 1);
    assert_eq!(plan.driven.len(), 2);
    assert_eq!(
        (plan.driven[1].to, plan.driven[1].column, plan.driven[1].linear),
        (element(2, 3, 0), 0, true)
    );

    let columns: Vec<_> = plan.recorded.iter().map(|r| (r.name.as_str(), r.every)).collect();
    assert_eq!(columns, [("left.vector[1]", 1), ("left.vector[2]", 1), ("angle", 10), ("second", 1)]);
    assert_eq!(plan.recorded[3].from, element(1, at(&plan, 1, "vector"), 1));

    let start = |c: usize, name: &str| {
        let reference = plan.components[c].description().find(name).unwrap().value_reference;
        plan.components[c].start.iter().find(|b| b.references == [reference]).unwrap().values.clone()
    };
    let ValueBuffer::Float64(gain) = start(0, "gain") else { panic!() };
    assert!((gain[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    assert_eq!(start(0, "matrix"), ValueBuffer::Float64(vec![1.0, 2.0, 3.0, 7.0, 5.0, 6.0]));
    assert_eq!(start(0, "mode"), ValueBuffer::Int64(vec![2]));
    assert_eq!(start(0, "label"), ValueBuffer::String(vec!["a, b".into()]));
    assert_eq!(start(1, "matrix"), ValueBuffer::Float64(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
    assert_eq!(start(2, "m[1,2]"), ValueBuffer::Float64(vec![2.5]));
    let notes = plan.notes.join("\n");
    for said in [
        "`left.angle` -> `right.degrees`: rad converted to deg (times 57.2957795",
        "`right.warm` -> `left.celsius`: K converted to degC (times 1.0, plus -273.15)",
        "`right.flag` -> `left.enable`",
        "`right.count` -> `left.wide`: Int32 is handed on as Int64, without loss",
        "`right.rate` -> `left.speed`: Hz is handed on as rad/s (rad counts as 1)",
    ] {
        assert_eq!(notes.contains(said), said != "`right.flag` -> `left.enable`", "{said}\n{notes}");
    }
}

#[test]
fn structural_parameters_size_arrays() {
    let desk = Desk::new();
    let plan = desk
        .plan("[components.a]\nfmu = \"all.fmu\"\nstart = { target = [1, 2, 3], n = 3 }\n")
        .map_err(|e| e.to_string())
        .unwrap();
    let part = &plan.components[0];
    assert_eq!(part.structural.len(), 1);
    assert_eq!(part.structural[0].values, ValueBuffer::UInt64(vec![3]));
    assert_eq!(
        part.start.iter().map(|b| b.values.clone()).collect::<Vec<_>>(),
        [ValueBuffer::Float64(vec![1.0, 2.0, 3.0])]
    );
    assert_eq!(plan.recorded.iter().filter(|r| r.name.starts_with("a.vector[")).count(), 3);
    let v = part.description().find("vector").unwrap();
    assert_eq!((part.description().elements(v), part.fmu.description().elements(v)), (Some(3), Some(2)));
}

#[test]
fn a_single_fmu_is_a_system_whose_names_have_no_component() {
    let desk = Desk::new();
    desk.write("in.csv", "time,u,target[2],x\n0,1,2,9\n");
    let mut system = CosimSystem::read(&desk.path().join("all.fmu")).unwrap();
    system.inputs =
        Some(trueup_cosim::system::InputFile { file: desk.path().join("in.csv"), ..Default::default() });
    let plan = check(&system).map_err(|e| e.to_string()).unwrap();
    assert_eq!(plan.components[0].name, "");
    let (u, target) = (at(&plan, 0, "u"), at(&plan, 0, "target"));
    assert_eq!(
        plan.driven.iter().map(|d| d.to).collect::<Vec<_>>(),
        [element(0, u, 0), element(0, target, 1)]
    );
    let columns: Vec<_> = plan.recorded.iter().map(|r| r.name.as_str()).collect();
    assert_eq!(columns[0], "angle");
    assert!(columns.contains(&"vector[2]") && !columns.contains(&"blob"), "{columns:?}");
    // The default experiment.
    assert_eq!((plan.grid.start, plan.grid.stop, plan.grid.step), (0.0, 4.0, 0.01));
}

#[test]
fn the_smallest_default_step_and_the_latest_stop_are_taken_and_said() {
    let desk = Desk::new();
    let slow = r#"<fmiModelDescription fmiVersion="2.0" modelName="slow" guid="g"><CoSimulation modelIdentifier="m"/>
        <DefaultExperiment startTime="0" stopTime="9" stepSize="0.5"/><ModelVariables/><ModelStructure/></fmiModelDescription>"#;
    desk.fmu("slow", slow);
    let plan = desk
        .plan("[components.a]\nfmu = \"all.fmu\"\n[components.s]\nfmu = \"slow.fmu\"\nstep = 0.5\n")
        .map_err(|e| e.to_string())
        .unwrap();
    assert_eq!((plan.grid.stop, plan.grid.step), (9.0, 0.01));
    assert_eq!(plan.components[1].every, 50);
    let notes = plan.notes.join("\n");
    assert!(notes.contains("stop 9 s: from the default experiment of `s`"), "{notes}");
    assert!(notes.contains("communication step 0.01 s: that of `a`, the smallest"), "{notes}");
}

#[test]
fn names_may_contain_dots() {
    let desk = Desk::new();
    let toml = "connections = ['outer.inner.x -> outer.u']\n[components.'outer.inner']\nfmu = \"all.fmu\"\n[components.outer]\nfmu = \"all.fmu\"\nstart.a.b = 1\n";
    let system = desk.system(toml).map_err(|e| e.to_string()).unwrap();
    let connection = &system.connections[0];
    assert_eq!((connection.from.component.as_str(), connection.from.variable.as_str()), ("outer.inner", "x"));
    assert_eq!(system.components[1].start[0].variable, "a.b");
}

#[test]
fn a_large_system_is_checked_in_linear_time() {
    let desk = Desk::new();
    let build = |n: usize| {
        let mut text = String::from("connections = [\n");
        for i in 0..n {
            text += &format!("'c{i}.x -> c{}.u',\n'c{i}.vector -> c{}.target',\n", (i + 1) % n, (i + 1) % n);
        }
        text += "]\n";
        (0..n).for_each(|i| {
            text += &format!(
                "[components.c{i}]\nfmu = \"all.fmu\"\nstart = {{ gain = 1.5, 'matrix[1,2]' = 3 }}\n"
            )
        });
        text
    };
    let plan = desk.plan(&build(1000)).map_err(|e| e.to_string()).unwrap();
    assert_eq!((plan.components.len(), plan.links.len()), (1000, 3000));
}
