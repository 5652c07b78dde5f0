//! The integrator of Co-Simulation with its work space.

use crate::layout::Layout;
use crate::model::FmuModel;
use trueup_numerics::driver::{Driver, DriverMemory, DriverOptions, Solver};

/// Integrator with work space.
pub(crate) struct StepIntegrator {
    pub(crate) driver: Driver,
    pub(crate) memory: DriverMemory,
    pub(crate) t: f64,
    pub(crate) x: Vec<f64>,
    pub(crate) u: Vec<f64>,
    pub(crate) p: Vec<f64>,
    pub(crate) modes: Vec<i32>,
    pub(crate) slopes: Vec<f64>,
    /// States, inputs and modes at the start of the step.
    pub(crate) before: (Vec<f64>, Vec<f64>, Vec<i32>),
}

impl StepIntegrator {
    pub(crate) fn new<M: FmuModel>(layout: &Layout, model: &M) -> Self {
        let n = layout.sizes;
        let options = match model.fixed_step() {
            Some(max_step) => {
                DriverOptions { solver: Solver::FixedStiff, max_step, ..DriverOptions::default() }
            }
            None => DriverOptions { solver: Solver::Explicit, ..DriverOptions::default() },
        };
        Self {
            driver: Driver::new(n, &layout.nominals, options),
            memory: DriverMemory::default(),
            t: 0.0,
            x: vec![0.0; n.states],
            u: vec![0.0; n.inputs],
            p: vec![0.0; n.parameters],
            modes: vec![0; n.modes],
            slopes: vec![0.0; n.inputs],
            before: (vec![0.0; n.states], vec![0.0; n.inputs], vec![0; n.modes]),
        }
    }
}
