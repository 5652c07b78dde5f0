//! Sweeps, run by run.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use trueup_sweep::{FactorValue, Runner};

use crate::error::PyFailure;
use crate::interrupt::LOOK;

/// A sweep that was read and checked. One thread runs it at a time.
#[pyclass(name = "Sweep", frozen, module = "trueup._native")]
pub(crate) struct PySweep {
    runner: Mutex<Runner>,
    /// Number of its runs.
    #[pyo3(get)]
    runs: u64,
    /// Names of the factors.
    #[pyo3(get)]
    factors: Vec<String>,
    /// Names of the outputs.
    #[pyo3(get)]
    outputs: Vec<String>,
    /// Of the sweep and all that it reads.
    #[pyo3(get)]
    fingerprint: String,
}

/// Values of the outputs, a row for each run, and why a run failed.
type SweepRunResult<'py> = (Bound<'py, PyArray2<f64>>, Vec<Option<String>>);

#[pymethods]
impl PySweep {
    #[new]
    fn new(py: Python<'_>, file: PathBuf) -> PyResult<Self> {
        let runner = py.detach(|| Runner::open(&file)).map_err(PyFailure::from)?;
        crate::system::keep_loaded(runner.plan());
        let sweep = runner.sweep();
        Ok(Self {
            runs: runner.design().runs(),
            factors: sweep.factors.iter().map(|f| f.name.clone()).collect(),
            outputs: sweep.outputs.iter().map(|o| o.name.clone()).collect(),
            fingerprint: runner.print().to_owned(),
            runner: Mutex::new(runner),
        })
    }

    /// The value of each factor in these runs, from 1, factor by factor.
    fn values<'py>(&self, py: Python<'py>, first: u64, count: u64) -> PyResult<Vec<Vec<Bound<'py, PyAny>>>> {
        let runner = self.runner.lock().unwrap_or_else(PoisonError::into_inner);
        let value = |factor: usize, run: u64| match runner.design().value(factor, run) {
            FactorValue::Number(x) => x.into_bound_py_any(py),
            FactorValue::Integer(n) => n.into_bound_py_any(py),
            FactorValue::Boolean(b) => b.into_bound_py_any(py),
            FactorValue::Text(text) => text.into_bound_py_any(py),
        };
        let runs = self.share(first, count)?;
        (0..self.factors.len()).map(|factor| runs.clone().map(|run| value(factor, run)).collect()).collect()
    }

    /// Does these runs, from 1.
    fn run<'py>(&self, py: Python<'py>, first: u64, count: u64) -> PyResult<SweepRunResult<'py>> {
        let runs = self.share(first, count)?;
        let (values, reasons) = py.detach(|| {
            let mut runner = self.runner.lock().unwrap_or_else(PoisonError::into_inner);
            let (mut values, mut reasons) = (Vec::new(), Vec::new());
            let mut looked = Instant::now();
            for run in runs {
                match runner.run(run).result {
                    Ok(found) => {
                        values.extend(found.into_iter().map(|x| x.unwrap_or(f64::NAN)));
                        reasons.push(None);
                    }
                    Err(why) => {
                        values.extend(self.outputs.iter().map(|_| f64::NAN));
                        reasons.push(Some(why));
                    }
                }
                if looked.elapsed() >= LOOK {
                    looked = Instant::now();
                    Python::attach(|py| py.check_signals())?;
                }
            }
            Ok::<_, PyErr>((values, reasons))
        })?;
        let values = PyArray1::from_vec(py, values).reshape([reasons.len(), self.outputs.len()])?;
        Ok((values, reasons))
    }
}

impl PySweep {
    fn share(&self, first: u64, count: u64) -> Result<std::ops::Range<u64>, PyFailure> {
        let end = first.saturating_add(count);
        if first >= 1 && end <= self.runs + 1 {
            return Ok(first..end);
        }
        Err(PyFailure::of(format!("there are no runs {first} to {}; there are 1 to {}", end - 1, self.runs)))
    }
}
