//! Systems of the demo: written as TOML next to the FMUs, for the user to run again, and run by the master.

use std::path::Path;

use trueup_cosim::system::{CosimSystem, SourceSpan};
use trueup_cosim::{Master, SeriesMemory, check};

use crate::error::CliError;
use crate::moving::{self, PlantInRun};

/// What a system of the demo did.
pub(super) struct DemoRun {
    pub(super) results: SeriesMemory,
    /// Its components that have a picture.
    pub(super) plants: Vec<PlantInRun>,
}

/// Writes `<name>.toml` and, if there are inputs, `<name>.csv` into the folder, and runs the system with these start
/// values (`component.variable`) on top.
pub(super) fn run(
    folder: &Path,
    name: &str,
    toml: &str,
    inputs: Option<&str>,
    set: &[(&str, String)],
) -> Result<DemoRun, CliError> {
    let write = |ending: &str, text: &str| {
        let file = folder.join(format!("{name}.{ending}"));
        let written = trueup_fmi_description::pack::write_file(&file, text.as_bytes());
        written.map_err(|e| CliError::Failed(e.to_string())).map(|()| file)
    };
    inputs.map(|text| write("csv", text)).transpose()?;
    let file = write("toml", toml)?;
    let failed = |e: trueup_cosim::CosimError| CliError::at(&file, e);
    let mut system = CosimSystem::read(&file).map_err(failed)?;
    for (variable, value) in set {
        let done = system.set(variable, value, &SourceSpan::default());
        done.map_err(|mistake| CliError::Failed(mistake.to_string()))?;
    }
    let plan = check(&system).map_err(failed)?;
    let (mut results, plants) = (SeriesMemory::default(), moving::plants(&plan));
    let mut master = Master::new(plan).map_err(failed)?;
    master.run(&mut results).map_err(failed)?;
    Ok(DemoRun { results, plants })
}

/// The samples of a column; none if there is no such column.
pub(super) fn column<'a>(results: &'a SeriesMemory, name: &str) -> &'a [f64] {
    results.column(name).unwrap_or_default()
}
