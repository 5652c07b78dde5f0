//! `[columns]` of a case: for all recordings, for those that match a pattern, and what a sidecar defines itself.

use std::fs;

use crate::common::{joint, says};
use trueup_signals::{Case, Finding, FindingKind, Loaded, Severity, SignalsError};

const HEAD: &str =
    "model = \"TwoMassJoint\"\ntrain = [\"log_040.csv\", \"log_041.csv\"]\nholdout = [\"late.csv\"]\n";
const LOG: &str = "t_ms,I_mA,enc\n0,0,0\n10,1000,1\n20,500,3\n";

/// A case of three equal logs, `extra` behind its head, and these files in addition.
fn load(extra: &str, files: &[(&str, &str)]) -> Result<(Loaded, Vec<Finding>), SignalsError> {
    let folder = tempfile::tempdir().unwrap();
    for name in ["log_040.csv", "log_041.csv", "late.csv"] {
        fs::write(folder.path().join(name), LOG).unwrap();
    }
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    fs::write(folder.path().join("case.toml"), format!("{HEAD}{extra}")).unwrap();
    Case::load(folder.path(), |_| Ok(joint()))
}

fn wrong(extra: &str, files: &[(&str, &str)]) -> Vec<Finding> {
    match load(extra, files).unwrap_err() {
        SignalsError::Wrong(findings) => findings.into_iter().filter(Finding::is_error).collect(),
        other => panic!("{other}"),
    }
}

const ALL: &str = "[columns]\nt_ms = { variable = \"time\", unit = \"ms\" }\nI_mA = { variable = \"motorCurrent\", unit = \"mA\" }\nenc = { variable = \"motorAngle\", scale = 0.5 }\n";

fn last(loaded: &Loaded, run: &str, channel: &str) -> f64 {
    *loaded.recordings[run].channel(channel).unwrap().values.last().unwrap()
}

#[test]
fn columns_of_a_case_hold_for_all_its_recordings() {
    let (loaded, findings) = load(ALL, &[]).unwrap();
    assert!(!findings.iter().any(|f| f.kind == FindingKind::UnknownColumn), "{findings:?}");
    for run in ["log_040.csv", "log_041.csv", "late.csv"] {
        assert_eq!([last(&loaded, run, "motorCurrent"), last(&loaded, run, "motorAngle")], [0.5, 1.5]);
        assert!((loaded.recordings[run].end - 0.02).abs() < 1e-15);
    }
}

#[test]
fn a_pattern_goes_before_them_and_a_sidecar_before_both() {
    let by_pattern =
        format!("{ALL}\n[columns.\"log_04*.csv\"]\nenc = {{ variable = \"motorAngle\", scale = 2.0 }}\n");
    let own = "[columns]\nenc = { variable = \"motorAngle\", scale = 7.0 }\n";
    let (loaded, _) = load(&by_pattern, &[("log_041.toml", own)]).unwrap();
    let angles = ["late.csv", "log_040.csv", "log_041.csv"].map(|run| last(&loaded, run, "motorAngle"));
    assert_eq!(angles, [1.5, 6.0, 21.0]);
    assert_eq!(
        last(&loaded, "log_041.csv", "motorCurrent"),
        0.5,
        "what the sidecar leaves out is the case's"
    );
}

/// A sidecar that takes another column for a variable replaces the case's column of it.
#[test]
fn a_sidecar_s_column_replaces_the_case_s_of_the_same_variable() {
    let other = "t_ms,I_mA,enc,enc_b\n0,0,0,0\n10,1000,1,10\n20,500,3,30\n";
    let own = "[columns]\nenc_b = \"motorAngle\"\n";
    let (loaded, _) = load(ALL, &[("late.csv", other), ("late.csv.toml", own)]).unwrap();
    assert_eq!(last(&loaded, "late.csv", "motorAngle"), 30.0);
    assert_eq!(last(&loaded, "log_040.csv", "motorAngle"), 1.5);
}

#[test]
fn logs_of_other_names_may_be_in_one_case() {
    let other = "time,I_mA,angle\n0,0,0\n0.01,1000,1\n0.02,500,3\n";
    let both = format!("{ALL}angle = \"loadAngle\"\n");
    let (loaded, findings) = load(&both, &[("late.csv", other)]).unwrap();
    assert!(!findings.iter().any(|f| f.kind == FindingKind::UnknownColumn && f.file.ends_with("case.toml")));
    assert_eq!(last(&loaded, "late.csv", "loadAngle"), 3.0);
}

#[test]
fn a_column_that_no_recording_has_is_one_error() {
    let all = wrong(&ALL.replace("enc =", "encoder ="), &[]);
    assert_eq!(all.len(), 1, "{all:?}");
    says(
        "typo",
        &all,
        Severity::Error,
        FindingKind::UnknownColumn,
        &["case.toml:7:", "`encoder`", "did you mean `enc`"],
    );
}

#[test]
fn a_pattern_that_matches_nothing_is_one_error() {
    let all = wrong(&format!("{ALL}\n[columns.\"log_05*.csv\"]\nenc = \"loadAngle\"\n"), &[]);
    assert_eq!(all.len(), 1, "{all:?}");
    says(
        "glob",
        &all,
        Severity::Error,
        FindingKind::MissingFile,
        &["case.toml:9:", "no recording", "`log_05*.csv`", "`log_040.csv`"],
    );
}

#[test]
fn mistakes_in_columns_of_a_case_have_their_line() {
    let says = |label: &str, extra: &str, kind, parts: &[&str]| {
        says(label, &wrong(extra, &[]), Severity::Error, kind, parts);
    };
    says(
        "variable",
        &ALL.replace("motorAngle", "motorAngel"),
        FindingKind::UnknownColumn,
        &["case.toml:7:", "did you mean `motorAngle`"],
    );
    says("unit", &ALL.replace("\"mA\"", "\"mAmp\""), FindingKind::Unit, &["case.toml:6:", "`mAmp`"]);
    says(
        "kind of unit",
        &ALL.replace("\"mA\"", "\"deg\""),
        FindingKind::Unit,
        &["case.toml:6:", "cannot be the unit"],
    );
    says("key", &ALL.replace("scale =", "factor ="), FindingKind::UnknownKey, &["case.toml:7:", "`factor`"]);
    let twice = format!(
        "{ALL}\n[columns.\"log_04*.csv\"]\nenc = \"loadAngle\"\n[columns.\"*1.csv\"]\nenc = \"motorAngle\"\n"
    );
    says("two patterns", &twice, FindingKind::DuplicateName, &["case.toml:10:", "both define", "`enc`"]);
    says(
        "no pattern",
        &format!("{ALL}\n[columns.\"log_[04*.csv\"]\nenc = \"loadAngle\"\n"),
        FindingKind::BadValue,
        &["no pattern"],
    );
}
