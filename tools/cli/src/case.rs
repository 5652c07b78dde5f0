//! Loading a case; all its errors are reported on standard error.

mod findings;
pub(crate) mod foreign;

use std::path::Path;

use trueup_identification::fmu::FmuSubject;
use trueup_identification::intake::{CaseIntake, Purpose};
use trueup_signals::check;
use trueup_signals::{Case, Finding, Loaded};

use crate::error::CliError;
use crate::voice;

/// A case with its recordings, and what the intake noticed: all of it is reported on standard error, as are the parameters that
/// the case leaves out.
/// `with` are effects that are fitted in addition to those that it names.
pub(crate) fn load(
    path: &Path,
    purpose: Purpose,
    with: &[String],
) -> Result<(Loaded, Vec<Finding>), CliError> {
    let read = CaseIntake::read(path, purpose, with).map_err(|e| CliError::Failed(e.to_string()))?;
    let CaseIntake { loaded, findings, preset } = read;
    if let Some(line) = preset {
        voice::line(&line);
    }
    tell(&findings);
    if findings.iter().any(Finding::is_error) { Err(CliError::Said) } else { Ok((loaded, findings)) }
}

/// The same for an FMU; which channels go with each other is not known there.
pub(crate) fn load_for(path: &Path, model: &FmuSubject) -> Result<(Loaded, Vec<Finding>), CliError> {
    let variables = model.variables();
    let (loaded, mut findings) =
        Case::load(path, |_| Ok(variables.clone())).map_err(|e| CliError::Failed(e.to_string()))?;
    findings.extend(check::case(&loaded, &variables, &[]));
    tell(&findings);
    if findings.iter().any(Finding::is_error) { Err(CliError::Said) } else { Ok((loaded, findings)) }
}

pub(crate) fn tell(all: &[Finding]) {
    findings::lines(all).iter().for_each(|line| voice::line(line));
}
