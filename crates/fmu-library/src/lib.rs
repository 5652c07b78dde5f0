//! The shared library in every FMU: all models behind one set of FMI functions.
//!
//! FMI's function names are the same in every FMU, so a program can link them once only. Plants and controllers
//! therefore share this library; which one it is the packer writes into it (decision 0003).

use fmu_controller::Controller;
use fmu_plant::PlantModelTable;
pub use fmu_plant::{
    RequestedStructure, StructureOption, capture_of_design, choices, controller_of_design, of_arm, of_design,
    with_links,
};
use trueup_fmi::configuration::Configuration;
use trueup_fmi::table::ModelTable;
use trueup_fmi_export::FmuModel;
use trueup_fmi_export::reference::{ReferenceSeries, WORK, reference, response};
use trueup_numerics::hybrid::At;

/// Any model of the project.
#[derive(Clone, Debug)]
#[allow(clippy::large_enum_variant)]
pub enum AnyModel {
    /// Of `fmu-plant`.
    Plant(PlantModelTable),
    /// Of `fmu-controller`.
    Controller(Controller),
}

trueup_numerics::delegate_hybrid!(AnyModel { AnyModel::Plant(m) => m, AnyModel::Controller(m) => m });

impl FmuModel for AnyModel {
    fn build(c: &Configuration) -> Result<Self, String> {
        if fmu_controller::MODELS.contains(&c.model.as_str()) {
            Controller::build(c).map(Self::Controller)
        } else {
            PlantModelTable::build(c).map(Self::Plant)
        }
    }
    fn table(&self) -> ModelTable {
        match self {
            Self::Plant(m) => m.table(),
            Self::Controller(m) => m.table(),
        }
    }
    fn check(&self, p: &[f64]) -> Result<(), (usize, String)> {
        match self {
            Self::Plant(m) => m.check(p),
            Self::Controller(m) => m.check(p),
        }
    }
    fn watch(&self, at: At<'_, f64>, said: u32) -> Option<(u32, String)> {
        match self {
            Self::Plant(m) => m.watch(at, said),
            Self::Controller(m) => m.watch(at, said),
        }
    }
    fn long_step(&self, h: f64, p: &[f64]) -> Option<String> {
        match self {
            Self::Plant(m) => m.long_step(h, p),
            Self::Controller(m) => m.long_step(h, p),
        }
    }
    fn singular(&self, at: At<'_, f64>) -> Option<String> {
        match self {
            Self::Plant(m) => m.singular(at),
            Self::Controller(m) => m.singular(at),
        }
    }
    fn fixed_step(&self) -> Option<f64> {
        match self {
            Self::Plant(m) => m.fixed_step(),
            Self::Controller(m) => m.fixed_step(),
        }
    }
    fn remark(&self, p: &[f64]) -> Option<String> {
        match self {
            Self::Plant(m) => m.remark(p),
            Self::Controller(m) => m.remark(p),
        }
    }
}

/// From which sources this library is built: version, hash. A program packs libraries of its own stamp only.
pub const STAMP: &str = env!("TRUEUP_STAMP");

trueup_fmi_export::export_fmu!(AnyModel, STAMP);

/// The variable table of a configuration, its start values applied.
///
/// # Errors
/// The model, an effect, a structure or a start value that is not available, with the remedy.
pub fn table(c: &Configuration) -> Result<ModelTable, String> {
    let model = AnyModel::build(c)?;
    let mut table = model.table();
    table.apply(&c.start)?;
    model.check(&table.parameter_starts()).map_err(|(_, message)| message)?;
    // An FMU with effects is not the model that it is made from, and bears a name of its own.
    if !c.effects.is_empty() {
        let ids = c.effects.iter().map(|id| format!("+{}", id.replace(':', "-")));
        let title = format!("{}{}", table.name, ids.collect::<String>());
        table.description = format!("{title}: {}", table.description);
        table.title = Some(title);
    }
    Ok(table)
}

/// Inputs and outputs of the reference experiment of a configuration, run natively. What drives a robot that a file
/// describes is scaled so that each input accelerates it at its start as it does the model's own one.
///
/// # Errors
/// As [`table`]; a run that failed, or took more steps than can be waited for.
pub fn reference_result(c: &Configuration) -> Result<ReferenceSeries, String> {
    let schedule = fmu_plant::schedule(c).or_else(|| fmu_controller::schedule(&c.model)).unwrap_or_default();
    if !fmu_plant::is_robot(c) {
        return reference::<AnyModel>(c, schedule, usize::MAX);
    }
    let own = Configuration::of(&c.model);
    let mut scaled = schedule.to_vec();
    for (_, name, value) in &mut scaled {
        if let (Some(of_own), Some(of_this)) =
            (response::<AnyModel>(&own, name)?, response::<AnyModel>(c, name)?)
        {
            *value *= of_own / of_this;
        }
    }
    reference::<AnyModel>(c, &scaled, WORK)
}
