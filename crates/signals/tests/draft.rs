//! Drafts of cases from logs with names, units and clocks of their own: what is recognised, what is marked, what is refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use crate::common::{joint, says};
use trueup_signals::draft::{CaseDraft, DraftLogs, DraftModel, DraftParameter};
use trueup_signals::{Case, FindingKind, Severity, SignalVariable, SignalsError, VariableRole};

fn model() -> DraftModel {
    let mut known = joint();
    known.iter_mut().filter(|v| v.name == "motorCurrent").for_each(|v| v.drives = true);
    let parameter =
        DraftParameter { name: "stiffness".into(), unit: "N.m/rad".into(), value: "3.07e-5".into() };
    DraftModel {
        name: "TwoMassJoint".into(),
        known,
        parameters: vec![parameter],
        preset: "x".into(),
        ..DraftModel::default()
    }
}

fn arm() -> DraftModel {
    let mut known = Vec::new();
    for k in 1..=2 {
        let torque = SignalVariable::new(&format!("jointTorque[{k}]"), "N.m", VariableRole::Input);
        known.push(SignalVariable { drives: true, ..torque });
        for (name, unit) in [("jointAngle", "rad"), ("jointVelocity", "rad/s"), ("motorAngle", "rad")] {
            known.push(SignalVariable::new(&format!("{name}[{k}]"), unit, VariableRole::Output));
        }
    }
    known.push(SignalVariable::new("baseAttitude", "rad", VariableRole::Output));
    DraftModel { name: "PlanarManipulator".into(), known, ..DraftModel::default() }
}

/// A log of 400 rows: its head, then cells by time in s.
fn log(head: &str, row: impl Fn(f64) -> String) -> String {
    let rows: String = (0..400).map(|k| row(0.005 * f64::from(k)) + "\n").collect();
    format!("{head}\n{rows}")
}

struct Tried(tempfile::TempDir, Vec<PathBuf>);

impl Tried {
    fn of(files: &[(&str, String)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let write = |(name, text): &(&str, String)| {
            let file = folder.path().join(name);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(&file, text).unwrap();
            file
        };
        let files = files.iter().map(write).collect();
        Self(folder, files)
    }
    fn draft(&self, model: &DraftModel) -> Result<CaseDraft, SignalsError> {
        DraftLogs::look(&self.1, None, None)?.draft(model, &BTreeMap::new())
    }
    fn text(&self, model: &DraftModel) -> String {
        let draft = self.draft(model).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(draft.file, self.0.path().join("case.toml"));
        fs::write(&draft.file, &draft.text).unwrap();
        // What is drafted is read.
        Case::load(self.0.path(), |_| Ok(model.known.clone()))
            .unwrap_or_else(|e| panic!("{e}\n{}", draft.text));
        draft.text
    }
}

fn has(text: &str, line: &str) {
    assert!(text.lines().any(|l| l.starts_with(line)), "no line {line:?} in\n{text}");
}

#[test]
fn units_in_names_and_a_clock_in_ms() {
    let row =
        |t: f64| format!("{},{},{},{},x", 1e3 * t, 800.0 * (9.0 * t).sin(), 900.0 * t.sin(), 3.0 * t.sin());
    let head = "t_ms,current_mA,motor_pos_deg,load_angle_rad,mode";
    let text = Tried::of(&[("a.csv", log(head, row)), ("b.csv", log(head, |t| row(0.7 * t)))]).text(&model());
    for line in [
        "model = \"TwoMassJoint\"",
        "train = [\"a.csv\"]",
        "holdout = [\"b.csv\"]   # GUESS",
        "\"t_ms\" = { variable = \"time\", unit = \"ms\" }",
        "\"current_mA\" = { variable = \"motorCurrent\", unit = \"mA\" }",
        "\"motor_pos_deg\" = { variable = \"motorAngle\", unit = \"deg\" }",
        "\"load_angle_rad\" = \"loadAngle\"",
        "\"mode\" = false   # no numbers",
        "# stiffness = 3.07e-5   # N.m/rad",
    ] {
        has(&text, line);
    }
    let mapped = |l: &&str| l.starts_with('"') && l.contains("GUESS");
    assert_eq!(text.lines().filter(mapped).count(), 0, "nothing of the columns is guessed\n{text}");
}

#[test]
fn names_without_units_or_sides_are_guesses() {
    let row = |t: f64| format!("{t},{},{},{}", (3.0 * t).sin(), 2.0 * t.sin(), 100.0 * t.sin());
    let text = Tried::of(&[("a.csv", log("Time,tau,q1,q2", row))]).text(&model());
    has(&text, "\"Time\" = \"time\"");
    // The one that turns more is the motor's; a torque is no current.
    has(&text, "\"q2\" = \"motorAngle\"   # GUESS: ");
    has(&text, "\"q1\" = \"loadAngle\"   # GUESS: ");
    has(&text, "\"tau\" = false");
    has(&text, "# TODO: no column was recognised as `motorCurrent` (A)");
    has(&text, "# holdout");
}

#[test]
fn numbered_columns_of_an_arm_counted_from_0_or_1() {
    let row = |t: f64| format!("{t},{},{},{},{}", t.sin(), t.cos(), (3.0 * t).sin(), (2.0 * t).sin());
    for head in [
        "time,q1,q2,tau_1,tau_2",
        "time,q0,q1,tau_0,tau_1",
        "time,joint_pos[1],joint_pos[2],effort[1],effort[2]",
        "time,joint_0_pos,joint_1_pos,joint_0_torque,joint_1_torque",
        "time,axis1_angle,axis2_angle,axis1_tau_Nm,axis2_tau_Nm",
    ] {
        let text = Tried::of(&[("a.csv", log(head, row))]).text(&arm());
        for (column, variable) in head.split(',').skip(1).zip([
            "jointAngle[1]",
            "jointAngle[2]",
            "jointTorque[1]",
            "jointTorque[2]",
        ]) {
            has(&text, &format!("{column:?} = {variable:?}"));
        }
    }
}

#[test]
fn rest_repeats_counts_and_holds_are_seen() {
    let count = std::f64::consts::TAU / 4096.0;
    let motion = |t: f64| {
        format!("{t},{},{}", (20.0 * t).floor().sin(), ((0.6 * t).sin() * 0.08 / count).round() * count)
    };
    let still = |t: f64| format!("{t},0,{}", count * ((t * 1e4).sin() * 0.7).round());
    let logs = [
        ("a.csv", log("time,motorCurrent,motorAngle", motion)),
        ("b.csv", log("time,motorCurrent,motorAngle", motion).replace("0.995,", "0.9951,")),
        ("still.csv", log("time,motorCurrent,motorAngle", still)),
    ];
    let text = Tried::of(&logs).text(&model());
    has(&text, "rest = [\"still.csv\"]");
    has(&text, "repeats = [[\"a.csv\", \"b.csv\"]]   # GUESS");
    has(&text, "resolution = 0.00153398");
    has(&text, "interpolation = \"hold\"   # GUESS");
    assert!(!text.contains("[columns]"), "names of variables need no mapping\n{text}");
}

#[test]
fn a_coarse_clock_gives_a_rate() {
    let row = |of: f64| {
        move |t: f64| {
            let step = ((t / 0.005).round() / of).floor();
            format!("{},{},{}", step * 0.02, (9.0 * t).sin(), t.sin())
        }
    };
    let logs = |of: [f64; 2]| {
        ["a.csv", "b.csv"]
            .into_iter()
            .zip(of.map(|of| log("time,motorCurrent,motorAngle", row(of))))
            .collect()
    };
    let equal: Vec<_> = logs([4.0, 4.0]);
    has(&Tried::of(&equal).text(&model()), "rate = 200   # GUESS");
    // Rates that differ are no rate of all: the reader refuses the clocks.
    for of in [[4.0, 8.0], [4.0, 1.0], [1.0, 4.0]] {
        let other: Vec<_> = logs(of);
        says("rates", &refused(&other), Severity::Error, FindingKind::ClockRepeats, &["`rate = N`"]);
    }
}

#[test]
fn a_rate_of_the_user_is_written_as_given() {
    let tried =
        Tried::of(&[("a.csv", log("time,motorCurrent,motorAngle", |t| format!("{t},{},{t}", t.sin())))]);
    let logs = DraftLogs::look(&tried.1, None, Some(1000.1234567)).unwrap();
    has(&logs.draft(&model(), &BTreeMap::new()).unwrap().text, "rate = 1000.1234567");
}

#[test]
fn a_log_with_other_columns_has_a_table_of_its_own() {
    let a = log("time,i_A,enc_deg", |t| format!("{t},{},{}", (9.0 * t).sin(), t.sin()));
    let b = log("time,i_A,enc_deg,motor_pos", |t| format!("{t},{},{},{}", (7.0 * t).sin(), t.sin(), t.cos()));
    let text = Tried::of(&[("x/a.csv", a), ("x/b.csv", b)]).draft(&model()).unwrap().text;
    has(&text, "\"enc_deg\" = { variable = \"motorAngle\", unit = \"deg\" }");
    has(&text, "\"motor_pos\" = \"motorAngle\"   # GUESS: its unit is not given: taken as rad");
    // Next to the motor's angle the other one is the load's.
    has(&text, "[columns.\"b.csv\"]");
    has(&text, "\"enc_deg\" = { variable = \"loadAngle\", unit = \"deg\" }   # GUESS");
}

fn refused(files: &[(&str, String)]) -> Vec<trueup_signals::Finding> {
    match Tried::of(files).draft(&model()).unwrap_err() {
        SignalsError::Wrong(findings) => findings,
        other => panic!("{other}"),
    }
}

#[test]
fn what_cannot_be_drafted_is_one_error() {
    let two =
        log("t,stamp,i_A,motor_deg", |t| format!("{t},{},{},{}", t * (1.0 + 0.3 * t), t.sin(), t.cos()));
    let found = refused(&[("a.csv", two)]);
    assert_eq!(found.len(), 1, "{found:?}");
    says(
        "two clocks",
        &found,
        Severity::Error,
        FindingKind::NoTime,
        &["a.csv", "two clocks", "do not agree", "--time"],
    );
    let none = log("i_A,motor_deg", |t| format!("{},{}", t.sin(), t.cos()));
    says(
        "none",
        &refused(&[("a.csv", none)]),
        Severity::Error,
        FindingKind::NoTime,
        &["no column is a clock", "--rate"],
    );
    let text = log("time,i_A,motor_deg", |t| {
        format!(
            "{t},{},{}",
            t.sin(),
            if (t - 1.0).abs() < 1e-9 { "overflow".into() } else { t.cos().to_string() }
        )
    });
    let found = refused(&[("a.csv", text)]);
    assert_eq!(found.iter().filter(|f| f.is_error()).count(), 1, "{found:?}");
    says("text", &found, Severity::Error, FindingKind::NotANumber, &["a.csv:202", "\"overflow\""]);
}

#[test]
fn two_clocks_that_agree_are_one() {
    let both = log("t,stamp_ms,i_A,motor_deg", |t| format!("{t},{},{},{}", 1e3 * t + 50.0, t.sin(), t.cos()));
    let text = Tried::of(&[("a.csv", both)]).text(&model());
    has(&text, "\"t\" = \"time\"");
    has(&text, "\"stamp_ms\" = false   # another clock");
}
