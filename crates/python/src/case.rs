//! Cases: recordings with their nominal model.

use std::collections::BTreeMap;
use std::path::PathBuf;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use trueup_diagnosis::diagnose::{ChannelTrace, DiagnoseOptions, Diagnosed, diagnose};
use trueup_diagnosis::inputs;
use trueup_fmi_description::FmiVersion;
use trueup_identification::fit::ChannelComparison;
use trueup_identification::identify::{IdentifyMethod, IdentifySettings, METHODS, identify, json};
use trueup_identification::intake::{CaseIntake, Purpose, variables};
use trueup_report::{DiagnosisRun, diagnosis_files};
use trueup_signals::{Case as Described, Finding, ParameterValue};

use crate::error::PyFailure;
use crate::interrupt::watched;
use crate::problem::PyProblem;

/// A recording: its name and its columns.
type RecordedColumns<'py> = (String, Vec<(String, PyReadonlyArray1<'py, f64>)>);

#[derive(Clone)]
enum CaseSource {
    /// A folder with a `case.toml`, or that file.
    Path(PathBuf),
    /// What a `case.toml` would say, and its recordings by name.
    Memory { text: String, tables: BTreeMap<String, Vec<(String, Vec<f64>)>> },
}

/// Recordings with a model, read again for each use, as the program does.
#[pyclass(name = "Case", frozen, module = "trueup._native")]
pub(crate) struct PyCase {
    source: CaseSource,
}

/// What was noticed, as text.
type Notes = Vec<String>;

/// A channel of a recording: recording, channel, then columns by name, `time` (s) first.
type ChannelSeries<'py> = (String, String, Vec<(&'static str, Bound<'py, PyArray1<f64>>)>);

/// JSON, notes, and for each compared channel what was measured and predicted.
type IdentifyResult<'py> = (String, Notes, Vec<ChannelSeries<'py>>);

/// JSON, notes, files by name, and compared channels, twists behind them.
type DiagnoseResult<'py> = (String, Notes, Vec<(String, Bound<'py, PyBytes>)>, Vec<ChannelSeries<'py>>);

#[pymethods]
impl PyCase {
    /// Of a folder.
    #[staticmethod]
    fn read(path: PathBuf) -> Self {
        Self { source: CaseSource::Path(path) }
    }

    /// From memory: `said` is `case.toml` as JSON.
    #[staticmethod]
    fn of(said: &str, recordings: Vec<RecordedColumns<'_>>) -> PyResult<Self> {
        let said: serde_json::Value = serde_json::from_str(said).map_err(|e| PyFailure::of(e.to_string()))?;
        let text = toml::to_string(&said).map_err(|e| PyFailure::of(e.to_string()))?;
        let column = |(name, values): (String, PyReadonlyArray1<'_, f64>)| (name, values.as_array().to_vec());
        let table = |(name, columns): RecordedColumns<'_>| (name, columns.into_iter().map(column).collect());
        Ok(Self { source: CaseSource::Memory { text, tables: recordings.into_iter().map(table).collect() } })
    }

    /// The content of its `case.toml`; none of a folder.
    #[getter]
    fn text(&self) -> Option<&str> {
        match &self.source {
            CaseSource::Path(_) => None,
            CaseSource::Memory { text, .. } => Some(text),
        }
    }

    /// What `trueup identify --json` prints.
    #[pyo3(signature = (method, with_effects, profile, progress))]
    fn identify<'py>(
        &self,
        py: Python<'py>,
        method: &str,
        with_effects: Vec<String>,
        profile: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<IdentifyResult<'py>> {
        let method = self::method(method)?;
        let purpose =
            if method == IdentifyMethod::BreakAway { Purpose::BreakAway } else { Purpose::Identify };
        let source = self.source.clone();
        let found = watched(py, progress.as_ref(), move |tell| {
            let (intake, notes) = source.taken_in(purpose, &with_effects)?;
            let progress = |what: &str| tell(f64::NAN, what);
            let settings = IdentifySettings { method, profile, design: None, progress: &progress };
            let found = identify(&intake.loaded, &settings);
            let found = found.map_err(|e| PyFailure::of(e.to_string()).file(&intake.loaded.case.file))?;
            Ok::<_, PyFailure>((found, notes))
        });
        let (found, notes) = found??;
        let series = |(at, all): (usize, &Vec<ChannelComparison>)| {
            let one = |c: &ChannelComparison| {
                let recording = found.names[at].get(c.run).cloned().unwrap_or_default();
                let columns = [("time", &c.t), ("measured", &c.measured), ("predicted", &c.predicted)];
                (recording, c.channel.clone(), arrays(py, columns))
            };
            all.iter().map(one).collect::<Vec<_>>()
        };
        // Without a hold-out both are of the recordings fitted.
        let shown = [&found.training, &found.compared];
        let shown = shown.into_iter().enumerate().take(if found.held_out { 2 } else { 1 });
        let series = shown.flat_map(series).collect();
        Ok((format!("{:#}\n", json(&found)), notes, series))
    }

    /// What `trueup diagnose --json` prints, without the files that it writes.
    #[pyo3(signature = (seed, force, watch, all_readings, verdict_only, progress))]
    fn diagnose<'py>(
        &self,
        py: Python<'py>,
        seed: u64,
        force: bool,
        watch: bool,
        all_readings: bool,
        verdict_only: bool,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<DiagnoseResult<'py>> {
        let source = self.source.clone();
        let found = watched(py, progress.as_ref(), move |tell| {
            let (CaseIntake { loaded, findings, .. }, notes) = source.taken_in(Purpose::Diagnose, &[])?;
            let capped = !force && findings.iter().any(Finding::is_grave);
            let options = DiagnoseOptions { seed, capped, force, watch, all_readings, verdict_only };
            let file = &loaded.case.file;
            let of_case = |e: String| PyFailure::of(e).file(file);
            let found = diagnose(&loaded, &options, &mut |part, what| tell(part, what));
            let mut found = found.map_err(|e| of_case(e.to_string()))?;
            let read = match &source {
                CaseSource::Path(_) => Some(inputs::read(&loaded.case).map_err(|e| of_case(e.to_string()))?),
                CaseSource::Memory { .. } => None,
            };
            let complete = found.complete(&findings, &loaded.case.folder, read);
            complete.map_err(|e| of_case(format!("{e}; look at the sizes of readings and parameters")))?;
            let text = serde_json::to_string_pretty(&found.diagnosis);
            let text = text.map_err(|e| of_case(e.to_string()))?;
            // The files name the FMUs that are packed with them.
            let fmus = augmented_names(&found);
            found.diagnosis.augmented = (!fmus.is_empty()).then(|| fmus.clone());
            let run = DiagnosisRun { seed, command: String::new(), fmus: &fmus };
            let files = diagnosis_files(&loaded, &found, &run);
            let files = files.map_err(|e| of_case(format!("{}: {}", e.file, e.what)))?;
            Ok::<_, PyFailure>((text, notes, files, [found.traces, found.twists].concat()))
        });
        let (text, notes, files, traces) = found??;
        let files = files.into_iter().map(|(name, bytes)| (name, PyBytes::new(py, &bytes))).collect();
        let one = |t: &ChannelTrace| {
            let floor = vec![t.floor; t.time.len()];
            let columns = [
                ("time", &t.time),
                ("measured", &t.measured),
                ("before", &t.before),
                ("tuned", &t.tuned),
                ("after", &t.after),
                ("floor", &floor),
            ];
            (t.recording.clone(), t.channel.clone(), arrays(py, columns))
        };
        Ok((text, notes, files, traces.iter().map(one).collect()))
    }

    /// The model along the recordings as a function of these parameters. `with`: effects that it has; `values` replace nominal
    /// ones, `first` those that are known of single recordings.
    #[pyo3(signature = (parameters, with_effects, values, first))]
    fn problem(
        &self,
        py: Python<'_>,
        parameters: Vec<String>,
        with_effects: Vec<String>,
        values: Vec<(String, f64)>,
        first: Vec<(String, Vec<(String, f64)>)>,
    ) -> PyResult<PyProblem> {
        let source = &self.source;
        let built = py.detach(|| {
            let (mut intake, _) = source.taken_in(Purpose::Identify, &with_effects)?;
            let number = |(name, x): (String, f64)| (name, ParameterValue::Number(x));
            intake.loaded.case.parameters.extend(values.into_iter().map(number));
            for (recording, values) in first {
                if let Some(run) = intake.loaded.recordings.get_mut(&recording) {
                    run.parameters.extend(values.into_iter().map(number));
                }
            }
            PyProblem::of(&intake.loaded, &parameters)
        });
        Ok(built?)
    }
}

/// Names of the FMUs of what a diagnosis claims.
fn augmented_names(found: &Diagnosed) -> Vec<String> {
    let Some(pack) = found.diagnosis.pack.as_ref().filter(|_| found.augmented.is_some()) else {
        return Vec::new();
    };
    FmiVersion::ALL.iter().map(|v| format!("{}.augmented.fmi{}.fmu", pack.model, v.major())).collect()
}

fn arrays<'py, const N: usize>(
    py: Python<'py>,
    columns: [(&'static str, &Vec<f64>); N],
) -> Vec<(&'static str, Bound<'py, PyArray1<f64>>)> {
    columns.into_iter().map(|(name, values)| (name, PyArray1::from_slice(py, values))).collect()
}

impl CaseSource {
    /// The case, fit for use, and what was noticed on the way.
    fn taken_in(&self, purpose: Purpose, with: &[String]) -> Result<(CaseIntake, Notes), PyFailure> {
        let intake = match self {
            Self::Path(path) => CaseIntake::read(path, purpose, with),
            Self::Memory { text, tables } => {
                let (loaded, findings) = Described::of_tables(text, tables, |case| variables(case, with))?;
                CaseIntake::of(loaded, findings, purpose, with)
            }
        }?;
        if intake.findings.iter().any(Finding::is_error) {
            return Err(trueup_signals::SignalsError::Wrong(intake.findings).into());
        }
        let findings = intake.findings.iter().map(|f| format!("{}: {f}", f.severity.id()));
        let notes = intake.preset.iter().cloned().chain(findings).collect();
        Ok((intake, notes))
    }
}

fn method(name: &str) -> Result<IdentifyMethod, PyFailure> {
    let known = METHODS.iter().find(|(known, _)| *known == name).map(|(_, method)| *method);
    known.ok_or_else(|| {
        let names = METHODS.iter().map(|(name, _)| *name);
        PyFailure::of(format!("there is no method `{name}`{}", trueup_cosim::suggestion(name, names)))
    })
}
