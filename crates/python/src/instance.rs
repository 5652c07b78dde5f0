//! A running FMU that Python steps.

use std::sync::{Mutex, PoisonError};

use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use trueup_cosim::{CosimError, SteppedFmu};

use crate::error::PyFailure;

/// One FMU in Co-Simulation; ended by `close`.
#[pyclass(name = "Instance", frozen, module = "trueup._native")]
pub(crate) struct PyInstance {
    running: Mutex<Option<SteppedFmu>>,
}

/// Shape and values.
type ShapedValues<'py> = (Vec<usize>, Bound<'py, PyArray1<f64>>);

/// Names of rows and columns, and the matrix.
type NamedMatrix<'py> = (Vec<String>, Vec<String>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl PyInstance {
    /// Time in s.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.with(|fmu| Ok(fmu.time()))?)
    }

    /// Advances by so many s.
    fn step(&self, py: Python<'_>, step: f64) -> PyResult<()> {
        Ok(py.detach(|| self.with(|fmu| fmu.step(step)))?)
    }

    /// Shape and values of a variable.
    fn get<'py>(&self, py: Python<'py>, name: &str) -> PyResult<ShapedValues<'py>> {
        let (shape, values) = self.with(|fmu| fmu.get(name))?;
        Ok((shape, PyArray1::from_vec(py, values)))
    }

    /// Sets a variable.
    fn set(&self, name: &str, values: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let values = values.as_array().to_vec();
        Ok(self.with(|fmu| fmu.set(name, &values))?)
    }

    /// Partial derivatives of these variables with respect to those.
    fn derivatives<'py>(
        &self,
        py: Python<'py>,
        of: Vec<String>,
        by: Vec<String>,
    ) -> PyResult<NamedMatrix<'py>> {
        let found = self.with(|fmu| fmu.derivatives(&of, &by))?;
        let shape = [found.of.len(), found.by.len()];
        Ok((found.of, found.by, PyArray1::from_vec(py, found.values).reshape(shape)?))
    }

    /// Ends the run; a second time it does nothing.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        let ended = py.detach(|| self.lock().take().map_or(Ok(()), SteppedFmu::end));
        Ok(ended.map_err(PyFailure::from)?)
    }
}

impl PyInstance {
    pub(crate) fn of(fmu: SteppedFmu) -> Self {
        Self { running: Mutex::new(Some(fmu)) }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<SteppedFmu>> {
        self.running.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn with<R>(&self, work: impl FnOnce(&mut SteppedFmu) -> Result<R, CosimError>) -> Result<R, PyFailure> {
        match self.lock().as_mut() {
            Some(fmu) => Ok(work(fmu)?),
            None => Err(PyFailure::of("the instance is closed; make another one")),
        }
    }
}
