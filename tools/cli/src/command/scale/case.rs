//! A case at another size: case.toml and its recordings, in a folder of their own.

use std::path::{Path, PathBuf};

use trueup_identification::intake::Purpose;
use trueup_identification::model::SimulatedPlant;
use trueup_scaling::{ScalingLaw, case, recording};

use super::{another, failed, text, word};
use crate::args::ScaleCommand;
use crate::error::CliError;
use crate::output::{folder, write};
use crate::voice;

pub(super) fn run(args: &ScaleCommand, law: &ScalingLaw) -> Result<(), CliError> {
    let (loaded, _) = crate::case::load(&args.file, Purpose::Identify, &[])?;
    let from = &loaded.case;
    let whole = std::path::absolute(&from.folder).unwrap_or_else(|_| from.folder.clone());
    let to = args.output.clone().unwrap_or_else(|| {
        let name = whole.file_name().unwrap_or_default().to_string_lossy().into_owned();
        whole.with_file_name(format!("{name}.{}", word(args)))
    });
    another(&whole, &to)?;
    let model = SimulatedPlant::of_case(from, &[]).map_err(|e| CliError::at(&from.file, e))?;
    let (variables, values) = (model.variables(), model.defaults());
    let own = model.parameters().iter().map(|q| q.name.clone()).zip(values);
    let left_out: Vec<(String, f64)> = own.filter(|(name, _)| !from.parameters.contains_key(name)).collect();
    let mut files: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    for name in from.recordings() {
        let file = from.folder.join(name);
        let sidecars = [file.with_extension("toml"), PathBuf::from(format!("{}.toml", file.display()))];
        if let Some(sidecar) = sidecars.iter().find(|s| s.is_file()) {
            let mend = "let its columns bear names of variables in SI, define the rest in case.toml, and take it out";
            return Err(CliError::at(sidecar, format!("a sidecar cannot be scaled; {mend}")));
        }
        if file.extension().is_none_or(|e| !e.eq_ignore_ascii_case("csv")) {
            return Err(CliError::at(&file, "only recordings as CSV can be scaled; write it as one"));
        }
        let read = text(&file)?;
        let mut bytes = Vec::new();
        let column = |name: &str| case::column(law, &variables, name);
        recording::scale(&file, read.as_bytes(), &mut bytes, law, column).map_err(failed)?;
        files.push((to.join(name), bytes));
    }
    // What makes a case of the folder comes last.
    let scaled = case::scaled(&text(&from.file)?, &from.file, law, &variables, &left_out).map_err(failed)?;
    files.push((to.join("case.toml"), scaled.into_bytes()));
    for (file, bytes) in &files {
        folder(file.parent().unwrap_or(Path::new("")))?;
        write(file, bytes)?;
    }
    voice::line(&format!("{}: {} recordings", to.display(), files.len() - 1));
    Ok(())
}
