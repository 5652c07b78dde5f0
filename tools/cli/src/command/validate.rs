//! `trueup fmu validate`

use trueup_fmi_description::archive::Archive;
use trueup_fmi_description::check::{self, DescriptionSeverity};

use crate::args::Validate;
use crate::error::CliError;
use crate::output::say;

pub(crate) fn run(args: &Validate) -> Result<(), CliError> {
    let mut archive = Archive::open(&args.file).map_err(|e| CliError::Failed(e.to_string()))?;
    let findings = check::archive(&mut archive);
    let mut out: String = findings.iter().map(|f| format!("{f}\n")).collect();
    let errors = findings.iter().filter(|f| f.severity == DescriptionSeverity::Error).count();
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    let (file, warnings) = (args.file.display(), findings.len() - errors);
    out += &format!("{file}: {}, {}\n", count(errors, "error"), count(warnings, "warning"));
    say(&out)?;
    if errors == 0 { Ok(()) } else { Err(CliError::Said) }
}
