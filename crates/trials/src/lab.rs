//! A sealed rig that runs what is proposed: a joint of the blind trials whose cause is not published, with limits.
//!
//! `case/` is a case for `trueup diagnose`, to which every round adds a recording for fitting; `limits.toml` has what may be
//! proposed; `rounds.csv` counts rounds; `sealed/` holds the key.

use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::bench::mix;
use crate::case::{TrialCase, TrialSplit};
use crate::draw::SeededDraw;
use crate::error::TrialError;
use crate::files;
use crate::joint::{SealedJoint, generate_rig, short};

/// Longest experiment, s.
const LONGEST: f64 = 20.0;
/// Largest current, over the largest that was recorded.
const MORE: f64 = 1.2;

/// `limits.toml`: what an experiment may do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "camelCase")]
pub struct LabLimits {
    /// Largest current either way, A.
    pub motor_current: f64,
    /// Load angles between which the drive stays switched on, rad: the recorded range, and its width more on both sides.
    pub load_angle: [f64; 2],
    /// Load angle at which the joint is at rest when an experiment begins, rad.
    pub begin: f64,
    /// Longest experiment, s.
    pub seconds: f64,
}

/// `sealed/order.toml`: what the rig is made from again for each round.
#[derive(Debug, Serialize, Deserialize)]
struct LabOrder {
    split: TrialSplit,
    // As text: TOML's integers have a sign.
    seed: String,
    case: String,
}

/// A new rig.
#[derive(Clone, Debug)]
pub struct LabNotice {
    /// SHA-256 of its key.
    pub seal: String,
    /// What may be proposed.
    pub limits: LabLimits,
}

/// A round that was run.
#[derive(Clone, Debug, PartialEq)]
pub struct LabRound {
    /// Its number, from 1.
    pub number: usize,
    /// The recording's name in `case/`.
    pub file: String,
    /// Its length, s.
    pub seconds: f64,
    /// The load left its range: the drive was switched off then, and the recording ends.
    pub tripped: bool,
}

/// A row of `rounds.csv`.
#[derive(Serialize, Deserialize)]
struct RoundRow {
    round: usize,
    seconds: f64,
    largest_current: f64,
    tripped: bool,
}

/// Makes a rig in `directory`, which must not have one. Without a split its kind is drawn as the benchmark's; without a seed a
/// secret one is.
///
/// # Errors
/// A rig is there; a file that cannot be written; no draw shows its effect.
pub fn new_lab(
    directory: &Path,
    split: Option<TrialSplit>,
    seed: Option<u64>,
) -> Result<LabNotice, TrialError> {
    let (sealed, case_folder) = (directory.join("sealed"), directory.join("case"));
    if sealed.exists() || case_folder.exists() {
        return Err(TrialError::at(directory, "a rig is here already; run it, or name another folder"));
    }
    let seed = seed.unwrap_or_else(rand::random);
    let split = split.unwrap_or_else(|| drawn(seed));
    let (case, _) = generate_rig(split, seed, 0)?;
    let limits = limits(&case);
    let part = files::fresh(directory, "rig")?;
    let name = files::write(&part, case)?;
    let key = part.join("keys").join(format!("{name}.toml"));
    let seal = files::hash(files::text(&key)?.as_bytes());
    let order = LabOrder { split, seed: seed.to_string(), case: name.clone() };
    written(&part.join("order.toml"), &order)?;
    let open = part.join("cases").join(&name);
    written(&directory.join("limits.toml"), &limits)?;
    files::settle(&open, &case_folder)?;
    fs::remove_dir(part.join("cases")).map_err(|e| TrialError::at(&part, e))?;
    files::settle(&part, &sealed)?;
    Ok(LabNotice { seal, limits })
}

fn written(path: &Path, value: &impl Serialize) -> Result<(), TrialError> {
    files::whole(path, &toml::to_string(value).map_err(|e| TrialError::at(path, e))?)
}

fn read<T: for<'a> Deserialize<'a>>(path: &Path) -> Result<T, TrialError> {
    toml::from_str(&files::text(path)?).map_err(|e| TrialError::at(path, e))
}

/// One of the splits of the benchmark, in its proportions.
fn drawn(seed: u64) -> TrialSplit {
    let mut at = SeededDraw::new("lab split", seed, 0, 0).below(100);
    for (split, share) in mix(100) {
        if at < share {
            return split;
        }
        at -= share;
    }
    TrialSplit::Single
}

fn limits(case: &TrialCase) -> LabLimits {
    let column = |name: &str| {
        let columns = case.train.iter().flat_map(|r| &r.columns).filter(move |c| c.name == name);
        columns.flat_map(|c| c.values.iter().copied()).filter(|v| v.is_finite()).collect::<Vec<f64>>()
    };
    let largest = column("motorCurrent").iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    let mut load = column("loadAngle");
    if load.is_empty() {
        // By the motor's angle: what the spring twists is small.
        let gear = case.parameters.get("gearRatio").and_then(toml::Value::as_float).unwrap_or(1.0);
        load = column("motorAngle").iter().map(|q| q / gear).collect();
    }
    let low = load.iter().copied().fold(f64::INFINITY, f64::min);
    let high = load.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let width = high - low;
    LabLimits {
        motor_current: short(MORE * largest),
        load_angle: [short(low - width), short(high + width)],
        begin: short(0.5 * (low + high)),
        seconds: LONGEST,
    }
}

/// Runs the input of `file` (columns `time` in s from 0 on, `motorCurrent` in A, held from each time on) on the rig in `directory`, and
/// adds the recording to its case.
///
/// # Errors
/// There is no rig; the input breaks a limit, or is no input; a file that cannot be written. Then nothing is run.
pub fn run_lab(directory: &Path, file: &Path) -> Result<LabRound, TrialError> {
    let sealed = directory.join("sealed");
    if !sealed.join("order.toml").is_file() {
        return Err(TrialError::at(directory, "no rig is here; `trueup lab new` makes one"));
    }
    let limits: LabLimits = read(&directory.join("limits.toml"))?;
    let order: LabOrder = read(&sealed.join("order.toml"))?;
    let (time, current) = proposed(file, &limits)?;
    let rig = again(&sealed, &order)?;
    let rounds = directory.join("rounds.csv");
    let mut rows: Vec<RoundRow> = Vec::new();
    if rounds.is_file() {
        let mut reader = csv::Reader::from_path(&rounds).map_err(|e| TrialError::at(&rounds, e))?;
        rows = reader.deserialize().collect::<Result<_, _>>().map_err(|e| TrialError::at(&rounds, e))?;
    }
    let number = rows.len() + 1;
    let name = format!("round-{number}.csv");
    let seed = seed_of(&order, &sealed)?;
    let run = (limits.motor_current, seed, number);
    let (recording, tripped) = rig.run(name.clone(), (&time, &current), limits.begin, limits.load_angle, run);
    let seconds = recording.time.last().copied().unwrap_or(0.0);
    if recording.time.len() < 2 {
        return Err(TrialError::at(file, "the load leaves its range at once; begin with less"));
    }
    let case = directory.join("case");
    let text = train_with(&case.join("case.toml"), &name)?;
    files::whole(&case.join(&name), &files::csv(&recording))?;
    files::whole(&case.join("case.toml"), &text)?;
    let largest_current = current.iter().fold(0.0, |m: f64, u| m.max(u.abs()));
    rows.push(RoundRow { round: number, seconds, largest_current, tripped });
    files::whole(&rounds, &crate::judge::table::csv(&rows, &rounds)?)?;
    Ok(LabRound { number, file: name, seconds, tripped })
}

fn seed_of(order: &LabOrder, sealed: &Path) -> Result<u64, TrialError> {
    let path = sealed.join("order.toml");
    order.seed.parse().map_err(|e| TrialError::at(&path, format!("seed `{}`: {e}", order.seed)))
}

/// The rig as it was made; another generator would make another one.
fn again(sealed: &Path, order: &LabOrder) -> Result<SealedJoint, TrialError> {
    let (mut case, rig) = generate_rig(order.split, seed_of(order, sealed)?, 0)?;
    case.key.case.clone_from(&order.case);
    let path = sealed.join("keys").join(format!("{}.toml", order.case));
    if toml::to_string(&case.key).ok().as_ref() != Some(&files::text(&path)?) {
        let why = "this program's generator makes another rig of its seed; use the program that made it, or `trueup lab new`";
        return Err(TrialError::at(&path, why));
    }
    Ok(rig)
}

/// Times and currents of a proposal, within the limits.
fn proposed(file: &Path, limits: &LabLimits) -> Result<(Vec<f64>, Vec<f64>), TrialError> {
    let text = files::text(file)?;
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| TrialError::at(file, e))?.clone();
    let column = |name: &str| {
        header.iter().position(|h| h.trim() == name).ok_or_else(|| {
            TrialError::at(
                file,
                format!("line 1: there is no column `{name}`; a proposal has `time` and `motorCurrent`"),
            )
        })
    };
    let (at_time, at_current) = (column("time")?, column("motorCurrent")?);
    let (mut time, mut current) = (Vec::new(), Vec::new());
    for (k, record) in reader.records().enumerate() {
        let record = record.map_err(|e| TrialError::at(file, e))?;
        let at = |why: String| TrialError::at(file, format!("line {}: {why}", k + 2));
        let number = |column: usize| {
            let cell = record.get(column).unwrap_or_default().trim();
            let value = cell.parse::<f64>().ok().filter(|v| v.is_finite());
            value.ok_or_else(|| {
                at(format!("`{cell}` of `{}` is no number", header.get(column).unwrap_or_default()))
            })
        };
        // What the rig has no actuator for may be there, if it does nothing.
        for other in (0..header.len()).filter(|c| *c != at_time && *c != at_current) {
            if number(other)? != 0.0 {
                let name = header.get(other).unwrap_or_default();
                return Err(at(format!("`{name}` is not 0, but the rig has a motor current only")));
            }
        }
        let (t, u) = (number(at_time)?, number(at_current)?);
        match time.last() {
            None if t != 0.0 => return Err(at(format!("it begins at {t} s; a proposal begins at 0"))),
            Some(before) if t <= *before => return Err(at(format!("{t} s is not after {before} s"))),
            _ => {}
        }
        if t > limits.seconds {
            return Err(at(format!("{t} s; limits.toml allows {} s", limits.seconds)));
        }
        if u.abs() > limits.motor_current * (1.0 + 1e-9) {
            return Err(at(format!("{u} A; limits.toml allows {} A either way", limits.motor_current)));
        }
        time.push(t);
        current.push(u);
    }
    if time.len() < 2 {
        return Err(TrialError::at(file, "fewer than two rows: nothing to run"));
    }
    Ok((time, current))
}

/// A case.toml with one recording more for fitting; all else as it was.
fn train_with(path: &Path, name: &str) -> Result<String, TrialError> {
    let mut document: toml_edit::DocumentMut =
        files::text(path)?.parse().map_err(|e| TrialError::at(path, e))?;
    let train = document.get_mut("train").and_then(toml_edit::Item::as_array_mut);
    train.ok_or_else(|| TrialError::at(path, "`train` is not a list of recordings"))?.push(name);
    Ok(document.to_string())
}
