//! The shared library in every FMU: all models behind one set of FMI functions.
//!
//! FMI's function names are the same in every FMU, so a program can link them once only. Plants and controllers
//! therefore share this library; which one it is the packer writes into it (decision 0003).

use fmu_controller::Controller;
use fmu_plant::Plant;
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_fmi_export::reference::{Reference, reference};
use trueup_numerics::Scalar;
use trueup_numerics::event::Direction;
use trueup_numerics::hybrid::{At, Hybrid, Sizes, Update};

/// Any model of the project.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum Model {
    /// Of `fmu-plant`.
    Plant(Plant),
    /// Of `fmu-controller`.
    Controller(Controller),
}

macro_rules! each {
    ($model:expr, $m:ident => $body:expr) => {
        match $model {
            Model::Plant($m) => $body,
            Model::Controller($m) => $body,
        }
    };
}

impl Hybrid for Model {
    fn sizes(&self) -> Sizes {
        each!(self, m => m.sizes())
    }
    fn start<T: Scalar>(&self, p: &[T], x: &mut [T]) {
        each!(self, m => m.start(p, x));
    }
    fn start_modes(&self, at: At<f64>, modes: &mut [i32]) {
        each!(self, m => m.start_modes(at, modes));
    }
    fn rates<T: Scalar>(&self, at: At<T>, dx: &mut [T]) {
        each!(self, m => m.rates(at, dx));
    }
    fn outputs<T: Scalar>(&self, at: At<T>, y: &mut [T]) {
        each!(self, m => m.outputs(at, y));
    }
    fn indicators<T: Scalar>(&self, at: At<T>, z: &mut [T]) {
        each!(self, m => m.indicators(at, z));
    }
    fn direction(&self, indicator: usize) -> Direction {
        each!(self, m => m.direction(indicator))
    }
    fn update(&self, t: f64, x: &mut [f64], u: &[f64], p: &[f64], modes: &mut [i32]) -> Update {
        each!(self, m => m.update(t, x, u, p, modes))
    }
    fn next_event(&self, p: &[f64], modes: &[i32]) -> Option<f64> {
        each!(self, m => m.next_event(p, modes))
    }
}

impl FmuModel for Model {
    fn build(c: &Configuration) -> Result<Self, String> {
        if fmu_controller::MODELS.contains(&c.model.as_str()) {
            Controller::build(c).map(Self::Controller)
        } else {
            Plant::build(c).map(Self::Plant)
        }
    }
    fn table(&self) -> ModelTable {
        each!(self, m => m.table())
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        each!(self, m => m.check(p))
    }
}

trueup_fmi_export::export_fmu!(Model);

/// The variable table of a configuration, its start values applied.
///
/// # Errors
/// The model, an effect, a structure or a start value that cannot be had, with the mend.
pub fn table(c: &Configuration) -> Result<ModelTable, String> {
    let model = Model::build(c)?;
    let mut table = model.table();
    table.apply(&c.start)?;
    model.check(&table.parameter_starts()).map_err(|(_, message)| message)?;
    Ok(table)
}

/// Inputs and outputs of the reference experiment of a configuration, run natively.
///
/// # Errors
/// As [`table`]; a run that failed.
pub fn reference_result(c: &Configuration) -> Result<Reference, String> {
    let schedule = fmu_plant::schedule(&c.model).or_else(|| fmu_controller::schedule(&c.model));
    reference::<Model>(c, schedule.unwrap_or_default())
}
