//! `trueup trial decide`: what results keep, decided again by the rules of this program.

use std::fs;
use std::path::Path;

use serde_json::{Value, json};
use trueup_diagnosis::diagnose::record::{self, DecisionRecord, Redecided};
use trueup_diagnosis::engine::decide::Thresholds;
use trueup_trials::Answers;

use super::failed;
use crate::args::TrialDecide;
use crate::error::CliError;
use crate::output::{folder, say, write};

pub(crate) fn decide(a: &TrialDecide) -> Result<(), CliError> {
    let before = Answers::find(&a.directory).map_err(failed)?;
    let after = Answers { trials: before.trials.clone(), results: a.results.clone() };
    folder(&after.results)?;
    let mut without = 0;
    for row in before.rows().map_err(failed)? {
        let (from, to) = (before.results.join(&row.case), after.results.join(&row.case));
        if !from.join(record::FILE).is_file() {
            without += 1;
            continue;
        }
        again(&from, &to)?;
    }
    after.tabulate().map_err(failed)?;
    if without > 0 {
        let file = record::FILE;
        crate::voice::note(&format!(
            "{without} cases have no {file} and are left out: run their diagnoses again"
        ));
    }
    let found = trueup_trials::compare(&before, &after).map_err(failed)?;
    if found.pairs.is_empty() {
        return Err(CliError::at(&before.results, format!("no case has a {}", record::FILE)));
    }
    say(&found.text())
}

fn read(path: &Path) -> Result<String, CliError> {
    crate::input::text(path, "diagnose the case again with `trueup trial run`")
}

/// A result with the new decision instead of the old one.
fn again(from: &Path, to: &Path) -> Result<(), CliError> {
    let path = from.join(record::FILE);
    let decided = DecisionRecord::parse(&read(&path)?)
        .and_then(|record| record.decide(&Thresholds::default()))
        .map_err(|e| CliError::at(&path, e))?;
    let path = from.join("diagnosis.json");
    let old: Value = serde_json::from_str(&read(&path)?).map_err(|e| CliError::at(&path, e))?;
    let new = serde_json::to_vec_pretty(&replaced(old, &decided).map_err(failed)?).map_err(failed)?;
    folder(to)?;
    if let Ok(took) = fs::read(from.join("trial.toml")) {
        write(&to.join("trial.toml"), &took)?;
    }
    write(&to.join("diagnosis.json"), &new)
}

/// Amplitudes and intervals stay where the same effect is claimed in the same place; gaps by channel go, since they were of
/// another claim.
fn replaced(mut old: Value, decided: &Redecided) -> Result<Value, serde_json::Error> {
    let mut new = serde_json::to_value(decided)?;
    let same = |a: &Value, b: &Value| ["id", "component", "joint"].iter().all(|k| a[k] == b[k]);
    for claim in new["effects"].as_array_mut().into_iter().flatten() {
        if let Some(was) = old["effects"].as_array().into_iter().flatten().find(|was| same(was, claim)) {
            claim["parameters"] = was["parameters"].clone();
        }
    }
    let list = |v: &Value| v["effects"].as_array().cloned().unwrap_or_default();
    let (was, is) = (list(&old), list(&new));
    let unchanged = old["verdict"] == new["verdict"]
        && was.len() == is.len()
        && was.iter().zip(&is).all(|(a, b)| same(a, b));
    for key in ["verdict", "effects", "candidates", "indistinguishable", "unknown"] {
        old[key] = new[key].take();
    }
    if unchanged {
        return Ok(old);
    }
    let figure = |key: &str| old["gap"]["overall"][key].as_f64();
    if let (Some(before), Some(floor)) = (figure("before"), figure("floor")) {
        let over = before - floor;
        let closed = (over > 0.0).then(|| (before - decided.after) / over);
        old["gap"]["overall"]["after"] = json!(decided.after);
        old["gap"]["overall"]["closed"] = json!(closed);
        old["gap"]["overall"]["ci95"] = Value::Null;
        old["gap"]["channels"] = json!({});
    }
    Ok(old)
}
