//! Cases, keys and seals as files.
//!
//! `cases/<name>/` holds what a diagnosis may see, `keys/<name>.toml` the truth, `seals.csv` the hash of every key
//! and case file, `results/<name>/` the result of a diagnosis.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use crate::case::{
    DeclaredGuess, DeclaredSensor, TrialCase, TrialPlant, TrialRecording, TrialSplit, TruthKey,
};
use crate::error::TrialError;

/// The robot of a case, in its folder.
const ROBOT: &str = "robot.toml";

/// Hash as hexadecimal digits.
pub(crate) fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::new(), |mut s, b| {
        let _ = write!(s, "{b:02x}");
        s
    })
}

/// Under a temporary name first.
pub(crate) fn whole(path: &Path, text: &str) -> Result<(), TrialError> {
    let part = path.with_extension(format!("part{}", std::process::id()));
    fs::write(&part, text).map_err(|e| TrialError::at(&part, e))?;
    fs::rename(&part, path).map_err(|e| TrialError::at(path, e))
}

pub(crate) fn folder(path: &Path) -> Result<(), TrialError> {
    fs::create_dir_all(path).map_err(|e| TrialError::at(path, e))
}

/// A recording as CSV.
pub(crate) fn csv(r: &TrialRecording) -> String {
    let mut text = String::from("time");
    r.columns.iter().for_each(|c| {
        let _ = write!(text, ",{}", c.name);
    });
    text.push('\n');
    // Two digits more than the smallest thing that can be seen.
    let digits: Vec<usize> =
        r.columns.iter().map(|c| (2.0 - c.unit_step.log10()).ceil().clamp(2.0, 15.0) as usize).collect();
    for (i, t) in r.time.iter().enumerate() {
        let _ = write!(text, "{t:.5}");
        for (c, n) in r.columns.iter().zip(&digits) {
            let v = c.values[i];
            text.push(',');
            if v.is_finite() {
                let _ = write!(text, "{v:.n$}");
            }
        }
        text.push('\n');
    }
    text
}

fn sensor(s: &DeclaredSensor) -> String {
    let mut text = format!(
        "\n[channels.{}]\n",
        if s.name.contains('[') { format!("\"{}\"", s.name) } else { s.name.clone() }
    );
    if let Some(x) = s.resolution {
        let _ = writeln!(text, "resolution = {x:e}");
    }
    if let Some(x) = s.noise {
        let _ = writeln!(text, "noise = {x:e}");
    }
    if s.hold {
        text.push_str("interpolation = \"hold\"\n");
    }
    for (name, guess) in [("gain", s.gain), ("offset", s.offset)] {
        let _ = match guess {
            Some(DeclaredGuess::Free) => writeln!(text, "{name} = \"estimate\""),
            Some(DeclaredGuess::About(value, doubt)) => {
                writeln!(text, "{name} = {{ value = {value:?}, doubt = {doubt:e} }}")
            }
            None => Ok(()),
        };
    }
    text
}

fn manifest(case: &TrialCase) -> String {
    let names = |list: &[TrialRecording]| {
        let quoted: Vec<String> = list.iter().map(|r| format!("\"{}\"", r.name)).collect();
        quoted.join(", ")
    };
    let mut text = format!("model = \"{}\"\n", case.model);
    if case.robot.is_some() {
        let _ = writeln!(text, "robot = \"{ROBOT}\"");
    }
    let _ = write!(text, "train = [{}]\nholdout = [{}]\n", names(&case.train), names(&case.holdout));
    if !case.rest.is_empty() {
        let _ = writeln!(text, "rest = [{}]", names(&case.rest));
    }
    if !case.repeats.is_empty() {
        let _ = writeln!(text, "repeats = {:?}", case.repeats);
    }
    for (title, table) in [("parameters", &case.parameters), ("uncertain", &case.uncertain)] {
        if !table.is_empty() {
            let _ = write!(text, "\n[{title}]\n{}", toml::to_string(table).unwrap_or_default());
        }
    }
    for (title, table) in [("effects", &case.effects), ("payload", &case.payload)] {
        if !table.is_empty() {
            let whole = toml::Table::from_iter([(title.to_owned(), toml::Value::Table(table.clone()))]);
            let _ = write!(text, "\n{}", toml::to_string(&whole).unwrap_or_default());
        }
    }
    case.sensors.iter().for_each(|s| text.push_str(&sensor(s)));
    text
}

/// A name without a meaning: the digits come from the numbers that the case was drawn from.
pub(crate) fn name_of(plant: TrialPlant, split: TrialSplit, seed: u64, index: usize) -> String {
    let digits = hash(format!("{}/{}/{seed}/{index}", plant.name(), split.name()).as_bytes());
    format!("{}-{}", plant.name(), &digits[..8])
}

/// An empty folder next to the one that will be `name`.
pub(crate) fn fresh(beside: &Path, name: &str) -> Result<PathBuf, TrialError> {
    let part = beside.join(format!(".{name}.part{}", std::process::id()));
    if part.exists() {
        fs::remove_dir_all(&part).map_err(|e| TrialError::at(&part, e))?;
    }
    folder(&part)?;
    Ok(part)
}

/// Gives a folder that is whole its final name.
pub(crate) fn settle(part: &Path, last: &Path) -> Result<(), TrialError> {
    if last.exists() {
        fs::remove_dir_all(last).map_err(|e| TrialError::at(last, e))?;
    }
    fs::rename(part, last).map_err(|e| TrialError::at(last, e))
}

/// Writes recordings into a folder, which is made if it is not there.
pub(crate) fn write_recordings<'a>(
    into: &Path,
    all: impl IntoIterator<Item = &'a TrialRecording>,
) -> Result<(), TrialError> {
    folder(into)?;
    all.into_iter().try_for_each(|r| whole(&into.join(&r.name), &csv(r)))
}

/// Writes a case and its key.
pub(crate) fn write(directory: &Path, mut case: TrialCase) -> Result<String, TrialError> {
    let key = &case.key;
    let name = name_of(key.plant, key.split, key.seed, key.index);
    case.key.case.clone_from(&name);
    let (cases, keys) = (directory.join("cases"), directory.join("keys"));
    folder(&cases)?;
    folder(&keys)?;
    let part = fresh(&cases, &name)?;
    write_recordings(&part, case.train.iter().chain(&case.holdout).chain(&case.rest))?;
    if let Some(robot) = &case.robot {
        whole(&part.join(ROBOT), robot)?;
    }
    whole(&part.join("case.toml"), &manifest(&case))?;
    let path = keys.join(format!("{name}.toml"));
    whole(&path, &toml::to_string(&case.key).map_err(|e| TrialError::at(&path, e))?)?;
    settle(&part, &cases.join(&name))?;
    Ok(name)
}

/// Names of all cases in `directory`, sorted.
pub(crate) fn cases(directory: &Path) -> Result<Vec<String>, TrialError> {
    let path = directory.join("cases");
    let mut names = Vec::new();
    for entry in fs::read_dir(&path).map_err(|e| TrialError::at(&path, e))? {
        let entry = entry.map_err(|e| TrialError::at(&path, e))?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if !name.starts_with('.') && entry.path().is_dir() {
            names.push(name);
        }
    }
    names.sort();
    Ok(names)
}

fn seals_path(directory: &Path) -> PathBuf {
    directory.join("seals.csv")
}

/// Writes the hash of every key.
pub(crate) fn seal(directory: &Path) -> Result<(), TrialError> {
    let mut text = String::from("case,key_sha256\n");
    for name in cases(directory)? {
        let path = directory.join("keys").join(format!("{name}.toml"));
        let bytes = fs::read(&path).map_err(|e| TrialError::at(&path, e))?;
        let _ = writeln!(text, "{name},{}", hash(&bytes));
    }
    whole(&seals_path(directory), &text)
}

/// Opens a key, with its seal; it has to be the one that was sealed.
pub(crate) fn open(directory: &Path, name: &str) -> Result<(TruthKey, String), TrialError> {
    let path = directory.join("keys").join(format!("{name}.toml"));
    let text = fs::read_to_string(&path).map_err(|e| TrialError::at(&path, e))?;
    let seals = seals_path(directory);
    let sealed = fs::read_to_string(&seals).map_err(|e| TrialError::at(&seals, e))?;
    let seal = hash(text.as_bytes());
    if !sealed.lines().any(|l| l == format!("{name},{seal}")) {
        return Err(TrialError::Broken { path });
    }
    Ok((toml::from_str(&text).map_err(|e| TrialError::at(&path, e))?, seal))
}

/// A text file, whole.
pub(crate) fn text(path: &Path) -> Result<String, TrialError> {
    fs::read_to_string(path).map_err(|e| TrialError::at(path, e))
}

/// Names of the files in a folder, sorted.
pub(crate) fn list(folder: &Path) -> Result<Vec<String>, TrialError> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).map_err(|e| TrialError::at(folder, e))? {
        names.push(entry.map_err(|e| TrialError::at(folder, e))?.file_name().to_string_lossy().into_owned());
    }
    names.sort();
    Ok(names)
}
