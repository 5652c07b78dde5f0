//! What the sweep and its map share.

use std::path::{Path, PathBuf};
use std::time::Duration;

use trueup_sweep::{LogDamage, SweepError};

use crate::error::CliError;
use crate::voice;

/// Time between two words on how far it is.
pub(super) const TELL: Duration = Duration::from_secs(2);

pub(super) fn failed(e: SweepError) -> CliError {
    match e {
        SweepError::NoRun { .. } => CliError::Usage(format!("--run: {e}")),
        _ => CliError::Failed(e.to_string()),
    }
}

/// Damaged lines are reported, a few of them.
pub(super) fn damaged(list: &[LogDamage], mend: &str) {
    const FEW: usize = 3;
    for damage in list.iter().take(FEW) {
        voice::note(&format!("{}:{}: this line is damaged; {mend}", damage.file.display(), damage.line));
    }
    if list.len() > FEW {
        voice::note(&format!("... and {} more damaged lines", list.len() - FEW));
    }
}

/// `NAME` with this end, in the folder of `NAME.toml`.
pub(super) fn beside(file: &Path, end: &str) -> PathBuf {
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    file.with_file_name(format!("{stem}{end}"))
}
