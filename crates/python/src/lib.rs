//! The native half of the Python package `trueup`: arguments are taken over, work is done by the libraries with Python's lock
//! released, results are handed back. What Python programmers see is below `python/trueup`.

mod case;
mod error;
mod instance;
mod interrupt;
mod problem;
mod sweep;
mod system;

/// Private: the package's Python modules are the interface.
#[pyo3::pymodule]
mod _native {
    #[pymodule_export]
    use super::case::PyCase;
    #[pymodule_export]
    use super::instance::PyInstance;
    #[pymodule_export]
    use super::problem::PyProblem;
    #[pymodule_export]
    use super::sweep::PySweep;
    #[pymodule_export]
    use super::system::PySystem;
}
