//! The default experiment as the layered standard FMI-LS-REF (1.0.0-alpha.1) describes it: a manifest of files that belong to an
//! FMU, and an experiment in the format MA-HS-Experiments, of which there are drafts only. The recordings stay in
//! `documentation/`, where FMI 3.0 looks for them.

use trueup_fmi::table::ModelTable;

use super::error::WriteError;
use super::xml::DescriptionXml;

/// Folder of both files.
pub const FOLDER: &str = "extra/org.fmi-standard.fmi-ls-ref";
/// The experiment.
const EXPERIMENT: &str = "default.exp";

/// Names, without folder, and texts.
///
/// # Errors
/// [`WriteError::Io`]
pub fn files(table: &ModelTable) -> Result<[(&'static str, String); 2], WriteError> {
    Ok([("fmi-ls-manifest.xml", manifest(table)?), (EXPERIMENT, experiment(table)?)])
}

/// Seen from the folder: a file of the default experiment.
fn recording(table: &ModelTable, kind: &str) -> String {
    format!("../../documentation/{}_{kind}.csv", table.name)
}

fn manifest(table: &ModelTable) -> Result<String, WriteError> {
    let mut x = DescriptionXml::new()?;
    x.open(
        "fmiReferences",
        &[
            ("xmlns:fmi-ls", "http://fmi-standard.org/fmi-ls-manifest"),
            ("fmi-ls:fmi-ls-name", "org.fmi-standard.fmi-ls-ref"),
            ("fmi-ls:fmi-ls-version", "1.0.0-alpha.1"),
            (
                "fmi-ls:fmi-ls-description",
                "Layered Standard providing information on related files included in an FMU.",
            ),
        ],
    )?;
    let result = recording(table, "ref");
    for (kind, source, role, description) in [
        ("application/x-ma-hs-experiments", EXPERIMENT, "experiment/smoke-test", "The default experiment"),
        ("text/csv", result.as_str(), "result", "What the default experiment gives"),
    ] {
        x.element(
            "Related",
            &[("type", kind), ("source", source), ("role", role), ("description", description)],
        )?;
    }
    x.finish()
}

fn experiment(table: &ModelTable) -> Result<String, WriteError> {
    let e = &table.experiment;
    let mut x = DescriptionXml::new()?;
    x.open("Experiments", &[("name", table.title())])?;
    let tolerance = format!("{:?}", e.tolerance);
    x.open("Experiment", &[("name", "default"), ("tolerance", &tolerance)])?;
    let times = [("startTime", 0.0), ("stopTime", e.stop_time), ("stepSize", e.step_size)];
    x.element("TransientSimulation", &times.map(|(name, t)| (name, format!("{t:?}"))))?;
    x.element("Stimuli", &[("source", recording(table, "in"))])?;
    x.element("References", &[("source", recording(table, "ref"))])?;
    x.finish()
}
