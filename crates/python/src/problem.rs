//! The model along the recordings of a case as a function of some of its parameters, with exact sensitivities.

use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::prelude::*;
use trueup_identification::model::SimulatedPlant;
use trueup_identification::output_error::OutputError;
use trueup_identification::parallel;
use trueup_identification::recorded::{led, runs};
use trueup_identification::run::IdentificationRun;
use trueup_identification::unknown::{FitTarget, FitUnknown, Scale};
use trueup_signals::Loaded;

use crate::error::PyFailure;

/// Free runs over the recordings for fitting. Everything is in SI; predictions of all channels of all recordings are one
/// behind the other, as [`PyProblem::channels`] lists them.
#[pyclass(name = "Problem", frozen, module = "trueup._native")]
pub(crate) struct PyProblem {
    model: SimulatedPlant,
    nominal: Vec<f64>,
    runs: Vec<IdentificationRun>,
    unknowns: Vec<FitUnknown>,
}

/// Recording, channel, times in s, readings, standard deviation of one reading.
type ChannelColumns<'py> =
    (String, String, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Predictions, and their derivatives.
type PredictionWithTangents<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl PyProblem {
    /// Names of the parameters.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.unknowns.iter().map(|u| u.name.clone()).collect()
    }

    /// Their prior in the case.
    #[getter]
    fn start<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.unknowns.iter().map(|u| u.start))
    }

    /// Smallest and largest values.
    #[getter]
    fn bounds(&self) -> (Vec<f64>, Vec<f64>) {
        self.unknowns.iter().map(|u| (u.lower, u.upper)).unzip()
    }

    /// What is predicted.
    #[getter]
    fn channels<'py>(&self, py: Python<'py>) -> Vec<ChannelColumns<'py>> {
        let of_run = |run: &IdentificationRun| {
            let run_name = run.name.clone();
            let one = move |c: &trueup_identification::run::OutputChannel| {
                let deviations = (0..c.y.len()).map(|k| c.deviation(k));
                (
                    run_name.clone(),
                    c.name.clone(),
                    PyArray1::from_slice(py, &c.t),
                    PyArray1::from_slice(py, &c.y),
                    PyArray1::from_iter(py, deviations),
                )
            };
            run.channels.iter().map(one).collect::<Vec<_>>()
        };
        self.runs.iter().flat_map(of_run).collect()
    }

    /// Predictions with these values.
    fn predict<'py>(
        &self,
        py: Python<'py>,
        theta: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let theta = self.theta(&theta)?;
        let found = py.detach(|| {
            let problem = self.problem();
            self.each(|run| problem.predict(run, &theta))
        })?;
        Ok(PyArray1::from_vec(py, found.concat()))
    }

    /// Predictions with these values and their derivatives, a row for each prediction and a column for each parameter.
    fn predict_and_jacobian<'py>(
        &self,
        py: Python<'py>,
        theta: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<PredictionWithTangents<'py>> {
        let theta = self.theta(&theta)?;
        let n = self.unknowns.len();
        let (readings, rows) = py.detach(|| {
            let problem = self.problem();
            let found = self.each(|run| problem.predict_along(run, &theta))?;
            let (mut readings, mut rows) = (Vec::new(), Vec::new());
            for (y, columns) in found {
                rows.extend((0..y.len()).flat_map(|at| columns.iter().map(move |c| c[at])));
                readings.extend(y);
            }
            Ok::<_, PyFailure>((readings, rows))
        })?;
        let m = readings.len();
        let rows = PyArray1::from_vec(py, rows);
        let jacobian = numpy::PyArrayMethods::reshape(&rows, [m, n])?;
        Ok((PyArray1::from_vec(py, readings), jacobian))
    }
}

impl PyProblem {
    pub(crate) fn of(loaded: &Loaded, parameters: &[String]) -> Result<Self, PyFailure> {
        let file = &loaded.case.file;
        let of_case = |e: String| PyFailure::of(e).file(file);
        let with: Vec<&str> = loaded.case.with.iter().map(String::as_str).collect();
        let plain = SimulatedPlant::of_case(&loaded.case, &with).map_err(|e| of_case(e.to_string()))?;
        let led = led(&plain, &[loaded.train(), loaded.holdout()].concat());
        let model = plain.with_led(&led).map_err(|e| of_case(e.to_string()))?;
        let nominal = model.set(&model.defaults(), &loaded.case.parameters);
        let nominal = nominal.map_err(|e| of_case(e.to_string()))?;
        let (runs, _) = runs(&model, loaded).map_err(|e| of_case(e.to_string()))?;
        let unknown = |name: &String| {
            let i = model.parameter(name).ok_or_else(|| {
                let known = model.parameters().iter().map(|q| q.name.as_str());
                PyFailure::of(format!(
                    "the model has no parameter `{name}`{}",
                    trueup_cosim::suggestion(name, known)
                ))
            })?;
            let q = &model.parameters()[i];
            let free = FitUnknown::free(name, FitTarget::Parameter(i), None, 1.0);
            Ok(FitUnknown {
                start: nominal[i],
                scale: Scale::Linear(1.0),
                lower: q.min,
                upper: q.max,
                ..free
            })
        };
        let unknowns = parameters.iter().map(unknown).collect::<Result<Vec<_>, PyFailure>>()?;
        Ok(Self { model, nominal, runs, unknowns })
    }

    fn problem(&self) -> OutputError<'_> {
        OutputError::new(&self.model, &self.nominal, &self.runs, self.unknowns.clone())
    }

    fn theta(&self, theta: &PyReadonlyArray1<'_, f64>) -> Result<Vec<f64>, PyFailure> {
        let theta = theta.as_array().to_vec();
        let (n, names) = (self.unknowns.len(), self.names().join(", "));
        if theta.len() != n {
            let given = theta.len();
            return Err(PyFailure::of(format!(
                "{given} values are given for {n} parameters; give one for each of {names}"
            )));
        }
        match theta.iter().zip(&self.unknowns).find(|(x, _)| !x.is_finite()) {
            Some((x, u)) => Err(PyFailure::of(format!("`{}` is {x}; give a finite value", u.name))),
            None => Ok(theta),
        }
    }

    /// Of each recording.
    fn each<R: Send>(
        &self,
        one: impl Fn(usize) -> Result<R, trueup_identification::predict::PredictError> + Sync,
    ) -> Result<Vec<R>, PyFailure> {
        let found = parallel::map(0..self.runs.len(), |run| {
            one(run).map_err(|e| PyFailure::of(format!("{}: {e}", self.runs[run].name)))
        });
        found.into_iter().collect()
    }
}
