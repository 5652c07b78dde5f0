//! The request to an identification, and its result.

use nalgebra::DMatrix;

use super::design::{Designed, ExperimentDesign};
use super::found::FoundParameter;
use super::leverage::Leverage;
use super::method::IdentifyMethod;
use super::starts::SearchStart;
use crate::estimate::ChannelFit;
use crate::fit::ChannelComparison;
use crate::model::PlantQuantity;
use crate::packed::PackedModel;
use crate::unknown::FitTarget;

/// How well a channel is reproduced, over all recordings that were compared.
#[derive(Clone, Debug)]
pub struct FitFigure {
    /// FMU variable.
    pub channel: String,
    /// RMS(simulated - measured) / RMS(measured - its mean); `None` for a channel without variation.
    pub nrmse: Option<f64>,
    /// RMS(simulated - measured), in the channel's unit.
    pub rms: f64,
    /// Unit.
    pub unit: &'static str,
}

/// All that there is to say.
#[derive(Clone, Debug)]
pub struct Identified {
    /// Name of the model.
    pub model: String,
    /// The FMU's file, if it was fitted through one.
    pub fmu: Option<String>,
    /// Outputs of the model.
    pub outputs: Vec<PlantQuantity>,
    /// How.
    pub method: IdentifyMethod,
    /// What was requested.
    pub parameters: Vec<FoundParameter>,
    /// What is uncertain and was estimated along with it.
    pub uncertain: Vec<FoundParameter>,
    /// Recording by recording, in the order of training.
    pub nuisance: Vec<(String, Vec<FoundParameter>)>,
    /// On held-out recordings, or on those of the training where there are none.
    pub fit: Vec<FitFigure>,
    /// Whether `fit` is on held-out recordings.
    pub held_out: bool,
    /// The same with the nominal parameters.
    pub before: Vec<FitFigure>,
    /// The same with the model's own parameters fitted, without the effects that are fitted with them; empty: there are
    /// none.
    pub without: Vec<FitFigure>,
    /// Residuals of the training.
    pub channels: Vec<ChannelFit>,
    /// Training recordings against their simulation.
    pub training: Vec<ChannelComparison>,
    /// What `fit` was made from.
    pub compared: Vec<ChannelComparison>,
    /// Names of the recordings of `training` and of `compared`.
    pub names: [Vec<String>; 2],
    /// Correlation of parameters and uncertain ones, in their order.
    pub correlation: DMatrix<f64>,
    /// Directions that the data determine, of how many unknowns.
    pub rank: (usize, usize),
    /// Condition number of the scaled Jacobian.
    pub condition: f64,
    /// By how much of itself each estimate moves with what is assumed known.
    pub leverage: Leverage,
    /// Where the search began and what came of it; the first is where the solution came from.
    pub starts: Vec<SearchStart>,
    /// Why the search ended.
    pub stop: &'static str,
    /// Iterations, simulations of the simplex, or samples of the regression.
    pub iterations: usize,
    /// What the reader has to know.
    pub notes: Vec<String>,
    /// All parameters of the model, with the estimates in place.
    pub values: Vec<f64>,
    /// The model with the estimates, ready to be packed; none of an FMU.
    pub pack: Option<PackedModel>,
    /// What was found of sensors, the same in all recordings.
    pub sensors: Vec<(FitTarget, f64)>,
    /// What runs from other starts would identify, if that was requested.
    pub design: Option<Designed>,
}

/// What to do.
pub struct IdentifySettings<'a> {
    /// How.
    pub method: IdentifyMethod,
    /// Intervals by profile likelihood; else from standard errors.
    pub profile: bool,
    /// Also requests what runs from other starts would identify.
    pub design: Option<&'a ExperimentDesign>,
    /// Called with what is being done.
    pub progress: &'a (dyn Fn(&str) + Sync),
}
