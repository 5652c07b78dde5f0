//! Hands every case to a diagnosis, and goes on where it was left.

use std::fs;
use std::path::Path;
use std::time::Instant;

use crate::error::Error;
use crate::files;

/// How a case came out.
#[derive(Clone, Debug, PartialEq)]
pub enum Ran {
    /// Diagnosed now, in so many seconds.
    Done(f64),
    /// It was there already.
    Kept,
    /// The diagnosis said this instead.
    Failed(String),
}

/// Diagnoses the cases in `directory` that have no result yet: `diagnose` gets the case's folder and an empty folder
/// for what it writes, which takes its final name when it is whole. `said` hears of each.
///
/// # Errors
/// A file that cannot be written. A diagnosis that fails is kept as `results/<name>.error`, and tried again next time.
pub fn run(
    directory: &Path,
    shard: (usize, usize),
    mut diagnose: impl FnMut(&Path, &Path) -> Result<(), String>,
    mut said: impl FnMut(&str, &Ran),
) -> Result<(), Error> {
    let results = directory.join("results");
    files::folder(&results)?;
    for (i, name) in files::cases(directory)?.iter().enumerate() {
        if i % shard.1 != shard.0 - 1 {
            continue;
        }
        let last = results.join(name);
        if last.join("diagnosis.json").is_file() {
            said(name, &Ran::Kept);
            continue;
        }
        let part = results.join(format!(".{name}.part"));
        if part.exists() {
            fs::remove_dir_all(&part).map_err(|e| Error::at(&part, e))?;
        }
        files::folder(&part)?;
        let begun = Instant::now();
        let told = diagnose(&directory.join("cases").join(name), &part).and_then(|()| {
            if part.join("diagnosis.json").is_file() {
                Ok(())
            } else {
                Err("it wrote no diagnosis.json".into())
            }
        });
        let seconds = begun.elapsed().as_secs_f64();
        let error = results.join(format!("{name}.error"));
        let ran = match told {
            Ok(()) => {
                files::whole(&part.join("trial.toml"), &format!("seconds = {seconds:.3}\n"))?;
                if last.exists() {
                    fs::remove_dir_all(&last).map_err(|e| Error::at(&last, e))?;
                }
                fs::rename(&part, &last).map_err(|e| Error::at(&last, e))?;
                if error.exists() {
                    fs::remove_file(&error).map_err(|e| Error::at(&error, e))?;
                }
                Ran::Done(seconds)
            }
            Err(why) => {
                fs::remove_dir_all(&part).map_err(|e| Error::at(&part, e))?;
                files::whole(&error, &why)?;
                Ran::Failed(why)
            }
        };
        said(name, &ran);
    }
    Ok(())
}
