//! FMUs and systems of them: read once, run often.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use trueup_cosim::model_exchange::{Linear, OperatingPoint};
use trueup_cosim::plan::MasterPlan;
use trueup_cosim::system::{
    ComponentInterface as Chosen, CosimSystem as Described, InputFile, RecordedVariable, SourceSpan,
};
use trueup_cosim::{ColumnKind, Files, InputFileTable, Master, SeriesMemory, SteppedFmu, check_with, names};
use trueup_fmi_description::description::StartValues;
use trueup_fmi_import::{UnpackedFmu, UsedInterface};

use crate::error::PyFailure;
use crate::instance::PyInstance;
use crate::interrupt::WatchedWork;

/// What messages call inputs that are arrays.
const INPUTS: &str = "inputs";

/// Name, kind and unit of a column.
type SystemHead = (String, &'static str, String);

/// An input: its name, times in s, values.
type InputColumns<'py> = (String, PyReadonlyArray1<'py, f64>, PyReadonlyArray1<'py, f64>);

/// A system of FMUs, or one FMU alone, whose files stay open. Runs share nothing else: threads may run it at once.
#[pyclass(name = "System", frozen, module = "trueup._native")]
pub(crate) struct PySystem {
    described: Described,
    fmus: Vec<(PathBuf, Arc<UnpackedFmu>)>,
    notes: Vec<String>,
}

/// Names and values.
type NamedValues<'py> = (Vec<String>, Bound<'py, PyArray1<f64>>);

/// What a run gave: columns, times in s, values of each column, notes.
type SystemRunResult<'py> =
    (Vec<SystemHead>, Bound<'py, PyArray1<f64>>, Vec<Bound<'py, PyArray1<f64>>>, Vec<String>);

#[pymethods]
impl PySystem {
    /// Reads a system (TOML, SSP) or an FMU, and checks all of it.
    #[new]
    fn new(py: Python<'_>, file: PathBuf) -> PyResult<Self> {
        Ok(py.detach(|| Self::read(&file))?)
    }

    /// What was chosen while reading.
    #[getter]
    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    /// Per component its name, its file, its FMI version, its model and its variables as dictionaries.
    fn components<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        self.described.components.iter().map(|c| self.component(py, &c.name, &c.fmu)).collect()
    }

    /// Runs it once. Start values are text, as on the command line of the program.
    #[pyo3(signature = (start, stop, step, tolerance, algorithm, interface, values, inputs, outputs, events))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        start: Option<f64>,
        stop: Option<f64>,
        step: Option<f64>,
        tolerance: Option<f64>,
        algorithm: Option<&str>,
        interface: Option<&str>,
        values: Vec<(String, String)>,
        inputs: Option<Vec<InputColumns<'py>>>,
        outputs: Vec<String>,
        events: Option<bool>,
    ) -> PyResult<SystemRunResult<'py>> {
        let mut system = self.with(&values)?;
        let run = &mut system.run;
        for (asked, slot) in [
            (start, &mut run.start),
            (stop, &mut run.stop),
            (step, &mut run.step),
            (tolerance, &mut run.tolerance),
        ] {
            *slot = asked.or(*slot);
        }
        run.event_rows = events.or(run.event_rows);
        if let Some(name) = algorithm {
            run.algorithm = Some(name.parse().map_err(PyFailure::of)?);
        }
        if let Some(name) = interface {
            let interface = Some(name.parse().map_err(PyFailure::of)?);
            system.components.iter_mut().for_each(|c| c.interface = interface);
        }
        if !outputs.is_empty() {
            let record = |name| RecordedVariable { name, ..RecordedVariable::default() };
            system.record = outputs.into_iter().map(record).collect();
        }
        let mut files = self.files();
        if let Some(signals) = inputs {
            let file = PathBuf::from(INPUTS);
            let columns = signals
                .into_iter()
                .map(|(name, t, x)| Ok((name, t.as_array().to_vec(), x.as_array().to_vec())));
            let columns = columns.collect::<PyResult<Vec<_>>>()?;
            files.hold_inputs(InputFileTable::of(&file, columns).map_err(PyFailure::from)?);
            // Columns that the system gives a meaning keep it.
            let columns = system.inputs.take().map(|i| i.columns).unwrap_or_default();
            system.inputs = Some(InputFile { file, columns, place: SourceSpan::default() });
        }
        let (memory, notes) = py.detach(|| {
            simulated(&system, &mut files).map_err(|e| match e {
                RunFailure::Failed(failure) => failure.or_file(&self.described.file).into(),
                RunFailure::Raised(raised) => raised,
            })
        })?;
        let heads = memory.columns().iter().map(|c| (c.name.clone(), kind(c.kind), c.unit.clone()));
        let series = memory.series().iter().map(|s| PyArray1::from_slice(py, s));
        Ok((heads.collect(), PyArray1::from_slice(py, memory.time()), series.collect(), notes))
    }

    /// Its one FMU in Co-Simulation, after initialization with these start values, to be stepped by the caller.
    #[pyo3(signature = (start, tolerance, values))]
    fn instance(
        &self,
        py: Python<'_>,
        start: f64,
        tolerance: Option<f64>,
        values: Vec<(String, String)>,
    ) -> PyResult<PyInstance> {
        let mut system = self.with(&values)?;
        (system.run.start, system.run.stop, system.run.step) = (Some(start), Some(start + 1.0), Some(1.0));
        system.run.tolerance = tolerance.or(system.run.tolerance);
        system.components.iter_mut().for_each(|c| c.interface = Some(Chosen::CoSimulation));
        let mut files = self.files();
        let begun = py.detach(|| check_with(&system, &mut files).and_then(SteppedFmu::begin));
        Ok(PyInstance::of(begun.map_err(|e| PyFailure::from(e).or_file(&self.described.file))?))
    }

    /// States, inputs, rates, outputs where a run begins at that time with those start values and states, and the exact derivatives
    /// of rates and outputs by states and inputs, row by row.
    fn linear<'py>(
        &self,
        py: Python<'py>,
        time: f64,
        values: Vec<(String, String)>,
        states: Vec<(String, f64)>,
    ) -> PyResult<(Vec<NamedValues<'py>>, Bound<'py, PyArray1<f64>>)> {
        let mut system = self.with(&values)?;
        (system.run.start, system.run.stop) = (Some(time), Some(time + 1.0));
        system.run.step = Some(1.0);
        system.components.iter_mut().for_each(|c| c.interface = Some(Chosen::ModelExchange));
        let mut files = self.files();
        let found = py.detach(|| check_with(&system, &mut files).and_then(|plan| Linear::of(plan, &states)));
        let found = found.map_err(|e| PyFailure::from(e).or_file(&self.described.file))?;
        let named = |p: &OperatingPoint| (p.names.clone(), PyArray1::from_slice(py, &p.values));
        let points = [&found.states, &found.inputs, &found.rates, &found.outputs].map(named);
        Ok((points.into(), PyArray1::from_slice(py, &found.jacobian)))
    }
}

/// Why a run did not end well.
enum RunFailure {
    Failed(PyFailure),
    /// Python was requested to stop.
    Raised(PyErr),
}

impl From<PyFailure> for RunFailure {
    fn from(failure: PyFailure) -> Self {
        Self::Failed(failure)
    }
}

fn simulated(system: &Described, files: &mut Files) -> Result<(SeriesMemory, Vec<String>), RunFailure> {
    let plan = check_with(system, files).map_err(PyFailure::from)?;
    let mut master = Master::new(plan).map_err(PyFailure::from)?;
    let mut sink = WatchedWork::new(SeriesMemory::default());
    match master.run(&mut sink) {
        Ok(log) => Ok((sink.sink, log.notes)),
        Err(e) => Err(sink.raised.map_or_else(|| PyFailure::from(e).into(), RunFailure::Raised)),
    }
}

impl PySystem {
    fn read(file: &Path) -> Result<Self, PyFailure> {
        let of_file = |e: trueup_cosim::CosimError| PyFailure::from(e).or_file(file);
        let described = Described::read(file).map_err(of_file)?;
        let plan = check_with(&described, &mut Files::default()).map_err(of_file)?;
        keep_loaded(&plan);
        let fmus = described.components.iter().zip(&plan.components);
        let fmus = fmus.map(|(c, planned)| (c.fmu.clone(), Arc::clone(&planned.fmu))).collect();
        Ok(Self { described, fmus, notes: plan.notes })
    }

    /// The FMUs, which are open already.
    fn files(&self) -> Files {
        let mut files = Files::default();
        self.fmus.iter().for_each(|(file, fmu)| files.hold(file, fmu));
        files
    }

    /// The same system with these start values, texts as on the command line of the program.
    fn with(&self, values: &[(String, String)]) -> Result<Described, PyFailure> {
        let mut system = self.described.clone();
        for (name, value) in values {
            let set = system.set(name, value, &SourceSpan::default());
            set.map_err(|mistake| PyFailure::from(trueup_cosim::CosimError::System(vec![mistake])))?;
        }
        Ok(system)
    }

    fn component<'py>(&self, py: Python<'py>, name: &str, file: &Path) -> PyResult<Bound<'py, PyDict>> {
        let about = PyDict::new(py);
        about.set_item("name", name)?;
        about.set_item("file", file)?;
        let Some((_, fmu)) = self.fmus.iter().find(|(f, _)| f == file) else { return Ok(about) };
        let d = fmu.description();
        about.set_item("model", &d.model_name)?;
        about.set_item("fmi_version", &d.fmi_version)?;
        about.set_item("description", &d.description)?;
        let variables = d.variables.iter().map(|v| {
            let about = PyDict::new(py);
            let attributes = d.attributes(v);
            about.set_item("name", &v.name)?;
            about.set_item("causality", lower(&format!("{:?}", v.causality)))?;
            about.set_item("variability", lower(&format!("{:?}", v.variability)))?;
            about.set_item("type", v.kind.name(d.version))?;
            about.set_item("unit", attributes.unit)?;
            let found = names::find(d, &v.name).ok();
            let element = |&(variable, element): &(usize, usize)| names::element(d, variable, element);
            let columns = found.as_ref().map(|f| f.elements.iter().map(element).collect::<Vec<_>>());
            about.set_item("shape", found.as_ref().map(|f| f.shape.clone()))?;
            about.set_item("columns", columns)?;
            about.set_item("start", v.start.as_ref().and_then(StartValues::as_f64))?;
            about.set_item("description", &v.description)?;
            Ok(about)
        });
        about.set_item("variables", variables.collect::<PyResult<Vec<_>>>()?)?;
        Ok(about)
    }
}

/// Lets libraries stay between runs: to load one takes longer than a short run.
pub(crate) fn keep_loaded(plan: &MasterPlan) {
    for planned in &plan.components {
        planned.fmu.keep_loaded(match planned.interface {
            Chosen::CoSimulation => UsedInterface::CoSimulation,
            Chosen::ModelExchange => UsedInterface::ModelExchange,
        });
    }
}

/// As the standard writes it: `StructuralParameter` is `structuralParameter`.
fn lower(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map(|first| first.to_lowercase().chain(letters).collect()).unwrap_or_default()
}

fn kind(kind: ColumnKind) -> &'static str {
    match kind {
        ColumnKind::Real => "float64",
        ColumnKind::Single => "float32",
        ColumnKind::Integer => "int64",
        ColumnKind::Unsigned => "uint64",
        ColumnKind::Boolean => "bool",
        ColumnKind::Text => "str",
    }
}
