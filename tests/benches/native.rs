//! The same work without FMI: the model's own functions and the driver.

use super::importer::TOLERANCE;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::{ModelTable, Storage};
use trueup_models::arm::PlanarManipulator;
use trueup_models::joint::TwoMassJoint;
use trueup_models::space::{SpatialFreeFlyer, presets};
use trueup_numerics::driver::{Driver, DriverMemory, DriverOptions, DriverState, Flow, StepInputs};
use trueup_numerics::hybrid::{At, Hybrid};

pub trait Native {
    /// States (moved a little), derivatives.
    fn evaluate(&mut self, t: f64, move_by: f64) -> &[f64];
    /// Inputs, one step, outputs.
    fn step(&mut self, h: f64, input: f64) -> &[f64];
    /// One step, and nothing else.
    fn advance(&mut self, h: f64);
}

/// With the start values of the packed FMU's table.
pub fn native(name: &str) -> Box<dyn Native> {
    let configuration = Configuration { model: name.to_owned(), ..Configuration::default() };
    let table = fmu_library::table(&configuration).unwrap();
    match name {
        "TwoMassJoint" => Box::new(Run::new(TwoMassJoint::new::<&str>(true, &[]).unwrap(), &table)),
        "SpatialFreeFlyer" => {
            // What an FMU without a structure of its own is.
            let chaser = presets::chaser().structure();
            Box::new(Run::new(SpatialFreeFlyer::new(chaser).unwrap(), &table))
        }
        _ => Box::new(Run::new(PlanarManipulator::new::<&str>(&[true, false, false], &[]).unwrap(), &table)),
    }
}

struct Run<M> {
    model: M,
    driver: Driver,
    memory: DriverMemory,
    t: f64,
    x: Vec<f64>,
    moved: Vec<f64>,
    dx: Vec<f64>,
    u: Vec<f64>,
    p: Vec<f64>,
    y: Vec<f64>,
    modes: Vec<i32>,
}

impl<M: Hybrid> Run<M> {
    fn new(model: M, table: &ModelTable) -> Self {
        let n = model.sizes();
        let mut nominals = vec![1.0; n.states];
        for v in &table.variables {
            if let Storage::State(first) = v.storage {
                nominals[first..first + v.len()].fill(v.nominal.unwrap_or(1.0));
            }
        }
        let driver =
            Driver::new(n, &nominals, DriverOptions { tolerance: TOLERANCE, ..DriverOptions::default() });
        let mut run = Self {
            model,
            driver,
            memory: DriverMemory::default(),
            t: 0.0,
            x: vec![0.0; n.states],
            moved: vec![0.0; n.states],
            dx: vec![0.0; n.states],
            u: table.input_starts(),
            p: table.parameter_starts(),
            y: vec![0.0; n.outputs],
            modes: vec![0; n.modes],
        };
        let mut state = DriverState {
            t: &mut run.t,
            x: &mut run.x,
            u: &mut run.u,
            p: &run.p,
            modes: &mut run.modes,
            memory: &mut run.memory,
        };
        run.driver.initialise(&run.model, &mut state).unwrap();
        run
    }
}

impl<M: Hybrid> Native for Run<M> {
    fn evaluate(&mut self, t: f64, move_by: f64) -> &[f64] {
        self.moved.copy_from_slice(&self.x);
        self.moved[0] += move_by;
        let at = At { t, x: &self.moved, u: &self.u, p: &self.p, modes: &self.modes };
        self.model.rates(at, &mut self.dx);
        &self.dx
    }
    fn step(&mut self, h: f64, input: f64) -> &[f64] {
        self.u.fill(input);
        self.advance(h);
        let at = At { t: self.t, x: &self.x, u: &self.u, p: &self.p, modes: &self.modes };
        self.model.outputs(at, &mut self.y);
        &self.y
    }
    fn advance(&mut self, h: f64) {
        let end = self.t + h;
        let mut state = DriverState {
            t: &mut self.t,
            x: &mut self.x,
            u: &mut self.u,
            p: &self.p,
            modes: &mut self.modes,
            memory: &mut self.memory,
        };
        let observer = &mut |_: trueup_numerics::driver::DriverView| Flow::Continue;
        self.driver.advance_to(&self.model, &mut state, end, StepInputs::Hold, observer).unwrap();
    }
}
