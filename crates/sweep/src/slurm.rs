//! A script for clusters.

use std::path::Path;

/// A script for Slurm whose array has a task for each of `shards` shares of the sweep. It is handed in from the folder of the
/// sweep's file; a task that is started again goes on where it was.
pub fn script(file: &Path, shards: u64) -> String {
    let name = file.file_name().unwrap_or_default().to_string_lossy();
    let stem = file.file_stem().unwrap_or_default().to_string_lossy();
    let (name, job) = (quoted(&name), plain(&stem));
    format!(
        "#!/bin/bash
#SBATCH --job-name={job}
#SBATCH --array=1-{shards}
#SBATCH --ntasks=1
#SBATCH --cpus-per-task=1
#SBATCH --output={job}-%a.out
#SBATCH --open-mode=append
#SBATCH --requeue
# Hand it in from the folder of the sweep's file; TRUEUP names the program where it is not in the PATH.
# Tasks that were killed may be handed in again: sbatch --array=3,7 {job}.slurm.sh
# When all are done: trueup sweep merge {name}
set -euo pipefail
exec \"${{TRUEUP:-trueup}}\" sweep {name} --shard \"${{SLURM_ARRAY_TASK_ID}}/{shards}\"
"
    )
}

/// For a shell, whatever the name.
fn quoted(text: &str) -> String {
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// For a line that is no shell's.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' }).collect()
}
