//! What an FMU does when it is moved. All values in SI.
//!
//! For Model Exchange: its equations linearised at its start, and at points nearby with inputs that overcome friction. For
//! Co-Simulation: runs from its start, with and without a step of each input.

mod directional;
mod exchange;
mod gear;
mod state;
mod steps;

use std::sync::Arc;

use trueup_fmi_import::{ImportError, UnpackedFmu, UsedInterface};

use crate::error::PortsError;
use crate::kind::PortKind;
use crate::quantity::{FmuQuantities, FmuQuantity};

pub use directional::DirectionalComparison;
pub use gear::GearFit;

/// Rows of a matrix.
pub type SensitivityRows = Vec<Vec<f64>>;

/// Outputs over points or along runs.
#[derive(Clone, Debug)]
pub(crate) enum ObservedMotion {
    /// Outputs, and their derivatives by time with the inputs held, at points.
    Points(Vec<[Vec<f64>; 2]>),
    /// Outputs at evenly spaced times; the step in s.
    Paths(Vec<(f64, SensitivityRows)>),
}

/// The FMU at its start: derivatives by its states.
#[derive(Clone, Debug)]
pub(crate) struct RestPoint {
    /// Of the outputs.
    pub(crate) outputs: SensitivityRows,
    /// Of the outputs' derivatives by time.
    pub(crate) flows: SensitivityRows,
}

/// What the FMU offers, and whether it holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FmuCapabilities {
    /// Continuous states, and those that move a rate or an output.
    pub states: [usize; 2],
    /// Event indicators.
    pub indicators: usize,
    /// It declares directional derivatives.
    pub directional: bool,
    /// Compared with differences of the equations; or why they are not.
    pub directional_error: Option<Result<DirectionalComparison, String>>,
    /// It declares that its state can be stored.
    pub fmu_state: bool,
    /// A restored state continues bit by bit as the first time; or why not.
    pub fmu_state_restored: Option<Result<bool, String>>,
}

/// Results of the experiments.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// Which interface was used.
    pub interface: UsedInterface,
    /// What it offers.
    pub offers: FmuCapabilities,
    /// d(dy/dt)/du of outputs by inputs, at each point where it was measured.
    pub mobilities: Vec<SensitivityRows>,
    /// dy/du.
    pub direct: SensitivityRows,
    /// Step of each input that moves something; `None`: none did.
    pub amplitudes: Vec<Option<f64>>,
    /// Co-Simulation: outputs answer an input's step one communication step late.
    pub late: Vec<bool>,
    pub(crate) motion: ObservedMotion,
    pub(crate) rest: Option<RestPoint>,
    /// For each input the run with its step alone (Co-Simulation).
    pub(crate) alone: Vec<Option<(f64, SensitivityRows)>>,
}

/// Inputs that may drive something: by their kind, or all where no kind is known.
pub(crate) fn effort(q: &FmuQuantity) -> bool {
    matches!(q.kind, PortKind::Torque | PortKind::Force | PortKind::Current)
}
/// Outputs that may be velocities.
pub(crate) fn velocity(q: &FmuQuantity) -> bool {
    matches!(q.kind, PortKind::AngularVelocity | PortKind::Velocity)
}

impl Experiment {
    /// Moves the FMU by this interface. It runs where the caller has put it ([`UnpackedFmu::isolate`]).
    ///
    /// # Errors
    /// A call that failed, with its name.
    pub fn run(fmu: &Arc<UnpackedFmu>, all: &FmuQuantities, by: UsedInterface) -> Result<Self, PortsError> {
        let mut found = match by {
            UsedInterface::ModelExchange => exchange::run(fmu, all)?,
            UsedInterface::CoSimulation => steps::run(fmu, all)?,
        };
        state::check(fmu, all, by, &mut found.offers);
        Ok(found)
    }

    /// Two matrix elements that are equal but for errors of the experiment differ by less, relative to their size
    /// (docs/decisions/0088-ports-by-reciprocity.md, also the next one).
    pub fn tolerance(&self) -> f64 {
        match self.interface {
            UsedInterface::ModelExchange => 1e-5,
            UsedInterface::CoSimulation => 1e-2,
        }
    }

    /// A derivative that differs by more is of something else.
    pub fn derivative_tolerance(&self) -> f64 {
        match self.interface {
            UsedInterface::ModelExchange => 1e-5,
            UsedInterface::CoSimulation => 1e-2,
        }
    }

    /// Relative size of the difference between the derivative of output `q` and output `v`; `None`: neither moved.
    pub fn derivative_error(&self, q: usize, v: usize) -> Option<f64> {
        match &self.motion {
            ObservedMotion::Points(points) => relative(points.iter().map(|[y, flow]| (flow[q], y[v]))),
            ObservedMotion::Paths(paths) => {
                // An FMU may advance by either end of its step.
                let rules: [fn(f64, f64) -> f64; 3] = [|a, _| a, |_, b| b, |a, b| f64::midpoint(a, b)];
                let by = |rule: &fn(f64, f64) -> f64| {
                    relative(paths.iter().flat_map(|(h, rows)| {
                        rows.windows(2).map(move |w| ((w[1][q] - w[0][q]) / h, rule(w[0][v], w[1][v])))
                    }))
                };
                rules.iter().filter_map(by).min_by(f64::total_cmp)
            }
        }
    }

    /// Two outputs are one: their derivatives by states, or their runs, are equal.
    pub(crate) fn same(&self, a: usize, b: usize) -> bool {
        let equal = |pairs: &mut dyn Iterator<Item = (f64, f64)>| relative(pairs).is_none_or(|e| e < 1e-6);
        let moved = match &self.motion {
            ObservedMotion::Points(points) => equal(&mut points.iter().map(|[y, _]| (y[a], y[b]))),
            ObservedMotion::Paths(paths) => {
                equal(&mut paths.iter().flat_map(|(_, rows)| rows.iter().map(|y| (y[a], y[b]))))
            }
        };
        moved && self.mobilities.iter().all(|m| equal(&mut m[a].iter().copied().zip(m[b].iter().copied())))
    }
}

/// Root mean square of the differences, relative to that of the larger ones of each pair.
fn relative(pairs: impl IntoIterator<Item = (f64, f64)>) -> Option<f64> {
    let (mut difference, mut size) = (0.0, 0.0);
    for (a, b) in pairs {
        difference += (a - b) * (a - b);
        size += a.abs().max(b.abs()).powi(2);
    }
    (size > 0.0).then(|| (difference / size).sqrt())
}

pub(crate) fn failed(fmu: &UnpackedFmu) -> impl Fn(ImportError) -> PortsError {
    let file = fmu.file().display().to_string();
    move |error| PortsError::Call { file: file.clone(), error: Box::new(error) }
}
