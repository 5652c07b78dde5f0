//! Inputs from files: each cell arrives unchanged, and what of a file nothing uses is named.

use std::fmt::Write;

use proptest::prelude::*;
use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::{CosimSystem, SourceSpan};
use trueup_cosim::{
    ColumnKind, CosimError, InputFileTable, ResultColumn, ResultRow, ResultSink, Results, RowValues,
    ValueBuffer, check,
};

use crate::system::Desk;

/// A run of `all.fmu` from 0 s to 4 s with this file of inputs.
fn driven(desk: &Desk, file: &str) -> Result<MasterPlan, String> {
    let text = format!("inputs = \"{file}\"\n[components.a]\nfmu = \"all.fmu\"\n");
    let system = CosimSystem::read(&desk.write("s.toml", &text)).map_err(|e| e.to_string())?;
    check(&system).map_err(|e| e.to_string())
}

/// What the variable of this name is driven by, at these times.
fn texts(plan: &MasterPlan, name: &str, times: &[f64]) -> Vec<String> {
    let d = plan.components[0].description();
    let inputs = plan.inputs.as_ref().unwrap();
    let found = plan.driven.iter().find(|x| d.variables[x.to.variable].name == name).unwrap();
    times.iter().map(|t| inputs.text(found.column, *t).unwrap().to_owned()).collect()
}

fn start(plan: &MasterPlan, name: &str) -> ValueBuffer {
    let planned = &plan.components[0];
    let reference = planned.description().find(name).unwrap().value_reference;
    planned.start.iter().find(|b| b.references == [reference]).unwrap().values.clone()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    /// A double has no more than 53 bits; these have 64, through CSV, Parquet, TOML and the command line.
    #[test]
    fn integers_of_64_bits_arrive_to_the_digit(wide in prop::array::uniform2(any::<i64>()), huge in prop::array::uniform2(any::<u64>())) {
        let desk = Desk::new();
        desk.write("in.csv", &format!("time,a.wide,a.huge\n0,{},{}\n2,{},{}\n", wide[0], huge[0], wide[1], huge[1]));
        let file = desk.write("in.parquet", "");
        let mut results = Results::create(&file).unwrap();
        let columns = [ResultColumn::new("a.wide", ColumnKind::Integer, ""), ResultColumn::new("a.huge", ColumnKind::Unsigned, "")];
        results.begin(&columns).unwrap();
        let mut values = RowValues::of(&columns);
        for k in 0..2 {
            (values.integers[0], values.integers[1]) = (wide[k], huge[k].cast_signed());
            results.row(ResultRow { time: 2.0 * k as f64, point: Some(k as u64), values: &values }).unwrap();
        }
        results.finish().unwrap();
        for name in ["in.csv", "in.parquet"] {
            let plan = driven(&desk, name).unwrap();
            prop_assert_eq!(texts(&plan, "wide", &[0.0, 1.9, 2.0]), [wide[0], wide[0], wide[1]].map(|n| n.to_string()));
            prop_assert_eq!(texts(&plan, "huge", &[0.0, 3.0]), huge.map(|n| n.to_string()));
        }
        // TOML's own integers have 63 bits and a sign; larger ones are written as texts.
        let text = format!("[components.a]\nfmu = \"all.fmu\"\nstart = {{ wide = {}, huge = \"{}\" }}\n", wide[0], huge[0]);
        let mut system = CosimSystem::read(&desk.write("s.toml", &text)).unwrap();
        let plan = check(&system).unwrap();
        prop_assert_eq!((start(&plan, "wide"), start(&plan, "huge")), (ValueBuffer::Int64(vec![wide[0]]), ValueBuffer::UInt64(vec![huge[0]])));
        system.set("a.huge", &huge[1].to_string(), &SourceSpan::default()).unwrap();
        prop_assert_eq!(start(&check(&system).unwrap(), "huge"), ValueBuffer::UInt64(vec![huge[1]]));
    }

    /// An array in one cell is an array, whatever it contains.
    #[test]
    fn arrays_in_a_cell_are_taken_element_by_element(x in prop::array::uniform4(-1e3..1e3)) {
        let desk = Desk::new();
        desk.write("in.csv", &format!("time,a.target\n0,{:?} {:?}\n2,{:?} {:?}\n", x[0], x[1], x[2], x[3]));
        let plan = driven(&desk, "in.csv").unwrap();
        let inputs = plan.inputs.as_ref().unwrap();
        for d in &plan.driven {
            prop_assert_eq!([0.0, 2.0].map(|t| inputs.at(d.column, t, d.linear)), [x[d.to.element], x[2 + d.to.element]]);
        }
        prop_assert_eq!(plan.driven.len(), 2);
    }
}

#[test]
fn texts_items_and_truth_values_are_taken_as_they_stand() {
    let desk = Desk::new();
    desk.write(
        "in.csv",
        "time,a.label,a.mode,a.enable,a.small\n0,\"foo, bar\",on,True,-7\n1,1.50,1,false,8.0\n",
    );
    let plan = driven(&desk, "in.csv").unwrap();
    let of = |name: &str| texts(&plan, name, &[0.0, 1.0]);
    assert_eq!(of("label"), ["foo, bar", "1.50"]);
    assert_eq!(
        (of("mode"), of("enable"), of("small")),
        (
            ["2", "1"].map(str::to_owned).to_vec(),
            ["1", "0"].map(str::to_owned).to_vec(),
            ["-7", "8"].map(str::to_owned).to_vec()
        )
    );
    for (cell, said) in [
        ("a.mode\n0,up", "line 2, a.mode: \"up\" is no Enumeration; expected: off, on"),
        ("a.mode\n0,3", "\"3\" is no"),
        ("a.u\n0,on", "line 2, a.u: \"on\" is no number"),
    ] {
        desk.write("in.csv", &format!("time,{cell}\n"));
        let why = driven(&desk, "in.csv").map(|_| ()).unwrap_err();
        assert!(why.contains(said), "{why}");
    }
}

#[test]
fn a_tunable_parameter_changes_and_its_unit_counts() {
    let desk = Desk::new();
    desk.write("in.csv", "time,a.knob [mm]\n0,500\n1,1500\n");
    let plan = driven(&desk, "in.csv").unwrap();
    let (inputs, d) = (plan.inputs.as_ref().unwrap(), plan.driven[0]);
    assert!(!d.linear, "it changes at events");
    assert_eq!([0.0, 0.9, 1.0].map(|t| inputs.at(d.column, t, d.linear)), [0.5, 0.5, 1.5]);
    assert!(plan.notes.iter().any(|n| n.contains("mm converted to m")), "{:?}", plan.notes);
    desk.write("in.csv", "time,a.knob [kg]\n0,500\n");
    assert!(
        driven(&desk, "in.csv").map(|_| ()).unwrap_err().contains("it is in kg (kg), the variable in m (m)")
    );
}

/// Every variable that is no input, in a column: named with its causality.
#[test]
fn what_drives_nothing_is_named() {
    let desk = Desk::new();
    let cases = [
        ("x", "an output"),
        ("gain", "a parameter that is fixed during a run"),
        ("matrix[1,2]", "a parameter that is fixed during a run"),
        ("fixed", "computed by the FMU"),
    ];
    for (name, what) in cases {
        desk.write("in.csv", &format!("time,a.u,\"a.{name}\"\n0,1,2\n4,1,2\n"));
        let plan = driven(&desk, "in.csv").unwrap();
        let note = plan.notes.iter().find(|n| n.contains("drive nothing")).unwrap();
        assert!(note.contains(&format!("`a.{name}` ({what}")) && !note.contains("a.u"), "{note}");
    }
}

/// Files whose times are outside the run, at drawn places.
#[test]
fn times_beside_the_run_are_named() {
    let desk = Desk::new();
    let mut state = 1_u64;
    let mut draw = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / f64::from(1 << 24)
    };
    for _ in 0..20 {
        let (from, length) = (10.0 * draw() - 4.0, 0.1 + 8.0 * draw());
        let mut text = "time,a.u\n".to_owned();
        (0..5).for_each(|k| writeln!(text, "{},{k}", from + length * f64::from(k) / 4.0).unwrap());
        desk.write("in.csv", &text);
        let plan = driven(&desk, "in.csv").unwrap();
        let says = |part: &str| plan.notes.iter().any(|n| n.contains(part));
        let to = from + length;
        let beside = from > 4.0 || to < 0.0;
        assert_eq!(says("no row of it is within the run"), beside, "{from} to {to}: {:?}", plan.notes);
        assert_eq!(
            says("what comes later is not used"),
            !beside && to > 4.0,
            "{from} to {to}: {:?}",
            plan.notes
        );
        assert_eq!(says("held from there on"), !beside && to < 4.0, "{from} to {to}: {:?}", plan.notes);
    }
    desk.write("in.csv", "time,a.u\n1709294400.5,1\n1709294402.5,3\n");
    let plan = driven(&desk, "in.csv").unwrap();
    let inputs = plan.inputs.as_ref().unwrap();
    assert_eq!((inputs.at(0, 1.0, true), inputs.end), (2.0, 2.0));
    assert!(plan.notes.iter().any(|n| n.contains("Unix time in s")), "{:?}", plan.notes);
}

/// A sidecar next to inputs counts; the system's own file, of the same name, is none.
#[test]
fn a_sidecar_counts_and_the_system_is_none() {
    let desk = Desk::new();
    desk.write("in.csv", "t,i\n0,1\n1000,3\n");
    desk.write(
        "in.toml",
        "[columns]\nt = { variable = \"time\", unit = \"ms\" }\ni = { variable = \"a.u\", scale = 2.0, offset = 1.0 }\n[channels.\"a.u\"]\ninterpolation = \"hold\"\n",
    );
    let plan = driven(&desk, "in.csv").unwrap();
    let (inputs, d) = (plan.inputs.as_ref().unwrap(), plan.driven[0]);
    assert_eq!([0.0, 0.5, 1.0].map(|t| inputs.at(d.column, t, d.linear)), [3.0, 3.0, 7.0]);
    desk.write("s.csv", "time,a.u\n0,1\n4,3\n");
    assert!(driven(&desk, "s.csv").is_ok(), "s.toml is the system");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// The line of a mistake is a field of the error, and is after the file in its text.
    #[test]
    fn an_error_of_inputs_has_its_line(rows in 2_usize..9, wrong in 0_usize..9, comments in 0_usize..3) {
        let wrong = wrong % rows;
        let desk = Desk::new();
        let mut text = "# a comment\n".repeat(comments) + "time,a.x\n";
        for k in 0..rows {
            writeln!(text, "{k},1{}", if k == wrong { ",2" } else { "" }).unwrap();
        }
        let file = desk.write("in.csv", &text);
        let error = InputFileTable::read(&file, &desk.write("s.toml", ""), None).unwrap_err();
        let at = (comments + 2 + wrong) as u64;
        let CosimError::Inputs { line, ref reason, .. } = error else { panic!("{error}") };
        prop_assert_eq!(line, Some(at), "{}", text);
        prop_assert!(!reason.starts_with(':'));
        prop_assert_eq!(error.to_string(), format!("{}:{at}: {reason}", file.display()));
    }
}

#[test]
fn an_error_of_inputs_without_a_line_has_none() {
    let desk = Desk::new();
    let file = desk.0.path().join("none.csv");
    let error = InputFileTable::read(&file, &desk.write("s.toml", ""), None).unwrap_err();
    let CosimError::Inputs { line: None, ref reason, .. } = error else { panic!("{error:?}") };
    assert_eq!(error.to_string(), format!("{}: {reason}", file.display()));
}
