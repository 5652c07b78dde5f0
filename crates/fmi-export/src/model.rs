//! What a model must offer to be exported.

use trueup_fmi::configuration::{Configuration, ConfigurationError};
use trueup_fmi::table::ModelTable;
use trueup_numerics::hybrid::{At, Hybrid};

/// A hybrid model together with its variable table; one type per shared library, which may represent
/// several models (an enum), chosen by the configuration packed into the library.
pub trait FmuModel: Hybrid + Sized + Send + Sync + 'static {
    /// The model that a configuration describes; the message gives the error and the remedy.
    fn build(configuration: &Configuration) -> Result<Self, String>;
    /// Its variables with their own start values (those of the configuration are put in by the caller).
    fn table(&self) -> ModelTable;
    /// What the bounds of one parameter cannot express: parameters that contradict each other.
    ///
    /// The error names the parameter element (index into the parameters) and the remedy.
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)>;
    /// What of parameters that [`Self::check`] lets pass is taken otherwise than it is written, and how: a warning to the
    /// importer.
    fn remark(&self, _p: &[f64]) -> Option<String> {
        None
    }
    /// What the model is not made for at this state, and the remedy: a warning to the importer. `said` has the bits of the
    /// warnings that this run has had; the answer has the bit of its own and the text. Called where a run begins and at
    /// communication points (Model Exchange: completed steps, and where outputs are read); must not allocate unless it answers.
    fn watch(&self, _at: At<'_, f64>, _said: u32) -> Option<(u32, String)> {
        None
    }
    /// Why a communication step of `h` s is longer than the model is made for, and the remedy: a warning, at most one a run.
    fn long_step(&self, _h: f64, _p: &[f64]) -> Option<String> {
        None
    }
    /// Why values at this state are not numbers, with the remedy, where the model reports more than that they are not.
    fn singular(&self, _at: At<'_, f64>) -> Option<String> {
        None
    }
    /// Size of the implicit steps that Co-Simulation takes, s; `None`: steps are as long as the tolerance allows.
    fn fixed_step(&self) -> Option<f64> {
        None
    }
}

/// A model with the configuration that is packed into its library; made by [`export_fmu!`](crate::export_fmu).
pub trait Exported {
    /// The model.
    type Model: FmuModel;
    /// Reads the library's block.
    fn configuration() -> Result<Configuration, ConfigurationError>;
}
