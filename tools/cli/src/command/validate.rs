//! `trueup fmu validate`

use trueup_fmi_description::archive::Archive;
use trueup_fmi_description::check::{self, Severity};

use crate::args::Validate;
use crate::error::Error;

pub(crate) fn run(args: &Validate) -> Result<(), Error> {
    let mut archive = Archive::open(&args.file).map_err(|e| Error::Failed(e.to_string()))?;
    let findings = check::archive(&mut archive);
    for f in &findings {
        println!("{f}");
    }
    let errors = findings.iter().filter(|f| f.severity == Severity::Error).count();
    let count = |n: usize, what: &str| format!("{n} {what}{}", if n == 1 { "" } else { "s" });
    println!(
        "{}: {}, {}",
        args.file.display(),
        count(errors, "error"),
        count(findings.len() - errors, "warning")
    );
    if errors == 0 { Ok(()) } else { Err(Error::Said) }
}
