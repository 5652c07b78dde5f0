//! The innovations engine, stage by stage, against the numbers of another program of the same method.
//!
//! `none.json`, `single.json`, `pairs.json` and `outside.json` have these numbers for cases of the trials' generator; `double.json`
//! has some of three other cases by that program with all columns in double precision. `arm` has a short recording of an arm with its
//! numbers by that program with tangents by central differences.

mod compare;
mod trajectory;

use std::fs;
use std::path::{Path, PathBuf};

use serde_json::Value;
use trueup_signals::Case;
use trueup_trials::{Folders, TrialOrder, TrialPlant, TrialSplit, generate};

fn read(path: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(path).unwrap()).unwrap()
}

fn own_numbers(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/innovations").join(format!("{name}.json"))
}

fn check(folder: &Path, golden: &Value, name: &str) -> Vec<String> {
    let (loaded, _) = Case::load(folder, |_| Ok(Vec::new())).unwrap();
    let mut golden = golden.clone();
    // Where rounding of single precision decides: the result of the same program in double precision.
    let double = read(&own_numbers("double"));
    double[name]
        .as_object()
        .into_iter()
        .flatten()
        .for_each(|(stage, numbers)| golden[stage] = numbers.clone());
    let complaints = compare::stages(&loaded, &golden).unwrap_or_else(|e| vec![e.to_string()]);
    complaints.into_iter().map(|c| format!("{name}: {c}")).collect()
}

fn none(complaints: &[String]) {
    assert!(complaints.is_empty(), "\n{}", complaints.join("\n"));
}

#[test]
#[ignore = "generates and searches four cases: a minute"]
fn every_stage_of_four_generated_joints_has_the_golden_numbers() {
    let kinds = [
        ("none", TrialSplit::None),
        ("single", TrialSplit::Single),
        ("pairs", TrialSplit::Pairs),
        ("outside", TrialSplit::Outside),
    ];
    let mut complaints = Vec::new();
    for (name, split) in kinds {
        let golden = read(&own_numbers(name));
        let number = |key: &str| golden["key"][key].as_u64().unwrap();
        let (index, seed) = (number("index") as usize, number("seed"));
        let folder = tempfile::tempdir().unwrap();
        let to = Folders { directory: folder.path(), cache: None };
        let order = TrialOrder {
            plant: TrialPlant::Joint,
            split,
            count: index + 1,
            seed,
            shard: (index + 1, index + 1),
        };
        generate(to, &order, |_, _| {}).unwrap();
        let case = golden["key"]["case"].as_str().unwrap();
        complaints.extend(check(&folder.path().join("cases").join(case), &golden, name));
    }
    none(&complaints);
}

/// Cases with their numbers by kind of plant, in `engine/goldens` in the folder that TRUEUP_DATA names, or next to it.
fn goldens_of(kind: &str) -> Vec<PathBuf> {
    let data = std::env::var_os("TRUEUP_DATA").map(PathBuf::from);
    let places =
        data.iter().flat_map(|d| [d.clone(), d.join("..")]).map(|d| d.join("engine/goldens").join(kind));
    let Some(folder) = places.into_iter().find(|d| d.is_dir()) else {
        eprintln!("SKIPPED: TRUEUP_DATA does not name the folder with the golden numbers of {kind}s");
        return Vec::new();
    };
    let mut names: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    names.sort();
    assert!(!names.is_empty());
    names
}

#[test]
#[ignore = "searches sixteen cases: minutes"]
fn every_stage_of_all_joints_has_the_golden_numbers() {
    let one = |case: &PathBuf| {
        let name = case.file_name().unwrap().to_string_lossy();
        check(case, &read(&case.join("golden.json")), &name)
    };
    none(&goldens_of("joint").iter().flat_map(one).collect::<Vec<_>>());
}

/// Gains of the other program have tangents by forward differences, which move them by up to 3.1e-4 in these cases: with central
/// differences in the same program they are ours to 1e-6.
const FORWARD: f64 = 5e-4;

fn stages_of_arm(case: &Path, numbers: &Path, of_gains: f64, whole: bool) -> Vec<String> {
    let (loaded, _) = Case::load(case, |_| Ok(Vec::new())).unwrap();
    let off = trajectory::stages(&loaded, numbers, of_gains, whole).unwrap_or_else(|e| vec![e.to_string()]);
    off.into_iter().map(|c| format!("{}: {c}", case.display())).collect()
}

fn short_arm() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/innovations/arm")
}

/// Checks EST-12, EST-13, EST-14.
#[test]
fn every_stage_of_a_short_arm_has_the_golden_numbers() {
    none(&stages_of_arm(&short_arm(), &short_arm(), 1e-6, false));
}

#[test]
#[ignore = "fits from the readings on: seconds"]
fn fits_of_a_short_arm_have_the_golden_evidence() {
    none(&stages_of_arm(&short_arm(), &short_arm(), 1e-6, true));
}

#[test]
#[ignore = "fits twelve arms: minutes"]
fn every_stage_of_all_arms_has_the_golden_numbers() {
    let one = |case: &PathBuf| stages_of_arm(case, &case.join("golden"), FORWARD, true);
    none(&goldens_of("arm").iter().flat_map(one).collect::<Vec<_>>());
}
